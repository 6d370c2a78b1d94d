//! The one axis of a servo module: its machine, and what the board tells of it.

use opentmcl_catalog::{AxisBehaviour, Foc, Module, Motion};
use opentmcl_firmware::{Power, Senses};
use opentmcl_plant::axis;
use opentmcl_plant::servo::{Influence, Noise, Sensing, Servo, SingleShunt, TwoShunt, View};
use opentmcl_wire::{Duration, Instant};

use crate::scenario::ServoSetup;

/// Distance of two control interrupts.
const CONTROL_PERIOD: Duration = Duration::from_micros(50);

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
    /// The machine of a module.
    pub(crate) fn new(model: &Module, setup: ServoSetup) -> Self {
        let sensing = sensing(model, setup.noise);
        Self { servo: Servo::new(setup.machine, sensing), sensed: Instant::from_ticks(0) }
    }

    /// What the control interrupt reads. While it slept, the machine did nothing that it could have seen.
    #[inline]
    pub(crate) fn sense(&mut self, senses: &mut Senses, now: Instant) {
        self.catch_up(now);
        self.sensed = now;
        *senses = self.servo.sense(now);
    }

    #[inline]
    pub(crate) fn drive(&mut self, power: &Power, now: Instant) {
        self.servo.drive(power, now);
    }

    /// The module has been reset: the motor is let go.
    pub(crate) fn reset(&mut self, now: Instant) {
        self.catch_up(now);
        self.servo.drive(&Power::default(), now);
    }

    pub(crate) fn is_still(&self) -> bool {
        self.servo.is_still()
    }

    /// Voltage at the bridge in volt.
    pub(crate) fn supply(&self, now: Instant) -> f64 {
        self.view(now).bus
    }

    /// Temperatures of motor and driver in degrees Celsius.
    pub(crate) fn temperatures(&self, now: Instant) -> [f64; 2] {
        self.servo.temperatures(now)
    }

    /// Left, right and home contact.
    pub(crate) fn switches(&self, now: Instant) -> [bool; 3] {
        self.servo.switches(now)
    }

    /// Does something to the machine.
    pub(crate) fn influence(&mut self, influence: Influence, now: Instant) {
        self.catch_up(now);
        self.servo.influence(influence, now);
    }

    /// What the axis really does.
    pub(crate) fn view(&self, now: Instant) -> View {
        self.servo.view(now)
    }

    /// While the control interrupt sleeps nobody asks for anything; the machine catches up before it is touched.
    #[inline]
    fn catch_up(&mut self, now: Instant) {
        if now > self.sensed + CONTROL_PERIOD {
            self.servo.skip(now - CONTROL_PERIOD);
        }
    }
}

/// What is done to the machine of any axis, as that of a servo axis knows it. Coils and safe-torque-off inputs
/// it has none.
pub(crate) fn translated(influence: axis::Influence) -> Option<Influence> {
    Some(match influence {
        axis::Influence::Supply(volts) => Influence::SourceVoltage(volts),
        axis::Influence::DriverTemperature(celsius) => Influence::DriverTemperature(celsius),
        axis::Influence::Torque(torque) => Influence::Torque(torque),
        axis::Influence::Blocked(blocked) => Influence::Blocked(blocked),
        axis::Influence::Position(fine_steps) => Influence::Position(fine_steps),
        axis::Influence::TorqueAllowed(_) | axis::Influence::Coil(..) => return None,
    })
}

/// How a module measures its currents: as its factory settings say.
fn sensing(model: &Module, noise: Noise) -> Sensing {
    if model.motion == Motion::Block {
        return Sensing::SingleShunt(SingleShunt { noise, ..SingleShunt::default() });
    }
    let offset = |effect| {
        let mut rows = model.axis_parameters.iter();
        let row = rows.find(|row| row.behaviour == AxisBehaviour::Foc(effect));
        row.and_then(|row| u16::try_from(row.default).ok()).unwrap_or_default()
    };
    Sensing::TwoShunt(TwoShunt {
        offset: [offset(Foc::AdcOffsetA), offset(Foc::AdcOffsetB)],
        milliamps_per_count: TWO_SHUNT_MA,
        noise,
        ..TwoShunt::default()
    })
}
