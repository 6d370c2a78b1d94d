//! What has changed since somebody looked.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_firmware::Board as _;
use opentmcl_wire::{Duration, Instant, TICKS_PER_SECOND};
use serde_json::{Map, Value, json};

use super::Lab;
use super::state::{CONTINUOUS, seconds};

/// What a watcher wants to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subscription {
    /// Only when something switches, begins or ends; then with positions and all that goes with them.
    Changes,
    /// All that has changed, at most so many times a second, 1..=1000.
    Rate(u32),
}

/// What a watcher has been told last.
#[derive(Clone, Debug)]
pub struct Snapshot {
    subscription: Subscription,
    told: Value,
    /// Before this time it wants to hear nothing.
    due: Instant,
}

impl<F: NorFlash> Lab<F> {
    /// Begins to watch: the present state counts as told.
    pub fn snapshot(&mut self, subscription: Subscription) -> Snapshot {
        let due = self.now() + pause(subscription);
        Snapshot { subscription, told: self.state_value(), due }
    }

    /// What has changed since the last call, as one line of JSON: the time, and a merge patch (RFC 7396)
    /// of the state; none if a watcher has nothing to be told.
    ///
    /// Call it at the time that [`Lab::next_look`] tells, and after anything has come from outside.
    pub fn changes_since(&mut self, snapshot: &mut Snapshot) -> Option<String> {
        let now = self.now();
        if now < snapshot.due {
            return None;
        }
        let state = self.state_value();
        let changes = difference(&snapshot.told, &state)?;
        if snapshot.subscription == Subscription::Changes && !is_event(&changes) {
            return None;
        }
        snapshot.told = state;
        snapshot.due = now + pause(snapshot.subscription);
        Some(json!({ "time": seconds(now), "changes": changes }).to_string())
    }

    /// When there may be something to tell a watcher, if nothing comes from outside; none while all is
    /// at rest. Nothing has to be asked before.
    pub fn next_look(&mut self, snapshot: &Snapshot) -> Option<Instant> {
        let moving = self.is_moving();
        if let (Subscription::Rate(_), true) = (snapshot.subscription, moving) {
            return Some(snapshot.due);
        }
        let events = self.modules.iter_mut().flat_map(|module| {
            let motion = if module.is_powered() { module.next_motion_event() } else { None };
            [module.next_event(), motion]
        });
        events.flatten().min().map(|event| event.max(snapshot.due))
    }

    fn is_moving(&mut self) -> bool {
        self.modules.iter_mut().any(|module| {
            // An axis that is about to start has no speed yet, and something to come.
            module.board_mut().next_event().is_some()
                || (0..module.model().axes).any(|axis| {
                    module.speed(axis) != Some(0)
                        || module.view(axis).is_some_and(|view| view.speed != 0.0)
                        || module.servo_view(axis).is_some_and(|view| view.speed != 0.0)
                })
        })
    }
}

fn pause(subscription: Subscription) -> Duration {
    match subscription {
        Subscription::Changes => Duration::from_ticks(0),
        Subscription::Rate(rate) => {
            Duration::from_ticks(TICKS_PER_SECOND / u64::from(rate.clamp(1, 1000)))
        }
    }
}

/// The members of `new` that differ from those of `old`; both have the same members, since a scenario
/// does not change.
fn difference(old: &Value, new: &Value) -> Option<Value> {
    match (old, new) {
        (Value::Object(old), Value::Object(new)) => {
            let members = new.iter().filter_map(|(key, value)| {
                let change = match old.get(key) {
                    Some(old) => difference(old, value)?,
                    None => value.clone(),
                };
                Some((key.clone(), change))
            });
            let members: Map<String, Value> = members.collect();
            if members.is_empty() { None } else { Some(Value::Object(members)) }
        }
        (old, new) if old == new => None,
        (_, new) => Some(new.clone()),
    }
}

/// Whether there is anything among changes but what changes steadily.
fn is_event(changes: &Value) -> bool {
    match changes {
        Value::Object(members) => members
            .iter()
            .any(|(key, value)| !CONTINUOUS.contains(&key.as_str()) && is_event(value)),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_differs_is_told() {
        let old = json!({ "a": 1, "b": { "c": true, "d": [1, 2] } });
        let new = json!({ "a": 1, "b": { "c": true, "d": [1, 3] } });
        assert_eq!(difference(&old, &new), Some(json!({ "b": { "d": [1, 3] } })));
        assert_eq!(difference(&old, &old), None);
    }

    #[test]
    fn what_changes_steadily_is_no_event() {
        assert!(!is_event(&json!({ "modules": { "x": { "axes": { "0": { "position": 3 } } } } })));
        assert!(is_event(&json!({ "axes": { "0": { "position": 3, "blocked": true } } })));
    }
}
