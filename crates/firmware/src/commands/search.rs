//! RFS: the reference search.
//!
//! A search turns towards the switch that its mode looks for, at the search speed, until it is
//! stopped. No switch exists on a virtual axis yet, so it does not end by itself.

use opentmcl_wire::Status;

use super::{Execution, Outcome};
use crate::axis::AxisNumber;
use crate::board::Board;
use crate::module::Module;

/// State of a search on its way to the first switch.
const APPROACH: i32 = 1;

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
                    if self.axes[axis].search_state != 0 {
                        self.stop_axis(axis);
                    }
                }
                Ok(Outcome::Done)
            }
            2 => Ok(Outcome::Read(self.axes[axis].search_state)),
            _ => Err(Status::WRONG_TYPE),
        }
    }

    fn start_search(&mut self, axis: AxisNumber) {
        let state = &self.axes[axis];
        let speed = state.search_speed as i32;
        let velocity = if begins_to_the_right(state.search_mode) { speed } else { -speed };
        self.rotate_axis(axis, velocity);
        self.axes[axis].search_state = APPROACH;
    }
}

/// Whether the first switch or index that a mode looks for lies in positive direction (firmware
/// manual 6.1; the modes 7 and 8 as in 6.1.7 and 6.1.8).
const fn begins_to_the_right(mode: i32) -> bool {
    matches!(mode, 2 | 3 | 6 | 8 | 9 | 65 | 68 | 134 | 136)
}
