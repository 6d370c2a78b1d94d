//! What reaches a chip from its motor by other ways than registers.

/// What the driver measures of its motor and of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sense {
    /// StallGuard2 value before the threshold (SGT) is added, 0..=1023.
    pub stallguard: u16,
    /// StealthChop amplitude that the motor would need, 0..=255; none where no motor is described.
    pub pwm_scale: Option<u8>,
    /// Error bits as they stand in DRV_STATUS: ot 25, otpw 26, s2ga 27, s2gb 28, ola 29, olb 30.
    pub flags: u32,
}

/// DRV_STATUS bit ot.
pub(super) const OVERTEMPERATURE: u32 = 1 << 25;

/// DRV_STATUS bits s2ga and s2gb.
pub(super) const SHORTS: u32 = 1 << 27 | 1 << 28;

impl Sense {
    /// The bits of `flags` that exist.
    pub const FLAGS: u32 = 0b11_1111 << 25;

    /// A motor without load: StallGuard2 says what it says of an ideal axis.
    pub const IDEAL: Self = Self { stallguard: 0, pwm_scale: None, flags: 0 };
}

/// What a driver does with the coils.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coils {
    /// Current flows: this many 1/32 of full scale (1..=32) times the global scaler (1..=256).
    Driven {
        /// CS_ACTUAL + 1.
        scale: u8,
        /// GLOBAL_SCALER, with 256 for its 0.
        global: u16,
    },
    /// Open: nothing flows.
    Off,
    /// Both ends of each coil are connected.
    Shorted,
}
