//! How much a program has of everything: the same on all modules, so it belongs to the language.

/// Commands that program memory holds (firmware manual 3.3; the vendor's modules of this class).
pub const PROGRAM_LEN: usize = 2048;

/// Calls of subroutines that may be under way at a time; one beyond is ignored (firmware manual 3.6.18).
pub const STACK_DEPTH: usize = 8;

/// Coordinates of each axis, from number 0, which the EEPROM never keeps (firmware manual 3.6.22).
pub const COORDINATES: usize = 21;

/// User variables, from number 0: as many as a byte can name.
pub const VARIABLES: usize = 256;

/// Bank of global parameters that holds the user variables.
pub const VARIABLE_BANK: u8 = 2;
