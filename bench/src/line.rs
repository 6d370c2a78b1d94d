//! Requests: in process, through the frames, and garbage.

use std::hint::black_box;
use std::time::{Duration, Instant as Wall};

use opentmcl_firmware::{Line, Port};
use opentmcl_virtual::VirtualModule;
use opentmcl_wire::serial::{BYTE_TIMEOUT, Decoder, Request, encode_request};
use opentmcl_wire::{Command, Instant, Opcode, Outgoing};

use crate::{Measured, program, seconds_per_call};

const ROUND: Duration = Duration::from_millis(300);
const BATCH: u32 = 1000;
const ADDRESS: u8 = 1;

fn gap_position(axis: u8) -> Command {
    Command::new(Opcode::Gap.number(), 1, axis, 0)
}

/// GAP 1 requests per second on a module that moves all six axes, without a line.
pub(crate) fn gap_in_process() -> Measured {
    let mut module = program::moving_module();
    let batch = seconds_per_call(ROUND, || {
        for request in 0..BATCH {
            let reply = module.execute(black_box(gap_position((request % 6) as u8)));
            assert!(black_box(reply).status.is_ok());
        }
    });
    Measured::new(f64::from(BATCH) / batch)
}

/// Microseconds from the bytes of a request to the bytes of its reply, while time goes on by what a
/// client on a pty needs between two requests.
pub(crate) fn own_work_per_request() -> Measured {
    const BETWEEN_REQUESTS: opentmcl_wire::Duration = opentmcl_wire::Duration::from_micros(50);
    let port = Port { line: Line::Usb, number: 0 };
    let mut module = program::moving_module();
    let mut decoder = Decoder::new();
    let batch = seconds_per_call(ROUND, || {
        for request in 0..BATCH {
            module.advance(BETWEEN_REQUESTS);
            let now = module.now();
            for byte in black_box(encode_request(ADDRESS, gap_position((request % 6) as u8))) {
                if let Some(request) = decoder.push(byte, now) {
                    module.receive(port, request);
                }
            }
            let reply = answer(&mut module);
            assert_eq!(black_box(reply).as_bytes()[2], 100);
        }
    });
    Measured::new(batch / f64::from(BATCH) * 1e6)
}

fn answer(module: &mut VirtualModule) -> Outgoing {
    loop {
        if let Some((_, reply)) = module.transmit() {
            return reply;
        }
        let due = module.next_event().expect("a request is answered");
        module.advance_to(due);
    }
}

/// Bytes of noise fed to the decoder; after each burst and a silence a good frame must be read.
pub(crate) fn garbage() -> Measured {
    const BYTES: u64 = 1_000_000_000;
    const LONGEST_BURST: u64 = 4096;
    let command = gap_position(0);
    let frame = encode_request(ADDRESS, command);
    let mut decoder = Decoder::new();
    let mut random = 0x9E37_79B9_7F4A_7C15u64;
    let mut now = Instant::from_ticks(0);
    let mut fed = 0;
    let mut frames = 0u64;
    let start = Wall::now();
    while fed < BYTES {
        let burst = (next(&mut random) % LONGEST_BURST).min(BYTES - fed);
        for _ in 0..burst.div_ceil(8) {
            for byte in next(&mut random).to_le_bytes() {
                frames += u64::from(decoder.push(byte, now).is_some());
            }
        }
        fed += burst.next_multiple_of(8);
        now = Instant::from_ticks(now.as_ticks() + BYTE_TIMEOUT.as_ticks() + 1);
        let found = frame.iter().find_map(|&byte| decoder.push(byte, now));
        assert_eq!(found, Some(Ok(Request { address: ADDRESS, command })), "lost step");
    }
    let rate = fed as f64 / start.elapsed().as_secs_f64() / 1e6;
    let note = format!("{rate:.0} million bytes per second, {frames} frames cut");
    Measured { value: fed as f64, note }
}

/// xorshift64: noise that is the same in every run.
fn next(random: &mut u64) -> u64 {
    *random ^= *random << 13;
    *random ^= *random >> 7;
    *random ^= *random << 17;
    *random
}
