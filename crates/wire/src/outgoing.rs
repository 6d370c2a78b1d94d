//! What a module sends, whatever the form of the line.

use crate::ascii::Text;
use crate::serial::FRAME_LEN;

/// What a module sends at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// A reply in binary mode.
    Frame([u8; FRAME_LEN]),
    /// A reply in ASCII mode, or a part of it or of an echo.
    Text(Text),
}

impl Outgoing {
    /// The bytes that the line carries.
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Frame(frame) => frame,
            Self::Text(text) => text.as_bytes(),
        }
    }

    /// The frame, if it is one: text may have nine bytes too.
    pub const fn frame(self) -> Option<[u8; FRAME_LEN]> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Text(_) => None,
        }
    }
}
