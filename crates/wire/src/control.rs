//! Numbers of the control commands: for hosts only, without mnemonics (firmware manual 3.6.57, 3.6.58).

/// Stop the program.
pub const STOP_PROGRAM: u8 = 128;
/// Start the program where it stands (type 0) or at an address (type 1).
pub const RUN_PROGRAM: u8 = 129;
/// Execute the next command of the program.
pub const STEP_PROGRAM: u8 = 130;
/// Stop the program and clear its registers.
pub const RESET_PROGRAM: u8 = 131;
/// From now on store commands instead of executing them; the value is the first address.
pub const START_DOWNLOAD: u8 = 132;
/// Execute commands again.
pub const END_DOWNLOAD: u8 = 133;
/// Read a command of the program; answered in a layout of its own.
pub const READ_PROGRAM: u8 = 134;
/// Ask for mode and address (types 0 and 1), accumulator (2) or X (3).
pub const APPLICATION_STATUS: u8 = 135;
/// Ask for the version, as text (type 0, a layout of its own) or as number (type 1).
pub const FIRMWARE_VERSION: u8 = 136;
/// Forget all settings.
pub const FACTORY_RESET: u8 = 137;
/// Ask for a second reply when targets have been reached.
pub const POSITION_REPORT: u8 = 138;
/// Take lines of text in place of frames, until the line BIN.
pub const ASCII_MODE: u8 = 139;
/// Write a register of the motion controller.
pub const WRITE_CONTROLLER: u8 = 146;
/// Write a register of the motor driver.
pub const WRITE_DRIVER: u8 = 147;
/// Read a register of the motion controller.
pub const READ_CONTROLLER: u8 = 148;
/// Read a register of the motor driver.
pub const READ_DRIVER: u8 = 149;
/// Leave the firmware for the boot loader; nothing happens without [`BOOT_LOADER_OPERANDS`].
pub const BOOT_LOADER: u8 = 242;
/// Restart the module.
pub const SOFTWARE_RESET: u8 = 255;

/// The value without which a module refuses [`FACTORY_RESET`] and [`SOFTWARE_RESET`].
pub const CONFIRMATION: i32 = 1234;

/// Type, motor and value with which [`BOOT_LOADER`] does what it says.
pub const BOOT_LOADER_OPERANDS: (u8, u8, u32) = (0x81, 0x92, 0xA3B4_C5D6);

/// The first of them: what has this number or a higher one is never part of a program.
pub const FIRST: u8 = STOP_PROGRAM;
