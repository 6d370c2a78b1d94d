//! Which axes a command is for, and how fast they may turn.

use opentmcl_wire::opcode::Field;
use opentmcl_wire::{Command, Opcode};

use crate::check::subject::Subject;
use crate::diagnostic::{Code, Diagnostic};

use super::{Rules, ranges};

/// Motor number that means the EEPROM with commands that copy coordinates.
const EEPROM: u8 = 255;

/// Bits of the motor field of a move to coordinates that make a set of axes of the others.
const SET_OF_AXES: u8 = 0x80 | 0x40;

/// Whether a command moves to a coordinate and not to a position.
pub(super) fn is_coordinate_move(opcode: Opcode, command: Command) -> bool {
    const COORD: u8 = 2;
    matches!(opcode, Opcode::Mvp | Opcode::Mvpa) && command.kind == COORD
}

impl Rules {
    pub(super) fn axis(self, opcode: Opcode, subject: Subject<'_>) -> Option<Diagnostic> {
        const TICKS: u8 = 0;
        let Self { module, .. } = self;
        let Command { kind, motor, .. } = subject.command;
        match opcode {
            // Time passes for all axes.
            Opcode::Wait if kind == TICKS => return None,
            Opcode::Sco | Opcode::Gco | Opcode::Aco if motor == EEPROM => return None,
            _ => {}
        }
        if is_coordinate_move(opcode, subject.command) && motor & SET_OF_AXES != 0 {
            return self.set_of_axes(subject);
        }
        if motor < module.axes {
            return None;
        }
        let location = subject.operand(Field::Motor);
        let message = format!("the {} has no axis {}", module.title, subject.shown(Field::Motor));
        let help = format!("its axes are {}", ranges(0..module.axes));
        Some(Diagnostic::new(Code::NoSuchAxis, location, message).help(help))
    }

    fn set_of_axes(self, subject: Subject<'_>) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let axes = subject.command.motor & !SET_OF_AXES;
        let existing = 1u8.checked_shl(module.axes.into()).map_or(u8::MAX, |bit| bit - 1);
        let shown = subject.shown(Field::Motor);
        let message = if axes == 0 {
            format!("{shown} is a set without any axis")
        } else if axes & !existing != 0 {
            format!("{shown} is a set with an axis that the {} does not have", module.title)
        } else {
            return None;
        };
        let location = subject.operand(Field::Motor);
        Some(Diagnostic::new(Code::NoSuchAxis, location, message).help(
            "add to $80 (each by itself) or $40 (together) 1 for axis 0, 2 for axis 1, 4 for axis 2 \
             and so on",
        ))
    }

    /// The target speed of an axis, which ROL writes with the other sign.
    pub(super) fn velocity(self, opcode: Opcode, subject: Subject<'_>) -> Option<Diagnostic> {
        let row = self.module.target_speed()?;
        let value = i64::from(subject.command.value);
        let speed = if opcode == Opcode::Rol { -value } else { value };
        let name = format!("the speed of {}", subject.name());
        self.range(row, speed, &name, subject)
    }
}
