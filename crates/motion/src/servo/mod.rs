//! Regulators of servo axes: what happens in the control interrupt, in integers alone.
//!
//! The boundary between firmware and hardware is the control interrupt: at each control period it reads
//! [`Senses`] and gives [`Power`]. The pieces in between are here, one file each.
//!
//! Units: currents are in the units of the module's current converter, voltages in 1/32767 of the largest
//! amplitude that the bridge can give a phase, angles in 1/65536 turn, speeds in 1/256 revolution per minute.

pub mod block;
pub mod hall;
pub mod pi;
pub mod ramp;
pub mod tachometer;
pub mod transform;

#[cfg(test)]
mod random;

/// Control periods per second.
pub const PERIODS_PER_SECOND: u32 = 20_000;

/// Periods of the 16 MHz clock in a control period.
pub const PERIOD_TICKS: u64 = crate::TICKS_PER_SECOND / PERIODS_PER_SECOND as u64;

/// What the control interrupt reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses {
    /// Readings of the current converters, offset included: phases A and B where there are two shunts. With a
    /// single one the first is the current of the leg with the larger duty of all legs that are on (of the first
    /// one of them, if duties are equal).
    pub currents: [u16; 2],
    /// Levels of the hall lines, bits 0 to 2.
    pub halls: u8,
    /// How long ago a hall line has changed within the period just past, in 1/256 period; 0 if none has.
    pub hall_age: u8,
    /// Counter of the incremental encoder; it wraps.
    pub encoder: u16,
    /// The counter when the index was passed last.
    pub index_latch: u16,
    /// Whether the index has been passed since the last control interrupt.
    pub index_passed: bool,
    /// Levels of the encoder lines: A, B, index in bits 0 to 2.
    pub encoder_lines: u8,
    /// Angle of the absolute encoder, 65536 per turn.
    pub absolute: u16,
    /// Voltage of the bridge's supply in 10 mV.
    pub supply: u16,
    /// Whether the gate driver reports a fault.
    pub driver_fault: bool,
}

/// What the control interrupt gives. The default lets the motor go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Power {
    /// The three legs of the bridge.
    pub legs: [Leg; 3],
    /// Whether the brake chopper burns power of the supply.
    pub chopper: bool,
    /// Duty of the output for the holding brake, 0..=255; a brake that gets none is shut.
    pub brake: u8,
}

/// One leg of the bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leg {
    /// Both switches are open; only their diodes conduct.
    #[default]
    Open,
    /// Switched to the supply for this part of the period, 1/65535, and to ground for the rest.
    Duty(u16),
}

/// The nearest value that 32 bits can hold.
#[inline]
pub const fn saturated(value: i64) -> i32 {
    if value > i32::MAX as i64 {
        i32::MAX
    } else if value < i32::MIN as i64 {
        i32::MIN
    } else {
        value as i32
    }
}
