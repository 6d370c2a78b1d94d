//! The picture of the README: six axes of a virtual module, recorded and drawn; and the plotter, which
//! is that of `tmcl sim --plot`.
//!
//! The file must be what is drawn here. After a change that is meant to alter it, run
//! `OPENTMCL_BLESS=1 cargo test -p opentmcl-cli --test picture` and look at it.

#[path = "../src/plot/mod.rs"]
mod plot;
#[path = "picture/reference_search.rs"]
mod reference_search;

use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Duration, Instant, mnemonic};

use plot::{Band, Curve, Marker, Marks, Panel, Plot, Row, Size, beside};

const PICTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/six-axes.svg");

const AXES: usize = 6;

/// Of each axis: maximum speed and V1 in pps, acceleration above V1 in pps², way in microsteps.
const SCENE: [(i32, i32, i32, i32); AXES] = [
    (51_200, 20_000, 102_400, 96_000),
    (72_000, 14_000, 192_000, 70_000),
    (60_000, 9_000, 96_000, 42_000),
    (40_000, 6_000, 160_000, -26_000),
    (56_000, 12_000, 128_000, -58_000),
    (64_000, 18_000, 80_000, -88_000),
];

const SAMPLE: Duration = Duration::from_millis(10);
/// From power-up to the first move.
const LEAD: Duration = Duration::from_millis(250);
/// Both parts of the scene, and the rest at the end.
const END: Duration = Duration::from_millis(7_000);
const RETURN: Duration = Duration::from_millis(3_750);

/// Speed in pps and position in microsteps of each axis at one time.
#[derive(Clone, Copy)]
struct Sample {
    time: Duration,
    speed: [i32; AXES],
    position: [i32; AXES],
}

struct Scene {
    module: VirtualModule,
    samples: Vec<Sample>,
}

impl Scene {
    /// Sets the axes up; below V1 they have half the acceleration.
    fn new() -> Self {
        let model = opentmcl_catalog::find("tmcm-6214").unwrap();
        let mut scene = Self { module: VirtualModule::new(model), samples: Vec::new() };
        for (axis, (speed, v1, acceleration, way)) in SCENE.into_iter().enumerate() {
            let settings = [
                (4, speed),
                (5, acceleration),
                (17, acceleration),
                (16, v1),
                (15, acceleration / 2),
                (18, acceleration / 2),
            ];
            for (parameter, value) in settings {
                scene.execute(&format!("SAP {parameter}, {axis}, {value}"));
            }
            scene.execute(&format!("SCO 1, {axis}, {way}"));
        }
        scene
    }

    fn execute(&mut self, command: &str) -> i32 {
        let reply = self.module.execute(mnemonic::parse(command).unwrap());
        assert!(reply.status.is_ok(), "{command}: {}", reply.status);
        reply.value
    }

    fn of_all_axes(&mut self, parameter: u8) -> [i32; AXES] {
        std::array::from_fn(|axis| self.execute(&format!("GAP {parameter}, {axis}")))
    }

    fn record_until(&mut self, end: Duration) {
        while self.module.now() - Instant::from_ticks(0) < end {
            self.record();
            self.module.advance(SAMPLE);
        }
    }

    fn record(&mut self) {
        let time = self.module.now() - Instant::from_ticks(0);
        let (speed, position) = (self.of_all_axes(3), self.of_all_axes(1));
        self.samples.push(Sample { time, speed, position });
    }

    /// All axes out together, and back each on its own.
    fn play() -> Vec<Sample> {
        let mut scene = Self::new();
        scene.record_until(LEAD);
        scene.execute("MVP COORD, $7F, 1");
        scene.record_until(RETURN);
        for axis in 0..AXES {
            scene.execute(&format!("MVP ABS, {axis}, 0"));
        }
        scene.record_until(END);
        scene.record();
        scene.samples
    }
}

fn microseconds(time: Duration) -> i64 {
    i64::try_from(time.as_micros()).unwrap()
}

fn curves(samples: &[Sample], of: impl Fn(&Sample) -> [i32; AXES]) -> Vec<Curve> {
    (0..AXES)
        .map(|axis| Curve {
            style: axis,
            points: samples
                .iter()
                .map(|sample| (microseconds(sample.time), i64::from(of(sample)[axis])))
                .collect(),
        })
        .collect()
}

fn marker(time: Duration, command: &str, meaning: &str) -> Marker {
    let meaning = (!meaning.is_empty()).then(|| meaning.to_owned());
    Marker { time: microseconds(time), command: command.to_owned(), meaning }
}

fn draw(samples: &[Sample]) -> String {
    Plot {
        size: Size::default(),
        title: "Six axes of a virtual TMCM-6214".to_owned(),
        end: microseconds(END),
        markers: vec![
            marker(LEAD, "MVP COORD, $7F, 1", "one move of six axes, interpolated"),
            marker(RETURN, "MVP ABS, 0…5, 0", "six moves, each at its own limits"),
        ],
        marks: None,
        legend: (0..AXES).map(|axis| (axis, format!("axis {axis}"))).collect(),
        panels: vec![
            Panel::Curves {
                quantity: "speed",
                unit: "pps",
                curves: curves(samples, |sample| sample.speed),
                bands: Vec::new(),
            },
            Panel::Curves {
                quantity: "position",
                unit: "microsteps",
                curves: curves(samples, |sample| sample.position),
                bands: Vec::new(),
            },
        ],
    }
    .draw()
}

#[test]
fn the_picture_shows_what_the_module_does() {
    let drawn = draw(&Scene::play());
    if std::env::var_os("OPENTMCL_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(PICTURE, &drawn).unwrap();
    }
    let kept = std::fs::read_to_string(PICTURE).unwrap();
    let differ = kept.lines().zip(drawn.lines()).filter(|(kept, drawn)| kept != drawn).count();
    assert!(
        kept == drawn,
        "the picture shows another motion ({differ} lines of docs/images/six-axes.svg differ); if that is \
         meant, run this test with OPENTMCL_BLESS=1 and look at the picture"
    );
}

#[test]
fn the_interpolated_axes_stay_on_a_straight_line_and_arrive_together() {
    let samples = Scene::play();
    let moving = |sample: &&Sample| sample.time > LEAD && sample.speed != [0; AXES];
    let interpolated: Vec<_> = samples.iter().take_while(|s| s.time < RETURN).collect();
    assert!(interpolated.iter().copied().filter(moving).count() > 100);
    for sample in &interpolated {
        for axis in 1..AXES {
            // Equal parts of the way, to 1 %: the smallest acceleration is about 60 register units,
            // so that rounding it to a whole number changes it by that much.
            let part =
                |axis: usize| i64::from(sample.position[axis]) * 100_000 / i64::from(SCENE[axis].3);
            assert!((part(axis) - part(0)).abs() <= 1000, "axis {axis} at {}", sample.time);
        }
    }
    let last = interpolated.last().unwrap();
    assert_eq!(last.position, SCENE.map(|(.., way)| way));
    assert_eq!(samples.last().unwrap().position, [0; AXES]);
}

/// A plot of one second with one curve and nothing else.
fn plot_of(points: &[(i64, i64)]) -> Plot {
    let curve = Curve { style: 1, points: points.to_vec() };
    Plot {
        size: Size::default(),
        title: "title".to_owned(),
        end: 1_000_000,
        markers: Vec::new(),
        marks: None,
        legend: Vec::new(),
        panels: vec![Panel::Curves {
            quantity: "speed",
            unit: "pps",
            curves: vec![curve],
            bands: Vec::new(),
        }],
    }
}

/// The texts of elements with this beginning.
fn texts<'a>(svg: &'a str, beginning: &str) -> Vec<&'a str> {
    svg.lines()
        .filter(|line| line.starts_with(beginning))
        .map(|line| line.split_once('>').unwrap().1.trim_end_matches("</text>"))
        .collect()
}

/// The corners of the first line with this class.
fn corners(svg: &str, class: &str) -> Vec<(f64, f64)> {
    let start = format!("<polyline class=\"{class}\"");
    let line = svg.lines().find(|line| line.starts_with(&start)).unwrap();
    let points = line.split_once("points=\"").unwrap().1.trim_end_matches("\"/>");
    let number = |text: &str| text.parse().unwrap();
    points
        .split(' ')
        .map(|point| point.split_once(',').unwrap())
        .map(|(x, y)| (number(x), number(y)))
        .collect()
}

#[test]
fn axes_have_round_ticks_and_units() {
    let ticks = |end, peak| {
        let mut plot = plot_of(&[(0, 0), (end, peak)]);
        plot.end = end;
        let svg = plot.draw();
        let times = texts(&svg, "<text class=\"middle\" x").join(" ");
        let values = texts(&svg, "<text class=\"right\"").join(" ");
        let quantity = texts(&svg, "<text class=\"middle\" transform").join(" ");
        format!("{times}; {values}; {quantity}")
    };
    assert_eq!(
        ticks(1_000_000, 51_200),
        "0.0 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1.0; 0 10 20 30 40 50 60 time in s; speed in 1000 pps"
    );
    assert_eq!(ticks(30_000, 7), "0 5 10 15 20 25 30; 0 1 2 3 4 5 6 7 time in ms; speed in pps");
    assert_eq!(
        ticks(3_600_000_000, -3_000_000),
        "0 5 10 15 20 25 30 35 40 45 50 55 60; \u{2212}3.0 \u{2212}2.5 \u{2212}2.0 \u{2212}1.5 \
         \u{2212}1.0 \u{2212}0.5 0.0 time in min; speed in million pps"
    );
}

#[test]
fn a_curve_keeps_its_corners_and_nothing_between_them() {
    let svg =
        plot_of(&[(0, 0), (250_000, 500), (500_000, 1000), (750_000, 1000), (1_000_000, 0)]).draw();
    let [from, peak, plateau, to] = corners(&svg, "curve")[..] else { panic!("{svg}") };
    // The plot is 780 pixels wide from pixel 64 on, each panel 190 high.
    assert_eq!((from.0, peak.0, plateau.0, to.0), (64.0, 454.0, 649.0, 844.0));
    assert_eq!((from.1 - peak.1, from.1 - plateau.1, from.1 - to.1), (190.0, 190.0, 0.0));
}

#[test]
fn curves_are_told_apart_without_colour() {
    let mut plot = plot_of(&[]);
    plot.legend = (0..AXES).map(|axis| (axis, format!("axis {axis}"))).collect();
    plot.panels.clear();
    let svg = plot.draw();
    let mut dashes: Vec<_> = svg
        .lines()
        .filter(|line| line.starts_with("<polyline"))
        .map(|line| {
            line.split_once("stroke-dasharray")
                .map_or("", |(_, rest)| rest.split('"').nth(1).unwrap())
        })
        .collect();
    dashes.sort_unstable();
    dashes.dedup();
    assert_eq!(dashes.len(), AXES, "{dashes:?}");
}

#[test]
fn levels_are_steps() {
    let mut plot = plot_of(&[]);
    let row = Row { name: "7".to_owned(), changes: vec![(500_000, true), (750_000, false)] };
    plot.panels = vec![Panel::Levels { quantity: "output", rows: vec![row] }];
    let svg = plot.draw();
    let steps = corners(&svg, "level");
    let low = steps[0].1;
    let high = low - 17.0;
    assert_eq!(
        steps,
        [(64.0, low), (454.0, low), (454.0, high), (649.0, high), (649.0, low), (844.0, low)]
    );
    assert!(svg.contains(">7</text>") && svg.contains(">output</text>"), "{svg}");
}

#[test]
fn names_of_moments_stand_beside_or_below_each_other() {
    let mut plot = plot_of(&[]);
    // 780 pixels a second: the first two are 8 pixels apart, the third is far away, the last at the end.
    let moments = [(100, "first"), (110, "second"), (600, "third"), (1000, "last")];
    plot.markers =
        moments.iter().map(|&(at, name)| marker(Duration::from_millis(at), name, "")).collect();
    let svg = plot.draw();
    let at = |name: &str| place(&svg, name);
    assert!(at("second").1 > at("first").1);
    assert_eq!(at("third").1, at("first").1);
    assert_eq!(at("last"), (835.0, at("first").1), "on the left of its moment");
}

#[test]
fn no_line_of_a_moment_runs_through_the_name_of_another() {
    let mut plot = plot_of(&[]);
    // The second name lies below the first one and reaches beyond the third moment.
    let moments = [(0, "first"), (40, "a-name-that-is-long"), (100, "third")];
    plot.markers =
        moments.iter().map(|&(at, name)| marker(Duration::from_millis(at), name, "")).collect();
    let svg = plot.draw();
    assert!(place(&svg, "third").1 > place(&svg, "a-name-that-is-long").1);
}

/// Where a text stands.
fn place(svg: &str, text: &str) -> (f64, f64) {
    let end = format!(">{text}</text>");
    let line = svg.lines().find(|line| line.ends_with(&end)).unwrap();
    let number = |key: &str| -> f64 {
        let value = line.split_once(key).unwrap().1;
        value.split('"').next().unwrap().parse().unwrap()
    };
    (number(" x=\""), number(" y=\""))
}

#[test]
fn moments_without_room_for_their_names_are_left_out() {
    let mut plot = plot_of(&[]);
    plot.markers = (0..1000).map(|at| marker(Duration::from_millis(at), "crowded", "")).collect();
    plot.marks = Some(Marks { name: "beat", times: (0..100_000).map(|at| at * 10).collect() });
    let svg = plot.draw();
    let names = texts(&svg, "<text class=\"command").len();
    // A name takes 65 of 780 pixels, in four lines.
    assert!((12..=48).contains(&names), "{names}");
    let marks = svg.matches("class=\"mark\"").count();
    assert!((300..=400).contains(&marks), "one every two pixels: {marks}");
}

#[test]
fn nothing_in_a_text_is_taken_for_markup() {
    let mut plot = plot_of(&[]);
    plot.title = "a<b & \u{1b}c>".to_owned();
    let svg = plot.draw();
    assert!(svg.contains("<title>a&lt;b &amp; \u{FFFD}c&gt;</title>"), "{svg}");
    assert!(!svg.contains('\u{1b}'));
}

/// A small drawing of a way into the zone of a switch and back, with the level of the switch below.
fn drawing_of_a_switch() -> String {
    let commanded = vec![(0, 0), (500_000, -900), (1_000_000, 0)];
    let real = commanded.iter().map(|&(at, value)| (at, value + 40)).collect();
    Plot {
        size: Size { width: 4300, panel: 1200 },
        title: "Left switch".to_owned(),
        end: 1_000_000,
        markers: Vec::new(),
        marks: None,
        legend: vec![(0, "commanded".to_owned()), (beside(0), "real".to_owned())],
        panels: vec![
            Panel::Curves {
                quantity: "position",
                unit: "microsteps",
                curves: vec![
                    Curve { style: 0, points: commanded },
                    Curve { style: beside(0), points: real },
                ],
                bands: vec![Band { name: "left switch".to_owned(), from: -1000, to: -800 }],
            },
            Panel::Levels {
                quantity: "switch",
                rows: vec![Row {
                    name: "left".to_owned(),
                    changes: vec![(450_000, true), (550_000, false)],
                }],
            },
        ],
    }
    .draw()
}

#[test]
fn a_zone_of_values_lies_where_its_values_are() {
    let svg = drawing_of_a_switch();
    let zone = svg.lines().find(|line| line.starts_with("<rect class=\"area\"")).unwrap();
    let number = |key: &str| -> f64 {
        let value = zone.split_once(key).unwrap().1;
        value.split('"').next().unwrap().parse().unwrap()
    };
    // The panel is 120 pixels high and shows -1000..=200, since the real position ends at 40: 200 values are 20
    // pixels.
    let start = corners(&svg, "level")[0];
    assert_eq!((number(" x=\""), number(" width=\"")), (start.0, 430.0 - 64.0 - 16.0));
    assert_eq!(number(" height=\""), 20.0);
    assert!(svg.contains(">left switch</text>"));
}

#[test]
fn a_curve_beside_another_one_has_its_colour_and_dashes_of_its_own() {
    let svg = drawing_of_a_switch();
    let lines: Vec<_> =
        svg.lines().filter(|line| line.starts_with("<polyline class=\"curve\"")).collect();
    // Two in the legend, two in the panel.
    let [_, _, commanded, real] = lines[..] else { panic!("{svg}") };
    let colour = |line: &str| line.split_once("stroke=\"").unwrap().1[..7].to_owned();
    assert_eq!(colour(commanded), colour(real));
    assert!(!commanded.contains("dasharray") && real.contains("dasharray"));
}
