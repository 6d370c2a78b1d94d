//! What is wrong with the rows of a file, in sentences that name the file, the row and what would be
//! right.

use std::collections::BTreeMap;
use std::fmt::Display;

use opentmcl_wire::opcode;

use crate::data::{self, Certainty, File, is_snake_case, rooms};

/// Checks all rows of one module. An empty list means that the tables can be generated.
pub(crate) fn check(file: &str, module: &File) -> Vec<String> {
    let mut faults = Vec::new();
    head(&mut Row::new(&mut faults, file, "[module]", ""), file, &module.module);
    for rating in &module.rating {
        let mut row = Row::new(&mut faults, file, "[[rating]]", &rating.name);
        row.text("name", &rating.name);
        row.text("value", &rating.value);
    }
    axis_parameters(&mut faults, file, module);
    global_parameters(&mut faults, file, module);
    interrupts(&mut faults, file, module);
    ports(&mut faults, file, module);
    commands(&mut faults, file, module);
    faults
}

fn head(row: &mut Row<'_>, file: &str, head: &data::Head) {
    row.text("title", &head.title);
    row.text("description", &head.description);
    let stem = file.rsplit('/').next().and_then(|name| name.strip_suffix(".toml"));
    if stem != Some(&head.name) {
        row.fault(format_args!("name {:?} must be the file's name without .toml", head.name));
    }
    let spelled = head.name.replace('-', "_");
    if !is_snake_case(&spelled) || head.name.contains('_') {
        row.fault(format_args!(
            "name {:?} must be lower case letters and digits with dashes, such as \"tmcm-6214\"",
            head.name
        ));
    }
    if head.version.len() != 8 || !head.version.bytes().all(|byte| byte.is_ascii_graphic()) {
        row.fault(format_args!(
            "version {:?} must be the 8 ASCII characters that command 136 replies, such as \
             \"6214V116\"",
            head.version
        ));
    }
    if !(1..=8).contains(&head.axes) {
        row.fault(format_args!("axes {} must be 1 to 8", head.axes));
    }
    if head.peak_current_ma == 0 {
        row.fault(format_args!("peak_current_ma must be the amplitude that a driver gives, not 0"));
    }
}

fn axis_parameters(faults: &mut Vec<String>, file: &str, module: &File) {
    const TABLE: &str = "[[axis_parameter]]";
    if module.axis_parameter.len() > 255 {
        Row::new(faults, file, TABLE, "").fault("there must be at most 255 rows");
    }
    let rooms = rooms::axis(module.module.motion);
    let (mut numbers, mut ids) = (Unique::new("number"), Unique::new("id"));
    for entry in &module.axis_parameter {
        let label = format!("{} ({})", entry.number, entry.id);
        let mut row = Row::new(faults, file, TABLE, &label);
        row.number("number", entry.number);
        row.id(&entry.id);
        row.text("name", &entry.name);
        row.text("description", &entry.description);
        row.origin(entry.certainty, entry.source.as_deref());
        row.range(entry.min, entry.max, entry.default, i64::from(i32::MAX));
        internal_max(&mut row, entry);
        row.access(&entry.access, "RWE");
        row.axes(entry.axes.as_deref(), module.module.axes);
        row.effect(entry.behaviour.as_deref(), entry.stored.as_deref(), rooms);
        row.values(&entry.values, entry.min, entry.max);
        numbers.check(&mut row, entry.number, &label);
        ids.check(&mut row, entry.id.clone(), &label);
    }
}

fn internal_max(row: &mut Row<'_>, entry: &data::AxisParameter) {
    let converted = matches!(entry.unit.as_str(), "pps" | "pps2");
    match entry.internal_max {
        None if converted => row.fault(
            "internal_max is missing; a row in pps or pps2 needs the largest value of its register",
        ),
        Some(_) if !converted => {
            row.fault("internal_max must be left out; only rows in pps and pps2 are converted");
        }
        Some(value) if !(1..=i64::from(i32::MAX)).contains(&value) => {
            row.fault(format_args!("internal_max {value} must be 1 to 2147483647"));
        }
        _ => {}
    }
}

fn global_parameters(faults: &mut Vec<String>, file: &str, module: &File) {
    const TABLE: &str = "[[global_parameter]]";
    let mut numbers = Unique::new("bank and number");
    let mut ids = Unique::new("id");
    let mut previous = None;
    for entry in &module.global_parameter {
        let label = format!("{}/{} ({})", entry.bank, entry.number, entry.id);
        let mut row = Row::new(faults, file, TABLE, &label);
        row.number("bank", entry.bank);
        row.number("number", entry.number);
        let last = entry.last.unwrap_or(entry.number);
        if last < entry.number {
            row.fault(format_args!("last {last} must not be below number {}", entry.number));
        } else if last != entry.number {
            row.number("last", last);
        }
        row.id(&entry.id);
        row.text("name", &entry.name);
        row.text("description", &entry.description);
        row.origin(entry.certainty, entry.source.as_deref());
        row.range(entry.min, entry.max, entry.default, i64::from(u32::MAX));
        row.access(&entry.access, "RWEA");
        row.effect(entry.behaviour.as_deref(), entry.stored.as_deref(), rooms::GLOBAL);
        row.values(&entry.values, entry.min, entry.max);
        for number in entry.number..=last.min(entry.number.saturating_add(255)) {
            if !numbers.check(&mut row, (entry.bank, number), &label) {
                break;
            }
        }
        if !previous.is_some_and(|previous| continues(previous, entry)) {
            ids.check(&mut row, entry.id.clone(), &label);
        }
        previous = Some(entry);
    }
}

/// Whether a row goes on with the equal parameters of the row before it, as user variables do where
/// those that can be stored end; then both have the same name.
fn continues(previous: &data::GlobalParameter, entry: &data::GlobalParameter) -> bool {
    previous.bank == entry.bank
        && previous.last.and_then(|last| last.checked_add(1)) == Some(entry.number)
        && previous.behaviour == entry.behaviour
        && previous.id == entry.id
}

fn interrupts(faults: &mut Vec<String>, file: &str, module: &File) {
    let (mut numbers, mut ids) = (Unique::new("number"), Unique::new("id"));
    for entry in &module.interrupt {
        let label = format!("{} ({})", entry.number, entry.id);
        let mut row = Row::new(faults, file, "[[interrupt]]", &label);
        row.number("number", entry.number);
        row.id(&entry.id);
        row.text("name", &entry.name);
        row.text("description", &entry.description);
        row.origin(entry.certainty, entry.source.as_deref());
        row.effect(Some(&entry.behaviour), None, rooms::INTERRUPT);
        numbers.check(&mut row, entry.number, &label);
        ids.check(&mut row, entry.id.clone(), &label);
    }
}

fn ports(faults: &mut Vec<String>, file: &str, module: &File) {
    let mut ids = Unique::new("bank and id");
    let mut directions = Unique::new("bank, number and access letter");
    for entry in &module.port {
        let label = format!("{}/{} ({})", entry.bank, entry.number, entry.id);
        let mut row = Row::new(faults, file, "[[port]]", &label);
        row.number("bank", entry.bank);
        row.number("number", entry.number);
        row.id(&entry.id);
        row.text("name", &entry.name);
        row.text("description", &entry.description);
        row.origin(entry.certainty, entry.source.as_deref());
        row.range(entry.min, entry.max, entry.default, i64::from(i32::MAX));
        row.access(&entry.access, "RW");
        row.effect(Some(&entry.behaviour), None, rooms::PORT);
        // GIO and SIO may mean different ports by the same number.
        for letter in entry.access.chars() {
            directions.check(&mut row, (entry.bank, entry.number, letter), &label);
        }
        ids.check(&mut row, (entry.bank, entry.id.clone()), &label);
    }
}

fn commands(faults: &mut Vec<String>, file: &str, module: &File) {
    let (mut numbers, mut names) = (Unique::new("number"), Unique::new("mnemonic"));
    for entry in &module.command {
        let label = format!("{} ({})", entry.number, entry.mnemonic);
        let mut row = Row::new(faults, file, "[[command]]", &label);
        row.number("number", entry.number);
        row.text("mnemonic", &entry.mnemonic);
        row.text("description", &entry.description);
        row.origin(entry.certainty, entry.source.as_deref());
        if let Some(reason) = &entry.unavailable {
            row.text("unavailable", reason);
        }
        mnemonic(&mut row, entry);
        numbers.check(&mut row, entry.number, &label);
        names.check(&mut row, entry.mnemonic.clone(), &label);
    }
}

fn mnemonic(row: &mut Row<'_>, entry: &data::Command) {
    let written = entry.mnemonic.as_str();
    if let Some(form) = u8::try_from(entry.number).ok().and_then(opcode::form) {
        if form.mnemonic != written {
            row.fault(format_args!(
                "mnemonic {written:?} must be {:?}, which is command {} of the language",
                form.mnemonic, entry.number
            ));
        }
    } else if let Some(form) = opcode::form_by_mnemonic(written) {
        row.fault(format_args!(
            "number {} must be {}, the number of {}",
            entry.number,
            form.opcode.number(),
            form.mnemonic
        ));
    } else if !written.chars().all(|c| c.is_ascii_lowercase() || c == ' ') {
        row.fault(format_args!(
            "mnemonic {written:?} must be a name in lower case, as the language has no mnemonic for \
             this number"
        ));
    }
}

/// One row of a file, and where its faults go.
struct Row<'a> {
    place: String,
    faults: &'a mut Vec<String>,
}

impl<'a> Row<'a> {
    fn new(faults: &'a mut Vec<String>, file: &str, table: &str, label: &str) -> Self {
        let gap = if label.is_empty() { "" } else { " " };
        Self { place: format!("{file}: {table}{gap}{label}"), faults }
    }

    fn fault(&mut self, sentence: impl Display) {
        self.faults.push(format!("{}: {sentence}", self.place));
    }

    fn number(&mut self, field: &str, value: i64) {
        if u8::try_from(value).is_err() {
            self.fault(format_args!("{field} {value} must be 0 to 255"));
        }
    }

    fn id(&mut self, id: &str) {
        if !is_snake_case(id) {
            self.fault(format_args!("id {id:?} must be snake_case, such as \"target_position\""));
        }
    }

    fn text(&mut self, field: &str, text: &str) {
        if text.is_empty() || text.trim() != text {
            self.fault(format_args!("{field} {text:?} must be a text without blanks at its ends"));
        }
    }

    fn origin(&mut self, certainty: Certainty, source: Option<&str>) {
        match source {
            Some(source) => self.text("source", source),
            None if certainty == Certainty::Exact => {}
            None => self.fault(
                "source is missing; a row that is not exact must say where it comes from, such as \
                 \"manual of the TMCM-351\"",
            ),
        }
    }

    fn range(&mut self, min: i64, max: i64, default: i64, limit: i64) {
        if min > max {
            self.fault(format_args!("min {min} must not be above max {max}"));
        } else if !(min..=max).contains(&default) {
            self.fault(format_args!("default {default} must lie in the range {min}..{max}"));
        }
        if min < i64::from(i32::MIN) || max > limit || i32::try_from(default).is_err() {
            self.fault(format_args!(
                "range {min}..{max} with default {default} must fit the 32 bits of a value"
            ));
        }
    }

    fn access(&mut self, access: &str, letters: &str) {
        let mut rest = letters.chars();
        let in_order = access.chars().all(|letter| rest.any(|legal| legal == letter));
        if access.is_empty() || !in_order {
            let legal = letters.chars().map(String::from).collect::<Vec<_>>().join(", ");
            self.fault(format_args!(
                "access {access:?} must be one or more of {legal}, in this order"
            ));
            return;
        }
        for (letter, meaning) in [('E', "stored on request"), ('A', "stored by each write")] {
            if access.contains(letter) && !access.contains('W') {
                self.fault(format_args!(
                    "access {access:?} has {letter} ({meaning}) but no W; it must be writable"
                ));
            }
        }
    }

    fn axes(&mut self, axes: Option<&[i64]>, count: u8) {
        let Some(axes) = axes else { return };
        if axes.is_empty() {
            self.fault("axes must name at least one axis; leave it out for all");
        }
        for (at, axis) in axes.iter().enumerate() {
            if !(0..i64::from(count)).contains(axis) {
                self.fault(format_args!("axis {axis} must be 0 to {}", i64::from(count) - 1));
            } else if axes.iter().take(at).any(|earlier| earlier == axis) {
                self.fault(format_args!("axis {axis} must be named once"));
            }
        }
    }

    fn effect(&mut self, behaviour: Option<&str>, stored: Option<&str>, rooms: &[(&str, &str)]) {
        match (behaviour, stored) {
            (Some(behaviour), None) => self.behaviour(behaviour, rooms),
            (None, Some(reason)) => self.text("stored", reason),
            _ => self.fault(
                "must have either behaviour = \"room.effect\" or stored = \"why nothing follows\"",
            ),
        }
    }

    fn behaviour(&mut self, behaviour: &str, rooms: &[(&str, &str)]) {
        let (room, effect) = behaviour.split_once('.').unwrap_or((behaviour, ""));
        if !rooms.iter().any(|(known, _)| *known == room) {
            let known = rooms.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            self.fault(format_args!(
                "behaviour {behaviour:?} must name one of the rooms of this table: {known}"
            ));
        } else if !is_snake_case(effect) {
            self.fault(format_args!(
                "behaviour {behaviour:?} must name an effect in snake_case after the dot"
            ));
        }
    }

    fn values(&mut self, values: &BTreeMap<String, String>, min: i64, max: i64) {
        for (value, meaning) in values {
            match value.parse::<i32>() {
                Ok(number) if (min..=max).contains(&i64::from(number)) => {}
                _ => self.fault(format_args!(
                    "values names {value}, which must be a number in the range {min}..{max}"
                )),
            }
            self.text("meaning of a value", meaning);
        }
    }
}

/// What has been seen in a table so far, and in which row.
struct Unique<K> {
    what: &'static str,
    seen: BTreeMap<K, String>,
}

impl<K: Ord> Unique<K> {
    fn new(what: &'static str) -> Self {
        Self { what, seen: BTreeMap::new() }
    }

    /// Notes one row; false if an earlier row has the same.
    fn check(&mut self, row: &mut Row<'_>, key: K, label: &str) -> bool {
        if let Some(earlier) = self.seen.get(&key) {
            row.fault(format_args!("{} must differ from that of row {earlier}", self.what));
            return false;
        }
        self.seen.insert(key, label.to_owned());
        true
    }
}
