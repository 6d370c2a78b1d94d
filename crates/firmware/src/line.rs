//! Lines to the host: addresses, the pause before a reply, what is on its way.
//!
//! # Readings
//!
//! - On one port everything leaves in the order in which it was said, even if the pause becomes shorter
//!   meanwhile. Ports do not wait for each other.

use opentmcl_wire::ascii::Text;
use opentmcl_wire::{Instant, Outgoing};

/// Kind of line by which a request came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Line {
    /// USB: one module on the line, its address is not checked.
    Usb,
    /// RS485: several modules, each answers to its own address only, after the telegram pause.
    Rs485,
    /// RS232: as RS485, without the pause.
    Rs232,
}

/// A connection: the kind of line, and which of several connections of that kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Port {
    /// Kind of line.
    pub line: Line,
    /// Tells connections of the same kind apart; means nothing to the module.
    pub number: u8,
}

impl Port {
    /// The only connection of a kind.
    pub const fn new(line: Line) -> Self {
        Self { line, number: 0 }
    }
}

/// Something on its way to the host.
#[derive(Clone, Copy, Debug)]
struct Item {
    due: Instant,
    port: Port,
    content: Outgoing,
}

/// What is on its way to the host. A host that sends on without reading loses the newest of it.
#[derive(Clone, Debug)]
pub(crate) struct Outbox {
    items: [Option<Item>; Self::CAPACITY],
}

impl Outbox {
    /// Two of the longest lines with their echoes and replies take twelve.
    const CAPACITY: usize = 16;

    pub(crate) const fn new() -> Self {
        Self { items: [None; Self::CAPACITY] }
    }

    pub(crate) fn push(&mut self, due: Instant, port: Port, content: Outgoing) {
        let due = self.last(port).map_or(due, |last| due.max(last.due));
        if let Some(place) = self.items.iter_mut().find(|place| place.is_none()) {
            *place = Some(Item { due, port, content });
        }
    }

    /// Sends text as soon as everything before it has left. It goes together with text that waits to be
    /// fetched, so that single characters take little room.
    pub(crate) fn push_text(&mut self, now: Instant, port: Port, text: &[u8]) {
        let mut rest = text;
        // What is due has not been seen by anybody yet, nor has what becomes due at the same time.
        if let Some(Item { content: Outgoing::Text(text), .. }) = self.last(port) {
            rest = text.push(rest);
        }
        while !rest.is_empty() {
            let mut text = Text::new();
            rest = text.push(rest);
            self.push(now, port, Outgoing::Text(text));
        }
    }

    /// The next item that is due, oldest first; one on a line without pause overtakes those with one.
    pub(crate) fn pop(&mut self, now: Instant) -> Option<(Port, Outgoing)> {
        let is_due = |place: &Option<Item>| place.is_some_and(|item| item.due <= now);
        let at = self.items.iter().position(is_due)?;
        let item = self.items.get_mut(at)?.take()?;
        if let Some(rest) = self.items.get_mut(at..) {
            rest.rotate_left(1);
        }
        Some((item.port, item.content))
    }

    pub(crate) fn next_due(&self) -> Option<Instant> {
        self.items.iter().flatten().map(|item| item.due).min()
    }

    /// What was said last by a port and has not left.
    fn last(&mut self, port: Port) -> Option<&mut Item> {
        self.items.iter_mut().flatten().rfind(|item| item.port == port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const USB: Port = Port::new(Line::Usb);
    const RS485: Port = Port::new(Line::Rs485);

    fn at(ticks: u64) -> Instant {
        Instant::from_ticks(ticks)
    }

    fn frame(number: u8) -> Outgoing {
        Outgoing::Frame([number; 9])
    }

    /// All that is due, in order.
    fn sent(outbox: &mut Outbox, now: u64) -> Vec<(Port, Outgoing)> {
        core::iter::from_fn(|| outbox.pop(at(now))).collect()
    }

    fn text(sent: &[(Port, Outgoing)]) -> Vec<u8> {
        assert!(sent.iter().all(|(_, content)| content.frame().is_none()));
        sent.iter().flat_map(|(_, content)| content.as_bytes().to_vec()).collect()
    }

    #[test]
    fn a_port_keeps_its_order_and_does_not_hold_up_others() {
        let mut outbox = Outbox::new();
        outbox.push(at(10), RS485, frame(1));
        outbox.push(at(5), RS485, frame(2));
        outbox.push_text(at(5), RS485, b"A");
        outbox.push(at(5), USB, frame(3));
        assert_eq!(outbox.next_due(), Some(at(5)));
        assert_eq!(sent(&mut outbox, 9), [(USB, frame(3))]);
        assert_eq!(outbox.next_due(), Some(at(10)));
        let late = sent(&mut outbox, 10);
        assert_eq!(late[..2], [(RS485, frame(1)), (RS485, frame(2))]);
        assert_eq!(text(&late[2..]), b"A");
        assert_eq!(outbox.next_due(), None);
    }

    #[test]
    fn characters_that_nobody_fetches_wait_together() {
        let mut outbox = Outbox::new();
        let line = [b'x'; 300];
        for (time, &character) in (0..).zip(&line) {
            outbox.push_text(at(time), USB, &[character]);
        }
        // 15 items of 19 bytes hold 285, and the sixteenth is not full.
        let all = sent(&mut outbox, 300);
        assert_eq!(text(&all), line);
        assert_eq!(all.len(), 16);
    }

    #[test]
    fn text_behind_a_frame_is_not_mixed_with_text_before_it() {
        let mut outbox = Outbox::new();
        outbox.push_text(at(0), USB, b"A");
        outbox.push(at(0), USB, frame(1));
        outbox.push_text(at(0), USB, b"B");
        let all = sent(&mut outbox, 0);
        assert_eq!(all.len(), 3);
        assert_eq!(text(&all[..1]), b"A");
        assert_eq!(all[1], (USB, frame(1)));
        assert_eq!(text(&all[2..]), b"B");
    }

    #[test]
    fn of_too_much_the_newest_is_lost() {
        let mut outbox = Outbox::new();
        (0..20).for_each(|number| outbox.push(at(0), USB, frame(number)));
        let kept: Vec<_> = (0..16).map(|number| (USB, frame(number))).collect();
        assert_eq!(sent(&mut outbox, 0), kept);
    }
}
