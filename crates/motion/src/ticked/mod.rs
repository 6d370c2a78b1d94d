//! The ramp generator of the TMC429: one axis that changes its speed in ticks.
//!
//! Unlike the generator in [`crate::ramp`] this one has no plan. With each *ramp tick* it looks at its
//! speed and at the way that is left, and makes the speed a little higher or lower; with each *pulse
//! tick* it adds the speed to an accumulator, and an overflow is a microstep. What a move looks like
//! comes out of that: with a braking factor that is too large an axis runs past its target and swings
//! about it, with one that is too small it creeps.
//!
//! # Units
//!
//! Speed counts 0..=2047, inside the chip with eight more bits behind the point; acceleration 0..=2047.
//! Ramp ticks are at the multiples of 32 * 2^ramp_div clocks and change the speed by a_max / 256. Pulse
//! ticks are at the multiples of 32 * 2^pulse_div clocks and add the whole part of the speed to an
//! accumulator of 11 bits. With a clock of 16 MHz that makes
//!
//! ```text
//! microsteps per second  = 16e6 v / (2^pulse_div * 2048 * 32)
//! microsteps per second² = 16e6² a / 2^(pulse_div + ramp_div + 29)
//! ```
//!
//! # Time
//!
//! State advances when asked: [`Ramp::advance`] steps through the ramp ticks at which the speed changes and
//! jumps over all others, so that an hour at rest or at constant speed costs nothing. What is asked, and
//! how often, changes no result.
//!
//! # Readings
//!
//! The data sheet describes the registers and the formulas, not the circuit. Where it is silent:
//!
//! - All ticks count from time 0, and changing a divisor does not shift them. If a ramp tick and a pulse
//!   tick fall together, the ramp tick comes first.
//! - A position mode has a target speed: v_max as long as the axis can still stop, v_min afterwards. At a
//!   ramp tick the axis takes the higher of its faster, its present and its slower speed with which,
//!   after the coming period, v² <= 2048 p' d still holds; but it never gets slower than v_min. Two details
//!   are ours, without which an axis with a good p' would come to its target too fast: that it is the
//!   state after the period which counts, and that the part of a microstep in the accumulator counts
//!   in d. A last approach of about ln(v / v_min) ramp ticks follows from them.
//! - v_min does not shorten the start: an axis accelerates from 0. It ends the braking: an axis at or
//!   below v_min that comes to its target, with the pulse or by a new target, stands at once.
//!   With v_min = 0 an axis may stop short of its target for ever.
//! - The soft mode has the target speed p' d / 2, between v_min and v_max. Keeping to it takes a_max at the
//!   highest speed if p' = p, and less below: the greatest factor with which the axis does not lag behind.
//! - v_max is a limit in velocity mode, too; in hold mode it is not.
//! - The accumulator has no sign. An axis that reverses goes on with what is in it.
//! - A target exactly half way round the 24 bits is approached in negative direction.

mod advance;
mod factor;
mod foresee;
mod rule;
mod stretch;
mod stride;

pub use factor::{BrakingFactor, braking_factor};
pub use foresee::Motion;
pub use stretch::{PLACE_SHIFT, Stretch};

pub use crate::ramp::Barred;

use crate::Instant;

/// Bits of a speed behind the point.
const SPEED_SHIFT: u32 = 8;

/// Largest speed and acceleration.
const MAX: u32 = 2047;

/// Largest divisor.
const DIVISOR_MAX: u32 = 13;

/// Content of the accumulator that makes a microstep.
const MICROSTEP: i64 = 2048;

/// What the ramp generator is to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// RAMP_MODE: move to the target with constant acceleration and deceleration.
    #[default]
    Ramp,
    /// SOFT_MODE: as `Ramp`, but the target is approached with a speed in proportion to the distance.
    Soft,
    /// VELOCITY_MODE: run at the target velocity, accelerating with a_max.
    Velocity,
    /// HOLD_MODE: run at the target velocity at once, whatever the limits.
    Hold,
}

/// Target and limits in the units of the chip's registers.
///
/// Values above the stated ranges act as the largest ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// What to do.
    pub mode: Mode,
    /// Target position in microsteps (position modes); 24 bits with sign.
    pub target: i32,
    /// Speed from which the axis stops at once on its target, 0..=2047; at least 1 for a clean arrival.
    pub v_min: u32,
    /// Highest speed, 0..=2047.
    pub v_max: u32,
    /// Velocity to run at (velocity and hold mode), -2047..=2047.
    pub v_target: i32,
    /// Acceleration and deceleration, 0..=2047; with 0 the speed does not change.
    pub a_max: u32,
    /// p', with which the axis knows when to brake (position modes).
    pub factor: BrakingFactor,
    /// Exponent of the time between two pulse ticks, 0..=13.
    pub pulse_div: u32,
    /// Exponent of the time between two ramp ticks, 0..=13.
    pub ramp_div: u32,
    /// Directions in which the axis must not move: it stops at once, or with a_max if `soft` is set,
    /// and stands as long as it would have to go there.
    pub barred: Barred,
}

impl Settings {
    /// The same within the ranges of the chip, so that calculations need no checks.
    fn clamped(&self) -> Self {
        Self {
            target: wrap(self.target.into()),
            v_min: self.v_min.min(MAX),
            v_max: self.v_max.min(MAX),
            v_target: self.v_target.clamp(-(MAX as i32), MAX as i32),
            a_max: self.a_max.min(MAX),
            factor: BrakingFactor { pmul: self.factor.pmul | 0x80, pdiv: self.factor.pdiv & 0x0F },
            pulse_div: self.pulse_div.min(DIVISOR_MAX),
            ramp_div: self.ramp_div.min(DIVISOR_MAX),
            ..*self
        }
    }

    fn is_position_mode(&self) -> bool {
        matches!(self.mode, Mode::Ramp | Mode::Soft)
    }
}

/// What has happened to an axis since [`Ramp::take_events`] was called last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Events {
    /// It has come to rest on its target.
    pub arrived: bool,
    /// Its speed has become zero.
    pub stopped: bool,
}

/// A ramp generator with its axis.
///
/// Questions are about the time up to which it was advanced last.
///
/// ```
/// use opentmcl_motion::Instant;
/// use opentmcl_motion::ticked::{Ramp, Settings, braking_factor};
///
/// let mut ramp = Ramp::new();
/// let mut now = Instant::from_ticks(0);
/// ramp.set(now, &Settings {
///     target: 51_200,
///     v_min: 1,
///     v_max: 1000,
///     a_max: 500,
///     factor: braking_factor(500, 7, 3).unwrap(),
///     ramp_div: 7,
///     pulse_div: 3,
///     ..Settings::default()
/// });
/// while let Some(next) = ramp.next_event(now) {
///     now = next;
/// }
/// ramp.advance(now);
/// assert_eq!((ramp.position(), ramp.velocity()), (51_200, 0));
/// ```
#[derive(Clone, Debug)]
pub struct Ramp {
    settings: Settings,
    /// All ticks up to this clock, including it, have happened.
    time: u64,
    /// Velocity in 1/256.
    velocity: i32,
    /// Position counter, 24 bits with sign.
    position: i32,
    /// Microsteps since the beginning, whatever was written to the position counter.
    travel: i64,
    /// Content of the accumulator, 0..=2047.
    fraction: i64,
    /// The last change of the velocity by a ramp tick, and the time of that tick.
    change: i32,
    changed_at: u64,
    /// When the velocity became zero; none if it never was anything else.
    stopped_at: Option<u64>,
    events: Events,
}

impl Default for Ramp {
    fn default() -> Self {
        Self::new()
    }
}

impl Ramp {
    /// An axis at rest at position 0 at time 0, with all limits 0.
    pub fn new() -> Self {
        Self {
            settings: Settings::default(),
            time: 0,
            velocity: 0,
            position: 0,
            travel: 0,
            fraction: 0,
            change: 0,
            changed_at: 0,
            stopped_at: None,
            events: Events::default(),
        }
    }

    /// Target and limits as they were set last, within their ranges.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Sets target and limits.
    pub fn set(&mut self, now: Instant, settings: &Settings) {
        self.advance(now);
        self.settings = settings.clamped();
        if self.settings.mode == Mode::Hold && !self.settings.bars(self.settings.v_target) {
            self.jump_to(self.settings.v_target << SPEED_SHIFT);
        }
        self.obey();
    }

    /// Sets the position counter. In a position mode the axis then moves to its target.
    pub fn set_position(&mut self, now: Instant, position: i32) {
        self.advance(now);
        self.position = wrap(position.into());
        self.obey();
    }

    /// Sets the velocity at once, -2047..=2047; the mode then does with it what it does.
    pub fn set_velocity(&mut self, now: Instant, velocity: i32) {
        self.advance(now);
        self.jump_to(velocity.clamp(-(MAX as i32), MAX as i32) << SPEED_SHIFT);
        self.obey();
    }

    /// The position counter in microsteps, 24 bits with sign.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Microsteps that the axis has made since the beginning, those in negative direction subtracted.
    /// Writing to the position counter does not change it.
    pub fn travel(&self) -> i64 {
        self.travel
    }

    /// The whole part of the velocity, with the direction as its sign.
    pub fn velocity(&self) -> i32 {
        self.velocity / (1 << SPEED_SHIFT)
    }

    /// The velocity in 1/256.
    pub fn exact_velocity(&self) -> i32 {
        self.velocity
    }

    /// By how many 1/256 the last ramp tick has changed the velocity: a_max upward or downward, less with
    /// the last tick before a speed is reached, 0 at constant speed.
    pub fn acceleration(&self) -> i32 {
        let is_last_tick = self.time - self.changed_at < self.ramp_period();
        if is_last_tick { self.change } else { 0 }
    }

    /// The velocity at which the generator aims at present: v_target itself, or what a position mode has
    /// calculated. This is what the register V_TARGET shows.
    pub fn target_velocity(&self) -> i32 {
        self.goal() / (1 << SPEED_SHIFT)
    }

    /// Whether the position is the target, moving or not.
    pub fn at_target(&self) -> bool {
        self.position == self.settings.target
    }

    /// Whether the axis stands and will go on standing.
    pub fn at_rest(&self) -> bool {
        self.velocity == 0 && self.next_change() == u64::MAX
    }

    /// When the speed became zero; none while the axis moves or if it never has.
    pub fn stopped_at(&self) -> Option<Instant> {
        self.stopped_at.filter(|_| self.velocity == 0).map(Instant::from_ticks)
    }

    /// What has happened since this was called last.
    pub fn take_events(&mut self) -> Events {
        core::mem::take(&mut self.events)
    }

    /// The way to the target, the short way round.
    fn distance(&self) -> i32 {
        wrap(i64::from(self.settings.target) - i64::from(self.position))
    }

    /// Takes a velocity without a ramp.
    fn jump_to(&mut self, velocity: i32) {
        self.change = 0;
        self.assume(velocity);
    }

    /// Takes a velocity, and notes what that means.
    fn assume(&mut self, velocity: i32) {
        if velocity == 0 && self.velocity != 0 {
            self.stopped_at = Some(self.time);
            self.events.stopped = true;
            self.events.arrived |= self.settings.is_position_mode() && self.at_target();
        }
        self.velocity = velocity;
    }

    /// Stops the axis where it must not move, and where it may stop on its target at once.
    fn obey(&mut self) {
        let barred = &self.settings.barred;
        let runs_into_a_stop = !barred.soft
            && (self.velocity < 0 && barred.negative || self.velocity > 0 && barred.positive);
        if runs_into_a_stop || self.stops_on_target() && self.at_target() {
            self.jump_to(0);
        }
    }

    /// Whether the axis is slow enough to stop on its target at once.
    fn stops_on_target(&self) -> bool {
        self.settings.is_position_mode()
            && self.velocity.unsigned_abs() <= self.settings.v_min << SPEED_SHIFT
    }
}

/// Wraps a position to 24 bits with sign.
fn wrap(position: i64) -> i32 {
    (position << 8) as i32 >> 8
}
