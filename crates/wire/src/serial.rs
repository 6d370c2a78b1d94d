//! The 9-byte frame of USB, RS485, RS232 and TCP (firmware manual 3.1, 3.2).

use crate::{Command, Duration, Instant, Reply, Status};

/// Length of a request and of a reply in bytes.
pub const FRAME_LEN: usize = 9;

/// A longer silence inside a frame makes the receiver forget what came before it.
///
/// Source: the vendor's open firmware.
pub const BYTE_TIMEOUT: Duration = Duration::from_millis(5);

/// The 8-bit sum that ends a frame.
pub const fn checksum(bytes: &[u8; FRAME_LEN - 1]) -> u8 {
    let mut sum = 0u8;
    let mut at = 0;
    while at < bytes.len() {
        sum = sum.wrapping_add(bytes[at]);
        at += 1;
    }
    sum
}

const fn sealed(bytes: [u8; FRAME_LEN - 1]) -> [u8; FRAME_LEN] {
    let [a, b, c, d, e, f, g, h] = bytes;
    [a, b, c, d, e, f, g, h, checksum(&bytes)]
}

/// A request as it is sent to the module with this address.
pub const fn encode_request(address: u8, command: Command) -> [u8; FRAME_LEN] {
    let [number, kind, motor, b3, b2, b1, b0] = command.to_bytes();
    sealed([address, number, kind, motor, b3, b2, b1, b0])
}

/// A reply as the module sends it to the host.
pub const fn encode_reply(host: u8, module: u8, reply: Reply) -> [u8; FRAME_LEN] {
    let [b3, b2, b1, b0] = reply.value.to_be_bytes();
    sealed([host, module, reply.status.0, reply.number, b3, b2, b1, b0])
}

/// A request that has arrived with a correct checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Address of the module that is meant.
    pub address: u8,
    /// What it shall do.
    pub command: Command,
}

/// Nine bytes whose last is not the sum of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongChecksum {
    /// Address byte of the damaged frame, which may itself be damaged.
    pub address: u8,
}

/// Reads nine bytes as a request.
pub const fn decode_request(frame: [u8; FRAME_LEN]) -> Result<Request, WrongChecksum> {
    let [address, number, kind, motor, b3, b2, b1, b0, sum] = frame;
    if checksum(&[address, number, kind, motor, b3, b2, b1, b0]) != sum {
        return Err(WrongChecksum { address });
    }
    let command = Command::from_bytes([number, kind, motor, b3, b2, b1, b0]);
    Ok(Request { address, command })
}

/// A reply with the addresses it carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AddressedReply {
    /// Address of the host.
    pub host: u8,
    /// Address of the module that answers.
    pub module: u8,
    /// The answer.
    pub reply: Reply,
}

/// Reads nine bytes as a reply.
pub const fn decode_reply(frame: [u8; FRAME_LEN]) -> Result<AddressedReply, WrongChecksum> {
    let [host, module, status, number, b3, b2, b1, b0, sum] = frame;
    if checksum(&[host, module, status, number, b3, b2, b1, b0]) != sum {
        return Err(WrongChecksum { address: host });
    }
    let value = i32::from_be_bytes([b3, b2, b1, b0]);
    Ok(AddressedReply { host, module, reply: Reply { status: Status(status), number, value } })
}

/// Cuts a stream of bytes into requests, as a module's receiver does.
///
/// Any bytes may come. Every ninth byte completes a frame, good or damaged; a silence of more than
/// [`BYTE_TIMEOUT`] drops a frame that has begun, so a lost or an added byte costs one frame and not
/// the step.
///
/// ```
/// use opentmcl_wire::{serial::{Decoder, encode_request}, Command, Instant};
///
/// let mut decoder = Decoder::new();
/// let now = Instant::from_ticks(0);
/// let frame = encode_request(1, Command::new(6, 1, 0, 0));
/// let requests: Vec<_> = frame.iter().filter_map(|&byte| decoder.push(byte, now)).collect();
/// assert_eq!(requests[0].unwrap().command.number, 6);
/// ```
#[derive(Clone, Debug)]
pub struct Decoder {
    frame: [u8; FRAME_LEN],
    len: usize,
    last_byte_at: Instant,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder that waits for the first byte of a frame.
    pub const fn new() -> Self {
        Self { frame: [0; FRAME_LEN], len: 0, last_byte_at: Instant::from_ticks(0) }
    }

    /// Takes the byte that arrived at `now`; yields a request when it completes one.
    pub fn push(&mut self, byte: u8, now: Instant) -> Option<Result<Request, WrongChecksum>> {
        let silence = now.checked_duration_since(self.last_byte_at);
        if silence.is_some_and(|silence| silence > BYTE_TIMEOUT) {
            self.len = 0;
        }
        self.last_byte_at = now;
        if let Some(place) = self.frame.get_mut(self.len) {
            *place = byte;
        }
        self.len += 1;
        if self.len < FRAME_LEN {
            return None;
        }
        self.len = 0;
        Some(decode_request(self.frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const ROR: [u8; 9] = [0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0xC8, 0x00, 0xCA];

    fn at(micros: u64) -> Instant {
        Instant::from_ticks(micros * 16)
    }

    fn decode(stream: &[(u64, &[u8])]) -> Vec<Result<Request, WrongChecksum>> {
        let mut decoder = Decoder::new();
        let mut found = Vec::new();
        for (micros, bytes) in stream {
            found.extend(bytes.iter().filter_map(|&byte| decoder.push(byte, at(*micros))));
        }
        found
    }

    #[test]
    fn the_manuals_first_example_is_encoded_byte_for_byte() {
        assert_eq!(encode_request(1, Command::new(1, 0, 0, 51200)), ROR);
    }

    #[test]
    fn the_manuals_example_of_a_reply_is_encoded_and_read() {
        // Firmware manual 3.6.13: GIO 0, 1 answers 302.
        let frame = [0x02, 0x01, 0x64, 0x0F, 0x00, 0x00, 0x01, 0x2E, 0xA5];
        let reply = Reply { status: Status::OK, number: 15, value: 302 };
        assert_eq!(encode_reply(2, 1, reply), frame);
        assert_eq!(decode_reply(frame), Ok(AddressedReply { host: 2, module: 1, reply }));
    }

    #[test]
    fn a_frame_may_come_in_pieces() {
        let found = decode(&[(0, &ROR[..4]), (4_000, &ROR[4..8]), (9_000, &ROR[8..])]);
        assert_eq!(found, [Ok(Request { address: 1, command: Command::new(1, 0, 0, 51200) })]);
    }

    #[test]
    fn a_partial_frame_is_dropped_after_more_than_five_milliseconds() {
        let found = decode(&[(0, &ROR[..7]), (5_001, &ROR)]);
        assert_eq!(found.len(), 1);
        assert!(found[0].is_ok());
    }

    #[test]
    fn a_silence_of_exactly_five_milliseconds_is_still_the_same_frame() {
        assert!(decode(&[(0, &ROR[..7]), (5_000, &ROR[7..])])[0].is_ok());
    }

    #[test]
    fn a_stray_byte_costs_one_frame() {
        let mut stray = Vec::from([0x55]);
        stray.extend(ROR);
        let found = decode(&[(0, &stray), (20_000, &ROR), (40_000, &ROR)]);
        assert_eq!(found.iter().map(Result::is_ok).collect::<Vec<_>>(), [false, true, true]);
    }

    #[test]
    fn a_damaged_frame_names_its_address_and_the_next_one_is_read() {
        let mut damaged = ROR;
        damaged[8] ^= 1;
        let found = decode(&[(0, &damaged), (0, &ROR)]);
        assert_eq!(found[0], Err(WrongChecksum { address: 1 }));
        assert!(found[1].is_ok());
    }
}
