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
