//! The registers of the TMC26x and their fields: the table that the chip, its tests and the documentation
//! share.
//!
//! Source: datasheets of the TMC260/261, TMC262 and TMC2660, chapter 6, and the vendor's open header for the
//! TMC2660, whose registers are the same. A datagram has 20 bits: an address on top, which has two bits for
//! DRVCTRL and three for the others, and fields below. All registers are 0 after power-up, so that
//! the bridges are off.
//!
//! # Readings
//!
//! - Addresses whose two upper bits are 01 belong to no register.

/// Bits of a datagram that exist.
pub const DATAGRAM: u32 = (1 << 20) - 1;

/// Where the address of a datagram begins; DRVCTRL uses the lowest of these bits for data in SPI mode.
const ADDRESS_SHIFT: u32 = 17;

/// One of the registers; all can only be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Register {
    /// Microsteps and step pulses.
    DrvCtrl,
    /// Chopper.
    ChopConf,
    /// CoolStep.
    SmartEn,
    /// StallGuard2 and current.
    SgcsConf,
    /// Bridges, sense voltage, and what a reply holds.
    DrvConf,
}

impl Register {
    /// All registers.
    pub const ALL: [Self; 5] =
        [Self::DrvCtrl, Self::ChopConf, Self::SmartEn, Self::SgcsConf, Self::DrvConf];

    /// Name as the datasheet prints it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::DrvCtrl => "DRVCTRL",
            Self::ChopConf => "CHOPCONF",
            Self::SmartEn => "SMARTEN",
            Self::SgcsConf => "SGCSCONF",
            Self::DrvConf => "DRVCONF",
        }
    }

    /// The three upper bits of its datagrams.
    const fn address(self) -> u32 {
        match self {
            Self::DrvCtrl => 0b000,
            Self::ChopConf => 0b100,
            Self::SmartEn => 0b101,
            Self::SgcsConf => 0b110,
            Self::DrvConf => 0b111,
        }
    }

    /// The register that a datagram writes, if there is one.
    pub const fn addressed_by(datagram: u32) -> Option<Self> {
        match (datagram & DATAGRAM) >> ADDRESS_SHIFT {
            0b000 | 0b001 => Some(Self::DrvCtrl),
            0b100 => Some(Self::ChopConf),
            0b101 => Some(Self::SmartEn),
            0b110 => Some(Self::SgcsConf),
            0b111 => Some(Self::DrvConf),
            _ => None,
        }
    }

    /// The bits of a datagram that its fields take up; the others ignore writes.
    pub fn mask(self) -> u32 {
        let fields = FIELDS.iter().filter(|field| field.register == self);
        fields.fold(0, |mask, field| mask | field.mask() << field.shift)
    }

    /// The datagram that sets these fields, and all others of the register to 0. Fields of other registers
    /// are left out.
    pub fn datagram(self, fields: &[(Field, u32)]) -> u32 {
        let own = fields.iter().filter(|(field, _)| field.register == self);
        own.fold(self.address() << ADDRESS_SHIFT, |datagram, (field, value)| {
            field.insert(datagram, *value)
        })
    }
}

/// Some bits of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Field {
    /// Name as the datasheet prints it.
    pub name: &'static str,
    /// Where it stands.
    pub register: Register,
    /// Its lowest bit.
    pub shift: u8,
    /// Number of bits.
    pub width: u8,
}

impl Field {
    const fn new(name: &'static str, register: Register, shift: u8, width: u8) -> Self {
        Self { name, register, shift, width }
    }

    const fn mask(&self) -> u32 {
        (1 << self.width) - 1
    }

    /// What a datagram holds of it.
    pub const fn extract(&self, datagram: u32) -> u32 {
        datagram >> self.shift & self.mask()
    }

    /// The same as a number with sign.
    pub const fn extract_signed(&self, datagram: u32) -> i32 {
        let unused = 32 - self.width as u32;
        (self.extract(datagram) << unused).cast_signed() >> unused
    }

    /// A datagram with it changed to the lower bits of `value`.
    pub const fn insert(&self, datagram: u32, value: u32) -> u32 {
        datagram & !(self.mask() << self.shift) | (value & self.mask()) << self.shift
    }
}

/// Interpolation of 16 microsteps to 256.
pub const INTPOL: Field = Field::new("INTPOL", Register::DrvCtrl, 9, 1);
/// Both edges of a step pulse count.
pub const DEDGE: Field = Field::new("DEDGE", Register::DrvCtrl, 8, 1);
/// Microstep resolution: 2^(8 - MRES) per full step, 0..=8.
pub const MRES: Field = Field::new("MRES", Register::DrvCtrl, 0, 4);
/// Blanking time.
pub const TBL: Field = Field::new("TBL", Register::ChopConf, 15, 2);
/// Chopper mode: 0 SpreadCycle, 1 constant off time.
pub const CHM: Field = Field::new("CHM", Register::ChopConf, 14, 1);
/// Random off time.
pub const RNDTF: Field = Field::new("RNDTF", Register::ChopConf, 13, 1);
/// Hysteresis decrement, or mode of the fast decay.
pub const HDEC: Field = Field::new("HDEC", Register::ChopConf, 11, 2);
/// Hysteresis end, or offset of the sine.
pub const HEND: Field = Field::new("HEND", Register::ChopConf, 7, 4);
/// Hysteresis start, or fast decay time.
pub const HSTRT: Field = Field::new("HSTRT", Register::ChopConf, 4, 3);
/// Off time; 0 switches the bridges off.
pub const TOFF: Field = Field::new("TOFF", Register::ChopConf, 0, 4);
/// Lowest current of CoolStep: 0 a half of CS, 1 a quarter.
pub const SEIMIN: Field = Field::new("SEIMIN", Register::SmartEn, 15, 1);
/// Readings for a step down: 32, 8, 2, 1.
pub const SEDN: Field = Field::new("SEDN", Register::SmartEn, 13, 2);
/// Height of the range without a change, in 32.
pub const SEMAX: Field = Field::new("SEMAX", Register::SmartEn, 8, 4);
/// Step up: 1, 2, 4, 8.
pub const SEUP: Field = Field::new("SEUP", Register::SmartEn, 5, 2);
/// Lower end of the range without a change, in 32; 0 switches CoolStep off.
pub const SEMIN: Field = Field::new("SEMIN", Register::SmartEn, 0, 4);
/// Filter of StallGuard2: one reading in four full steps.
pub const SFILT: Field = Field::new("SFILT", Register::SgcsConf, 16, 1);
/// Threshold of StallGuard2, with sign, -64..=63.
pub const SGT: Field = Field::new("SGT", Register::SgcsConf, 8, 7);
/// Current in 1/32 of full scale, less one.
pub const CS: Field = Field::new("CS", Register::SgcsConf, 0, 5);
/// Test mode.
pub const TST: Field = Field::new("TST", Register::DrvConf, 16, 1);
/// Slope of the high side.
pub const SLPH: Field = Field::new("SLPH", Register::DrvConf, 14, 2);
/// Slope of the low side.
pub const SLPL: Field = Field::new("SLPL", Register::DrvConf, 12, 2);
/// Switches the protection against shorts to ground off.
pub const DISS2G: Field = Field::new("DISS2G", Register::DrvConf, 10, 1);
/// Delay of the detection of shorts.
pub const TS2G: Field = Field::new("TS2G", Register::DrvConf, 8, 2);
/// SPI mode: step pulses do nothing, and DRVCTRL sets the coil currents.
pub const SDOFF: Field = Field::new("SDOFF", Register::DrvConf, 7, 1);
/// Full scale of the sense voltage: 0 310 mV, 1 165 mV.
pub const VSENSE: Field = Field::new("VSENSE", Register::DrvConf, 6, 1);
/// What replies hold in their upper half: 0 MSTEP, 1 SG, 2 the upper half of SG, and SE.
pub const RDSEL: Field = Field::new("RDSEL", Register::DrvConf, 4, 2);

/// All fields, with DRVCTRL as it is in step/dir mode.
pub const FIELDS: &[Field] = &[
    INTPOL, DEDGE, MRES, TBL, CHM, RNDTF, HDEC, HEND, HSTRT, TOFF, SEIMIN, SEDN, SEMAX, SEUP,
    SEMIN, SFILT, SGT, CS, TST, SLPH, SLPL, DISS2G, TS2G, SDOFF, VSENSE, RDSEL,
];

/// Lowest bit of MSTEP or SG in a reply; both have ten bits.
pub const REPLY_VALUE_SHIFT: u32 = 10;
/// Lowest bit of the upper five bits of SG in a reply with RDSEL = 2.
pub const REPLY_SG_UPPER_SHIFT: u32 = 15;
/// Lowest bit of SE, five bits, in a reply with RDSEL = 2: the actual current.
pub const REPLY_SE_SHIFT: u32 = 10;

/// Flag of a reply: no step pulse in the last 2^20 clocks.
pub const STST: u32 = 1 << 7;
/// Flag of a reply: coil B is open.
pub const OLB: u32 = 1 << 6;
/// Flag of a reply: coil A is open.
pub const OLA: u32 = 1 << 5;
/// Flag of a reply: bridge B is off after a short to ground.
pub const S2GB: u32 = 1 << 4;
/// Flag of a reply: bridge A is off after a short to ground.
pub const S2GA: u32 = 1 << 3;
/// Flag of a reply: overtemperature warning.
pub const OTPW: u32 = 1 << 2;
/// Flag of a reply: shut down by overtemperature.
pub const OT: u32 = 1 << 1;
/// Flag of a reply: the motor stalls.
pub const SG: u32 = 1;
