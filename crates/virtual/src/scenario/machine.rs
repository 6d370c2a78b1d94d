//! Load, way and switches of an axis, as its motor feels them.

use opentmcl_plant::machine::{Load, Spring, Stage, Switch};
use opentmcl_wire::TICKS_PER_SECOND;
use toml::de::DeValue;

use super::read::{Reader, Table, Value};
use super::scale::{GRAVITY, Scale};
use crate::quantity::Quantity;

/// How far from 0 a position may be, in fine steps: as far as position counters count.
const FARTHEST: f64 = 2_147_483_648.0;

/// Seconds for which a contact may bounce.
const LONGEST_BOUNCE: f64 = 1.0;

/// A position of the stage in fine steps.
pub(super) fn place<'a>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    scale: &Scale,
) -> Option<f64> {
    let fine = scale.to_fine(reader.quantity(value, scale.length())?);
    if fine.abs() <= FARTHEST {
        return Some(fine);
    }
    let farthest = scale.to_stage(FARTHEST);
    let unit = scale.unit().symbol();
    reader.mistake(
        value.span(),
        format!("this is farther than a position counter counts, {farthest:.0} {unit}"),
    );
    None
}

/// A distance in fine steps.
pub(super) fn way<'a>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    scale: &Scale,
    positive: bool,
) -> Option<f64> {
    reader.amount(value, scale.length(), positive)?;
    place(reader, value, scale)
}

pub(super) fn stage<'a>(
    reader: &mut Reader<'a>,
    value: Option<&'a Value<'a>>,
    scale: &Scale,
) -> Option<Stage> {
    let Some(value) = value else { return Some(Stage::default()) };
    let table = reader.table(value, "a stage", &["from", "to", "start", "circular"])?;
    let mut end = |key| match table.get(key) {
        Some(value) => place(reader, value, scale).map(Some),
        None => Some(None),
    };
    let (lowest, highest, start) = (end("from"), end("to"), end("start"));
    let circle = match table.get("circular") {
        Some(value) => circle(reader, value, scale),
        None => Some(None),
    };
    let (lowest, highest, start, circle) = (lowest?, highest?, start?, circle?);
    if circle.is_some() && (lowest.is_some() || highest.is_some()) {
        let key = if lowest.is_some() { "from" } else { "to" };
        reader.mistake(table.place(key), "a circular axis has no ends; leave out from and to");
    }
    if let (Some(lowest), Some(highest)) = (lowest, highest)
        && lowest >= highest
    {
        reader.mistake(table.place("to"), "the way must end after it begins: from < to");
        return None;
    }
    let first = start.unwrap_or(0.0);
    if lowest.is_some_and(|lowest| first < lowest) || highest.is_some_and(|highest| first > highest)
    {
        let message = "the stage must start between from and to (without start it is at 0)";
        reader.mistake(table.place("start"), message);
        return None;
    }
    Some(Stage { lowest, highest, circle, backlash: 0.0, start: first })
}

/// After how many fine steps a circular axis is where it was.
fn circle<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>, scale: &Scale) -> Option<Option<f64>> {
    match (value.get_ref(), scale.is_linear()) {
        (DeValue::Boolean(false), _) => Some(None),
        (DeValue::Boolean(true), false) => Some(Some(scale.to_fine(360.0))),
        (DeValue::Boolean(true), true) => {
            let message =
                "after which way is it where it was? write for example circular = \"400 mm\"";
            reader.mistake(value.span(), message);
            None
        }
        _ => way(reader, value, scale, true).map(Some),
    }
}

const LOAD_KEYS: [&str; 9] =
    ["mass", "inertia", "friction", "viscous", "gravity", "force", "torque", "springs", "along"];

pub(super) fn load<'a>(
    reader: &mut Reader<'a>,
    value: Option<&'a Value<'a>>,
    scale: &Scale,
) -> Option<Load> {
    let Some(value) = value else { return Some(Load::default()) };
    let table = reader.table(value, "a load", &LOAD_KEYS)?;
    let linear = scale.is_linear();
    for (key, instead) in if linear { [("torque", "force")] } else { [("force", "torque")] } {
        if let Some(value) = table.get(key) {
            let moves = if linear { "moves along a line" } else { "turns" };
            reader.mistake(value.span(), format!("this stage {moves}; write {instead} instead"));
        }
    }
    let mass = mass(reader, &table, scale);
    let friction =
        table.get("friction").map_or(Some(0.0), |value| reader.amount(value, scale.force(), false));
    let damping = if linear { Quantity::LinearDamping } else { Quantity::RotaryDamping };
    let viscous =
        table.get("viscous").map_or(Some(0.0), |value| reader.amount(value, damping, false));
    let force = table
        .get(if linear { "force" } else { "torque" })
        .map_or(Some(0.0), |value| reader.quantity(value, scale.force()));
    let weight = match table.get("gravity") {
        Some(value) => reader.word(value, &["negative", "positive"]).map(|direction| {
            let weight = mass.as_ref().map_or(0.0, |mass| mass.linear) * GRAVITY;
            if direction == "negative" { -weight } else { weight }
        }),
        None => Some(0.0),
    };
    if let Some(value) = table.get("gravity")
        && mass.as_ref().is_some_and(|mass| mass.linear == 0.0)
    {
        let message = "gravity pulls a mass along a line; without one write force or torque";
        reader.mistake(value.span(), message);
    }
    let springs = springs(reader, &table, scale);
    let along = along(reader, &table, scale);
    Some(Load {
        inertia: mass?.inertia,
        friction: scale.torque(friction?),
        viscous: scale.damping(viscous?),
        constant: scale.torque(force? + weight?),
        springs: springs?,
        along: along?,
    })
}

/// What is to be accelerated.
struct Mass {
    /// In kg; 0 on a stage that turns.
    linear: f64,
    /// In kg m² at the motor's shaft.
    inertia: f64,
}

/// A mass is seen through the transmission. An inertia is that of the stage where it turns; where it
/// moves along a line, that of coupling and screw, which turn behind the gear, if there is one, and
/// are given as the motor feels them.
fn mass<'a>(reader: &mut Reader<'a>, table: &Table<'a>, scale: &Scale) -> Option<Mass> {
    let inertia = table
        .get("inertia")
        .map_or(Some(0.0), |value| reader.amount(value, Quantity::Inertia, false));
    let linear = match table.get("mass") {
        Some(value) if !scale.is_linear() => {
            let message = "this stage turns; write inertia = \"120 g cm2\" instead";
            reader.mistake(value.span(), message);
            None
        }
        Some(value) => reader.amount(value, Quantity::Mass, false),
        None => Some(0.0),
    };
    let (inertia, linear) = (inertia?, linear?);
    let inertia =
        if scale.is_linear() { inertia + scale.inertia(linear) } else { scale.inertia(inertia) };
    Some(Mass { linear, inertia })
}

fn springs<'a>(reader: &mut Reader<'a>, table: &Table<'a>, scale: &Scale) -> Option<Vec<Spring>> {
    let Some(value) = table.get("springs") else { return Some(Vec::new()) };
    let example = "springs = [{ rate = \"2 N/mm\", rest = \"10 mm\" }]";
    let quantity = if scale.is_linear() { Quantity::LinearRate } else { Quantity::RotaryRate };
    let mut springs = Some(Vec::new());
    for value in reader.list(value, example) {
        let Some(table) = reader.table(value, "a spring", &["rate", "rest"]) else {
            springs = None;
            continue;
        };
        let rate = reader.required(&table, "rate", "rate = \"2 N/mm\"");
        let rate = rate.and_then(|value| reader.amount(value, quantity, false));
        let rest = table.get("rest").map_or(Some(0.0), |value| place(reader, value, scale));
        match (springs.as_mut(), rate, rest) {
            (Some(springs), Some(rate), Some(rest)) => {
                springs.push(Spring { rate: scale.spring(rate), rest });
            }
            _ => springs = None,
        }
    }
    springs
}

/// Forces along the way, each with its position.
fn along<'a>(reader: &mut Reader<'a>, table: &Table<'a>, scale: &Scale) -> Option<Vec<(f64, f64)>> {
    let Some(value) = table.get("along") else { return Some(Vec::new()) };
    let example = "along = [[\"0 mm\", \"0 N\"], [\"100 mm\", \"-5 N\"]]";
    let mut points: Vec<(f64, f64)> = Vec::new();
    for value in reader.list(value, example) {
        let [position, force] = reader.list(value, "[\"100 mm\", \"-5 N\"]") else {
            reader.mistake(
                value.span(),
                "a point has a position and a force: [\"100 mm\", \"-5 N\"]",
            );
            return None;
        };
        let at = place(reader, position, scale);
        let force = reader.quantity(force, scale.force());
        let (at, force) = (at?, force?);
        if points.last().is_some_and(|&(before, _)| at <= before) {
            reader.mistake(position.span(), "each position must be greater than the one before");
            return None;
        }
        points.push((at, scale.torque(force)));
    }
    Some(points)
}

pub(super) fn switch<'a>(
    reader: &mut Reader<'a>,
    key: &str,
    value: &'a Value<'a>,
    scale: &Scale,
    circular: bool,
) -> Option<Switch> {
    let keys = ["at", "width", "hysteresis", "bounce", "contact"];
    let table = reader.table(value, "a switch", &keys)?;
    let at = reader.required(&table, "at", "at = \"12.5 mm\"");
    let at = at.and_then(|value| place(reader, value, scale));
    let width = table.get("width").map(|value| way(reader, value, scale, true));
    let hysteresis =
        table.get("hysteresis").map_or(Some(0.0), |value| way(reader, value, scale, false));
    let bounce =
        table.get("bounce").map_or(Some(0.0), |value| reader.amount(value, Quantity::Time, false));
    let contact = table.get("contact").map_or(Some("normally open"), |value| {
        reader.word(value, &["normally open", "normally closed"])
    });
    if width.is_none() && (key == "home" || circular) {
        let message = if key == "home" {
            "a home switch needs the key \"width\", for example width = \"4 mm\""
        } else {
            "a switch of a circular axis needs the key \"width\", for example width = \"5 deg\""
        };
        reader.mistake(table.span.clone(), message);
        return None;
    }
    if bounce.is_some_and(|seconds| seconds > LONGEST_BOUNCE) {
        reader.mistake(
            table.place("bounce"),
            format!("a contact bounces for {LONGEST_BOUNCE} s at most"),
        );
    }
    let at = at?;
    let width = match width {
        Some(width) => width?,
        None => f64::INFINITY,
    };
    let (from, to) = match key {
        "left" => (at - width, at),
        "right" => (at, at + width),
        _ => (at - width / 2.0, at + width / 2.0),
    };
    Some(Switch {
        from,
        to,
        hysteresis: hysteresis?,
        bounce: (bounce? * TICKS_PER_SECOND as f64).round() as u64,
        normally_closed: contact? == "normally closed",
    })
}
