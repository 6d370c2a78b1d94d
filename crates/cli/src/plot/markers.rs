//! The names of moments above the panels, in as many lines as they need to stand beside each other.

use super::Marker;
use super::scale::{Span, TimeScale};
use super::svg::{self, Svg};

/// Lines of names; what finds no room in them is left out.
const LINES: usize = 4;

/// Between the line of a moment and its name.
const GAP: i64 = 90;

/// Height of a line of names, and of what they mean below.
const NAME: i64 = 190;
const MEANING: i64 = 170;

/// Markers that have found their places.
pub(super) struct Placed<'a> {
    markers: Vec<(&'a Marker, Place)>,
    line_height: i64,
    /// What all lines together need.
    pub(super) height: i64,
}

#[derive(Clone, Copy)]
struct Place {
    x: i64,
    line: usize,
    /// On the left of its moment, because it would leave the picture on the right.
    is_left: bool,
}

/// Places markers, which come in order of time.
///
/// A moment's own line goes down from its name. So a name may stand in a line only if no earlier name
/// in that line or below reaches as far as its moment.
pub(super) fn place<'a>(markers: &'a [Marker], time: &TimeScale, over: Span) -> Placed<'a> {
    let mut ends = [i64::MIN; LINES];
    let mut placed = Vec::new();
    for marker in markers {
        let x = time.place(marker.time, over);
        let meaning = marker.meaning.as_deref().unwrap_or_default();
        let width = GAP + svg::command_width(&marker.command).max(svg::text_width(meaning));
        let is_left = x + width > over.to;
        let from = if is_left { x - width } else { x };
        let free = ends.iter().rposition(|&end| end >= from).map_or(0, |taken| taken + 1);
        if let Some(end) = ends.get_mut(free) {
            *end = if is_left { x } else { x + width };
            placed.push((marker, Place { x, line: free, is_left }));
        }
    }
    let has_meanings = markers.iter().any(|marker| marker.meaning.is_some());
    let line_height = if has_meanings { NAME + MEANING } else { NAME };
    let lines = placed.iter().map(|(_, place)| place.line + 1).max().unwrap_or(0);
    let height = line_height * i64::try_from(lines).unwrap_or(0);
    Placed { markers: placed, line_height, height }
}

impl Placed<'_> {
    /// Draws the names from `top` on, and the lines of the moments down to `bottom`.
    pub(super) fn draw(&self, svg: &mut Svg, top: i64, bottom: i64) {
        let mut last_x = None;
        for (marker, place) in &self.markers {
            let from = top + self.line_height * i64::try_from(place.line).unwrap_or(0);
            // The line of an earlier one begins higher.
            if last_x.replace(place.x) != Some(place.x) {
                svg.line("moment", (place.x, from), (place.x, bottom));
            }
            let (x, class, meaning_class) = if place.is_left {
                (place.x - GAP, "command-right", "right")
            } else {
                (place.x + GAP, "command", "")
            };
            svg.text(class, x, from + 110, &marker.command);
            if let Some(meaning) = &marker.meaning {
                svg.text(meaning_class, x, from + 110 + MEANING, meaning);
            }
        }
    }
}
