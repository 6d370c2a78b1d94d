//! Tables of a TOML text, read with places, so that each mistake is told where it is.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Mistake;
use crate::quantity::{self, Quantity};
use crate::suggest::did_you_mean;

/// A value and its place.
pub(super) type Value<'a> = Spanned<DeValue<'a>>;

/// A text under way, and what has been found wrong with it.
pub(super) struct Reader<'a> {
    name: &'a str,
    text: &'a str,
    mistakes: Vec<Mistake>,
}

/// A table whose keys are known.
#[derive(Clone)]
pub(super) struct Table<'a> {
    table: &'a DeTable<'a>,
    /// Where it stands.
    pub(super) span: Range<usize>,
    /// What it describes: `an axis`.
    what: &'static str,
}

impl<'a> Reader<'a> {
    pub(super) fn new(name: &'a str, text: &'a str) -> Self {
        Self { name, text, mistakes: Vec::new() }
    }

    /// All mistakes in the order of the text.
    pub(super) fn mistakes(mut self) -> Vec<Mistake> {
        self.mistakes.sort_by_key(|mistake| (mistake.line, mistake.column));
        self.mistakes
    }

    /// The line where something begins, counted from 1.
    pub(super) fn line(&self, span: &Range<usize>) -> usize {
        self.text.get(..span.start).unwrap_or(self.text).matches('\n').count() + 1
    }

    pub(super) fn mistake(&mut self, span: Range<usize>, message: impl Into<String>) {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let column = before.get(line_start..).map_or(0, |line| line.chars().count()) + 1;
        self.mistakes.push(Mistake {
            file: self.name.to_owned(),
            line: self.line(&span),
            column,
            message: message.into(),
        });
    }

    /// The table that a value is; keys that it must not have are told.
    pub(super) fn table(
        &mut self,
        value: &'a Value<'a>,
        what: &'static str,
        keys: &[&str],
    ) -> Option<Table<'a>> {
        let DeValue::Table(table) = value.get_ref() else {
            self.mistake(
                value.span(),
                format!("{what} is a table with the keys {}", keys.join(", ")),
            );
            return None;
        };
        Some(self.known(table, value.span(), what, keys))
    }

    /// The same of a table that has been found already.
    pub(super) fn known(
        &mut self,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        what: &'static str,
        keys: &[&str],
    ) -> Table<'a> {
        for key in table.keys() {
            let name: &str = key.get_ref();
            if !keys.contains(&name) {
                let near = did_you_mean(name, keys.iter().copied());
                let known = keys.join(", ");
                self.mistake(
                    key.span(),
                    format!("{what} has no key {name:?}{near} (keys: {known})"),
                );
            }
        }
        Table { table, span, what }
    }

    /// A value that must be there.
    pub(super) fn required(
        &mut self,
        table: &Table<'a>,
        key: &str,
        example: &str,
    ) -> Option<&'a Value<'a>> {
        let value = table.get(key);
        if value.is_none() {
            let message = format!("{} needs the key {key:?}, for example {example}", table.what);
            self.mistake(table.span.clone(), message);
        }
        value
    }

    pub(super) fn text(&mut self, value: &'a Value<'a>, example: &str) -> Option<&'a str> {
        if let DeValue::String(text) = value.get_ref() {
            return Some(text);
        }
        self.mistake(value.span(), format!("this is a text between quotation marks: {example}"));
        None
    }

    pub(super) fn boolean(&mut self, value: &'a Value<'a>) -> Option<bool> {
        if let DeValue::Boolean(value) = value.get_ref() {
            return Some(*value);
        }
        self.mistake(value.span(), "this is true or false");
        None
    }

    pub(super) fn integer(&mut self, value: &'a Value<'a>, range: Range<u64>) -> Option<u64> {
        if let DeValue::Integer(integer) = value.get_ref()
            && let Ok(number) = u64::from_str_radix(integer.as_str(), integer.radix())
            && range.contains(&number)
        {
            return Some(number);
        }
        let (first, last) = (range.start, range.end.saturating_sub(1));
        self.mistake(value.span(), format!("this is a whole number from {first} to {last}"));
        None
    }

    /// A plain number within a range.
    pub(super) fn number(&mut self, value: &'a Value<'a>, least: f64, most: f64) -> Option<f64> {
        let number = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => {
                quantity::number(integer.as_str())
            }
            DeValue::Float(float) => quantity::number(float.as_str()),
            _ => None,
        };
        let number = number.filter(|number| (least..=most).contains(number));
        if number.is_none() {
            self.mistake(value.span(), format!("this is a number from {least} to {most}"));
        }
        number
    }

    /// A value with a unit.
    pub(super) fn quantity(&mut self, value: &'a Value<'a>, quantity: Quantity) -> Option<f64> {
        let DeValue::String(text) = value.get_ref() else {
            let expected = quantity.expected();
            self.mistake(value.span(), format!("a value with its unit is a text: {expected}"));
            return None;
        };
        match quantity::parse(text, &[quantity]) {
            Ok((_, value)) => Some(value),
            Err(message) => {
                self.mistake(value.span(), message);
                None
            }
        }
    }

    /// A value with a unit that is not negative, or, `positive`, greater than 0.
    pub(super) fn amount(
        &mut self,
        value: &'a Value<'a>,
        quantity: Quantity,
        positive: bool,
    ) -> Option<f64> {
        let amount = self.quantity(value, quantity)?;
        if amount > 0.0 || (amount == 0.0 && !positive) {
            return Some(amount);
        }
        let wish = if positive { "more than 0" } else { "0 or more" };
        self.mistake(value.span(), format!("this must be {wish}"));
        None
    }

    /// One of several words.
    pub(super) fn word(
        &mut self,
        value: &'a Value<'a>,
        words: &[&'static str],
    ) -> Option<&'static str> {
        if let DeValue::String(text) = value.get_ref() {
            if let Some(word) = words.iter().find(|word| **word == text.trim()) {
                return Some(word);
            }
            let near = did_you_mean(text, words.iter().copied());
            let message = format!("{text:?} is none of {}{near}", words.join(", "));
            self.mistake(value.span(), message);
        } else {
            self.mistake(value.span(), format!("this is one of the words {}", words.join(", ")));
        }
        None
    }

    /// The elements of a list.
    pub(super) fn list(&mut self, value: &'a Value<'a>, example: &str) -> &'a [Value<'a>] {
        if let DeValue::Array(array) = value.get_ref() {
            return array;
        }
        self.mistake(value.span(), format!("this is a list: {example}"));
        &[]
    }
}

impl<'a> Table<'a> {
    pub(super) fn get(&self, key: &str) -> Option<&'a Value<'a>> {
        self.table.get(key)
    }

    /// The place of the value of a key, or of the table.
    pub(super) fn place(&self, key: &str) -> Range<usize> {
        self.get(key).map_or_else(|| self.span.clone(), Spanned::span)
    }
}
