//! Limits in the exact units, and how far an axis travels while it changes its speed.

use super::Limits;

/// Exact speed units in one register unit: 2^17.
pub(super) const SPEED_SHIFT: u32 = 17;
/// Exact position units in one microstep: 2^42.
pub(super) const POSITION_SHIFT: u32 = 42;
/// Half a microstep: where the position counter changes.
pub(super) const HALF_MICROSTEP: i128 = 1 << (POSITION_SHIFT - 1);
/// One register unit of speed.
pub(super) const SPEED_UNIT: i64 = 1 << SPEED_SHIFT;

const MAX_SPEED: u32 = (1 << 23) - 1;
const MAX_ACCELERATION: u32 = u16::MAX as u32;

/// The position counter for an exact position: rounded to the nearest microstep, wrapped to 32 bits.
pub(super) const fn microsteps(position: i128) -> i32 {
    ((position + HALF_MICROSTEP) >> POSITION_SHIFT) as i32
}

/// The same place on the 32-bit circle, next to zero, so that numbers stay small for ever.
pub(super) const fn wrapped(position: i128) -> i128 {
    const UNUSED: u32 = i128::BITS - 32 - POSITION_SHIFT;
    (((position + HALF_MICROSTEP) << UNUSED) >> UNUSED) - HALF_MICROSTEP
}

/// Part of a ramp with constant acceleration, seen in the direction of motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) clocks: i64,
    pub(super) speed: i64,
    pub(super) acceleration: i64,
}

impl Piece {
    /// From one speed to another. Whole clocks: the last, incomplete step of the speed is a jump by
    /// less than one register unit onto `to`, so a piece that is cut anywhere stays the same piece.
    fn between(from: i64, to: i64, acceleration: i64) -> Self {
        let change = to - from;
        if change == 0 {
            return Self { clocks: 0, speed: from, acceleration: 0 };
        }
        Self {
            clocks: change.abs().checked_div(acceleration).unwrap_or(0),
            speed: from,
            acceleration: acceleration * change.signum(),
        }
    }

    pub(super) fn distance(self) -> i128 {
        i128::from(2 * self.speed + self.acceleration * self.clocks) * i128::from(self.clocks)
    }
}

pub(super) fn distance(pieces: [Piece; 2]) -> i128 {
    let [first, second] = pieces;
    first.distance() + second.distance()
}

/// [`Limits`] in exact units, with the gaps that the registers allow closed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rates {
    pub(super) start: i64,
    pub(super) v1: i64,
    pub(super) max: i64,
    pub(super) stop: i64,
    pub(super) a1: i64,
    pub(super) amax: i64,
    pub(super) dmax: i64,
    pub(super) d1: i64,
}

impl Rates {
    pub(super) fn new(limits: &Limits) -> Self {
        let speed = |register: u32| i64::from(register.min(MAX_SPEED)) << SPEED_SHIFT;
        let acceleration = |register: u32| i64::from(register.min(MAX_ACCELERATION));
        let first_above_zero = |choices: [u32; 3]| {
            acceleration(choices.into_iter().find(|&choice| choice > 0).unwrap_or(1))
        };
        Self {
            start: speed(limits.vstart),
            v1: speed(limits.v1),
            max: speed(limits.vmax),
            stop: speed(limits.vstop.max(1)),
            a1: acceleration(limits.a1),
            amax: acceleration(limits.amax),
            dmax: first_above_zero([limits.dmax, limits.amax, 0]),
            d1: first_above_zero([limits.d1, limits.dmax, limits.amax]),
        }
    }

    /// Changing the speed with A1 below V1 and AMAX above.
    pub(super) fn change(&self, from: i64, to: i64) -> [Piece; 2] {
        if from <= to {
            let knee = self.v1.clamp(from, to);
            [Piece::between(from, knee, self.a1), Piece::between(knee, to, self.amax)]
        } else {
            let knee = self.v1.clamp(to, from);
            [Piece::between(from, knee, self.amax), Piece::between(knee, to, self.a1)]
        }
    }

    /// Braking down to VSTOP with DMAX above V1 and D1 below.
    pub(super) fn braking(&self, from: i64) -> [Piece; 2] {
        let to = self.stop.min(from);
        let knee = self.v1.clamp(to, from);
        [Piece::between(from, knee, self.dmax), Piece::between(knee, to, self.d1)]
    }

    /// Changing the speed with AMAX alone, as in velocity mode.
    pub(super) fn change_with_amax(&self, from: i64, to: i64) -> Piece {
        Piece::between(from, to, self.amax)
    }

    pub(super) fn braking_distance(&self, from: i64) -> i128 {
        distance(self.braking(from))
    }

    /// Travel from `speed` to `peak` and from there to a stop, without cruising.
    pub(super) fn distance_over(&self, speed: i64, peak: i64) -> i128 {
        distance(self.change(speed, peak)) + self.braking_distance(peak)
    }

    /// The speed that an axis faster than VMAX slows down to, given the accelerations that are zero.
    pub(super) fn slowest(&self, speed: i64) -> i64 {
        if speed > self.v1 && self.amax == 0 {
            speed
        } else if self.a1 == 0 {
            speed.min(self.v1).max(self.max)
        } else {
            self.max
        }
    }

    /// The speed that an axis not above VMAX can reach, given the accelerations that are zero.
    pub(super) fn fastest(&self, speed: i64) -> i64 {
        if speed < self.v1 && self.a1 == 0 {
            speed
        } else if self.amax == 0 {
            speed.max(self.v1.min(self.max))
        } else {
            self.max
        }
    }

    /// The highest speed, in whole register units, from which the axis can still stop within `room`
    /// after accelerating from `speed`; at least `speed` itself.
    ///
    /// Between two knees of the curve the travel grows with the square of the peak, which gives the
    /// answer up to the effect of whole clocks; the exact travel decides between the neighbours.
    pub(super) fn peak(&self, speed: i64, room: i128) -> i64 {
        let ceiling = self.fastest(speed);
        if self.distance_over(speed, ceiling) <= room {
            return ceiling;
        }
        let mut base = speed;
        for knee in [self.v1, self.stop] {
            if base < knee && knee < ceiling && self.distance_over(speed, knee) <= room {
                base = knee;
            }
        }
        let (up, down) = if base < self.v1 { (self.a1, self.d1) } else { (self.amax, self.dmax) };
        let slack = room - self.distance_over(speed, base);
        let gain = if base < self.stop {
            slack * i128::from(up)
        } else {
            (slack * i128::from(up * down)) / i128::from(up + down)
        };
        let estimate = speed_of_square(base, gain);
        largest(estimate, base, ceiling, |peak| self.distance_over(speed, peak) <= room).max(speed)
    }

    /// The speed to start with from rest: VSTART, or less if the axis could not stop within `room`.
    pub(super) fn start_speed(&self, room: i128) -> i64 {
        let ceiling = self.start.min(self.max);
        if self.braking_distance(ceiling) <= room {
            return ceiling;
        }
        let base =
            if self.stop < self.v1 && self.v1 < ceiling && self.braking_distance(self.v1) <= room {
                self.v1
            } else {
                self.stop
            };
        let down = if base < self.v1 { self.d1 } else { self.dmax };
        let slack = room - self.braking_distance(base);
        let estimate = speed_of_square(base, slack * i128::from(down));
        largest(estimate, base, ceiling, |speed| self.braking_distance(speed) <= room)
    }

    /// How far an axis faster than VMAX slows down before it has to brake for the target: to
    /// [`Rates::slowest`], or less far if slowing down gently takes more than the `room` there is.
    ///
    /// On the whole way down braking must remain possible. Between the knees the travel grows or
    /// shrinks steadily, so the ends and the knees are all that needs to be looked at.
    pub(super) fn slow_down(&self, speed: i64, room: i128) -> i64 {
        let goal = self.slowest(speed);
        let fits_down_to = |lower: i64| {
            [lower, self.v1.clamp(lower, speed), self.stop.clamp(lower, speed)]
                .into_iter()
                .all(|passed| self.distance_over(speed, passed) <= room)
        };
        if fits_down_to(goal) {
            return goal;
        }
        // The speed itself is known to fit: the axis can brake in time.
        let mut too_slow = goal >> SPEED_SHIFT;
        let mut fits = (speed >> SPEED_SHIFT) + 1;
        while fits - too_slow > 1 {
            let middle = too_slow.midpoint(fits);
            if fits_down_to(middle << SPEED_SHIFT) {
                fits = middle;
            } else {
                too_slow = middle;
            }
        }
        (fits << SPEED_SHIFT).min(speed)
    }
}

/// How many whole clocks a cruise over `distance` takes, and what remains of the distance.
pub(super) fn cruise(distance: i128, speed: i64) -> (i128, i128) {
    let per_clock = 2 * speed;
    match i64::try_from(distance) {
        // Nearly every cruise; the wide division takes several times as long.
        Ok(distance) => (
            i128::from(distance.checked_div(per_clock).unwrap_or(0)),
            i128::from(distance.checked_rem(per_clock).unwrap_or(0)),
        ),
        Err(_) => {
            let clocks = distance.checked_div(i128::from(per_clock)).unwrap_or(0);
            (clocks, distance - clocks * i128::from(per_clock))
        }
    }
}

/// The square root of `base² + gain` in whole register units.
fn speed_of_square(base: i64, gain: i128) -> i64 {
    let square = i128::from(base) * i128::from(base) + gain;
    let in_units = u64::try_from(square >> (2 * SPEED_SHIFT)).unwrap_or(0);
    i64::try_from(in_units.isqrt()).unwrap_or(0)
}

/// The largest whole register unit from `base` to `ceiling` that fits, looked for near `estimate`.
fn largest(estimate: i64, base: i64, ceiling: i64, fits: impl Fn(i64) -> bool) -> i64 {
    let base = base >> SPEED_SHIFT;
    let ceiling = (ceiling >> SPEED_SHIFT).max(base);
    let mut units = estimate.clamp(base, ceiling);
    while units > base && !fits(units << SPEED_SHIFT) {
        units -= 1;
    }
    while units < ceiling && fits((units + 1) << SPEED_SHIFT) {
        units += 1;
    }
    units << SPEED_SHIFT
}
