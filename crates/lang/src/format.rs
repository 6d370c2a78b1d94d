//! The one layout of a program's text.
//!
//! It is that of the vendor's examples: labels, constants and includes at the left margin, commands
//! indented, comments at the ends of lines below each other.

mod row;
mod statement;

use crate::parse::MAX_DIAGNOSTICS;
use crate::token::TokenKind;
use crate::tree::{TokenId, Tree};

use row::Row;

/// The column of commands.
const INDENT: usize = 4;

/// The column of comments at the ends of lines, where the code leaves room for it.
const COMMENT_COLUMN: usize = 28;

/// Blanks between code and a comment, at least.
const GAP: usize = 2;

/// The widest code that moves the comments of its neighbours to the right.
const WIDE: usize = 48;

/// Blank lines in a row, at most.
const BLANK_LINES: usize = 2;

/// The same program in canonical layout; formatting it again changes nothing.
///
/// - Labels, constants and includes begin at the left margin; commands stand in column 4, or one blank
///   behind a label that is longer.
/// - Mnemonics, keywords and functions are upper case. Names and numbers stay as they are written:
///   which spelling of a name is the right one may stand in another file.
/// - One blank follows a comma and surrounds `=`, `+`, `-`, `*` and `/`, none surrounds `^`.
/// - Comments behind code stand in column 28; where code is in the way, all comments up to the next
///   line that has no code move to the right together. Code wider than 48 moves only its own.
/// - A comment on a line of its own goes with the code below it if it stood in the same column.
///   Otherwise it stays at the left margin if it stood there, and is indented as commands are if it did
///   not. The title of the file stays at the left margin. A comment that continues the one at the end
///   of the line above stays below that.
/// - At most two blank lines follow each other, and none stand at the top and at the end.
/// - All lines end in the way in which most of them do; the last one ends, too.
/// - Blanks at the ends of lines, and the end mark of DOS, go.
///
/// The text of comments stays. A line with a syntax error stays as it is, and so does the whole text if
/// it has so many that they are not all known. Of a text that was too long to be read
/// ([`Code::TooMuchText`](crate::Code::TooMuchText)) nothing is in the tree, and nothing is given.
pub fn format(tree: &Tree) -> String {
    if tree.diagnostics().len() >= MAX_DIAGNOSTICS {
        return tree.text().to_owned();
    }
    let mistaken = mistaken_lines(tree);
    let mut mistaken = mistaken.iter().copied().peekable();
    let mut printer = Printer {
        text: String::with_capacity(tree.text().len()),
        line_end: line_end(tree),
        blank_lines: 0,
    };
    // Lines up to the next blank one: how a line looks depends on none outside.
    let mut paragraph = Vec::new();
    let mut code = String::new();
    for (number, line) in tree.lines().iter().enumerate() {
        let is_mistaken = mistaken.next_if(|&mistaken| mistaken == number).is_some();
        match row::read(tree, line, is_mistaken, &mut code) {
            Some(row) => paragraph.push(row),
            None => {
                printer.paragraph(&mut paragraph, &code);
                code.clear();
                printer.blank_lines += 1;
            }
        }
    }
    printer.paragraph(&mut paragraph, &code);
    printer.text
}

/// The lines with syntax errors, in the order in which they are found, which is that of the lines.
fn mistaken_lines(tree: &Tree) -> Vec<usize> {
    let places = tree.diagnostics().iter().map(|diagnostic| diagnostic.location.span.start);
    let mut lines: Vec<_> = places.map(|start| tree.line_at(start)).collect();
    lines.dedup();
    lines
}

/// What most lines end with; a line feed, if as many do.
fn line_end(tree: &Tree) -> &'static str {
    let mut counts = [("\r", 0_usize), ("\r\n", 0), ("\n", 0)];
    for (at, token) in tree.tokens().iter().enumerate() {
        if token.kind == TokenKind::Newline {
            let text = tree.token_text(TokenId(at as u32));
            counts.iter_mut().filter(|(end, _)| *end == text).for_each(|(_, count)| *count += 1);
        }
    }
    // Of equal ones this gives the last.
    counts.iter().max_by_key(|&&(_, count)| count).map_or("\n", |&(end, _)| end)
}

struct Printer {
    text: String,
    line_end: &'static str,
    /// Blank lines in front of the next line.
    blank_lines: usize,
}

impl Printer {
    /// Writes the lines of a paragraph and empties it. `code` is what the rows refer to.
    fn paragraph(&mut self, rows: &mut Vec<Row<'_>>, code: &str) {
        if rows.is_empty() {
            return;
        }
        let blank_lines = if self.text.is_empty() { 0 } else { self.blank_lines.min(BLANK_LINES) };
        for _ in 0..blank_lines {
            self.text.push_str(self.line_end);
        }
        self.blank_lines = 0;
        row::find_continuations(rows);
        row::place_comments(rows, self.text.is_empty());
        let mut rest = &rows[..];
        while let Some(first) = rest.first() {
            let length = match first.belongs_to_block() {
                true => rest.iter().take_while(|row| row.belongs_to_block()).count(),
                false => 1,
            };
            let (block, behind) = rest.split_at(length);
            self.block(block, code);
            rest = behind;
        }
        rows.clear();
    }

    /// Writes lines of code, whose comments stand below each other, or one other line.
    fn block(&mut self, rows: &[Row<'_>], code: &str) {
        let widths = rows.iter().filter_map(Row::commented_width).filter(|&width| width <= WIDE);
        let common = widths.max().map_or(0, |width| width + GAP).max(COMMENT_COLUMN);
        let mut column = common;
        for row in rows {
            let mut width = 0;
            if let Row::Code(row) = row {
                let text = &code[row.text.clone()];
                self.text.push_str(text);
                width = row.width;
                column = common.max(width + GAP);
            }
            let (comment, column) = match row {
                Row::Verbatim(text) => (Some(*text), 0),
                Row::Code(row) => (row.comment.as_ref().map(|comment| comment.text), column),
                Row::Comment(row) if row.continues => (Some(row.text), column),
                Row::Comment(row) => (Some(row.text), row.indent),
            };
            if let Some(comment) = comment {
                let blanks = column.saturating_sub(width);
                self.text.extend(std::iter::repeat_n(' ', blanks));
                self.text.push_str(comment);
            }
            self.text.push_str(self.line_end);
        }
    }
}
