//! What a request and a reply mean, independent of the line they travel on.

/// One TMCL command: the seven bytes that every line carries and that program memory holds.
///
/// All values of all fields can be represented; whether they make sense is the module's decision.
/// Source: firmware manual 3.1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Command {
    /// Command number, see [`crate::Opcode`].
    pub number: u8,
    /// Type field: parameter number, operation, condition, port, depending on the command.
    pub kind: u8,
    /// Motor (axis) number or parameter bank.
    pub motor: u8,
    /// Value field.
    pub value: i32,
}

impl Command {
    /// Length of [`Command::to_bytes`].
    pub const LEN: usize = 7;

    /// A command from its four fields.
    pub const fn new(number: u8, kind: u8, motor: u8, value: i32) -> Self {
        Self { number, kind, motor, value }
    }

    /// The seven bytes in the order in which they are sent: number, type, motor, value MSB first.
    pub const fn to_bytes(self) -> [u8; Self::LEN] {
        let [b3, b2, b1, b0] = self.value.to_be_bytes();
        [self.number, self.kind, self.motor, b3, b2, b1, b0]
    }

    /// The inverse of [`Command::to_bytes`].
    pub const fn from_bytes(bytes: [u8; Self::LEN]) -> Self {
        let [number, kind, motor, b3, b2, b1, b0] = bytes;
        Self { number, kind, motor, value: i32::from_be_bytes([b3, b2, b1, b0]) }
    }
}

/// The answer to one [`Command`].
///
/// Source: firmware manual 3.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Reply {
    /// How the command went.
    pub status: Status,
    /// The number of the command that is answered; 0 after a damaged frame.
    pub number: u8,
    /// The value asked for; commands that define none return the value of the request.
    pub value: i32,
}

/// Status byte of a reply.
///
/// A newtype and not an `enum` because a client must be able to hold codes that it does not know.
/// Source: firmware manual 3.2.1; the codes from 7 on and 128 as in the vendor's open sources.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Status(pub u8);

impl Status {
    /// Wrong checksum.
    pub const WRONG_CHECKSUM: Self = Self(1);
    /// Invalid command: the module does not know the command number.
    pub const INVALID_COMMAND: Self = Self(2);
    /// Wrong type: no such parameter, port, bank or operation.
    pub const WRONG_TYPE: Self = Self(3);
    /// Invalid value; also a motor number that the module does not have.
    pub const INVALID_VALUE: Self = Self(4);
    /// Configuration EEPROM locked: the memory did not take the value.
    pub const EEPROM_LOCKED: Self = Self(5);
    /// Command not available on this module or in its present state.
    pub const NOT_AVAILABLE: Self = Self(6);
    /// Successfully executed.
    pub const OK: Self = Self(100);
    /// Command loaded into program memory.
    pub const LOADED: Self = Self(101);
    /// Second reply of command 138: the target position has been reached.
    pub const DELAYED: Self = Self(128);

    /// Whether the command was executed or stored (100 and above).
    pub const fn is_ok(self) -> bool {
        self.0 >= 100
    }

    /// The meaning in words, if the code is a known one.
    pub const fn meaning(self) -> Option<&'static str> {
        Some(match self.0 {
            1 => "wrong checksum",
            2 => "invalid command",
            3 => "wrong type",
            4 => "invalid value",
            5 => "configuration EEPROM locked",
            6 => "command not available",
            7 => "load error",
            8 => "write protected",
            9 => "maximum exceeded",
            10 => "download not possible",
            11 => "chip read failed",
            100 => "successfully executed",
            101 => "loaded into program memory",
            128 => "target position reached",
            129 => "active communication",
            _ => return None,
        })
    }
}

impl core::fmt::Debug for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

impl core::fmt::Display for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.meaning() {
            Some(meaning) => write!(f, "{} ({meaning})", self.0),
            None => write!(f, "{} (unknown status)", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_travels_most_significant_byte_first() {
        // Firmware manual 3.6.14, CALC MUL, -5000.
        let command = Command::new(19, 2, 0, -5000);
        assert_eq!(command.to_bytes(), [0x13, 0x02, 0x00, 0xFF, 0xFF, 0xEC, 0x78]);
        assert_eq!(Command::from_bytes(command.to_bytes()), command);
    }
}
