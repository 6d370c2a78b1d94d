//! Drawings of the reference search: each mode from the left of its switch, on it, and from the right, on
//! the stages of the transcripts.

use opentmcl_virtual::{Action, MemoryFlash, ModuleSetup, Options, Scenario, VirtualModule};
use opentmcl_wire::{Duration, Instant, mnemonic};

use crate::plot::{Band, Curve, Marker, Panel, Plot, Row, Size};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/reference-search");
const SCENARIO: &str = include_str!("../../../../conformance/tmcm-6214/reference-search.toml");

const SAMPLE: Duration = Duration::from_millis(20);
/// After the end of a search, and the length of a drawing whose search does not end.
const REST: Duration = Duration::from_millis(500);
const LONGEST: Duration = Duration::from_millis(20_000);
const ENDLESS: Duration = Duration::from_millis(4_000);

/// A search: its mode, its axis, and the switch that matters in the order left, right, home.
struct Case {
    mode: u8,
    axis: u8,
    switch: usize,
    /// Places of the stage in mm with their names.
    starts: &'static [(&'static str, f64)],
}

const LIMIT: &[(&str, f64)] = &[("left", -4.0), ("on", 4.8), ("right", 40.0)];
const HOME: &[(&str, f64)] = &[("left", 20.0), ("on", 48.0), ("right", 80.0)];
const INDEX: &[(&str, f64)] = &[("left", 20.0), ("right", 56.0)];

const CASES: [Case; 10] = [
    Case { mode: 1, axis: 0, switch: 0, starts: LIMIT },
    Case { mode: 2, axis: 0, switch: 0, starts: LIMIT },
    Case { mode: 3, axis: 0, switch: 0, starts: LIMIT },
    Case { mode: 4, axis: 0, switch: 0, starts: LIMIT },
    Case { mode: 5, axis: 0, switch: 2, starts: HOME },
    Case { mode: 6, axis: 0, switch: 2, starts: HOME },
    Case { mode: 7, axis: 1, switch: 2, starts: HOME },
    Case { mode: 8, axis: 1, switch: 2, starts: HOME },
    Case { mode: 9, axis: 3, switch: 2, starts: INDEX },
    Case { mode: 10, axis: 3, switch: 2, starts: INDEX },
];

const SWITCHES: [&str; 3] = ["left", "right", "home"];

fn execute(module: &mut VirtualModule, command: &str) -> i32 {
    let reply = module.execute(mnemonic::parse(command).unwrap());
    assert!(reply.status.is_ok(), "{command}: {}", reply.status);
    reply.value
}

/// What is seen of a search.
struct Run {
    /// When it ended, in microseconds.
    end: Option<i64>,
    /// Time and place of the stage in 1/1000 mm.
    stage: Vec<(i64, i64)>,
    /// Changes of the left, right and home switch.
    levels: [Vec<(i64, bool)>; 3],
}

fn microseconds(module: &VirtualModule, start: Instant) -> i64 {
    i64::try_from((module.now() - start).as_micros()).unwrap()
}

fn run(setup: &ModuleSetup, case: &Case, place: f64) -> Run {
    let Case { mode, axis, .. } = *case;
    let mut module = VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default());
    let action = format!("set position axis {axis} {place} mm");
    module.act(&action.parse::<Action>().unwrap()).unwrap();
    if setup.axes[usize::from(axis)].machine.as_ref().unwrap().stepper().unwrap().encoder.is_some()
    {
        execute(&mut module, &format!("SAP 210, {axis}, 4000"));
    }
    for (parameter, value) in [(193, i32::from(mode)), (194, 25_600), (195, 5_120)] {
        execute(&mut module, &format!("SAP {parameter}, {axis}, {value}"));
    }
    execute(&mut module, &format!("RFS START, {axis}"));
    let start = module.now();
    let mut run = Run { end: None, stage: Vec::new(), levels: Default::default() };
    let mut last = LONGEST;
    while module.now() - start <= last {
        let time = microseconds(&module, start);
        let view = module.view(axis).unwrap();
        let place = module.scale(axis).to_stage(view.stage);
        run.stage.push((time, (place * 1000.0).round() as i64));
        for (changes, level) in run.levels.iter_mut().zip(view.switches) {
            if changes.last().map_or(level, |&(_, before)| before != level) {
                changes.push((time, level));
            }
        }
        if run.end.is_none() && execute(&mut module, &format!("RFS STATUS, {axis}")) == 0 {
            run.end = Some(time);
            last = (module.now() - start) + REST;
        }
        module.advance(SAMPLE);
    }
    if run.end.is_none() {
        let end = i64::try_from(ENDLESS.as_micros()).unwrap();
        run.stage.retain(|&(time, _)| time <= end);
        run.levels.iter_mut().for_each(|changes| changes.retain(|&(time, _)| time <= end));
    }
    run
}

fn draw(setup: &ModuleSetup, case: &Case, name: &str, place: f64) -> String {
    let run = run(setup, case, place);
    let scale = setup.axes[usize::from(case.axis)].scale;
    let machine = setup.axes[usize::from(case.axis)].machine.as_ref().unwrap().stepper().unwrap();
    let (low, high) =
        run.stage.iter().fold((0, 0), |(low, high), &(_, at)| (at.min(low), at.max(high)));
    let mut bands = Vec::new();
    let mut rows = Vec::new();
    let switches = [&machine.switches.left, &machine.switches.right, &machine.switches.home];
    for (number, switch) in switches.into_iter().enumerate() {
        let Some(switch) = switch else { continue };
        let ends =
            [switch.from, switch.to].map(|end| (scale.to_stage(end) * 1000.0).round() as i64);
        // On a circle the switch comes again with each turn.
        let turn =
            machine.stage.circle.map(|circle| (scale.to_stage(circle) * 1000.0).round() as i64);
        for copy in if turn.is_some() { -1..=1 } else { 0..=0 } {
            let [from, to] = ends.map(|end| end + copy * turn.unwrap_or(0));
            if from <= high && to >= low {
                bands.push(Band { name: SWITCHES[number].to_owned(), from, to });
            }
        }
        let changes = run.levels[number].clone();
        if number == case.switch || changes.len() > 1 {
            rows.push(Row { name: SWITCHES[number].to_owned(), changes });
        }
    }
    if let Some(encoder) = &machine.encoder {
        for turn in 0..3 {
            let index = scale.to_stage(encoder.index + f64::from(turn) * 51_200.0) * 1000.0;
            let at = index.round() as i64;
            bands.push(Band { name: "index".to_owned(), from: at, to: at });
        }
    }
    let from = match name {
        "on" => "on the switch",
        "left" => "from the left",
        _ => "from the right",
    };
    let mut panels = vec![Panel::Curves {
        quantity: "stage",
        unit: "µm",
        curves: vec![Curve { style: 0, points: run.stage.clone() }],
        bands,
    }];
    if !rows.is_empty() {
        panels.push(Panel::Levels { quantity: "switch", rows });
    }
    Plot {
        size: Size { width: 3600, panel: 1700 },
        title: format!("Mode {}, {from}", case.mode),
        end: run.stage.last().unwrap().0,
        markers: run
            .end
            .map(|time| Marker { time, command: "0".to_owned(), meaning: None })
            .into_iter()
            .collect(),
        marks: None,
        legend: Vec::new(),
        panels,
    }
    .draw()
}

#[test]
fn the_drawings_of_the_reference_search_show_what_the_module_does() {
    let scenario = Scenario::parse("reference-search.toml", SCENARIO).unwrap();
    let setup = scenario.modules.first().unwrap();
    let bless = std::env::var_os("OPENTMCL_BLESS").is_some_and(|value| value == "1");
    let mut different = Vec::new();
    for case in &CASES {
        for &(name, place) in case.starts {
            let file = format!("{FOLDER}/mode-{}-{name}.svg", case.mode);
            let drawn = draw(setup, case, name, place);
            if bless {
                std::fs::write(&file, &drawn).unwrap();
            }
            if std::fs::read_to_string(&file).ok().as_deref() != Some(&drawn) {
                different.push(format!("mode-{}-{name}.svg", case.mode));
            }
        }
    }
    assert!(
        different.is_empty(),
        "{} in docs/images/reference-search show other motions; if that is meant, run this test with \
         OPENTMCL_BLESS=1 and look at them",
        different.join(", ")
    );
}
