//! Names of a program in place of numbers.

use std::ops::RangeInclusive;

use opentmcl_catalog::{Module, PortBehaviour};

use super::number::value;
use crate::programs::Assembled;

/// From how similar a name on it is worth proposing, on a scale of 0 to 1.
const SIMILAR: f64 = 0.8;

/// How many names are looked at, and how long a name may be; nobody misses a proposal beyond.
const MAX_NAMES: usize = 4096;
const MAX_LEN: usize = 64;

/// What names and numbers of a line may mean.
#[derive(Clone, Copy)]
pub(super) struct Names<'a> {
    /// The program whose constants and labels are known.
    pub(super) program: Option<&'a Assembled>,
    /// The module, unless the file names none.
    pub(super) module: Option<&'static Module>,
}

impl Names<'_> {
    /// A number or a constant, which may have a sign.
    pub(super) fn value(&self, text: &str) -> Result<i32, String> {
        let (name, negative) = match text.strip_prefix('-') {
            Some(name) => (name, true),
            None => (text, false),
        };
        if !is_name(name) {
            return value(text);
        }
        let program = self.program_for(name)?;
        let Some(value) = program.constant(name) else {
            let is_label = program.label(name).is_some();
            let hint = if is_label { "; it is a label" } else { "" };
            let near = nearest(name, program.constants.iter().map(|(name, _)| name.as_str()));
            return Err(format!("the program has no constant {name}{hint}{near}"));
        };
        if negative {
            value.checked_neg().ok_or_else(|| format!("{text} is more than a value can be"))
        } else {
            Ok(value)
        }
    }

    /// One value or a range of them.
    pub(super) fn range(&self, text: &str) -> Result<RangeInclusive<i32>, String> {
        let Some((low, high)) = text.split_once("..") else {
            let value = self.value(text)?;
            return Ok(value..=value);
        };
        let (low, high) = (self.value(low.trim())?, self.value(high.trim())?);
        if low > high {
            return Err(format!("the range {text} is empty; write the smaller number first"));
        }
        Ok(low..=high)
    }

    /// A number or constant that is not larger than a field of 8 or 16 bits.
    pub(super) fn small<T: TryFrom<i32>>(&self, text: &str) -> Result<T, String> {
        let value = self.value(text)?;
        value.try_into().map_err(|_| {
            let most = if size_of::<T>() == 1 { 255 } else { 65535 };
            let is = if is_name(text) { format!("{text} is {value}, which") } else { text.into() };
            format!("{is} is not a number from 0 to {most}")
        })
    }

    /// The number of an axis that the module has.
    pub(super) fn axis(&self, text: &str) -> Result<u8, String> {
        let axis = self.small(text)?;
        match self.module {
            Some(module) if axis >= module.axes => {
                let (title, last) = (module.title, module.axes.saturating_sub(1));
                Err(format!("there is no axis {axis}; {title} has axes 0 to {last}"))
            }
            _ => Ok(axis),
        }
    }

    /// The number of a port that GIO can read.
    pub(super) fn port(&self, bank: u8, what: &str, text: &str) -> Result<u8, String> {
        let number = self.small(text)?;
        match self.module {
            Some(module) if module.input_port(bank, number).is_none() => {
                Err(no_port(module, what, number))
            }
            _ => Ok(number),
        }
    }

    /// The number of an input that can be set from outside.
    pub(super) fn pin(
        &self,
        behaviour: PortBehaviour,
        what: &str,
        text: &str,
    ) -> Result<u8, String> {
        let number = self.small(text)?;
        match self.module {
            Some(module) if module.port(behaviour, number).is_none() => {
                Err(no_port(module, what, number))
            }
            _ => Ok(number),
        }
    }

    /// An address or a label.
    pub(super) fn address(&self, text: &str) -> Result<i32, String> {
        if !is_name(text) {
            return Ok(i32::from(self.small::<u16>(text)?));
        }
        let program = self.program_for(text)?;
        program.label(text).map(i32::from).ok_or_else(|| {
            let near = nearest(text, program.labels.iter().map(|(name, _)| name.as_str()));
            format!("the program has no label {text}{near}")
        })
    }

    fn program_for(&self, name: &str) -> Result<&Assembled, String> {
        self.program.ok_or_else(|| {
            format!(
                "{name} is not a number, and no program is loaded from a file that could name it"
            )
        })
    }
}

fn no_port(module: &Module, what: &str, number: u8) -> String {
    let Module { title, name, .. } = module;
    format!("{title} has no {what} {number}; `tmcl modules {name}` lists those that there are")
}

/// Whether this can be a name of a program; a number cannot.
pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
}

/// The nearest of these names as a question behind a message; nothing if none is near.
pub(super) fn nearest<'a>(wanted: &str, names: impl Iterator<Item = &'a str>) -> String {
    if wanted.len() > MAX_LEN {
        return String::new();
    }
    let wanted = wanted.to_ascii_lowercase();
    names
        .take(MAX_NAMES)
        .filter(|name| name.len() <= MAX_LEN)
        .map(|name| (strsim::jaro_winkler(&wanted, &name.to_ascii_lowercase()), name))
        .filter(|&(similarity, _)| similarity >= SIMILAR)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| format!("; did you mean {name}?"))
        .unwrap_or_default()
}
