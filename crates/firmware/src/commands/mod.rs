//! What each family of commands does. [`Module::execute`] is where a command finds its family.

mod control;
mod coordinates;
mod io;
mod motion;
mod parameters;
mod registers;
mod search;

use opentmcl_wire::limits::PROGRAM_LEN;
use opentmcl_wire::{Command, Opcode, Status};

use crate::axis::AxisNumber;
use crate::board::Board;
use crate::direct::Answer;
use crate::interpreter;
use crate::interrupts;
use crate::line::Port;
use crate::module::Module;

/// Who wants a command executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Caller {
    /// The running program.
    Program,
    /// A host, by a line or directly.
    Host(Option<Port>),
}

/// What a command gives back when it has not failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Nothing: the reply returns the value of the request.
    Done,
    /// A value for the reply only.
    Reply(i32),
    /// A value that was read: for the reply, or for the accumulator of a program.
    Read(i32),
    /// The command has been stored in program memory.
    Loaded,
    /// An answer in a layout of its own.
    Answer(Answer),
}

pub(crate) type Execution = Result<Outcome, Status>;

impl<B: Board> Module<B> {
    /// Executes one command. A refused one changes nothing.
    pub(crate) fn execute(&mut self, command: Command, caller: Caller) -> Execution {
        if let Caller::Host(port) = caller {
            if command.number >= opentmcl_wire::control::FIRST {
                return self.execute_control(command, port);
            }
            if self.download.active {
                return self.load(command);
            }
            if self.standalone_commands.contain(command.number) {
                return Err(Status::NOT_AVAILABLE);
            }
        }
        let opcode = Opcode::from_number(command.number).ok_or(Status::INVALID_COMMAND)?;
        let Command { kind, motor, value, .. } = command;
        match opcode {
            Opcode::Gap => self.get_axis_parameter(self.axis(motor)?, kind),
            Opcode::Sap => self.set_axis_parameter(self.axis(motor)?, kind, value),
            Opcode::Gapx => self.get_axis_parameter(self.axis_in_x()?, kind),
            Opcode::Sapx => self.set_axis_parameter(self.axis_in_x()?, kind, value),
            Opcode::Aap => {
                let value = self.cpu.accumulator;
                self.set_axis_parameter(self.axis(motor)?, kind, value)
            }
            Opcode::Aapx => {
                let value = self.cpu.accumulator;
                self.set_axis_parameter(self.axis_in_x()?, kind, value)
            }
            Opcode::Ggp => self.get_global_parameter(motor, kind),
            Opcode::Sgp => self.set_global_parameter(motor, kind, value),
            Opcode::Agp => self.set_global_parameter(motor, kind, self.cpu.accumulator),
            Opcode::Stgp => self.store_global_parameter(motor, kind),
            Opcode::Rsgp => self.restore_global_parameter(motor, kind),
            Opcode::Ror => self.rotate(self.axis(motor)?, i64::from(value)),
            Opcode::Rol => self.rotate(self.axis(motor)?, -i64::from(value)),
            Opcode::Rora => self.rotate(self.axis(motor)?, i64::from(self.cpu.accumulator)),
            Opcode::Rola => self.rotate(self.axis(motor)?, -i64::from(self.cpu.accumulator)),
            Opcode::Rorxa => self.rotate(self.axis_in_x()?, i64::from(self.cpu.accumulator)),
            Opcode::Rolxa => self.rotate(self.axis_in_x()?, -i64::from(self.cpu.accumulator)),
            Opcode::Mst => self.stop(self.axis(motor)?),
            Opcode::Mstx => self.stop(self.axis_in_x()?),
            Opcode::Mvp => self.move_to(kind, motor, value),
            Opcode::Mvpa => self.move_to(kind, motor, self.cpu.accumulator),
            Opcode::Mvpxa => {
                let motor = u8::try_from(self.cpu.x).map_err(|_| Status::INVALID_VALUE)?;
                self.move_to(kind, motor, self.cpu.accumulator)
            }
            Opcode::Rfs => self.reference_search(kind, self.axis(motor)?),
            Opcode::Sio => self.set_output(motor, kind, value),
            Opcode::Gio => self.get_input(motor, kind),
            Opcode::Sco => self.set_coordinate(kind, motor, value),
            Opcode::Gco => self.get_coordinate(kind, motor),
            Opcode::Cco => self.capture_coordinate(kind, motor),
            Opcode::Aco => self.set_coordinate(kind, motor, self.cpu.accumulator),
            Opcode::Cle => self.clear_errors(kind),
            Opcode::Ei => self.enable_interrupt(kind),
            Opcode::Di => self.disable_interrupt(kind),
            Opcode::Vect => self.set_interrupt_vector(kind, value),
            Opcode::Calc
            | Opcode::Comp
            | Opcode::Calcx
            | Opcode::Calcvv
            | Opcode::Calcva
            | Opcode::Calcav
            | Opcode::Calcvx
            | Opcode::Calcxv
            | Opcode::Calcv
            | Opcode::Siv
            | Opcode::Giv
            | Opcode::Aiv => {
                let done = interpreter::calculate(&mut self.cpu, &mut self.variables, command);
                done.unwrap_or(Err(Status::INVALID_COMMAND)).map(|()| Outcome::Done)
            }
            Opcode::Stap => self.store_axis_parameter(self.axis(motor)?, kind),
            Opcode::Rsap => self.restore_axis_parameter(self.axis(motor)?, kind),
            // A command of other modules, which no catalogue here names yet.
            Opcode::Sac => Err(Status::INVALID_COMMAND),
            // A host has no program counter to change; user functions are the customer's own.
            Opcode::Jc
            | Opcode::Ja
            | Opcode::Csub
            | Opcode::Rsub
            | Opcode::Wait
            | Opcode::Stop
            | Opcode::Rst
            | Opcode::Djnz
            | Opcode::Call
            | Opcode::Reti
            | Opcode::Uf0
            | Opcode::Uf1
            | Opcode::Uf2
            | Opcode::Uf3
            | Opcode::Uf4
            | Opcode::Uf5
            | Opcode::Uf6
            | Opcode::Uf7 => Err(Status::NOT_AVAILABLE),
        }
    }

    /// The axis with this number; a motor that does not exist is an invalid value.
    #[inline]
    pub(crate) fn axis(&self, motor: u8) -> Result<AxisNumber, Status> {
        AxisNumber::new(motor, self.model.axes).ok_or(Status::INVALID_VALUE)
    }

    fn axis_in_x(&self) -> Result<AxisNumber, Status> {
        self.axis(u8::try_from(self.cpu.x).map_err(|_| Status::INVALID_VALUE)?)
    }

    fn clear_errors(&mut self, flag: u8) -> Execution {
        use crate::cpu::ErrorFlags;
        let flags = match flag {
            0 => ErrorFlags::ALL,
            1 => ErrorFlags::TIMEOUT,
            2 => ErrorFlags::ALARM,
            3 => ErrorFlags::DEVIATION,
            4 => ErrorFlags::POSITION,
            5 => ErrorFlags::SHUTDOWN,
            _ => return Err(Status::WRONG_TYPE),
        };
        self.cpu.flags.errors.clear(flags);
        Ok(Outcome::Done)
    }

    fn check_interrupt(&self, number: u8) -> Result<(), Status> {
        match self.model.interrupt(number) {
            Some(_) => Ok(()),
            None => Err(Status::WRONG_TYPE),
        }
    }

    fn enable_interrupt(&mut self, number: u8) -> Execution {
        self.check_interrupt(number)?;
        self.forget_past_events();
        self.interrupts.enable(number, self.now);
        Ok(Outcome::Done)
    }

    fn disable_interrupt(&mut self, number: u8) -> Execution {
        self.check_interrupt(number)?;
        self.interrupts.disable(number);
        Ok(Outcome::Done)
    }

    fn set_interrupt_vector(&mut self, number: u8, address: i32) -> Execution {
        self.check_interrupt(number)?;
        if number == interrupts::GLOBAL {
            return Err(Status::WRONG_TYPE);
        }
        self.interrupts.set_vector(number, program_address(address)?);
        Ok(Outcome::Done)
    }
}

/// An address within program memory.
pub(crate) fn program_address(address: i32) -> Result<u16, Status> {
    match u16::try_from(address) {
        Ok(address) if usize::from(address) < PROGRAM_LEN => Ok(address),
        _ => Err(Status::INVALID_VALUE),
    }
}
