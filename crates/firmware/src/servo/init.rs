//! How an encoder learns where the rotor is: an incremental one begins to count anywhere, an absolute one sits on
//! the shaft in any angle.
//!
//! # Readings
//!
//! - The manual's names for the states are those of its descendant, the TMCM-1690: 0 nothing to do, 1 start, 2
//!   wait, 3 estimate the offset.
//! - Mode 0 pulls the rotor to angle 0 with the open-loop current (parameter 12) for the time of parameter 104.
//! - Mode 1 is nowhere explained; parameter 105 is the speed of a search for the null channel, so it turns the
//!   motor in open loop until the null channel comes, from where parameter 106 is the offset.
//! - Mode 2 commutates by the halls until one of their edges tells the angle.
//! - Modes 0 and 1 of an absolute encoder (parameter 161) pull the rotor for the time of parameter 104 too, and
//!   take parameter 163 from where it comes to rest; that mode 1 shakes it meanwhile makes no difference here.

use opentmcl_catalog::Foc;
use opentmcl_motion::servo::hall;

use super::sensors::{Source, TURN};
use super::{ABSOLUTE_COMMUTATION, ENCODER_COMMUTATION, Servo};

/// Values of parameter 102.
const BY_PULLING: i32 = 0;
const BY_NULL_CHANNEL: i32 = 1;

/// Value of parameter 161 with which nothing has to be found out.
const BY_STORED_OFFSET: i32 = 2;

/// Half a sector of the halls: from its middle to its edge.
const HALF_SECTOR: u16 = (TURN / 12) as u16;

/// Values of parameter 103.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum State {
    #[default]
    Idle,
    Start,
    Wait,
    Estimate,
}

/// What the field is made to do meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Forced {
    /// It stands at an electrical angle.
    Angle(u16),
    /// It turns.
    OpenLoop,
}

/// The initialisation of an encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Init {
    pub(super) state: State,
    forced: Option<Forced>,
    /// Milliseconds in the present state.
    elapsed: i32,
    /// Sector of the halls at the beginning.
    sector: Option<u8>,
    /// Whether the encoder knows the angle.
    pub(super) done: bool,
}

impl Init {
    /// What the field has to do; none while it obeys the regulators.
    #[inline]
    pub(super) fn forced(&self) -> Option<Forced> {
        self.forced
    }

    /// Whether the angle is still taken from the halls.
    #[inline]
    pub(super) fn uses_halls(&self) -> bool {
        self.state == State::Wait && self.forced.is_none()
    }
}

impl Servo {
    /// Begins the initialisation if the motor is commutated by an encoder that needs one.
    pub(super) fn begin_init(&mut self) {
        self.init = Init::default();
        let is_needed = match self.settings[Foc::CommutationMode] {
            ENCODER_COMMUTATION => true,
            ABSOLUTE_COMMUTATION => self.settings[Foc::AbsoluteInitMode] != BY_STORED_OFFSET,
            _ => false,
        };
        if is_needed {
            self.init.state = State::Start;
        }
    }

    fn is_absolute(&self) -> bool {
        self.settings[Foc::CommutationMode] == ABSOLUTE_COMMUTATION
    }

    /// Goes on with the initialisation, each millisecond.
    pub(super) fn step_init(&mut self) {
        match self.init.state {
            State::Idle => {}
            State::Start => self.start_init(),
            State::Wait => self.wait_init(),
            State::Estimate => {
                self.init = Init { done: true, ..Init::default() };
            }
        }
    }

    fn start_init(&mut self) {
        self.init.state = State::Wait;
        self.init.elapsed = 0;
        self.init.sector = self.sensors.sector;
        self.init.forced = match self.settings[Foc::EncoderInitMode] {
            _ if self.is_absolute() => Some(Forced::Angle(0)),
            BY_PULLING => Some(Forced::Angle(0)),
            BY_NULL_CHANNEL => Some(Forced::OpenLoop),
            _ => None,
        };
    }

    fn wait_init(&mut self) {
        self.init.elapsed = self.init.elapsed.saturating_add(1);
        let is_over = match self.init.forced {
            Some(Forced::Angle(_)) => self.init.elapsed >= self.settings[Foc::EncoderInitDelay],
            // The null channel ends it in its own control period.
            Some(Forced::OpenLoop) => false,
            None => self.sensors.sector.is_some() && self.sensors.sector != self.init.sector,
        };
        if !is_over {
            return;
        }
        self.init.state = State::Estimate;
        match self.init.forced {
            Some(_) if self.is_absolute() => {
                let angle = self.sensors.absolute.within() as i32;
                self.settings[Foc::AbsoluteOffset] = -angle & 0xFFFF;
            }
            Some(_) => {
                self.settings[Foc::EncoderOffset] = 0;
                self.begin_count(0);
            }
            None => self.take_angle_of_edge(),
        }
        self.init.forced = None;
    }

    /// The null channel has been passed this number of counts ago.
    pub(super) fn end_search_for_null(&mut self, counts: i32) {
        if self.init.state == State::Wait && self.init.forced == Some(Forced::OpenLoop) {
            self.begin_count(counts);
            self.init.state = State::Estimate;
            self.init.forced = None;
        }
    }

    /// The encoder's counter takes a value; the position stays what it is.
    fn begin_count(&mut self, counts: i32) {
        let position = self.position();
        self.sensors.encoder.set(counts);
        self.sensors.set_position(self.position_source(), self.reading.pole_pairs, position);
        let steps = self.encoder_steps();
        self.sensors.restart_tachometer(steps, self.reading.pole_pairs);
    }

    /// An edge of the halls is half a sector from the middle of the one that begins there.
    fn take_angle_of_edge(&mut self) {
        let (Some(before), Some(sector)) = (self.init.sector, self.sensors.sector) else { return };
        let to_the_right = (before + 1) % 6 == sector;
        let middle = hall::sector_angle(sector);
        let edge = if to_the_right {
            middle.wrapping_sub(HALF_SECTOR)
        } else {
            middle.wrapping_add(HALF_SECTOR)
        };
        let pole_pairs = self.reading.pole_pairs;
        let angle = self.sensors.angle(Source::Encoder, pole_pairs, false);
        let missing = i64::from(edge.wrapping_sub(angle));
        let field_turn = TURN * i64::from(pole_pairs.max(1));
        let counts = missing * i64::from(self.encoder_steps()) / field_turn;
        self.settings[Foc::EncoderOffset] = counts as i32;
    }
}
