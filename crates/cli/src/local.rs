//! A virtual module inside this program, as a connection.

use std::time::Duration;

use opentmcl_firmware::{Line, Port};
use opentmcl_link::{Connection, ConnectionError, DEFAULT_TIMEOUT};
use opentmcl_virtual::{MemoryFlash, ModuleSetup, Options, VirtualModule};
use opentmcl_wire::Instant;
use opentmcl_wire::serial::{Decoder, FRAME_LEN};

const PORT: Port = Port { line: Line::Usb, number: 0 };

/// A module that was just switched on. Its time stands still except while a reply is awaited.
pub(crate) struct LocalModule {
    module: VirtualModule,
    decoder: Decoder,
}

impl LocalModule {
    /// A new module as it leaves the factory, with what is around it.
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        let module = VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default());
        Self { module, decoder: Decoder::new() }
    }

    /// Its time.
    pub(crate) fn now(&self) -> Instant {
        self.module.now()
    }

    /// Lets time pass.
    pub(crate) fn advance(&mut self, by: opentmcl_wire::Duration) {
        self.module.advance(by);
    }
}

impl Connection for LocalModule {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        for &byte in bytes {
            if self.module.is_in_ascii_mode(PORT) {
                self.module.receive_key(PORT, byte);
            } else if let Some(request) = self.decoder.push(byte, self.module.now()) {
                self.module.receive(PORT, request);
            }
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError> {
        let micros = u64::try_from(timeout.as_micros()).unwrap_or(u64::MAX);
        let end = self.module.now() + opentmcl_wire::Duration::from_micros(micros);
        loop {
            if let Some((_, content)) = self.module.transmit() {
                // Who speaks in frames has no use for text.
                let Some(frame) = content.frame() else { continue };
                return Ok(Some(frame));
            }
            match self.module.next_event() {
                Some(event) if event <= end => self.module.advance_to(event),
                _ => {
                    self.module.advance_to(end);
                    return Ok(None);
                }
            }
        }
    }

    fn discard(&mut self) -> Result<(), ConnectionError> {
        while self.module.transmit().is_some() {}
        Ok(())
    }

    fn timeout(&self) -> Duration {
        DEFAULT_TIMEOUT
    }
}
