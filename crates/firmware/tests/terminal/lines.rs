//! What is typed, and what comes back.

use opentmcl_firmware::{Answer, Board};
use opentmcl_wire::ascii::LINE_MAX;
use opentmcl_wire::serial::encode_reply;
use opentmcl_wire::{Command, Outgoing, Reply, Status, control, mnemonic};

use crate::bench::*;

#[test]
fn the_echo_is_as_bits_4_and_5_of_parameter_67_say() {
    let typed = "AMST 12\x08\r";
    for (parameter, echo) in
        [(0x00, "AMST 12\x08 \x08\r"), (0x10, "AMST 1\r"), (0x20, ""), (0x30, "")]
    {
        let mut bench = Bench::new();
        bench.enter(USB);
        bench.execute(&format!("SGP 67, 0, {parameter}"));
        assert_eq!(bench.type_in(USB, typed), format!("{echo}BA 100 0\r"), "{parameter}");
        assert_eq!(bench.type_in(USB, "BMST 0\r\n"), "", "for another module");
    }
}

#[test]
fn the_longest_lines_are_echoed_whole_though_nobody_fetches_the_echo_meanwhile() {
    for parameter in [0x00, 0x10] {
        let mut bench = Bench::new();
        bench.enter(USB);
        bench.execute(&format!("SGP 67, 0, {parameter}"));
        let line = format!("{:LINE_MAX$}\r", "AMST 1");
        let long = format!("{:width$}\r", "AMST 1", width = LINE_MAX + 1);
        for (keys, status) in [(&line, 100), (&long, 2)] {
            for &key in [keys.as_bytes(); 2].concat().iter() {
                bench.module.receive_key(USB, key, bench.now);
            }
            let answered = format!("{keys}BA {status} 0\r");
            assert_eq!(bench.shown(USB), answered.repeat(2));
        }
    }
}

#[test]
fn addresses_of_host_and_module_are_the_letters_of_a_reply() {
    let mut bench = Bench::silent(USB);
    bench.execute("SGP 76, 0, 8");
    bench.execute("SGP 66, 0, 3");
    bench.execute("SGP 87, 0, 4");
    assert_eq!(bench.type_in(USB, "AMST 0\r"), "");
    assert_eq!(bench.type_in(USB, "DMST 0\r"), "", "the secondary address");
    assert_eq!(bench.type_in(USB, "CMST 0\r"), "HC 100 0\r");
}

#[test]
fn refused_commands_and_lines_that_cannot_be_read_have_their_status() {
    let mut bench = Bench::silent(USB);
    for (line, reply) in [
        ("AMST 6\r", "BA 4 0\r"),
        ("ASAP 4, 0, 9999999\r", "BA 4 9999999\r"),
        ("AGAP 255, 0\r", "BA 3 0\r"),
        ("AMVP FAST, 0, 1\r", "BA 3 0\r"),
        ("AFLY 0\r", "BA 2 0\r"),
        ("AUF0\r", "BA 6 0\r"),
        ("A137 0, 0, 1234\r", "BA 2 0\r"),
    ] {
        assert_eq!(bench.type_in(USB, line), reply, "{line}");
    }
}

#[test]
fn run_and_stop_control_the_program() {
    let mut bench = Bench::new();
    for command in ["132 0, 0, 0", "SGP 0, 2, 5", "WAIT TICKS, 0, 10", "JA 1", "133 0, 0, 0"] {
        bench.execute(command);
    }
    bench.enter(USB);
    bench.execute("SGP 67, 0, 32");
    assert_eq!(bench.type_in(USB, "ARUN\r"), "BA 100 0\r");
    bench.wait_ms(1000);
    assert_eq!(bench.type_in(USB, "AGGP 0, 2\r"), "BA 100 5\r");
    assert_eq!(bench.execute("GGP 128, 0"), 1);
    assert_eq!(bench.type_in(USB, "ASTOP\r"), "BA 100 0\r");
    assert_eq!(bench.execute("GGP 128, 0"), 0);
    assert_eq!(bench.type_in(USB, "ARUN 1\r"), "BA 100 1\r");
    assert_eq!(bench.execute("GGP 128, 0"), 1);
}

#[test]
fn while_a_program_is_downloaded_lines_are_stored() {
    let mut bench = Bench::silent(USB);
    bench.execute("132 0, 0, 7");
    assert_eq!(bench.type_in(USB, "AROR 2, 300\r"), "BA 101 300\r");
    bench.execute("133 0, 0, 0");
    let stored =
        bench.module.execute_direct(Command::new(control::READ_PROGRAM, 0, 0, 7), bench.now);
    assert_eq!(stored, Answer::Memory(mnemonic::parse("ROR 2, 300").unwrap()));
}

#[test]
fn without_replies_only_questions_are_answered() {
    let mut bench = Bench::new();
    bench.enter(USB);
    bench.execute("SGP 255, 0, 1");
    assert_eq!(bench.type_in(USB, "AMST 1\r"), "AMST 1\r");
    assert_eq!(bench.type_in(USB, "AFLY\r"), "AFLY\r");
    assert_eq!(bench.type_in(USB, "AGGP 255, 0\r"), "AGGP 255, 0\rBA 100 1\r");
    assert_eq!(bench.type_in(USB, "ABIN\r"), "ABIN\r");
    assert!(!bench.module.is_in_ascii_mode(USB));
}

#[test]
fn arrivals_are_reported_in_the_form_that_the_port_has_by_then() {
    const X_ACTUAL: u8 = 0x01;
    let report = Command::new(control::POSITION_REPORT, 1, 0, 0b11);
    let mut bench = Bench::new();
    assert_eq!(bench.ask(USB, report), ok(report));
    assert_eq!(bench.ask(USB, ASCII), ok(ASCII));
    bench.execute("SGP 67, 0, 32");
    // An axis that stands there already arrives at once, after the reply.
    assert_eq!(bench.type_in(USB, "AMVP ABS, 0, 0\r"), "BA 100 0\rBA 128 1\r");
    assert_eq!(bench.type_in(USB, "AMVP ABS, 1, 500\r"), "BA 100 500\r");
    bench.wait_ms(10);
    assert_eq!(bench.shown(USB), "");
    bench.module.board_mut().write_register(1, X_ACTUAL, 500);
    bench.module.hardware_changed(bench.now);
    assert_eq!(bench.shown(USB), "BA 128 2\r");

    bench.type_in(USB, "AMVP ABS, 1, 600\r");
    bench.type_in(USB, "ABIN\r");
    bench.module.board_mut().write_register(1, X_ACTUAL, 600);
    bench.module.hardware_changed(bench.now);
    let (port, content) = bench.module.transmit(bench.now).unwrap();
    let arrived = Reply { status: Status::DELAYED, number: control::POSITION_REPORT, value: 2 };
    assert_eq!((port, content), (USB, Outgoing::Frame(encode_reply(2, 1, arrived))));
}

#[test]
fn a_line_that_asks_something_keeps_the_heartbeat_going_and_no_other_does() {
    for (line, keeps) in [
        ("AGAP 1, 0\r", true),
        ("ABIN\r", true),
        ("AFLY\r", false),
        ("BMST 5\r", false),
        ("AMST 5", false),
    ] {
        let mut bench = Bench::silent(USB);
        bench.execute("SGP 68, 0, 100");
        bench.execute("MVP ABS, 2, 300");
        bench.wait_ms(60);
        bench.type_in(USB, line);
        bench.wait_ms(60);
        // Ramp mode 0 is a move to a position, 2 a rotation, to which a stop changes.
        assert_eq!(bench.execute("GAP 138, 2"), if keeps { 0 } else { 2 }, "{line}");
    }
}
