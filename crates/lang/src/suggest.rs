//! What was probably meant.

/// How many names are looked at; nobody misses a proposal in a program with more.
const MAX_NAMES: usize = 4096;

/// From how similar a name on it is worth proposing, on a scale of 0 to 1.
const SIMILAR: f64 = 0.8;

/// The name nearest to this one in any case, if one is near enough to propose it.
pub fn nearest<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if wanted.len() > 64 {
        return None;
    }
    let wanted = wanted.to_ascii_lowercase();
    names
        .into_iter()
        .take(MAX_NAMES)
        .filter(|name| name.len().abs_diff(wanted.len()) <= 4)
        .map(|name| (similarity(&wanted, &name.to_ascii_lowercase()), name))
        .filter(|&(similarity, _)| similarity >= SIMILAR)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| name)
}

/// One slip of the finger is always near: in a short name it changes much.
fn similarity(wanted: &str, name: &str) -> f64 {
    let similarity = strsim::jaro_winkler(wanted, name);
    let is_slip = wanted.len() > 1 && name.len() > 1 && strsim::osa_distance(wanted, name) == 1;
    if is_slip { 1.0 + similarity } else { similarity }
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn a_slip_is_recognized_and_something_else_is_not() {
        let names = ["MainLoop", "StopAll", "Home"];
        assert_eq!(nearest("mainlop", names), Some("MainLoop"));
        assert_eq!(nearest("StopAl", names), Some("StopAll"));
        assert_eq!(nearest("Grip", names), None);
        assert_eq!(nearest("GPP", ["GAP", "MVP", "GGP"]), Some("GGP"));
        assert_eq!(nearest("xJA", ["JC", "JA"]), Some("JA"));
        assert_eq!(nearest("X", ["Y"]), None);
        // A name of one letter is another one with any letter more or less.
        assert_eq!(nearest("X", ["YX"]), None);
        assert_eq!(nearest("YX", ["X"]), None);
    }

    #[test]
    fn the_nearest_of_several_is_proposed() {
        assert_eq!(nearest("Speed1", ["Speed12", "Speed22", "Speed333"]), Some("Speed12"));
        assert_eq!(
            nearest("MaxSpeed", ["MinSpeed", "MaxSpeeds", "MaxSpeedValue"]),
            Some("MaxSpeeds")
        );
        // Half of a long name has been forgotten, but not more than four letters.
        assert_eq!(nearest("Position", ["PositionLeft"]), Some("PositionLeft"));
        assert_eq!(nearest("Position", ["PositionRight"]), None);
    }

    #[test]
    fn a_name_longer_than_any_person_writes_is_not_compared() {
        let (name, longer) = ("x".repeat(64), "x".repeat(65));
        assert_eq!(nearest(&name, [longer.as_str()]), Some(longer.as_str()));
        assert_eq!(nearest(&longer, [name.as_str()]), None);
    }
}
