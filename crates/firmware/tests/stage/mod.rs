//! A board with one simple machine behind axis 3: the ideal ramp, switches with hysteresis and bounce at
//! places of the stage, an encoder that a barrier can hold, and a stall at a given time.
//!
//! The machine stands at `origin` + position counter. What changes by itself is found by looking at each
//! millisecond and then halving, so that the firmware hears of it in the very clock.

mod flash;

use flash::Flash;
use opentmcl_catalog::TMCM_6214;
use opentmcl_firmware::{Analog, Answer, Board, Config, Module};
use opentmcl_motion::ramp::{Limits, Mode, Ramp};
use opentmcl_wire::{Instant, mnemonic};

/// The axis with the machine.
pub(crate) const AXIS: u8 = 3;
const MILLISECOND: u64 = 16_000;
/// How far the board looks ahead; it wakes the firmware then if the axis moves.
const HORIZON: u64 = 500;
/// How often a switch changes within its bouncing time.
const BOUNCES: u64 = 6;

/// A switch that closes within its range and opens beyond its hysteresis.
#[derive(Clone, Copy)]
pub(crate) struct Switch {
    pub(crate) from: i64,
    pub(crate) to: i64,
    pub(crate) hysteresis: i64,
    /// Ticks for which the contact bounces.
    pub(crate) bounce: u64,
    closed: bool,
    changed_at: Option<u64>,
}

impl Switch {
    pub(crate) fn new(from: i64, to: i64) -> Self {
        Self { from, to, hysteresis: 0, bounce: 0, closed: false, changed_at: None }
    }

    fn level_at(&self, place: i64) -> bool {
        let margin = if self.closed { self.hysteresis } else { 0 };
        (self.from - margin..=self.to + margin).contains(&place)
    }

    fn update(&mut self, place: i64, now: u64) {
        let level = self.level_at(place);
        if level != self.closed {
            self.closed = level;
            self.changed_at = Some(now);
        }
    }

    fn bounces_since(&self, now: u64) -> Option<u64> {
        let since = now - self.changed_at.filter(|_| self.bounce != 0)?;
        (since < self.bounce).then_some(since * BOUNCES / self.bounce)
    }

    fn shown(&self, now: u64) -> bool {
        self.closed ^ self.bounces_since(now).is_some_and(|count| count % 2 == 1)
    }

    fn next_bounce(&self, now: u64) -> Option<u64> {
        let next = self.bounces_since(now)? + 1;
        Some(self.changed_at? + (next * self.bounce).div_ceil(BOUNCES))
    }
}

pub(crate) struct Stage {
    now: u64,
    registers: [[u32; 128]; 6],
    ramp: Ramp,
    /// Place of the machine where the position counter is 0.
    pub(crate) origin: i64,
    pub(crate) left: Switch,
    pub(crate) right: Switch,
    pub(crate) home: Switch,
    /// Place of the encoder's null channel.
    pub(crate) index: i64,
    /// Where the machine, and with it the encoder, stops to follow to the right.
    pub(crate) barrier: Option<i64>,
    encoder_origin: i64,
    is_past_index: bool,
    /// When the load becomes too high.
    pub(crate) stall_at: Option<u64>,
    pub(crate) outputs: u8,
    flash: Flash,
}

const NOWHERE: i64 = 1 << 40;

impl Stage {
    pub(crate) fn new() -> Self {
        let nowhere = Switch::new(NOWHERE, NOWHERE);
        Self {
            now: 0,
            registers: [[0; 128]; 6],
            ramp: Ramp::new(),
            origin: 0,
            left: nowhere,
            right: nowhere,
            home: nowhere,
            index: NOWHERE,
            barrier: None,
            encoder_origin: 0,
            is_past_index: false,
            stall_at: None,
            outputs: 0,
            flash: Flash::new(),
        }
    }

    pub(crate) fn place(&self) -> i64 {
        self.place_at(self.now)
    }

    fn place_at(&self, time: u64) -> i64 {
        self.origin + i64::from(self.ramp.position(Instant::from_ticks(time)))
    }

    fn encoder_at(&self, time: u64) -> i64 {
        let place = self.place_at(time);
        self.barrier.map_or(place, |barrier| place.min(barrier)) - self.encoder_origin
    }

    fn deviates_at(&self, time: u64) -> bool {
        let limit = i64::from(self.registers[3][0x3D]);
        let counter = self.place_at(time) - self.origin;
        limit != 0 && (self.encoder_at(time) - counter).abs() > limit
    }

    /// All that the machine shows at a time.
    fn levels_at(&self, time: u64) -> [bool; 5] {
        let place = self.place_at(time);
        let [left, right, home] = [&self.left, &self.right, &self.home].map(|s| s.level_at(place));
        [left, right, home, place >= self.index, self.deviates_at(time)]
    }

    fn update(&mut self) {
        let (now, place) = (self.now, self.place());
        for switch in [&mut self.left, &mut self.right, &mut self.home] {
            switch.update(place, now);
        }
        if (place >= self.index) != self.is_past_index {
            self.is_past_index = !self.is_past_index;
            let chip = &mut self.registers[3];
            chip[0x3B] |= 1;
            if chip[0x38] & 0x20 != 0 {
                chip[0x38] &= !0x20;
                chip[0x36] = (self.index - self.origin) as u32;
            }
        }
        if self.deviates_at(now) {
            self.registers[3][0x3B] |= 2;
        }
        let watches_stall = self.registers[3][0x34] & 0x400 != 0;
        if watches_stall && self.stall_at.is_some_and(|stall| stall <= now) {
            self.stall_at = None;
            self.ramp.stop_now(Instant::from_ticks(now));
            self.registers[3][0x35] |= 0x40;
        }
    }

    fn limits(&self) -> Limits {
        let chip = &self.registers[3];
        Limits {
            mode: match chip[0x20] {
                0 => Mode::Position,
                1 => Mode::VelocityPositive,
                2 => Mode::VelocityNegative,
                _ => Mode::Hold,
            },
            target: chip[0x2D] as i32,
            vstart: chip[0x23],
            a1: chip[0x24],
            v1: chip[0x25],
            amax: chip[0x26],
            vmax: chip[0x27],
            dmax: chip[0x28],
            d1: chip[0x2A],
            vstop: chip[0x2B],
            ..Limits::default()
        }
    }
}

impl Board for Stage {
    type Flash = Flash;

    fn set_time(&mut self, now: Instant) {
        self.now = now.as_ticks();
        self.update();
    }

    fn next_event(&mut self) -> Option<Instant> {
        let now = self.now;
        let time = Instant::from_ticks(now);
        let ramp = self.ramp.next_event(time).map(|event| event.as_ticks());
        let bounces = [&self.left, &self.right, &self.home].map(|s| s.next_bounce(now));
        let watches_stall = self.registers[3][0x34] & 0x400 != 0;
        let stall = self.stall_at.filter(|&stall| watches_stall && stall > now);
        let mut next = bounces.into_iter().chain([ramp, stall]).flatten().min();
        let moves = self.ramp.velocity(time) != 0 || ramp.is_some();
        if moves {
            let levels = self.levels_at(now);
            let at = |step: u64| now + step * MILLISECOND;
            let first = (1..HORIZON).find(|&step| self.levels_at(at(step)) != levels);
            let change = first.map_or(at(HORIZON), |step| {
                let (mut same, mut other) = (at(step - 1), at(step));
                while other - same > 1 {
                    let middle = (same + other) / 2;
                    let place =
                        if self.levels_at(middle) == levels { &mut same } else { &mut other };
                    *place = middle;
                }
                other
            });
            next = Some(next.map_or(change, |next| next.min(change)));
        }
        next.map(Instant::from_ticks)
    }

    fn read_register(&mut self, axis: u8, address: u8) -> u32 {
        let value = self.registers[usize::from(axis)][usize::from(address)];
        if axis != AXIS {
            return value;
        }
        let time = Instant::from_ticks(self.now);
        match address {
            0x21 => self.ramp.position(time) as u32,
            0x22 => self.ramp.velocity(time) as u32,
            0x35 => {
                let position_reached = self.ramp.position(time) == self.limits().target;
                value & 0x40
                    | u32::from(self.left.shown(self.now))
                    | u32::from(self.right.shown(self.now)) << 1
                    | u32::from(self.ramp.velocity_reached(time)) << 8
                    | u32::from(position_reached) << 9
                    | u32::from(self.ramp.velocity(time) == 0) << 10
            }
            0x39 => self.encoder_at(self.now) as u32,
            _ => value,
        }
    }

    fn write_register(&mut self, axis: u8, address: u8, value: u32) {
        let cell = &mut self.registers[usize::from(axis)][usize::from(address)];
        // Events are cleared by writing 1.
        if matches!(address, 0x35 | 0x3B) {
            *cell &= !value;
            self.update();
            return;
        }
        *cell = value;
        if axis != AXIS {
            return;
        }
        let time = Instant::from_ticks(self.now);
        match address {
            0x21 => {
                self.origin = self.place() - i64::from(value as i32);
                self.ramp.set_position(time, value as i32);
            }
            0x39 => {
                self.encoder_origin = 0;
                self.encoder_origin = self.encoder_at(self.now) - i64::from(value as i32);
            }
            0x20..=0x2D => self.ramp.plan(time, &self.limits()),
            _ => {}
        }
        self.update();
    }

    fn digital_inputs(&mut self) -> u8 {
        0
    }

    fn home_switch(&mut self, axis: u8) -> bool {
        axis == AXIS && self.home.shown(self.now)
    }

    fn torque_inputs(&mut self) -> u8 {
        3
    }

    fn analog(&mut self, _: Analog) -> i32 {
        0
    }

    fn set_analog_range(&mut self, _: u8, _: u8) {}

    fn set_digital_outputs(&mut self, levels: u8) {
        self.outputs = levels;
    }

    fn set_pull_ups(&mut self, _: u8) {}

    fn flash(&mut self) -> &mut Flash {
        &mut self.flash
    }

    fn reset(&mut self) {
        self.registers = [[0; 128]; 6];
    }
}

/// A module on a stage, and the time.
pub(crate) struct Bench {
    pub(crate) module: Module<Stage>,
    now: u64,
}

impl Bench {
    pub(crate) fn new(stage: Stage) -> Self {
        let now = Instant::from_ticks(0);
        Self { module: Module::power_up(&TMCM_6214, stage, Config::default(), now), now: 0 }
    }

    /// Value of the reply to a command that must be accepted.
    pub(crate) fn ask(&mut self, command: &str) -> i32 {
        let parsed = mnemonic::parse(command).unwrap();
        match self.module.execute_direct(parsed, Instant::from_ticks(self.now)) {
            Answer::Reply(reply) if reply.status.is_ok() => reply.value,
            other => panic!("{command}: {other:?}"),
        }
    }

    /// Lets time pass, asking the module only when it wants to be.
    pub(crate) fn wait_ms(&mut self, time: u64) {
        self.now += time * MILLISECOND;
        self.module.poll(Instant::from_ticks(self.now));
    }

    pub(crate) fn stage(&mut self) -> &mut Stage {
        self.module.board_mut()
    }

    pub(crate) fn now_ms(&self) -> u64 {
        self.now / MILLISECOND
    }
}
