//! What is recorded of a servo axis, and what it is called.

use opentmcl_virtual::ServoSample;

use super::columns::{Kind, Value};

/// Field, unit, kind and value.
type ServoColumn = (&'static str, &'static str, Kind, fn(&ServoSample) -> Value);

/// The largest value of the torque regulator.
const FULL_VOLTAGE: f64 = 32_767.0;

/// A current or torque of nothing has no sign.
fn real(value: f64) -> Value {
    Value::Real(value + 0.0)
}

fn whole(value: i32) -> Value {
    Value::Whole(value.into())
}

/// What parameters tell; position and speed have columns on all axes.
pub(super) const PARAMETERS: [ServoColumn; 10] = [
    ("target_position", "units", Kind::Whole, |servo| whole(servo.state.target_position)),
    ("ramp_position", "units", Kind::Whole, |servo| whole(servo.state.ramp_position)),
    ("target_speed", "rpm", Kind::Whole, |servo| whole(servo.state.target_speed)),
    ("ramp_speed", "rpm", Kind::Whole, |servo| whole(servo.state.ramp_speed)),
    ("target_torque", "milliampere", Kind::Whole, |servo| whole(servo.state.target_torque)),
    ("actual_torque", "milliampere", Kind::Whole, |servo| whole(servo.state.torque)),
    ("target_flux", "milliampere", Kind::Whole, |servo| whole(servo.state.target_flux)),
    ("actual_flux", "milliampere", Kind::Whole, |servo| whole(servo.state.flux)),
    ("duty", "", Kind::Real, |servo| real(f64::from(servo.state.voltage) / FULL_VOLTAGE)),
    ("status_flags", "", Kind::Whole, |servo| Value::Whole(servo.state.status_flags.into())),
];

/// What the machine really does.
pub(super) const REALITY: [ServoColumn; 17] = [
    ("rotor", "turns", Kind::Real, |servo| real(servo.view.turns)),
    ("stage", "turns", Kind::Real, |servo| real(servo.view.stage / 65_536.0)),
    ("real_speed", "rpm", Kind::Real, |servo| real(servo.view.speed)),
    ("current_a", "ampere", Kind::Real, |servo| real(servo.view.currents[0])),
    ("current_b", "ampere", Kind::Real, |servo| real(servo.view.currents[1])),
    ("current_c", "ampere", Kind::Real, |servo| real(servo.view.currents[2])),
    ("torque_current", "ampere", Kind::Real, |servo| real(servo.view.torque_current)),
    ("flux_current", "ampere", Kind::Real, |servo| real(servo.view.direct_current)),
    ("torque", "newtonmeter", Kind::Real, |servo| real(servo.view.torque)),
    ("bus", "volt", Kind::Real, |servo| real(servo.view.bus)),
    ("bus_current", "ampere", Kind::Real, |servo| real(servo.view.bus_current)),
    ("chopper_current", "ampere", Kind::Real, |servo| real(servo.view.chopper_current)),
    ("motor_temperature", "celsius", Kind::Real, |servo| real(servo.view.winding_temperature)),
    ("driver_temperature", "celsius", Kind::Real, |servo| real(servo.view.driver_temperature)),
    ("left", "", Kind::Level, |servo| Value::Level(servo.view.switches[0])),
    ("right", "", Kind::Level, |servo| Value::Level(servo.view.switches[1])),
    ("home", "", Kind::Level, |servo| Value::Level(servo.view.switches[2])),
];
