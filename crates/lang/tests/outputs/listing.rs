//! Listings and symbol files.

use opentmcl_lang::include::{Found, Sources};
use opentmcl_lang::{Options, assemble, listing, symbols};

use super::assembled;

/// Files in memory.
struct Files(&'static [(&'static str, &'static str)]);

impl Sources for Files {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        let file = self.0.iter().find(|(known, _)| *known == name);
        file.map_or(Found::Nothing, |&(name, text)| Found::File {
            name: name.into(),
            text: text.into(),
        })
    }
}

/// So that a listing in a test may begin in a line of its own.
#[track_caller]
fn lists(found: &str, expected: &str) {
    assert_eq!(found, expected.trim_start_matches('\n'));
}

#[test]
fn a_listing_shows_each_line_and_what_became_of_it() {
    let text = "\
// Spin for ever
Speed = 2 * 25600
Third = 1/3

Loop: ROR 0, Speed   // start
\tWAIT TICKS, 0, 100
  JA loop
";
    let assembly = assemble("spin.tmc", text, &mut Files(&[]), Options { append_stop: true });
    // $01 + $C8 = $C9; $1B + $64 = $7F.
    lists(
        &listing(&assembly),
        "
address  record                   line  source
                                     1  // Spin for ever
         = 51200                     2  Speed = 2 * 25600
         = 0.3333333333333333        3  Third = 1/3
                                     4
      0  01 00 00 00 00 C8 00 C9     5  Loop: ROR 0, Speed   // start
      1  1B 00 00 00 00 00 64 7F     6  \tWAIT TICKS, 0, 100
      2  16 00 00 00 00 00 00 16     7    JA loop
      3  1C 00 00 00 00 00 00 1C        STOP  // appended
",
    );
}

#[test]
fn included_lines_stand_where_they_are_included() {
    let files =
        Files(&[("axes.inc", "X = 0\n#include deep.inc\nMST X\n"), ("deep.inc", "MST 5 // deep")]);
    let mut files = files;
    let text = "#include Interrupts.inc\n#include axes.inc\nEI TI_GLOBAL\n#include none.inc\nSTOP";
    let assembly = assemble("main.tmc", text, &mut files, Options::default());
    lists(
        &listing(&assembly),
        "
address  record                         line  source
                                  main.tmc:1  #include Interrupts.inc
                                  main.tmc:2  #include axes.inc
         = 0                      axes.inc:1  X = 0
                                  axes.inc:2  #include deep.inc
      0  03 00 05 00 00 00 00 08  deep.inc:1  MST 5 // deep
      1  03 00 00 00 00 00 00 03  axes.inc:3  MST X
      2  19 FF 00 00 00 00 00 18  main.tmc:3  EI TI_GLOBAL
                                  main.tmc:4  #include none.inc
      3  1C 00 00 00 00 00 00 1C  main.tmc:5  STOP
",
    );
}

#[test]
fn a_file_that_is_included_twice_is_listed_twice() {
    let mut files = Files(&[("wait.inc", "WAIT POS, 0, 0\n")]);
    let text = "#include wait.inc\nMST 0\n#include wait.inc\n";
    let assembly = assemble("main.tmc", text, &mut files, Options { append_stop: false });
    let addresses: Vec<_> = listing(&assembly)
        .lines()
        .filter(|line| line.contains("WAIT POS"))
        .map(|line| line.trim_start().split(' ').next().unwrap_or_default().to_owned())
        .collect();
    assert_eq!(addresses, ["0", "2"]);
}

#[test]
fn a_huge_or_tiny_constant_is_listed_with_an_exponent() {
    let text = listing(&assembled("a = 10^300\nb = -10^-300\nc = 0\nd = 1/0\ne = -2.5\n"));
    let values: Vec<_> = text.lines().skip(1).map(|line| line[9..32].trim_end()).collect();
    assert_eq!(values, ["= 1e300", "= -1e-300", "= 0", "", "= -2.5"]);
}

#[test]
fn an_empty_program_lists_its_stop() {
    let assembly = assemble("empty.tmc", "", &mut Files(&[]), Options { append_stop: true });
    lists(
        &listing(&assembly),
        "
address  record                   line  source
      0  1C 00 00 00 00 00 00 1C        STOP  // appended
",
    );
}

#[test]
fn symbols_come_by_address_and_keep_their_order_there() {
    let text = "Main: Again: JA End\nStop_All: MST 0\nzero: JA Main\nEnd:";
    let expected = "Main = 0\nAgain = 0\nStop_All = 1\nzero = 2\nEnd = 3\n";
    assert_eq!(symbols(&assembled(text)), expected);
}

#[test]
fn a_symbol_file_may_be_included_by_another_program() {
    let text = symbols(&assembled("MST 0\nGo: MST 1\nHalt: STOP"));
    let assembly = assembled(&format!("{text}JA Halt\nJA Go"));
    let addresses: Vec<_> = assembly.commands().map(|command| command.value).collect();
    assert_eq!(addresses, [2, 1]);
}
