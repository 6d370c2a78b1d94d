//! The control interrupt, and what else happens to a servo axis in its time.

use opentmcl_catalog::{Globals, Motion};
use opentmcl_motion::servo::PERIOD_TICKS;
use opentmcl_wire::{Duration, Instant};

use super::{Behaviour, PERIODS_PER_TICK, SERVO_AXIS, Surroundings};
use crate::board::{Analog, Board};
use crate::module::Module;

/// How often a host that serves the module should look after an axis that moves.
const CATCH_UP: Duration = Duration::from_millis(10);

impl<B: Board> Module<B> {
    /// Whether the axis is a servo axis.
    #[inline]
    pub(crate) fn has_servo(&self) -> bool {
        self.model.motion.is_servo()
    }

    /// Runs all control interrupts that are due until a time.
    #[inline]
    pub(crate) fn run_servo(&mut self, until: Instant) {
        if self.has_servo() && !self.servo.is_asleep {
            self.run_control(until);
        }
    }

    fn run_control(&mut self, until: Instant) {
        while self.servo.next <= until && !self.servo.is_asleep {
            let now = self.servo.next;
            self.board.set_time(now);
            self.board.sense(SERVO_AXIS, &mut self.servo.senses);
            let number = now.as_ticks() / PERIOD_TICKS;
            let power = self.servo.period(number);
            self.board.drive(SERVO_AXIS, &power);
            self.servo.power = power;
            if number.is_multiple_of(PERIODS_PER_TICK) {
                let around = self.surroundings();
                self.servo.tick(&around);
                if self.servo.has_settled() && self.board.is_still(SERVO_AXIS) {
                    self.servo.is_asleep = true;
                }
            }
            self.servo.next = now + Duration::from_ticks(PERIOD_TICKS);
        }
    }

    /// Somebody touches the axis: what slept goes on.
    pub(crate) fn wake_servo(&mut self) {
        self.servo.wake(self.now);
    }

    /// What the axis has around it at present.
    pub(crate) fn surroundings(&mut self) -> Surroundings {
        let (left, right) = self.board.limit_switches(SERVO_AXIS);
        Surroundings {
            temperature: self.board.analog(Analog::Temperature),
            inputs: self.board.digital_inputs(),
            analog: self.board.analog(Analog::Input(0)),
            left,
            right,
            home: self.board.home_switch(SERVO_AXIS),
        }
    }

    /// When the servo axis next may have changed what somebody waits for.
    pub(crate) fn next_servo_tick(&self) -> Option<Instant> {
        if !self.has_servo() || self.servo.is_asleep {
            return None;
        }
        let tick = PERIOD_TICKS * PERIODS_PER_TICK;
        let ticks = self.servo.next.as_ticks().div_ceil(tick).saturating_mul(tick);
        Some(Instant::from_ticks(ticks))
    }

    /// When a host that serves the module should next let it catch up.
    pub(crate) fn next_catching_up(&self) -> Option<Instant> {
        (self.has_servo() && !self.servo.is_asleep).then(|| self.now + CATCH_UP)
    }

    /// What power-up does for a servo axis, after its settings have been restored.
    pub(crate) fn start_servo(&mut self) {
        if !self.has_servo() {
            return;
        }
        if self.model.motion == Motion::Block {
            let stored = self.globals[Globals::ModuleBehaviour];
            let reading = self.board.analog(Analog::Input(0));
            self.behave(Behaviour::at_start(stored, reading));
        }
        self.board.sense(SERVO_AXIS, &mut self.servo.senses);
        let around = self.surroundings();
        self.servo.step_status(&around);
    }

    /// The reading of the converter behind the single shunt.
    pub(crate) fn shunt_reading(&self) -> i32 {
        i32::from(self.servo.senses.currents[0])
    }
}

/// The first moment of the grid of control periods after a time.
pub(super) const fn grid_after(now: Instant) -> Instant {
    let periods = now.as_ticks() / PERIOD_TICKS;
    Instant::from_ticks(periods.saturating_add(1).saturating_mul(PERIOD_TICKS))
}
