//! Block commutation: two legs carry the current, the third one is open.

use super::Leg;

/// What a leg does in a sector while the voltage is positive.
#[derive(Clone, Copy)]
enum Part {
    High,
    Low,
    Open,
}

/// The current vector lies 90° before the centre of each sector.
const PARTS: [[Part; 3]; 6] = {
    use Part::{High, Low, Open};
    [
        [Open, High, Low],
        [Low, High, Open],
        [Low, Open, High],
        [Open, Low, High],
        [High, Low, Open],
        [High, Open, Low],
    ]
};

/// The legs for a hall sector and a voltage between two phases in 1/32767 of the supply, -32767..=32767 and
/// clipped to this. A positive one gives torque to the right, a negative one drives the same phases the other
/// way round. Sectors repeat with each turn.
///
/// One leg gets the duty, at least 1 so that a single shunt always has a leg to look at; the other one is at
/// ground.
#[inline]
pub fn commutate(sector: u8, voltage: i32) -> [Leg; 3] {
    // At most 65534.
    let duty = (voltage.unsigned_abs().min(32_767) * 2).max(1) as u16;
    let (high, low) =
        if voltage < 0 { (Leg::Duty(0), Leg::Duty(duty)) } else { (Leg::Duty(duty), Leg::Duty(0)) };
    PARTS[usize::from(sector % 6)].map(|part| match part {
        Part::High => high,
        Part::Low => low,
        Part::Open => Leg::Open,
    })
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;
    use std::f64::consts::TAU;

    /// Angle in degrees of the current that flows in at the leg with a duty and out at the one at ground.
    fn direction(legs: [Leg; 3]) -> f64 {
        let (mut x, mut y) = (0.0, 0.0);
        for (phase, leg) in legs.into_iter().enumerate() {
            let current = match leg {
                Leg::Open => 0.0,
                Leg::Duty(0) => -1.0,
                Leg::Duty(_) => 1.0,
            };
            let (sin, cos) = (phase as f64 * TAU / 3.0).sin_cos();
            x += current * cos;
            y += current * sin;
        }
        y.atan2(x).to_degrees()
    }

    #[test]
    fn the_current_is_a_right_angle_before_the_sector() {
        for sector in 0..6 {
            for (voltage, ahead) in [(100, 90.0), (-100, -90.0)] {
                let off = direction(commutate(sector, voltage)) - f64::from(sector) * 60.0 - ahead;
                let off = (off + 720.0 + 180.0) % 360.0 - 180.0;
                assert!(off.abs() < 1e-9, "sector {sector}: {off} off");
            }
        }
    }

    #[test]
    fn the_duty_is_the_voltage_and_never_nothing() {
        use Leg::{Duty, Open};
        assert_eq!(commutate(0, 1_000), [Open, Duty(2_000), Duty(0)]);
        assert_eq!(commutate(0, -1_000), [Open, Duty(0), Duty(2_000)]);
        assert_eq!(commutate(4, 32_767), [Duty(65_534), Duty(0), Open]);
        assert_eq!(commutate(4, 0), [Duty(1), Duty(0), Open]);
        assert_eq!(commutate(4, i32::MAX), [Duty(65_534), Duty(0), Open]);
        assert_eq!(commutate(4, i32::MIN), [Duty(0), Duty(65_534), Open]);
    }

    #[test]
    fn there_are_always_one_open_leg_one_at_ground_and_one_with_a_duty() {
        let mut random = Random::new(0xb10c);
        for _ in 0..20_000 {
            let legs = commutate(random.next() as u8, random.signed());
            let count = |wanted: fn(&Leg) -> bool| legs.iter().filter(|leg| wanted(leg)).count();
            assert_eq!(count(|leg| *leg == Leg::Open), 1);
            assert_eq!(count(|leg| *leg == Leg::Duty(0)), 1);
        }
    }
}
