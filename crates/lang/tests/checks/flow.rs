//! Where programs go.

use std::time::{Duration, Instant};

use opentmcl_lang::{Code, Options, assemble, check, include::BuiltInOnly};

use crate::{assembly, said, tells};

#[track_caller]
fn flow(text: &str) {
    tells(text, true, None);
}

#[test]
fn jumps_to_where_the_program_is_not() {
    flow(
        "Start: JC ZE, 12   //! jump-outside-program
        CSUB 10             //! jump-outside-program
        CALL NZ, -1         //! jump-outside-program
        DJNZ 0, 7
        DJNZ 0, $FFFF       //! jump-outside-program
        VECT 0, 2048        //! jump-outside-program, interrupt-not-enabled
        RST End             //! jump-outside-program
        JA Start
        STOP
        STOP
        End:",
    );
    assert_eq!(
        said("JA End\nSTOP\nEnd:", None),
        ["End | there is no command at address 2 (End) | that is right behind the last command; \
          write STOP there"]
    );
    assert_eq!(
        said("JA 7", None),
        ["7 | there is no command at address 7 | the program has the addresses 0..1"]
    );
}

#[test]
fn a_program_that_runs_beyond_its_last_command() {
    for (text, append_stop) in [
        ("MST 0", true),
        ("MST 0 //! runs-off-the-end", false),
        ("Loop: MST 0\nDJNZ 0, Loop //! runs-off-the-end", false),
        ("Loop: MST 0\nJC ZE, Loop\nJA Loop", false),
        ("JA Last\nSub: RSUB\nLast: CALL ZE, Sub //! runs-off-the-end", false),
        ("RSUB //! return-without-call, runs-off-the-end", false),
        ("JA Last\nSub: RSUB\nLast: CSUB Sub //! runs-off-the-end", false),
        ("", false),
    ] {
        tells(text, append_stop, None);
    }
}

#[test]
fn code_that_nothing_leads_to() {
    flow(
        "JA Start
        MST 0         //! unreachable-code
        MST 1
        Used: MST 2
        STOP
        MST 3         //! unreachable-code
        RSUB
        Start: CSUB Used2
        JC ZE, Used
        RST Start
        MST 4         //! unreachable-code
        Unused: MST 5 //! unreferenced-code
        CSUB Helper
        JA Unused
        Helper: MST 6
        RSUB
        MST 7         //! unreachable-code
        Used2: RSUB",
    );
    assert_eq!(
        said("Loop: JA Loop\nMST 1\nMST 2", None),
        [
            "MST 1 | nothing leads to these commands | remove all 3, or give them a label by which they \
          are reached"
        ]
    );
    assert_eq!(
        said("Loop: JA Loop\nFree: MST 1", None),
        [
            "MST 1 | nothing in the program leads to Free | only a host that starts at address 1 comes \
          here"
        ]
    );
}

#[test]
fn code_that_only_unused_code_leads_to_is_not_told_twice() {
    flow(
        "Loop: JA Loop
        Inner: MST 0
        RSUB
        Outer: CSUB Inner //! unreferenced-code
        RSUB
        // A circle of its own.
        Round: MST 1      //! unreferenced-code
        JA Round",
    );
}

#[test]
fn a_customary_end_behind_what_never_ends_is_no_dead_code() {
    flow("Loop: MST 0\nJA Loop\nSTOP");
    flow("CSUB Sub\nEntry: JA Entry\nSub: RST Entry\nRSUB");
    flow("Loop: JA Loop\nDone: STOP");
}

#[test]
fn a_row_of_jumps_at_the_beginning_is_for_hosts() {
    // Firmware manual 7.6.
    flow("JA A\nB: JA B2\nJA C\nA: STOP\nB2: STOP\nC: MST 0\nSTOP");
    // One jump is a jump.
    flow("JA A\nMST 0 //! unreachable-code\nA: STOP");
}

#[test]
fn calls_deeper_than_the_stack() {
    // 3.6.18: the stack holds eight addresses.
    let chain = |count: usize, mark: &str| {
        let mut text = "CSUB S1\nSTOP\n".to_owned();
        for number in 1..count {
            let mark = if number == 8 { mark } else { "" };
            text += &format!("S{number}: CSUB S{} {mark}\nRSUB\n", number + 1);
        }
        text + &format!("S{count}: RSUB\n")
    };
    flow(&chain(8, ""));
    flow(&chain(9, "//! calls-too-deep"));
    flow(&chain(12, "//! calls-too-deep"));
    assert_eq!(
        said(&chain(9, ""), None),
        [
            "CSUB S9 | this call is ignored: it would be level 9 | there are 8 levels; S1 > S2 > S3 > \
          S4 > S5 > S6 > S7 > S8 > S9"
        ]
    );
}

#[test]
fn the_longest_of_several_ways_counts() {
    // S8 is called directly and at the end of a chain.
    let mut text = "CALL ZE, S8\nVECT 0, Handler\nEI 0\nEI 255\nSTOP\n".to_owned();
    for number in 1..8 {
        text += &format!("S{number}: CALL NZ, S{}\nRSUB\n", number + 1);
    }
    text += "S8: MST 0\nCSUB S9 //! calls-too-deep\nRSUB\nS9: RSUB\nHandler: CSUB S1\nRETI";
    flow(&text);
}

#[test]
fn subroutines_that_are_called_again_before_they_return() {
    flow("CSUB A\nSTOP\nA: CALL ZE, A //! recursive-call\nRSUB");
    flow("CSUB A\nSTOP\nA: CSUB B\nRSUB\nB: CALL NZ, A //! recursive-call\nRSUB");
    flow("CSUB A\nSTOP\nA: CALL ZE, A //! recursive-call\nCALL NZ, A\nRSUB");
    // A subroutine that is left by a jump has not returned.
    flow("Main: CSUB A //! recursive-call\nJA Main\nA: JC ZE, Main\nRSUB");
    // RST gives up all calls.
    flow("Main: CSUB A\nJA Main\nA: JC ZE, Again\nRSUB\nAgain: RST Main");
    // The same subroutine from many places, one after the other, is no recursion.
    flow("CSUB A\nCSUB B\nCSUB A\nSTOP\nA: CSUB B\nRSUB\nB: RSUB");
}

#[test]
fn returns_without_a_call() {
    flow("MST 0\nSub: MST 1\nRSUB //! return-without-call\nCSUB Sub");
    flow("CSUB Sub\nJC ZE, Sub\nSTOP\nSub: RSUB //! return-without-call");
    flow("CSUB Sub\nSTOP\nSub: RSUB");
    // RST has given up the call.
    flow("CSUB A\nSTOP\nA: RST B\nB: RSUB //! return-without-call");
    // The subroutine never returns: nothing comes to the second one that way.
    flow("CSUB Sub\nSub2: MST 0\nRSUB\nSub: MST 1\nCSUB Sub2\nSTOP");
}

/// With what all handlers need.
fn with_handler(rest: &str) -> String {
    format!("VECT 3, Handler\nEI 3\nEI 255\n{rest}")
}

#[test]
fn handlers_that_do_not_end_as_handlers_do() {
    let flow = |rest: &str| flow(&with_handler(rest));
    flow("Loop: JA Loop\nHandler: MST 0\nRETI");
    flow("Loop: JA Loop\nHandler: JC ZE, Out\nMST 0\nOut: RETI");
    flow("Loop: JA Loop\nHandler: MST 0\nSTOP");
    flow("Loop: JA Loop\nHandler: RST Loop");
    flow("Loop: JA Loop\nHandler: MST 0\nRSUB //! rsub-in-handler");
    flow("Loop: JA Loop\nHandler: CSUB Sub\nRETI\nSub: RSUB");
    flow("Loop: JA Loop\nHandler: MST 0 //! handler-without-reti\nJA Loop");
    flow("Loop: JA Loop\nHandler: CSUB Sub //! handler-without-reti\nJA Handler\nSub: RSUB");
}

#[test]
fn a_handler_that_runs_beyond_the_program_ends_with_it() {
    let text = with_handler("Loop: JA Loop\nHandler: MST 0 //! runs-off-the-end");
    tells(&text, false, None);
}

#[test]
fn of_several_labels_at_one_place_the_first_is_named() {
    assert_eq!(
        said("CSUB Second\nSTOP\nFirst:\nSecond:\nThird: CALL ZE, Third\nRSUB", None),
        [
            "CALL ZE, Third | First is called again before it has returned | each turn takes one of 8 \
          levels, and calls beyond are ignored; leave a subroutine by RSUB, or begin anew by RST"
        ]
    );
}

#[test]
fn a_subroutine_of_a_handler_does_not_end_the_handler() {
    let flow = |rest: &str| flow(&with_handler(rest));
    flow(
        "Loop: JA Loop\nHandler: CSUB Sub\nRETI\nSub: JC ZE, Out\nRSUB\nOut: RETI //! reti-in-subroutine",
    );
    flow(
        "Loop: JA Loop\nHandler: CSUB A\nRETI\nA: CSUB B\nRSUB\nB: JC ZE, Out\nRSUB\nOut: RETI //! reti-in-subroutine",
    );
    flow("Loop: JA Loop\nHandler: JC ZE, Out\nCSUB Sub\nOut: RETI\nSub: RSUB");
    // One subroutine for both is told of once.
    flow("CSUB Sub\nSTOP\nHandler: CSUB Sub\nRETI\nSub: RETI //! reti-outside-handler");
}

#[test]
fn ways_into_a_handler_that_are_no_interrupt() {
    let flow = |rest: &str| flow(&with_handler(rest));
    flow("MST 0\nHandler: MST 1 //! falls-into-handler\nRETI");
    flow("CSUB Sub\nHandler: RETI //! falls-into-handler\nSub: RSUB");
    flow("CSUB Never\nHandler: RETI\nNever: STOP");
    flow("JC ZE, Handler\nSTOP\nHandler: MST 1\nRETI //! reti-outside-handler");
    flow("CSUB Sub\nSTOP\nHandler: RETI\nSub: MST 1\nRETI //! reti-outside-handler");
    // A handler that names its successor (PyTrinamic's test program does).
    flow("Loop: JA Loop\nHandler: VECT 3, Second\nRETI\nSecond: VECT 3, Handler\nRETI");
    assert_eq!(
        said(&with_handler("MST 0\nHandler: MST 1\nRETI"), None),
        [
            "MST 1 | the program runs into the handler Handler | end by STOP or JA what stands before \
          it"
        ]
    );
}

#[test]
fn interrupts_of_which_one_half_is_missing() {
    flow("VECT 0, H //! interrupt-not-enabled\nVECT 0, H\nEI 255\nSTOP\nH: RETI");
    flow("VECT 0, H //! interrupt-not-enabled\nEI 0\nSTOP\nH: RETI");
    flow("EI 255\nEI 1 //! interrupt-without-vector\nVECT 0, H\nEI 0\nSTOP\nH: RETI");
    assert_eq!(
        said("VECT 0, H\nEI 0\nSTOP\nH: RETI", None),
        ["0 | interrupt 0 is never enabled | the program lacks EI 255"]
    );
    assert_eq!(
        said("EI 2\nSTOP", None),
        ["2 | interrupt 2 has no handler | VECT 2, <label> names one"]
    );
}

#[test]
fn waiting_for_a_switch_without_a_time_out() {
    flow(
        "WAIT REFSW, 0, 0 //! wait-without-time-out
        WAIT LIMSW, 0, 0  //! wait-without-time-out
        WAIT LIMSW, 0, 1
        WAIT REFSW, 0, -1
        WAIT POS, 0, 0
        WAIT RFS, 0, 0
        WAIT TICKS, 0, 0",
    );
}

#[test]
fn programs_longer_than_program_memory() {
    let program = |count: usize| "MST 0\n".repeat(count);
    flow(&program(2047));
    flow(&format!("{}STOP", program(2047)));
    // With STOP there are 2049 commands; the last one that is written is the one to blame.
    flow(&format!("{}MST 1 //! program-too-long", program(2047)));
    flow(&format!("{}MST 1 //! program-too-long\nMST 2", program(2048)));
}

#[test]
fn an_incomplete_program_is_not_followed() {
    let text = "JA Nowhere\nMST 0\nEI 7";
    let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options::default());
    let findings = check::findings(&assembly, None);
    let codes: Vec<_> = findings.iter().map(|finding| finding.code).collect();
    assert_eq!(codes, [Code::UnknownLabel]);
}

#[test]
fn only_the_first_thousand_findings_are_told_and_silenced_ones_do_not_count() {
    let text = format!(
        "// tmcl-allow-file: wait-without-time-out\n{}{}",
        "WAIT REFSW, 0, 0\n".repeat(2000),
        "JA -1\n".repeat(2000)
    );
    let assembly = assembly(&text, true);
    let findings = check::findings(&assembly, None);
    assert_eq!(findings.len(), 1001);
    assert_eq!(findings.iter().filter(|one| one.code == Code::TooManyFindings).count(), 1);
}

#[test]
fn a_hundred_thousand_commands_take_no_time() {
    // All subroutines call the next one and jump about: many ways, all of them deep.
    let mut text = "CSUB S0\nSTOP\n".to_owned();
    let count = 25_000;
    for number in 0..count {
        let (next, before) = (number + 1, number / 2);
        text += &format!("S{number}: CALL ZE, S{next}\nJC NZ, S{before}\nDJNZ 0, S{next}\nRSUB\n");
    }
    text += &format!("S{count}: RSUB\n");
    let assembly = assembly(&text, true);
    let start = Instant::now();
    let findings = check::findings(&assembly, None);
    assert!(!findings.is_empty());
    // It takes some hundredths; what is not linear would take minutes.
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
}
