//! What is recorded, and what it is called.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::{Module, PortBehaviour};
use opentmcl_virtual::{MachineSample, Sample, VirtualModule};

use super::servo::{PARAMETERS, REALITY};

use crate::time;

/// Value of a column in one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    Whole(i64),
    Real(f64),
    Level(bool),
}

/// What kind of values a column has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Whole,
    Real,
    Level,
}

/// One column.
pub(super) struct Column {
    /// What it is within its group: `position`, `output2`.
    pub(super) field: String,
    /// The axis to which it belongs; none for what belongs to the module.
    pub(super) axis: Option<u8>,
    /// Its unit; empty for numbers without one.
    pub(super) unit: &'static str,
    pub(super) kind: Kind,
    value: Source,
}

type Source = Box<dyn Fn(&Sample) -> Value>;

impl Column {
    /// Its name among all columns: `position0_microsteps`.
    pub(super) fn name(&self) -> String {
        let axis = self.axis.map(|axis| axis.to_string()).unwrap_or_default();
        let unit = match self.unit {
            "" => String::new(),
            unit => format!("_{unit}"),
        };
        format!("{}{axis}{unit}", self.field)
    }

    pub(super) fn value(&self, sample: &Sample) -> Value {
        (self.value)(sample)
    }
}

/// Everything that a recording has of a module, and what it says of itself.
pub(crate) struct Columns {
    /// The first one is the time; those that are there without a machine come first.
    pub(super) columns: Vec<Column>,
    pub(super) model: &'static Module,
    /// Samples per second.
    pub(super) rate: u32,
}

impl Columns {
    /// Columns for a module: those of a machine for each axis that has one, and those of its inputs if somebody
    /// may change them while it runs. `variables` are numbers of user variables, as the recorder has them.
    pub(crate) fn new<F: NorFlash>(
        module: &VirtualModule<F>,
        rate: u32,
        variables: &[u8],
        with_inputs: bool,
    ) -> Self {
        let model = module.model();
        let machines = (0..model.axes).filter(|&axis| module.has_machine(axis));
        let mut columns = Self::without_machines(model, rate, variables);
        machines.for_each(|axis| {
            if model.motion.is_servo() {
                columns.add_servo(axis);
            } else {
                columns.add_machine(axis);
            }
        });
        if with_inputs {
            columns.add_inputs();
        }
        columns
    }

    /// Columns of an axis for quantities that have a name and a unit. A sample has their values in the place of the
    /// variables, in this order.
    pub(crate) fn of_quantities(
        model: &'static Module,
        rate: u32,
        axis: u8,
        quantities: &[(&str, &'static str)],
    ) -> Self {
        let mut all = Self { columns: Vec::new(), model, rate };
        all.add_time();
        for (at, &(name, unit)) in quantities.iter().enumerate() {
            all.add(Some(axis), name, unit, Kind::Whole, move |sample| {
                whole(sample.variables.get(at))
            });
        }
        all
    }

    pub(super) fn without_machines(model: &'static Module, rate: u32, variables: &[u8]) -> Self {
        let mut all = Self { columns: Vec::new(), model, rate };
        all.add_time();
        let (position, speed) = match model.motion.is_servo() {
            true => ("units", "rpm"),
            false => ("microsteps", "pps"),
        };
        for axis in 0..model.axes {
            all.add(Some(axis), "position", position, Kind::Whole, move |sample| {
                whole(sample.positions.get(usize::from(axis)))
            });
        }
        for axis in 0..model.axes {
            all.add(Some(axis), "speed", speed, Kind::Whole, move |sample| {
                whole(sample.speeds.get(usize::from(axis)))
            });
        }
        all.add(None, "address", "", Kind::Whole, |sample| Value::Whole(sample.address.into()));
        for row in ports(model, PortBehaviour::DigitalOutput).filter(|row| row.access.write) {
            let (name, bit) = (format!("output{}", row.number), row.index % 8);
            all.add(None, name, "", Kind::Level, move |sample| level(sample.outputs, bit));
        }
        for (at, number) in variables.iter().enumerate() {
            all.add(None, format!("variable{number}"), "", Kind::Whole, move |sample| {
                whole(sample.variables.get(at))
            });
        }
        all
    }

    /// Adds the columns of the machine behind an axis.
    pub(super) fn add_machine(&mut self, axis: u8) {
        for (field, unit, kind, of) in MACHINE {
            // Where the machine is gone, its columns say nothing.
            self.add(Some(axis), field, unit, kind, move |sample| {
                match (sample.machines.get(usize::from(axis)).copied().flatten(), kind) {
                    (Some(machine), _) => of(&machine),
                    (None, Kind::Whole) => Value::Whole(0),
                    (None, Kind::Real) => Value::Real(0.0),
                    (None, Kind::Level) => Value::Level(false),
                }
            });
        }
    }

    /// Adds the columns of a servo axis: what its parameters tell, and what its machine really does.
    pub(super) fn add_servo(&mut self, axis: u8) {
        for (field, unit, kind, of) in PARAMETERS.iter().chain(&REALITY).copied() {
            self.add(Some(axis), field, unit, kind, move |sample| {
                match (sample.servos.get(usize::from(axis)).and_then(Option::as_ref), kind) {
                    (Some(servo), _) => of(servo),
                    (None, Kind::Whole) => Value::Whole(0),
                    (None, Kind::Real) => Value::Real(0.0),
                    (None, Kind::Level) => Value::Level(false),
                }
            });
        }
    }

    /// Adds the columns of digital and analog inputs.
    pub(super) fn add_inputs(&mut self) {
        for row in ports(self.model, PortBehaviour::DigitalInput) {
            let (name, bit) = (format!("input{}", row.number), row.index % 8);
            self.add(None, name, "", Kind::Level, move |sample| level(sample.inputs, bit));
        }
        for (at, row) in ports(self.model, PortBehaviour::AnalogInput).enumerate() {
            self.add(None, format!("analog{}", row.number), "", Kind::Whole, move |sample| {
                whole(sample.analog.get(at))
            });
        }
    }

    fn add_time(&mut self) {
        self.add(None, "time", "s", Kind::Real, |sample| Value::Real(time::number(sample.time)));
    }

    fn add(
        &mut self,
        axis: Option<u8>,
        field: impl Into<String>,
        unit: &'static str,
        kind: Kind,
        value: impl Fn(&Sample) -> Value + 'static,
    ) {
        let value = Box::new(value);
        self.columns.push(Column { field: field.into(), axis, unit, kind, value });
    }

    /// What a recording says of itself besides its columns.
    pub(super) fn description(&self) -> [(&'static str, String); 4] {
        let (major, minor) = self.model.firmware;
        [
            ("module", self.model.title.to_owned()),
            ("firmware", format!("{major}.{minor:02}")),
            ("rate_hz", self.rate.to_string()),
            ("program", format!("tmcl {}", env!("CARGO_PKG_VERSION"))),
        ]
    }
}

/// Field, unit, kind and value.
type MachineColumn = (&'static str, &'static str, Kind, fn(&MachineSample) -> Value);

const MACHINE: [MachineColumn; 13] = [
    ("rotor", "microsteps", Kind::Real, |machine| Value::Real(machine.rotor)),
    ("stage", "microsteps", Kind::Real, |machine| Value::Real(machine.stage)),
    ("real_speed", "pps", Kind::Real, |machine| Value::Real(machine.speed)),
    ("load_angle", "degrees", Kind::Real, |machine| Value::Real(machine.load_angle)),
    ("load", "", Kind::Real, |machine| Value::Real(machine.load)),
    ("stallguard", "", Kind::Whole, |machine| Value::Whole(machine.stallguard.into())),
    ("current", "ampere", Kind::Real, |machine| Value::Real(machine.current)),
    ("lost_steps", "", Kind::Whole, |machine| Value::Whole(machine.lost_steps)),
    ("left", "", Kind::Level, |machine| Value::Level(machine.switches[0])),
    ("right", "", Kind::Level, |machine| Value::Level(machine.switches[1])),
    ("home", "", Kind::Level, |machine| Value::Level(machine.switches[2])),
    ("stop_flags", "", Kind::Whole, |machine| Value::Whole(machine.stop_flags.into())),
    ("driver_flags", "", Kind::Whole, |machine| Value::Whole(machine.driver_flags.into())),
];

fn whole(value: Option<&i32>) -> Value {
    Value::Whole(value.copied().unwrap_or_default().into())
}

fn level(levels: u8, bit: u8) -> Value {
    Value::Level(levels >> bit & 1 != 0)
}

fn ports(
    model: &'static Module,
    behaviour: PortBehaviour,
) -> impl Iterator<Item = &'static opentmcl_catalog::Port> {
    model.ports.iter().filter(move |row| row.behaviour == behaviour)
}
