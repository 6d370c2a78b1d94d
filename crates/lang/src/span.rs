//! Places in a text.

/// A part of a text, in bytes of its UTF-8 form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// First byte after it.
    pub end: u32,
}

impl Span {
    /// From its ends.
    pub const fn new(start: u32, end: u32) -> Self {
        Self { start, end }
    }

    /// Whether a cursor at this offset touches it, its end included.
    pub const fn touches(self, offset: u32) -> bool {
        self.start <= offset && offset <= self.end
    }

    /// The text that it covers; empty if it does not lie within the text.
    pub fn of(self, text: &str) -> &str {
        text.get(self.start as usize..self.end as usize).unwrap_or_default()
    }
}

/// A place as people and editors count it, both from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Position {
    /// Line.
    pub line: u32,
    /// Column, in the unit that was asked for.
    pub column: u32,
}

/// What a column counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnUnit {
    /// Characters, for people.
    Characters,
    /// Bytes of UTF-8.
    Utf8,
    /// 16-bit units of UTF-16, for the language server protocol.
    Utf16,
}

impl ColumnUnit {
    fn width(self, character: char) -> u32 {
        (match self {
            Self::Characters => 1,
            Self::Utf8 => character.len_utf8(),
            Self::Utf16 => character.len_utf16(),
        }) as u32
    }

    /// How many columns a text takes.
    pub fn columns(self, text: &str) -> u32 {
        match self {
            Self::Utf8 => text.len() as u32,
            _ => text.chars().map(|character| self.width(character)).sum(),
        }
    }
}

/// Where the lines of a text begin. Lines end with CR LF, LF or CR.
#[derive(Clone, Debug)]
pub struct LineIndex {
    starts: Vec<u32>,
}

impl LineIndex {
    /// Of this text.
    pub fn new(text: &str) -> Self {
        let bytes = text.as_bytes();
        let mut starts = vec![0];
        for (at, &byte) in bytes.iter().enumerate() {
            let ends = byte == b'\n' || byte == b'\r' && bytes.get(at + 1) != Some(&b'\n');
            if ends {
                starts.push(at as u32 + 1);
            }
        }
        Self { starts }
    }

    /// The place of an offset in the text that the index was made of.
    pub fn position(&self, text: &str, offset: u32, unit: ColumnUnit) -> Position {
        let line = self.starts.partition_point(|&start| start <= offset).saturating_sub(1);
        let start = self.starts.get(line).copied().unwrap_or_default();
        let column = unit.columns(Span::new(start, offset).of(text));
        Position { line: line as u32, column }
    }

    /// The offset of a place; beyond the end of a line the end of it.
    pub fn offset(&self, text: &str, position: Position, unit: ColumnUnit) -> u32 {
        let line = self.line(text, position.line);
        let mut column = 0;
        for (at, character) in line.of(text).char_indices() {
            if column >= position.column {
                return line.start + at as u32;
            }
            column += unit.width(character);
        }
        line.end
    }

    /// A line without what ends it; behind the last line, the end of the text.
    pub fn line(&self, text: &str, line: u32) -> Span {
        let end = text.len() as u32;
        let Some(&start) = self.starts.get(line as usize) else { return Span::new(end, end) };
        let next = self.starts.get(line as usize + 1).copied().unwrap_or(end);
        let content = Span::new(start, next).of(text).trim_end_matches(['\n', '\r']);
        Span::new(start, start + content.len() as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_three_line_ends_count_once() {
        let text = "a\r\nb\nc\rd";
        let index = LineIndex::new(text);
        let lines: Vec<_> = (0..5).map(|line| index.line(text, line).of(text)).collect();
        assert_eq!(lines, ["a", "b", "c", "d", ""]);
    }

    #[test]
    fn a_column_counts_what_it_is_asked_to() {
        // ü has two bytes and one unit, the musical clef four bytes and two units.
        let text = "x\nü𝄞z";
        let index = LineIndex::new(text);
        let z = text.find('z').unwrap() as u32;
        for (unit, column) in
            [(ColumnUnit::Characters, 2), (ColumnUnit::Utf8, 6), (ColumnUnit::Utf16, 3)]
        {
            let position = Position { line: 1, column };
            assert_eq!(index.position(text, z, unit), position);
            assert_eq!(index.offset(text, position, unit), z);
        }
    }

    #[test]
    fn a_line_begins_behind_the_end_of_the_one_before() {
        let text = "ab\ncd";
        let index = LineIndex::new(text);
        let unit = ColumnUnit::Characters;
        assert_eq!(index.position(text, 2, unit), Position { line: 0, column: 2 });
        assert_eq!(index.position(text, 3, unit), Position { line: 1, column: 0 });
    }

    #[test]
    fn a_column_beyond_the_line_is_its_end() {
        let text = "ab\r\ncd";
        let index = LineIndex::new(text);
        let far = Position { line: 0, column: 99 };
        assert_eq!(index.offset(text, far, ColumnUnit::Utf16), 2);
        let below = Position { line: 9, column: 0 };
        assert_eq!(index.offset(text, below, ColumnUnit::Utf16), 6);
    }
}
