//! Any bytes as a program's source: no panic in anything that looks at it, nothing lost, and what it
//! means is the same after formatting, and after a binary and a disassembly.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_lang::encoding::{decode, encode};
use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::service::Service;
use opentmcl_lang::span::Span;
use opentmcl_lang::tree::Tree;
use opentmcl_lang::{
    Assembly, Disassembly, FileId, Options, assemble, binary, check, disassemble, format, listing,
    symbols,
};

const OPTIONS: Options = Options { append_stop: false };
const MAIN: FileId = FileId(0);

fn assembly(text: &str) -> Assembly {
    assemble("fuzz.tmc", text, &mut BuiltInOnly, OPTIONS)
}

/// What a program means: its commands and labels.
fn meaning(assembly: &Assembly) -> impl PartialEq + std::fmt::Debug {
    let labels: Vec<_> =
        assembly.labels().map(|label| (label.name.to_owned(), label.address)).collect();
    (assembly.commands().collect::<Vec<_>>(), labels)
}

fn look_at_all_of_it(assembly: &Assembly, offset: u32) {
    let module = opentmcl_catalog::find("tmcm-6214");
    for module in [None, module] {
        let findings = check::findings(assembly, module);
        for finding in &findings {
            let file = assembly.file(finding.location.file);
            let Span { start, end } = finding.location.span;
            assert!(start <= end && end as usize <= file.tree.text().len(), "{finding:?}");
            assert!(!finding.message.is_empty());
        }
        let service = Service { assembly, module };
        service.completion(MAIN, offset);
        service.hover(MAIN, offset);
        service.definition(MAIN, offset);
        service.references(MAIN, offset);
        service.highlights(MAIN, offset);
        let _ = service.rename(MAIN, offset, "Other");
        service.hints(MAIN, Span::new(0, u32::MAX));
        service.symbols(MAIN);
        service.semantic_tokens(MAIN);
    }
    listing(assembly);
    symbols(assembly);
}

fuzz_target!(|input: (u16, &[u8])| {
    let (offset, bytes) = input;
    let (text, encoding) = decode(bytes);
    assert_eq!(encode(&text, encoding).as_deref(), Some(bytes));

    let assembly = assembly(&text);
    look_at_all_of_it(&assembly, u32::from(offset));

    let formatted = format(&Tree::parse(text.as_str()));
    let reread = self::assembly(&formatted);
    assert_eq!(format(&Tree::parse(formatted.as_str())), formatted);
    if !assembly.is_valid() {
        return;
    }
    assert_eq!(meaning(&reread), meaning(&assembly));
    let commands: Vec<_> = assembly.commands().collect();
    let bytes = binary::encode(commands.iter().copied());
    assert_eq!(binary::decode(&bytes).as_ref(), Ok(&commands));
    let back = self::assembly(&disassemble(&commands, &Disassembly::default()));
    assert!(back.commands().eq(commands));
});
