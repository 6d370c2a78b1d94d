//! What was probably meant.

/// How many names are looked at; nobody misses a proposal in a program with more.
const MAX_NAMES: usize = 4096;

/// From how similar a name on it is worth proposing, on a scale of 0 to 1.
const SIMILAR: f64 = 0.8;

/// The name nearest to this one, if one is near enough.
pub(crate) fn nearest<'a>(
    wanted: &str,
    names: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    if wanted.len() > 64 {
        return None;
    }
    let wanted = wanted.to_ascii_lowercase();
    names
        .into_iter()
        .take(MAX_NAMES)
        .filter(|name| name.len().abs_diff(wanted.len()) <= 4)
        .map(|name| (strsim::jaro_winkler(&wanted, &name.to_ascii_lowercase()), name))
        .filter(|&(similarity, _)| similarity >= SIMILAR)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| name)
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
    }
}
