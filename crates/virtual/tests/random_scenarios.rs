//! Random scenarios with random commands and actions: nothing panics, nothing becomes infinite, no stage
//! leaves its way, and how often the module is looked at changes nothing.
//!
//! `OPENTMCL_SCENARIOS` in the environment sets how many there are; each has its number as its seed.

use std::fmt::Write;

use opentmcl_virtual::{Lab, Scenario};
use opentmcl_wire::{Command, Duration, Instant, Opcode};

/// SplitMix64: a seed gives the same scenario on every platform.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len() as u64) as usize]
    }

    /// From `least` to `most` with three digits behind the point.
    fn number(&mut self, least: f64, most: f64) -> f64 {
        let part = self.below(1001) as f64 / 1000.0;
        ((least + (most - least) * part) * 1000.0).round() / 1000.0
    }

    fn chance(&mut self, of_ten: u64) -> bool {
        self.below(10) < of_ten
    }
}

/// Axis `number` with a screw and two hard stops, loaded in some way.
fn axis(text: &mut String, random: &mut Random, number: u64, has_encoder: bool) {
    let motor =
        random.one(&["nema17", "qsh4218-35-10-027", "qsh5718-76-28-189", "qsh6018-86-28-310"]);
    let (lead, mass) = (random.number(1.0, 20.0), random.number(0.0, 10.0));
    let (friction, viscous) = (random.number(0.0, 50.0), random.number(0.0, 100.0));
    let (force, rate) = (random.number(-30.0, 30.0), random.number(0.0, 5.0));
    let (to, width) = (random.number(5.0, 200.0), random.number(0.5, 10.0));
    let _ = write!(
        text,
        "[[module.axis]]\naxis = {number}\nmotor = \"{motor}\"\ntransmission = {{ screw = \"{lead} mm\" }}\n\
         load = {{ mass = \"{mass} kg\", friction = \"{friction} N\", viscous = \"{viscous} N s/m\", \
         force = \"{force} N\", springs = [{{ rate = \"{rate} N/mm\", rest = \"{width} mm\" }}] }}\n\
         stage = {{ from = \"-2 mm\", to = \"{to} mm\" }}\n\
         home = {{ at = \"{width} mm\", width = \"1 mm\", hysteresis = \"0.05 mm\" }}\n"
    );
    if random.chance(5) {
        let _ = writeln!(text, "left = {{ at = \"0 mm\", bounce = \"1 ms\" }}");
    }
    if random.chance(5) {
        let backlash = random.number(0.0, 0.2);
        let _ = writeln!(text, "backlash = \"{backlash} mm\"");
    }
    if has_encoder {
        let on = random.one(&["motor", "stage"]);
        let _ = writeln!(text, "encoder = {{ counts = 4000, on = \"{on}\" }}");
    }
}

/// A module with machines behind some of its axes; which ones, and the largest speed that it takes.
fn scenario(random: &mut Random) -> (String, Vec<u64>, i32) {
    let (model, fastest, encoders) =
        if random.chance(3) { ("tmcm-6110", 2047, 6) } else { ("tmcm-6214", 100_000, 3) };
    let mut text = format!("[[module]]\nname = \"m\"\nmodel = \"{model}\"\n");
    let axes: Vec<u64> = (0..6).filter(|_| random.chance(4)).collect();
    for &number in &axes {
        axis(&mut text, random, number, number >= encoders);
    }
    (text, axes, fastest)
}

fn action(random: &mut Random, axis: u64, has_torque_inputs: bool) -> String {
    match random.below(9) {
        0 => format!("{} home axis {axis}", random.one(&["press", "release", "free"])),
        1 => format!("{} left axis {axis}", random.one(&["press", "release", "free"])),
        2 => format!("load axis {axis} {} N", random.number(-40.0, 40.0)),
        3 => format!("{} axis {axis}", random.one(&["block", "unblock", "unblock"])),
        4 => format!(
            "{} coil A axis {axis}",
            random.one(&["disconnect", "short", "connect", "connect"])
        ),
        5 => format!("supply {} V", random.number(8.0, 28.0)),
        6 => format!("set position axis {axis} {} mm", random.number(-2.0, 5.0)),
        7 if has_torque_inputs => format!("torque {} input 0", random.one(&["off", "on", "on"])),
        _ => format!("temperature driver {} axis {axis}", random.number(0.0, 180.0)),
    }
}

/// What can be done to an axis without a machine.
fn touch(random: &mut Random, axis: u64) -> String {
    let switch = random.one(&["left", "right", "home"]);
    format!("{} {switch} axis {axis}", random.one(&["press", "release", "free"]))
}

fn command(random: &mut Random, axis: u64, fastest: i32) -> Command {
    let axis = axis as u8;
    let value = random.below(2 * fastest as u64) as i32 - fastest;
    match random.below(7) {
        0 => Command::new(Opcode::Ror.number(), 0, axis, value.abs()),
        1 => Command::new(Opcode::Rol.number(), 0, axis, value.abs()),
        2 => Command::new(Opcode::Mvp.number(), 0, axis, value * 3),
        3 => Command::new(Opcode::Mst.number(), 0, axis, 0),
        4 => Command::new(Opcode::Rfs.number(), 0, axis, 0),
        // Any parameter of the axis, with a value that many of them take.
        5 => Command::new(Opcode::Sap.number(), random.below(256) as u8, axis, value % 256),
        _ => Command::new(Opcode::Sap.number(), 4, axis, value.abs()),
    }
}

/// What is done, and when: the same however it is looked at.
enum Deed {
    Line(String),
    Command(Command),
}

fn run(text: &str, deeds: &[(Instant, Deed)], steps: u64) -> (Lab, String) {
    let scenario = Scenario::parse("random.toml", text).unwrap_or_else(|wrong| panic!("{wrong}"));
    let mut lab = Lab::new(scenario);
    let mut log = String::new();
    for (time, deed) in deeds {
        let (from, way) = (lab.now(), *time - lab.now());
        for step in 1..=steps {
            lab.advance_to(from + Duration::from_ticks(way.as_ticks() * step / steps));
        }
        match deed {
            Deed::Line(line) => log.push_str(&lab.line(line).json),
            Deed::Command(command) => {
                let reply = lab.module_mut(0).unwrap().execute(*command);
                let _ = write!(log, "{reply:?}");
            }
        }
        log.push_str(&lab.line("state").json);
    }
    (lab, log)
}

#[track_caller]
fn is_sound(seed: u64, lab: &mut Lab) {
    let setup = lab.scenario().modules[0].clone();
    let module = lab.module_mut(0).unwrap();
    for (number, axis) in (0u8..).zip(&setup.axes) {
        let view = module.view(number).unwrap();
        let values = [view.rotor, view.stage, view.speed, view.load_angle, view.load, view.current];
        assert!(values.iter().all(|value| value.is_finite()), "seed {seed}: {view:?}");
        // A motor that turns with 100 turns a second has long lost its torque to its inductance.
        assert!(view.speed.abs() < 200.0 * 51_200.0, "seed {seed}: {view:?}");
        if let Some(machine) = &axis.machine {
            let stage = machine.stage();
            let (lowest, highest) = (stage.lowest.unwrap(), stage.highest.unwrap());
            // A thousandth of a full step for rounding.
            let way = lowest - 0.256..=highest + 0.256;
            assert!(way.contains(&view.stage), "seed {seed}, axis {number}: {view:?}");
        }
    }
}

#[test]
fn whatever_happens_to_a_machine_it_stays_within_its_bounds() {
    let count = std::env::var("OPENTMCL_SCENARIOS").ok();
    let count: u64 = count.map_or(60, |count| count.parse().expect("a number of scenarios"));
    for seed in 0..count {
        let mut random = Random(seed);
        let (text, axes, fastest) = scenario(&mut random);
        let has_torque = text.contains("tmcm-6214");
        let mut time = Instant::from_ticks(0);
        let mut deeds = Vec::new();
        for _ in 0..20 {
            time += Duration::from_ticks(random.below(3_000_000));
            let axis = match axes.len() as u64 {
                0 => random.below(6),
                count => axes[random.below(count) as usize],
            };
            let deed = if random.chance(4) {
                let has_machine = !axes.is_empty();
                Deed::Line(if has_machine {
                    action(&mut random, axis, has_torque)
                } else {
                    touch(&mut random, axis)
                })
            } else {
                Deed::Command(command(&mut random, axis, fastest))
            };
            deeds.push((time, deed));
        }
        let (mut lab, log) = run(&text, &deeds, 1);
        is_sound(seed, &mut lab);
        assert!(!log.contains("\"ok\":false"), "seed {seed}: {log}");
        let (_, polled) = run(&text, &deeds, 7);
        assert!(log == polled, "seed {seed}: looking at it changes it\n{text}");
    }
}
