//! The SixPoint ramp generator.
//!
//! In position mode an axis starts at VSTART, accelerates with A1 up to V1 and with AMAX up to VMAX,
//! cruises, brakes with DMAX down to V1 and with D1 down to VSTOP, and stops on the target. In
//! velocity mode AMAX alone leads to VMAX. (Firmware manual 1.3 and 6.6; datasheet of the TMC5160,
//! chapter 12.)
//!
//! # Readings
//!
//! Where the datasheet forbids a setting or says nothing, this generator does the following:
//!
//! - A move ends in the clock in which the position counter becomes the target, with a last speed
//!   of at most VSTOP. The exact position, up to half a microstep behind, is then set to the target.
//! - A short move whose peak stays below VMAX peaks at a whole register unit, rounded down, and
//!   cruises there for the few clocks that are left. What is then still left, less than the travel
//!   of one clock at the peak, is part of the jump from VSTOP to zero.
//! - VSTART above what a short move can brake from is lowered for this move, so that every move ends
//!   on its target.
//! - VSTOP = 0 acts as 1. D1 = 0 acts as DMAX, DMAX = 0 as AMAX, and if all are zero as 1: an axis can
//!   always brake.
//! - A1 = 0 or AMAX = 0: no change of speed in that range of speeds. The axis keeps what it has, or
//!   VSTART from rest.
//! - An axis that moves away from the target, or is too fast to stop in front of it, brakes with
//!   DMAX and D1 down to VSTOP, stops, waits, and comes back (the second move).
//! - VMAX lowered below the speed in position mode: slows down with AMAX and A1, unless braking for the
//!   target is due. VMAX = 0 is the extreme case: the axis stops that way and stays.
//! - In velocity mode VSTART and VSTOP are not used. Manual 6.6 says they are; the table of
//!   parameters (19, 20: "in position mode only") and the datasheet say they are not.
//! - The wait at zero counts from every stop and delays whatever movement comes next.
//! - A target exactly 2^31 microsteps away is approached in negative direction.

mod plan;
mod rates;

use crate::{Duration, Instant};
use rates::{POSITION_SHIFT, Rates, SPEED_SHIFT, microsteps, wrapped};

/// What the ramp generator is to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Move to the target with all limits.
    #[default]
    Position,
    /// Run at +VMAX, accelerating with AMAX.
    VelocityPositive,
    /// Run at -VMAX, accelerating with AMAX.
    VelocityNegative,
    /// Keep the velocity.
    Hold,
}

/// Directions in which an axis must not move, as a limit switch tells.
///
/// An axis that moves in such a direction stops, and then does what the limits say as far as that leads
/// the other way; where it would start in a barred direction it stands until the next planning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Barred {
    /// No motion towards negative positions.
    pub negative: bool,
    /// No motion towards positive positions.
    pub positive: bool,
    /// The stop is a ramp, in every mode: DMAX above V1, D1 below, down to VSTOP. Otherwise the speed
    /// is zero at once.
    pub soft: bool,
}

impl Barred {
    const fn bars(self, direction: i64) -> bool {
        direction < 0 && self.negative || direction > 0 && self.positive
    }
}

/// Target and limits of a ramp, in the units of the chip's registers.
///
/// A speed of V is V microsteps per 2^24 clocks (0.953674 microsteps per second), used up to
/// 2^23 - 1. An acceleration of A changes V by A/2^17 per clock (116.415 microsteps per second
/// squared), used up to 65535. Greater values act as these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// What to do.
    pub mode: Mode,
    /// Target position in microsteps (position mode).
    pub target: i32,
    /// VSTART: speed at which a move begins (position mode).
    pub vstart: u32,
    /// A1: acceleration below V1 (position mode).
    pub a1: u32,
    /// V1: speed at which the accelerations change; 0 = AMAX and DMAX alone (position mode).
    pub v1: u32,
    /// AMAX: acceleration above V1; the only acceleration in velocity mode.
    pub amax: u32,
    /// VMAX: speed of cruising.
    pub vmax: u32,
    /// DMAX: deceleration above V1 (position mode).
    pub dmax: u32,
    /// D1: deceleration below V1 (position mode).
    pub d1: u32,
    /// VSTOP: speed from which the axis stops at once (position mode).
    pub vstop: u32,
    /// Time to stand still after every stop before the next movement.
    pub zero_wait: Duration,
    /// Directions in which the axis must not move.
    pub barred: Barred,
}

impl Default for Limits {
    /// Position mode, everything zero: an axis that does not move.
    fn default() -> Self {
        Self {
            mode: Mode::Position,
            target: 0,
            vstart: 0,
            a1: 0,
            v1: 0,
            amax: 0,
            vmax: 0,
            dmax: 0,
            d1: 0,
            vstop: 0,
            zero_wait: Duration::from_ticks(0),
            barred: Barred { negative: false, positive: false, soft: false },
        }
    }
}

/// What the ramp does at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// Stands, and nothing is going to happen.
    Standstill,
    /// Stands until the wait at zero has passed, then moves.
    Waiting,
    /// Gets faster.
    Accelerating,
    /// Runs at constant speed.
    Cruising,
    /// Gets slower.
    Decelerating,
}

impl Phase {
    const fn stands(self) -> bool {
        matches!(self, Self::Standstill | Self::Waiting)
    }
}

/// A part of a plan with constant acceleration, from a time on until the next part begins.
///
/// Positions and speeds are exact: a position counts 2^-42 microstep, a speed 2^-17 of a register unit,
/// an acceleration is that of the registers. Positions of one plan are not wrapped to 32 bits, so that
/// the difference of two of them is the way between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// When it begins.
    pub from: Instant,
    /// When the next one begins; none if it goes on until the next planning.
    pub until: Option<Instant>,
    /// Position at `from` in 2^-42 microstep.
    pub position: i128,
    /// Velocity at `from` in 2^-17 of a register unit, with the direction as its sign.
    pub velocity: i64,
    /// Change of the velocity per clock.
    pub acceleration: i32,
    /// What the ramp does.
    pub phase: Phase,
}

impl Stretch {
    /// Whether the axis does not move.
    pub const fn stands(&self) -> bool {
        self.phase.stands()
    }

    /// VACTUAL at a time within the stretch: the velocity in register units, truncated toward zero.
    pub fn velocity_at(&self, time: Instant) -> i32 {
        let clocks = time.as_ticks().saturating_sub(self.from.as_ticks());
        let change = i64::from(self.acceleration).wrapping_mul(clocks as i64);
        (self.velocity.wrapping_add(change) / (1 << SPEED_SHIFT)) as i32
    }
}

/// Constant acceleration from `start` to the start of the next segment.
#[derive(Clone, Copy, Debug)]
struct Segment {
    start: u64,
    position: i128,
    velocity: i64,
    acceleration: i32,
    phase: Phase,
}

impl Segment {
    const fn standstill(start: u64, position: i128) -> Self {
        Self { start, position, velocity: 0, acceleration: 0, phase: Phase::Standstill }
    }

    fn velocity_at(&self, time: u64) -> i64 {
        if self.acceleration == 0 {
            return self.velocity;
        }
        let clocks = time.saturating_sub(self.start);
        self.velocity.wrapping_add(i64::from(self.acceleration).wrapping_mul(clocks as i64))
    }

    fn position_at(&self, time: u64) -> i128 {
        let clocks = time.saturating_sub(self.start);
        let mean = self.velocity.wrapping_add(self.velocity_at(time));
        self.position.wrapping_add(i128::from(mean).wrapping_mul(i128::from(clocks)))
    }

    const fn stands(&self) -> bool {
        self.phase.stands()
    }
}

/// Braking, waiting, two accelerations, cruising, two decelerations, standstill.
const MAX_SEGMENTS: usize = 9;

/// A ramp generator: a plan, and the means to evaluate it at any time from the last planning on.
///
/// ```
/// use opentmcl_motion::{Instant, ramp::{Limits, Ramp}};
///
/// let mut ramp = Ramp::new();
/// let limits = Limits { target: 512_000, amax: 439, dmax: 439, vmax: 53_687, ..Limits::default() };
/// ramp.plan(Instant::from_ticks(0), &limits);
/// let arrival = ramp.arrival().unwrap();
/// assert_eq!(ramp.position(arrival), 512_000);
/// assert_eq!(ramp.velocity(arrival), 0);
/// ```
#[derive(Clone, Debug)]
pub struct Ramp {
    limits: Limits,
    segments: [Segment; MAX_SEGMENTS],
    count: usize,
    /// When the axis stopped that stands at the beginning of the plan; `None` if it never moved.
    stopped_before: Option<u64>,
    /// Sign of the motion that was braked in order to return; 0 if none was.
    braked: i64,
    second_move: Option<u64>,
    arrival: Option<u64>,
    /// When braking for the target begins, and what then remains behind the braking distance.
    braking_from: u64,
    residue: i128,
}

impl Default for Ramp {
    fn default() -> Self {
        Self::new()
    }
}

impl Ramp {
    /// An axis at rest at position 0 that has not moved yet.
    pub fn new() -> Self {
        Self {
            limits: Limits::default(),
            segments: [Segment::standstill(0, 0); MAX_SEGMENTS],
            count: 1,
            stopped_before: None,
            braked: 0,
            second_move: None,
            arrival: None,
            braking_from: u64::MAX,
            residue: 0,
        }
    }

    /// Target and limits of the last planning.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// XACTUAL: the position counter in microsteps, wrapped to 32 bits.
    ///
    /// `time` must not lie before the last planning; an earlier time counts as that one. This holds
    /// for all questions asked of a ramp.
    pub fn position(&self, time: Instant) -> i32 {
        microsteps(self.segment(time.as_ticks()).position_at(time.as_ticks()))
    }

    /// VACTUAL: the velocity in register units, truncated toward zero.
    pub fn velocity(&self, time: Instant) -> i32 {
        (self.segment(time.as_ticks()).velocity_at(time.as_ticks()) / (1 << SPEED_SHIFT)) as i32
    }

    /// What the ramp is doing.
    pub fn phase(&self, time: Instant) -> Phase {
        self.segment(time.as_ticks()).phase
    }

    /// Whether the velocity is VMAX in either direction.
    pub fn velocity_reached(&self, time: Instant) -> bool {
        let velocity = self.segment(time.as_ticks()).velocity_at(time.as_ticks());
        velocity.abs() == Rates::new(&self.limits).max
    }

    /// Whether the axis stands still because it stopped less than the wait at zero ago.
    pub fn zero_wait_active(&self, time: Instant) -> bool {
        self.zero_wait_end(time.as_ticks()).is_some_and(|end| time.as_ticks() < end)
    }

    /// Since when the axis stands; `None` while it moves or if it has never moved.
    pub fn stopped_at(&self, time: Instant) -> Option<Instant> {
        self.stop_time(time.as_ticks()).map(Instant::from_ticks)
    }

    /// When the plan comes to rest on its target; `None` if it does not, or is not in position mode.
    ///
    /// A plan made while the axis stands on the target arrives when it is made.
    pub fn arrival(&self) -> Option<Instant> {
        self.arrival.map(Instant::from_ticks)
    }

    /// When the axis starts back because it went away from the target or past it; `None` if the plan
    /// has no such second move.
    pub fn second_move(&self) -> Option<Instant> {
        self.second_move.map(Instant::from_ticks)
    }

    /// The next time after `time` at which the axis arrives or stops, reaches a constant speed, or
    /// ends the wait at zero; `None` if nothing of that kind is to come.
    pub fn next_event(&self, time: Instant) -> Option<Instant> {
        let time = time.as_ticks();
        let after_wait = self.zero_wait_end(time).filter(|&end| time < end);
        let boundary = self
            .planned()
            .filter(|segment| {
                matches!(segment.phase, Phase::Standstill | Phase::Waiting | Phase::Cruising)
            })
            .map(|segment| segment.start)
            .find(|&start| time < start);
        after_wait.into_iter().chain(boundary).min().map(Instant::from_ticks)
    }

    /// The part of the plan at this time.
    pub fn stretch(&self, time: Instant) -> Stretch {
        let time = time.as_ticks();
        let segment = self.segment(time);
        let until = self.planned().map(|segment| segment.start).find(|&start| time < start);
        Stretch {
            from: Instant::from_ticks(segment.start),
            until: until.map(Instant::from_ticks),
            position: segment.position,
            velocity: segment.velocity,
            acceleration: segment.acceleration,
            phase: segment.phase,
        }
    }

    /// Makes the plan from the state at `now`.
    ///
    /// `now` must not lie before the last planning.
    pub fn plan(&mut self, now: Instant, limits: &Limits) {
        self.replan(now.as_ticks(), limits, None);
    }

    /// Sets the position counter and plans anew with the same target and limits, so that in
    /// position mode the axis moves to its target. The velocity stays as it is, and so does the part of
    /// a microstep by which the axis is off its counter.
    pub fn set_position(&mut self, now: Instant, position: i32) {
        let limits = self.limits;
        let now = now.as_ticks();
        let exact = wrapped(self.segment(now).position_at(now));
        let part = exact - (i128::from(microsteps(exact)) << POSITION_SHIFT);
        self.replan(now, &limits, Some((i128::from(position) << POSITION_SHIFT) + part));
    }

    /// Stops at once, whatever the limits, and stands until the next planning.
    pub fn stop_now(&mut self, now: Instant) {
        let now = now.as_ticks();
        let position = wrapped(self.segment(now).position_at(now));
        let stopped = if self.segment(now).stands() { self.stop_time(now) } else { Some(now) };
        let standing = Self { limits: self.limits, stopped_before: stopped, ..Self::new() };
        *self = standing;
        self.segments[0] = Segment::standstill(now, position);
    }

    fn planned(&self) -> impl DoubleEndedIterator<Item = &Segment> + ExactSizeIterator {
        self.segments.iter().take(self.count)
    }

    fn segment(&self, time: u64) -> &Segment {
        let [first, ..] = &self.segments;
        self.planned().rev().find(|segment| segment.start <= time).unwrap_or(first)
    }

    fn stop_time(&self, time: u64) -> Option<u64> {
        let [first, ..] = &self.segments;
        let segment = self.segment(time);
        if !segment.stands() {
            None
        } else if core::ptr::eq(segment, first) {
            self.stopped_before
        } else {
            Some(segment.start)
        }
    }

    fn zero_wait_end(&self, time: u64) -> Option<u64> {
        self.stop_time(time).map(|stop| stop.saturating_add(self.limits.zero_wait.as_ticks()))
    }
}
