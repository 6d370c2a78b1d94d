//! Texts that are open in the editor.

use std::path::{Path, PathBuf};

use lsp_types::{TextDocumentContentChangeEvent, Uri};
use opentmcl_lang::span::{ColumnUnit, LineIndex};

use super::convert;

/// One open text.
#[derive(Debug)]
pub(super) struct Document {
    /// As the editor writes it.
    pub(super) uri: Uri,
    pub(super) version: i32,
    pub(super) text: String,
    /// Where it is on disk, by way of no links; nowhere, if it was never saved.
    pub(super) real: Option<PathBuf>,
}

impl Document {
    pub(super) fn new(uri: Uri, name: &str, version: i32, text: String) -> Self {
        Self { uri, version, text, real: Path::new(name).canonicalize().ok() }
    }

    /// Applies changes, each to what the one before has left.
    pub(super) fn change(
        &mut self,
        version: i32,
        changes: Vec<TextDocumentContentChangeEvent>,
        unit: ColumnUnit,
    ) {
        self.version = version;
        for change in changes {
            let Some(range) = change.range else {
                self.text = change.text;
                continue;
            };
            let lines = LineIndex::new(&self.text);
            let offset = |position| lines.offset(&self.text, convert::place(position), unit);
            let (start, end) = (offset(range.start) as usize, offset(range.end) as usize);
            self.text.replace_range(start.min(end)..start.max(end), &change.text);
        }
    }
}

#[cfg(test)]
mod tests {
    use lsp_types::{Position, Range};

    use super::*;

    fn after(text: &str, changes: &[(Option<[u32; 4]>, &str)], unit: ColumnUnit) -> String {
        let uri: Uri = "untitled:a".parse().unwrap();
        let mut document = Document::new(uri, "untitled:a", 1, text.into());
        let changes = changes.iter().map(|&(range, text)| TextDocumentContentChangeEvent {
            range: range.map(|[line, column, end_line, end_column]| Range {
                start: Position::new(line, column),
                end: Position::new(end_line, end_column),
            }),
            range_length: None,
            text: text.into(),
        });
        document.change(2, changes.collect(), unit);
        assert_eq!(document.version, 2);
        document.text
    }

    #[test]
    fn changes_apply_one_after_the_other() {
        let changes = [(Some([1, 0, 1, 3]), "STOP"), (Some([1, 4, 1, 4]), " // end")];
        assert_eq!(after("MST 0\nEND\n", &changes, ColumnUnit::Utf16), "MST 0\nSTOP // end\n");
        let changes = [(None, "a\nb"), (Some([0, 1, 1, 0]), "")];
        assert_eq!(after("x", &changes, ColumnUnit::Utf16), "ab");
    }

    #[test]
    fn columns_count_what_was_agreed_upon() {
        // 𝄞 has two units of UTF-16 and four bytes of UTF-8.
        let text = "// 𝄞x";
        assert_eq!(after(text, &[(Some([0, 5, 0, 6]), "y")], ColumnUnit::Utf16), "// 𝄞y");
        assert_eq!(after(text, &[(Some([0, 7, 0, 8]), "y")], ColumnUnit::Utf8), "// 𝄞y");
    }

    #[test]
    fn places_outside_of_the_text_are_moved_into_it() {
        let far = [(Some([0, 99, 99, 99]), "!")];
        assert_eq!(after("ab\ncd", &far, ColumnUnit::Utf16), "ab!");
        let backwards = [(Some([0, 2, 0, 1]), "x")];
        assert_eq!(after("abc", &backwards, ColumnUnit::Utf16), "axc");
        let within = [(Some([0, 1, 0, 1]), "x")];
        assert_eq!(after("𝄞", &within, ColumnUnit::Utf16), "𝄞x");
    }
}
