//! Commands that nothing leads to, and the end of the program.

use crate::diagnostic::{Code, Diagnostic};

use super::graph::{Addresses, Graph, Step};
use super::{Findings, Program};

/// Tells of code that cannot be reached, and of a program that runs beyond its last command.
pub(super) fn check(program: &Program<'_>, findings: &mut Findings<'_>) {
    let graph = &program.graph;
    let mut reached = Reach::new(graph);
    reached.extend(graph.entries());
    unreferenced(program, &mut reached, findings);
    unreachable(program, &reached, findings);
    if let Some(last) = graph.len().checked_sub(1)
        && reached.contains(last)
        && (graph.may_go_on(last) || reached.ignored.contains(last))
        && let Some(location) = program.location(last)
    {
        let message = "the program goes on behind its last command";
        findings.report(
            Diagnostic::new(Code::RunsOffTheEnd, location, message)
                .help("end it by STOP, or by a jump back"),
        );
    }
}

/// What the module can come to.
struct Reach<'a> {
    graph: &'a Graph,
    reached: Addresses,
    /// Returns that the module may have to ignore: it then goes on behind them.
    ignored: Addresses,
}

impl<'a> Reach<'a> {
    fn new(graph: &'a Graph) -> Self {
        let mut ignored = graph.none();
        let is = |address, step| graph.step(address) == step;
        // Nothing has been called and nothing has been interrupted.
        let mut lowest = graph.none();
        graph.reach(&mut lowest, graph.entries(), |address| {
            let passes = is(address, Step::Return) || is(address, Step::ReturnFromInterrupt);
            within(graph, address, passes)
        });
        // Nothing has been called since the interrupt.
        let mut lowest_in_handlers = graph.none();
        graph.reach(&mut lowest_in_handlers, graph.handlers().iter(), |address| {
            within(graph, address, is(address, Step::Return))
        });
        for address in lowest.iter().chain(lowest_in_handlers.iter()) {
            if is(address, Step::Return) {
                ignored.insert(address);
            }
        }
        let mut outside = graph.none();
        graph.reach(&mut outside, graph.entries(), |address| {
            let passes = ignored.contains(address) || is(address, Step::ReturnFromInterrupt);
            let [next, target] = within(graph, address, passes);
            [next, target, graph.target(address)]
        });
        for address in outside.iter().filter(|&one| is(one, Step::ReturnFromInterrupt)) {
            ignored.insert(address);
        }
        Self { graph, reached: graph.none(), ignored }
    }

    /// Adds all that may happen once these addresses are reached; calls are supposed to return.
    fn extend(&mut self, from: impl IntoIterator<Item = u32>) {
        let Self { graph, ignored, .. } = self;
        graph.reach(&mut self.reached, from, |address| {
            let [next, _] = within(graph, address, ignored.contains(address));
            [next, target(graph.step(address))]
        });
    }

    fn contains(&self, address: u32) -> bool {
        self.reached.contains(address)
    }
}

/// What may come next without a call, if calls return; `passes` if a return is ignored.
fn within(graph: &Graph, address: u32, passes: bool) -> [Option<u32>; 2] {
    let next = (passes || graph.may_go_on(address)).then_some(address + 1);
    match graph.step(address) {
        Step::Jump(target) | Step::Branch(target) => [next, Some(target)],
        _ => [next, None],
    }
}

const fn target(step: Step) -> Option<u32> {
    match step {
        Step::Jump(target)
        | Step::Branch(target)
        | Step::Call(target)
        | Step::CallIf(target)
        | Step::Restart(target)
        | Step::Vector(target) => Some(target),
        Step::Next | Step::Return | Step::ReturnFromInterrupt | Step::End => None,
    }
}

/// Code behind a label may be started by a host: it counts as reached once it has been told.
fn unreferenced(program: &Program<'_>, reached: &mut Reach<'_>, findings: &mut Findings<'_>) {
    let graph = &program.graph;
    let mut targets = graph.none();
    for target in graph.steps().filter_map(|(_, step)| target(step)) {
        targets.insert(target);
    }
    // First what nothing refers to: what else it leads to is no matter of its own.
    for is_target in [false, true] {
        for &(address, name) in &program.labels {
            let is_in = address < graph.len();
            if !is_in || reached.contains(address) || targets.contains(address) != is_target {
                continue;
            }
            reached.extend([address]);
            if is_customary_end(graph, address..address + 1) {
                continue;
            }
            let Some(location) = program.location(address) else { continue };
            let message = format!("nothing in the program leads to {name}");
            findings.report(
                Diagnostic::new(Code::UnreferencedCode, location, message)
                    .help(format!("only a host that starts at address {address} comes here")),
            );
        }
    }
}

fn unreachable(program: &Program<'_>, reached: &Reach<'_>, findings: &mut Findings<'_>) {
    let graph = &program.graph;
    let mut address = 0;
    while address < graph.len() {
        let start = address;
        while address < graph.len() && !reached.contains(address) {
            address += 1;
        }
        let is_told = start < address && !is_customary_end(graph, start..address);
        if is_told && let Some(location) = program.location(start) {
            let count = address - start;
            let (message, help) = match count {
                1 => (
                    "nothing leads to this command",
                    "remove it, or give it a label by which it is reached".into(),
                ),
                _ => (
                    "nothing leads to these commands",
                    format!("remove all {count}, or give them a label by which they are reached"),
                ),
            };
            findings.report(Diagnostic::new(Code::UnreachableCode, location, message).help(help));
        }
        address += 1;
    }
}

/// People like to see a STOP or RSUB at the end of what never ends.
fn is_customary_end(graph: &Graph, mut addresses: std::ops::Range<u32>) -> bool {
    addresses.all(|address| {
        matches!(graph.step(address), Step::End | Step::Return | Step::ReturnFromInterrupt)
    })
}
