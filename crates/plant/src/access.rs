//! Which way a register goes.

/// What reading and writing a register does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Writing has no effect on what is read.
    ReadOnly,
    /// Reads as 0.
    WriteOnly,
    /// Reads as written, or as the chip has changed it since.
    ReadWrite,
    /// Writing a 1 to one of these bits clears it and a 0 leaves it; what other bits do is the chip's.
    WriteOneToClear(u32),
}
