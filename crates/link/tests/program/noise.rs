//! Whatever comes back, nothing is asked for ever.

use std::time::Duration;

use opentmcl_link::program::Programmer;
use opentmcl_link::{Connection, ConnectionError};
use opentmcl_wire::serial::{FRAME_LEN, checksum};
use opentmcl_wire::{Command, control};
use proptest::prelude::*;

/// Answers to anything with the next of these, over and over, and sometimes with nothing.
struct Noise {
    answers: Vec<Option<[u8; FRAME_LEN]>>,
    next: usize,
    requests: usize,
    receptions: usize,
}

impl Connection for Noise {
    fn send(&mut self, _: &[u8]) -> Result<(), ConnectionError> {
        self.requests += 1;
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError> {
        self.receptions += 1;
        self.next = (self.next + 1) % self.answers.len();
        Ok(self.answers[self.next])
    }

    fn discard(&mut self) -> Result<(), ConnectionError> {
        Ok(())
    }

    fn timeout(&self) -> Duration {
        Duration::from_secs(1)
    }
}

/// Nine bytes that look like a reply in most respects: so do they get far.
fn answer() -> impl Strategy<Value = Option<[u8; FRAME_LEN]>> {
    let number = prop_oneof![Just(0), Just(1), Just(28), control::FIRST..=136, any::<u8>()];
    let status = prop_oneof![3 => Just(100), 3 => Just(101), 1 => 0..6_u8, 1 => any::<u8>()];
    let module = prop_oneof![5 => Just(1), 1 => any::<u8>()];
    let damage = prop_oneof![9 => Just(0), 1 => any::<u8>()];
    let frame = (module, status, number, 0..4_u8, damage).prop_map(
        |(module, status, number, value, damage)| {
            let bytes = [2, module, status, number, 0, 0, 0, value];
            let [a, b, c, d, e, f, g, h] = bytes;
            [a, b, c, d, e, f, g, h, checksum(&bytes) ^ damage]
        },
    );
    prop_oneof![1 => Just(None), 6 => frame.prop_map(Some)]
}

proptest! {
    #[test]
    fn any_replies_end_any_operation(answers in prop::collection::vec(answer(), 1..12)) {
        let mut line = Noise { answers, next: 0, requests: 0, receptions: 0 };
        let program = [Command::new(1, 0, 0, 1), Command::new(28, 0, 0, 0)];
        if let Ok(mut host) = Programmer::open(&mut line, 1, 4) {
            // Whether they succeed is left to chance.
            let _ = host.protection();
            let _ = host.download(&program, &mut |_| {});
            let _ = host.verify(&program, &mut |_| {});
            let _ = host.read(&mut |_| {});
            let _ = host.run(Some(1));
            let _ = host.step();
            let _ = host.registers();
        }
        // Some thirty steps, of three attempts with at most five requests each.
        prop_assert!(line.requests < 450, "{} requests", line.requests);
        prop_assert!(line.receptions < 50 * line.requests, "{} receptions", line.receptions);
    }
}
