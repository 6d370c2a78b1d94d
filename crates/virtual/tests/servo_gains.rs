//! Gains that nobody would set: the motor swings or trips its limits, as a real one would, and nothing breaks.

use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Duration, mnemonic};

/// Current in ampere that 24 V drive through two phases of the usual motor in series at most, with an EMF that adds
/// as much again.
const MOST_CURRENT: f64 = 2.0 * 24.0 / 0.72 * 1.2;

struct Module(VirtualModule);

impl Module {
    fn new(name: &str) -> Self {
        Self(VirtualModule::new(opentmcl_catalog::find(name).unwrap()))
    }

    /// A TMCM-1636 that is commutated by its encoder, with the gains of the vendor's example.
    fn field_oriented() -> Self {
        let mut module = Self::new("tmcm-1636");
        for text in [
            "SAP 12, 0, 1000",
            "SAP 11, 0, 2000",
            "SAP 70, 0, 300",
            "SAP 71, 0, 600",
            "SAP 74, 0, 300",
            "SAP 56, 0, 4096",
            "SAP 101, 0, 1",
            "SAP 15, 0, 3",
        ] {
            module.tell(text);
        }
        module.pass(1100);
        assert_eq!(module.tell("GAP 103, 0"), 0, "the encoder knows the angle");
        module
    }

    fn tell(&mut self, text: &str) -> i32 {
        let reply = self.0.execute(mnemonic::parse(text).unwrap());
        assert_eq!(reply.status.0, 100, "{text}");
        reply.value
    }

    fn pass(&mut self, milliseconds: u64) {
        self.0.advance(Duration::from_millis(milliseconds));
    }

    /// Looks at the machine each millisecond; gives the largest current and the number of times that the rotor has
    /// turned round.
    fn watch(&mut self, milliseconds: u64) -> (f64, u32) {
        let (mut current, mut turns, mut before) = (0.0f64, 0, 0.0f64);
        for _ in 0..milliseconds {
            self.pass(1);
            let view = self.0.servo_view(0).unwrap();
            assert!(view.turns.is_finite() && view.speed.is_finite() && view.amplitude.is_finite());
            assert!(view.amplitude <= MOST_CURRENT, "{view:?}");
            current = current.max(view.amplitude);
            if view.speed * before < 0.0 {
                turns += 1;
            }
            before = view.speed;
        }
        (current, turns)
    }
}

#[test]
fn a_speed_regulator_with_far_too_much_gain_throws_the_current_from_limit_to_limit() {
    let demands = |gains: [&str; 2]| {
        let mut module = Module::field_oriented();
        for text in gains {
            module.tell(text);
        }
        module.tell("ROR 0, 300");
        module.pass(1500);
        let demands: Vec<i32> = (0..100)
            .map(|_| {
                module.watch(1);
                module.tell("GAP 30, 0")
            })
            .collect();
        (*demands.iter().min().unwrap(), *demands.iter().max().unwrap())
    };
    let (least, most) = demands(["SAP 72, 0, 100", "SAP 73, 0, 100"]);
    assert!(-500 < least && most < 500, "{least} {most}");
    assert_eq!(demands(["SAP 72, 0, 32767", "SAP 73, 0, 32767"]), (-2000, 2000));
}

#[test]
fn a_position_regulator_with_far_too_much_gain_swings_around_its_target() {
    let turns = |gain: &str| {
        let mut module = Module::field_oriented();
        for text in [gain, "SAP 45, 0, 0", "MVP REL, 0, 4096"] {
            module.tell(text);
        }
        let (_, turned_round) = module.watch(4000);
        turned_round
    };
    let (calm, absurd) = (turns("SAP 74, 0, 50"), turns("SAP 74, 0, 32767"));
    assert!(calm <= 2 && absurd >= 8, "{calm} {absurd}");
}

#[test]
fn any_gains_and_motions_leave_currents_and_speeds_finite() {
    let mut random = 0x1636_1613u64;
    let mut below = |limit: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (random >> 33) % limit
    };
    for round in 0..200 {
        let foc = round % 2 == 0;
        let mut module = if foc { Module::field_oriented() } else { Module::new("tmcm-1613") };
        let (gains, largest): (&[u8], _) = if foc {
            (&[70, 71, 72, 73, 74], 32_767)
        } else {
            (&[172, 173, 230, 234, 235], 65_535)
        };
        for &gain in gains {
            // Small ones as often as large ones.
            let value = below(largest + 1) >> below(16);
            module.tell(&format!("SAP {gain}, 0, {value}"));
        }
        if !foc {
            module.tell(&format!("SAP 133, 0, {}", below(21)));
            module.tell(&format!("SAP 134, 0, {}", 1 + below(10)));
        }
        for _ in 0..4 {
            let value = below(20_001) as i64 - 10_000;
            let torque = if foc { 30 } else { 155 };
            let text = match below(4) {
                0 => format!("ROR 0, {value}"),
                1 => format!("MVP REL, 0, {value}"),
                2 => format!("SAP {torque}, 0, {value}"),
                _ => "MST 0".to_owned(),
            };
            module.tell(&text);
            module.watch(below(200));
        }
    }
}
