//! Commands 146..149: registers of the motion chip, raw.
//!
//! The vendor's evaluation firmware has them; they open the chip to whoever needs more than the
//! parameters. Motion controller and driver are one chip here, so both pairs do the same.

use opentmcl_wire::Status;

use super::{Execution, Outcome};
use crate::board::Board;
use crate::drive::REGISTERS;
use crate::module::Module;

impl<B: Board> Module<B> {
    pub(super) fn write_register(&mut self, address: u8, motor: u8, value: i32) -> Execution {
        let axis = self.axis(motor)?;
        check_address(address)?;
        self.tmc5160(axis).0.write(address, value as u32);
        self.touch(axis);
        Ok(Outcome::Done)
    }

    pub(super) fn read_register(&mut self, address: u8, motor: u8) -> Execution {
        let axis = self.axis(motor)?;
        check_address(address)?;
        Ok(Outcome::Reply(self.tmc5160(axis).0.read(address) as i32))
    }
}

fn check_address(address: u8) -> Result<(), Status> {
    if usize::from(address) < REGISTERS { Ok(()) } else { Err(Status::WRONG_TYPE) }
}
