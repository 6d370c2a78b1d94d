//! Interrupt handlers: how the program comes to them and leaves them, and whether it ever does.

use std::collections::{BTreeMap, BTreeSet};

use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::Field;

use crate::diagnostic::{Code, Diagnostic};

use super::graph::{Addresses, Graph, Step};
use super::{Findings, Program};

/// Number of the interrupt that switches all of them.
const ALL: u8 = 255;

/// Tells of handlers that do not end, of ways into them, and of interrupts without one half.
pub(super) fn check(program: &Program<'_>, findings: &mut Findings<'_>) {
    let handlers = program.graph.handlers();
    let outside = outside(&program.graph, &handlers);
    ways_in(program, &handlers, &outside, findings);
    ways_out(program, &handlers, &outside, findings);
    numbers(program, findings);
}

/// What is executed without an interrupt. That the program runs into a handler is told by itself, and
/// what follows from it is not.
fn outside(graph: &Graph, handlers: &Addresses) -> Addresses {
    let mut outside = graph.none();
    graph.reach(&mut outside, graph.entries(), |address| {
        let [next, target] = graph.same_level(address);
        let next = next.filter(|&next| !handlers.contains(next));
        [next, target, graph.target(address)]
    });
    outside
}

fn ways_in(
    program: &Program<'_>,
    handlers: &Addresses,
    outside: &Addresses,
    findings: &mut Findings<'_>,
) {
    let graph = &program.graph;
    for handler in handlers.iter() {
        let Some(before) = handler.checked_sub(1) else { continue };
        if !outside.contains(before) || !graph.goes_on(before) {
            continue;
        }
        let Some(location) = program.location(handler) else { continue };
        let message = format!("the program runs into the handler {}", program.name(handler));
        let mut diagnostic = Diagnostic::new(Code::FallsIntoHandler, location, message)
            .help("end by STOP or JA what stands before it");
        if let Some(before) = program.location(before) {
            diagnostic = diagnostic.related(before, "from here");
        }
        findings.report(diagnostic);
    }
    for address in outside.iter().filter(|&one| graph.step(one) == Step::ReturnFromInterrupt) {
        let Some(location) = program.location(address) else { continue };
        let message = "the program can come to this RETI without an interrupt";
        findings.report(
            Diagnostic::new(Code::RetiOutsideHandler, location, message)
                .help("only a handler that VECT names ends by RETI; a subroutine ends by RSUB"),
        );
    }
}

fn ways_out(
    program: &Program<'_>,
    handlers: &Addresses,
    outside: &Addresses,
    findings: &mut Findings<'_>,
) {
    let graph = &program.graph;
    let mut inside = graph.none();
    graph.reach(&mut inside, handlers.iter(), |address| graph.same_level(address));
    for address in inside.iter().filter(|&one| graph.step(one) == Step::Return) {
        let Some(location) = program.location(address) else { continue };
        let message = "this RSUB is in an interrupt handler";
        findings.report(
            Diagnostic::new(Code::RsubInHandler, location, message).help("a handler ends by RETI"),
        );
    }
    let mut called = graph.none();
    let calls = inside.iter().filter_map(|address| graph.call(address));
    graph.reach(&mut called, calls, |address| {
        let [next, target] = graph.same_level(address);
        [next, target, graph.call(address)]
    });
    let is_reti = |&one: &u32| graph.step(one) == Step::ReturnFromInterrupt;
    for address in called.iter().filter(is_reti).filter(|&one| !outside.contains(one)) {
        let Some(location) = program.location(address) else { continue };
        let message = "this RETI is in a subroutine";
        findings.report(
            Diagnostic::new(Code::RetiInSubroutine, location, message)
                .help("a subroutine ends by RSUB, and the handler that calls it by RETI"),
        );
    }
    let ending = ending(graph);
    let ends = |&handler: &u32| ending.contains(handler) || graph.returns(handler);
    for handler in handlers.iter().filter(|handler| !ends(handler)) {
        let Some(location) = program.location(handler) else { continue };
        let message = format!("the handler {} never ends", program.name(handler));
        findings.report(
            Diagnostic::new(Code::HandlerWithoutReti, location, message)
                .help("a handler ends by RETI; until then no interrupt is served"),
        );
    }
}

/// From where a way leads to the end of a handler or of the program.
fn ending(graph: &Graph) -> Addresses {
    let mut ending = graph.none();
    let last = graph.len().checked_sub(1).filter(|&last| graph.may_go_on(last));
    for (address, step) in graph.steps() {
        use Step::{End, Restart, ReturnFromInterrupt};
        if matches!(step, End | Restart(_) | ReturnFromInterrupt) || Some(address) == last {
            ending.insert(address);
        }
    }
    graph.reach_back(&mut ending);
    ending
}

/// Interrupts of which only one half is there: enabled, or with a handler.
fn numbers(program: &Program<'_>, findings: &mut Findings<'_>) {
    let mut enabled = BTreeSet::new();
    let mut vectors = BTreeMap::new();
    for (address, command) in (0..).zip(program.assembly.commands()) {
        match Opcode::from_number(command.number) {
            Some(Opcode::Ei) => {
                enabled.insert(command.kind);
            }
            Some(Opcode::Vect) if command.kind != ALL => {
                vectors.entry(command.kind).or_insert(address);
            }
            _ => {}
        }
    }
    for (address, command) in (0..).zip(program.assembly.commands()) {
        let is_half = command.number == Opcode::Ei.number()
            && command.kind != ALL
            && !vectors.contains_key(&command.kind);
        if !is_half {
            continue;
        }
        let Some(subject) = program.subject(address) else { continue };
        let shown = subject.shown(Field::Kind);
        let message = format!("interrupt {shown} has no handler");
        let help = format!("VECT {}, <label> names one", command.kind);
        let location = subject.operand(Field::Kind);
        findings
            .report(Diagnostic::new(Code::InterruptWithoutVector, location, message).help(help));
    }
    for (&number, &address) in &vectors {
        let missing = [number, ALL].into_iter().filter(|number| !enabled.contains(number));
        let missing: Vec<_> = missing.map(|number| format!("EI {number}")).collect();
        let Some(subject) = program.subject(address) else { continue };
        if missing.is_empty() {
            continue;
        }
        let message = format!("interrupt {} is never enabled", subject.shown(Field::Kind));
        let help = format!("the program lacks {}", missing.join(" and "));
        let location = subject.operand(Field::Kind);
        findings.report(Diagnostic::new(Code::InterruptNotEnabled, location, message).help(help));
    }
}
