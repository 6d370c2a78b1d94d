//! Samples of a module at a set rate.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_wire::{Duration, Instant, TICKS_PER_SECOND};

use crate::module::VirtualModule;

/// A module at one time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Time since the recording began.
    pub time: Duration,
    /// The program counter.
    pub address: u16,
    /// Position of each axis in microsteps.
    pub positions: Vec<i32>,
    /// Speed of each axis in microsteps per second, positive to the right.
    pub speeds: Vec<i32>,
    /// Levels of the general purpose outputs, bit n for output n.
    pub outputs: u8,
    /// Values of the user variables that were asked for, in that order.
    pub variables: Vec<i32>,
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
        sample.speeds.extend(axes.filter_map(|axis| module.speed(axis)));
        sample.outputs = module.digital_outputs();
        sample.variables.clear();
        sample.variables.extend(variables.iter().map(|&number| module.variable(number)));
        sample
    }

    /// From now on takes only every second sample: those that would have had an even number.
    pub fn halve_rate(&mut self) {
        self.taken = self.taken.div_ceil(2);
        self.clocks = self.clocks.saturating_mul(2);
    }
}
