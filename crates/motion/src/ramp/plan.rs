//! Planning: from the state at a time and the limits to segments.
//!
//! Distances and speeds are seen in the direction of motion (`sign`), so every case is written once.

use super::rates::{
    HALF_MICROSTEP, POSITION_SHIFT, Piece, Rates, SPEED_UNIT, cruise, distance, microsteps, wrapped,
};
use super::{Barred, Limits, MAX_SEGMENTS, Mode, Phase, Ramp, Segment};

impl Ramp {
    /// Plans from the state at `now`, or from that velocity at another position.
    pub(super) fn replan(&mut self, now: u64, limits: &Limits, position: Option<i128>) {
        let segment = *self.segment(now);
        let velocity = segment.velocity_at(now);
        let on_final_approach = !segment.stands() && self.braking_from <= now;
        let stopped = match velocity {
            // About to start in this very instant.
            0 if !segment.stands() => self.stopped_before,
            _ => self.stop_time(now),
        };
        let mut planner = Planner {
            rates: Rates::new(limits),
            target: limits.target,
            zero_wait: limits.zero_wait.as_ticks(),
            segments: [Segment::standstill(now, 0); MAX_SEGMENTS],
            count: 0,
            time: now,
            position: wrapped(position.unwrap_or_else(|| segment.position_at(now))),
            stopped,
            braked: if segment.phase == Phase::Waiting { self.braked } else { 0 },
            second_move: None,
            arrival: None,
            braking_from: u64::MAX,
            old_residue: on_final_approach.then_some(self.residue),
            residue: 0,
            same_speed_limit: self.limits.vmax == limits.vmax,
        };
        let moving = velocity;
        let velocity = if limits.barred.bars(velocity) {
            planner.halt(velocity, limits.barred.soft);
            0
        } else {
            velocity
        };
        let halted = planner.count;
        match limits.mode {
            Mode::Position => planner.move_to_target(velocity),
            Mode::VelocityPositive => planner.run(velocity, planner.rates.max),
            Mode::VelocityNegative => planner.run(velocity, -planner.rates.max),
            Mode::Hold => planner.keep(velocity),
        }
        planner.cut(halted, limits.barred);
        self.limits = *limits;
        self.segments = planner.segments;
        self.count = planner.count;
        // An axis that stops in the instant of planning has no segment in which it moves.
        self.stopped_before = if moving == 0 { stopped } else { Some(now) };
        self.braked = planner.braked;
        self.second_move = planner.second_move;
        self.arrival = planner.arrival;
        self.braking_from = planner.braking_from;
        self.residue = planner.residue;
    }
}

struct Planner {
    rates: Rates,
    target: i32,
    zero_wait: u64,
    segments: [Segment; MAX_SEGMENTS],
    count: usize,
    /// End of what is planned so far.
    time: u64,
    position: i128,
    /// When the axis stopped, if it stands at `time` and has ever moved.
    stopped: Option<u64>,
    braked: i64,
    second_move: Option<u64>,
    arrival: Option<u64>,
    braking_from: u64,
    /// What the previous plan left behind its braking distance, if it is braking for its target.
    old_residue: Option<i128>,
    residue: i128,
    same_speed_limit: bool,
}

impl Planner {
    fn push(&mut self, velocity: i64, acceleration: i64, phase: Phase) {
        if let Some(segment) = self.segments.get_mut(self.count) {
            *segment = Segment {
                start: self.time,
                position: self.position,
                velocity,
                acceleration: acceleration as i32,
                phase,
            };
            self.count += 1;
        }
    }

    fn travel(&mut self, sign: i64, piece: Piece, phase: Phase) {
        if piece.clocks > 0 {
            self.push(sign * piece.speed, sign * piece.acceleration, phase);
            self.position += i128::from(sign) * piece.distance();
            self.time = self.time.saturating_add(piece.clocks.unsigned_abs());
        }
    }

    fn cruise(&mut self, sign: i64, speed: i64, clocks: i128) {
        let clocks = i64::try_from(clocks).unwrap_or(i64::MAX);
        self.travel(sign, Piece { clocks, speed, acceleration: 0 }, Phase::Cruising);
    }

    /// The stop of an axis that moves in a barred direction.
    fn halt(&mut self, velocity: i64, soft: bool) {
        if soft {
            for piece in self.rates.braking(velocity.abs()) {
                self.travel(velocity.signum(), piece, Phase::Decelerating);
            }
            self.position = wrapped(self.position);
        }
        self.stopped = Some(self.time);
    }

    /// Lets the plan end where a motion in a barred direction would begin, looking from a segment on.
    fn cut(&mut self, from: usize, barred: Barred) {
        let begins = |segment: &Segment| {
            let direction = match segment.velocity {
                0 => i64::from(segment.acceleration),
                velocity => velocity,
            };
            !segment.stands() && barred.bars(direction)
        };
        let Some(at) = (from..self.count).find(|&at| self.segments.get(at).is_some_and(begins))
        else {
            return;
        };
        if let Some(segment) = self.segments.get_mut(at) {
            *segment = Segment::standstill(segment.start, segment.position);
        }
        self.count = at + 1;
        // A wait for a motion that does not come is a standstill.
        let before = at.checked_sub(1).and_then(|before| self.segments.get_mut(before));
        if let Some(wait) = before.filter(|before| before.phase == Phase::Waiting) {
            wait.phase = Phase::Standstill;
            self.count = at;
        }
        self.arrival = None;
        self.second_move = None;
        self.braking_from = u64::MAX;
    }

    fn stand(&mut self) {
        self.push(0, 0, Phase::Standstill);
    }

    /// The wait at zero, as far as it has not passed.
    fn wait(&mut self) {
        let end = self.stopped.map_or(0, |stop| stop.saturating_add(self.zero_wait));
        if self.time < end {
            self.push(0, 0, Phase::Waiting);
            self.time = end;
        }
    }

    /// Hold mode; also what is left when acceleration is impossible.
    fn keep(&mut self, velocity: i64) {
        let phase = if velocity == 0 { Phase::Standstill } else { Phase::Cruising };
        self.push(velocity, 0, phase);
    }

    /// Velocity mode: to the velocity `goal` with AMAX, through zero with a wait.
    fn run(&mut self, velocity: i64, goal: i64) {
        if self.rates.amax == 0 && velocity != goal {
            return self.keep(velocity);
        }
        let mut speed = velocity.abs();
        if velocity != 0 && velocity.signum() != goal.signum() {
            let braking = self.rates.change_with_amax(speed, 0);
            self.travel(velocity.signum(), braking, Phase::Decelerating);
            self.stopped = Some(self.time);
            speed = 0;
        }
        if goal == 0 {
            return self.stand();
        }
        if speed == 0 {
            self.wait();
        }
        let phase = if speed <= goal.abs() { Phase::Accelerating } else { Phase::Decelerating };
        let change = self.rates.change_with_amax(speed, goal.abs());
        self.travel(goal.signum(), change, phase);
        self.keep(goal);
    }

    /// Microsteps to the target, the short way round the 32-bit circle.
    fn way(&self) -> i32 {
        self.target.wrapping_sub(microsteps(self.position))
    }

    /// Distance to the point where the position counter becomes the target.
    fn room(&self, sign: i64) -> i128 {
        let goal = i128::from(microsteps(self.position)) + i128::from(self.way());
        i128::from(sign) * ((goal << POSITION_SHIFT) - self.position) - HALF_MICROSTEP
    }

    fn move_to_target(&mut self, velocity: i64) {
        if velocity == 0 {
            return self.move_from_rest();
        }
        // An axis that is on its target already must have come too fast: it is leaving it.
        let sign = match self.way() {
            0 => velocity.signum(),
            way => i64::from(way.signum()),
        };
        let room = self.room(sign);
        let speed = sign * velocity;
        if speed > 0 && self.rates.braking_distance(speed) <= room {
            return self.approach(sign, speed, room);
        }
        for piece in self.rates.braking(speed.abs()) {
            self.travel(velocity.signum(), piece, Phase::Decelerating);
        }
        self.position = wrapped(self.position);
        self.stopped = Some(self.time);
        self.braked = velocity.signum();
        self.move_from_rest();
    }

    fn move_from_rest(&mut self) {
        let sign = i64::from(self.way().signum());
        if sign == 0 {
            self.arrival = Some(self.time);
            return self.stand();
        }
        let room = self.room(sign);
        let speed = self.rates.start_speed(room);
        if self.rates.fastest(speed) == 0 {
            return self.stand();
        }
        self.wait();
        if sign == -self.braked {
            self.second_move = Some(self.time);
        }
        self.approach(sign, speed, room);
    }

    /// The way to the target in one direction, of which the last part is braking. The axis can
    /// brake from `speed` within `room`.
    fn approach(&mut self, sign: i64, speed: i64, room: i128) {
        // A braking that is under way goes on as it was planned: what the whole clocks of its plan
        // left over is not worth a new acceleration or a creep at the speed of now.
        let braking_already = (speed <= self.rates.max || self.same_speed_limit)
            && self
                .old_residue
                .is_some_and(|residue| residue == room - self.rates.braking_distance(speed));
        let (peak, phase) = if braking_already {
            (speed, Phase::Decelerating)
        } else if speed > self.rates.max {
            (self.rates.slow_down(speed, room), Phase::Decelerating)
        } else {
            // Below one register unit, where VSTART cannot be, the axis would creep.
            (self.rates.peak(speed, room).max(SPEED_UNIT), Phase::Accelerating)
        };
        let change = self.rates.change(speed, peak);
        for piece in change {
            self.travel(sign, piece, phase);
        }
        if peak == 0 {
            self.stopped = Some(self.time);
            if self.way() == 0 {
                self.arrival = Some(self.time);
            }
            return self.stand();
        }
        let braking = self.rates.braking(peak);
        self.residue = room - distance(change) - distance(braking);
        if !braking_already {
            let (clocks, rest) = cruise(self.residue, peak);
            self.cruise(sign, peak, clocks);
            self.residue = rest;
        }
        self.braking_from = self.time;
        for piece in braking {
            self.travel(sign, piece, Phase::Decelerating);
        }
        self.arrival = Some(self.time);
        self.position = i128::from(self.target) << POSITION_SHIFT;
        self.stand();
    }
}
