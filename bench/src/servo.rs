//! Servo modules: regulators and motor, control period by control period.

use opentmcl_catalog::find;
use opentmcl_virtual::{Options, VirtualModule, flash::MemoryFlash};

use crate::Measured;
use crate::fleet::cpu_seconds;
use crate::program::{advance_seconds, execute};

/// Field-oriented control by encoder, with the settings that PyTrinamic's examples give the usual motor, but twice
/// their acceleration: as the other module has it from the factory.
const FIELD_ORIENTED: [&str; 17] = [
    "SAP 10, 0, 4",
    "SAP 11, 0, 2000",
    "SAP 12, 0, 1000",
    "SAP 70, 0, 300",
    "SAP 71, 0, 600",
    "SAP 72, 0, 100",
    "SAP 73, 0, 100",
    "SAP 74, 0, 300",
    "SAP 43, 0, 4000",
    "SAP 44, 0, 2000",
    "SAP 100, 0, 4096",
    "SAP 56, 0, 4096",
    "SAP 53, 0, 5",
    "SAP 54, 0, 500",
    "SAP 102, 0, 0",
    "SAP 101, 0, 1",
    "SAP 15, 0, 3",
];

const SPEED: i32 = 2000;

/// How many times faster than real time the module with field-oriented control runs.
pub(crate) fn field_oriented() -> Measured {
    back_and_forth("tmcm-1636", &FIELD_ORIENTED, "GAP 42, 0")
}

/// The same for the one with block commutation.
pub(crate) fn block() -> Measured {
    back_and_forth("tmcm-1613", &[], "GAP 3, 0")
}

/// Turns the usual motor, whose friction is its load, four seconds to the right and four to the left, and so on: half
/// of the time it is accelerated or braked. Time is that of the processor, since the limit is for one core.
fn back_and_forth(name: &str, settings: &[&str], actual_speed: &str) -> Measured {
    /// To the right and to the left.
    const WAYS: u32 = 120;
    const SECONDS_PER_WAY: u32 = 4;
    let model = find(name).expect("the catalogue has the module");
    let mut module = VirtualModule::with_flash(model, MemoryFlash::new(), Options::default());
    for line in settings {
        execute(&mut module, line);
    }
    // The rotor is turned to a known angle first.
    advance_seconds(&mut module, 2);
    let start = cpu_seconds();
    for way in 0..WAYS {
        let (command, speed) = if way % 2 == 0 { ("ROR", SPEED) } else { ("ROL", -SPEED) };
        execute(&mut module, &format!("{command} 0, {SPEED}"));
        advance_seconds(&mut module, SECONDS_PER_WAY);
        let off = execute(&mut module, actual_speed) - speed;
        assert!(off.abs() < SPEED / 20, "{off} rpm off");
    }
    let seconds = cpu_seconds() - start;
    let simulated = f64::from(WAYS * SECONDS_PER_WAY);
    Measured {
        value: simulated / seconds,
        note: format!("{:.1} ns per control period", seconds / (simulated * 20_000.0) * 1e9),
    }
}
