//! Parameters that have other values during a run, and their values before.

use opentmcl_catalog::{AxisParameter, Module};
use opentmcl_lang::suggest;

use super::line::Line;
use super::regulator::named;
use crate::failure::Failure;

/// A parameter by its name or number, and a value: `current_p=300`.
pub(super) fn parse(text: &str) -> Result<(String, i32), String> {
    let expected = || "write a parameter and its value: max_current=2000 or 6=2000".to_owned();
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    let value = value.trim().parse().map_err(|_| expected())?;
    match name.trim() {
        "" => Err(expected()),
        name => Ok((name.to_owned(), value)),
    }
}

/// The parameter that somebody named.
///
/// # Errors
/// When there is none of this name, or it cannot be set and read back.
pub(super) fn named_parameter(
    module: &'static Module,
    name: &str,
) -> Result<&'static AxisParameter, Failure> {
    let known = || module.axis_parameters.iter().filter(|row| module.has(row.since));
    let number = name.parse::<u8>().ok();
    let is_meant =
        |row: &&AxisParameter| Some(row.number) == number || row.id.eq_ignore_ascii_case(name);
    let row = known().find(is_meant).ok_or_else(|| {
        let failure = Failure::usage(format!("a {} has no parameter {name:?}", module.title));
        let list = format!("`tmcl modules {}` lists all", module.name);
        match suggest::nearest(name, known().map(|row| row.id)) {
            Some(near) => failure.help(format!("did you mean {near}? {list}")),
            None => failure.help(list),
        }
    })?;
    match row.access {
        access if access.read && access.write => Ok(row),
        _ => Err(Failure::usage(format!("{} cannot be set and restored", named(row)))
            .help("name one that can be read and written")),
    }
}

/// Fails if a value is out of the parameter's range.
pub(super) fn must_be_in_range(row: &AxisParameter, value: i32) -> Result<(), Failure> {
    if (row.min..=row.max).contains(&value) {
        return Ok(());
    }
    Err(Failure::usage(format!("{} cannot be {value}", named(row)))
        .help(format!("write {} to {}", row.min, row.max)))
}

/// Values of before a run, the latest change last.
#[derive(Default)]
pub(super) struct Changed {
    before: Vec<(&'static AxisParameter, i32)>,
}

impl Changed {
    /// Sets a parameter for the run. One that is to be kept keeps its value afterwards.
    pub(super) fn set(
        &mut self,
        line: &mut Line,
        row: &'static AxisParameter,
        value: i32,
        is_kept: bool,
    ) -> Result<(), Failure> {
        let before = line.read(row)?;
        if before == value {
            return Ok(());
        }
        if !is_kept {
            self.before.push((row, before));
        }
        line.write(row, value)
    }

    /// Gives all parameters the values of before, in reverse order.
    ///
    /// # Errors
    /// The first failure; the other parameters are tried all the same.
    pub(super) fn restore(self, line: &mut Line) -> Result<(), Failure> {
        let mut result = Ok(());
        for (row, value) in self.before.into_iter().rev() {
            result = result.and(line.write(row, value));
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_set_by_name_or_number() {
        assert_eq!(parse("max_current=2000"), Ok(("max_current".to_owned(), 2000)));
        assert_eq!(parse("6 = -1"), Ok(("6".to_owned(), -1)));
        for text in ["", "6", "=6", "6=", "6=x", "6=99999999999"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
