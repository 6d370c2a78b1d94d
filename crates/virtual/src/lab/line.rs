//! The line protocol: a line of text in, a line of JSON out.

use embedded_storage::nor_flash::NorFlash;
use serde_json::{Value, json};

use super::state::seconds;
use super::{Lab, LabEffect, Subscription};
use crate::scenario::MachineSetup;
use crate::suggest::did_you_mean;
use crate::world::{Action, FAULTS_FORM, FORMS};

/// The JSON schema of all lines that a lab writes.
pub const SCHEMA: &str = include_str!("schema.json");

/// Longest line that is looked at.
const LONGEST_LINE: usize = 1024;

/// Lines that are no actions, and what comes of them.
const QUERIES: [(&str, &str); 8] = [
    ("state", "everything there is to see"),
    ("watch", "changes from now on: watch changes, or watch 20 for 20 times a second"),
    ("unwatch", "no changes any more"),
    ("scenario", "the modules, their axes and ports"),
    ("faults", "what the lines of the served ports do to frames"),
    ("help", "this"),
    ("schema", "the JSON schema of all replies"),
    ("NAME:", "before an action: the module that it is meant for, if there are several"),
];

/// What comes of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    /// One line of JSON without its end, for whoever has sent the line.
    pub json: String,
    /// Whether whoever has sent the line wants to watch from now on: `Some(None)` is no more.
    pub watch: Option<Option<Subscription>>,
    /// What it asks of whoever serves the lab.
    pub effects: Vec<LabEffect>,
}

impl Response {
    fn ok(mut members: Value) -> Self {
        if let Value::Object(members) = &mut members {
            members.insert("ok".to_owned(), json!(true));
        }
        Self { json: members.to_string(), watch: None, effects: Vec::new() }
    }

    /// A line that did nothing, and why.
    pub fn error(message: &str) -> Self {
        let json = json!({ "ok": false, "error": message }).to_string();
        Self { json, watch: None, effects: Vec::new() }
    }
}

impl<F: NorFlash> Lab<F> {
    /// Does what a line asks for, at the lab's time.
    pub fn line(&mut self, text: &str) -> Response {
        let text = text.trim();
        if text.len() > LONGEST_LINE {
            return Response::error(&format!("a line has at most {LONGEST_LINE} characters"));
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            [] => Response::error("the line is empty; help lists what there is"),
            ["state"] => self.state(),
            ["watch", ..] => watch(&words),
            ["unwatch"] => Response { watch: Some(None), ..Response::ok(json!({})) },
            ["scenario"] => self.describe(),
            ["help"] => help(),
            ["schema"] => match serde_json::from_str::<Value>(SCHEMA) {
                Ok(schema) => Response::ok(json!({ "schema": schema })),
                Err(error) => Response::error(&format!("the schema is damaged: {error}")),
            },
            _ => match self.action(text) {
                Ok(response) => response,
                Err(message) => Response::error(&message),
            },
        }
    }

    fn state(&mut self) -> Response {
        let time = seconds(self.now());
        Response::ok(json!({ "time": time, "state": self.state_value() }))
    }

    fn action(&mut self, text: &str) -> Result<Response, String> {
        let (module, rest) = self.addressed(text)?;
        let action: Action = rest.parse().map_err(|error: crate::ActionError| {
            let word = rest.split_whitespace().next().unwrap_or_default();
            let queries = QUERIES.iter().map(|query| query.0);
            let is_action = FORMS.iter().any(|form| form.0 == word) || word == "faults";
            let near = if is_action { String::new() } else { did_you_mean(word, queries) };
            if near.is_empty() { error.to_string() } else { format!("{word:?} is no action{near}") }
        })?;
        self.act(module, &action).map_err(|error| error.to_string())?;
        Ok(Response { effects: self.take_effects(), ..Response::ok(json!({})) })
    }

    /// The module that a line is meant for, and the rest of the line.
    fn addressed<'a>(&self, text: &'a str) -> Result<(usize, &'a str), String> {
        let names = || self.scenario.modules.iter().map(|setup| setup.name.as_str());
        // A name stands before the first blank; what follows may have colons of its own.
        let first = text.split_whitespace().next().unwrap_or_default();
        if let Some((name, _)) = first.split_once(':') {
            let rest = text.get(name.len() + 1..).unwrap_or_default();
            return match self.find(name) {
                Some(module) => Ok((module, rest.trim())),
                None => {
                    let near = did_you_mean(name, names());
                    let all: Vec<&str> = names().collect();
                    Err(format!("there is no module {name:?}{near} (modules: {})", all.join(", ")))
                }
            };
        }
        match names().count() {
            0 | 1 => Ok((0, text)),
            _ => {
                let all: Vec<&str> = names().collect();
                let (first, all) = (all.first().copied().unwrap_or_default(), all.join(", "));
                Err(format!("for which module? write {first}: and the action (modules: {all})"))
            }
        }
    }

    fn describe(&mut self) -> Response {
        let modules = self.scenario.modules.iter().map(|setup| {
            let axes = setup.axes.iter().enumerate().map(|(number, axis)| {
                let stage = axis.machine.as_ref().map(MachineSetup::stage);
                let place = |fine: Option<f64>| fine.map(|fine| axis.scale.to_stage(fine));
                let switches = axis.machine.as_ref().map(|machine| *machine.switches());
                let zone = |switch: Option<opentmcl_plant::machine::Switch>| {
                    switch.map(|switch| {
                        let end = |fine: f64| {
                            Some(axis.scale.to_stage(fine)).filter(|end| end.is_finite())
                        };
                        json!({ "from": end(switch.from), "to": end(switch.to) })
                    })
                };
                json!({
                    "axis": number,
                    "machine": axis.machine.is_some(),
                    "unit": axis.scale.unit().symbol(),
                    "microsteps_per_unit": axis.scale.to_fine(1.0),
                    "from": place(stage.and_then(|stage| stage.lowest)),
                    "to": place(stage.and_then(|stage| stage.highest)),
                    "circle": place(stage.and_then(|stage| stage.circle)),
                    "left": switches.and_then(|switches| zone(switches.left)),
                    "right": switches.and_then(|switches| zone(switches.right)),
                    "home": switches.and_then(|switches| zone(switches.home)),
                })
            });
            let axes: Vec<Value> = axes.collect();
            let ports: Vec<&str> = setup.ports.iter().map(|port| port.name.as_str()).collect();
            json!({ "name": setup.name, "model": setup.model.name, "axes": axes, "ports": ports })
        });
        let modules: Vec<Value> = modules.collect();
        Response::ok(json!({ "scenario": { "name": self.scenario.name, "modules": modules } }))
    }
}

fn watch(words: &[&str]) -> Response {
    let subscription = match words {
        ["watch"] | ["watch", "changes"] => Some(Subscription::Changes),
        ["watch", rate] => {
            rate.parse().ok().filter(|rate| (1..=1000).contains(rate)).map(Subscription::Rate)
        }
        _ => None,
    };
    match subscription {
        Some(subscription) => {
            Response { watch: Some(Some(subscription)), ..Response::ok(json!({})) }
        }
        None => Response::error("write watch changes, or watch and a rate from 1 to 1000 a second"),
    }
}

fn help() -> Response {
    let actions: Vec<&str> = FORMS.iter().map(|form| form.1).chain([FAULTS_FORM]).collect();
    let queries: Vec<String> =
        QUERIES.iter().map(|(name, what)| format!("{name} — {what}")).collect();
    Response::ok(json!({ "help": { "actions": actions, "queries": queries } }))
}
