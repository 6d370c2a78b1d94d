//! Several ports, and time.

use opentmcl_firmware::{Line, Module, Port};
use opentmcl_wire::serial::encode_reply;
use opentmcl_wire::{Instant, Outgoing};

use crate::bench::*;

#[test]
fn on_rs485_replies_keep_the_telegram_pause_and_the_echo_does_not() {
    let mut bench = Bench::new();
    bench.execute("SGP 75, 0, 20");
    bench.enter(RS485);
    assert_eq!(bench.type_in(RS485, "AMST 1\r"), "AMST 1\r");
    bench.wait_ms(19);
    assert_eq!(bench.shown(RS485), "");
    // What is typed before the reply is shown behind it.
    assert_eq!(bench.type_in(RS485, "AM"), "");
    assert_eq!(bench.module.poll_at(), Some(Instant::from_ticks(20 * MILLISECOND)));
    bench.wait_ms(1);
    assert_eq!(bench.shown(RS485), "BA 100 0\rAM");
    assert_eq!(bench.type_in(RS485, "ST 2\r"), "ST 2\r");
}

#[test]
fn with_the_pause_139_is_still_answered_before_anything_is_echoed() {
    let mut bench = Bench::new();
    bench.execute("SGP 75, 0, 20");
    bench.send(RS485, ASCII);
    assert_eq!(bench.type_in(RS485, "AM"), "");
    bench.wait_ms(20);
    let reply = encode_reply(2, 1, ok(ASCII).unwrap());
    assert_eq!(bench.module.transmit(bench.now), Some((RS485, Outgoing::Frame(reply))));
    assert_eq!(bench.shown(RS485), "AM");
}

/// Ports of a kind.
fn ports<const COUNT: usize>(line: Line) -> [Port; COUNT] {
    std::array::from_fn(|number| Port { line, number: number as u8 })
}

#[test]
fn four_ports_can_type_at_the_same_time() {
    let mut bench = Bench::new();
    bench.execute("SGP 67, 0, 33");
    bench.module.power_cycle(bench.now);
    let ports: [Port; 4] = ports(Line::Usb);
    for (at, _) in "AMST 1\r".char_indices() {
        for (number, port) in ports.iter().enumerate() {
            let key = format!("AMST {number}\r").as_bytes()[at];
            let shown = bench.type_in(*port, [key]);
            assert_eq!(shown, if key == b'\r' { "BA 100 0\r" } else { "" });
        }
    }
    // A line that is finished makes room for another port, however long ago another one began.
    bench.type_in(ports[0], "A");
    for port in self::ports::<20>(Line::Rs232) {
        assert_eq!(bench.type_in(port, "AMST 3\r"), "BA 100 0\r");
    }
    assert_eq!(bench.type_in(ports[0], "MST 3\r"), "BA 100 0\r");
}

#[test]
fn of_five_lines_at_the_same_time_the_one_left_alone_for_longest_is_lost() {
    let mut bench = Bench::new();
    bench.execute("SGP 67, 0, 33");
    bench.module.power_cycle(bench.now);
    let ports: [Port; 5] = ports(Line::Usb);
    ports[..4].iter().for_each(|port| drop(bench.type_in(*port, "AMS")));
    bench.type_in(ports[0], "T");
    bench.type_in(ports[4], "AMST");
    for (port, rest) in [(0, " 0\r"), (2, "T 0\r"), (3, "T 0\r"), (4, " 0\r")] {
        assert_eq!(bench.type_in(ports[port], rest), "BA 100 0\r", "{port}");
    }
    assert_eq!(bench.type_in(ports[1], "T 0\r"), "", "for nobody, as it begins with T");
}

#[test]
fn a_connection_that_takes_the_place_of_another_begins_anew() {
    for start in [32, 33] {
        let mut bench = Bench::new();
        bench.execute(&format!("SGP 67, 0, {start}"));
        bench.module.power_cycle(bench.now);
        let starts_in_ascii = start == 33;
        if starts_in_ascii {
            bench.type_in(RS232, "ABIN\r");
        } else {
            bench.enter(RS232);
            bench.type_in(RS232, "AMST ");
        }
        assert_ne!(bench.module.is_in_ascii_mode(RS232), starts_in_ascii);
        bench.module.hang_up(RS232);
        assert_eq!(bench.module.is_in_ascii_mode(RS232), starts_in_ascii);
        if !starts_in_ascii {
            bench.enter(RS232);
        }
        assert_eq!(bench.type_in(RS232, "AMST 0\r"), "BA 100 0\r");
    }
}

#[test]
fn asking_more_often_changes_no_byte() {
    /// All bytes of each port with their times. Between two keys the module is asked when it wants to be,
    /// every `step` ticks too, or never.
    fn record(at_events: bool, step: Option<u64>) -> Vec<(u64, Port, u8)> {
        let mut bench = Bench::new();
        bench.execute("SGP 75, 0, 7");
        for command in ["132 0, 0, 0", "CALC ADD, 1", "AGP 0, 2", "JA 0", "133 0, 0, 0"] {
            bench.execute(command);
        }
        bench.send(USB, ASCII);
        bench.send(RS485, ASCII);
        let mut log = Vec::new();
        let mut collect = |module: &mut Module<Memory>, now: u64| {
            while let Some((port, content)) = module.transmit(Instant::from_ticks(now)) {
                log.extend(content.as_bytes().iter().map(|&byte| (now, port, byte)));
            }
        };
        let keys = "ARUN\rAGGP 0, 2\rAFLY\rAMVP ABS, 0, 0\rBMST 1\rAGGP 0, 2\rASTOP\rABIN\r";
        let mut now = 0;
        // A key at other times on each of the ports, some at the same time.
        let mut keys: Vec<_> = [(USB, 9_000), (RS485, 13_500)]
            .into_iter()
            .flat_map(|(port, period)| (1..).map(move |at| (at * period, port)).zip(keys.bytes()))
            .collect();
        keys.sort_by_key(|&((time, _), _)| time);
        for ((time, port), key) in keys.into_iter().chain([((2_000_000, USB), 0)]) {
            loop {
                let event = bench.module.poll_at().filter(|_| at_events);
                let event = event.map(|event| event.as_ticks().max(now));
                let next = event.into_iter().chain(step.map(|step| now + step)).min();
                let Some(next) = next.filter(|&next| next < time) else { break };
                now = next;
                bench.module.poll(Instant::from_ticks(now));
                collect(&mut bench.module, now);
            }
            now = time;
            bench.module.receive_key(port, key, Instant::from_ticks(now));
            collect(&mut bench.module, now);
        }
        log
    }
    let once = record(true, None);
    assert!(once.len() > 150, "{}", once.len());
    for step in [1_600, 1_601, 7_919] {
        assert_eq!(record(true, Some(step)), once, "{step}");
    }
    // Then what waits for the telegram pause is fetched late.
    let never = record(false, None);
    for port in [USB, RS485] {
        let bytes = |log: &[(u64, Port, u8)]| -> Vec<u8> {
            log.iter().filter(|(_, by, _)| *by == port).map(|&(_, _, byte)| byte).collect()
        };
        assert_eq!(bytes(&never), bytes(&once));
    }
}
