//! What each mode of the reference search looks for, as data (firmware manual 6.1).

/// The input that a search goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sensor {
    /// The left limit switch, after swapping and polarity.
    Left,
    /// The right limit switch, after swapping and polarity.
    Right,
    /// The home switch.
    Home,
    /// The home switch with its level inverted.
    InvertedHome,
    /// The null channel of the encoder.
    Index,
}

/// A direction of travel; right is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Direction {
    #[default]
    Negative,
    Positive,
}

impl Direction {
    pub(crate) const fn reversed(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Positive => Self::Negative,
        }
    }

    /// A speed in this direction.
    pub(crate) const fn velocity(self, speed: u32) -> i32 {
        match self {
            Self::Negative => 0i32.saturating_sub_unsigned(speed),
            Self::Positive => 0i32.saturating_add_unsigned(speed),
        }
    }
}

/// Finding one switch, or the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    /// What is looked for.
    pub(crate) sensor: Sensor,
    /// Where to.
    pub(crate) direction: Direction,
    /// Whether the reference is the middle of the switch, found from both sides, and not the edge at
    /// which the axis enters it.
    pub(crate) both_sides: bool,
    /// Whether the limit switch in this direction sends the axis the other way.
    pub(crate) reverses: bool,
}

impl Leg {
    const fn mirrored(self) -> Self {
        let sensor = match self.sensor {
            Sensor::Left => Sensor::Right,
            Sensor::Right => Sensor::Left,
            other => other,
        };
        Self { sensor, direction: self.direction.reversed(), ..self }
    }
}

/// The legs of a search; the last one gives the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    pub(crate) first: Leg,
    pub(crate) second: Option<Leg>,
}

/// Added to the modes 1..=4: left and right change places.
const MIRRORED: u8 = 64;
/// Added to the modes 5..=8: the home switch is inverted.
const INVERTED: u8 = 128;

impl Plan {
    /// The plan of a mode; one that does not exist searches as mode 1.
    pub(crate) const fn of_mode(mode: u8) -> Self {
        let base = mode & !(MIRRORED | INVERTED);
        let home = if mode & INVERTED != 0 { Sensor::InvertedHome } else { Sensor::Home };
        let left = Leg {
            sensor: Sensor::Left,
            direction: Direction::Negative,
            both_sides: false,
            reverses: false,
        };
        let left_middle = Leg { both_sides: true, ..left };
        let right = left.mirrored();
        let home = Leg { sensor: home, ..left_middle };
        let index = Leg { sensor: Sensor::Index, ..left };
        let (first, second) = match base {
            2 => (right, Some(left)),
            3 => (right, Some(left_middle)),
            4 => (left_middle, None),
            5 => (Leg { reverses: true, ..home }, None),
            6 => (Leg { reverses: true, ..home.mirrored() }, None),
            7 => (home, None),
            8 => (home.mirrored(), None),
            9 => (index.mirrored(), None),
            10 => (index, None),
            _ => (left, None),
        };
        if mode & MIRRORED == 0 {
            return Self { first, second };
        }
        let second = match second {
            Some(leg) => Some(leg.mirrored()),
            None => None,
        };
        Self { first: first.mirrored(), second }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_begins_as_chapter_6_1_says() {
        // Mode, what is looked for first, whether to the right.
        let begins = [
            (1, Sensor::Left, false),
            (2, Sensor::Right, true),
            (3, Sensor::Right, true),
            (4, Sensor::Left, false),
            (5, Sensor::Home, false),
            (6, Sensor::Home, true),
            (7, Sensor::Home, false),
            (8, Sensor::Home, true),
            (9, Sensor::Index, true),
            (10, Sensor::Index, false),
            (65, Sensor::Right, true),
            (66, Sensor::Left, false),
            (67, Sensor::Left, false),
            (68, Sensor::Right, true),
            (133, Sensor::InvertedHome, false),
            (134, Sensor::InvertedHome, true),
            (135, Sensor::InvertedHome, false),
            (136, Sensor::InvertedHome, true),
        ];
        for (mode, sensor, right) in begins {
            let leg = Plan::of_mode(mode).first;
            assert_eq!(
                (leg.sensor, leg.direction == Direction::Positive),
                (sensor, right),
                "{mode}"
            );
        }
    }

    #[test]
    fn the_modes_with_two_switches_end_at_the_other_one() {
        for (mode, sensor, both_sides) in
            [(2, Sensor::Left, false), (3, Sensor::Left, true), (66, Sensor::Right, false)]
        {
            let leg = Plan::of_mode(mode).second;
            assert_eq!(leg.map(|leg| (leg.sensor, leg.both_sides)), Some((sensor, both_sides)));
        }
        assert!([1, 4, 5, 8, 10, 65].iter().all(|&mode| Plan::of_mode(mode).second.is_none()));
    }
}
