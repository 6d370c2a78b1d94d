//! SIO and GIO.

use opentmcl_catalog::{Port, PortBehaviour};
use opentmcl_wire::Status;

use super::{Execution, Outcome};
use crate::board::{Analog, Board};
use crate::module::Module;
use crate::servo::Behaviour;

/// Ranges of the raw readings of supply (0.1 V) and temperature (°C). No source tells the real ones.
const SUPPLY_RANGE: (i32, i32) = (0, 600);
const TEMPERATURE_RANGE: (i32, i32) = (-50, 150);

/// Value that stands for the accumulator when all outputs are set at once.
const ACCUMULATOR: i32 = -1;

impl<B: Board> Module<B> {
    pub(super) fn get_input(&mut self, bank: u8, number: u8) -> Execution {
        let row = self.model.input_port(bank, number).ok_or(Status::WRONG_TYPE)?;
        let torque = |board: &mut B| board.torque_inputs();
        Ok(Outcome::Read(match row.behaviour {
            PortBehaviour::DigitalInput => bit(self.board.digital_inputs(), row),
            PortBehaviour::AllInputs => i32::from(self.board.digital_inputs()),
            PortBehaviour::StoInput => bit(torque(&mut self.board), row),
            PortBehaviour::TorqueEnabled => i32::from(torque(&mut self.board) & 3 == 3),
            PortBehaviour::AnalogInput => self.board.analog(Analog::Input(row.index)),
            PortBehaviour::SupplyVoltage => self.board.analog(Analog::SupplyVoltage),
            PortBehaviour::Temperature => self.board.analog(Analog::Temperature),
            PortBehaviour::SupplyCurrent => self.board.analog(Analog::SupplyCurrent),
            PortBehaviour::ShuntReading => self.shunt_reading(),
            PortBehaviour::SupplyReading => {
                reading(self.board.analog(Analog::SupplyVoltage), SUPPLY_RANGE)
            }
            PortBehaviour::TemperatureReading => {
                let (channel, range) = if row.index == 0 {
                    (Analog::Temperature, TEMPERATURE_RANGE)
                } else {
                    (Analog::MotorTemperature, TEMPERATURE_RANGE)
                };
                reading(self.board.analog(channel), range)
            }
            PortBehaviour::DigitalOutput | PortBehaviour::SerialOutput => {
                bit(self.digital_outputs, row)
            }
            PortBehaviour::AllOutputs => i32::from(self.digital_outputs),
            // Write-only, which the catalogue says.
            PortBehaviour::PullUps | PortBehaviour::AdcRange => return Err(Status::WRONG_TYPE),
        }))
    }

    pub(super) fn set_output(&mut self, bank: u8, number: u8, value: i32) -> Execution {
        let row = self.model.output_port(bank, number).ok_or(Status::WRONG_TYPE)?;
        if !(row.min..=row.max).contains(&value) {
            return Err(Status::INVALID_VALUE);
        }
        match row.behaviour {
            PortBehaviour::DigitalOutput => {
                let output = 1u8 << (row.index % 8);
                let others = self.digital_outputs & !output;
                self.write_outputs(others | if value != 0 { output } else { 0 });
            }
            // In other behaviours the line belongs to the replies.
            PortBehaviour::SerialOutput if self.behaviour() != Behaviour::Mixed => {
                return Err(Status::NOT_AVAILABLE);
            }
            PortBehaviour::SerialOutput => self.write_outputs(value as u8 & 1),
            PortBehaviour::AllOutputs => {
                let levels = if value == ACCUMULATOR { self.cpu.accumulator } else { value };
                self.write_outputs(levels as u8);
            }
            PortBehaviour::PullUps => self.board.set_pull_ups(value as u8),
            PortBehaviour::AdcRange => self.board.set_analog_range(row.index, value as u8),
            // Read-only, which the catalogue says.
            PortBehaviour::DigitalInput
            | PortBehaviour::AllInputs
            | PortBehaviour::StoInput
            | PortBehaviour::TorqueEnabled
            | PortBehaviour::AnalogInput
            | PortBehaviour::SupplyVoltage
            | PortBehaviour::Temperature
            | PortBehaviour::SupplyCurrent
            | PortBehaviour::ShuntReading
            | PortBehaviour::SupplyReading
            | PortBehaviour::TemperatureReading => return Err(Status::WRONG_TYPE),
        }
        Ok(Outcome::Done)
    }

    pub(crate) fn write_outputs(&mut self, levels: u8) {
        self.digital_outputs = levels;
        self.board.set_digital_outputs(levels);
    }
}

/// What a converter of 12 bits reads of a value within its range.
fn reading(value: i32, (least, most): (i32, i32)) -> i32 {
    const FULL_SCALE: i32 = 4095;
    (value.clamp(least, most) - least) * FULL_SCALE / (most - least)
}

fn bit(levels: u8, row: &Port) -> i32 {
    i32::from(levels >> (row.index % 8) & 1)
}
