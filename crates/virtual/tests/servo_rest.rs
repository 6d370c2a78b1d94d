//! A servo axis in which nothing moves sleeps, and one in which something moves does not.

use opentmcl_plant::servo::HoldingBrake;
use opentmcl_virtual::flash::MemoryFlash;
use opentmcl_virtual::scenario::{MachineSetup, ModuleSetup};
use opentmcl_virtual::{Options, VirtualModule};
use opentmcl_wire::{Duration, mnemonic};

fn module(name: &str) -> VirtualModule {
    VirtualModule::new(opentmcl_catalog::find(name).unwrap())
}

fn tell(module: &mut VirtualModule, text: &str) {
    let reply = module.execute(mnemonic::parse(text).unwrap());
    assert_eq!(reply.status.0, 100, "{text}");
}

/// Milliseconds until the module next wants to be called; none if it sleeps.
fn next(module: &mut VirtualModule) -> Option<u64> {
    let now = module.now();
    module.next_event().map(|event| (event.as_ticks() - now.as_ticks()) / 16_000)
}

#[test]
fn a_fresh_module_sleeps() {
    for name in ["tmcm-1636", "tmcm-1613"] {
        let mut module = module(name);
        module.advance(Duration::from_millis(5));
        assert_eq!(next(&mut module), None, "{name}");
    }
}

#[test]
fn a_motor_that_turns_keeps_its_module_awake_and_one_that_was_let_go_does_not() {
    let mut module = module("tmcm-1636");
    for text in ["SAP 90, 0, 1", "SAP 15, 0, 2", "ROR 0, 500"] {
        tell(&mut module, text);
    }
    for _ in 0..5 {
        module.advance(Duration::from_millis(300));
        assert_eq!(next(&mut module), Some(10));
    }
    // Without torque it coasts to a standstill, which the halls tell for sure after two seconds without an edge.
    tell(&mut module, "SAP 255, 0, 0");
    module.advance(Duration::from_millis(50));
    assert_eq!(next(&mut module), Some(10), "it still turns");
    module.advance(Duration::from_secs(10));
    assert_eq!(next(&mut module), None);
    // Who pulls at it wakes it up.
    tell(&mut module, "SAP 255, 0, 1");
    tell(&mut module, "SAP 30, 0, 1000");
    module.advance(Duration::from_millis(100));
    assert_eq!(next(&mut module), Some(10));
    assert!(module.servo_view(0).unwrap().speed > 100.0);
}

#[test]
fn a_brake_output_that_will_change_keeps_its_module_awake() {
    let model = opentmcl_catalog::find("tmcm-1636").unwrap();
    let mut setup = ModuleSetup::new(model);
    let Some(MachineSetup::Servo(servo)) = &mut setup.axes[0].machine else { panic!("no motor") };
    // Open with half of the current and more: with the first duty, and not with the second one.
    servo.machine.brake = Some(HoldingBrake { torque: 0.5, release_duty: 128 });
    let mut module = VirtualModule::with_setup(&setup, MemoryFlash::new(), Options::default());
    for text in ["SAP 124, 0, 1", "SAP 121, 0, 75", "SAP 122, 0, 11", "SAP 123, 0, 300"] {
        tell(&mut module, text);
    }
    tell(&mut module, "SAP 120, 0, 1");
    module.advance(Duration::from_millis(200));
    assert_eq!(next(&mut module), Some(10), "nothing moves, but the duty will change");
    module.advance(Duration::from_secs(10));
    assert_eq!(next(&mut module), None);
    // The brake has shut with the second duty: nobody turns the shaft.
    module.act(&"load axis 0 100 mNm".parse().unwrap()).unwrap();
    module.advance(Duration::from_millis(200));
    assert_eq!(module.servo_view(0).unwrap().speed, 0.0);
    // With the first duty it is open again.
    tell(&mut module, "SAP 120, 0, 0");
    module.advance(Duration::from_millis(10));
    tell(&mut module, "SAP 120, 0, 1");
    module.advance(Duration::from_millis(200));
    assert!(module.servo_view(0).unwrap().speed > 1000.0);
}
