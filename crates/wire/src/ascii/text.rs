//! Text on its way to a terminal.

use super::REPLY_MAX;

/// Up to [`REPLY_MAX`] bytes that a terminal shows: a whole reply with its CR, or a piece of an echo.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text {
    bytes: [u8; REPLY_MAX],
    len: u8,
}

impl Text {
    /// No text.
    pub const fn new() -> Self {
        Self { bytes: [0; REPLY_MAX], len: 0 }
    }

    /// The bytes to send.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or_default()
    }

    /// Appends what there is room for and returns the rest.
    pub fn push<'a>(&mut self, bytes: &'a [u8]) -> &'a [u8] {
        let free = self.bytes.get_mut(usize::from(self.len)..).unwrap_or_default();
        let (taken, rest) = bytes.split_at_checked(free.len()).unwrap_or((bytes, &[]));
        for (place, byte) in free.iter_mut().zip(taken) {
            *place = *byte;
        }
        // No more than the 19 places that there are.
        self.len += taken.len() as u8;
        rest
    }
}

impl Default for Text {
    fn default() -> Self {
        Self::new()
    }
}

impl core::fmt::Debug for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "\"{}\"", self.as_bytes().escape_ascii())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    #[test]
    fn what_finds_no_room_comes_back() {
        let mut text = Text::new();
        assert_eq!(text.push(b""), b"");
        assert_eq!(text.push(b"AMVP ABS"), b"");
        assert_eq!(text.push(b", 1, 50000\rBA"), b"BA");
        assert_eq!(text.as_bytes(), b"AMVP ABS, 1, 50000\r");
        assert_eq!(text.push(b"BA"), b"BA");
        assert_eq!(text.push(b""), b"");
    }

    #[test]
    fn control_characters_are_printed_as_escapes() {
        let mut text = Text::new();
        text.push(b"A\x08 \x08\r");
        assert_eq!(format!("{text:?}"), r#""A\x08 \x08\r""#);
    }
}
