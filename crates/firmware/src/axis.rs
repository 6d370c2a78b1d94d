//! What the firmware remembers of an axis beside the registers of its chip.

use core::ops::{Index, IndexMut};

use crate::search::Search;
use crate::tend::Currents;

/// Number of an axis that the module has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AxisNumber(u8);

impl AxisNumber {
    /// The most axes any module has; a power of two, so that [`PerAxis`] needs no bounds check.
    pub(crate) const MAX: usize = 8;

    /// The axis with this number if the module has so many.
    pub(crate) const fn new(motor: u8, axes: u8) -> Option<Self> {
        if motor < axes && (motor as usize) < Self::MAX { Some(Self(motor)) } else { None }
    }

    /// All axes of a module that has `axes` of them.
    pub(crate) fn all(axes: u8) -> impl Iterator<Item = Self> + Clone {
        (0..axes.min(Self::MAX as u8)).map(Self)
    }

    /// The number.
    pub(crate) const fn get(self) -> u8 {
        self.0
    }

    /// The bit of this axis in a mask of axes.
    pub(crate) const fn bit(self) -> u8 {
        1 << (self.0 % 8)
    }
}

/// One `T` for each axis.
#[derive(Clone, Debug)]
pub(crate) struct PerAxis<T>([T; AxisNumber::MAX]);

impl<T> PerAxis<T> {
    /// The same kind of value for each axis.
    pub(crate) fn new(value: impl Fn() -> T) -> Self {
        Self(core::array::from_fn(|_| value()))
    }
}

impl<T> Index<AxisNumber> for PerAxis<T> {
    type Output = T;
    fn index(&self, axis: AxisNumber) -> &T {
        &self.0[usize::from(axis.0) % AxisNumber::MAX]
    }
}

impl<T> IndexMut<AxisNumber> for PerAxis<T> {
    fn index_mut(&mut self, axis: AxisNumber) -> &mut T {
        &mut self.0[usize::from(axis.0) % AxisNumber::MAX]
    }
}

/// The most rows of the axis table whose value is kept and nothing follows from it.
pub(crate) const STORED: usize = 16;

/// Settings and state of one axis that live in the firmware's memory and not in a chip.
#[derive(Clone, Debug, Default)]
pub(crate) struct AxisState {
    /// What MVP REL counts from: 0 last target, 1 actual position, 2 encoder position.
    pub(crate) relative_positioning_option: i32,
    /// Reference search mode as written.
    pub(crate) search_mode: i32,
    /// Speed to the reference switch, in the chip's unit.
    pub(crate) search_speed: u32,
    /// Speed at the reference switch, in the chip's unit.
    pub(crate) switch_speed: u32,
    /// The reference search under way.
    pub(crate) search: Search,
    /// During a search, which keeps the chip from stopping by itself: SW_MODE with the stops as set.
    pub(crate) suspended_stops: Option<u32>,
    /// During a search for the index: the encoder mode as set.
    pub(crate) suspended_encoder_mode: Option<u32>,
    /// Distance between the switches that the last search with two of them has found.
    pub(crate) end_switch_distance: i32,
    /// Position of the reference before the last search made it the origin.
    pub(crate) last_reference_position: i32,
    /// Speed above which a stall stops the axis, in the chip's unit; 0 never.
    pub(crate) stall_speed: u32,
    /// What a driver is given that does not choose its current itself.
    pub(crate) currents: Currents,
    /// Why the firmware has stopped the axis (parameter 207).
    pub(crate) errors: u8,
    /// What a deviation of the encoder brings about besides stopping (parameter 240).
    pub(crate) deviation_action: i32,
    /// Full steps of the motor per turn.
    pub(crate) motor_fullsteps: i32,
    /// Counts of the encoder per turn.
    pub(crate) encoder_resolution: i32,
    /// Axes with the same number above 0 obey motion commands together.
    pub(crate) group_index: i32,
    /// Speeds and accelerations are in the chip's own unit and not in pps and pps².
    pub(crate) internal_units: bool,
    /// The chip's ramp registers hold the scaled limits of an interpolated move, not the settings.
    pub(crate) scaled_limits: bool,
    /// Values from which nothing follows, in the order of their rows in the catalogue.
    pub(crate) stored: [i32; STORED],
}
