//! Stand-in for what lang will have.
pub(crate) mod binary {
    use opentmcl_wire::Command;
    pub(crate) fn encode(commands: impl Iterator<Item = Command>) -> Vec<u8> {
        commands
            .flat_map(|c| {
                let mut r = [0; 8];
                r[..3].copy_from_slice(&[c.number, c.kind, c.motor]);
                r[3..7].copy_from_slice(&c.value.to_be_bytes());
                r[7] = r[..7].iter().fold(0u8, |a, b| a.wrapping_add(*b));
                r
            })
            .collect()
    }
    #[derive(Debug)]
    pub(crate) struct BadRecord {
        pub(crate) number: usize,
    }
    impl std::fmt::Display for BadRecord {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "record {}: bad", self.number)
        }
    }
    pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<Command>, Vec<BadRecord>> {
        let mut commands = Vec::new();
        let mut bad = Vec::new();
        for (number, record) in bytes.chunks(8).enumerate() {
            match record {
                &[opcode, kind, motor, a, b, c, d, sum]
                    if sum == record[..7].iter().fold(0u8, |a, b| a.wrapping_add(*b)) =>
                {
                    commands.push(Command::new(
                        opcode,
                        kind,
                        motor,
                        i32::from_be_bytes([a, b, c, d]),
                    ));
                }
                _ => bad.push(BadRecord { number }),
            }
        }
        if bad.is_empty() { Ok(commands) } else { Err(bad) }
    }
}
pub(crate) mod listing {
    use opentmcl_lang::Assembly;
    pub(crate) fn listing(assembly: &Assembly) -> String {
        assembly.commands().map(|c| format!("{c}\n")).collect()
    }
    pub(crate) fn symbols(assembly: &Assembly) -> String {
        assembly.labels().map(|l| format!("{} {}\n", l.name, l.address)).collect()
    }
}
pub(crate) mod disassemble {
    use opentmcl_catalog::Module;
    use opentmcl_wire::Command;
    pub(crate) struct Disassembly<'a> {
        pub(crate) module: Option<&'static Module>,
        pub(crate) title: Option<&'a str>,
    }
    pub(crate) fn disassemble(commands: &[Command], options: &Disassembly<'_>) -> String {
        let _ = options.module;
        let mut s: String = options.title.map(|t| format!("// {t}\n")).unwrap_or_default();
        s.extend(commands.iter().map(|c| format!("{c}\n")));
        s
    }
}
pub(crate) mod format {
    use opentmcl_lang::tree::Tree;
    pub(crate) fn format(tree: &Tree) -> String {
        tree.text().lines().map(|l| format!("{}\n", l.trim_end())).collect()
    }
}
