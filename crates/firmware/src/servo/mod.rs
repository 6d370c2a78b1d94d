//! A servo axis: regulators between sensors and bridge, and what is around them.
//!
//! Each 50 µs the control interrupt reads the [`Senses`] of the board and gives it [`Power`]; each millisecond it
//! also steps ramps, looks at flags, switches and inputs. It does so on a fixed grid of the module's time whoever
//! asks and when: the module catches up before anything else happens at a time. An axis in which nothing moves any
//! more sleeps until somebody touches it.
//!
//! - `interrupt`: when all that happens; `control`: currents in, duties out; `slow`: speed, position and their ramps.
//! - `sensors`: where the rotor is; `init`: how an incremental encoder learns it.
//! - `status`: flags, and what switches the bridge off; `outputs`: brake and brake chopper.
//! - `motion`: motion commands; `switches`: reference switches.
//! - `watched`: what those see who look on.
//! - `behaviour`: who commands a TMCM-1613.
//! - `settings`, `parameters`: axis parameters; `units`: what their speeds count.
//!
//! # Readings
//!
//! - Gains: P in 1/256 and I in 1/65536 for each run of the regulator. The current regulators give 1/32767 of the
//!   largest voltage for 2 mA in a TMCM-1636 and for 1 mA in a TMCM-1613. The regulators of the speed give 2 mA for
//!   a revolution per minute of the field in a TMCM-1636, and 1 mA for one of the shaft in a TMCM-1613, there with I
//!   in 1/2^18. The regulators of the position give 1/256 revolution per minute for 1/65536 turn.
//! - Currents are amplitudes, as the chip of a TMCM-1636 has them, and not RMS values.

pub(crate) mod axis;
mod behaviour;
mod control;
mod init;
mod interrupt;
mod motion;
mod outputs;
mod parameters;
mod sensors;
mod settings;
mod shunt;
mod slow;
mod status;
mod switches;
mod units;
mod watched;

use opentmcl_catalog::{Block, Foc, Motion, Servo as Shared};
use opentmcl_motion::servo::pi::Pi;
use opentmcl_motion::servo::ramp::{PositionRamp, SpeedRamp};
use opentmcl_motion::servo::transform::Dq;
use opentmcl_motion::servo::{Power, Senses};
use opentmcl_wire::Instant;

pub(crate) use behaviour::Behaviour;
use control::Measured;
use init::{Init, State};
use interrupt::grid_after;
use outputs::Brake;
use sensors::{Reading, Sensors, Source};
use settings::Settings;
use shunt::Shunt;
use status::Status;

/// Control periods in a millisecond.
const PERIODS_PER_TICK: u64 = 20;

/// Milliseconds in a second: what is slower than the control interrupt runs so often.
const TICKS_PER_SECOND: u32 = 1000;

/// The largest voltage of the regulators.
const FULL_VOLTAGE: i32 = 32_767;

/// Current in mA of the unit in which the regulators of a TMCM-1636 calculate: a count of its converters.
const FOC_UNIT_MA: i32 = 2;

/// The same for a TMCM-1613, whose converter is too coarse.
const BLOCK_UNIT_MA: i32 = 1;

/// Values of parameter 14.
const NO_MOTOR: i32 = 0;
const BRUSHED: i32 = 1;
const STEPPER: i32 = 2;

/// Values of parameter 15.
const DISABLED: i32 = 0;
const OPEN_LOOP: i32 = 1;
const HALL_COMMUTATION: i32 = 2;
const ENCODER_COMMUTATION: i32 = 3;
const ABSOLUTE_COMMUTATION: i32 = 4;

/// Nobody overheats a motor with so many mA while the axis sleeps.
const HARMLESS_CURRENT: i32 = 1000;

/// What is regulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Stop,
    Torque,
    Velocity,
    Position,
}

/// What the axis has around it, seen each millisecond.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surroundings {
    /// Of the bridge, in °C.
    temperature: i32,
    /// Levels of the digital inputs.
    inputs: u8,
    /// Reading of analog input 0.
    analog: i32,
    /// Whether the contacts of the left and the right limit switch and of the home switch are closed.
    left: bool,
    right: bool,
    home: bool,
}

/// All state of the servo axis.
#[derive(Clone, Debug)]
pub(crate) struct Servo {
    motion: Motion,
    settings: Settings,
    reading: Reading,
    sensors: Sensors,
    mode: Mode,
    /// In mA.
    target_torque: i32,
    /// In mA.
    target_flux: i32,
    /// In revolutions per minute.
    target_velocity: i32,
    /// In the unit of the parameters.
    target_position: i32,
    speed_ramp: SpeedRamp,
    position_ramp: PositionRamp,
    /// What the position regulator asks of the ramp of the speed, and what the speed regulator is asked for, in 1/256
    /// revolution per minute.
    approach: i32,
    wanted_speed: i32,
    /// In 1/256 revolution per minute, and in 1/65536 turn.
    velocity_error: i32,
    position_error: i32,
    /// Actual speed as the speed regulator sees it, in 1/65536 revolution per minute.
    smoothed_speed: i64,
    /// What the current regulators are asked for, in their unit.
    demand: Dq,
    torque: Pi,
    flux: Pi,
    velocity: Pi,
    /// What the torque regulator gives, in 1/32767 of the most.
    voltage: i32,
    phase_currents: [i32; 2],
    measured: Measured,
    senses: Senses,
    power: Power,
    init: Init,
    brake: Brake,
    shunt: Shunt,
    status: Status,
    behaviour: Behaviour,
    /// Whether analog mode may start the motor.
    is_armed: bool,
    debug: [i32; 10],
    /// When the control interrupt comes next.
    next: Instant,
    is_asleep: bool,
    /// What was a millisecond ago, to find out whether anything still moves.
    before: Trace,
}

/// What changes in an axis in which anything moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Trace {
    position: i64,
    speeds: [i32; 3],
    errors: [i32; 3],
    power: Power,
    senses: Senses,
    mean: Dq,
}

impl Servo {
    pub(crate) fn new(motion: Motion, now: Instant) -> Self {
        let reading = Reading {
            pole_pairs: 1,
            hall_inverted: false,
            hall_reversed: false,
            encoder_reversed: false,
            absolute_reversed: false,
            has_absolute: false,
            mirrored: false,
        };
        Self {
            motion,
            settings: Settings::new(),
            reading,
            sensors: Sensors::new(Source::Halls, 1, 1),
            mode: Mode::Stop,
            target_torque: 0,
            target_flux: 0,
            target_velocity: 0,
            target_position: 0,
            speed_ramp: SpeedRamp::default(),
            position_ramp: PositionRamp::default(),
            approach: 0,
            wanted_speed: 0,
            velocity_error: 0,
            position_error: 0,
            smoothed_speed: 0,
            demand: Dq::default(),
            torque: Pi::default(),
            flux: Pi::default(),
            velocity: Pi::default(),
            voltage: 0,
            phase_currents: [0; 2],
            measured: Measured::default(),
            senses: Senses::default(),
            power: Power::default(),
            init: Init::default(),
            brake: Brake::default(),
            shunt: Shunt::default(),
            status: Status::default(),
            behaviour: Behaviour::Default,
            is_armed: true,
            debug: [0; 10],
            next: grid_after(now),
            is_asleep: false,
            before: Trace::default(),
        }
    }

    /// Somebody touches the axis at this time: if it sleeps it goes on.
    pub(crate) fn wake(&mut self, now: Instant) {
        if self.is_asleep {
            self.is_asleep = false;
            self.next = grid_after(now);
        }
    }

    /// What happens each millisecond, after the control period at the same time.
    fn tick(&mut self, around: &Surroundings) {
        self.measured.close(self.current_unit());
        self.step_behaviour(around);
        self.step_status(around);
        self.step_switches(around);
        self.step_init();
        self.step_ramps();
        self.step_brake();
    }

    /// Whether nothing has changed in a millisecond, and nothing will change by itself.
    fn has_settled(&mut self) -> bool {
        let trace = Trace {
            position: self.position(),
            speeds: [self.speed(), self.wanted_speed, self.speed_ramp.speed()],
            errors: [self.velocity_error, self.position_error, self.voltage],
            power: self.power,
            senses: self.senses,
            mean: self.measured.mean,
        };
        let is_same = trace == core::mem::replace(&mut self.before, trace);
        let regulators = [self.torque.error(), self.flux.error(), self.velocity.error()];
        let is_quiet = !self.is_driven() || regulators == [0; 3];
        let is_cool = self.measured.mean.q.abs().max(self.measured.mean.d.abs()) < HARMLESS_CURRENT;
        is_same
            && is_quiet
            && is_cool
            && trace.speeds == [0; 3]
            && self.init.state == State::Idle
            && !self.brake_moves()
            && !self.shunt.is_measuring()
            && !self.is_hot()
    }

    /// Units of the settings have changed: how sensors are read.
    fn update_reading(&mut self) {
        let is_on = |value: i32| value != 0;
        self.reading = match self.motion {
            Motion::Foc => Reading {
                pole_pairs: self.settings[Foc::PolePairs].max(1) as u32,
                hall_inverted: is_on(self.settings[Shared::HallPolarity]),
                hall_reversed: is_on(self.settings[Foc::HallDirection]),
                encoder_reversed: is_on(self.settings[Foc::EncoderDirection]),
                absolute_reversed: is_on(self.settings[Foc::AbsoluteDirection]),
                has_absolute: is_on(self.settings[Foc::AbsoluteType]),
                mirrored: is_on(self.settings[Foc::MotorDirection]),
            },
            _ => Reading {
                pole_pairs: (self.settings[Block::MotorPoles] / 2).max(1) as u32,
                hall_inverted: is_on(self.settings[Shared::HallPolarity]),
                ..self.reading
            },
        };
    }

    /// Counts of the encoder in a turn.
    fn encoder_steps(&self) -> u32 {
        if self.motion == Motion::Foc { self.settings[Foc::EncoderSteps].max(1) as u32 } else { 1 }
    }

    /// Counters of other sizes; the position stays what it is.
    fn update_sensors(&mut self) {
        let position = self.position();
        self.sensors.set_steps(self.encoder_steps(), self.reading.pole_pairs);
        self.take_sensors(position);
    }

    /// Other sensors may be in use from now on; the position stays what it is.
    fn take_sensors(&mut self, position: i64) {
        let (steps, pole_pairs) = (self.encoder_steps(), self.reading.pole_pairs);
        self.sensors.set_position(self.position_source(), pole_pairs, position);
        self.sensors.watch(self.velocity_source(), steps, pole_pairs);
    }

    fn is_open_loop(&self) -> bool {
        self.motion == Motion::Foc && self.settings[Foc::CommutationMode] == OPEN_LOOP
    }

    /// Whether the motor is commutated by the halls.
    fn uses_halls(&self) -> bool {
        self.motion == Motion::Block
            || self.settings[Foc::CommutationMode] == HALL_COMMUTATION
            || self.init.uses_halls()
    }

    /// The sensor that commutates.
    fn commutation_source(&self) -> Source {
        if self.motion != Motion::Foc {
            return Source::Halls;
        }
        match self.settings[Foc::CommutationMode] {
            _ if self.init.uses_halls() => Source::Halls,
            OPEN_LOOP => Source::OpenLoop,
            HALL_COMMUTATION => Source::Halls,
            ABSOLUTE_COMMUTATION => Source::Absolute,
            _ => Source::Encoder,
        }
    }

    fn position_source(&self) -> Source {
        self.chosen_source(Foc::PositionSensor)
    }

    fn velocity_source(&self) -> Source {
        self.chosen_source(Foc::VelocitySensor)
    }

    /// The sensor of position or speed. While the encoder learns the angle it counts already.
    fn chosen_source(&self, selection: Foc) -> Source {
        if self.motion != Motion::Foc {
            return Source::Halls;
        }
        match (self.settings[selection], self.settings[Foc::CommutationMode]) {
            (1, _) => Source::Encoder,
            (2, _) => Source::Absolute,
            (_, OPEN_LOOP) => Source::OpenLoop,
            (_, HALL_COMMUTATION) => Source::Halls,
            (_, ABSOLUTE_COMMUTATION) => Source::Absolute,
            _ => Source::Encoder,
        }
    }

    /// The electrical angle by a sensor, its offset included.
    #[inline]
    fn angle_of(&self, source: Source) -> u16 {
        let pole_pairs = self.reading.pole_pairs;
        if self.motion != Motion::Foc {
            return self.sensors.angle(source, pole_pairs, false);
        }
        let interpolated = self.settings[Foc::HallInterpolation] != 0;
        let angle = self.sensors.angle(source, pole_pairs, interpolated);
        let offset = match source {
            Source::OpenLoop => 0,
            Source::Halls => self.settings[Foc::HallOffset],
            Source::Encoder if self.settings[Foc::EncoderOffset] == 0 => 0,
            Source::Encoder => {
                let counts = i64::from(self.settings[Foc::EncoderOffset]) * i64::from(pole_pairs);
                (counts * sensors::TURN / i64::from(self.encoder_steps())) as i32
            }
            Source::Absolute => self.settings[Foc::AbsoluteOffset].wrapping_mul(pole_pairs as i32),
        };
        angle.wrapping_add(offset as u16)
    }

    fn commutation_angle(&self) -> u16 {
        self.angle_of(self.commutation_source())
    }

    /// Current in mA of the unit in which the regulators calculate.
    fn current_unit(&self) -> i32 {
        if self.motion == Motion::Block { BLOCK_UNIT_MA } else { FOC_UNIT_MA }
    }

    /// In the unit of the regulators.
    fn open_loop_current(&self) -> i32 {
        self.settings[Foc::OpenLoopCurrent] / FOC_UNIT_MA
    }
}

/// The one axis of a servo module.
pub(crate) const SERVO_AXIS: u8 = 0;
