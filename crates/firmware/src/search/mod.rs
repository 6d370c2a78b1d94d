//! The reference search: the state machine that carries out a [`Plan`] (firmware manual 6.1).
//!
//! A search approaches its switch at the search speed (parameter 194) and brakes. Then it makes slow
//! passes at the switch speed (195), and where the switch opens or closes during them are the two
//! switching points; their middle is the reference.
//!
//! - One side: the axis leaves the switch against the direction of search until it opens, and comes back
//!   until it closes. Both are the same edge, apart from the hysteresis.
//! - Both sides: the axis runs on through the switch until it opens behind it, and back until it opens
//!   in front of it.
//!
//! After each pass that ends with an open switch the axis stands still for a moment. If the switch is
//! closed there, it had only bounced, and the pass goes on. An axis that stands on its switch at the
//! start begins with the slow passes; one that has run past a narrow switch while braking comes back.
//!
//! The state advances by what the hardware shows: levels, standstill, the null channel. It is looked at
//! whenever [`Board::next_event`] foresees a change, so an edge is seen at its exact time; a board that
//! cannot foresee names the time of its next look instead, and the edge is found a little later.

pub(crate) mod plan;

use crate::axis::AxisNumber;
use crate::board::Board;
use crate::module::Module;
use crate::tmc5160::registers::*;
use opentmcl_motion::interpolation::Limits;
use plan::{Direction, Leg, Plan, Sensor};

/// Where a search stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    /// There is none.
    #[default]
    Idle,
    /// Fast, towards the switch.
    Approaching,
    /// The switch has been found; on the way to a standstill.
    Braking,
    /// Slowly, until the switch opens.
    Leaving,
    /// The switch has opened; on the way to a standstill.
    Turning,
    /// Slowly, until the switch closes.
    Entering,
    /// To the reference.
    Returning,
    /// A stall or a deviation has stopped the axis; nothing more happens until a command ends it.
    Halted,
}

/// A reference search of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Search {
    phase: Phase,
    /// The mode as it was at the start.
    mode: u8,
    /// Whether the first of two switches has been found.
    is_second_leg: bool,
    /// Direction of the present pass.
    heading: Direction,
    /// Whether the switch has been closed during the present pass.
    was_closed: bool,
    /// Where the switch opened in the present pass.
    edge: i32,
    /// The first of the two switching points.
    first_point: Option<i32>,
    /// The reference of the first leg.
    first_reference: i32,
}

impl Search {
    pub(crate) fn is_active(&self) -> bool {
        self.phase != Phase::Idle
    }

    /// What RFS STATUS tells.
    pub(crate) fn state(&self) -> i32 {
        match self.phase {
            Phase::Idle => 0,
            Phase::Approaching => 1,
            Phase::Braking | Phase::Turning => 2,
            Phase::Leaving => 3,
            Phase::Entering => 4,
            Phase::Returning => 5,
            Phase::Halted => 6,
        }
    }

    fn leg(&self) -> Leg {
        let plan = Plan::of_mode(self.mode);
        plan.second.filter(|_| self.is_second_leg).unwrap_or(plan.first)
    }
}

/// More than a search goes through at one moment.
const STEPS_AT_ONCE: u8 = 8;

impl<B: Board> Module<B> {
    /// Starts a search, whatever the axis does at present.
    pub(crate) fn start_search(&mut self, axis: AxisNumber) {
        self.begin_motion(axis);
        self.give_up_target(axis);
        let (mut drive, state) = self.drive(axis);
        let mode = state.search_mode as u8;
        let leg = Plan::of_mode(mode).first;
        state.suspended_stops = Some(drive.suspend_stops());
        if leg.sensor == Sensor::Index {
            let (mut chip, state) = self.tmc5160(axis);
            state.suspended_encoder_mode = Some(chip.read_field(ENCMODE_SETTINGS));
            chip.write(ENC_STATUS, ENC_STATUS_N_EVENT);
            chip.write_field(ENCMODE_ACTIONS, ENCMODE_LATCH_ONCE);
            chip.write_field(ENCMODE_CLEAR, 0);
            chip.write_field(ENCMODE_LATCH_POSITION, 1);
        }
        self.axes[axis].search = Search { phase: Phase::Approaching, mode, ..Search::default() };
        self.searching |= axis.bit();
        self.approach(axis, leg.direction);
        self.touch(axis);
    }

    /// Ends a search without a result, if there is one, and restores what it has changed. The motion goes
    /// on until the next command.
    pub(crate) fn end_search(&mut self, axis: AxisNumber) {
        if self.searching & axis.bit() == 0 {
            return;
        }
        self.searching &= !axis.bit();
        let (mut drive, state) = self.drive(axis);
        state.search.phase = Phase::Idle;
        if let Some(stops) = state.suspended_stops.take() {
            drive.restore_stops(stops);
        }
        if let Some(mode) = state.suspended_encoder_mode.take() {
            self.tmc5160(axis).0.write_field(ENCMODE_SETTINGS, mode);
        }
    }

    /// The axis has been stopped for good reason: a search under way does not go on.
    pub(crate) fn halt_search(&mut self, axis: AxisNumber) {
        let search = &mut self.axes[axis].search;
        if search.is_active() {
            search.phase = Phase::Halted;
        }
    }

    /// Goes on with the searches of these axes as far as the hardware shows what they wait for.
    pub(crate) fn observe_searches(&mut self, axes: u8) {
        let axes = axes & self.searching;
        for axis in AxisNumber::all(self.model.axes) {
            if axes & axis.bit() != 0 {
                // A step may fulfil at once what the next one waits for.
                for _ in 0..STEPS_AT_ONCE {
                    if !self.step_search(axis) {
                        break;
                    }
                }
            }
        }
    }

    /// One step of a search; whether there was one.
    fn step_search(&mut self, axis: AxisNumber) -> bool {
        let search = self.axes[axis].search;
        let leg = search.leg();
        match search.phase {
            Phase::Idle | Phase::Halted => false,
            Phase::Approaching => self.step_approach(axis, search, leg),
            Phase::Braking => {
                let stands = self.stands_still(axis);
                if stands {
                    self.begin_calibration(axis, leg);
                }
                stands
            }
            Phase::Leaving => {
                let closed = self.is_actuated(axis, leg.sensor);
                let position = self.drive(axis).0.position();
                let search = &mut self.axes[axis].search;
                if closed {
                    search.was_closed = true;
                } else if search.was_closed {
                    search.edge = position;
                    self.brake(axis, Phase::Turning);
                    return true;
                }
                false
            }
            Phase::Turning => {
                let stands = self.stands_still(axis);
                if stands {
                    self.turn(axis, search, leg);
                }
                stands
            }
            Phase::Entering => {
                let closed = self.is_actuated(axis, leg.sensor);
                if closed {
                    let position = self.drive(axis).0.position();
                    self.finish_leg(axis, middle(search.first_point.unwrap_or(position), position));
                }
                closed
            }
            Phase::Returning => {
                let arrived = self.stands_still(axis) && self.drive(axis).0.position_reached();
                if arrived {
                    self.finish_search(axis);
                }
                arrived
            }
        }
    }

    fn step_approach(&mut self, axis: AxisNumber, search: Search, leg: Leg) -> bool {
        if self.is_actuated(axis, leg.sensor) {
            // An axis that turns around may meet the switch on the way it came.
            let velocity = self.drive(axis).0.velocity();
            self.axes[axis].search.heading = match velocity {
                ..0 => Direction::Negative,
                0 => search.heading,
                1.. => Direction::Positive,
            };
            self.brake(axis, Phase::Braking);
            return true;
        }
        let ahead = match leg.direction {
            Direction::Negative => Sensor::Left,
            Direction::Positive => Sensor::Right,
        };
        let turns_around =
            leg.reverses && search.heading == leg.direction && self.is_actuated(axis, ahead);
        if turns_around {
            self.approach(axis, leg.direction.reversed());
        }
        turns_around
    }

    /// Begins the slow part, at a standstill on the switch or behind it.
    fn begin_calibration(&mut self, axis: AxisNumber, leg: Leg) {
        if leg.sensor == Sensor::Index {
            // The chip has latched the position at the event itself.
            let reference = self.tmc5160(axis).0.read(XLATCH) as i32;
            self.return_to(axis, reference);
            return;
        }
        let closed = self.is_actuated(axis, leg.sensor);
        let search = &mut self.axes[axis].search;
        search.first_point = None;
        let direction = match (leg.both_sides, closed) {
            (false, _) => leg.direction.reversed(),
            (true, true) => search.heading,
            (true, false) => search.heading.reversed(),
        };
        self.pass(axis, Phase::Leaving, direction);
    }

    /// Goes on after a pass, at a standstill.
    fn turn(&mut self, axis: AxisNumber, search: Search, leg: Leg) {
        if self.is_actuated(axis, leg.sensor) {
            self.pass(axis, Phase::Leaving, search.heading);
            return;
        }
        match search.first_point {
            Some(first) => self.finish_leg(axis, middle(first, search.edge)),
            None => {
                self.axes[axis].search.first_point = Some(search.edge);
                let phase = if leg.both_sides { Phase::Leaving } else { Phase::Entering };
                self.pass(axis, phase, search.heading.reversed());
            }
        }
    }

    /// A switch has been found exactly: goes to the other one, or to the reference.
    fn finish_leg(&mut self, axis: AxisNumber, reference: i32) {
        let search = &mut self.axes[axis].search;
        match Plan::of_mode(search.mode).second {
            Some(leg) if !search.is_second_leg => {
                search.is_second_leg = true;
                search.first_reference = reference;
                search.phase = Phase::Approaching;
                self.approach(axis, leg.direction);
            }
            _ => self.return_to(axis, reference),
        }
    }

    /// The axis stands on the reference: this becomes the origin.
    fn finish_search(&mut self, axis: AxisNumber) {
        let has_encoder = self.has_encoder(axis);
        let (mut drive, state) = self.drive(axis);
        let reference = drive.position();
        state.last_reference_position = reference;
        if state.search.is_second_leg {
            let distance = reference.wrapping_sub(state.search.first_reference);
            state.end_switch_distance = distance.wrapping_abs();
        }
        // Not in positioning mode, where a new position would make the axis move.
        drive.rotate(state, 0);
        drive.set_position(0);
        if has_encoder {
            self.tmc5160(axis).0.write(X_ENC, 0);
        }
        let (mut drive, state) = self.drive(axis);
        drive.move_to(state, 0);
        self.end_search(axis);
        self.forget_deviation(axis);
    }

    /// Turns at the search speed.
    fn approach(&mut self, axis: AxisNumber, direction: Direction) {
        let (mut drive, state) = self.drive(axis);
        state.search.heading = direction;
        let speed = fast(state.search_speed, drive.settings());
        drive.rotate(state, direction.velocity(speed));
    }

    /// Begins a slow pass.
    fn pass(&mut self, axis: AxisNumber, phase: Phase, direction: Direction) {
        let (mut drive, state) = self.drive(axis);
        state.search.phase = phase;
        state.search.heading = direction;
        state.search.was_closed = false;
        let speed = slow(state.switch_speed, state.search_speed, drive.settings());
        drive.rotate(state, direction.velocity(speed));
    }

    fn brake(&mut self, axis: AxisNumber, phase: Phase) {
        let (mut drive, state) = self.drive(axis);
        state.search.phase = phase;
        drive.rotate(state, 0);
    }

    fn return_to(&mut self, axis: AxisNumber, reference: i32) {
        let (mut drive, state) = self.drive(axis);
        state.search.phase = Phase::Returning;
        let settings = drive.settings();
        let v_max = slow(state.switch_speed, state.search_speed, settings);
        drive.move_to_within(state, reference, Limits { v_max, ..settings });
    }

    fn stands_still(&mut self, axis: AxisNumber) -> bool {
        self.drive(axis).0.velocity() == 0
    }

    fn is_actuated(&mut self, axis: AxisNumber, sensor: Sensor) -> bool {
        match sensor {
            Sensor::Left => self.drive(axis).0.limit_switches().0,
            Sensor::Right => self.drive(axis).0.limit_switches().1,
            Sensor::Home => self.board.home_switch(axis.get()),
            Sensor::InvertedHome => !self.board.home_switch(axis.get()),
            Sensor::Index => self.tmc5160(axis).0.read(ENC_STATUS) & ENC_STATUS_N_EVENT != 0,
        }
    }
}

/// The search speed; not set (0), it is the positioning speed.
fn fast(search_speed: u32, settings: Limits) -> u32 {
    if search_speed == 0 { settings.v_max } else { search_speed }
}

/// The switch speed; not set (0), it is a quarter of the search speed.
fn slow(switch_speed: u32, search_speed: u32, settings: Limits) -> u32 {
    if switch_speed == 0 { (fast(search_speed, settings) / 4).max(1) } else { switch_speed }
}

/// The middle between two positions of a counter that may wrap.
const fn middle(a: i32, b: i32) -> i32 {
    a.wrapping_add(b.wrapping_sub(a) / 2)
}
