//! The operations of CALC and its relatives (firmware manual 3.6.14, 3.6.26, 3.6.34..39).
//!
//! Arithmetic wraps at 32 bits; DIV and MOD truncate towards zero; DIV and MOD by zero leave the
//! destination as it is.

/// What an operation does to its destination and its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effect {
    /// The destination takes this value.
    Assign(i32),
    /// Destination and source change places.
    Swap,
    /// Nothing changes but the flags.
    Compare,
}

/// The operation with this number, 0..=11.
#[inline(always)]
pub(crate) const fn operate(operation: u8, destination: i32, source: i32) -> Option<Effect> {
    Some(Effect::Assign(match operation {
        0 => destination.wrapping_add(source),
        1 => destination.wrapping_sub(source),
        2 => destination.wrapping_mul(source),
        3 if source == 0 => destination,
        3 => destination.wrapping_div(source),
        4 if source == 0 => destination,
        4 => destination.wrapping_rem(source),
        5 => destination & source,
        6 => destination | source,
        7 => destination ^ source,
        8 => !source,
        9 => source,
        10 => return Some(Effect::Swap),
        11 => return Some(Effect::Compare),
        _ => return None,
    }))
}
