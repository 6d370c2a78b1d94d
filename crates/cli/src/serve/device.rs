//! A lab as the server sees it.

use opentmcl_firmware::{Line, Port};
use opentmcl_link::{BadLine, Device, Endpoint, MAX_CONTROL_LINE, Peer, ServedPort, Speed};
use opentmcl_virtual::{Lab, Response, Snapshot, Subscription};
use opentmcl_wire::serial::{Request, WrongChecksum};
use opentmcl_wire::{Duration, Instant, Outgoing};

use super::eeprom::Eeprom;
use super::faults;

/// The least real time between two looks for one watcher. Each look makes a picture of everything.
const LOOK_PAUSE: std::time::Duration = std::time::Duration::from_millis(1);

/// The modules, and who watches them.
pub(super) struct Served {
    lab: Lab<Eeprom>,
    /// [`LOOK_PAUSE`] in the time of the lab.
    pause: Duration,
    watchers: Vec<Watcher>,
}

/// What the firmware calls the line of a client.
fn port_of(peer: Peer) -> Port {
    let line = match peer.endpoint {
        Endpoint::Pty => Line::Usb,
        Endpoint::Tcp => Line::Rs485,
    };
    Port { line, number: peer.number }
}

/// A client of the control socket that wants to be told of changes.
struct Watcher {
    client: u8,
    snapshot: Snapshot,
    /// The least time between two looks for it.
    pause: Duration,
    /// Whether something may have happened since the last look.
    unseen: bool,
    /// Before this time there is no look.
    next: Instant,
}

impl Served {
    pub(super) fn new(lab: Lab<Eeprom>, speed: Speed) -> Self {
        let pause = Duration::from_ticks(speed.ticks(LOOK_PAUSE));
        Self { lab, pause, watchers: Vec::new() }
    }

    fn happened(&mut self) {
        for watcher in &mut self.watchers {
            watcher.unseen = true;
        }
    }

    fn watch(&mut self, client: u8, subscription: Option<Subscription>) {
        self.watchers.retain(|watcher| watcher.client != client);
        let Some(subscription) = subscription else { return };
        let wanted = match subscription {
            Subscription::Changes => Duration::from_ticks(0),
            Subscription::Rate(rate) => Duration::from_micros(1_000_000 / u64::from(rate.max(1))),
        };
        let pause = self.pause.max(wanted);
        let next = self.lab.now() + pause;
        let snapshot = self.lab.snapshot(subscription);
        self.watchers.push(Watcher { client, snapshot, pause, unseen: false, next });
    }

    /// The answer to a line, without its end.
    fn answer(&mut self, client: u8, line: &str, ports: &mut [ServedPort]) -> String {
        if line.trim() == "faults" {
            return faults::tell(ports, self.lab.scenario());
        }
        let response = self.lab.line(line);
        if let Some(subscription) = response.watch {
            self.watch(client, subscription);
        }
        for asked in &response.effects {
            if let Err(message) = faults::apply(ports, asked.module, &asked.effect) {
                return Response::error(&message).json;
            }
        }
        response.json
    }
}

impl Device for Served {
    fn next_event(&mut self) -> Option<Instant> {
        self.lab.next_event()
    }

    fn advance_to(&mut self, now: Instant) {
        self.lab.advance_to(now);
        self.happened();
    }

    fn receive(&mut self, from: Peer, request: Result<Request, WrongChecksum>) {
        if let Some(module) = self.lab.module_mut(from.module) {
            module.receive(port_of(from), request);
        }
        self.happened();
    }

    fn takes_text(&self, from: Peer) -> bool {
        let module = self.lab.modules().get(from.module);
        module.is_some_and(|module| module.is_in_ascii_mode(port_of(from)))
    }

    fn receive_key(&mut self, from: Peer, byte: u8) {
        if let Some(module) = self.lab.module_mut(from.module) {
            module.receive_key(port_of(from), byte);
        }
        self.happened();
    }

    fn connection_ended(&mut self, peer: Peer) {
        if let Some(module) = self.lab.module_mut(peer.module) {
            module.hang_up(port_of(peer));
        }
    }

    fn transmit(&mut self) -> Option<(Peer, Outgoing)> {
        let count = self.lab.modules().len();
        let (module, (port, content)) = (0..count)
            .find_map(|module| Some((module, self.lab.module_mut(module)?.transmit()?)))?;
        let endpoint = match port.line {
            Line::Usb => Endpoint::Pty,
            Line::Rs485 | Line::Rs232 => Endpoint::Tcp,
        };
        Some((Peer { module, endpoint, number: port.number }, content))
    }

    fn set_faults(&mut self, ports: &mut [ServedPort]) {
        for asked in self.lab.take_effects() {
            // Its text was looked at before serving. A port that is not served has no faults.
            let _ = faults::apply(ports, asked.module, &asked.effect);
        }
    }

    fn control(
        &mut self,
        client: u8,
        line: Result<&str, BadLine>,
        ports: &mut [ServedPort],
        answer: &mut String,
    ) {
        let json = match line {
            Ok(line) => self.answer(client, line, ports),
            Err(BadLine::NotUtf8) => Response::error("the line is not UTF-8").json,
            Err(BadLine::TooLong) => {
                Response::error(&format!("a line has at most {MAX_CONTROL_LINE} bytes")).json
            }
        };
        answer.push_str(&json);
        answer.push('\n');
        self.happened();
    }

    fn control_ended(&mut self, client: u8) {
        self.watch(client, None);
    }

    fn next_report(&mut self) -> Option<Instant> {
        let Self { lab, watchers, .. } = self;
        let looks = watchers.iter().filter_map(|watcher| {
            if watcher.unseen {
                return Some(watcher.next);
            }
            Some(lab.next_look(&watcher.snapshot)?.max(watcher.next))
        });
        looks.min()
    }

    fn report(&mut self, client: u8, lines: &mut String) {
        let now = self.lab.now();
        let due = |watcher: &&mut Watcher| {
            watcher.client == client && watcher.unseen && watcher.next <= now
        };
        if let Some(watcher) = self.watchers.iter_mut().find(due) {
            watcher.unseen = false;
            watcher.next = now + watcher.pause;
            if let Some(changes) = self.lab.changes_since(&mut watcher.snapshot) {
                lines.push_str(&changes);
                lines.push('\n');
            }
        }
    }
}
