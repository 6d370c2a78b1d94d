//! What the firmware sees of its hardware.

use embedded_storage::nor_flash::NorFlash;
pub use opentmcl_motion::servo::{Power, Senses};
use opentmcl_wire::Instant;

/// The hardware around the firmware: chips behind registers, pins, converters, a flash.
///
/// A real board implements it with SPI, GPIO and an ADC; a virtual one with models. Every access
/// takes place at the time that [`Board::set_time`] has told last.
pub trait Board {
    /// The memory behind the EEPROM. Must hold [`crate::storage::FLASH_SIZE`] bytes.
    type Flash: NorFlash;

    /// All following accesses take place at `now`, which never goes back. Hardware has its own time
    /// and ignores this.
    fn set_time(&mut self, now: Instant);

    /// When the hardware will next change something that the firmware reacts to (a target reached, a
    /// switch opening or closing, a stall, a deviation or null channel of an encoder), if that can be
    /// foreseen. Later than the time told last.
    ///
    /// Asked only while something depends on it. A board that cannot foresee gives the time at which
    /// the firmware shall look again, or calls [`crate::Module::hardware_changed`] at each change.
    fn next_event(&mut self) -> Option<Instant>;

    /// Axes of which the event that [`Board::next_event`] has told is due now, bit n for axis n. Hardware
    /// that cannot tell them apart names all.
    fn axes_with_event(&mut self) -> u8 {
        u8::MAX
    }

    /// Value of a register (0..=127) of the motion chip of this axis; 0 where it cannot be read.
    fn read_register(&mut self, axis: u8, address: u8) -> u32;

    /// Writes a register (0..=127) of the motion chip of this axis.
    fn write_register(&mut self, axis: u8, address: u8, value: u32);

    /// Reads what the control interrupt of a servo axis wants to know at this time.
    fn sense(&mut self, axis: u8, senses: &mut Senses) {
        let _ = (axis, senses);
    }

    /// What the control interrupt of a servo axis gives: from now on, until the next one.
    fn drive(&mut self, axis: u8, power: &Power) {
        let _ = (axis, power);
    }

    /// Whether nothing that a servo axis senses will change by itself while it gets the same power. A board that cannot tell says no, and its control interrupt never rests.
    fn is_still(&mut self, axis: u8) -> bool {
        let _ = axis;
        false
    }

    /// Whether the contacts of the left and the right limit switch of a servo axis are closed.
    fn limit_switches(&mut self, axis: u8) -> (bool, bool) {
        let _ = axis;
        (false, false)
    }

    /// Levels of the general purpose inputs, bit n for input n.
    fn digital_inputs(&mut self) -> u8;

    /// Whether the home switch of this axis is closed.
    fn home_switch(&mut self, axis: u8) -> bool;

    /// Levels of the two safe-torque-off inputs, bit n for input n; 1 allows torque.
    fn torque_inputs(&mut self) -> u8;

    /// Reading of a converter.
    fn analog(&mut self, channel: Analog) -> i32;

    /// Selects the voltage range of an analog input: 0 is 0..10 V, 1 is 0..20 V, 2 is -10..10 V.
    fn set_analog_range(&mut self, input: u8, range: u8);

    /// Switches the general purpose outputs, bit n for output n.
    fn set_digital_outputs(&mut self, levels: u8);

    /// Switches the pull-up resistors of the switch inputs: bit 0 axes 0..=2, bit 1 axes 3..=5.
    fn set_pull_ups(&mut self, groups: u8);

    /// The memory behind the EEPROM.
    fn flash(&mut self) -> &mut Self::Flash;

    /// Resets the chips and pins as power-up does.
    fn reset(&mut self);
}

/// A converter of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Analog {
    /// Analog input with this number, 0..=4095.
    Input(u8),
    /// Supply voltage in 0.1 V.
    SupplyVoltage,
    /// Board temperature in °C.
    Temperature,
    /// Supply current in mA.
    SupplyCurrent,
    /// Temperature of the motor in °C.
    MotorTemperature,
}
