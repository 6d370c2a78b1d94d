//! Findings with the lines of the source that they are about.

use std::borrow::Cow;

use annotate_snippets::renderer::{AnsiColor, Renderer};
use annotate_snippets::{AnnotationKind, Element, Level, Origin, Snippet};
use opentmcl_lang::{Location, Severity};

use super::place::{Files, Finding, Point, Region};

/// The longest line that is shown, in bytes. The renderer shortens lines to the width of the
/// terminal, but at a cost that grows with their length.
const MAX_LINE: usize = 4000;

/// The longest message that is shown in full, in characters.
const MAX_MESSAGE: usize = 300;

const RENDERER: Renderer = Renderer::styled()
    .error(AnsiColor::Red.on_default().bold())
    .warning(AnsiColor::Yellow.on_default().bold())
    .help(AnsiColor::Cyan.on_default().bold());

/// The finding as text with colours, which the stream takes away where they are not wanted.
pub(super) fn render(finding: &Finding<'_>, width: u16) -> String {
    let diagnostic = finding.diagnostic;
    let level = match diagnostic.severity() {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Hint => Level::INFO.with_name("hint"),
    };
    let files = finding.files;
    let message = shortened(&diagnostic.message);
    let title = level.primary_title(message).id(diagnostic.code.name());
    let place = part(files, diagnostic.location, AnnotationKind::Primary, None);
    let mut group = title.element(place);
    if let Some((location, message)) = &diagnostic.related {
        group = group.element(part(files, *location, AnnotationKind::Context, Some(message)));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(shortened(help)));
    }
    RENDERER.term_width(width.into()).render(&[group])
}

/// The line of a location with a mark under it.
fn part<'a>(
    files: &Files<'a>,
    location: Location,
    kind: AnnotationKind,
    label: Option<&'a str>,
) -> Element<'a> {
    let Region { file, start: Point { line, column }, .. } = files.region(location);
    let (line, column) = (line as usize, column as usize);
    let (text, span) = files.line(location);
    if text.len() > MAX_LINE {
        return Origin::path(file).line(line).char_column(column).into();
    }
    let mark = kind.span(span.start as usize..span.end as usize).label(label);
    Snippet::source(harmless(text)).path(file).line_start(line).annotation(mark).into()
}

/// A line without the control characters of ISO 6429's second set, which terminals obey and the
/// renderer, as opposed to those of the first, shows as they are.
fn harmless(line: &str) -> Cow<'_, str> {
    let obeyed = '\u{80}'..='\u{9F}';
    if !line.contains(|character| obeyed.contains(&character)) {
        return line.into();
    }
    // As many bytes, so that places stay right.
    line.replace(|character| obeyed.contains(&character), "\u{B7}").into()
}

/// A message that names what somebody has written may be as long as that.
fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(MAX_MESSAGE) {
        Some((end, _)) => format!("{}…", &text[..end]).into(),
        None => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_message_ends_with_an_ellipsis() {
        let long = "ä".repeat(MAX_MESSAGE + 1);
        assert_eq!(shortened(&long), format!("{}…", "ä".repeat(MAX_MESSAGE)));
        assert_eq!(shortened(&long[2..]), long[2..]);
    }

    #[test]
    fn a_source_cannot_command_the_terminal() {
        // U+009B introduces an escape sequence; the middle dot has two bytes in UTF-8 as well.
        assert_eq!(harmless("a\u{9B}31m"), "a·31m");
    }
}
