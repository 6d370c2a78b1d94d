//! What all driver chips share: how they stand to their motor, and how they measure its load.
//!
//! # Readings
//!
//! - One unit of the threshold SGT shifts a result of StallGuard2 by 16, so that the whole range of SGT
//!   shifts it by the whole range of results.

/// What the driver measures of its motor and of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sense {
    /// StallGuard2 value before the threshold (SGT) is added, 0..=1023.
    pub stallguard: u16,
    /// StealthChop amplitude that the motor would need, 0..=255; none where no motor is described.
    pub pwm_scale: Option<u8>,
    /// Error bits as they stand in DRV_STATUS of a TMC5160: ot 25, otpw 26, s2ga 27, s2gb 28, ola 29,
    /// olb 30.
    pub flags: u32,
}

/// Bit ot of [`Sense::flags`].
pub(crate) const OVERTEMPERATURE: u32 = 1 << 25;

/// Bits s2ga and s2gb of [`Sense::flags`].
pub(crate) const SHORTS: u32 = 1 << 27 | 1 << 28;

/// Clocks without a step after which a driver takes the axis for standing.
pub(crate) const STANDSTILL: u64 = 1 << 20;

/// What one unit of SGT adds to a result.
const SGT_SLOPE: i32 = 16;

impl Sense {
    /// The bits of `flags` that exist.
    pub const FLAGS: u32 = 0b11_1111 << 25;

    /// A motor without load: StallGuard2 says what it says of an ideal axis.
    pub const IDEAL: Self = Self { stallguard: 0, pwm_scale: None, flags: 0 };
}

/// What a driver does with the coils.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coils {
    /// Current flows: this many 1/32 of full scale (1..=32), and of that this many 1/256 (1..=256).
    Driven {
        /// The current in 1/32: CS_ACTUAL + 1, or SE + 1.
        scale: u8,
        /// What is left of full scale, in 1/256: GLOBAL_SCALER, with 256 for its 0, or what VSENSE
        /// makes of it.
        global: u16,
    },
    /// Open: nothing flows.
    Off,
    /// Both ends of each coil are connected.
    Shorted,
}

/// The result of StallGuard2, 0..=1023, for a value before the threshold SGT (-64..=63) is added.
pub(crate) fn stallguard(raw: u16, threshold: i32) -> u16 {
    (i32::from(raw) + SGT_SLOPE * threshold).clamp(0, 1023) as u16
}
