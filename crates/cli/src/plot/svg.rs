//! Elements of the picture. Lengths are in tenths of a pixel.

use std::fmt::{self, Write};

/// Deviation that nobody sees.
const TOLERANCE: i64 = 1;

const STYLE: &str = "\
text{font:13px system-ui,-apple-system,'Segoe UI',Helvetica,Arial,sans-serif;fill:#747d88}\
.title{font-size:16px;font-weight:600}\
.command{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-weight:600}\
.command-right{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-weight:600;\
text-anchor:end}\
.right{text-anchor:end}.middle{text-anchor:middle}\
.grid{stroke:#808a96;stroke-opacity:.25}\
.zero{stroke:#808a96;stroke-opacity:.7}\
.moment{stroke:#808a96;stroke-dasharray:4 4}\
.mark{fill:#747d88}\
.area{fill:#747d88;fill-opacity:.25}\
.level{fill:none;stroke:#747d88;stroke-width:1.5}\
.curve{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}";

/// Styles of curves. As many again follow for the curves beside these.
pub(super) const STYLES: usize = 6;

/// Colour and dash pattern of a curve.
const CURVES: [(&str, &str); STYLES] = [
    ("#3b82d6", ""),
    ("#d9822b", "9 5"),
    ("#27a065", "1 5"),
    ("#cf5a8c", "9 5 1 5"),
    ("#8a6fd1", "20 6"),
    ("#a38a1f", "9 5 1 5 1 5"),
];

/// Width of a text, about: no font is at hand to measure it.
pub(super) fn text_width(text: &str) -> i64 {
    width(text, 70)
}

/// Width of a text in the larger letters of the title.
pub(super) fn title_width(text: &str) -> i64 {
    width(text, 92)
}

/// Width of a word of the program, whose letters have one width.
pub(super) fn command_width(text: &str) -> i64 {
    width(text, 80)
}

fn width(text: &str, letter: i64) -> i64 {
    i64::try_from(text.chars().count()).unwrap_or(i64::MAX).saturating_mul(letter)
}

/// A number of pixels.
struct Px(i64);

impl fmt::Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let (whole, tenth) = (self.0.abs() / 10, self.0.abs() % 10);
        write!(f, "{sign}{whole}")?;
        if tenth == 0 { Ok(()) } else { write!(f, ".{tenth}") }
    }
}

/// A text in which nothing is taken for markup.
struct Plain<'a>(&'a str);

impl fmt::Display for Plain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                letter if letter.is_control() => f.write_char('\u{FFFD}')?,
                letter => f.write_char(letter)?,
            }
        }
        Ok(())
    }
}

/// A picture that is being drawn.
pub(super) struct Svg {
    body: String,
}

impl Svg {
    pub(super) fn new() -> Self {
        Self { body: String::new() }
    }

    /// The whole document.
    pub(super) fn finish(self, title: &str, width: i64, height: i64) -> String {
        let (width, height) = (Px(width), Px(height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<style>{STYLE}</style>\n{}</svg>\n",
            Plain(title),
            self.body
        )
    }

    pub(super) fn text(&mut self, class: &str, x: i64, y: i64, text: &str) {
        let (x, y, text) = (Px(x), Px(y), Plain(text));
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        self.element(format_args!("<text{class} x=\"{x}\" y=\"{y}\">{text}</text>"));
    }

    /// A text from bottom to top whose middle is here.
    pub(super) fn turned_text(&mut self, x: i64, y: i64, text: &str) {
        let (x, y, text) = (Px(x), Px(y), Plain(text));
        self.element(format_args!(
            "<text class=\"middle\" transform=\"translate({x} {y}) rotate(-90)\">{text}</text>"
        ));
    }

    pub(super) fn line(&mut self, class: &str, from: (i64, i64), to: (i64, i64)) {
        let ((x1, y1), (x2, y2)) = ((Px(from.0), Px(from.1)), (Px(to.0), Px(to.1)));
        self.element(format_args!(
            "<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>"
        ));
    }

    /// A line through these points in the style with this number.
    pub(super) fn curve(&mut self, style: usize, points: &[(i64, i64)]) {
        let (colour, dashes) = CURVES[style % CURVES.len()];
        let is_beside = (style / STYLES) % 2 == 1;
        let dashes = match dashes {
            _ if is_beside => " stroke-dasharray=\"2 4\" style=\"stroke-width:1.4\"".to_owned(),
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        let points = joined(points);
        self.element(format_args!(
            "<polyline class=\"curve\" stroke=\"{colour}\"{dashes} points=\"{points}\"/>"
        ));
    }

    /// A line through these points, and what lies between it and a height.
    pub(super) fn area(&mut self, points: &[(i64, i64)], base: i64) {
        let line = joined(points);
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            let corners = joined(&[(last.0, base), (first.0, base)]);
            self.element(format_args!("<polygon class=\"area\" points=\"{line} {corners}\"/>"));
        }
        self.element(format_args!("<polyline class=\"level\" points=\"{line}\"/>"));
    }

    /// A filled rectangle between two corners, the upper left one first.
    pub(super) fn zone(&mut self, from: (i64, i64), to: (i64, i64)) {
        let ((x, y), (width, height)) = (from, (to.0 - from.0, to.1 - from.1));
        let (x, y, width, height) = (Px(x), Px(y), Px(width), Px(height));
        self.element(format_args!(
            "<rect class=\"area\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"
        ));
    }

    /// A small triangle whose lower tip is here.
    pub(super) fn mark(&mut self, x: i64, y: i64) {
        let (x, y) = (Px(x), Px(y));
        self.element(format_args!("<path class=\"mark\" d=\"M{x} {y}l-4 -7h8z\"/>"));
    }

    fn element(&mut self, element: fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.body, "{element}");
    }
}

fn joined(points: &[(i64, i64)]) -> String {
    let points: Vec<String> = points.iter().map(|&(x, y)| format!("{},{}", Px(x), Px(y))).collect();
    points.join(" ")
}

/// The points without those that lie on the line between the ones that are kept.
pub(super) fn simplified(points: &[(i64, i64)]) -> Vec<(i64, i64)> {
    let mut kept = Vec::new();
    let mut from = 0;
    kept.extend(points.first());
    for to in 2..points.len() {
        if !is_straight(&points[from..=to]) {
            from = to - 1;
            kept.push(points[from]);
        }
    }
    kept.extend(points.get(1..).and_then(<[_]>::last));
    kept
}

/// Whether all points lie near the line from the first to the last one, measured vertically.
fn is_straight(points: &[(i64, i64)]) -> bool {
    let [(x0, y0), .., (x1, y1)] = *points else { return true };
    points.iter().all(|&(x, y)| {
        ((y - y0) * (x1 - x0) - (y1 - y0) * (x - x0)).abs() <= TOLERANCE * (x1 - x0).abs()
    })
}
