//! Control commands 128..139 and 255, downloads, code protection (firmware manual 3.6.57, 3.6.58).

use opentmcl_catalog::{Globals, Motion};
use opentmcl_wire::limits::PROGRAM_LEN;
use opentmcl_wire::{Command, Status, control};

use super::{Execution, Outcome, program_address};
use crate::board::Board;
use crate::cpu::Mode;
use crate::direct::Answer;
use crate::line::Port;
use crate::module::Module;
use crate::program::{CHUNK_LEN, CHUNKS, Download};
use crate::storage::{self, StorageError};

/// Bits of the code protection parameter.
const PROTECT_READING: i32 = 1;
const PROTECT_WRITING: i32 = 2;

impl<B: Board> Module<B> {
    pub(super) fn execute_control(&mut self, command: Command, port: Option<Port>) -> Execution {
        let Command { number, kind, motor, value } = command;
        if !self.is_known(number) {
            return Err(Status::INVALID_COMMAND);
        }
        // What has been downloaded so far is stored before anything else is done with it.
        self.save_download()?;
        match number {
            control::STOP_PROGRAM => self.cpu.stop(),
            control::RUN_PROGRAM => {
                match kind {
                    0 => {}
                    1 => {
                        let address = program_address(value)?;
                        self.cpu.start_at(address);
                    }
                    _ => return Err(Status::WRONG_TYPE),
                }
                self.run_program();
            }
            control::STEP_PROGRAM => self.step_program(),
            control::RESET_PROGRAM => {
                self.cpu.reset();
                self.cpu.mode = Mode::Reset;
                self.interrupts.clear_pending();
            }
            control::START_DOWNLOAD => {
                let address = program_address(value)?;
                if self.globals[Globals::CodeProtection] & PROTECT_WRITING != 0 {
                    return Err(Status::EEPROM_LOCKED);
                }
                if self.model.motion == Motion::Block && self.servo.is_moving() {
                    return Err(Status::NOT_AVAILABLE);
                }
                self.cpu.stop();
                self.switch_bridge_off(true);
                self.download = Download { active: true, address, unsaved: None };
            }
            control::END_DOWNLOAD => {
                self.switch_bridge_off(false);
                self.download.active = false;
            }
            control::READ_PROGRAM => return self.read_program(value),
            control::APPLICATION_STATUS => return self.application_status(kind),
            control::FIRMWARE_VERSION => return self.version(kind),
            control::FACTORY_RESET => {
                confirmed(value)?;
                storage::factory_reset(self.board.flash()).map_err(eeprom_locked)?;
                self.restart();
                return Ok(Outcome::Answer(Answer::Silence));
            }
            control::POSITION_REPORT => {
                let axes = u8::try_from(value).map_err(|_| Status::INVALID_VALUE)?;
                if u32::from(axes) >> self.model.axes != 0 {
                    return Err(Status::INVALID_VALUE);
                }
                match kind {
                    0 => self.ask_for_report(port, axes, false),
                    1 => self.ask_for_report(port, axes, true),
                    _ => return Err(Status::WRONG_TYPE),
                }
            }
            // Without a letter no line could be for this module, not even BIN.
            control::ASCII_MODE => match port.zip(self.letter()) {
                Some((port, _)) => self.terminals.enter(port),
                None => return Err(Status::NOT_AVAILABLE),
            },
            control::WRITE_CONTROLLER | control::WRITE_DRIVER => {
                return self.write_register(kind, motor, value);
            }
            control::READ_CONTROLLER | control::READ_DRIVER => {
                return self.read_register(kind, motor);
            }
            control::BOOT_LOADER => {
                if (kind, motor, value as u32) == control::BOOT_LOADER_OPERANDS {
                    // The boot loader finds nothing to load and starts the firmware.
                    self.restart();
                    return Ok(Outcome::Answer(Answer::Silence));
                }
            }
            control::SOFTWARE_RESET => {
                confirmed(value)?;
                self.restart();
            }
            _ => return Err(Status::INVALID_COMMAND),
        }
        Ok(Outcome::Done)
    }

    /// Stores a command in program memory instead of executing it.
    pub(super) fn load(&mut self, command: Command) -> Execution {
        let address = self.download.address;
        if usize::from(address) >= PROGRAM_LEN {
            return Err(Status::INVALID_VALUE);
        }
        let chunk = usize::from(address) / CHUNK_LEN;
        if self.download.unsaved.is_some_and(|unsaved| unsaved != chunk) {
            self.save_download()?;
        }
        self.program.set(address, command);
        self.download.unsaved = Some(chunk);
        self.download.address = address + 1;
        Ok(Outcome::Loaded)
    }

    /// A TMCM-1613 has no torque while its program memory is filled.
    fn switch_bridge_off(&mut self, off: bool) {
        if self.model.motion == Motion::Block {
            self.wake_servo();
            self.servo.set_downloading(off);
        }
    }

    fn save_download(&mut self) -> Result<(), Status> {
        match self.download.unsaved.take() {
            Some(chunk) => self.save_chunk(chunk).map_err(eeprom_locked),
            None => Ok(()),
        }
    }

    fn save_chunk(&mut self, chunk: usize) -> Result<(), StorageError> {
        let commands = if self.program.is_empty(chunk) { &[] } else { self.program.chunk(chunk) };
        storage::store_chunk(self.board.flash(), chunk as u8, commands)
    }

    /// Sets the protection; lifting the one against reading erases the program first.
    pub(super) fn set_code_protection(&mut self, number: u8, value: i32) -> Result<(), Status> {
        let before = self.globals[Globals::CodeProtection];
        if before & PROTECT_READING != 0 && value & PROTECT_READING == 0 {
            self.cpu.stop();
            let used: [bool; CHUNKS] = core::array::from_fn(|chunk| !self.program.is_empty(chunk));
            self.program.erase();
            for (chunk, _) in used.iter().enumerate().filter(|(_, used)| **used) {
                self.save_chunk(chunk).map_err(eeprom_locked)?;
            }
        }
        self.keep_global(number, value)
    }

    fn read_program(&self, address: i32) -> Execution {
        let address = program_address(address)?;
        let is_protected = self.globals[Globals::CodeProtection] & PROTECT_READING != 0;
        // A protected program looks like none: clients know no error in this layout.
        let command = if is_protected { Command::default() } else { self.program.get(address) };
        Ok(Outcome::Answer(Answer::Memory(command)))
    }

    fn application_status(&self, kind: u8) -> Execution {
        let mode = (self.cpu.mode as i32) << 24;
        let waits = i32::from(self.cpu.wait.is_some()) << 16;
        Ok(Outcome::Reply(match kind {
            0 => mode | waits | i32::from(self.download.address),
            1 => mode | waits | i32::from(self.cpu.pc),
            2 => self.cpu.accumulator,
            3 => self.cpu.x,
            _ => return Err(Status::WRONG_TYPE),
        }))
    }

    fn version(&self, kind: u8) -> Execution {
        let (major, minor) = self.model.firmware;
        match kind {
            0 => Ok(Outcome::Answer(Answer::Version(self.model.version))),
            1 => {
                let number = i32::from(self.model.number) << 16;
                Ok(Outcome::Reply(number | i32::from(major) << 8 | i32::from(minor)))
            }
            _ => Err(Status::WRONG_TYPE),
        }
    }
}

fn confirmed(value: i32) -> Result<(), Status> {
    if value == control::CONFIRMATION { Ok(()) } else { Err(Status::INVALID_VALUE) }
}

fn eeprom_locked(_: StorageError) -> Status {
    Status::EEPROM_LOCKED
}
