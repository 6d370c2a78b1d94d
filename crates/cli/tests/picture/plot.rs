//! Curves over time as SVG, in whole tenths of a pixel so that every machine draws the same bytes.

use std::fmt::{self, Write};

/// A range of values, from left to right or from bottom to top.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    pub(crate) from: i64,
    pub(crate) to: i64,
}

impl Span {
    /// Where a value lies if this range is spread over another one.
    fn spread(self, value: i64, over: Span) -> i64 {
        over.from + (value - self.from) * (over.to - over.from) / (self.to - self.from)
    }
}

/// One diagram.
pub(crate) struct Panel {
    pub(crate) title: &'static str,
    pub(crate) values: Span,
    /// Distance of the grid lines, in values. Labels are in thousands.
    pub(crate) tick: i64,
    /// Points (time in ms, value) of each curve.
    pub(crate) curves: Vec<Vec<(i64, i64)>>,
}

/// When something happened, in ms; the command that was given, and what it means.
pub(crate) type Moment = (i64, &'static str, &'static str);

/// Tenths of a pixel.
struct Px(i64);

impl fmt::Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let (whole, tenth) = (self.0.abs() / 10, self.0.abs() % 10);
        write!(f, "{sign}{whole}")?;
        if tenth == 0 { Ok(()) } else { write!(f, ".{tenth}") }
    }
}

const WIDTH: i64 = 8600;
const HEADER: i64 = 1000;
const PANEL: i64 = 1900;
const GAP: i64 = 460;
const FOOTER: i64 = 520;
const PLOT: Span = Span { from: 640, to: 8440 };

/// Deviation that nobody sees.
const TOLERANCE: i64 = 1;

/// Of one brightness between the white and the black of a page, and told apart by the colour-blind.
const COLOURS: [&str; 6] = ["#3b82d6", "#d9822b", "#27a065", "#cf5a8c", "#8a6fd1", "#a38a1f"];

const STYLE: &str = "\
text{font:13px system-ui,-apple-system,'Segoe UI',Helvetica,Arial,sans-serif;fill:#747d88}\
.title{font-size:16px;font-weight:600}\
.command{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-weight:600}\
.right{text-anchor:end}.middle{text-anchor:middle}\
.grid{stroke:#808a96;stroke-opacity:.25}\
.zero{stroke:#808a96;stroke-opacity:.7}\
.moment{stroke:#808a96;stroke-dasharray:4 4}\
.curve{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}";

/// Draws panels one below the other over the same time in ms.
pub(crate) fn write(
    svg: &mut String,
    title: &str,
    time: Span,
    moments: &[Moment],
    panels: &[Panel],
) -> fmt::Result {
    let count = i64::try_from(panels.len()).unwrap();
    let bottom = HEADER + count * (PANEL + GAP) - GAP;
    let height = bottom + FOOTER;
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" viewBox="0 0 {0} {1}">"#,
        Px(WIDTH),
        Px(height)
    )?;
    writeln!(svg, "<title>{title}</title>")?;
    writeln!(svg, "<style>{STYLE}</style>")?;
    text(svg, "title", PLOT.from, 220, title)?;
    legend(svg, 220)?;
    for &(at, command, meaning) in moments {
        let x = time.spread(at, PLOT);
        line(svg, "moment", (x, HEADER - 460), (x, bottom))?;
        text(svg, "command", x + 90, HEADER - 350, command)?;
        text(svg, "", x + 90, HEADER - 170, meaning)?;
    }
    let mut top = HEADER;
    for panel in panels {
        draw_panel(svg, panel, time, top)?;
        top += PANEL + GAP;
    }
    for second in time.from / 1000..=time.to / 1000 {
        let x = time.spread(second * 1000, PLOT);
        text(svg, "middle", x, bottom + 200, &second.to_string())?;
    }
    text(svg, "right", PLOT.to, bottom + 400, "time in s")?;
    writeln!(svg, "</svg>")
}

fn draw_panel(svg: &mut String, panel: &Panel, time: Span, top: i64) -> fmt::Result {
    let inside = Span { from: top + PANEL, to: top };
    let y = |value| panel.values.spread(value, inside);
    for second in time.from / 1000..=time.to / 1000 {
        let x = time.spread(second * 1000, PLOT);
        line(svg, "grid", (x, top), (x, top + PANEL))?;
    }
    let mut value = panel.values.from;
    while value <= panel.values.to {
        let class = if value == 0 { "zero" } else { "grid" };
        line(svg, class, (PLOT.from, y(value)), (PLOT.to, y(value)))?;
        let minus = if value < 0 { "\u{2212}" } else { "" };
        let label = format!("{minus}{}", value.abs() / 1000);
        text(svg, "right", PLOT.from - 90, y(value) + 45, &label)?;
        value += panel.tick;
    }
    // Turned, its middle beside the middle of the panel.
    let (x, middle) = (Px(150), Px(top + PANEL / 2));
    writeln!(
        svg,
        r#"<text class="middle" transform="translate({x} {middle}) rotate(-90)">{}</text>"#,
        panel.title
    )?;
    // The first axis on top.
    for (curve, colour) in panel.curves.iter().zip(COLOURS).rev() {
        let points: Vec<_> =
            curve.iter().map(|&(at, value)| (time.spread(at, PLOT), y(value))).collect();
        write!(svg, r#"<polyline class="curve" stroke="{colour}" points=""#)?;
        for (at, (x, y)) in simplified(&points).into_iter().enumerate() {
            let blank = if at == 0 { "" } else { " " };
            write!(svg, "{blank}{},{}", Px(x), Px(y))?;
        }
        writeln!(svg, r#""/>"#)?;
    }
    Ok(())
}

fn legend(svg: &mut String, y: i64) -> fmt::Result {
    const ENTRY: i64 = 780;
    for (axis, colour) in (0..).zip(COLOURS) {
        let x = PLOT.to - (6 - axis) * ENTRY + 150;
        let (from, to, middle) = (Px(x), Px(x + 180), Px(y - 45));
        writeln!(svg, r#"<path class="curve" stroke="{colour}" d="M{from} {middle}H{to}"/>"#)?;
        text(svg, "", x + 250, y, &format!("axis {axis}"))?;
    }
    Ok(())
}

fn line(svg: &mut String, class: &str, from: (i64, i64), to: (i64, i64)) -> fmt::Result {
    let ((x1, y1), (x2, y2)) = ((Px(from.0), Px(from.1)), (Px(to.0), Px(to.1)));
    writeln!(svg, r#"<line class="{class}" x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/>"#)
}

fn text(svg: &mut String, class: &str, x: i64, y: i64, text: &str) -> fmt::Result {
    let class = if class.is_empty() { String::new() } else { format!(r#" class="{class}""#) };
    writeln!(svg, r#"<text{class} x="{}" y="{}">{text}</text>"#, Px(x), Px(y))
}

/// The points without those that lie on the line between the ones that are kept.
fn simplified(points: &[(i64, i64)]) -> Vec<(i64, i64)> {
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
