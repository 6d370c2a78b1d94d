//! Programs made at random, run on a virtual module: what really happens has been told.

use std::ops::ControlFlow;

use opentmcl_lang::{Assembly, Code, Diagnostic, check};
use opentmcl_virtual::{Executed, VirtualModule};
use opentmcl_wire::{Command, Duration, Opcode, Status};
use proptest::prelude::*;

use crate::{assembly, tmcm_6214};

/// How many commands of a run are looked at.
const STEPS: usize = 400;

/// Interrupt 0, a timer, with a handler at an address.
fn prelude(handler: usize) -> Vec<String> {
    vec![format!("VECT 0, {handler}"), "SGP 0, 3, 1".into(), "EI 0".into(), "EI 255".into()]
}

fn command(len: usize) -> impl Strategy<Value = String> {
    let address = 0..len;
    prop_oneof![
        3 => address.clone().prop_map(|to| format!("CSUB {to}")),
        2 => address.clone().prop_map(|to| format!("CALL NZ, {to}")),
        2 => address.clone().prop_map(|to| format!("JA {to}")),
        2 => address.clone().prop_map(|to| format!("JC ZE, {to}")),
        2 => (0..3, address.clone()).prop_map(|(variable, to)| format!("DJNZ {variable}, {to}")),
        1 => address.prop_map(|to| format!("RST {to}")),
        4 => Just("RSUB".to_owned()),
        3 => Just("RETI".to_owned()),
        1 => Just("STOP".to_owned()),
        3 => (-2..3).prop_map(|value| format!("CALC ADD, {value}")),
        2 => (0..3).prop_map(|variable| format!("CALCV LOAD, {variable}, 2")),
        2 => Just("WAIT TICKS, 0, 1".to_owned()),
    ]
}

fn program() -> impl Strategy<Value = String> {
    (6usize..24).prop_flat_map(|len| {
        let commands = prop::collection::vec(command(len), len - 4);
        (0..len, any::<bool>(), commands).prop_map(|(handler, has_handler, commands)| {
            let begin = if has_handler { prelude(handler) } else { vec!["MST 0".into(); 4] };
            [begin, commands].concat().join("\n")
        })
    })
}

/// Runs a program from address 0 and hands over what it does.
fn run(assembly: &Assembly, mut watcher: impl FnMut(&Executed) -> ControlFlow<()>) {
    let mut module = VirtualModule::new(tmcm_6214());
    let control = |number| Command::new(number, 0, 0, 0);
    let download = [control(132)].into_iter().chain(assembly.commands());
    for command in download.chain([control(133), control(129)]) {
        assert!(module.execute(command).status.is_ok(), "{command}");
    }
    let mut steps = 0;
    let end = module.now() + Duration::from_secs(1);
    let _ = module.advance_watched(end, |executed| {
        steps += 1;
        if steps > STEPS { ControlFlow::Break(()) } else { watcher(executed) }
    });
}

fn lines_with(assembly: &Assembly, findings: &[Diagnostic], code: Code) -> Vec<usize> {
    let tree = &assembly.files[0].tree;
    let with_code = findings.iter().filter(|finding| finding.code == code);
    with_code.map(|finding| tree.line_at(finding.location.span.start)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Every line is one command, so that lines are addresses.
    #[test]
    fn what_the_module_ignores_has_been_told(text in program()) {
        let assembly = assembly(&text, false);
        let len = assembly.instructions.len();
        let findings = check::findings(&assembly, None);
        let lines = |code| lines_with(&assembly, &findings, code);
        let unreachable = lines(Code::UnreachableCode);
        let mut depth_before = 0;
        let mut was_in_interrupt = false;
        let mut depth_of_handler = 0;
        let mut wrong = None;
        run(&assembly, |executed| {
            let at = usize::from(executed.address);
            if executed.in_interrupt && !was_in_interrupt {
                depth_of_handler = depth_before;
            }
            let ok = match Opcode::from_number(executed.command.number) {
                _ if at >= len => !lines(Code::RunsOffTheEnd).is_empty(),
                _ if unreachable.contains(&at) => false,
                Some(Opcode::Rsub) if executed.in_interrupt && depth_before <= depth_of_handler => {
                    lines(Code::RsubInHandler).contains(&at)
                }
                Some(Opcode::Rsub) if executed.status == Status::NOT_AVAILABLE => {
                    lines(Code::ReturnWithoutCall).contains(&at)
                }
                Some(Opcode::Reti) if executed.status == Status::NOT_AVAILABLE => {
                    lines(Code::RetiOutsideHandler).contains(&at)
                        || !lines(Code::FallsIntoHandler).is_empty()
                }
                Some(Opcode::Reti) if executed.status.is_ok() && depth_before > depth_of_handler => {
                    lines(Code::RetiInSubroutine).contains(&at)
                        || lines(Code::RetiOutsideHandler).contains(&at)
                }
                Some(Opcode::Csub | Opcode::Call) if executed.status == Status::NOT_AVAILABLE => {
                    // How deep the program is when an interrupt comes is not known.
                    executed.in_interrupt
                        || !lines(Code::CallsTooDeep).is_empty()
                        || !lines(Code::RecursiveCall).is_empty()
                }
                _ => {
                    depth_before = executed.depth;
                    let ends = [Opcode::Reti.number(), Opcode::Rst.number()];
                    was_in_interrupt =
                        executed.in_interrupt && !ends.contains(&executed.command.number);
                    return ControlFlow::Continue(());
                }
            };
            if !ok {
                wrong = Some(*executed);
            }
            // What follows from one mistake is not told.
            ControlFlow::Break(())
        });
        prop_assert!(wrong.is_none(), "{wrong:?}\n{findings:#?}");
    }

    #[test]
    fn no_program_is_too_strange_to_be_checked(
        text in "([A-Za-z]{1,3}:|[A-Z]{2,4}|-?[0-9]{1,4}|[,=/; \n]|// tmcl-allow: |// module: ){0,60}",
    ) {
        let options = opentmcl_lang::Options::default();
        let mut sources = opentmcl_lang::include::BuiltInOnly;
        let assembly = opentmcl_lang::assemble("main.tmc", text, &mut sources, options);
        let findings = check::findings(&assembly, Some(tmcm_6214()));
        for finding in findings {
            prop_assert!(assembly.text(finding.location).len() <= 100);
        }
    }
}
