//! Where the rotor is, by each of its sensors, and how fast it turns.

use opentmcl_motion::servo::hall::{self, HallCounter, HallStep};
use opentmcl_motion::servo::tachometer::Tachometer;
use opentmcl_motion::servo::{PERIODS_PER_SECOND, Senses, saturated};

/// A full turn in the unit of angles.
pub(super) const TURN: i64 = 65_536;

/// A counter of steps that come round with each turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counter {
    /// Steps of a turn, at least 1.
    steps: u32,
    turns: i32,
    /// Steps within the turn, below `steps`.
    within: u32,
}

impl Counter {
    pub(super) const fn new(steps: u32) -> Self {
        Self { steps: if steps == 0 { 1 } else { steps }, turns: 0, within: 0 }
    }

    #[inline]
    fn step(&mut self, by: i32) {
        let sum = i64::from(self.within) + i64::from(by);
        let steps = i64::from(self.steps);
        if (0..steps).contains(&sum) {
            self.within = sum as u32;
        } else {
            self.turns = self.turns.wrapping_add(sum.div_euclid(steps) as i32);
            self.within = sum.rem_euclid(steps) as u32;
        }
    }

    /// Takes a value of so many steps from 0.
    pub(super) fn set(&mut self, count: i32) {
        (self.turns, self.within) = (0, 0);
        self.step(count);
    }

    /// Steps within the turn.
    pub(super) fn within(&self) -> u32 {
        self.within
    }

    /// In 1/65536 turn.
    fn position(&self) -> i64 {
        i64::from(self.turns) * TURN + i64::from(self.within) * TURN / i64::from(self.steps)
    }

    /// All steps; wraps.
    fn count(&self) -> i32 {
        self.turns.wrapping_mul(self.steps as i32).wrapping_add(self.within as i32)
    }

    /// Angle in 1/65536 turn of the field, of which each step is so much.
    #[inline]
    fn electrical(&self, step: FieldStep) -> u16 {
        (u64::from(self.within).wrapping_mul(step.0) >> 32) as u16
    }
}

/// A step of a counter in turns of the field: in 2^-48 turn, so that a control period needs no division.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FieldStep(u64);

impl FieldStep {
    /// Rounded up, so that whole angles stay whole.
    fn new(steps: u32, pole_pairs: u32) -> Self {
        Self((u64::from(pole_pairs) << 48).div_ceil(u64::from(steps.max(1))))
    }
}

/// Where an angle or a position comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    OpenLoop,
    Halls,
    Encoder,
    Absolute,
}

/// How the signals of the sensors are to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    pub(super) pole_pairs: u32,
    pub(super) hall_inverted: bool,
    pub(super) hall_reversed: bool,
    pub(super) encoder_reversed: bool,
    pub(super) absolute_reversed: bool,
    /// Whether an absolute encoder is read at all.
    pub(super) has_absolute: bool,
    /// Whether the motor is seen from its other side, so that everything turns the other way.
    pub(super) mirrored: bool,
}

/// All sensors of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensors {
    pub(super) encoder: Counter,
    encoder_step: FieldStep,
    halls: Counter,
    pub(super) absolute: Counter,
    /// Electrical angle without a sensor, 1/65536 of its unit; all turns since it began.
    pub(super) open_loop: i64,
    hall_counter: HallCounter,
    pub(super) sector: Option<u8>,
    /// Control periods since the last edge of a hall line.
    since_edge: u32,
    encoder_before: u16,
    absolute_before: u16,
    /// Whether there is a reading before.
    started: bool,
    tachometer: Tachometer,
    /// Which sensor the tachometer looks at.
    watched: Source,
    /// Position in 1/65536 turn that the position counter calls 0.
    origin: i64,
}

impl Sensors {
    pub(super) fn new(source: Source, encoder_steps: u32, pole_pairs: u32) -> Self {
        Self {
            encoder: Counter::new(encoder_steps),
            encoder_step: FieldStep::new(encoder_steps, pole_pairs),
            halls: Counter::new(6 * pole_pairs),
            absolute: Counter::new(TURN as u32),
            open_loop: 0,
            hall_counter: HallCounter::default(),
            sector: None,
            since_edge: 0,
            encoder_before: 0,
            absolute_before: 0,
            started: false,
            tachometer: tachometer(source, encoder_steps, pole_pairs),
            watched: source,
            origin: 0,
        }
    }

    /// Takes the readings of a control period. Tells whether the hall lines have jumped.
    #[inline]
    pub(super) fn step(&mut self, senses: &Senses, reading: &Reading) -> bool {
        let sign = |reversed: bool| if reversed != reading.mirrored { -1 } else { 1 };
        let sector = hall::sector(senses.halls, reading.hall_inverted);
        self.sector = match sector {
            Some(sector) if reading.hall_reversed != reading.mirrored => Some((6 - sector) % 6),
            sector => sector,
        };
        let mut has_jumped = false;
        if self.started {
            let moved = senses.encoder.wrapping_sub(self.encoder_before) as i16;
            if moved != 0 {
                self.encoder.step(i32::from(moved) * sign(reading.encoder_reversed));
            }
            let turned = senses.absolute.wrapping_sub(self.absolute_before) as i16;
            if turned != 0 && reading.has_absolute {
                self.absolute.step(i32::from(turned) * sign(reading.absolute_reversed));
            }
        } else {
            self.restart_absolute(senses, reading);
            self.started = true;
        }
        self.encoder_before = senses.encoder;
        self.absolute_before = senses.absolute;
        self.since_edge = self.since_edge.saturating_add(1);
        match self.hall_counter.step(self.sector) {
            HallStep::Same => {}
            HallStep::Right => self.hall_edge(1),
            HallStep::Left => self.hall_edge(-1),
            HallStep::Error => has_jumped = true,
        }
        let age = if self.watched == Source::Halls { senses.hall_age } else { 0 };
        self.tachometer.step(self.counter(self.watched).count(), age);
        has_jumped
    }

    /// The absolute encoder is read for the first time, or no more.
    pub(super) fn restart_absolute(&mut self, senses: &Senses, reading: &Reading) {
        self.absolute = Counter::new(TURN as u32);
        if reading.has_absolute {
            let reversed = reading.absolute_reversed != reading.mirrored;
            let angle = i32::from(senses.absolute);
            self.absolute.set(if reversed { -angle } else { angle });
        }
    }

    fn hall_edge(&mut self, by: i32) {
        self.since_edge = 0;
        self.halls.step(by);
    }

    fn counter(&self, source: Source) -> &Counter {
        match source {
            Source::Halls | Source::OpenLoop => &self.halls,
            Source::Encoder => &self.encoder,
            Source::Absolute => &self.absolute,
        }
    }

    /// The electrical angle by a sensor, without its offset.
    #[inline]
    pub(super) fn angle(&self, source: Source, pole_pairs: u32, interpolated: bool) -> u16 {
        match source {
            Source::OpenLoop => (self.open_loop >> 16) as u16,
            Source::Halls if interpolated => {
                // Revolutions per minute are pole pairs times 65536 of the unit in 60 s.
                let speed = i64::from(self.tachometer.speed()) * i64::from(pole_pairs);
                let per_period = speed * (TURN * TURN / 256) / i64::from(60 * PERIODS_PER_SECOND);
                self.hall_counter.angle(self.since_edge, saturated(per_period))
            }
            Source::Halls => self.sector.map_or(0, hall::sector_angle),
            Source::Encoder => self.encoder.electrical(self.encoder_step),
            // A step is a unit of the angle.
            Source::Absolute => self.absolute.within.wrapping_mul(pole_pairs) as u16,
        }
    }

    /// Position in 1/65536 turn by a sensor, from where the position counter is 0.
    pub(super) fn position(&self, source: Source, pole_pairs: u32) -> i64 {
        self.raw_position(source, pole_pairs).saturating_sub(self.origin)
    }

    /// From now on this is the position.
    pub(super) fn set_position(&mut self, source: Source, pole_pairs: u32, position: i64) {
        self.origin = self.raw_position(source, pole_pairs).saturating_sub(position);
    }

    fn raw_position(&self, source: Source, pole_pairs: u32) -> i64 {
        match source {
            Source::OpenLoop => (self.open_loop >> 16) / i64::from(pole_pairs.max(1)),
            source => self.counter(source).position(),
        }
    }

    /// Speed in 1/256 revolution per minute.
    #[inline]
    pub(super) fn speed(&self) -> i32 {
        self.tachometer.speed()
    }

    /// Measures the speed by another sensor, from standstill.
    pub(super) fn watch(&mut self, source: Source, encoder_steps: u32, pole_pairs: u32) {
        if source != self.watched {
            self.watched = source;
            self.restart_tachometer(encoder_steps, pole_pairs);
        }
    }

    /// Forgets the speed.
    pub(super) fn restart_tachometer(&mut self, encoder_steps: u32, pole_pairs: u32) {
        self.tachometer = tachometer(self.watched, encoder_steps, pole_pairs);
    }

    /// Another number of steps per turn; the counters begin anew.
    pub(super) fn set_steps(&mut self, encoder_steps: u32, pole_pairs: u32) {
        let position = self.position(self.watched, pole_pairs);
        self.encoder = Counter::new(encoder_steps);
        self.encoder_step = FieldStep::new(encoder_steps, pole_pairs);
        self.halls = Counter::new(6 * pole_pairs);
        self.restart_tachometer(encoder_steps, pole_pairs);
        self.set_position(self.watched, pole_pairs, position);
    }
}

/// An encoder gives several counts in a period, so that marks need some distance to be precise: that of two runs of
/// the speed regulator, and four of them are 2 ms. Hall lines differ a little from each other, and six of their edges
/// are an electrical turn.
fn tachometer(source: Source, encoder_steps: u32, pole_pairs: u32) -> Tachometer {
    match source {
        Source::Halls | Source::OpenLoop => Tachometer::new(6 * pole_pairs, 0, 6),
        Source::Encoder => Tachometer::new(encoder_steps, 10, 4),
        Source::Absolute => Tachometer::new(TURN as u32, 10, 4),
    }
}
