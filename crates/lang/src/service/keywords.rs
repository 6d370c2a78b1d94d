//! What the words of the language mean.

/// The meaning of a word of the operand with this name, one sentence.
pub(super) fn meaning(operand: &str, word: &str) -> Option<&'static str> {
    let (_, words) = MEANINGS.iter().find(|&&(name, _)| name == operand)?;
    words.iter().find(|&&(name, _)| name == word).map(|&(_, meaning)| meaning)
}

type Meanings = &'static [(&'static str, &'static str)];

const MEANINGS: &[(&str, Meanings)] = &[
    (
        "kind of move",
        &[
            ("ABS", "To a position, counted from the origin."),
            ("REL", "By a distance, counted from where the axis is."),
            ("COORD", "To a coordinate that SCO or CCO has stored, given by its number."),
        ],
    ),
    (
        "action",
        &[
            ("START", "Begins the reference search that axis parameter 193 chooses."),
            ("STOP", "Ends the reference search."),
            ("STATUS", "Asks how the reference search stands; 0 means that none is active."),
        ],
    ),
    (
        "condition",
        &[
            ("TICKS", "Until a time is over; the motor is of no importance."),
            ("POS", "Until the axis has reached its target position."),
            ("REFSW", "Until the reference switch is active."),
            ("LIMSW", "Until a limit switch is active."),
            ("RFS", "Until the reference search has ended."),
            ("ZE", "If the last result is zero."),
            ("NZ", "If the last result is not zero."),
            ("EQ", "If the last comparison found both equal."),
            ("NE", "If the last comparison found a difference."),
            ("GT", "If the accumulator was greater at the last comparison."),
            ("GE", "If the accumulator was greater or equal at the last comparison."),
            ("LT", "If the accumulator was less at the last comparison."),
            ("LE", "If the accumulator was less or equal at the last comparison."),
            ("ETO", "If the time-out flag is set: a WAIT took longer than it was allowed to."),
            ("EAL", "If the flag of the external alarm is set."),
            ("EDV", "If the deviation flag is set."),
            ("EPO", "If the flag of the position error is set."),
            ("ESD", "If the shutdown flag is set."),
        ],
    ),
    (
        "flag",
        &[
            ("ALL", "All error flags."),
            ("ETO", "The time-out flag, which WAIT sets."),
            ("EAL", "The flag of the external alarm."),
            ("EDV", "The deviation flag."),
            ("EPO", "The flag of the position error."),
            ("ESD", "The shutdown flag."),
        ],
    ),
    (
        "operation",
        &[
            ("ADD", "Adds the second value to the first."),
            ("SUB", "Takes the second value from the first."),
            ("MUL", "Multiplies the first value by the second."),
            ("DIV", "Divides the first value by the second."),
            ("MOD", "The remainder of the first value divided by the second."),
            ("AND", "Each bit that both values have."),
            ("OR", "Each bit that one of the values has, or both."),
            ("XOR", "Each bit that only one of the values has."),
            ("NOT", "Turns over each bit."),
            ("LOAD", "Copies the second value to the first; with CALCX the accumulator to X."),
            ("SWAP", "Exchanges the two values."),
            ("COMP", "Compares the first value with the second, for JC and CALL."),
        ],
    ),
];

#[cfg(test)]
mod tests {
    use opentmcl_wire::opcode::FORMS;

    use super::{MEANINGS, meaning};

    #[test]
    fn every_word_of_every_command_has_a_meaning_and_no_other_word_has() {
        let operands = || FORMS.iter().flat_map(|form| form.operands);
        for operand in operands() {
            for (word, _) in operand.words {
                let meaning = meaning(operand.name, word).unwrap_or_default();
                assert!(meaning.ends_with('.'), "{} {word}", operand.name);
            }
        }
        for (name, words) in MEANINGS {
            for (word, _) in *words {
                let has = |operand: &opentmcl_wire::opcode::Operand| {
                    operand.name == *name && operand.words.iter().any(|(other, _)| other == word)
                };
                assert!(operands().any(has), "{name} {word}");
            }
        }
    }
}
