//! What was probably meant.

/// The name nearest to this one, if one is near enough to propose it.
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
        .map(|name| {
            let is_slip = wanted.len() > 1 && strsim::osa_distance(&wanted, name) == 1;
            let similarity = strsim::jaro_winkler(&wanted, name);
            (if is_slip { 1.0 + similarity } else { similarity }, name)
        })
        .filter(|&(similarity, _)| similarity >= 0.8)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| name)
}

/// `; did you mean "mass"?` or nothing.
pub(crate) fn did_you_mean<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(wanted, names).map_or_else(String::new, |name| format!("; did you mean {name:?}?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_recognized_and_something_else_is_not() {
        assert_eq!(nearest("lod", ["load", "left", "stage"]), Some("load"));
        assert_eq!(nearest("Bakclash", ["backlash", "stage"]), Some("backlash"));
        assert_eq!(nearest("piston", ["load", "left", "stage"]), None);
    }
}
