//! The TMC429: a motion controller for three axes, which makes the steps for three drivers.
//!
//! What moves is in [`opentmcl_motion::ticked`]; the registers are in [`registers`].
//!
//! # What is modelled
//!
//! - The ramp generators with all their registers, and the interrupt flags that follow from them.
//! - The reference switches: their polarity and multiplexing, stops, edges, the position latch.
//! - The place in the electrical period (USTEP_COUNT).
//!
//! Not modelled: datagrams to and from drivers on the chip's own bus, the choice of currents by
//! acceleration, the position comparator, the power-down, and the flag for a reference switch that was
//! missed. Their registers keep what is written.
//!
//! # Readings
//!
//! - Flags of INTERRUPT are set whether or not their interrupt is enabled; the mask is for the interrupt
//!   alone. Writing a 1 clears a flag.
//! - "Target reached" comes when an axis comes to rest on its target, and when a write makes target and
//!   position equal at rest; not when an axis runs through its target.
//! - V_ACTUAL takes writes in every mode: the vendor's firmware stops an axis by writing 0 to V_TARGET and
//!   V_ACTUAL in velocity mode. The data sheet allows it in hold mode alone.
//! - Hold mode: an axis that enters it keeps its velocity. Then writes to V_TARGET and to V_ACTUAL both set
//!   it at once; of the sources, one says that V_TARGET counts, the other that it does not.
//! - An axis that leaves a position mode for velocity mode goes on to the velocity that its generator had in
//!   view, which is what V_TARGET holds then.
//! - X_LATCHED: any write arms the latch, whatever the value.
//! - The reference switch, which is latched and has a tolerance, is the left one or, with ref_RnL, the right
//!   one. The stops are not affected by that.
//! - Right switches are seen if the interface has inputs for them or multiplexes them. Otherwise they do not
//!   exist, but for the one that the input of axis 2 may be to axis 0.
//! - USTEP_COUNT counts 256 per electrical period; a usrs of 7 counts as 6.
//! - In the vendor's headers the masks of ramp_mode, usrs and the number of drivers have one bit less than the
//!   fields have values. The fields are taken to be as wide as their values need.

mod axis;
pub mod registers;

use opentmcl_motion::Instant;
use opentmcl_motion::ticked::{Motion, Stretch};

use axis::Axis;
use registers::{
    Access, COMMON, COMMON_REGISTERS, ENABLE_RIGHT_SWITCHES, GLOBAL_PARAMETERS, IF_CONFIGURATION,
    INVERT_SWITCHES, REFERENCE_SWITCHES, SWITCHES_MULTIPLEXED, THIRD_IS_RIGHT_OF_FIRST, X_LATCHED,
    register,
};

/// Axes of one chip.
pub const AXES: usize = 3;

/// Status bit of an interrupt.
const STATUS_INTERRUPT: u8 = 1 << 7;

/// One TMC429.
///
/// Times must not run backwards from one call to the next. An axis is a number from 0 to 2; others stand
/// at 0 and take nothing.
///
/// ```
/// use opentmcl_motion::Instant;
/// use opentmcl_plant::tmc429::{Tmc429, registers::*};
///
/// let mut chip = Tmc429::new();
/// let now = Instant::from_ticks(0);
/// for (index, value) in [
///     (DIVISORS, 3 << 12 | 7 << 8 | 6),
///     (V_MIN, 1),
///     (V_MAX, 1000),
///     (A_MAX, 500),
///     (PMUL_PDIV, 247 << 8 | 7),
///     (X_TARGET, 51_200),
/// ] {
///     chip.write(of_axis(2, index), value, now);
/// }
/// let mut time = now;
/// while let Some(next) = chip.next_event(time) {
///     time = next;
/// }
/// assert_eq!(chip.read(of_axis(2, X_ACTUAL), time), 51_200);
/// ```
#[derive(Clone, Debug)]
pub struct Tmc429 {
    axes: [Axis; AXES],
    /// What was written last to the common registers, by index.
    common: [u32; 16],
    /// Levels of the pins: left and right of each axis.
    inputs: [(bool, bool); AXES],
}

impl Default for Tmc429 {
    fn default() -> Self {
        Self::new()
    }
}

impl Tmc429 {
    /// A chip that is switched on at time 0.
    pub fn new() -> Self {
        let mut common = [0; 16];
        for register in &COMMON_REGISTERS {
            if let Some(cell) = common.get_mut(usize::from(register.index)) {
                *cell = register.reset;
            }
        }
        Self {
            axes: [Axis::new(), Axis::new(), Axis::new()],
            common,
            inputs: [(false, false); AXES],
        }
    }

    /// Switches the chip off and on: all registers take their reset values, the axes stand at position 0.
    /// The levels of the pins stay, and so does what [`Tmc429::travel`] counts.
    pub fn reset(&mut self, now: Instant) {
        for axis in &mut self.axes {
            axis.reset(now);
        }
        self.common = Self::new().common;
        self.read_switches(now);
    }

    /// Reads a register. A register that can only be written, or does not exist, reads as 0.
    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        let Some(register) = register(address) else { return 0 };
        if register.access == Access::WriteOnly {
            return 0;
        }
        let value = match self.axes.get_mut(usize::from(address >> 4)) {
            Some(axis) => axis.read(register.index, now),
            None if address == REFERENCE_SWITCHES => self.switches(),
            None => self.common(address),
        };
        value & register.mask
    }

    /// Writes a register: the bits that exist, and only if it takes writes.
    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        let Some(register) = register(address) else { return };
        let value = value & register.mask;
        match (self.axes.get_mut(usize::from(address >> 4)), register.access) {
            (Some(axis), Access::ReadOnly) if register.index == X_LATCHED => axis.arm_latch(),
            (_, Access::ReadOnly) => {}
            (Some(axis), _) => axis.write(register.index, value, now),
            (None, Access::WriteOneToClear(clearable)) => {
                let kept = self.common(address) & clearable & !value;
                self.store(register.index, value & !clearable | kept);
            }
            (None, _) => {
                self.store(register.index, value);
                if matches!(address, IF_CONFIGURATION | GLOBAL_PARAMETERS) {
                    self.read_switches(now);
                }
            }
        }
    }

    /// Levels of the reference inputs of an axis. Without multiplexing or an interface for right switches
    /// the right one leads nowhere.
    pub fn set_reference_inputs(&mut self, axis: usize, left: bool, right: bool, now: Instant) {
        if let Some(inputs) = self.inputs.get_mut(axis) {
            *inputs = (left, right);
            self.read_switches(now);
        }
    }

    /// When an axis next arrives, stops or reaches a constant speed; none if nothing of that kind is to
    /// come without a write.
    pub fn next_event(&mut self, now: Instant) -> Option<Instant> {
        self.axes.iter_mut().filter_map(|axis| axis.next_event(now)).min()
    }

    /// The same for one axis.
    pub fn next_event_of(&mut self, axis: usize, now: Instant) -> Option<Instant> {
        self.axes.get_mut(axis)?.next_event(now)
    }

    /// The status that the chip sends with every datagram: bits 0, 2 and 4 for axes on their targets, 1, 3
    /// and 5 for closed left switches, 7 for an interrupt.
    pub fn status(&mut self, now: Instant) -> u8 {
        let mut status = 0;
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let at_target = axis.ramp(now).at_target();
            let (left, _) = axis.switches();
            status |= (u8::from(at_target) | u8::from(left) << 1) << (2 * number);
            if axis.interrupts(now) {
                status |= STATUS_INTERRUPT;
            }
        }
        status
    }

    /// Position counter of an axis in microsteps.
    pub fn position(&mut self, axis: usize, now: Instant) -> i32 {
        self.axes.get_mut(axis).map_or(0, |axis| axis.ramp(now).position())
    }

    /// Microsteps that an axis has made, up minus down: what its driver has seen. Neither writing to the
    /// position counter nor a reset changes it.
    pub fn travel(&mut self, axis: usize, now: Instant) -> i64 {
        self.axes.get_mut(axis).map_or(0, |axis| axis.travel(now))
    }

    /// Velocity of an axis in register units, truncated toward zero.
    pub fn velocity(&mut self, axis: usize, now: Instant) -> i32 {
        self.axes.get_mut(axis).map_or(0, |axis| axis.ramp(now).velocity())
    }

    /// How an axis moves, without the steps in its velocity; none for one that does not exist.
    pub fn motion(&mut self, axis: usize, now: Instant) -> Option<Motion> {
        self.axes.get_mut(axis).map(|axis| axis.ramp(now).motion())
    }

    /// The place of an axis in units of a [`Stretch`]: what [`Tmc429::travel`] counts, and the part of the
    /// next microstep while it moves.
    pub fn place(&mut self, axis: usize, now: Instant) -> i128 {
        self.axes.get_mut(axis).map_or(0, |axis| axis.before() + axis.ramp(now).place())
    }

    /// How an axis goes on from now, in places as [`Tmc429::place`] counts them; none for an axis that does not
    /// exist.
    pub fn stretch(&mut self, axis: usize, now: Instant) -> Option<Stretch> {
        let axis = self.axes.get_mut(axis)?;
        let mut stretch = axis.ramp(now).stretch();
        stretch.end += axis.before();
        Some(stretch)
    }

    /// What a common register holds that the chip does not compute.
    pub(crate) fn register(&self, address: u8) -> u32 {
        self.common(address)
    }

    /// Velocity of an axis in 1/256 of a register unit.
    pub fn exact_velocity(&mut self, axis: usize, now: Instant) -> i32 {
        self.axes.get_mut(axis).map_or(0, |axis| axis.ramp(now).exact_velocity())
    }

    /// Since when an axis stands; none while it moves or if it never has since the last reset.
    pub fn stopped_at(&mut self, axis: usize, now: Instant) -> Option<Instant> {
        self.axes.get_mut(axis)?.ramp(now).stopped_at()
    }

    /// REFERENCE_SWITCHES.
    fn switches(&self) -> u32 {
        let levels = self.axes.iter().map(Axis::switches).enumerate();
        levels.fold(0, |bits, (number, (left, right))| {
            bits | (u32::from(right) | u32::from(left) << 1) << (2 * number)
        })
    }

    /// Gives each axis the levels that it sees of the pins.
    fn read_switches(&mut self, now: Instant) {
        let (interface, parameters) =
            (self.common(IF_CONFIGURATION), self.common(GLOBAL_PARAMETERS));
        let inverted = interface & INVERT_SWITCHES != 0;
        let has_right =
            interface & ENABLE_RIGHT_SWITCHES != 0 || parameters & SWITCHES_MULTIPLEXED != 0;
        let third_is_right = !has_right && parameters & THIRD_IS_RIGHT_OF_FIRST != 0;
        let [_, _, (third, _)] = self.inputs;
        for (number, (axis, (left, right))) in self.axes.iter_mut().zip(self.inputs).enumerate() {
            let left = left != inverted && !(third_is_right && number == 2);
            let right = has_right && right != inverted
                || third_is_right && number == 0 && third != inverted;
            axis.set_switches(left, right, now);
        }
    }

    fn common(&self, address: u8) -> u32 {
        let index = usize::from(address.wrapping_sub(COMMON));
        self.common.get(index).copied().unwrap_or(0)
    }

    fn store(&mut self, index: u8, value: u32) {
        if let Some(cell) = self.common.get_mut(usize::from(index)) {
            *cell = value;
        }
    }
}
