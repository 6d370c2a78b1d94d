//! Which ports are in ASCII mode, and since when.

use opentmcl_catalog::TMCM_6214;
use opentmcl_firmware::{Answer, Line, Port};
use opentmcl_wire::{Command, Status, control};

use crate::bench::*;

#[test]
fn command_139_is_answered_with_a_frame_and_bin_with_text() {
    let mut bench = Bench::new();
    assert!(!bench.module.is_in_ascii_mode(USB));
    assert_eq!(bench.ask(USB, ASCII), ok(ASCII));
    assert!(bench.module.is_in_ascii_mode(USB));
    // The manual's reply to a question for a position.
    assert_eq!(bench.type_in(USB, "ASAP 1, 3, -5000\r"), "ASAP 1, 3, -5000\rBA 100 -5000\r");
    assert_eq!(bench.type_in(USB, "a gap 1, 3\r"), "a gap 1, 3\rBA 100 -5000\r");
    assert_eq!(bench.type_in(USB, "ABIN\r"), "ABIN\rBA 100 0\r");
    assert!(!bench.module.is_in_ascii_mode(USB));
    assert_eq!(bench.ask(USB, PING), ok(PING));
}

#[test]
fn each_port_has_its_own_mode() {
    let mut bench = Bench::new();
    bench.execute("SGP 75, 0, 0");
    let lines = [Line::Usb, Line::Rs485, Line::Rs232];
    let ports = lines.map(|line| [0, 1, 63, 64, 255].map(|number| Port { line, number }));
    for entered in ports.iter().flatten() {
        assert_eq!(bench.ask(*entered, ASCII), ok(ASCII));
        for port in ports.iter().flatten() {
            assert_eq!(bench.module.is_in_ascii_mode(*port), port == entered);
            if port != entered {
                assert_eq!(bench.ask(*port, PING), ok(PING));
            }
        }
        assert_eq!(bench.type_in(*entered, "ABIN\r"), "ABIN\rBA 100 0\r");
    }
}

#[test]
fn frames_for_a_port_in_ascii_mode_and_keys_for_another_are_not_answered() {
    let mut bench = Bench::silent(USB);
    assert_eq!(bench.ask(USB, PING), None);
    assert_eq!(bench.execute("GGP 0, 2"), 0);
    assert_eq!(bench.type_in(RS232, "AMST 0\r"), "");
    assert_eq!(bench.ask(RS232, PING), ok(PING));
}

#[test]
fn with_bit_0_of_parameter_67_a_module_starts_in_ascii_mode_on_all_ports() {
    let every = || (0..=255).map(|number| Port { line: Line::Rs485, number }).chain([USB, RS232]);
    let mut bench = Bench::new();
    bench.execute("SGP 67, 0, 33");
    assert!(every().all(|port| !bench.module.is_in_ascii_mode(port)), "from the next start on");
    for reset in [false, true] {
        if reset {
            bench
                .module
                .execute_direct(Command::new(control::SOFTWARE_RESET, 0, 0, 1234), bench.now);
        } else {
            bench.module.power_cycle(bench.now);
        }
        assert!(every().all(|port| bench.module.is_in_ascii_mode(port)));
        assert_eq!(bench.type_in(USB, "ABIN\r"), "BA 100 0\r");
        assert!(every().all(|port| bench.module.is_in_ascii_mode(port) == (port != USB)));
        assert_eq!(bench.ask(USB, PING), ok(PING));
        assert_eq!(bench.ask(USB, ASCII), ok(ASCII));
        assert!(every().all(|port| bench.module.is_in_ascii_mode(port)));
        bench.type_in(USB, "ABIN\r");
    }
    bench.execute("SGP 67, 0, 32");
    bench.module.power_cycle(bench.now);
    assert!(every().all(|port| !bench.module.is_in_ascii_mode(port)));
}

#[test]
fn a_restart_forgets_mode_and_line() {
    let mut bench = Bench::silent(USB);
    bench.type_in(USB, "AROR 0, 1");
    bench.module.power_cycle(bench.now);
    assert!(!bench.module.is_in_ascii_mode(USB));
    bench.enter(USB);
    assert_eq!(bench.type_in(USB, "AMST 0\r"), "BA 100 0\r");
}

#[test]
fn a_module_without_the_ascii_interface_does_not_know_it() {
    let mut bench = Bench::of(&TMCM_6214);
    assert_eq!(bench.ask(USB, ASCII).unwrap().status, Status::INVALID_COMMAND);
    assert!(!bench.module.is_in_ascii_mode(USB));
}

#[test]
fn a_module_without_letter_refuses_139_and_starts_in_binary_mode() {
    for (address, has_letter) in [(26, true), (27, false), (255, false)] {
        let mut bench = Bench::new();
        bench.execute("SGP 67, 0, 33");
        bench.execute(&format!("SGP 66, 0, {address}"));
        let status = if has_letter { Status::OK } else { Status::NOT_AVAILABLE };
        assert_eq!(bench.ask(USB, ASCII).unwrap().status, status);
        assert_eq!(bench.module.is_in_ascii_mode(USB), has_letter);
        bench.module.power_cycle(bench.now);
        assert_eq!(bench.module.is_in_ascii_mode(USB), has_letter);
        if has_letter {
            assert_eq!(bench.type_in(USB, "ZMST 5\r"), "BZ 100 0\r");
        }
    }
}

#[test]
fn without_a_port_there_is_nothing_to_switch() {
    let mut bench = Bench::new();
    let Answer::Reply(reply) = bench.module.execute_direct(ASCII, bench.now) else { panic!() };
    assert_eq!(reply.status, Status::NOT_AVAILABLE);
}
