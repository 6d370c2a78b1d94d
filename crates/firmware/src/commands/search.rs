//! RFS: starts and stops reference searches and tells how they stand.

use opentmcl_wire::Status;

use super::{Execution, Outcome};
use crate::axis::AxisNumber;
use crate::board::Board;
use crate::module::Module;

impl<B: Board> Module<B> {
    pub(super) fn reference_search(&mut self, action: u8, axis: AxisNumber) -> Execution {
        match action {
            0 => {
                for axis in self.group(axis) {
                    self.start_search(axis);
                }
                Ok(Outcome::Done)
            }
            1 => {
                for axis in self.group(axis) {
                    if self.searching & axis.bit() != 0 {
                        self.stop_axis(axis);
                    }
                }
                Ok(Outcome::Done)
            }
            2 => Ok(Outcome::Read(self.axes[axis].search.state())),
            _ => Err(Status::WRONG_TYPE),
        }
    }
}
