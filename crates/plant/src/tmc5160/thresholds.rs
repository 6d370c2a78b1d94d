//! Ranges of speed: where StealthChop, CoolStep, StallGuard2, full steps and DcStep are used.
//!
//! The chip compares TSTEP, the time between two fine steps, with three thresholds, each with a
//! hysteresis (datasheet 6.2): an axis that gets faster is above the threshold speed from
//! TSTEP < T * 15/16 - 1 on, one that gets slower until TSTEP >= T; with GCONF.small_hysteresis it is 31/32.
//!
//! A comparison has a memory, but none that depends on when it is looked at: within a stretch of the
//! ramp the speed only grows or only falls, so that its two ends tell all that happens in it.
//!
//! # Readings
//!
//! - TSTEP = T itself belongs to StealthChop at TPWMTHRS, to CoolStep at TCOOLTHRS, and to the
//!   high-speed modes at THIGH.
//! - Writing a threshold compares anew, without hysteresis.
//! - A standing axis is slower than every threshold, even than 2^20 - 1, which TSTEP never exceeds.

use opentmcl_motion::Instant;
use opentmcl_motion::ramp::Phase;

use super::registers::{CHOPCONF, COOLCONF, GCONF, TCOOLTHRS, THIGH, TPWMTHRS, VDCMIN};
use super::{TSTEP_MAX, Tmc5160};

const THRESHOLDS: [u8; 3] = [TPWMTHRS, TCOOLTHRS, THIGH];

/// Whether the axis is faster than each threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Above {
    pwm: bool,
    cool: bool,
    high: bool,
}

/// The comparisons at a time from which on they follow from the ramp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    from: Instant,
    above: Above,
}

impl Watch {
    /// A standing axis.
    pub(super) const fn at_rest(from: Instant) -> Self {
        Self { from, above: Above { pwm: false, cool: false, high: false } }
    }
}

impl Tmc5160 {
    /// When the axis next crosses one of the thresholds, or VDCMIN, within the present stretch of the
    /// ramp.
    pub fn next_threshold(&self, now: Instant) -> Option<Instant> {
        let stretch = self.ramp.stretch(now);
        let end = stretch.until.filter(|_| stretch.acceleration != 0)?.as_ticks();
        let above = self.above(now);
        let present = (above, self.dcstep_active(now));
        let crossed = |ticks: u64| {
            let velocity = stretch.velocity_at(Instant::from_ticks(ticks));
            (self.compared(above, stretch.stands(), velocity), self.allows_dcstep(velocity))
                != present
        };
        // Within a stretch each comparison changes once at most.
        let (mut before, mut after) = (now.as_ticks(), end.saturating_sub(1));
        if after <= before || !crossed(after) {
            return None;
        }
        while after - before > 1 {
            let middle = before.midpoint(after);
            if crossed(middle) {
                after = middle;
            } else {
                before = middle;
            }
        }
        Some(Instant::from_ticks(after))
    }

    /// Whether DcStep is in use: it is configured (VDCMIN, vhighfs and vhighchm), and the speed is not
    /// below VDCMIN.
    pub fn dcstep_active(&self, now: Instant) -> bool {
        self.allows_dcstep(self.ramp.velocity(now))
    }

    fn allows_dcstep(&self, velocity: i32) -> bool {
        self.dcstep_configured() && velocity.unsigned_abs() >= self.stored(VDCMIN)
    }

    /// The speed in register units that the load allows in DcStep; none where it sets no limit.
    ///
    /// The ramp then cruises with it, not below VDCMIN, while VACTUAL shows the speed that was asked for.
    pub fn set_speed_limit(&mut self, limit: Option<u32>, now: Instant) {
        self.settle(now);
        self.speed_limit = limit;
        self.plan_anew(now);
    }

    /// VMAX as the ramp may use it.
    pub(super) fn speed_ceiling(&self, vmax: u32) -> u32 {
        match self.speed_limit {
            Some(limit) if self.dcstep_configured() => vmax.min(limit.max(self.stored(VDCMIN))),
            _ => vmax,
        }
    }

    /// VACTUAL: in DcStep the speed that would be without the load.
    pub(super) fn nominal_velocity(&self, now: Instant) -> i32 {
        let velocity = self.ramp.velocity(now);
        let vmax = self.stored(super::registers::VMAX);
        let ceiling = self.speed_ceiling(vmax);
        let limited = ceiling < vmax
            && self.ramp.phase(now) == Phase::Cruising
            && velocity.unsigned_abs() == ceiling;
        if limited { velocity.signum() * vmax.cast_signed() } else { velocity }
    }

    fn dcstep_configured(&self) -> bool {
        self.stored(VDCMIN) > 0 && self.stored(CHOPCONF) >> 18 & 0b11 == 0b11
    }

    /// Whether StealthChop is in use: it is enabled and the axis slower than all three thresholds.
    pub(super) fn stealthchop(&self, now: Instant) -> bool {
        self.stealthchop_below(self.above(now))
    }

    /// Whether the driver makes full steps because of the speed.
    pub(super) fn full_steps(&self, now: Instant) -> bool {
        self.stored(CHOPCONF) >> 18 & 1 == 1 && self.above(now).high
    }

    /// Whether a stall would be noticed: the motor moves, without StealthChop, and TCOOLTHRS is reached.
    pub(super) fn measures_stalls(&self, now: Instant) -> bool {
        let above = self.above(now);
        self.standing(now).is_none() && above.cool && !self.stealthchop_below(above)
    }

    /// Whether CoolStep regulates the current now.
    pub fn cool_active(&self, now: Instant) -> bool {
        // The cheap question first.
        self.stored(COOLCONF) & 0xF > 0 && self.cool_range(self.above(now), now)
    }

    fn cool_range(&self, above: Above, now: Instant) -> bool {
        self.stored(COOLCONF) & 0xF > 0
            && above.cool
            && !above.high
            && !self.stealthchop_below(above)
            && self.standing(now).is_none()
    }

    fn stealthchop_below(&self, above: Above) -> bool {
        self.stored(GCONF) >> 2 & 1 == 1 && above == Above::default()
    }

    fn above(&self, now: Instant) -> Above {
        self.follow(now).0
    }

    /// Whether CoolStep has been regulating without a break since the last [`Tmc5160::mark`].
    pub(super) fn cool_throughout(&self, now: Instant) -> bool {
        self.follow(now).1
    }

    /// Notes the comparisons as they are. Must precede every change of what they follow from.
    pub(super) fn mark(&mut self, now: Instant) {
        let (above, cool) = self.follow(now);
        if !cool {
            self.cool.release();
        }
        self.watch = Watch { from: now, above };
    }

    /// Compares with a threshold that has just been written.
    pub(super) fn compare_anew(&mut self, address: u8, now: Instant) {
        let faster = self.standing(now).is_none() && self.tstep(now) < self.bound(address);
        match address {
            TPWMTHRS => self.watch.above.pwm = faster,
            TCOOLTHRS => self.watch.above.cool = faster,
            _ => self.watch.above.high = faster,
        }
    }

    /// The comparisons at `now`, and whether CoolStep was regulating all the time since the last mark.
    fn follow(&self, now: Instant) -> (Above, bool) {
        let Watch { from: mut time, mut above } = self.watch;
        let mut cool = true;
        loop {
            let stretch = self.ramp.stretch(time);
            let until = stretch.until.filter(|&until| until <= now);
            let last = until.map_or(now, |until| Instant::from_ticks(until.as_ticks() - 1));
            for end in [time, last] {
                above = self.compared(above, stretch.stands(), stretch.velocity_at(end));
                cool = cool && self.cool_range(above, end);
            }
            match until {
                Some(until) if time < until => time = until,
                _ => return (above, cool),
            }
        }
    }

    fn compared(&self, above: Above, stands: bool, velocity: i32) -> Above {
        if stands {
            return Above::default();
        }
        let tstep = self.tstep_at(velocity);
        let [pwm, cool, high] = THRESHOLDS.map(|address| {
            let bound = self.bound(address);
            (tstep < bound, tstep < self.upper(address))
        });
        // Getting faster takes more than staying fast.
        let compare = |was: bool, (stays, begins): (bool, bool)| if was { stays } else { begins };
        Above {
            pwm: compare(above.pwm, pwm),
            cool: compare(above.cool, cool),
            high: compare(above.high, high),
        }
    }

    /// The TSTEP below which an axis remains faster than a threshold.
    fn bound(&self, address: u8) -> u32 {
        self.stored(address) + u32::from(address != TPWMTHRS)
    }

    /// The TSTEP below which an axis becomes faster than a threshold.
    fn upper(&self, address: u8) -> u32 {
        let threshold = self.stored(address).min(TSTEP_MAX);
        let parts = if self.stored(GCONF) >> 14 & 1 == 1 { 32 } else { 16 };
        (threshold * (parts - 1) / parts).saturating_sub(1)
    }
}
