//! The one axis of a servo module: its machine, and what the board tells of it.

use opentmcl_catalog::{AxisBehaviour, Foc, Module, Motion};
use opentmcl_firmware::{Power, Senses};
use opentmcl_plant::axis::{self, Rotor};
use opentmcl_plant::servo::{
    Influence, Machine, Motor, Sensing, Servo, SingleShunt, TwoShunt, motor,
};
use opentmcl_wire::{Duration, Instant};

/// Distance of two control interrupts.
const CONTROL_PERIOD: Duration = Duration::from_micros(50);

/// The motor of a module about whose machine nothing is said.
const USUAL_MOTOR: &str = "qbl4208-61-04-013";

/// Current of a count of the two-shunt converters in mA.
const TWO_SHUNT_MA: f64 = 2.0;

/// The machine behind a servo module.
#[derive(Clone, Debug)]
pub(crate) struct ServoAxis {
    servo: Servo,
    /// When the senses were asked for last.
    sensed: Instant,
}

impl ServoAxis {
    /// The machine of a module; the usual motor, which turns nothing but itself, if none is given.
    pub(crate) fn new(model: &Module, machine: Option<Machine>) -> Self {
        let machine = machine.unwrap_or_else(usual_machine);
        let sensing = sensing(model);
        Self { servo: Servo::new(machine, sensing), sensed: Instant::from_ticks(0) }
    }

    /// What the control interrupt reads. While it slept, the machine did nothing that it could have seen.
    #[inline]
    pub(crate) fn sense(&mut self, senses: &mut Senses, now: Instant) {
        if now > self.sensed + CONTROL_PERIOD {
            self.servo.skip(now - CONTROL_PERIOD);
        }
        self.sensed = now;
        *senses = self.servo.sense(now);
    }

    #[inline]
    pub(crate) fn drive(&mut self, power: &Power, now: Instant) {
        self.servo.drive(*power, now);
    }

    pub(crate) fn is_still(&self) -> bool {
        self.servo.is_still()
    }

    /// Voltage at the bridge in volt.
    pub(crate) fn supply(&self, now: Instant) -> f64 {
        self.servo.view(now).bus
    }

    /// Temperatures of motor and driver in degrees Celsius.
    pub(crate) fn temperatures(&self, now: Instant) -> [f64; 2] {
        self.servo.temperatures(now)
    }

    /// Left, right and home contact.
    pub(crate) fn switches(&self, now: Instant) -> [bool; 3] {
        self.servo.switches(now)
    }

    /// Does to the machine what is done to that of a stepper; coils and safe-torque-off inputs it has none.
    pub(crate) fn influence(&mut self, influence: axis::Influence, now: Instant) {
        let influence = match influence {
            axis::Influence::Supply(volts) => Influence::SourceVoltage(volts),
            axis::Influence::DriverTemperature(celsius) => Influence::DriverTemperature(celsius),
            axis::Influence::Torque(torque) => Influence::Torque(torque),
            axis::Influence::Blocked(blocked) => Influence::Blocked(blocked),
            axis::Influence::Position(fine_steps) => Influence::Position(fine_steps),
            axis::Influence::TorqueAllowed(_) | axis::Influence::Coil(..) => return,
        };
        self.servo.influence(influence, now);
    }

    /// What the axis really does, in the terms that all axes share.
    pub(crate) fn view(&self, now: Instant) -> axis::View {
        let view = self.servo.view(now);
        let turning = view.speed / 60.0 * f64::from(1 << 16);
        axis::View {
            rotor: view.rotor,
            stage: view.stage,
            speed: turning,
            load_angle: 0.0,
            load: 0.0,
            stallguard: 0,
            current: view.amplitude,
            lost_steps: 0,
            state: if view.amplitude == 0.0 { Rotor::Free } else { Rotor::Following },
            switches: view.switches,
        }
    }
}

fn usual_machine() -> Machine {
    let motor = motor::preset(USUAL_MOTOR).unwrap_or(motor::PRESETS[0].motor);
    Machine::new(Motor::Brushless(motor))
}

/// How a module measures its currents: as its factory settings say.
fn sensing(model: &Module) -> Sensing {
    if model.motion == Motion::Block {
        return Sensing::SingleShunt(SingleShunt::default());
    }
    let offset = |effect| {
        let mut rows = model.axis_parameters.iter();
        let row = rows.find(|row| row.behaviour == AxisBehaviour::Foc(effect));
        row.and_then(|row| u16::try_from(row.default).ok()).unwrap_or_default()
    };
    Sensing::TwoShunt(TwoShunt {
        offset: [offset(Foc::AdcOffsetA), offset(Foc::AdcOffsetB)],
        milliamps_per_count: TWO_SHUNT_MA,
        ..TwoShunt::default()
    })
}
