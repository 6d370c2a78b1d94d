//! Programs of several files: where files are looked for, how many there may be, and which of them a
//! finding is about.

use opentmcl_lang::include::{Found, Sources};
use opentmcl_lang::{Assembly, Options, assemble};

/// Each finding as `text that it is about | code | message | help`.
fn findings(assembly: &Assembly) -> Vec<String> {
    let one = |diagnostic: &opentmcl_lang::Diagnostic| {
        let help = diagnostic.help.as_deref().unwrap_or("-");
        let text = assembly.text(diagnostic.location);
        format!("{text} | {} | {} | {help}", diagnostic.code.name(), diagnostic.message)
    };
    assembly.diagnostics.iter().map(one).collect()
}

#[test]
fn only_the_first_thousand_findings_are_told() {
    for line in
        ["FOO\n", "L:\n", "= 1\n", "COMP (\n", "#include\n", "#include many.tmc\n", "A = 1/0\n"]
    {
        let assembly = including(&line.repeat(5000));
        assert_eq!(assembly.diagnostics.len(), 1001, "{line}");
        let last = assembly.diagnostics.last().unwrap();
        assert_eq!(last.message, "there are more than 1000 findings");
    }
    // Of exactly so many none is left out, and still nobody knows.
    assert_eq!(including(&"FOO\n".repeat(999)).diagnostics.len(), 999);
}

/// Two files that include each other, and one that is not there.
struct Circle;

impl Sources for Circle {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        let text = match name {
            "a.tmc" => "A = 1\n#include b.tmc\n",
            "b.tmc" => "B = 2\n#include a.tmc\n",
            "twice.tmc" => "#include <b2.tmc>\n#include \"b2.tmc\"\n",
            "b2.tmc" => "B2 = 2\n",
            "bad.tmc" => "COMP (1 2)\nHome: A = 2\nA: A = 2",
            "many.tmc" => return Found::File { name: name.into(), text: "= 1\n".repeat(700) },
            "locked.tmc" => return Found::Unreadable("no permission".into()),
            _ => return Found::Nothing,
        };
        Found::File { name: name.into(), text: text.into() }
    }
}

fn including(text: &str) -> Assembly {
    assemble("main.tmc", text, &mut Circle, Options::default())
}

#[test]
fn a_circular_include_is_told_at_the_line_that_closes_the_circle() {
    let assembly = including("#include a.tmc\nROR A, B");
    assert_eq!(
        findings(&assembly),
        [
            "a.tmc | circular-include | a.tmc includes itself | remove this line, or move what both need \
         into a file of its own",
        ]
    );
    assert_eq!(assembly.file(assembly.diagnostics[0].location.file).name, "b.tmc");
    assert_eq!(assembly.instructions[0].command.value, 2);
}

#[test]
fn a_missing_include_is_told_at_its_line() {
    assert_eq!(
        findings(&including("MST 0\n#include gone.tmc // x")),
        ["gone.tmc | include-not-found | there is no file gone.tmc | it is looked for beside the \
         including file, in the include folders, and among the built-in files",]
    );
    assert_eq!(
        findings(&including("#include TCMLParam.tmc")),
        ["TCMLParam.tmc | include-not-found | there is no file TCMLParam.tmc | did you mean \
         TMCLParam.tmc?",]
    );
    assert_eq!(
        findings(&including("#include")),
        [
            "#include | include-not-found | #include without the name of a file | write for example: \
         #include TMCLParam.tmc",
        ]
    );
    assert_eq!(
        findings(&including("#include locked.tmc")),
        ["locked.tmc | include-not-found | cannot read locked.tmc: no permission | -",]
    );
}

#[test]
fn the_same_constants_may_be_included_twice() {
    let assembly = including("#include twice.tmc\nROR B2, 1");
    assert_eq!(findings(&assembly), [] as [&str; 0]);
    assert_eq!(assembly.files.len(), 4);
}

#[test]
fn a_finding_names_the_file_that_it_is_in() {
    let assembly = including("Home: MST 0\nA = 1\n#include bad.tmc\nA:");
    let name = |location: opentmcl_lang::Location| assembly.file(location.file).name.as_str();
    let found: Vec<_> = assembly
        .diagnostics
        .iter()
        .map(|finding| {
            let related = finding.related.as_ref().map_or("-", |(location, _)| name(*location));
            (finding.code.name(), name(finding.location), related)
        })
        .collect();
    let expected = [
        ("duplicate-label", "main.tmc", "bad.tmc"),
        ("unexpected-text", "bad.tmc", "-"),
        ("duplicate-label", "bad.tmc", "main.tmc"),
        ("redefined-constant", "bad.tmc", "main.tmc"),
        ("redefined-constant", "bad.tmc", "main.tmc"),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_file_is_looked_for_from_the_file_that_includes_it() {
    struct Asked(Vec<(String, String)>);
    impl Sources for Asked {
        fn find(&mut self, name: &str, from: &str) -> Found {
            self.0.push((name.into(), from.into()));
            match name {
                "a" => Found::File { name: "folder/a".into(), text: "#include b".into() },
                _ => Found::Nothing,
            }
        }
    }
    let mut asked = Asked(Vec::new());
    let assembly =
        assemble("main", "#include a\n#include Interrupts.inc", &mut asked, Options::default());
    let pairs = [("a", "main"), ("b", "folder/a"), ("Interrupts.inc", "main")];
    assert_eq!(asked.0, pairs.map(|(name, from)| (name.to_owned(), from.to_owned())));
    let files: Vec<_> = assembly.files.iter().map(|file| (&*file.name, file.built_in)).collect();
    assert_eq!(files, [("main", false), ("folder/a", false), ("Interrupts.inc", true)]);
}

/// Files of blanks, as many as their name says.
struct Blanks {
    asked: usize,
}

impl Sources for Blanks {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        self.asked += 1;
        match name.parse() {
            Ok(length) => Found::File { name: name.into(), text: " ".repeat(length) },
            Err(_) => Found::Nothing,
        }
    }
}

#[test]
fn all_files_together_have_the_length_that_one_may_have() {
    let mut sources = Blanks { asked: 0 };
    let mut codes = |text: &str| -> Vec<_> {
        let assembly = assemble("main", text, &mut sources, Options::default());
        assembly.diagnostics.iter().map(|finding| finding.code.name()).collect()
    };
    let main = "#include 1234567\n".len();
    let rest = opentmcl_lang::MAX_TEXT - main;
    assert_eq!(codes(&format!("#include {rest}\n")), [""; 0]);
    assert_eq!(codes(&format!("#include {}\n", rest + 1)), ["too-much-text"]);
    let half = rest / 2 + 1;
    assert_eq!(codes(&format!("#include {half}\n#include {half}\n")), ["too-much-text"]);
}

#[test]
fn no_more_files_are_looked_for_than_a_program_may_have() {
    for name in ["main", "gone", "3", "tmcm-6214.inc"] {
        let mut sources = Blanks { asked: 0 };
        let text = format!("#include {name}\n").repeat(500);
        let assembly = assemble("main", text, &mut sources, Options::default());
        assert_eq!(sources.asked, 255, "{name}");
        assert_eq!(assembly.diagnostics.last().unwrap().code.name(), "too-much-text", "{name}");
    }
}

#[test]
fn files_that_include_each_other_twice_come_to_an_end() {
    /// Each file includes the next one twice: 2^1000 files.
    struct Bomb;
    impl Sources for Bomb {
        fn find(&mut self, name: &str, _from: &str) -> Found {
            let next = name.parse::<u32>().unwrap_or(0) + 1;
            let text = format!("#include {next}\n#include {next}\n");
            Found::File { name: name.into(), text }
        }
    }
    let assembly = assemble("main.tmc", "#include 1", &mut Bomb, Options::default());
    assert_eq!(assembly.files.len(), 256);
    assert!(!assembly.is_valid());
}
