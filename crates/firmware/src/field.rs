//! Bits of registers.

/// Some bits of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) register: u8,
    shift: u8,
    width: u8,
}

impl Field {
    pub(crate) const fn new(register: u8, shift: u8, width: u8) -> Self {
        Self { register, shift, width }
    }

    /// The whole register.
    pub(crate) const fn whole(register: u8) -> Self {
        Self::new(register, 0, 32)
    }

    const fn mask(self) -> u32 {
        if self.width >= 32 { u32::MAX } else { (1 << self.width) - 1 }
    }

    pub(crate) const fn extract(self, register: u32) -> u32 {
        (register >> (self.shift % 32)) & self.mask()
    }

    pub(crate) const fn insert(self, register: u32, value: u32) -> u32 {
        let shift = self.shift % 32;
        (register & !(self.mask() << shift)) | ((value & self.mask()) << shift)
    }

    /// The field's value as a signed number.
    pub(crate) const fn signed(self, value: u32) -> i32 {
        sign_extend(value, self.width)
    }
}

/// The lower `width` bits as a signed number.
pub(crate) const fn sign_extend(value: u32, width: u8) -> i32 {
    let unused = 32 - if width > 32 || width == 0 { 32 } else { width } as u32;
    ((value << unused) as i32) >> unused
}
