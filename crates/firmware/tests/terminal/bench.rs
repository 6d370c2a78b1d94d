//! A TMCM-6110 whose chips are memory: nothing moves, and an axis is where its position register says.

use opentmcl_catalog::TMCM_6110;
use opentmcl_firmware::{Analog, Answer, Board, Config, Line, Module, Port};
use opentmcl_wire::serial::{self, encode_request};
use opentmcl_wire::{Command, Instant, Outgoing, Reply, Status, control, mnemonic};

use crate::flash::Flash;

pub(crate) const USB: Port = Port::new(Line::Usb);
pub(crate) const RS232: Port = Port::new(Line::Rs232);
pub(crate) const RS485: Port = Port::new(Line::Rs485);
pub(crate) const MILLISECOND: u64 = 16_000;

pub(crate) const ASCII: Command = Command::new(control::ASCII_MODE, 0, 0, 0);
pub(crate) const PING: Command = Command::new(9, 0, 2, 77);

pub(crate) fn ok(command: Command) -> Option<Reply> {
    Some(Reply { status: Status::OK, number: command.number, value: command.value })
}

/// Registers that keep what is written to them.
pub(crate) struct Memory {
    registers: [[u32; 128]; 6],
    flash: Flash,
}

impl Board for Memory {
    type Flash = Flash;

    fn set_time(&mut self, _: Instant) {}
    fn next_event(&mut self) -> Option<Instant> {
        None
    }
    fn read_register(&mut self, axis: u8, address: u8) -> u32 {
        self.registers[usize::from(axis)][usize::from(address)]
    }
    fn write_register(&mut self, axis: u8, address: u8, value: u32) {
        self.registers[usize::from(axis)][usize::from(address)] = value;
    }
    fn digital_inputs(&mut self) -> u8 {
        0
    }
    fn home_switch(&mut self, _: u8) -> bool {
        false
    }
    fn torque_inputs(&mut self) -> u8 {
        3
    }
    fn analog(&mut self, channel: Analog) -> i32 {
        // 24 V, without which programs do not start.
        if channel == Analog::SupplyVoltage { 240 } else { 0 }
    }
    fn set_analog_range(&mut self, _: u8, _: u8) {}
    fn set_digital_outputs(&mut self, _: u8) {}
    fn set_pull_ups(&mut self, _: u8) {}
    fn flash(&mut self) -> &mut Flash {
        &mut self.flash
    }
    fn reset(&mut self) {
        self.registers = [[0; 128]; 6];
    }
}

/// A module and the time.
pub(crate) struct Bench {
    pub(crate) module: Module<Memory>,
    pub(crate) now: Instant,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::of(&TMCM_6110)
    }

    pub(crate) fn of(model: &'static opentmcl_catalog::Module) -> Self {
        let (now, registers) = (Instant::from_ticks(0), [[0; 128]; 6]);
        let board = Memory { registers, flash: Flash::new() };
        Self { module: Module::power_up(model, board, Config::default(), now), now }
    }

    /// A module that has been switched to ASCII mode by this port, echoing nothing.
    pub(crate) fn silent(port: Port) -> Self {
        let mut bench = Self::new();
        bench.execute("SGP 67, 0, 32");
        bench.enter(port);
        bench
    }

    /// Executes a command without a line.
    pub(crate) fn execute(&mut self, command: &str) -> i32 {
        match self.module.execute_direct(mnemonic::parse(command).unwrap(), self.now) {
            Answer::Reply(reply) if reply.status.is_ok() => reply.value,
            other => panic!("{command}: {other:?}"),
        }
    }

    pub(crate) fn send(&mut self, port: Port, command: Command) {
        let request = serial::decode_request(encode_request(1, command));
        self.module.receive(port, request, self.now);
    }

    /// The frame that answers a frame, at once; nothing else comes.
    #[track_caller]
    pub(crate) fn ask(&mut self, port: Port, command: Command) -> Option<Reply> {
        self.send(port, command);
        let sent = self.module.transmit(self.now);
        assert_eq!(self.module.transmit(self.now), None);
        sent.map(|(by, content)| {
            assert_eq!(by, port);
            let frame = content.frame().expect("text");
            serial::decode_reply(frame).unwrap().reply
        })
    }

    #[track_caller]
    pub(crate) fn enter(&mut self, port: Port) {
        let pause = self.execute("GGP 75, 0");
        self.execute("SGP 75, 0, 0");
        assert_eq!(self.ask(port, ASCII).unwrap().status, Status::OK);
        self.execute(&format!("SGP 75, 0, {pause}"));
        assert!(self.module.is_in_ascii_mode(port));
    }

    /// The text that comes at once when this is typed.
    #[track_caller]
    pub(crate) fn type_in(&mut self, port: Port, keys: impl AsRef<[u8]>) -> String {
        let mut shown = String::new();
        for &key in keys.as_ref() {
            self.module.receive_key(port, key, self.now);
            shown.push_str(&self.shown(port));
        }
        shown
    }

    /// The text that is due for a port; nothing is due for another.
    #[track_caller]
    pub(crate) fn shown(&mut self, port: Port) -> String {
        let mut text = Vec::new();
        while let Some((by, content)) = self.module.transmit(self.now) {
            assert_eq!(by, port);
            assert!(matches!(content, Outgoing::Text(_)), "{content:?}");
            text.extend_from_slice(content.as_bytes());
        }
        String::from_utf8(text).unwrap()
    }

    pub(crate) fn wait_ms(&mut self, time: u64) {
        self.now = Instant::from_ticks(self.now.as_ticks() + time * MILLISECOND);
        self.module.poll(self.now);
    }
}
