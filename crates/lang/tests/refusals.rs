//! The checks against the firmware itself: an error is told exactly where a module refuses.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::ControlFlow;

use opentmcl_catalog::{Mode, Module};
use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Options, assemble, check, diagnostic::Severity};
use opentmcl_virtual::VirtualModule;
use opentmcl_wire::opcode::{FORMS, Field, Form, Meaning};
use opentmcl_wire::{Command, Duration, Opcode, Status, mnemonic};

/// Fewer commands than findings are told of one program, since one may have several.
const BATCH: usize = 300;

fn module() -> &'static Module {
    opentmcl_catalog::find("tmcm-6214").unwrap()
}

/// Which of the commands have an error, each looked at by itself but for its place in a program.
fn errors(commands: &[Command]) -> Vec<bool> {
    let mut errors = Vec::new();
    for batch in commands.chunks(BATCH) {
        let mut text = String::new();
        for Command { number, kind, motor, value } in batch {
            writeln!(text, "{number} {kind}, {motor}, {value}").unwrap();
        }
        let assembly = assemble("batch", text, &mut BuiltInOnly, Options::default());
        assert!(assembly.is_valid(), "{:?}", assembly.diagnostics);
        let tree = &assembly.files[0].tree;
        let lines: BTreeSet<usize> = check::findings(&assembly, Some(module()))
            .iter()
            .filter(|finding| finding.severity() == Severity::Error)
            .map(|finding| tree.line_at(finding.location.span.start))
            .collect();
        errors.extend((0..batch.len()).map(|line| lines.contains(&line)));
    }
    errors
}

/// How a new module takes a command: by a host where it may be sent by one, else in a program.
fn status(command: Command) -> Status {
    let mut virtual_module = VirtualModule::new(module());
    // X names an axis that has every parameter; the accumulator is 0.
    for text in ["CALC LOAD, 3", "CALCX LOAD", "CALC LOAD, 0"] {
        assert!(virtual_module.execute(mnemonic::parse(text).unwrap()).status.is_ok());
    }
    let row = module().command(command.number);
    if row.is_none_or(|row| row.mode != Mode::Standalone) {
        return virtual_module.execute(command).status;
    }
    let control = |number| Command::new(number, 0, 0, 0);
    for step in [control(132), command, control(133), control(129)] {
        assert!(virtual_module.execute(step).status.is_ok(), "{step}");
    }
    let mut status = None;
    let soon = virtual_module.now() + Duration::from_millis(1);
    let _ = virtual_module.advance_watched(soon, |executed| {
        status = Some(executed.status);
        ControlFlow::Break(())
    });
    // A WAIT that lasts has been taken.
    status.unwrap_or(Status::OK)
}

/// Values on both sides of every limit that may hold for a command.
fn values(form: &Form, kind: u8, motor: u8) -> Vec<i32> {
    let mut values = BTreeSet::from([0]);
    let mut around = |limits: [i64; 2]| {
        for limit in limits {
            for value in [limit - 1, limit, limit + 1] {
                values.extend(i32::try_from(value));
                values.extend(u32::try_from(value).map(|bits| bits as i32));
            }
        }
    };
    match form.opcode {
        Opcode::Sap | Opcode::Sapx => match module().axis_parameter(kind) {
            Some(row) => {
                around([row.min.into(), row.max.into()]);
                around([row.default.into(), row.internal_max.into()]);
                if row.values.len() > 2 {
                    // Choices with gaps.
                    for &(value, _) in row.values {
                        around([value.into(); 2]);
                    }
                }
            }
            None => around([0, 1]),
        },
        Opcode::Sgp => match module().global_parameter(motor, kind) {
            Some(row) => around([row.min, row.max]),
            None => around([0, 1]),
        },
        Opcode::Sio => match module().output_port(motor, kind) {
            Some(row) => around([row.min.into(), row.max.into()]),
            None => around([0, 1]),
        },
        Opcode::Ror | Opcode::Rol => {
            // Firmware manual, parameter 2: the largest value of the chip's register in pps.
            around([-7_999_774, 7_999_774]);
            around([i32::MIN.into(), i32::MAX.into()]);
        }
        // Where a jump goes is no matter of the single command.
        _ if form.operands.iter().any(|operand| operand.meaning == Meaning::Address) => {}
        _ => {
            around([0, 20]);
            around([255, 2047]);
            around([i32::MIN.into(), i32::MAX.into()]);
        }
    }
    values.into_iter().collect()
}

/// Commands of all kinds, right ones and wrong ones.
fn sample() -> Vec<Command> {
    // Axes with and without encoder, banks, and what is neither.
    const MOTORS: [u8; 7] = [0, 1, 2, 3, 5, 6, 255];
    // Sets of axes.
    const MOVES: [u8; 10] = [0, 5, 6, 0x3F, 0x40, 0x47, 0x80, 0x85, 0xC0, 0xFF];
    let mut commands = Vec::new();
    for form in FORMS {
        let uses = |field| form.operands.iter().any(|operand| operand.field == field);
        let kinds = if uses(Field::Kind) { 0..=255 } else { 0..=0 };
        let words = form.operands.first().is_some_and(|operand| !operand.words.is_empty());
        for kind in kinds.filter(|kind| !words || *kind < 20 || *kind == 255) {
            let motors = match form.opcode {
                _ if !uses(Field::Motor) => &MOTORS[..1],
                Opcode::Mvp | Opcode::Mvpa => &MOVES[..],
                _ => &MOTORS[..],
            };
            for &motor in motors {
                let has_value = uses(Field::Value);
                let values = if has_value { values(form, kind, motor) } else { vec![0] };
                let number = form.opcode.number();
                commands
                    .extend(values.iter().map(|&value| Command::new(number, kind, motor, value)));
            }
        }
    }
    commands.extend((1..128).map(|number| Command::new(number, 0, 0, 0)));
    commands
}

/// What a module refuses only at times, so that nobody can tell it from the program.
fn depends_on_what_was_before(command: Command, status: Status) -> bool {
    match Opcode::from_number(command.number) {
        // The accumulator, which is 0 here, is the value.
        Some(Opcode::Aap | Opcode::Aapx | Opcode::Agp) => status == Status::INVALID_VALUE,
        // The largest hysteresis is there with the classic chopper only.
        Some(Opcode::Sap | Opcode::Sapx) => command.kind == 166 && command.value == 8,
        // Nothing has been called or interrupted: flow checks.
        Some(Opcode::Rsub | Opcode::Reti) => true,
        _ => false,
    }
}

#[test]
fn an_error_is_told_exactly_where_the_module_refuses() {
    let is_unit_mode =
        |command: &Command| matches!(command.number, 5 | 16 | 18 | 34) && command.kind == 255;
    // With unit mode 0 other ranges hold; a program that sets it is looked at by itself.
    let (unit_mode, others): (Vec<_>, Vec<_>) = sample().into_iter().partition(is_unit_mode);
    let mut differences = Vec::new();
    let mut counts = [0, 0];
    for commands in [unit_mode, others] {
        for (command, is_error) in commands.iter().zip(errors(&commands)) {
            let status = status(*command);
            let is_refused = !status.is_ok();
            counts[usize::from(is_refused)] += 1;
            let is_known = !is_error && depends_on_what_was_before(*command, status);
            if is_error != is_refused && !is_known {
                let told = if is_error { "an error" } else { "nothing" };
                differences.push(format!("{command:?}: {told} is told, the module says {status}"));
            }
        }
    }
    assert!(
        differences.is_empty(),
        "{} differences, e.g. {:#?}",
        differences.len(),
        &differences[..differences.len().min(20)]
    );
    // Both halves of the statement have been looked at.
    assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
}

#[test]
fn commands_for_hosts_are_errors_in_a_program() {
    let commands: Vec<_> = (128..=255).map(|number| Command::new(number, 0, 0, 0)).collect();
    assert!(errors(&commands).iter().all(|is_error| *is_error));
}
