//! Any bytes with any gaps into the stream decoder: frames come out exactly where the rule says, and
//! whatever came before, a good frame after a silence is read.
//!
//! Input: the address and command of the good frame (8 bytes), then pairs of a gap and a byte.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_wire::serial::{BYTE_TIMEOUT, Decoder, FRAME_LEN, Request, encode_request};
use opentmcl_wire::{Command, Instant};

/// Unit of the gaps: 125 of them are still no silence, 126 are one.
const GAP_TICKS: u64 = BYTE_TIMEOUT.as_ticks() / 125;

fuzz_target!(|input: &[u8]| {
    let Some((&[address, ref command @ ..], noise)) = input.split_first_chunk::<8>() else {
        return;
    };
    let mut now = Instant::from_ticks(0);
    let mut decoder = Decoder::new();
    let mut expected_len = 0;
    for &[gap, byte] in noise.as_chunks::<2>().0 {
        let silence = u64::from(gap) * GAP_TICKS;
        now = Instant::from_ticks(now.as_ticks() + silence);
        if silence > BYTE_TIMEOUT.as_ticks() {
            expected_len = 0;
        }
        expected_len += 1;
        let complete = decoder.push(byte, now).is_some();
        assert_eq!(complete, expected_len == FRAME_LEN);
        expected_len %= FRAME_LEN;
    }

    now = Instant::from_ticks(now.as_ticks() + BYTE_TIMEOUT.as_ticks() + 1);
    let command = Command::from_bytes(*command);
    let mut found = None;
    for byte in encode_request(address, command) {
        assert_eq!(found, None, "complete before its last byte");
        found = decoder.push(byte, now);
    }
    assert_eq!(found, Some(Ok(Request { address, command })));
});
