//! What happens in each control period: currents in, duties out.

use opentmcl_catalog::{Block, Foc, Motion, Servo as Shared};
use opentmcl_motion::servo::pi::Gains;
use opentmcl_motion::servo::transform::{Dq, clarke, space_vector};
use opentmcl_motion::servo::{Leg, Power, block};

use super::init::Forced;
use super::sensors::Source;
use super::{BLOCK_UNIT_MA, FOC_UNIT_MA, FULL_VOLTAGE, Mode, PERIODS_PER_TICK, Servo};

/// Current in mA of one count of the converter behind the single shunt.
const SINGLE_SHUNT_MA: i32 = 20;

/// Duties of the legs in 1/65535, or [`OPEN`]: numbers, and not [`Leg`]s, so that they stay in registers until the
/// bridge has them, which is what the next period waits for.
type Duties = [i32; 3];

/// A leg of which both switches are open.
const OPEN: i32 = -1;

/// Control periods between two runs of the speed regulator of a TMCM-1636: 2 kHz.
const FOC_VELOCITY_PERIODS: u64 = 10;

/// What flows, on average over the last millisecond and its sum so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Measured {
    sum: Dq,
    /// Mean of the millisecond that has ended last: flux and torque, in mA.
    pub(super) mean: Dq,
}

impl Measured {
    #[inline]
    fn add(&mut self, current: Dq) {
        self.sum.d = self.sum.d.saturating_add(current.d);
        self.sum.q = self.sum.q.saturating_add(current.q);
    }

    /// A millisecond has ended.
    pub(super) fn close(&mut self, milliamps: i32) {
        let mean = |sum: i32| sum.saturating_mul(milliamps) / PERIODS_PER_TICK as i32;
        self.mean = Dq { d: mean(self.sum.d), q: mean(self.sum.q) };
        self.sum = Dq::default();
    }
}

impl Servo {
    /// One control period: from senses to power. `number` counts them since power-up.
    // In one piece with its caller, so that the legs go on in registers: they are what the next period waits for.
    #[inline(always)]
    pub(super) fn period(&mut self, number: u64) -> Power {
        let has_jumped = self.sensors.step(&self.senses, &self.reading);
        if has_jumped && self.uses_halls() {
            self.latch_hall_error();
        }
        if self.senses.index_passed {
            self.pass_null();
        }
        if self.senses.driver_fault {
            self.latch_driver_fault();
        }
        let duties = match self.motion {
            Motion::Block => self.block_period(number),
            _ => self.foc_period(number),
        };
        let leg = |duty: i32| if duty < 0 { Leg::Open } else { Leg::Duty(duty as u16) };
        let [a, b, c] = duties;
        Power { legs: [leg(a), leg(b), leg(c)], chopper: self.chops(), brake: self.brake.duty }
    }

    pub(super) fn torque_gains(&self) -> Gains {
        Gains { p: self.settings[Shared::TorqueP], i: self.settings[Shared::TorqueI] }
    }

    #[inline(always)]
    fn block_period(&mut self, number: u64) -> Duties {
        let raw = i32::from(self.senses.currents[0]) - self.settings[Block::ShuntOffset];
        // The shunt sees the current of the leg that is high, whichever way the torque goes.
        let current = if self.voltage < 0 { -raw } else { raw };
        let flows = self.is_driven();
        let current = current * SINGLE_SHUNT_MA;
        self.phase_currents = [if flows { current } else { 0 }, 0];
        self.measured.add(Dq { d: 0, q: self.phase_currents[0] });
        self.measure_shunt(raw);
        if is_turn_of(number, self.settings[Block::VelocityLoopDelay]) {
            self.regulate_speed(1, BLOCK_UNIT_MA);
        }
        let (true, Some(sector)) = (flows, self.sensors.sector) else {
            return self.rest();
        };
        if is_turn_of(number, self.settings[Block::CurrentLoopDelay]) {
            let gains = self.torque_gains();
            self.voltage = self.torque.step(gains, self.demand.q, current, FULL_VOLTAGE);
        }
        let duty = |leg: Leg| match leg {
            Leg::Open => OPEN,
            Leg::Duty(duty) => i32::from(duty),
        };
        block::commutate(sector, self.voltage).map(duty)
    }

    #[inline(always)]
    fn foc_period(&mut self, number: u64) -> Duties {
        let mut currents = [
            i32::from(self.senses.currents[0]) - self.settings[Foc::AdcOffsetA],
            i32::from(self.senses.currents[1]) - self.settings[Foc::AdcOffsetB],
        ];
        if self.reading.mirrored {
            currents[1] = -(currents[0] + currents[1]);
        }
        self.phase_currents = currents;
        if number.is_multiple_of(FOC_VELOCITY_PERIODS) {
            self.regulate_speed(self.reading.pole_pairs, FOC_UNIT_MA);
        }
        if self.settings[Foc::MotorType] == super::BRUSHED {
            return self.brushed_period(currents[0]);
        }
        self.turn_open_loop();
        let (angle, demand) = match self.init.forced() {
            Some(Forced::Angle(angle)) => (angle, Dq { d: self.open_loop_current(), q: 0 }),
            Some(Forced::OpenLoop) => {
                (self.angle_of(Source::OpenLoop), Dq { d: self.open_loop_current(), q: 0 })
            }
            None => (self.commutation_angle(), self.demand),
        };
        let actual = clarke(currents[0], currents[1]).park(angle);
        self.measured.add(actual);
        if !self.is_driven() || self.is_lost() {
            return self.rest();
        }
        let gains = self.torque_gains();
        let d = self.flux.step(gains, demand.d, actual.d, FULL_VOLTAGE);
        let q = self.torque.step(gains, demand.q, actual.q, FULL_VOLTAGE);
        let voltage = Dq { d, q }.limited(FULL_VOLTAGE);
        self.voltage = voltage.q;
        let [a, mut b, mut c] = space_vector(voltage.unpark(angle));
        if self.reading.mirrored {
            core::mem::swap(&mut b, &mut c);
        }
        [a, b, c].map(i32::from)
    }

    /// A brushed motor between the legs A and B.
    fn brushed_period(&mut self, current: i32) -> Duties {
        let (current, sign) = if self.reading.mirrored { (-current, -1) } else { (current, 1) };
        self.measured.add(Dq { d: 0, q: current });
        if !self.is_driven() {
            return self.rest();
        }
        let gains = self.torque_gains();
        self.voltage = self.torque.step(gains, self.demand.q, current, FULL_VOLTAGE);
        let half = sign * self.voltage;
        let duty = |part: i32| (FULL_VOLTAGE + part).clamp(0, 65_535);
        [duty(half), duty(-half), OPEN]
    }

    /// Whether the halls that commutate tell no angle.
    fn is_lost(&self) -> bool {
        self.sensors.sector.is_none() && self.uses_halls() && self.init.forced().is_none()
    }

    /// The bridge is off, and regulators without a bridge know nothing.
    fn rest(&mut self) -> Duties {
        self.voltage = 0;
        self.torque.reset();
        self.flux.reset();
        [OPEN; 3]
    }

    /// Whether the bridge is on.
    pub(super) fn is_driven(&self) -> bool {
        let wanted = self.mode != Mode::Stop || self.init.forced().is_some();
        wanted && self.is_enabled()
    }
}

/// Whether a loop with this delay in control periods, of which 0 acts as 1, runs in the period of this number.
#[inline]
fn is_turn_of(number: u64, delay: i32) -> bool {
    delay <= 1 || number.is_multiple_of(delay as u64)
}
