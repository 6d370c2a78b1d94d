//! Bytes of a file to text and back, with nothing lost.
//!
//! Programs come from decades of Windows editors: what is not valid UTF-8 is read as CP-1252, in
//! which every byte is a character, so that no file is refused and a formatted file keeps its bytes.

/// How the bytes of a file are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8.
    Utf8,
    /// UTF-8 behind a byte order mark.
    Utf8WithMark,
    /// CP-1252, the Western European code page of Windows, which agrees with Latin-1 from $A0 on.
    Windows1252,
}

const MARK: &[u8] = &[0xEF, 0xBB, 0xBF];

/// The characters of $80..=$9F in CP-1252; the five bytes that it leaves open keep their number.
const HIGH_CONTROLS: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8D}', 'Ž', '\u{8F}',
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9D}', 'ž', 'Ÿ',
];

/// The text of a file.
pub fn decode(bytes: &[u8]) -> (String, Encoding) {
    let (rest, encoding) = match bytes.strip_prefix(MARK) {
        Some(rest) => (rest, Encoding::Utf8WithMark),
        None => (bytes, Encoding::Utf8),
    };
    match str::from_utf8(rest) {
        Ok(text) => (text.to_owned(), encoding),
        Err(_) => (bytes.iter().map(|&byte| from_1252(byte)).collect(), Encoding::Windows1252),
    }
}

/// The bytes of a text; `None` if it has a character that the encoding lacks.
pub fn encode(text: &str, encoding: Encoding) -> Option<Vec<u8>> {
    match encoding {
        Encoding::Utf8 => Some(text.as_bytes().to_vec()),
        Encoding::Utf8WithMark => Some([MARK, text.as_bytes()].concat()),
        Encoding::Windows1252 => text.chars().map(to_1252).collect(),
    }
}

fn from_1252(byte: u8) -> char {
    match byte {
        0x80..=0x9F => HIGH_CONTROLS[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

fn to_1252(character: char) -> Option<u8> {
    match u8::try_from(u32::from(character)) {
        Ok(byte) if !(0x80..=0x9F).contains(&byte) => Some(byte),
        _ => {
            let at = HIGH_CONTROLS.iter().position(|&high| high == character)?;
            Some(0x80 + at as u8)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_in_every_encoding() {
        let all: Vec<u8> = (0..=255).collect();
        let (text, encoding) = decode(&all);
        assert_eq!(encoding, Encoding::Windows1252);
        assert_eq!(encode(&text, encoding), Some(all));

        // What looks like a mark belongs to the text when the rest is not UTF-8.
        let bytes = b"\xEF\xBB\xBF\xAE";
        let (text, encoding) = decode(bytes);
        assert_eq!(encode(&text, encoding).as_deref(), Some(&bytes[..]));

        let marked = b"\xEF\xBB\xBFMST 0 // \xC2\xB5";
        let (text, encoding) = decode(marked);
        assert_eq!((text.as_str(), encoding), ("MST 0 // µ", Encoding::Utf8WithMark));
        assert_eq!(encode(&text, encoding).as_deref(), Some(&marked[..]));
    }

    #[test]
    fn a_windows_comment_reads_as_its_author_saw_it() {
        // ® and ™ as CP-1252 has them.
        let (text, encoding) = decode(b"//TRINAMIC\xAE coolStep\x99");
        assert_eq!(text, "//TRINAMIC® coolStep™");
        assert_eq!(encoding, Encoding::Windows1252);
    }

    #[test]
    fn a_character_that_the_encoding_lacks_is_not_replaced() {
        assert_eq!(encode("→", Encoding::Windows1252), None);
        // $80 is the euro sign, and no control character any more.
        assert_eq!(encode("\u{80}", Encoding::Windows1252), None);
    }
}
