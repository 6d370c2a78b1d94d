//! Lines as the formatter sees them.

use std::ops::Range;

use crate::token::TokenKind;
use crate::tree::{Line, Statement, TokenId, Tree};

use super::{INDENT, statement};

/// How far apart tab stops are: so in the editors in which most programs were written.
const TAB: usize = 8;

/// A line that is not blank.
pub(super) enum Row<'t> {
    /// One with a mistake, as it is.
    Verbatim(&'t str),
    /// Nothing but a comment.
    Comment(CommentRow<'t>),
    /// Labels or a statement.
    Code(CodeRow<'t>),
}

pub(super) struct CommentRow<'t> {
    pub(super) text: &'t str,
    /// Where it stood.
    column: usize,
    /// Where it will stand.
    pub(super) indent: usize,
    /// Whether it continues the comment at the end of the line above.
    pub(super) continues: bool,
}

pub(super) struct CodeRow<'t> {
    /// Labels and statement as they will be written, as a part of the common buffer.
    pub(super) text: Range<usize>,
    /// How many characters these are.
    pub(super) width: usize,
    /// Where the code stood, and where it will stand.
    columns: (usize, usize),
    pub(super) comment: Option<EndComment<'t>>,
}

/// A comment behind code.
pub(super) struct EndComment<'t> {
    pub(super) text: &'t str,
    /// Where it stood.
    column: usize,
}

impl Row<'_> {
    /// Whether its comment stands in the column that it shares with its neighbours.
    pub(super) fn belongs_to_block(&self) -> bool {
        match self {
            Row::Verbatim(_) => false,
            Row::Comment(comment) => comment.continues,
            Row::Code(_) => true,
        }
    }

    /// How wide the code in front of a comment is.
    pub(super) fn commented_width(&self) -> Option<usize> {
        match self {
            Row::Code(code) if code.comment.is_some() => Some(code.width),
            _ => None,
        }
    }
}

/// Reads a line, and adds its code to the buffer; `None` if it is blank.
pub(super) fn read<'t>(
    tree: &'t Tree,
    line: &Line,
    is_mistaken: bool,
    buffer: &mut String,
) -> Option<Row<'t>> {
    let span = tree.line_span(line);
    let whole = span.of(tree.text());
    if is_mistaken {
        return Some(Row::Verbatim(whole));
    }
    let column_of = |token: TokenId| {
        let before = (tree.token_span(token).start - span.start) as usize;
        column(whole.get(..before).unwrap_or_default())
    };
    let comment = tree.comment(line).map(|token| EndComment {
        text: tree.token_text(token).trim_end_matches(is_blank),
        column: column_of(token),
    });
    if tree.labels(line).is_empty() && line.statement == Statement::None {
        let EndComment { text, column } = comment?;
        return Some(Row::Comment(CommentRow { text, column, indent: 0, continues: false }));
    }
    let has_label = !tree.labels(line).is_empty();
    let indent = if statement::is_command(line) && !has_label { INDENT } else { 0 };
    let first = line.tokens.clone().map(TokenId);
    let first = first.into_iter().find(|&token| tree.kind(token) != TokenKind::Blank);
    let start = buffer.len();
    statement::write(tree, line, buffer);
    let width = buffer[start..].chars().count();
    let columns = (first.map_or(0, column_of), indent);
    Some(Row::Code(CodeRow { text: start..buffer.len(), width, columns, comment }))
}

/// Finds the comments that stand exactly below one at the end of a line of code.
pub(super) fn find_continuations(rows: &mut [Row<'_>]) {
    let mut above = None;
    for row in rows {
        match row {
            Row::Verbatim(_) => above = None,
            Row::Code(code) => above = code.comment.as_ref().map(|comment| comment.column),
            Row::Comment(comment) => {
                // Where commands begin, a comment is more likely to be about what follows.
                comment.continues = above == Some(comment.column) && comment.column > INDENT;
                if !comment.continues {
                    above = None;
                }
            }
        }
    }
}

/// Decides where comments stand that have a line of their own.
///
/// Those at the top of the text and at the left margin are about the whole file: they stay there.
pub(super) fn place_comments(rows: &mut [Row<'_>], at_top: bool) {
    let mut below = None;
    for row in rows.iter_mut().rev() {
        match row {
            Row::Verbatim(_) => below = None,
            Row::Code(code) => below = Some(code.columns),
            Row::Comment(comment) => {
                comment.indent = match below {
                    Some((stood, stands)) if stood == comment.column => stands,
                    _ if comment.column == 0 => 0,
                    _ => INDENT,
                };
            }
        }
    }
    let title = rows.iter_mut().map_while(|row| match row {
        Row::Comment(comment) if at_top => Some(comment),
        _ => None,
    });
    title.filter(|comment| comment.column == 0).for_each(|comment| comment.indent = 0);
}

/// The column behind a text at the beginning of a line.
fn column(text: &str) -> usize {
    text.chars().fold(0, |column, character| match character {
        '\t' => column / TAB * TAB + TAB,
        _ => column + 1,
    })
}

/// What may go at the end of a comment.
fn is_blank(character: char) -> bool {
    character.is_whitespace() || matches!(character, '\u{1A}' | '\u{FEFF}')
}
