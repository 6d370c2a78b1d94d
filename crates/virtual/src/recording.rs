//! Samples of a module at a set rate.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::PortBehaviour;
use opentmcl_firmware::{Analog, Board as _, ServoState};
use opentmcl_plant::axis::View;
use opentmcl_plant::servo::View as ServoView;
use opentmcl_plant::tmc5160::registers::{CHOPCONF, DRV_STATUS};
use opentmcl_wire::{Duration, Instant, TICKS_PER_SECOND};

use crate::module::VirtualModule;

/// A module at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time since the recording began.
    pub time: Duration,
    /// The program counter.
    pub address: u16,
    /// Position of each axis in microsteps, or of a servo axis in the unit of its parameters.
    pub positions: Vec<i32>,
    /// Speed of each axis in microsteps per second, or of a servo axis in revolutions per minute, positive to the right.
    pub speeds: Vec<i32>,
    /// Levels of the general purpose outputs, bit n for output n.
    pub outputs: u8,
    /// Values of the user variables that were asked for, in that order.
    pub variables: Vec<i32>,
    /// What the machine behind each stepper axis does; none where there is none.
    pub machines: Vec<Option<MachineSample>>,
    /// What each servo axis does; none for other axes.
    pub servos: Vec<Option<ServoSample>>,
    /// Levels of the general purpose inputs, bit n for input n.
    pub inputs: u8,
    /// Readings of the analog inputs, in the order of their rows in the catalogue.
    pub analog: Vec<i32>,
}

/// The machine behind an axis at one time, in the axis' units: its microsteps have the resolution that is
/// set at that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineSample {
    /// Fine steps (1/256 full step) in a microstep.
    pub fine_steps: f64,
    /// Position of the rotor in microsteps.
    pub rotor: f64,
    /// Position of the stage in microsteps: the rotor's, less the play.
    pub stage: f64,
    /// Speed of the rotor in microsteps per second.
    pub speed: f64,
    /// Angle by which the rotor lags behind the field, in electrical degrees.
    pub load_angle: f64,
    /// Part of the torque available that the load takes, 0..=1.
    pub load: f64,
    /// StallGuard2 value.
    pub stallguard: u16,
    /// Amplitude of the phase currents in ampere.
    pub current: f64,
    /// Full steps that have been lost since power-up, with their sign.
    pub lost_steps: i64,
    /// Levels of the left, right and home input.
    pub switches: [bool; 3],
    /// Why the firmware stopped the axis, as axis parameter 207 has it.
    pub stop_flags: u8,
    /// Flags of the driver chip as axis parameter 208 has them.
    pub driver_flags: u8,
}

impl MachineSample {
    /// A view in microsteps of which one is 2^`resolution` fine steps, and the flags.
    fn new(view: &View, resolution: u32, stop_flags: u8, driver_flags: u8) -> Self {
        let fine_steps = f64::from(1u32 << resolution.min(8));
        Self {
            fine_steps,
            rotor: view.rotor / fine_steps,
            stage: view.stage / fine_steps,
            speed: view.speed / fine_steps,
            load_angle: view.load_angle,
            load: view.load,
            stallguard: view.stallguard,
            current: view.current,
            lost_steps: view.lost_steps,
            switches: view.switches,
            stop_flags,
            driver_flags,
        }
    }

    /// Takes a sample of the machine behind an axis. Reads registers that reading does not change.
    fn take<F: NorFlash>(module: &mut VirtualModule<F>, axis: u8) -> Option<Self> {
        if !module.has_machine(axis) {
            return None;
        }
        let view = module.view(axis)?;
        let stop_flags = module.stop_flags(axis);
        let board = module.board_mut();
        let resolution = board.read_register(axis, CHOPCONF) >> 24 & 0xF;
        let [driver_flags, ..] = board.read_register(axis, DRV_STATUS).to_be_bytes();
        Some(Self::new(&view, resolution, stop_flags, driver_flags))
    }
}

/// A servo axis at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoSample {
    /// As its parameters tell it.
    pub state: ServoState,
    /// What its machine really does.
    pub view: ServoView,
}

impl ServoSample {
    fn take<F: NorFlash>(module: &mut VirtualModule<F>, axis: u8) -> Option<Self> {
        Some(Self { state: module.servo_state(axis)?, view: module.servo_view(axis)? })
    }
}

/// Takes samples of a module, the first one when the recording begins.
///
/// The recorder says when the next sample is [due](Recorder::due); whoever moves the module's time
/// stops there and [takes](Recorder::take) it. Nothing is kept but the last sample.
///
/// ```
/// use opentmcl_virtual::{Recorder, VirtualModule};
/// use opentmcl_wire::{Duration, mnemonic};
///
/// let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
/// module.execute(mnemonic::parse("ROR 0, 51200").unwrap());
/// let mut recorder = Recorder::new(module.now(), 100, Vec::new());
/// let mut positions = Vec::new();
/// for _ in 0..3 {
///     module.advance_to(recorder.due());
///     positions.push(recorder.take(&mut module).positions[0]);
/// }
/// // With 51107 pps² the way is 2.6 microsteps after 10 ms and 10.2 after 20 ms.
/// assert_eq!(positions, [0, 3, 10]);
/// ```
#[derive(Clone, Debug)]
pub struct Recorder {
    start: Instant,
    /// Samples taken so far at the present rate.
    taken: u64,
    /// Clocks between two samples are `clocks` / `per`.
    clocks: u64,
    per: u64,
    sample: Sample,
    variables: Vec<u8>,
}

impl Recorder {
    /// A recording that begins at `start`, with `rate` samples per second (0 counts as 1) and these user
    /// variables.
    pub fn new(start: Instant, rate: u32, variables: Vec<u8>) -> Self {
        Self {
            start,
            taken: 0,
            clocks: TICKS_PER_SECOND,
            per: u64::from(rate.max(1)),
            sample: Sample {
                time: Duration::from_ticks(0),
                address: 0,
                positions: Vec::new(),
                speeds: Vec::new(),
                outputs: 0,
                variables: Vec::new(),
                machines: Vec::new(),
                servos: Vec::new(),
                inputs: 0,
                analog: Vec::new(),
            },
            variables,
        }
    }

    /// When the next sample is due. Each is rounded for itself, so that no rate drifts.
    pub fn due(&self) -> Instant {
        let clocks = u128::from(self.taken) * u128::from(self.clocks) / u128::from(self.per);
        self.start + Duration::from_ticks(u64::try_from(clocks).unwrap_or(u64::MAX))
    }

    /// Takes a sample of the module as it is now.
    pub fn take<F: NorFlash>(&mut self, module: &mut VirtualModule<F>) -> &Sample {
        self.taken += 1;
        let Self { sample, variables, .. } = self;
        let axes = 0..module.model().axes;
        sample.time = module.now() - self.start;
        sample.address = module.program_state().address;
        sample.positions.clear();
        sample.positions.extend(axes.clone().filter_map(|axis| module.position(axis)));
        sample.speeds.clear();
        sample.speeds.extend(axes.clone().filter_map(|axis| module.speed(axis)));
        sample.outputs = module.digital_outputs();
        sample.variables.clear();
        sample.variables.extend(variables.iter().map(|&number| module.variable(number)));
        sample.machines.clear();
        sample.machines.extend(axes.clone().map(|axis| MachineSample::take(module, axis)));
        sample.servos.clear();
        sample.servos.extend(axes.map(|axis| ServoSample::take(module, axis)));
        let rows = module.model().ports.iter();
        let analog = rows.filter(|row| row.behaviour == PortBehaviour::AnalogInput);
        let board = module.board_mut();
        sample.inputs = board.digital_inputs();
        sample.analog.clear();
        sample.analog.extend(analog.map(|row| board.analog(Analog::Input(row.index))));
        sample
    }

    /// From now on takes only every second sample: those that would have had an even number.
    pub fn halve_rate(&mut self) {
        self.taken = self.taken.div_ceil(2);
        self.clocks = self.clocks.saturating_mul(2);
    }
}

#[cfg(test)]
mod tests {
    use opentmcl_plant::axis::Rotor;

    use super::*;

    #[test]
    fn what_a_machine_does_is_told_in_microsteps_of_the_axis() {
        let view = View {
            rotor: 5120.0,
            stage: 5112.0,
            speed: -2560.0,
            load_angle: 30.0,
            load: 0.5,
            stallguard: 512,
            current: 1.5,
            lost_steps: -4,
            state: Rotor::Following,
            switches: [false, true, false],
        };
        // 20 full steps are 20 * 16 microsteps with 16 of them to a full step, which is MRES 4.
        let sample = MachineSample::new(&view, 4, 0, 0x80);
        assert_eq!((sample.rotor, sample.stage, sample.speed), (320.0, 319.5, -160.0));
        assert_eq!((sample.load_angle, sample.current), (30.0, 1.5));
        // With whole steps, MRES 8.
        assert_eq!(MachineSample::new(&view, 8, 0, 0).rotor, 20.0);
    }
}
