//! The ticked ramp generator against another one that knows no shortcut: it looks at every 32 clocks
//! whether there is a tick, and calculates with the formulas of the data sheet in fractions.

use opentmcl_motion::Instant;
use opentmcl_motion::ticked::{Barred, BrakingFactor, Mode, Ramp, Settings, braking_factor};

/// SplitMix64: a seed gives the same settings on every platform.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn chance(&mut self, one_in: u64) -> bool {
        self.below(one_in) == 0
    }

    /// Up to `bits` bits, all magnitudes alike.
    fn magnitude(&mut self, bits: u64) -> u32 {
        let width = self.below(bits + 1);
        (self.next() & ((1 << width) - 1)) as u32
    }

    fn signed(&mut self, bits: u64) -> i32 {
        let magnitude = self.magnitude(bits) as i32;
        if self.chance(2) { -magnitude } else { magnitude }
    }

    fn settings(&mut self, near: i32) -> Settings {
        let divisors = if self.chance(4) { 14 } else { 8 };
        let (ramp_div, pulse_div) = (self.below(divisors) as u32, self.below(divisors) as u32);
        let a_max = if self.chance(20) { 0 } else { self.magnitude(11) };
        let fitting = braking_factor(a_max, ramp_div, pulse_div);
        let any = BrakingFactor { pmul: 128 + self.below(128) as u8, pdiv: self.below(16) as u8 };
        Settings {
            mode: match self.below(10) {
                0 | 1 => Mode::Velocity,
                2 => Mode::Hold,
                3 | 4 => Mode::Soft,
                _ => Mode::Ramp,
            },
            target: if self.chance(10) { near } else { near.wrapping_add(self.signed(16)) },
            v_min: if self.chance(3) { self.magnitude(11) } else { 1 },
            v_max: if self.chance(20) { 0 } else { self.magnitude(11) },
            v_target: self.signed(11),
            a_max,
            factor: if self.chance(4) { any } else { fitting.unwrap_or(any) },
            pulse_div,
            ramp_div,
            barred: Barred {
                negative: self.chance(8),
                positive: self.chance(8),
                soft: self.chance(2),
            },
        }
    }
}

/// The generator without shortcuts. Velocities in 1/256.
struct Plain {
    settings: Settings,
    time: u64,
    velocity: i32,
    position: i32,
    accumulator: i32,
}

fn wrapped(position: i32) -> i32 {
    (position + 0x80_0000).rem_euclid(0x100_0000) - 0x80_0000
}

fn toward(velocity: i32, goal: i32, step: i32) -> i32 {
    if velocity < goal { (velocity + step).min(goal) } else { (velocity - step).max(goal) }
}

impl Plain {
    fn set(&mut self, settings: Settings) {
        self.settings = Settings { target: wrapped(settings.target), ..settings };
        if settings.mode == Mode::Hold && !self.barred(settings.v_target) {
            self.velocity = settings.v_target * 256;
        }
        if !settings.barred.soft && self.barred(self.velocity) {
            self.velocity = 0;
        }
        self.stop_on_target();
    }

    fn advance(&mut self, now: u64) {
        while self.time + 32 - self.time % 32 <= now {
            self.time += 32 - self.time % 32;
            if self.time.is_multiple_of(32 << self.settings.ramp_div) {
                self.ramp_tick();
            }
            if self.time.is_multiple_of(32 << self.settings.pulse_div) {
                self.pulse_tick();
            }
        }
        self.time = now;
    }

    fn pulse_tick(&mut self) {
        self.accumulator += self.velocity.abs() / 256;
        if self.accumulator >= 2048 {
            self.accumulator -= 2048;
            self.position = wrapped(self.position + self.velocity.signum());
            self.stop_on_target();
        }
    }

    fn stop_on_target(&mut self) {
        let positions = matches!(self.settings.mode, Mode::Ramp | Mode::Soft);
        let slow = self.velocity.abs() <= self.settings.v_min as i32 * 256;
        if positions && slow && self.position == self.settings.target {
            self.velocity = 0;
        }
    }

    fn barred(&self, direction: i32) -> bool {
        let barred = &self.settings.barred;
        direction > 0 && barred.positive || direction < 0 && barred.negative
    }

    fn ramp_tick(&mut self) {
        let settings = self.settings;
        let step = settings.a_max as i32;
        let v_max = settings.v_max as i32 * 256;
        let positions = matches!(settings.mode, Mode::Ramp | Mode::Soft);
        let distance = wrapped(settings.target - self.position);
        let direction = if positions { distance.signum() } else { settings.v_target.signum() };
        if self.barred(direction) || positions && distance == 0 {
            self.velocity = toward(self.velocity, 0, step);
            self.stop_on_target();
            return;
        }
        match settings.mode {
            Mode::Hold => self.velocity = settings.v_target * 256,
            Mode::Velocity => {
                let goal = (settings.v_target * 256).clamp(-v_max, v_max);
                self.velocity = toward(self.velocity, goal, step);
            }
            Mode::Soft | Mode::Ramp => {
                let speed = self.velocity * direction;
                let part = if speed < 0 { 0 } else { self.accumulator };
                // In 1/2048 microstep.
                let way = i128::from(distance.abs()) * 2048 - i128::from(part);
                let floor = settings.v_min.min(settings.v_max) as i32 * 256;
                let next = if settings.mode == Mode::Soft {
                    // p' d / 2 in 1/256 of a unit
                    let goal = i128::from(settings.factor.pmul) * way * 256
                        / (2 * 2048)
                        / (8 << settings.factor.pdiv);
                    toward(speed, goal.clamp(floor.into(), v_max.into()) as i32, step)
                } else {
                    let faster = toward(speed, v_max, step);
                    if self.stops(faster, way) {
                        faster
                    } else if floor < speed && speed < faster && self.stops(speed, way) {
                        speed
                    } else {
                        toward(speed, floor, step)
                    }
                };
                self.velocity = next * direction;
            }
        }
    }

    /// Whether v² <= 2048 p' d holds after a ramp period at this speed.
    fn stops(&self, speed: i32, way: i128) -> bool {
        let settings = &self.settings;
        let per_period = i128::from(speed / 256) * (1 << settings.ramp_div);
        let left = way - per_period / (1 << settings.pulse_div);
        // Both sides times 2^16 * 2^(3 + pdiv).
        let square = i128::from(speed).pow(2) * (8 << settings.factor.pdiv);
        speed <= 0 || square <= i128::from(settings.factor.pmul) * left * 65_536
    }
}

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

#[test]
fn shortcuts_give_what_every_single_tick_gives_however_often_they_are_asked() {
    let mut random = Random(1);
    for _ in 0..1500 {
        let mut plain = Plain {
            settings: Settings::default(),
            time: 0,
            velocity: 0,
            position: 0,
            accumulator: 0,
        };
        let (mut once, mut polled) = (Ramp::new(), Ramp::new());
        let mut now = 0;
        for _ in 0..6 {
            let settings = random.settings(plain.position);
            plain.set(settings);
            once.set(at(now), &settings);
            polled.set(at(now), &settings);
            let end = now + u64::from(random.magnitude(23));
            plain.advance(end);
            let polls = random.below(50);
            for poll in 0..polls {
                polled.advance(at(now + (end - now) * poll / polls + random.below(64)));
            }
            // Polls must not be later than the end, so this one may be later than `end`.
            let end = end + 64;
            plain.advance(end);
            once.advance(at(end));
            polled.advance(at(end));
            now = end;
            assert_eq!(once.exact_velocity(), plain.velocity, "{settings:?}");
            assert_eq!(once.position(), plain.position, "{settings:?}");
            assert_eq!(format!("{once:?}"), format!("{polled:?}"));
        }
    }
}

#[test]
fn an_event_comes_when_it_is_foreseen_from_anywhere_before() {
    let mut random = Random(2);
    for _ in 0..300 {
        let mut ramp = Ramp::new();
        let mut now = at(0);
        for _ in 0..5 {
            let settings = random.settings(ramp.position());
            ramp.set(now, &settings);
            ramp.take_events();
            let Some(next) = ramp.next_event(now) else { continue };
            assert!(next > now, "{settings:?}");
            let between = at(now.as_ticks() + random.below(next.as_ticks() - now.as_ticks()));
            ramp.advance(between);
            assert!(!ramp.take_events().stopped, "before {next:?}: {settings:?}");
            let foreseen = ramp.next_event(between).expect("still to come");
            // A look ahead of limited length may see more from a later time.
            assert!(foreseen >= next, "{settings:?}");
            now = next;
            ramp.advance(now);
        }
    }
}

#[test]
fn nothing_in_the_settings_makes_the_ramp_panic_and_values_out_of_range_count_as_the_last_ones() {
    let mut random = Random(3);
    for _ in 0..2_000 {
        let mut any = |bits| if random.chance(3) { u32::MAX } else { random.magnitude(bits) };
        let wild = Settings {
            target: any(32).cast_signed(),
            v_min: any(12),
            v_max: any(12),
            v_target: any(32).cast_signed(),
            a_max: any(12),
            factor: BrakingFactor { pmul: any(8) as u8, pdiv: any(8) as u8 },
            pulse_div: any(5),
            ramp_div: any(5),
            ..random.settings(0)
        };
        let mut ramp = Ramp::new();
        ramp.set(at(0), &wild);
        ramp.set_position(at(0), random.next() as i32);
        ramp.set_velocity(at(0), random.next() as i32);
        let tame = *ramp.settings();
        assert!(tame.v_max <= 2047 && tame.a_max <= 2047 && tame.v_min <= 2047);
        assert!(tame.pulse_div <= 13 && tame.ramp_div <= 13 && tame.v_target.abs() <= 2047);
        for time in [1 << 20, 1 << 24] {
            ramp.advance(at(time));
            ramp.next_event(at(time));
            assert!(ramp.velocity().abs() <= 2047 && ramp.position().abs() <= 1 << 23);
        }
        // At a constant speed the end of time is not far.
        ramp.set(at(1 << 24), &Settings { mode: Mode::Hold, ..wild });
        ramp.advance(at(u64::MAX));
        ramp.set(at(u64::MAX), &Settings { mode: Mode::Ramp, ..wild });
        ramp.next_event(at(u64::MAX));
    }
}
