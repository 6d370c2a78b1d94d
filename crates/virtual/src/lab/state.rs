//! Everything there is to see of a lab, as JSON.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::PortBehaviour;
use opentmcl_firmware::Mode;
use opentmcl_plant::axis::{CoilFault, Rotor};
use opentmcl_wire::{Instant, TICKS_PER_SECOND};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{Lab, servo};
use crate::module::VirtualModule;
use crate::world::Hands;

/// Members that change steadily while an axis moves.
pub(super) const CONTINUOUS: [&str; 17] = [
    "position",
    "stage",
    "rotor",
    "counter",
    "speed",
    "load_angle",
    "load",
    "stallguard",
    "current",
    "rpm",
    "phase_currents",
    "torque_current",
    "flux_current",
    "motor_torque",
    "bus",
    "bus_current",
    "temperatures",
];

/// What a driver tells, by bits.
const FLAGS: [(&str, u32); 7] = [
    ("stall", 0),
    ("overtemperature", 1),
    ("overtemperature_warning", 2),
    ("short_a", 3),
    ("short_b", 4),
    ("open_a", 5),
    ("open_b", 6),
];

/// One axis.
#[derive(Serialize)]
struct AxisState {
    machine: bool,
    unit: &'static str,
    position: f64,
    stage: f64,
    rotor: f64,
    counter: i32,
    speed: f64,
    moving: bool,
    load_angle: f64,
    load: f64,
    stallguard: u16,
    current: f64,
    lost_steps: i64,
    rotor_state: &'static str,
    switches: Value,
    held: Value,
    blocked: bool,
    push: f64,
    coils: Value,
    driver_temperature: f64,
    flags: Map<String, Value>,
}

/// One module.
#[derive(Serialize)]
struct ModuleState {
    model: &'static str,
    powered: bool,
    supply: f64,
    temperature: f64,
    program: &'static str,
    inputs: Map<String, Value>,
    outputs: Map<String, Value>,
    analog: Map<String, Value>,
    torque: Map<String, Value>,
    axes: Map<String, Value>,
}

/// A time in seconds.
pub(super) fn seconds(time: Instant) -> f64 {
    time.as_ticks() as f64 / TICKS_PER_SECOND as f64
}

/// A value with the digits that mean something.
pub(super) fn rounded(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    // Too large to have such digits.
    if rounded.is_finite() { rounded + 0.0 } else { value }
}

impl<F: NorFlash> Lab<F> {
    /// All modules by their names.
    pub(super) fn state_value(&mut self) -> Value {
        let mut modules = Map::new();
        for (setup, module) in self.scenario.modules.iter().zip(&mut self.modules) {
            modules.insert(setup.name.clone(), module_state(module));
        }
        json!({ "modules": modules })
    }
}

fn module_state<F: NorFlash>(module: &mut VirtualModule<F>) -> Value {
    let model = module.model();
    let board = module.board();
    let pins = |behaviour, levels: u8| -> Map<String, Value> {
        let rows = model.ports.iter().filter(|row| row.behaviour == behaviour && row.access.read);
        rows.map(|row| (row.number.to_string(), json!(levels >> (row.index % 8) & 1 == 1)))
            .collect()
    };
    let analog = model.ports.iter().filter(|row| row.behaviour == PortBehaviour::AnalogInput);
    let torque = model.ports.iter().filter(|row| row.behaviour == PortBehaviour::StoInput);
    let torque_levels = board.torque_levels();
    let state = ModuleState {
        model: model.name,
        powered: module.is_powered(),
        supply: rounded(board.supply()),
        temperature: rounded(board.temperature()),
        program: match module.program_state().mode {
            _ if !module.is_powered() => "stopped",
            Mode::Run => "running",
            Mode::Step => "stepping",
            _ => "stopped",
        },
        inputs: pins(PortBehaviour::DigitalInput, board.input_levels()),
        outputs: pins(PortBehaviour::DigitalOutput, board.digital_outputs()),
        analog: analog
            .map(|row| (row.number.to_string(), json!(board.analog_reading(row.index))))
            .collect(),
        torque: torque
            .map(|row| (row.index.to_string(), json!(torque_levels >> (row.index % 8) & 1 == 1)))
            .collect(),
        axes: (0..model.axes)
            .filter_map(|axis| Some((axis.to_string(), axis_state(module, axis)?)))
            .collect(),
    };
    json!(state)
}

/// Who decides about the switches of an axis.
pub(super) fn held(hands: &Hands) -> Value {
    let [left, right, home] = hands.held.map(|held| match held {
        None => "stage",
        Some(true) => "pressed",
        Some(false) => "released",
    });
    json!({ "left": left, "right": right, "home": home })
}

fn axis_state<F: NorFlash>(module: &mut VirtualModule<F>, axis: u8) -> Option<Value> {
    let Some(view) = module.view(axis) else { return servo::axis_state(module, axis) };
    let (scale, hands) = (module.scale(axis), module.hands_at(axis));
    let counter = module.position(axis)?;
    let turns = module.speed(axis)? != 0;
    let now = module.now();
    let status = module.hardware().driver_flags(axis, now);
    let [left, right, home] = view.switches;
    let [a, b] = hands.coils.map(|fault| match fault {
        None => "connected",
        Some(CoilFault::Open) => "disconnected",
        Some(CoilFault::ShortToGround) => "shorted",
    });
    Some(json!(AxisState {
        machine: module.has_machine(axis),
        unit: scale.unit().symbol(),
        position: rounded(scale.to_stage(view.stage)),
        stage: rounded(view.stage),
        rotor: rounded(view.rotor),
        counter,
        speed: rounded(scale.to_stage(view.speed)),
        moving: turns || view.speed != 0.0,
        load_angle: rounded(view.load_angle),
        load: rounded(view.load),
        stallguard: view.stallguard,
        current: rounded(view.current),
        lost_steps: view.lost_steps,
        rotor_state: match view.state {
            Rotor::Following => "following",
            Rotor::Pressed => "pressed",
            Rotor::Slipping => "slipping",
            Rotor::Free => "free",
        },
        switches: json!({ "left": left, "right": right, "home": home }),
        held: held(&hands),
        blocked: hands.blocked,
        push: hands.torque,
        coils: json!({ "a": a, "b": b }),
        driver_temperature: rounded(hands.driver_temperature),
        flags: FLAGS
            .iter()
            .map(|&(name, bit)| (name.to_owned(), json!(status >> bit & 1 == 1)))
            .collect(),
    }))
}
