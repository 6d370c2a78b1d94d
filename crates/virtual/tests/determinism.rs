//! A run is a function of its inputs: asking the module in between changes nothing.

use std::ops::ControlFlow;

use opentmcl_virtual::{Executed, Line, Port, VirtualModule};
use opentmcl_wire::{Command, Duration, Instant, mnemonic, serial};

/// What happens to the module from outside.
enum Input {
    Request(Line, &'static str),
    Level(u8, bool),
}

/// A program with moves, a timer, an input interrupt, subroutines, waits and random numbers.
const PROGRAM: &[&str] = &[
    "VECT 0, 24",
    "VECT 39, 27",
    "VECT 3, 30",
    "SGP 0, 3, 7",
    "SGP 39, 3, 3",
    "EI 0",
    "EI 39",
    "EI 3",
    "EI 255",
    "SGP 10, 2, 0",
    "MVP ABS, 0, 51200", // 10
    "MVP REL, 1, 3000",
    "CSUB 20",
    "WAIT POS, 1, 0",
    "MVP ABS, 0, -200",
    "WAIT POS, 0, 37",
    "JC ETO, 18",
    "JA 10",
    "CLE ETO", // 18
    "JA 10",
    "GGP 133, 0", // 20
    "CALC MOD, 100",
    "AGP 12, 2",
    "RSUB",
    "CALCV ADD, 0, 1", // 24: timer
    "GIO 0, 1",
    "RETI",
    "GIO 255, 0", // 27: input
    "SIO 255, 2, -1",
    "RETI",
    "CALCV ADD, 3, 1", // 30: position reached
    "WAIT TICKS, 0, 2",
    "RETI",
];

/// A program that calculates without end and looks at a motor now and then: whatever else happens has
/// to find its moment between two of its commands.
const BUSY_PROGRAM: &[&str] = &[
    "VECT 0, 10",
    "SGP 0, 3, 1234",
    "EI 0",
    "EI 255",
    "ROR 0, 51200",
    "SGP 1, 2, 700", // 5
    "CALC ADD, 3",
    "DJNZ 1, 6",
    "GAP 1, 0",
    "JA 5",
    "AGP 0, 2", // 10: timer
    "RETI",
];

/// Ramps that are tick by tick, currents on a grid, soft approaches, limits that change on the way.
const TICKED_PROGRAM: &[&str] = &[
    "VECT 0, 28",
    "VECT 3, 32",
    "SGP 0, 3, 7",
    "EI 0",
    "EI 3",
    "EI 255", // 5
    "SAP 154, 0, 3",
    "SAP 153, 0, 7",
    "SAP 5, 0, 100",
    "SAP 154, 1, 5",
    "SAP 153, 1, 4", // 10
    "SAP 5, 1, 37",
    "SAP 200, 0, 200",
    "SAP 182, 0, 300",
    "SAP 204, 1, 20",
    "SAP 214, 1, 3", // 15
    "MVP ABS, 0, 51200",
    "MVP REL, 1, 3000",
    "WAIT POS, 1, 0",
    "SAP 138, 1, 1",
    "SAP 0, 1, 100", // 20
    "GAP 180, 0",
    "AGP 14, 2",
    "MVP ABS, 0, -200",
    "WAIT POS, 0, 37",
    "ROR 1, 700", // 25
    "WAIT TICKS, 0, 13",
    "JA 16",
    "GGP 10, 2", // 28: timer
    "CALC ADD, 1",
    "AGP 0, 2",
    "RETI",
    "GGP 11, 2", // 32: position reached
    "CALC ADD, 1",
    "AGP 3, 2",
    "RETI",
];

/// Encoder and regulators, with speeds, positions and torques that follow each other before the axis has settled.
const FIELD_ORIENTED_PROGRAM: &[&str] = &[
    "SAP 12, 0, 1000",
    "SAP 56, 0, 4096",
    "SAP 104, 0, 300",
    "SAP 101, 0, 1",
    "SAP 15, 0, 3",
    "WAIT TICKS, 0, 50", // 5
    "ROR 0, 700",
    "WAIT TICKS, 0, 33",
    "GAP 31, 0",
    "AGP 0, 2",
    "MVP REL, 0, 3000", // 10
    "WAIT POS, 0, 150",
    "GAP 52, 0",
    "AGP 3, 2",
    "SAP 30, 0, -300",
    "WAIT TICKS, 0, 7", // 15
    "MST 0",
    "WAIT POS, 0, 20",
    "JA 6",
];

/// The same by halls alone.
const BLOCK_PROGRAM: &[&str] = &[
    "ROR 0, 700",
    "WAIT TICKS, 0, 33",
    "GAP 150, 0",
    "AGP 0, 2",
    "MVP REL, 0, 30",
    "WAIT POS, 0, 150", // 5
    "GAP 1, 0",
    "AGP 3, 2",
    "SAP 155, 0, -300",
    "WAIT TICKS, 0, 7",
    "MST 0", // 10
    "WAIT TICKS, 0, 20",
    "JA 0",
];

/// A module, what runs on it for how long, and two speed limits that it gets again and again.
#[derive(Clone, Copy)]
struct Story {
    model: &'static str,
    program: &'static [&'static str],
    limits: [&'static str; 2],
    seconds: u64,
}

const MOVING: Story = Story {
    model: "tmcm-6214",
    program: PROGRAM,
    limits: ["SAP 4, 0, 40000", "SAP 4, 0, 70000"],
    seconds: 60,
};
const BUSY: Story = Story { program: BUSY_PROGRAM, ..MOVING };
const TICKED: Story = Story {
    model: "tmcm-6110",
    program: TICKED_PROGRAM,
    limits: ["SAP 4, 0, 700", "SAP 4, 0, 1900"],
    seconds: 60,
};
const FIELD_ORIENTED: Story = Story {
    model: "tmcm-1636",
    program: FIELD_ORIENTED_PROGRAM,
    limits: ["SAP 43, 0, 900", "SAP 43, 0, 2000"],
    seconds: 6,
};
const BLOCK: Story = Story {
    model: "tmcm-1613",
    program: BLOCK_PROGRAM,
    limits: ["SAP 4, 0, 900", "SAP 4, 0, 2000"],
    seconds: 6,
};
const STORIES: [Story; 5] = [MOVING, BUSY, TICKED, FIELD_ORIENTED, BLOCK];

fn millis(time: u64) -> Instant {
    Instant::from_ticks(time * 16_000)
}

fn scenario(story: Story) -> Vec<(Instant, Input)> {
    let Story { program, limits: [low, high], seconds, .. } = story;
    let usb = |time, text| (millis(time), Input::Request(Line::Usb, text));
    let rs485 = |time, text| (millis(time), Input::Request(Line::Rs485, text));
    let mut inputs = vec![usb(0, "132 0, 0, 0")];
    inputs.extend(program.iter().map(|&text| usb(1, text)));
    inputs.extend([
        usb(2, "133 0, 0, 0"),
        usb(2, "SGP 75, 0, 3"),
        usb(3, "138 1, 0, 3"),
        usb(4, "129 1, 0, 0"),
    ]);
    for second in 0..seconds {
        let at = second * 1000;
        inputs.extend([
            rs485(at + 10, "GAP 1, 0"),
            usb(at + 15, "GAP 3, 1"),
            (millis(at + 170), Input::Level(0, second % 2 == 0)),
            rs485(at + 333, "GGP 0, 2"),
            usb(at + 400, low),
            usb(at + 500, "GIO 255, 2"),
            usb(at + 501, "GGP 130, 0"),
            usb(at + 502, "135 2, 0, 0"),
            usb(at + 700, high),
            rs485(at + 910, "GGP 3, 2"),
        ]);
    }
    let end = seconds * 1000;
    inputs.push(usb(end + 1000, "SGP 68, 0, 100"));
    // Where the axis stands tells when the heartbeat stopped it.
    inputs.push(rs485(end + 5000, "GAP 1, 0"));
    inputs.push(rs485(end + 5001, "GAP 3, 0"));
    // Late enough that the replies before it have been sent, telegram pause included.
    inputs.push(usb(end + 6000, "GGP 0, 2"));
    inputs
}

/// When the module is asked between two inputs.
enum Times<'a> {
    /// Never: it has to catch up in one go.
    Never,
    /// Whenever it wants to be.
    AtEvents,
    /// Then, and at other times besides.
    AndAt(&'a mut dyn FnMut(Instant) -> Instant),
    /// Whenever it wants to be, with somebody who watches the program and may break off.
    Watched(&'a mut dyn FnMut(&Executed) -> ControlFlow<()>),
}

/// Lets time pass until then; collects also where a watcher breaks off.
fn advance(
    module: &mut VirtualModule,
    until: Instant,
    times: &mut Times<'_>,
    collect: &mut impl FnMut(&mut VirtualModule),
) {
    if let Times::Watched(watcher) = times {
        while module.advance_watched(until, &mut **watcher).is_break() {
            collect(module);
        }
    } else {
        module.advance_to(until);
    }
}

/// Everything the module sends, with the time, as `time line: bytes`.
fn record(story: Story, mut times: Times<'_>) -> Vec<String> {
    let mut module = VirtualModule::new(opentmcl_catalog::find(story.model).unwrap());
    let mut log = Vec::new();
    let mut collect = |module: &mut VirtualModule| {
        while let Some((port, content)) = module.transmit() {
            let frame = content.frame().unwrap();
            log.push(format!("{} {:?}: {frame:02X?}", module.now().as_ticks(), port.line));
        }
    };
    let scenario = scenario(story);
    for (time, input) in scenario {
        loop {
            let event = module.next_event();
            let next = match &mut times {
                Times::Never => None,
                Times::AtEvents | Times::Watched(_) => event,
                Times::AndAt(extra) => {
                    let extra = extra(module.now());
                    Some(event.map_or(extra, |event| event.min(extra)))
                }
            };
            let Some(next) = next.filter(|&next| next < time) else { break };
            advance(&mut module, next, &mut times, &mut collect);
            collect(&mut module);
        }
        advance(&mut module, time, &mut times, &mut collect);
        match input {
            Input::Request(line, text) => {
                let command: Command = mnemonic::parse(text).unwrap();
                module.receive(Port::new(line), Ok(serial::Request { address: 1, command }));
            }
            Input::Level(input, level) => module.set_digital_input(input, level),
        }
        collect(&mut module);
    }
    log
}

#[test]
fn asking_more_often_changes_no_byte() {
    for story in STORIES {
        compare(story);
    }
}

fn compare(story: Story) {
    let once = record(story, Times::AtEvents);
    assert!(once.len() as u64 > story.seconds * 8, "{}", once.len());
    for seed in 1..4u64 {
        let mut random = seed;
        let mut asked = Instant::from_ticks(0);
        let often = record(
            story,
            Times::AndAt(&mut |now| {
                if asked <= now {
                    random =
                        random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    asked = now + Duration::from_ticks(1 + (random >> 33) % 200_000);
                }
                asked
            }),
        );
        assert_same(&once, &often);
    }
    // Without a look in between, frames are the same; only the time of their collection is not.
    let untimed = |log: Vec<String>| -> Vec<String> {
        log.iter().filter_map(|line| Some(line.split_once(' ')?.1.to_owned())).collect()
    };
    assert_same(&untimed(once), &untimed(record(story, Times::Never)));
}

#[test]
fn watching_a_program_and_breaking_off_changes_no_byte() {
    for story in STORIES {
        let unwatched = record(story, Times::AtEvents);
        let mut seen = 0u64;
        let watched = record(
            story,
            Times::Watched(&mut |executed| {
                // Now and then, at no regular command or time.
                seen = seen.wrapping_mul(31).wrapping_add(executed.at.as_ticks() | 1);
                if seen.is_multiple_of(7) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            }),
        );
        assert_same(&unwatched, &watched);
    }
}

fn assert_same(once: &[String], other: &[String]) {
    for (at, (once, other)) in once.iter().zip(other).enumerate() {
        assert_eq!(once, other, "frame {at}");
    }
    assert_eq!(once.len(), other.len());
}

#[test]
fn the_scenario_exercises_what_it_is_for() {
    let log = record(MOVING, Times::AtEvents);
    let values = |log: &[String], command: u8| -> Vec<i32> {
        log.iter()
            .filter_map(|line| {
                let bytes = line.rsplit_once(": [")?.1.trim_end_matches(']').split(", ");
                let bytes: Vec<u8> =
                    bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
                let value = i32::from_be_bytes(bytes[4..8].try_into().unwrap());
                (bytes[3] == command).then_some(value)
            })
            .collect()
    };
    let reports = log.iter().filter(|line| line.contains("80, 8A")).count();
    assert!(reports > 20, "position reports: {reports}");
    assert!(values(&log, 10).iter().any(|&value| value > 5000), "timer interrupts counted");
    assert!(values(&log, 15).windows(2).any(|pair| pair[0] != pair[1]), "outputs follow inputs");
    // The heartbeat has stopped the motor that the busy program turns.
    let busy = record(BUSY, Times::AtEvents);
    assert_eq!(values(&busy, 6).last(), Some(&0));
    assert!(values(&busy, 6).iter().any(|&value| value > 3_000_000), "a minute at 51200 pps");
    for (story, variable) in [(FIELD_ORIENTED, 1000), (BLOCK, 20)] {
        let replies = values(&record(story, Times::AtEvents), 10);
        assert!(replies.iter().any(|value| value.abs() > variable), "it has moved: {replies:?}");
    }
    let ticked = record(TICKED, Times::AtEvents);
    let positions = values(&ticked, 6);
    assert!(positions.iter().any(|&value| value > 10_000), "{positions:?}");
    assert!(positions.windows(2).any(|pair| pair[1] < pair[0]), "back and forth: {positions:?}");
}
