//! SCO GCO CCO ACO, and the copies to and from the EEPROM that motor 255 stands for.

use opentmcl_catalog::Globals;
use opentmcl_wire::Status;
use opentmcl_wire::limits::COORDINATES;

use super::{Execution, Outcome};
use crate::axis::AxisNumber;
use crate::board::Board;
use crate::module::Module;
use crate::storage::{self, Key};

/// Motor number that means the EEPROM.
const EEPROM: u8 = 255;

impl<B: Board> Module<B> {
    pub(super) fn set_coordinate(&mut self, coordinate: u8, motor: u8, value: i32) -> Execution {
        if motor == EEPROM {
            for coordinate in selected(coordinate)? {
                for axis in AxisNumber::all(self.model.axes) {
                    self.keep_coordinate(axis, coordinate)?;
                }
            }
            return Ok(Outcome::Done);
        }
        let axis = self.axis(motor)?;
        let place = self.coordinates[axis].get_mut(usize::from(coordinate));
        *place.ok_or(Status::INVALID_VALUE)? = value;
        // Coordinate 0 lives in RAM only.
        if self.globals[Globals::CoordinateStorage] != 0 && coordinate != 0 {
            self.keep_coordinate(axis, coordinate)?;
        }
        Ok(Outcome::Done)
    }

    pub(super) fn get_coordinate(&mut self, coordinate: u8, motor: u8) -> Execution {
        if motor == EEPROM {
            for coordinate in selected(coordinate)? {
                for axis in AxisNumber::all(self.model.axes) {
                    self.fetch_coordinate(axis, coordinate)?;
                }
            }
            return Ok(Outcome::Done);
        }
        let axis = self.axis(motor)?;
        Ok(Outcome::Read(self.coordinate(axis, i32::from(coordinate))?))
    }

    pub(super) fn capture_coordinate(&mut self, coordinate: u8, motor: u8) -> Execution {
        let axis = self.axis(motor)?;
        let position = self.drive(axis).0.position();
        self.set_coordinate(coordinate, motor, position)?;
        Ok(Outcome::Read(position))
    }

    /// A coordinate of an axis; a number beyond the last one is an invalid value.
    pub(super) fn coordinate(&self, axis: AxisNumber, coordinate: i32) -> Result<i32, Status> {
        let place = usize::try_from(coordinate).map_err(|_| Status::INVALID_VALUE)?;
        self.coordinates[axis].get(place).copied().ok_or(Status::INVALID_VALUE)
    }

    fn keep_coordinate(&mut self, axis: AxisNumber, coordinate: u8) -> Result<(), Status> {
        let value = self.coordinate(axis, i32::from(coordinate))?;
        self.keep(Key::Coordinate(coordinate, axis.get()), value)
    }

    fn fetch_coordinate(&mut self, axis: AxisNumber, coordinate: u8) -> Result<(), Status> {
        let key = Key::Coordinate(coordinate, axis.get());
        let stored = storage::fetch(self.board.flash(), key).map_err(|_| Status::EEPROM_LOCKED)?;
        if let Some(place) = self.coordinates[axis].get_mut(usize::from(coordinate)) {
            *place = stored.unwrap_or_default();
        }
        Ok(())
    }
}

/// The coordinates that a copy means: one, or with 0 all but number 0.
fn selected(coordinate: u8) -> Result<core::ops::RangeInclusive<u8>, Status> {
    const LAST: u8 = COORDINATES as u8 - 1;
    match coordinate {
        0 => Ok(1..=LAST),
        1..=LAST => Ok(coordinate..=coordinate),
        _ => Err(Status::INVALID_VALUE),
    }
}
