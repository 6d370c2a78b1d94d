//! What `expect` and `wait until` do.

use opentmcl_wire::{Duration, Status, serial};

use super::{Runner, describe};
use crate::target::TargetError;
use crate::transcript::{Condition, DEFAULT_ADDRESS};

/// Why a condition does not hold.
struct Unmet {
    /// The value in words, or the reply that has none.
    got: String,
    /// Whether the module does not say.
    refused: bool,
}

impl Runner<'_> {
    pub(super) fn expect(&mut self, line: usize, condition: &Condition) -> Result<(), TargetError> {
        self.outcome.expectations += 1;
        if let Some(unmet) = self.look(condition)? {
            let command = format!("expect {}", condition.text);
            self.fail(line, &command, &condition.expected, unmet.got);
        }
        Ok(())
    }

    /// Looks again and again until all conditions hold at once, the time is over or the module
    /// refuses to say.
    pub(super) fn wait_until(
        &mut self,
        line: usize,
        text: &str,
        conditions: &[Condition],
        at_most: Duration,
    ) -> Result<(), TargetError> {
        self.outcome.expectations += 1;
        let end = self.target.moment().time + at_most;
        while let Some((condition, unmet)) = self.first_unmet(conditions)? {
            let left = end.checked_sub(self.target.moment().time);
            match left.filter(|left| !unmet.refused && left.as_ticks() > 0) {
                Some(left) => self.target.pause(left)?,
                None => {
                    let expected = format!("{} within {}", condition.text, in_words(at_most));
                    self.fail(line, text, expected, unmet.got);
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// The first condition that does not hold, and why.
    fn first_unmet<'c>(
        &mut self,
        conditions: &'c [Condition],
    ) -> Result<Option<(&'c Condition, Unmet)>, TargetError> {
        for condition in conditions {
            if let Some(unmet) = self.look(condition)? {
                return Ok(Some((condition, unmet)));
            }
        }
        Ok(None)
    }

    /// Asks, and says why the condition does not hold; nothing if it does.
    fn look(&mut self, condition: &Condition) -> Result<Option<Unmet>, TargetError> {
        let command = condition.command;
        let frame = self.ask(serial::encode_request(DEFAULT_ADDRESS, command))?;
        let reply = frame.and_then(|frame| serial::decode_reply(frame).ok());
        let value = reply
            .map(|answer| answer.reply)
            .filter(|reply| reply.status == Status::OK && reply.number == command.number);
        Ok(match value.map(|reply| reply.value) {
            Some(value) if condition.is_met(value) => None,
            Some(value) => Some(Unmet { got: condition.meaning.describe(value), refused: false }),
            None => Some(Unmet { got: describe(frame), refused: true }),
        })
    }
}

/// A time in the unit in which it is a small number.
pub(super) fn in_words(time: Duration) -> String {
    let micros = time.as_micros();
    match micros {
        _ if micros % 1_000_000 == 0 => format!("{} s", micros / 1_000_000),
        _ if micros % 1000 == 0 => format!("{} ms", micros / 1000),
        _ => format!("{micros} us"),
    }
}
