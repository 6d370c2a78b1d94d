//! A virtual module behind a line on which chosen exchanges go wrong, in virtual time.

use std::collections::VecDeque;
use std::time::Duration;

use opentmcl_firmware::{Answer, Line, Port};
use opentmcl_link::{Connection, ConnectionError, DEFAULT_TIMEOUT};
use opentmcl_virtual::VirtualModule;
use opentmcl_wire::serial::{self, AddressedReply, Decoder, FRAME_LEN};
use opentmcl_wire::{Command, Instant, Reply, Status, control, mnemonic};

/// What happens to one exchange.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fault {
    RequestLost,
    /// One byte of the request, inverted in these bits.
    RequestGarbled(usize, u8),
    /// Only the first bytes of the request arrive.
    RequestTruncated(usize),
    StrayBeforeRequest(u8),
    ReplyLost,
    ReplyGarbled(usize, u8),
    ReplyTruncated(usize),
    StrayBeforeReply(u8),
    /// The reply comes so much later.
    ReplyLate(Duration),
    /// The module is switched off and on before the request.
    PowerCycle,
    /// Another host starts a download at address 15 before the request.
    OtherHost,
}

/// One fault of each kind; of those that concern a byte, at the beginning, in the middle and at the
/// end.
pub(crate) const FAULTS: [Fault; 23] = [
    Fault::RequestLost,
    Fault::RequestGarbled(0, 0x02),
    Fault::RequestGarbled(1, 0x80),
    Fault::RequestGarbled(3, 0x01),
    Fault::RequestGarbled(7, 0xFF),
    Fault::RequestGarbled(8, 0x10),
    Fault::RequestTruncated(1),
    Fault::RequestTruncated(8),
    Fault::StrayBeforeRequest(0x00),
    Fault::StrayBeforeRequest(0x01),
    Fault::StrayBeforeRequest(0xFE),
    Fault::ReplyLost,
    Fault::ReplyGarbled(1, 0x04),
    Fault::ReplyGarbled(2, 0x01),
    Fault::ReplyGarbled(8, 0x80),
    Fault::ReplyTruncated(1),
    Fault::ReplyTruncated(8),
    Fault::StrayBeforeReply(0x00),
    Fault::StrayBeforeReply(0x02),
    Fault::StrayBeforeReply(0xFF),
    // While the line is expected to fall silent; with the reply to the next request; long after.
    Fault::ReplyLate(Duration::from_millis(1_020)),
    Fault::ReplyLate(Duration::from_millis(1_050)),
    Fault::ReplyLate(Duration::from_millis(1_500)),
];

/// The module, the line and its plan of faults.
pub(crate) struct FaultyLine {
    pub(crate) module: VirtualModule,
    port: Port,
    decoder: Decoder,
    /// Replies on their way, in their order, each with the time of its arrival.
    underway: VecDeque<(Instant, Vec<u8>)>,
    arrived: VecDeque<u8>,
    /// Faults by number of the exchange, from 0.
    plan: Vec<(usize, Fault)>,
    /// Exchanges so far.
    pub(crate) exchanges: usize,
    /// Whether the reply to a stored command returns its value.
    pub(crate) echoes: bool,
    dead: bool,
}

impl FaultyLine {
    /// A new module, addresses checked as on RS485.
    pub(crate) fn new() -> Self {
        Self::with_plan(&[])
    }

    pub(crate) fn with_plan(plan: &[(usize, Fault)]) -> Self {
        Self::of_kind(Line::Rs485, plan)
    }

    pub(crate) fn of_kind(line: Line, plan: &[(usize, Fault)]) -> Self {
        Self {
            module: VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap()),
            port: Port::new(line),
            decoder: Decoder::new(),
            underway: VecDeque::new(),
            arrived: VecDeque::new(),
            plan: plan.to_vec(),
            exchanges: 0,
            echoes: true,
            dead: false,
        }
    }

    /// From now on nothing passes.
    pub(crate) fn cut(&mut self) {
        self.dead = true;
    }

    /// Lets bytes arrive that nobody has asked for.
    pub(crate) fn arrive(&mut self, bytes: &[u8]) {
        self.arrived.extend(bytes);
    }

    /// Milliseconds since the beginning.
    pub(crate) fn millis(&self) -> u64 {
        self.module.now().duration_since_epoch().as_millis()
    }

    /// Executes commands on the module itself, past the line.
    pub(crate) fn execute(&mut self, commands: &[&str]) -> i32 {
        let replies = commands.iter().map(|text| {
            let reply = self.module.execute(mnemonic::parse(text).unwrap());
            assert_eq!(reply.status, Status::OK, "{text}");
            reply.value
        });
        replies.last().unwrap()
    }

    /// Fills program memory, past the line.
    pub(crate) fn store(&mut self, commands: &[Command]) {
        self.execute(&["132 0, 0, 0"]);
        for &command in commands {
            assert_eq!(self.module.execute(command).status, Status::LOADED);
        }
        self.execute(&["133 0, 0, 0"]);
    }

    /// The first commands in program memory, read past the line.
    pub(crate) fn memory(&mut self, len: i32) -> Vec<Command> {
        let read = |address| match self.module.execute_direct(Command::new(
            control::READ_PROGRAM,
            0,
            0,
            address,
        )) {
            Answer::Memory(command) => command,
            other => panic!("{other:?}"),
        };
        (0..len).map(read).collect()
    }

    fn fault(&self) -> Option<Fault> {
        let planned = self.plan.iter().find(|(exchange, _)| *exchange + 1 == self.exchanges);
        planned.map(|&(_, fault)| fault)
    }

    fn reply(&mut self, frame: [u8; FRAME_LEN]) {
        let mut bytes = self.without_echo(frame).to_vec();
        let mut due = self.module.now();
        match self.fault() {
            Some(Fault::ReplyLost) => return,
            Some(Fault::ReplyGarbled(at, bits)) => bytes[at] ^= bits,
            Some(Fault::ReplyTruncated(len)) => bytes.truncate(len),
            Some(Fault::StrayBeforeReply(stray)) => bytes.insert(0, stray),
            Some(Fault::ReplyLate(delay)) => due += micros(delay),
            _ => {}
        }
        // A line does not change the order.
        let earliest = self.underway.back().map_or(due, |&(last, _)| last);
        self.underway.push_back((due.max(earliest), bytes));
    }

    fn without_echo(&self, frame: [u8; FRAME_LEN]) -> [u8; FRAME_LEN] {
        match serial::decode_reply(frame) {
            Ok(AddressedReply { host, module, reply })
                if !self.echoes && reply.status == Status::LOADED =>
            {
                serial::encode_reply(host, module, Reply { value: 0, ..reply })
            }
            _ => frame,
        }
    }

    fn take_what_has_come(&mut self) {
        while let Some((_, content)) = self.module.transmit() {
            self.reply(content.frame().expect("a module in binary mode"));
        }
        while self.underway.front().is_some_and(|(due, _)| *due <= self.module.now()) {
            self.arrived.extend(self.underway.pop_front().unwrap().1);
        }
    }
}

fn micros(duration: Duration) -> opentmcl_wire::Duration {
    opentmcl_wire::Duration::from_micros(duration.as_micros().try_into().unwrap())
}

impl Connection for FaultyLine {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        self.exchanges += 1;
        let mut bytes = bytes.to_vec();
        match self.fault() {
            Some(Fault::RequestLost) => bytes.clear(),
            Some(Fault::RequestGarbled(at, bits)) => bytes[at] ^= bits,
            Some(Fault::RequestTruncated(len)) => bytes.truncate(len),
            Some(Fault::StrayBeforeRequest(stray)) => bytes.insert(0, stray),
            Some(Fault::PowerCycle) => self.module.power_cycle(),
            Some(Fault::OtherHost) => drop(self.execute(&["132 0, 0, 15"])),
            _ => {}
        }
        if self.dead {
            return Ok(());
        }
        for byte in bytes {
            if let Some(request) = self.decoder.push(byte, self.module.now()) {
                self.module.receive(self.port, request);
            }
        }
        // What it answers at once belongs to this exchange, whenever it is received.
        self.take_what_has_come();
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError> {
        let end = self.module.now() + micros(timeout);
        loop {
            self.take_what_has_come();
            if self.arrived.len() >= FRAME_LEN {
                let mut frame = [0; FRAME_LEN];
                frame.fill_with(|| self.arrived.pop_front().unwrap());
                return Ok(Some(frame));
            }
            if self.module.now() >= end {
                let part = self.arrived.drain(..).count();
                return if part == 0 { Ok(None) } else { Err(ConnectionError::Fragment(part)) };
            }
            let next = self.underway.front().map(|&(due, _)| due);
            let next = next.into_iter().chain(self.module.next_event()).min();
            self.module.advance_to(next.map_or(end, |next| next.min(end)));
        }
    }

    fn discard(&mut self) -> Result<(), ConnectionError> {
        self.take_what_has_come();
        self.arrived.clear();
        Ok(())
    }

    fn timeout(&self) -> Duration {
        DEFAULT_TIMEOUT
    }
}
