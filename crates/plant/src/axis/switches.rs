//! Switches along the way, held by hand or by the stage, with contacts that bounce.

use crate::machine::Switch;

/// Parts of the time of bouncing, in which a contact is by turns as it will be and as it was.
const BOUNCES: u64 = 5;

/// One switch and its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact {
    switch: Option<Switch>,
    /// Whether the stage actuates it.
    actuated: bool,
    /// Whether somebody holds it, and how.
    held: Option<bool>,
    /// When the contact began to bounce.
    bouncing_since: Option<u64>,
}

impl Contact {
    /// A switch that the stage at this position may actuate; none is a switch that is never actuated
    /// except by hand.
    pub(crate) fn new(switch: Option<Switch>, stage: f64, circle: Option<f64>) -> Self {
        let actuated = switch.is_some_and(|switch| {
            let at = near(&switch, stage, circle);
            (switch.from..=switch.to).contains(&at)
        });
        Self { switch, actuated, held: None, bouncing_since: None }
    }

    /// The stage has come to a position. Says whether the level of the contact may have changed.
    pub(crate) fn pass(&mut self, stage: f64, circle: Option<f64>, now: u64) -> bool {
        let Some(switch) = self.switch else { return false };
        let at = near(&switch, stage, circle);
        let (from, to) = zone(&switch, self.actuated);
        let inside = (from..=to).contains(&at);
        if inside != self.actuated {
            self.actuated = inside;
            self.bouncing_since = (switch.bounce > 0).then_some(now);
            return true;
        }
        false
    }

    /// Holds it actuated or not, or leaves it to the stage.
    pub(crate) fn hold(&mut self, held: Option<bool>) {
        self.held = held;
        self.bouncing_since = None;
    }

    /// Level of the input: whether it is actuated, and the other way round for a contact that is closed at
    /// rest.
    pub(crate) fn level(&self, now: u64) -> bool {
        let closed_at_rest = self.switch.is_some_and(|switch| switch.normally_closed);
        let as_before = self.held.is_none() && self.part(now).is_some_and(|part| part % 2 == 1);
        self.held.unwrap_or(self.actuated) ^ as_before ^ closed_at_rest
    }

    /// When a bouncing contact next changes.
    pub(crate) fn next_bounce(&self, now: u64) -> Option<u64> {
        let (since, bounce) = (self.bouncing_since?, self.switch?.bounce);
        let next = self.part(now)? + 1;
        (next < BOUNCES).then(|| (since + (bounce * next).div_ceil(BOUNCES)).max(now + 1))
    }

    /// The position of the stage at which it next changes on a way in this direction; none if it will not.
    pub(crate) fn edge_ahead(&self, stage: f64, forward: bool, circle: Option<f64>) -> Option<f64> {
        let switch = self.switch?;
        let at = near(&switch, stage, circle);
        let (from, to) = zone(&switch, self.actuated);
        let edge = match (self.actuated, forward) {
            (true, true) | (false, false) => to,
            (true, false) | (false, true) => from,
        };
        let way = edge - at;
        let ahead = if forward { way >= 0.0 } else { way <= 0.0 };
        let way = match circle {
            Some(circle) if !ahead => {
                if forward {
                    way + circle
                } else {
                    way - circle
                }
            }
            _ if !ahead => return None,
            _ => way,
        };
        way.is_finite().then_some(stage + way)
    }

    fn part(&self, now: u64) -> Option<u64> {
        let bounce = self.switch?.bounce;
        let part = (now.saturating_sub(self.bouncing_since?) * BOUNCES).checked_div(bounce)?;
        (part < BOUNCES).then_some(part)
    }
}

/// Where a switch is actuated, given whether it is.
fn zone(switch: &Switch, actuated: bool) -> (f64, f64) {
    let play = if actuated { switch.hysteresis } else { 0.0 };
    (switch.from - play, switch.to + play)
}

/// A position of the stage on a circular axis, in the turn that has the switch in its middle.
fn near(switch: &Switch, stage: f64, circle: Option<f64>) -> f64 {
    let middle = (switch.from + switch.to) / 2.0;
    match circle {
        Some(circle) if middle.is_finite() => {
            let away = stage - middle + circle / 2.0;
            middle + away - circle * libm::floor(away / circle) - circle / 2.0
        }
        _ => stage,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOME: Switch =
        Switch { from: 100.0, to: 200.0, hysteresis: 10.0, bounce: 0, normally_closed: false };

    #[test]
    fn a_switch_closes_at_its_zone_and_opens_behind_its_hysteresis() {
        let mut contact = Contact::new(Some(HOME), 0.0, None);
        assert_eq!(contact.edge_ahead(0.0, true, None), Some(100.0));
        assert_eq!(contact.edge_ahead(0.0, false, None), None);
        assert!(contact.pass(100.0, None, 1) && contact.level(1));
        assert_eq!(contact.edge_ahead(100.0, true, None), Some(210.0));
        assert_eq!(contact.edge_ahead(100.0, false, None), Some(90.0));
        assert!(!contact.pass(205.0, None, 2) && contact.level(2));
        assert!(contact.pass(210.5, None, 3) && !contact.level(3));
        assert_eq!(contact.edge_ahead(210.5, false, None), Some(200.0));
    }

    #[test]
    fn on_a_circle_it_comes_again_with_every_turn() {
        let mut contact = Contact::new(Some(HOME), 51_350.0, Some(51_200.0));
        assert!(contact.level(0), "51350 is 150 of the next turn");
        assert!(contact.pass(51_500.0, Some(51_200.0), 1) && !contact.level(1));
        assert_eq!(contact.edge_ahead(51_500.0, true, Some(51_200.0)), Some(102_500.0));
        assert_eq!(contact.edge_ahead(51_500.0, false, Some(51_200.0)), Some(51_400.0));
    }

    #[test]
    fn a_limit_switch_reaches_to_infinity() {
        let left = Switch { from: f64::NEG_INFINITY, to: 0.0, ..HOME };
        let contact = Contact::new(Some(left), -5.0, None);
        assert_eq!(contact.edge_ahead(-5.0, false, None), None);
        assert_eq!(contact.edge_ahead(-5.0, true, None), Some(10.0));
    }

    #[test]
    fn a_contact_bounces_in_five_parts_and_a_hand_stills_it() {
        let bouncing = Switch { bounce: 1000, normally_closed: true, ..HOME };
        let mut contact = Contact::new(Some(bouncing), 0.0, None);
        assert!(contact.level(0), "closed at rest");
        contact.pass(150.0, None, 5000);
        let mut levels = vec![contact.level(5000)];
        let mut now = 5000;
        while let Some(next) = contact.next_bounce(now) {
            now = next;
            levels.push(contact.level(now));
        }
        assert_eq!(levels, [false, true, false, true, false]);
        assert_eq!((now, contact.level(6000)), (5800, false));
        contact.hold(Some(false));
        assert!(contact.level(6000) && contact.next_bounce(6000).is_none());
        contact.hold(None);
        assert!(!contact.level(6000));
    }
}
