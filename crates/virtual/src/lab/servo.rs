//! What there is to see of a servo axis, as JSON.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_plant::servo::LineFault;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::state::{held, rounded};
use crate::module::VirtualModule;

/// Status flags (parameter 156) by bits.
const FLAGS: [(&str, u32); 13] = [
    ("overcurrent", 0),
    ("undervoltage", 1),
    ("overvoltage", 2),
    ("overtemperature", 3),
    ("halted", 4),
    ("hall_error", 5),
    ("driver_error", 6),
    ("stop_mode", 8),
    ("velocity_mode", 9),
    ("position_mode", 10),
    ("torque_mode", 11),
    ("position_end", 14),
    ("initialized", 15),
];

/// Names of hall lines and phases.
const LETTERS: [&str; 3] = ["a", "b", "c"];

/// One servo axis.
#[derive(Serialize)]
struct ServoAxisState {
    machine: bool,
    unit: &'static str,
    position: f64,
    stage: f64,
    rotor: f64,
    counter: i32,
    speed: f64,
    rpm: f64,
    moving: bool,
    current: f64,
    phase_currents: Value,
    torque_current: f64,
    flux_current: f64,
    motor_torque: f64,
    bus: f64,
    bus_current: f64,
    temperatures: Value,
    switches: Value,
    held: Value,
    blocked: bool,
    push: f64,
    halls: Value,
    phases: Value,
    driver_fault: bool,
    flags: Map<String, Value>,
}

/// A servo axis; none if it is no such axis.
pub(super) fn axis_state<F: NorFlash>(module: &mut VirtualModule<F>, axis: u8) -> Option<Value> {
    let view = module.servo_view(axis)?;
    let state = module.servo_state(axis)?;
    let (scale, hands) = (module.scale(axis), module.hands_at(axis));
    let fine_per_second = view.speed / 60.0 * crate::scenario::SERVO_TURN;
    let [left, right, home] = view.switches;
    let by_letter = |values: [Value; 3]| -> Value {
        let letters = LETTERS.iter().map(|letter| (*letter).to_owned());
        Value::Object(letters.zip(values).collect())
    };
    let halls = hands.halls.map(|fault| match fault {
        LineFault::None => json!("connected"),
        LineFault::StuckHigh => json!("disconnected"),
        LineFault::StuckLow => json!("shorted"),
    });
    let phases =
        hands.open_phases.map(|open| if open { json!("disconnected") } else { json!("connected") });
    Some(json!(ServoAxisState {
        machine: true,
        unit: scale.unit().symbol(),
        position: rounded(scale.to_stage(view.stage)),
        stage: rounded(view.stage),
        rotor: rounded(view.rotor),
        counter: state.position,
        speed: rounded(scale.to_stage(fine_per_second)),
        rpm: rounded(view.speed),
        moving: state.speed != 0 || view.speed != 0.0,
        current: rounded(view.amplitude),
        phase_currents: by_letter(view.currents.map(|current| json!(rounded(current)))),
        torque_current: rounded(view.torque_current),
        flux_current: rounded(view.direct_current),
        motor_torque: rounded(view.torque),
        bus: rounded(view.bus),
        bus_current: rounded(view.bus_current),
        temperatures: json!({
            "motor": rounded(view.winding_temperature),
            "driver": rounded(view.driver_temperature),
        }),
        switches: json!({ "left": left, "right": right, "home": home }),
        held: held(&hands),
        blocked: hands.blocked,
        push: hands.torque,
        halls: by_letter(halls),
        phases: by_letter(phases),
        driver_fault: hands.driver_fault,
        flags: FLAGS
            .iter()
            .map(|&(name, bit)| (name.to_owned(), json!(state.status_flags >> bit & 1 == 1)))
            .collect(),
    }))
}
