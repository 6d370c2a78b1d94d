//! Whatever is done to a machine, it goes on, and looking at it changes nothing.

use opentmcl_motion::Instant;
use opentmcl_motion::servo::{Leg, PERIOD_TICKS, Power};
use opentmcl_plant::machine::{Encoder, Load, Spring, Stage, Switch};
use opentmcl_plant::servo::motor::{Cogging, PRESETS};
use opentmcl_plant::servo::{
    Absolute, HoldingBrake, Influence, LineFault, Machine, Motor, Noise, Sensing, Servo,
    SingleShunt, TwoShunt,
};

use crate::bench::BRUSHED;

/// Numbers that look random and are the same each time (splitmix64, Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (self.next() >> 11) as f64 / (1u64 << 53) as f64 * (to - from)
    }

    fn decades(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.between(from, to))
    }

    fn machine(&mut self) -> Machine {
        let motor = if self.one_in(4) {
            Motor::Brushed(BRUSHED)
        } else {
            let mut motor = PRESETS[self.below(PRESETS.len() as u64) as usize].motor;
            motor.inertia = self.decades(-9.0, -3.0);
            motor.inductance = self.decades(-6.0, -2.0);
            motor.resistance = self.decades(-2.0, 1.0);
            motor.friction = if self.one_in(3) { 0.0 } else { self.decades(-4.0, -1.0) };
            if self.one_in(3) {
                motor.cogging = Cogging { torque: self.decades(-4.0, -1.0), per_turn: 24 };
            }
            Motor::Brushless(motor)
        };
        let mut machine = Machine::new(motor);
        machine.supply.capacitance = self.decades(-6.0, -1.0);
        machine.supply.resistance = self.decades(-3.0, 1.0);
        machine.load = Load {
            inertia: if self.one_in(2) { 0.0 } else { self.decades(-6.0, -2.0) },
            constant: if self.one_in(2) { 0.0 } else { self.between(-0.1, 0.1) },
            ..Load::default()
        };
        if self.one_in(3) {
            machine.load.springs = vec![Spring { rate: self.decades(-8.0, 0.0), rest: 100.0 }];
        }
        if self.one_in(3) {
            machine.load.along = vec![(-1000.0, 0.01), (5000.0, self.between(-0.1, 0.1))];
        }
        let highest = self.one_in(2).then(|| self.between(0.0, 1e6));
        machine.stage = Stage { highest, backlash: self.between(0.0, 300.0), ..Stage::default() };
        let end = self.between(0.0, 1e5);
        machine.switches.home = Some(Switch {
            from: 0.0,
            to: end,
            hysteresis: 10.0,
            bounce: self.below(100_000),
            normally_closed: false,
        });
        machine.encoder = Some(Encoder {
            counts: 4096.0,
            index: self.between(0.0, 65536.0),
            reversed: self.one_in(2),
            on_stage: self.one_in(2),
        });
        machine.absolute =
            Some(Absolute { offset: self.between(0.0, 65536.0), reversed: self.one_in(2) });
        if self.one_in(3) {
            machine.brake = Some(HoldingBrake { torque: 0.4, release_duty: 100 });
        }
        machine
    }

    fn servo(&mut self) -> Servo {
        let noise = Noise { counts: 2.0, seed: self.next() };
        let sensing = if self.one_in(2) {
            Sensing::TwoShunt(TwoShunt { noise, ..TwoShunt::default() })
        } else {
            Sensing::SingleShunt(SingleShunt { noise, ..SingleShunt::default() })
        };
        Servo::new(self.machine(), sensing)
    }

    fn power(&mut self) -> Power {
        let mut leg = || match self.below(4) {
            0 => Leg::Open,
            1 => Leg::Duty(0),
            2 => Leg::Duty(65535),
            _ => Leg::Duty(self.next() as u16),
        };
        let legs = [leg(), leg(), leg()];
        Power { legs, chopper: self.one_in(2), brake: self.next() as u8 }
    }

    fn influence(&mut self) -> Influence {
        match self.below(11) {
            0 => Influence::SourceVoltage(self.between(-5.0, 60.0)),
            1 => Influence::Ambient(self.between(-40.0, 60.0)),
            2 => Influence::DriverTemperature(self.between(-40.0, 150.0)),
            3 => Influence::WindingTemperature(self.between(-40.0, 150.0)),
            4 => {
                Influence::Torque(self.decades(-3.0, 4.0) * if self.one_in(2) { 1.0 } else { -1.0 })
            }
            5 => Influence::Torque(f64::NAN),
            6 => Influence::Blocked(self.one_in(2)),
            7 => Influence::Position(self.between(-1e6, 1e6)),
            8 => Influence::HallLine(
                self.below(4) as u8,
                [LineFault::None, LineFault::StuckLow, LineFault::StuckHigh]
                    [self.below(3) as usize],
            ),
            9 => Influence::DriverFault(self.one_in(3)),
            _ => Influence::PhaseOpen(self.below(4) as u8, self.one_in(3)),
        }
    }
}

#[track_caller]
fn assert_finite(servo: &Servo, now: Instant, seed: u64) {
    let view = servo.view(now);
    let [a, b, c] = view.currents;
    let numbers = [
        view.rotor,
        view.stage,
        view.speed,
        a,
        b,
        c,
        view.torque,
        view.bus,
        view.bus_current,
        view.source_current,
        view.winding_temperature,
        view.driver_temperature,
    ];
    assert!(numbers.iter().all(|number| number.is_finite()), "seed {seed}: {view:?}");
    assert!(view.bus >= 0.0 && view.bus < 1e6, "seed {seed}: {view:?}");
}

#[test]
fn numbers_stay_numbers_whatever_is_done() {
    for seed in 0..400 {
        let mut random = Random(seed);
        let mut servo = random.servo();
        let mut ticks = 0;
        for _ in 0..300 {
            ticks += if random.one_in(5) { random.below(3 * PERIOD_TICKS) } else { PERIOD_TICKS };
            let now = Instant::from_ticks(ticks);
            let _ = servo.sense(now);
            if random.one_in(3) {
                servo.drive(&random.power(), now);
            }
            if random.one_in(20) {
                servo.influence(random.influence(), now);
            }
            assert_finite(&servo, now, seed);
        }
    }
}

#[test]
fn looking_at_a_machine_changes_nothing() {
    for seed in 0..50 {
        let mut random = Random(1000 + seed);
        let mut servo = random.servo();
        let mut watched = servo.clone();
        for period in 1..400 {
            let now = Instant::from_ticks(period * PERIOD_TICKS);
            for _ in 0..random.below(4) {
                let within = Instant::from_ticks((period - 1) * PERIOD_TICKS + random.below(801));
                let _ = (watched.view(within), watched.switches(within), watched.is_still());
                let _ = watched.temperatures(within);
            }
            assert_eq!(servo.sense(now), watched.sense(now), "seed {seed}");
            if random.one_in(3) {
                let power = random.power();
                servo.drive(&power, now);
                watched.drive(&power, now);
            }
            if random.one_in(20) {
                let influence = random.influence();
                servo.influence(influence, now);
                watched.influence(influence, now);
            }
            assert_eq!(servo.view(now), watched.view(now), "seed {seed}");
        }
    }
}
