//! Mnemonics: from a name to the form of the command, fast enough for the inner loop of the
//! assembler.

use opentmcl_wire::opcode::{FORMS, Form};

use crate::suggest::nearest;

/// The longest mnemonic that fits a key.
const MAX_LEN: usize = 8;

/// Twice as many places as forms, so that a search is over after a step or two.
const PLACES: usize = 256;

/// The form of the command with this name, in any case.
pub fn find(name: &str) -> Option<&'static Form> {
    let key = key(name.as_bytes())?;
    let mut place = place(key);
    loop {
        let (known, form) = TABLE[place];
        if known == key {
            return FORMS.get(usize::from(form));
        }
        if known == 0 {
            return None;
        }
        place = (place + 1) % PLACES;
    }
}

/// What was probably meant by a mnemonic that does not exist: names from other assemblers, then the
/// nearest one.
pub(crate) fn probably(name: &str) -> Option<&'static str> {
    const HABITS: &[(&str, &str)] = &[
        ("RET", "RSUB"),
        ("RETURN", "RSUB"),
        ("RTS", "RSUB"),
        ("IRET", "RETI"),
        ("GOSUB", "CSUB"),
        ("JSR", "CSUB"),
        ("GOTO", "JA"),
        ("JMP", "JA"),
        ("JUMP", "JA"),
        ("CMP", "COMP"),
        ("END", "STOP"),
        ("HALT", "STOP"),
        ("DELAY", "WAIT"),
        ("SLEEP", "WAIT"),
        ("MOVE", "MVP"),
        ("HOME", "RFS"),
    ];
    let habit = HABITS.iter().find(|(other, _)| other.eq_ignore_ascii_case(name));
    match habit {
        Some(&(_, ours)) => Some(ours),
        None => nearest(name, FORMS.iter().map(|form| form.mnemonic)),
    }
}

/// The letters in upper case as a number; none is 0.
const fn key(name: &[u8]) -> Option<u64> {
    if name.is_empty() || name.len() > MAX_LEN {
        return None;
    }
    let mut key = 0;
    let mut at = 0;
    while at < name.len() {
        key = key << 8 | name[at].to_ascii_uppercase() as u64;
        at += 1;
    }
    Some(key)
}

const fn place(key: u64) -> usize {
    // Multiplicative hashing: the upper bits of the product depend on all letters.
    (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as usize % PLACES
}

static TABLE: [(u64, u8); PLACES] = table();

const fn table() -> [(u64, u8); PLACES] {
    let mut table = [(0, 0); PLACES];
    let mut form = 0;
    while form < FORMS.len() {
        let Some(key) = key(FORMS[form].mnemonic.as_bytes()) else { panic!("too long a mnemonic") };
        let mut place = place(key);
        while table[place].0 != 0 {
            place = (place + 1) % PLACES;
        }
        table[place] = (key, form as u8);
        form += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mnemonic_is_found_in_any_case_and_nothing_else() {
        for form in FORMS {
            assert_eq!(find(form.mnemonic), Some(form));
            assert_eq!(find(&form.mnemonic.to_lowercase()), Some(form));
        }
        // Neither what ends nor what begins as one does, even where a key would hold no more letters.
        for name in ["", "RET", "CALCVVV", "CALCULATE", "ABCDEMST", "ABCDEFGHIMST", "M\u{FC}P"] {
            assert_eq!(find(name), None, "{name}");
        }
    }

    #[test]
    fn habits_from_other_languages_are_known() {
        for (others, ours) in [
            ("ret return rts", "RSUB"),
            ("iret", "RETI"),
            ("gosub jsr", "CSUB"),
            ("goto jmp jump", "JA"),
            ("cmp", "COMP"),
            ("end halt", "STOP"),
            ("delay sleep", "WAIT"),
            ("move", "MVP"),
            ("home", "RFS"),
        ] {
            for other in others.split(' ') {
                assert_eq!(probably(other), Some(ours), "{other}");
            }
        }
        assert_eq!(probably("WIAT"), Some("WAIT"));
        assert_eq!(probably("XYZZY"), None);
    }
}
