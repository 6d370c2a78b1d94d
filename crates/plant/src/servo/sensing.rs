//! Converters of currents and of the supply voltage.

use opentmcl_motion::servo::Leg;

use super::bridge::Legs;

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

/// Converters, with what follows from their data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Converters {
    /// Whether there is one shunt for all legs.
    single: bool,
    offset: [f64; 2],
    counts_per_ampere: [f64; 2],
    largest: f64,
    noise: Noise,
}

impl Converters {
    pub(super) fn new(sensing: Sensing) -> Self {
        match sensing {
            Sensing::TwoShunt(shunts) => Self {
                single: false,
                offset: shunts.offset.map(f64::from),
                counts_per_ampere: shunts.gain.map(|gain| gain * 1e3 / shunts.milliamps_per_count),
                largest: 65535.0,
                noise: shunts.noise,
            },
            Sensing::SingleShunt(shunt) => Self {
                single: true,
                offset: [f64::from(shunt.offset), 0.0],
                counts_per_ampere: [shunt.gain * 1e3 / shunt.milliamps_per_count, 0.0],
                largest: 4095.0,
                noise: shunt.noise,
            },
        }
    }

    /// Readings with these currents of the legs in ampere, in the period of this number.
    #[inline(always)]
    pub(super) fn read(&self, currents: [f64; 3], legs: &Legs, period: u64) -> [u16; 2] {
        let noise = |number: u64| if self.is_noisy() { self.noise.at(number) } else { 0.0 };
        let read = |shunt: usize, current: f64, noise: f64| {
            let reading = self.offset[shunt] + current * self.counts_per_ampere[shunt] + noise;
            count(reading.min(self.largest))
        };
        if self.single {
            return [read(0, measured(currents, legs), noise(period)), 0];
        }
        [read(0, currents[0], noise(2 * period)), read(1, currents[1], noise(2 * period + 1))]
    }

    /// Whether readings differ while nothing else does.
    pub(super) fn is_noisy(&self) -> bool {
        self.noise.counts != 0.0
    }
}

/// Current of the first leg that has the largest duty of those that are on; none if all are open.
fn measured(currents: [f64; 3], legs: &Legs) -> f64 {
    let mut largest = (-1, 0.0);
    if legs.fault {
        return 0.0;
    }
    for (leg, current) in legs.told.iter().zip(currents) {
        if let Leg::Duty(duty) = *leg
            && i32::from(duty) > largest.0
        {
            largest = (i32::from(duty), current);
        }
    }
    largest.1
}

impl Noise {
    fn at(&self, number: u64) -> f64 {
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

/// The nearest number of 0..=65535.
pub(super) fn count(reading: f64) -> u16 {
    (reading + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::super::bridge::Wiring;
    use super::*;

    fn legs(legs: [Leg; 3]) -> Legs {
        let mut driven = Legs::new();
        driven.drive(Wiring::Star, &legs);
        driven
    }

    #[test]
    fn two_shunts_read_a_and_b_around_their_offsets_and_end_at_the_ends() {
        let converters = Converters::new(Sensing::TwoShunt(TwoShunt::default()));
        let open = legs([Leg::Open; 3]);
        let read = |currents| converters.read(currents, &open, 0);
        assert_eq!(read([0.0; 3]), [33050, 32900]);
        assert_eq!(read([3.0, -1.5, -1.5]), [34050, 32400]);
        assert_eq!(read([0.004, -0.004, 0.0]), [33051, 32899], "to the nearest");
        assert_eq!(read([200.0, -200.0, 0.0]), [65535, 0]);
    }

    #[test]
    fn a_single_shunt_reads_the_leg_with_the_larger_duty() {
        let converters = Converters::new(Sensing::SingleShunt(SingleShunt::default()));
        let read = |driven| converters.read([1.0, -3.0, 2.0], &legs(driven), 0)[0];
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
