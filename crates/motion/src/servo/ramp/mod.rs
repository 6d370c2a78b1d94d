//! Ramps of speed and of position, in steps of equal time.
//!
//! Both are exact: what is less than a unit is carried on to the next step.

mod position;
mod speed;

pub use position::PositionRamp;
pub use speed::SpeedRamp;

/// Speeds outside are given in 1/256 revolution per minute.
const SPEED_PARTS: i64 = 256;

/// The integer square root, the quick way if 64 bits are enough.
fn root(value: u128) -> u64 {
    match u64::try_from(value) {
        Ok(value) => value.isqrt(),
        // Half the bits of the value.
        Err(_) => value.isqrt() as u64,
    }
}

/// The speed in 1/256 revolution per minute from which an axis stops within `distance` counts if it brakes with
/// this many revolutions per minute and second: the root of 120 * acceleration * distance / counts per turn.
///
/// It is rounded down and saturates; 0 counts per turn act as 1.
pub fn braking_speed(distance: u64, acceleration: u32, counts_per_turn: u32) -> u32 {
    const FACTOR: u64 = 120 * (SPEED_PARTS * SPEED_PARTS) as u64;
    let per_turn = counts_per_turn.max(1);
    let quick = u64::from(acceleration).checked_mul(FACTOR).and_then(|f| f.checked_mul(distance));
    let square = match quick {
        Some(product) => u128::from(product / u64::from(per_turn)),
        None => {
            let product = u128::from(acceleration) * u128::from(FACTOR);
            product * u128::from(distance) / u128::from(per_turn)
        }
    };
    u32::try_from(root(square)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn the_braking_speed_is_the_root_of_the_way() {
        // 2000 rpm/s, 5 turns: sqrt(120 * 2000 * 5) = 1095.445 rpm.
        assert_eq!(braking_speed(5 * 4_096, 2_000, 4_096), 280_433);
        assert_eq!(braking_speed(0, 2_000, 4_096), 0);
        assert_eq!(braking_speed(5, 0, 0), 0);
        assert_eq!(braking_speed(u64::MAX, u32::MAX, 0), u32::MAX);
        let mut random = Random::new(0xb4a6e);
        for _ in 0..50_000 {
            let distance = u64::from(random.unsigned()) << random.below(33);
            let (acceleration, counts) = (random.unsigned(), random.unsigned());
            let turns = distance as f64 / f64::from(counts.max(1));
            let exact = (120.0 * f64::from(acceleration) * turns).sqrt() * 256.0;
            let given = f64::from(braking_speed(distance, acceleration, counts));
            let exact = exact.min(f64::from(u32::MAX));
            assert!(given <= exact + 1e-3 && given >= exact - 1.01, "{given} {exact}");
        }
    }
}
