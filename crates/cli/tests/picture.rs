//! The picture of the README: six axes of a virtual module, recorded and drawn.
//!
//! The file must be what is drawn here. After a change that is meant to alter it, run
//! `OPENTMCL_BLESS=1 cargo test -p opentmcl-cli --test picture` and look at it.

#[path = "picture/plot.rs"]
mod plot;

use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Duration, Instant, mnemonic};

use plot::{Panel, Span};

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

fn curves(samples: &[Sample], of: impl Fn(&Sample) -> [i32; AXES]) -> Vec<Vec<(i64, i64)>> {
    let milliseconds = |time: Duration| i64::try_from(time.as_millis()).unwrap();
    (0..AXES)
        .map(|axis| {
            samples
                .iter()
                .map(|sample| (milliseconds(sample.time), i64::from(of(sample)[axis])))
                .collect()
        })
        .collect()
}

fn draw(samples: &[Sample]) -> String {
    let moments = [
        (LEAD, "MVP COORD, $7F, 1", "one move of six axes, interpolated"),
        (RETURN, "MVP ABS, 0…5, 0", "six moves, each at its own limits"),
    ];
    let panels = [
        Panel {
            title: "speed in 1000 pps",
            values: Span { from: -80_000, to: 80_000 },
            tick: 40_000,
            curves: curves(samples, |sample| sample.speed),
        },
        Panel {
            title: "position in 1000 microsteps",
            values: Span { from: -100_000, to: 100_000 },
            tick: 50_000,
            curves: curves(samples, |sample| sample.position),
        },
    ];
    let end = i64::try_from(END.as_millis()).unwrap();
    let mut svg = String::new();
    plot::write(
        &mut svg,
        "Six axes of a virtual TMCM-6214",
        Span { from: 0, to: end },
        &moments.map(|(at, command, meaning)| {
            (i64::try_from(at.as_millis()).unwrap(), command, meaning)
        }),
        &panels,
    )
    .unwrap();
    svg
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
