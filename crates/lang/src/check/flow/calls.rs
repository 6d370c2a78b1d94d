//! How deep subroutines call each other, and returns from nowhere.

use std::collections::BTreeSet;

use opentmcl_wire::limits::STACK_DEPTH;

use crate::diagnostic::{Code, Diagnostic};

use super::graph::{Addresses, Graph, Step};
use super::{Findings, Program};

/// No call leads here.
const NONE: u32 = u32::MAX;

/// Tells of calls for which the stack may have no room, and of returns without a call.
pub(super) fn check(program: &Program<'_>, findings: &mut Findings<'_>) {
    let graph = &program.graph;
    let mut outside = graph.none();
    graph.reach(&mut outside, graph.entries(), |address| graph.same_level(address));
    returns(program, &outside, findings);
    depth(program, outside, findings);
}

fn returns(program: &Program<'_>, outside: &Addresses, findings: &mut Findings<'_>) {
    for address in outside.iter().filter(|&one| program.graph.step(one) == Step::Return) {
        let Some(location) = program.location(address) else { continue };
        let message = "the program can come to this RSUB without a call";
        findings.report(
            Diagnostic::new(Code::ReturnWithoutCall, location, message)
                .help("end by STOP or JA what stands before the subroutine, and call it by CSUB"),
        );
    }
}

/// Follows all ways through the program level by level, as many as the stack has, and so finds what
/// would need one more.
fn depth(program: &Program<'_>, mut outside: Addresses, findings: &mut Findings<'_>) {
    let graph = &program.graph;
    let handlers = graph.handlers();
    graph.reach(&mut outside, handlers.iter(), |address| graph.same_level(address));
    let mut levels: Vec<Vec<u32>> = Vec::new();
    let mut calls: Vec<u32> = outside.iter().filter(|&one| graph.call(one).is_some()).collect();
    while levels.len() < STACK_DEPTH && !calls.is_empty() {
        let (via, next) = level(graph, &calls);
        levels.push(via);
        calls = next;
    }
    // Of several calls that close the same circle one is enough.
    let mut circles = BTreeSet::new();
    for call in calls {
        let path = path(&levels, call);
        match circle(program, &path) {
            Some(closing) => {
                if circles.insert(graph.call(closing)) {
                    recursion(program, closing, findings);
                }
            }
            None => too_deep(program, call, &path, findings),
        }
    }
}

/// One level deeper: which of the calls leads to each address, and the calls that are there.
fn level(graph: &Graph, calls: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut via = vec![NONE; graph.len() as usize];
    let mut next = Vec::new();
    let mut open = Vec::new();
    for &call in calls {
        open.extend(graph.call(call));
        while let Some(address) = open.pop() {
            let Some(place) = via.get_mut(address as usize) else { continue };
            if *place != NONE {
                continue;
            }
            *place = call;
            if graph.call(address).is_some() {
                next.push(address);
            }
            open.extend(graph.same_level(address).into_iter().flatten());
        }
    }
    (via, next)
}

/// The calls that lead to one on the last level, the first first and this one last.
fn path(levels: &[Vec<u32>], call: u32) -> Vec<u32> {
    let mut path = vec![call];
    let mut at = call;
    for via in levels.iter().rev() {
        at = via.get(at as usize).copied().unwrap_or(NONE);
        path.push(at);
    }
    path.reverse();
    path
}

/// The first call on a path to a subroutine that is under way already.
fn circle(program: &Program<'_>, path: &[u32]) -> Option<u32> {
    let mut under_way = BTreeSet::new();
    path.iter().copied().find(|&call| !under_way.insert(program.graph.call(call)))
}

fn recursion(program: &Program<'_>, call: u32, findings: &mut Findings<'_>) {
    let (Some(location), Some(target)) = (program.location(call), program.graph.call(call)) else {
        return;
    };
    let message = format!("{} is called again before it has returned", program.name(target));
    findings.report(Diagnostic::new(Code::RecursiveCall, location, message).help(format!(
        "each turn takes one of {STACK_DEPTH} levels, and calls beyond are ignored; leave a \
         subroutine by RSUB, or begin anew by RST"
    )));
}

fn too_deep(program: &Program<'_>, call: u32, path: &[u32], findings: &mut Findings<'_>) {
    let Some(location) = program.location(call) else { return };
    let names = path.iter().filter_map(|&call| program.graph.call(call));
    let names: Vec<_> = names.map(|target| program.name(target)).collect();
    let message = format!("this call is ignored: it would be level {}", path.len());
    findings.report(
        Diagnostic::new(Code::CallsTooDeep, location, message)
            .help(format!("there are {STACK_DEPTH} levels; {}", names.join(" > "))),
    );
}
