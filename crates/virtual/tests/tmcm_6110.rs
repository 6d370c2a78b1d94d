//! The TMCM-6110 from outside its protocol: speeds in microsteps per second, and motors that follow.

use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Duration, mnemonic};

fn module(commands: &[&str]) -> VirtualModule {
    let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6110").unwrap());
    for text in commands {
        let reply = module.execute(mnemonic::parse(text).unwrap());
        assert!(reply.status.is_ok(), "{text}: {}", reply.status);
    }
    module
}

#[test]
fn speeds_are_told_in_microsteps_per_second_whatever_the_divisor() {
    for (divisor, pps) in [(0, 244_141), (3, 30_518), (5, 7_630), (13, 30)] {
        let mut module = module(&[
            &format!("SAP 154, 0, {divisor}"),
            "SAP 153, 0, 0",
            "SAP 5, 0, 2000",
            "ROR 0, 1000",
        ]);
        module.advance(Duration::from_millis(100));
        // 1000 * 16 MHz / 2^(16 + divisor), away from zero.
        assert_eq!(module.speed(0), Some(pps), "{divisor}");
        module.execute(mnemonic::parse("ROL 0, 1000").unwrap());
        module.advance(Duration::from_millis(100));
        assert_eq!(module.speed(0), Some(-pps), "{divisor}");
    }
}

#[test]
fn a_motor_follows_its_pulses_with_the_resolution_of_its_driver() {
    // 16 microsteps: 16 fine steps of 1/256 each.
    let mut module =
        module(&["SAP 140, 0, 4", "SAP 154, 0, 3", "SAP 5, 0, 500", "MVP ABS, 0, 1000"]);
    module.advance(Duration::from_secs(2));
    assert_eq!(module.position(0), Some(1000));
    let view = module.view(0).unwrap();
    assert_eq!((view.rotor, view.speed), (16_000.0, 0.0));
    // 1.6 A at most, parameter 6 is 255: 32 of 32.
    assert!((view.current - 1.6).abs() < 1e-9, "{}", view.current);
    // Another value of the counter moves nothing.
    module.execute(mnemonic::parse("MST 0").unwrap());
    module.execute(mnemonic::parse("SAP 1, 0, 77").unwrap());
    assert_eq!(module.position(0), Some(77));
    assert!((module.view(0).unwrap().rotor - 16_000.0).abs() < 1e-9);
}
