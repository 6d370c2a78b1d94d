//! Converters of currents and of the supply voltage.

use super::bridge::Terminal;
use super::step::Inputs;

/// How the module measures the currents of its bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensing {
    /// Shunts in legs A and B.
    TwoShunt(TwoShunt),
    /// One shunt for all legs.
    SingleShunt(SingleShunt),
}

/// Two shunts with 16-bit converters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoShunt {
    /// Readings without current.
    pub offset: [u16; 2],
    /// Errors of the amplifiers: 1 is none.
    pub gain: [f64; 2],
    /// Current per count in mA.
    pub milliamps_per_count: f64,
    /// Noise.
    pub noise: Noise,
}

/// One shunt with a 12-bit converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleShunt {
    /// Reading without current.
    pub offset: u16,
    /// Error of the amplifier: 1 is none.
    pub gain: f64,
    /// Current per count in mA.
    pub milliamps_per_count: f64,
    /// Noise.
    pub noise: Noise,
}

/// Noise of a converter. The same in each run: it follows from the seed and the number of the control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Standard deviation in counts.
    pub counts: f64,
    /// Which noise of all.
    pub seed: u64,
}

impl Default for TwoShunt {
    fn default() -> Self {
        Self {
            offset: [33050, 32900],
            gain: [1.0; 2],
            milliamps_per_count: 3.0,
            noise: Noise::default(),
        }
    }
}

impl Default for SingleShunt {
    fn default() -> Self {
        Self { offset: 2048, gain: 1.0, milliamps_per_count: 20.0, noise: Noise::default() }
    }
}

impl Sensing {
    /// Readings with these currents of the legs in ampere, in the period of this number.
    pub(super) fn read(&self, currents: [f64; 3], inputs: &Inputs, period: u64) -> [u16; 2] {
        match self {
            Self::TwoShunt(shunts) => [0, 1].map(|shunt| {
                let counts =
                    currents[shunt] * shunts.gain[shunt] * 1000.0 / shunts.milliamps_per_count;
                let noise = shunts.noise.at(2 * period + shunt as u64);
                count(f64::from(shunts.offset[shunt]) + counts + noise, u16::MAX)
            }),
            Self::SingleShunt(shunt) => {
                let counts =
                    measured(currents, inputs) * shunt.gain * 1000.0 / shunt.milliamps_per_count;
                let noise = shunt.noise.at(period);
                [count(f64::from(shunt.offset) + counts + noise, 4095), 0]
            }
        }
    }

    /// Whether readings differ while nothing else does.
    pub(super) fn is_noisy(&self) -> bool {
        let (Self::TwoShunt(TwoShunt { noise, .. }) | Self::SingleShunt(SingleShunt { noise, .. })) =
            self;
        noise.counts != 0.0
    }
}

/// Current of the first leg that has the largest duty of those that are on; none if all are open.
fn measured(currents: [f64; 3], inputs: &Inputs) -> f64 {
    let mut largest = (-1.0, 0.0);
    for (terminal, current) in inputs.legs.terminals.iter().zip(currents) {
        if let Terminal::Driven(duty) = *terminal
            && duty > largest.0
        {
            largest = (duty, current);
        }
    }
    largest.1
}

impl Noise {
    fn at(&self, number: u64) -> f64 {
        if self.counts == 0.0 {
            return 0.0;
        }
        let random = mix(self.seed ^ mix(number));
        // Four uniform numbers make nearly a normal one, with the variance 4/12.
        let sum: u64 = (0..4).map(|part| random >> (16 * part) & 0xFFFF).sum();
        (sum as f64 / 65535.0 - 2.0) * SQRT_3 * self.counts
    }
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Splitmix64 (Steele et al. 2014).
fn mix(number: u64) -> u64 {
    let z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}

/// The nearest number that a converter has.
pub(super) fn count(reading: f64, largest: u16) -> u16 {
    ((reading + 0.5) as u16).min(largest)
}

#[cfg(test)]
mod tests {
    use opentmcl_motion::servo::{Leg, Power};

    use super::super::bridge::{Legs, Wiring};
    use super::*;

    fn inputs(legs: [Leg; 3]) -> Inputs {
        let power = Power { legs, ..Power::default() };
        Inputs {
            legs: Legs::new(Wiring::Star, &power, false, [false; 3]),
            chopper: false,
            friction: 0.0,
            external: 0.0,
            blocked: false,
            source: 24.0,
        }
    }

    #[test]
    fn two_shunts_read_a_and_b_around_their_offsets_and_end_at_the_ends() {
        let sensing = Sensing::TwoShunt(TwoShunt::default());
        let inputs = inputs([Leg::Open; 3]);
        let read = |currents| sensing.read(currents, &inputs, 0);
        assert_eq!(read([0.0; 3]), [33050, 32900]);
        assert_eq!(read([3.0, -1.5, -1.5]), [34050, 32400]);
        assert_eq!(read([0.004, -0.004, 0.0]), [33051, 32899], "to the nearest");
        assert_eq!(read([200.0, -200.0, 0.0]), [65535, 0]);
    }

    #[test]
    fn a_single_shunt_reads_the_leg_with_the_larger_duty() {
        let sensing = Sensing::SingleShunt(SingleShunt::default());
        let read = |legs| sensing.read([1.0, -3.0, 2.0], &inputs(legs), 0)[0];
        assert_eq!(read([Leg::Duty(100), Leg::Duty(0), Leg::Open]), 2048 + 50);
        assert_eq!(read([Leg::Open, Leg::Duty(0), Leg::Duty(1)]), 2048 + 100);
        assert_eq!(read([Leg::Duty(7), Leg::Duty(7), Leg::Duty(7)]), 2048 + 50);
        assert_eq!(read([Leg::Open, Leg::Duty(0), Leg::Open]), 2048 - 150);
        assert_eq!(read([Leg::Open; 3]), 2048);
    }

    #[test]
    fn noise_has_its_deviation_and_comes_again_with_its_seed() {
        let noise = Noise { counts: 3.0, seed: 7 };
        let values: Vec<f64> = (0..20_000).map(|number| noise.at(number)).collect();
        let mean = values.iter().sum::<f64>() / 20_000.0;
        let square = values.iter().map(|value| value * value).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.1 && (square.sqrt() - 3.0).abs() < 0.1, "{mean} {square}");
        assert_eq!(noise.at(5), values[5]);
        assert_ne!(Noise { seed: 8, ..noise }.at(5), values[5]);
    }
}
