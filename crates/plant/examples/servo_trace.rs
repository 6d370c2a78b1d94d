//! What a brushless motor does with given voltages: `servo_trace MOTOR LOAD_INERTIA VOLTS`.
//!
//! Reads a line for each control period: the duties of the legs A, B and C in 1/65535, and the torque in Nm that acts
//! on the shaft from outside, with commas in between. Prints a line for the end of each of them: currents of the
//! phases A, B and C in ampere, torque of the currents in Nm, speed in rad/s.
//!
//! The motor is a preset without dry friction, its load has this inertia in kg m², and nothing moves the bus from this
//! voltage. `tests/python/test_servo_physics.py` compares what comes out with a simulator of others.

use std::error::Error;
use std::f64::consts::PI;
use std::io::{BufWriter, Write, stdin, stdout};

use opentmcl_motion::Instant;
use opentmcl_motion::servo::{Leg, PERIOD_TICKS, Power};
use opentmcl_plant::machine::Load;
use opentmcl_plant::servo::motor::{Brushless, preset};
use opentmcl_plant::servo::{Influence, Machine, Motor, Sensing, Servo, Supply, TwoShunt};

/// In farad: so much that no current moves the voltage.
const STIFF: f64 = 1e9;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [motor, inertia, volts] = arguments.as_slice() else {
        return Err("usage: servo_trace MOTOR LOAD_INERTIA VOLTS".into());
    };
    let motor = preset(motor).ok_or("no such motor")?;
    let machine = machine(motor, inertia.parse()?, volts.parse()?);
    let mut servo = Servo::new(machine, Sensing::TwoShunt(TwoShunt::default()));
    let mut output = BufWriter::new(stdout().lock());
    let mut now = Instant::from_ticks(0);
    for line in stdin().lines() {
        let line = line?;
        let fields: Vec<&str> = line.split(',').collect();
        let [a, b, c, torque] = fields.as_slice() else {
            return Err(format!("not three duties and a torque: {line}").into());
        };
        let legs = [Leg::Duty(a.parse()?), Leg::Duty(b.parse()?), Leg::Duty(c.parse()?)];
        servo.influence(Influence::Torque(torque.parse()?), now);
        servo.drive(&Power { legs, ..Power::default() }, now);
        now = Instant::from_ticks(now.as_ticks() + PERIOD_TICKS);
        servo.come_to(now);
        let view = servo.view(now);
        let [a, b, c] = view.currents;
        writeln!(output, "{a},{b},{c},{},{}", view.torque, view.speed * PI / 30.0)?;
    }
    Ok(output.flush()?)
}

fn machine(motor: Brushless, inertia: f64, volts: f64) -> Machine {
    let motor = Brushless { friction: 0.0, ..motor };
    let load = Load { inertia, ..Load::default() };
    let supply = Supply { voltage: volts, capacitance: STIFF, ..Supply::default() };
    Machine { load, supply, ..Machine::new(Motor::Brushless(motor)) }
}
