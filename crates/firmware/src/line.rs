//! Lines to the host: addresses, the pause before a reply, replies on their way.

use opentmcl_wire::{Instant, serial};

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

/// One frame on its way to the host.
#[derive(Clone, Copy, Debug)]
struct Outgoing {
    due: Instant,
    port: Port,
    frame: [u8; serial::FRAME_LEN],
}

/// Frames on their way to the host. A host that sends on without reading loses the newest ones.
#[derive(Clone, Debug)]
pub(crate) struct Outbox {
    frames: [Option<Outgoing>; Self::CAPACITY],
}

impl Outbox {
    const CAPACITY: usize = 16;

    pub(crate) const fn new() -> Self {
        Self { frames: [None; Self::CAPACITY] }
    }

    pub(crate) fn push(&mut self, due: Instant, port: Port, frame: [u8; serial::FRAME_LEN]) {
        if let Some(place) = self.frames.iter_mut().find(|place| place.is_none()) {
            *place = Some(Outgoing { due, port, frame });
        }
    }

    /// The next frame that is due, oldest first; one on a line without pause overtakes those with one.
    pub(crate) fn pop(&mut self, now: Instant) -> Option<(Port, [u8; serial::FRAME_LEN])> {
        let is_due = |place: &Option<Outgoing>| place.is_some_and(|outgoing| outgoing.due <= now);
        let at = self.frames.iter().position(is_due)?;
        let outgoing = self.frames.get_mut(at)?.take()?;
        if let Some(rest) = self.frames.get_mut(at..) {
            rest.rotate_left(1);
        }
        Some((outgoing.port, outgoing.frame))
    }

    pub(crate) fn next_due(&self) -> Option<Instant> {
        self.frames.iter().flatten().map(|outgoing| outgoing.due).min()
    }
}
