//! A TMCM-6110 with machines: whoever looks on changes nothing, and an encoder has no place there.

use opentmcl_virtual::flash::MemoryFlash;
use opentmcl_virtual::{Action, Options, Push, Scenario, VirtualModule};
use opentmcl_wire::{Duration, mnemonic};

const SCENARIO: &str = r#"
[[module]]
model = "tmcm-6110"
[[module.axis]]
axis = 0
motor = "qsh4218-51-10-049"
[[module.axis]]
axis = 1
motor = "qsh4218-51-10-049"
transmission = { belt = "40 mm" }
load = { mass = "0.3 kg", friction = "2 N" }
stage = { from = "-10 mm", to = "118 mm", start = "40 mm" }
left = { at = "8 mm", width = "8 mm", bounce = "3 ms" }
home = { at = "50 mm", width = "8 mm", hysteresis = "0.1 mm" }
[[module.axis]]
axis = 2
motor = "nema17"
load = { torque = "-0.05 Nm" }
[[module.axis]]
axis = 4
motor = "nema17"
transmission = { screw = "2 mm" }
stage = { from = "-5 mm", to = "5 mm" }
"#;

fn execute(module: &mut VirtualModule<MemoryFlash>, text: &str) -> i32 {
    module.execute(mnemonic::parse(text).unwrap()).value
}

/// What can be seen of all axes at set times, with further looks between them.
fn run(mut looks: impl FnMut() -> u64) -> Vec<String> {
    let scenario = Scenario::parse("machines.toml", SCENARIO).unwrap();
    let setup = &scenario.modules[0];
    let mut module = VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default());
    for axis in 0..6 {
        for setting in ["SAP 154, #, 3", "SAP 153, #, 7", "SAP 4, #, 1000", "SAP 5, #, 300"] {
            execute(&mut module, &setting.replace('#', &axis.to_string()));
        }
    }
    for setting in ["SAP 13, 1, 0", "SAP 193, 1, 5", "SAP 194, 1, 1000", "SAP 195, 1, 50"] {
        execute(&mut module, setting);
    }
    for start in [
        "SAP 181, 0, 500",
        "SAP 172, 0, 4",
        "SAP 182, 0, 300",
        "ROR 0, 1678",
        "RFS START, 1",
        "SAP 204, 2, 150",
        "MVP ABS, 4, 400000",
    ] {
        execute(&mut module, start);
    }
    let mut seen = Vec::new();
    for second in 0..20 {
        let end = module.now() + Duration::from_ticks(16_000_000);
        while module.now() < end {
            let next = module.now() + Duration::from_ticks(looks());
            module.advance_to(next.min(end));
            for axis in 0..6 {
                module.view(axis);
                for look in ["GAP 1, #", "GAP 206, #", "GAP 208, #", "GAP 180, #", "GAP 10, #"] {
                    execute(&mut module, &look.replace('#', &axis.to_string()));
                }
            }
        }
        let torque = -0.05 * f64::from(second % 10);
        module.act(&Action::Load { axis: 0, push: Push::Torque(torque) }).unwrap();
        if second == 8 {
            execute(&mut module, "ROL 0, 1200");
        }
        for axis in 0..6 {
            let position = execute(&mut module, &format!("GAP 1, {axis}"));
            seen.push(format!("{second} s, axis {axis}: {position} {:?}", module.view(axis)));
        }
        seen.push(format!("search {}", execute(&mut module, "RFS STATUS, 1")));
    }
    seen
}

#[test]
fn looking_at_machines_changes_nothing() {
    let expected = run(|| 16_000_000);
    assert!(expected.contains(&"search 0".to_owned()), "the search comes to its end");
    let states = ["Slipping", "Free", "Pressed", "Following"];
    for state in states {
        assert!(expected.iter().any(|line| line.contains(state)), "{state}");
    }
    let mut random = 1u64;
    let seen = run(|| {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        1 + (random >> 33) % 400_000
    });
    for (seen, expected) in seen.iter().zip(&expected) {
        assert_eq!(seen, expected);
    }
}

#[test]
fn an_encoder_is_refused() {
    let text = "[[module]]\nmodel = \"tmcm-6110\"\n[[module.axis]]\naxis = 1\nmotor = \"nema17\"\n\
                encoder = { counts = 4000 }\n";
    let mistakes = Scenario::parse("lab.toml", text).unwrap_err().to_string();
    assert_eq!(
        mistakes,
        "lab.toml:6:11: the TMCM-6110 has no encoder inputs; leave the encoder out"
    );
}
