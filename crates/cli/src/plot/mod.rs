//! Curves and levels over time as SVG, for a report or a page.
//!
//! Everything is drawn with whole numbers, in tenths of a pixel, so that every machine writes the same
//! bytes. Colours are of one brightness between the white and the black of a page and told apart by
//! the colour-blind; each curve has a dash pattern of its own as well, for print in grey.
//!
//! - here: what a plot is, and its layout.
//! - `markers`: where the texts of the markers have room.
//! - `scale`: ranges, ticks and their labels.
//! - `svg`: elements.

mod markers;
mod scale;
mod svg;

use scale::{Scale, Span, TimeScale};
use svg::Svg;

/// A plot: panels one below the other over a common time axis.
pub(crate) struct Plot {
    pub(crate) size: Size,
    pub(crate) title: String,
    /// End of the time axis in microseconds; it begins at 0.
    pub(crate) end: i64,
    /// Moments with a name and a line through all panels, in order of time.
    pub(crate) markers: Vec<Marker>,
    /// Moments with a small mark on top of the first panel.
    pub(crate) marks: Option<Marks>,
    /// Names of the curves for the legend, with the number of their style.
    pub(crate) legend: Vec<(usize, String)>,
    pub(crate) panels: Vec<Panel>,
}

/// How large a plot is, in tenths of a pixel.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    /// Width of the whole picture.
    pub(crate) width: i64,
    /// Height of a panel with curves.
    pub(crate) panel: i64,
}

impl Default for Size {
    /// As wide as a page.
    fn default() -> Self {
        Self { width: 8600, panel: 1900 }
    }
}

impl Size {
    /// From left to right, what lies between the labels.
    const fn plot(self) -> Span {
        Span { from: 640, to: self.width - 160 }
    }
}

/// A moment that has a name.
pub(crate) struct Marker {
    /// In microseconds.
    pub(crate) time: i64,
    /// A word of the program.
    pub(crate) command: String,
    /// What it means, on a line of its own.
    pub(crate) meaning: Option<String>,
}

/// Moments of one kind.
pub(crate) struct Marks {
    /// What they are, for the legend.
    pub(crate) name: &'static str,
    /// In microseconds, ascending.
    pub(crate) times: Vec<i64>,
}

/// One diagram.
pub(crate) enum Panel {
    /// Values over time.
    Curves {
        /// What the values are: `speed`.
        quantity: &'static str,
        /// In which unit: `pps`.
        unit: &'static str,
        curves: Vec<Curve>,
        /// Zones of values below the curves.
        bands: Vec<Band>,
    },
    /// Things that are off or on, each on a line of its own.
    Levels { quantity: &'static str, rows: Vec<Row> },
}

/// A curve of straight lines.
pub(crate) struct Curve {
    /// Number of its style, as in the legend.
    pub(crate) style: usize,
    /// Time in microseconds, ascending, and value.
    pub(crate) points: Vec<(i64, i64)>,
}

/// The style of a curve beside the one with this style: the same colour, thin and dotted.
pub(crate) const fn beside(style: usize) -> usize {
    style + svg::STYLES
}

/// A zone of values with a name.
pub(crate) struct Band {
    pub(crate) name: String,
    /// Its lowest value.
    pub(crate) from: i64,
    /// Its highest value.
    pub(crate) to: i64,
}

/// One thing that is off or on.
pub(crate) struct Row {
    pub(crate) name: String,
    /// Time in microseconds, ascending, and whether it is on from then on; off before.
    pub(crate) changes: Vec<(i64, bool)>,
}

const GAP: i64 = 460;
const FOOTER: i64 = 520;
/// Height of a line of a panel with levels, and the least height of such a panel.
const ROW: i64 = 300;
const LEAST_LEVELS: i64 = 560;
/// Baseline of the title, and from there to the legend if it has a line of its own.
const TITLE: i64 = 220;
const LEGEND_LINE: i64 = 260;
/// Space above the first panel, or above the names of markers.
const HEAD: i64 = 270;

impl Plot {
    /// The picture.
    pub(crate) fn draw(&self) -> String {
        let mut svg = Svg::new();
        let (size, plot) = (self.size, self.size.plot());
        let entries = self.legend_entries();
        let legend_width: i64 = entries.iter().map(Entry::width).sum();
        let beside = svg::title_width(&self.title) + 300 + legend_width <= plot.to - plot.from;
        let names = if beside { TITLE } else { TITLE + LEGEND_LINE };
        let time = TimeScale::new(self.end);

        let placed = markers::place(&self.markers, &time, plot);
        let top = names + HEAD + placed.height;
        let heights = self.panels.iter().map(|panel| panel.height(size));
        let bottom = top + heights.map(|height| height + GAP).sum::<i64>() - GAP;

        svg.text("title", plot.from, TITLE, &self.title);
        if beside {
            draw_legend(&mut svg, &entries, plot.to - legend_width, TITLE);
        } else {
            draw_legend(&mut svg, &entries, plot.from, names);
        }
        placed.draw(&mut svg, names + HEAD - 160, bottom);
        if let Some(marks) = &self.marks {
            draw_marks(&mut svg, &marks.times, &time, plot, top);
        }
        let mut panel_top = top;
        for panel in &self.panels {
            panel.draw(&mut svg, &time, size, panel_top);
            panel_top += panel.height(size) + GAP;
        }
        for (at, label) in time.ticks() {
            svg.text("middle", time.place(at, plot), bottom + 200, &label);
        }
        svg.text("right", plot.to, bottom + 400, &time.title());
        svg.finish(&self.title, size.width, bottom + FOOTER)
    }

    fn legend_entries(&self) -> Vec<Entry<'_>> {
        let curves = self.legend.iter().map(|(style, name)| Entry::Curve(*style, name));
        let marks = self.marks.iter().filter(|marks| !marks.times.is_empty());
        curves.chain(marks.map(|marks| Entry::Mark(marks.name))).collect()
    }
}

/// One entry of the legend.
enum Entry<'a> {
    Curve(usize, &'a str),
    Mark(&'a str),
}

impl Entry<'_> {
    /// Length of the sample in front of the name.
    const fn sample(&self) -> i64 {
        match self {
            Self::Curve(..) => 330,
            Self::Mark(_) => 80,
        }
    }

    fn width(&self) -> i64 {
        let (Self::Curve(_, name) | Self::Mark(name)) = self;
        self.sample() + 70 + svg::text_width(name) + 180
    }
}

fn draw_legend(svg: &mut Svg, entries: &[Entry<'_>], mut x: i64, y: i64) {
    for entry in entries {
        let name = match entry {
            Entry::Curve(style, name) => {
                svg.curve(*style, &[(x, y - 45), (x + entry.sample(), y - 45)]);
                name
            }
            Entry::Mark(name) => {
                svg.mark(x + 40, y - 5);
                name
            }
        };
        svg.text("", x + entry.sample() + 70, y, name);
        x += entry.width();
    }
}

/// Draws each mark that is not right on top of another one.
fn draw_marks(svg: &mut Svg, times: &[i64], time: &TimeScale, plot: Span, top: i64) {
    let mut last = i64::MIN;
    for &at in times {
        let x = time.place(at, plot);
        if x >= last.saturating_add(20) {
            svg.mark(x, top);
            last = x;
        }
    }
}

impl Panel {
    fn height(&self, size: Size) -> i64 {
        match self {
            Self::Curves { .. } => size.panel,
            Self::Levels { rows, .. } => {
                LEAST_LEVELS.max(ROW * i64::try_from(rows.len()).unwrap_or(0))
            }
        }
    }

    fn draw(&self, svg: &mut Svg, time: &TimeScale, size: Size, top: i64) {
        let (height, plot) = (self.height(size), size.plot());
        for (at, _) in time.ticks() {
            let x = time.place(at, plot);
            svg.line("grid", (x, top), (x, top + height));
        }
        let title = match self {
            Self::Curves { quantity, unit, curves, bands } => {
                let values = curves.iter().flat_map(|curve| &curve.points).map(|point| point.1);
                let ends = bands.iter().flat_map(|band| [band.from, band.to]);
                let scale = Scale::around(values.chain(ends));
                let over = Span { from: top + height, to: top };
                let lines: Vec<Vec<(i64, i64)>> = curves
                    .iter()
                    .map(|curve| {
                        let points = curve.points.iter();
                        let place = |&(at, value): &(i64, i64)| {
                            (time.place(at, plot), scale.place(value, over))
                        };
                        points.map(place).collect()
                    })
                    .collect();
                for band in bands {
                    draw_band(svg, band, &lines, plot, &scale, over);
                }
                draw_values(svg, &scale, plot, over);
                // The first one, which is drawn through, below the others, whose dashes show it where they
                // meet.
                for (curve, points) in curves.iter().zip(&lines) {
                    svg.curve(curve.style, &svg::simplified(points));
                }
                scale.title(quantity, unit)
            }
            Self::Levels { quantity, rows } => {
                let count = i64::try_from(rows.len()).unwrap_or(1).max(1);
                let lowest = top + height / 2 + ROW * count / 2;
                for (row, above) in rows.iter().rev().zip(0..) {
                    draw_levels(svg, row, time, plot, lowest - ROW * above);
                }
                (*quantity).to_owned()
            }
        };
        // Turned, its middle beside the middle of the panel.
        svg.turned_text(105, top + height / 2, &title);
    }
}

/// Height of a zone whose values are one: enough to be seen.
const THIN: i64 = 24;

/// Draws a zone from left to right, with its name inside or above it, where no curve goes through that.
fn draw_band(
    svg: &mut Svg,
    band: &Band,
    lines: &[Vec<(i64, i64)>],
    plot: Span,
    scale: &Scale,
    over: Span,
) {
    let (low, high) = (scale.place(band.from, over), scale.place(band.to, over));
    let missing = (THIN - (low - high)).max(0) / 2;
    svg.zone((plot.from, high - missing), (plot.to, low + missing));
    let width = svg::text_width(&band.name);
    let (left, right) = (plot.from + 60, plot.to - 60);
    let (inside, above) = ((low + high) / 2, high - 80);
    let heights = if missing > 0 { [above, above] } else { [inside, above] };
    let places = heights.into_iter().flat_map(|middle| {
        [right, left + width, (plot.from + plot.to + width) / 2].map(|end| (end, middle))
    });
    let is_free = |&(end, middle): &(i64, i64)| {
        let (across, down) = ((end - width, end), (middle - 70, middle + 70));
        let mut steps = lines.iter().flat_map(|line| line.windows(2));
        !steps.any(|ends| match *ends {
            [(x1, y1), (x2, y2)] => {
                x2 >= across.0 && x1 <= across.1 && y1.max(y2) >= down.0 && y1.min(y2) <= down.1
            }
            _ => false,
        })
    };
    let (end, middle) = places.into_iter().find(is_free).unwrap_or((right, inside));
    svg.text("right", end, middle + 45, &band.name);
}

/// Draws a line and a label for each tick of the values.
fn draw_values(svg: &mut Svg, scale: &Scale, plot: Span, over: Span) {
    for (value, label) in scale.ticks() {
        let class = if value == 0 { "zero" } else { "grid" };
        let y = scale.place(value, over);
        svg.line(class, (plot.from, y), (plot.to, y));
        svg.text("right", plot.from - 90, y + 45, &label);
    }
}

/// Draws a row whose lower end is at `bottom`: a line that is up and filled while it is on.
fn draw_levels(svg: &mut Svg, row: &Row, time: &TimeScale, plot: Span, bottom: i64) {
    let (low, high) = (bottom - 50, bottom - 220);
    svg.text("right", plot.from - 90, bottom - 90, &row.name);
    svg.line("zero", (plot.from, low), (plot.to, low));
    let mut points = vec![(plot.from, low)];
    for &(at, on) in &row.changes {
        let x = time.place(at, plot);
        let before = points.last().map_or(low, |point| point.1);
        points.extend([(x, before), (x, if on { high } else { low })]);
    }
    let last = points.last().map_or(low, |point| point.1);
    points.push((plot.to, last));
    svg.area(&points, low);
}
