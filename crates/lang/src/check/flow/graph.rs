//! What may come after each command.

use opentmcl_wire::{Command, Opcode};

/// What a command does to the way of the program. Addresses are within the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Goes on behind it.
    Next,
    /// Goes there.
    Jump(u32),
    /// Goes there or on behind it.
    Branch(u32),
    /// Calls a subroutine.
    Call(u32),
    /// Calls a subroutine, or does not.
    CallIf(u32),
    /// Gives up all calls and goes there.
    Restart(u32),
    /// Names an interrupt handler, and goes on behind it.
    Vector(u32),
    /// Ends a subroutine.
    Return,
    /// Ends an interrupt handler.
    ReturnFromInterrupt,
    /// Ends the program.
    End,
}

/// A set of addresses.
#[derive(Clone, Debug, Default)]
pub(super) struct Addresses(Vec<bool>);

impl Addresses {
    pub(super) fn contains(&self, address: u32) -> bool {
        self.0.get(address as usize).copied().unwrap_or_default()
    }

    /// Whether it was not in before.
    pub(super) fn insert(&mut self, address: u32) -> bool {
        match self.0.get_mut(address as usize) {
            Some(place) => !std::mem::replace(place, true),
            None => false,
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.0).filter_map(|(address, &is_in)| is_in.then_some(address))
    }
}

/// The commands of a program as steps from one to the next.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    steps: Vec<Step>,
    sources: Sources,
    /// From where a subroutine can come to its RSUB.
    returning: Addresses,
}

impl Graph {
    pub(super) fn new(commands: impl ExactSizeIterator<Item = Command>) -> Self {
        let len = commands.len();
        let steps: Vec<_> = commands.map(|command| step(command, len)).collect();
        let sources = Sources::new(&steps);
        let returning = returning(&steps, &sources);
        Self { steps, sources, returning }
    }

    pub(super) fn len(&self) -> u32 {
        self.steps.len() as u32
    }

    pub(super) fn step(&self, address: u32) -> Step {
        self.steps.get(address as usize).copied().unwrap_or(Step::End)
    }

    pub(super) fn steps(&self) -> impl DoubleEndedIterator<Item = (u32, Step)> {
        (0..self.len()).zip(self.steps.iter().copied())
    }

    pub(super) fn none(&self) -> Addresses {
        Addresses(vec![false; self.steps.len()])
    }

    /// Whether the program goes on behind a command, supposed that subroutines return.
    pub(super) fn may_go_on(&self, address: u32) -> bool {
        use Step::{Branch, Call, CallIf, Next, Vector};
        matches!(self.step(address), Next | Branch(_) | Call(_) | CallIf(_) | Vector(_))
    }

    /// Whether the program goes on behind a command; behind a call only if there is a way back.
    pub(super) fn goes_on(&self, address: u32) -> bool {
        match self.step(address) {
            Step::Call(target) => self.returns(target),
            _ => self.may_go_on(address),
        }
    }

    /// What comes after a command in the same subroutine.
    pub(super) fn same_level(&self, address: u32) -> [Option<u32>; 2] {
        let next = self.goes_on(address).then_some(address + 1);
        match self.step(address) {
            Step::Jump(target) | Step::Branch(target) => [next, Some(target)],
            _ => [next, None],
        }
    }

    /// The subroutine that a command calls.
    pub(super) fn call(&self, address: u32) -> Option<u32> {
        match self.step(address) {
            Step::Call(target) | Step::CallIf(target) => Some(target),
            _ => None,
        }
    }

    /// Where else a command may go: calls, restarts, but not interrupts.
    pub(super) fn target(&self, address: u32) -> Option<u32> {
        match self.step(address) {
            Step::Restart(target) => Some(target),
            _ => self.call(address),
        }
    }

    /// Adds all that is reached from some addresses.
    pub(super) fn reach<const N: usize>(
        &self,
        reached: &mut Addresses,
        from: impl IntoIterator<Item = u32>,
        after: impl Fn(u32) -> [Option<u32>; N],
    ) {
        let mut open: Vec<u32> = from.into_iter().filter(|&one| reached.insert(one)).collect();
        while let Some(address) = open.pop() {
            let new = after(address).into_iter().flatten();
            open.extend(new.filter(|&one| reached.insert(one)));
        }
    }

    /// Adds all from where a way leads to one of these, subroutines and what calls them included.
    pub(super) fn reach_back(&self, reached: &mut Addresses) {
        let mut open: Vec<u32> = reached.iter().collect();
        while let Some(address) = open.pop() {
            let before = address.checked_sub(1).filter(|&before| self.goes_on(before));
            let sources = self.sources.of(address).iter().copied();
            open.extend(sources.chain(before).filter(|&one| reached.insert(one)));
        }
    }

    /// Whether a way leads from here to an RSUB that belongs to the same subroutine.
    pub(super) fn returns(&self, address: u32) -> bool {
        self.returning.contains(address)
    }

    /// Where a program begins: at its first command, at each of a row of jumps there, by which hosts
    /// choose a function, and where RST takes it.
    pub(super) fn entries(&self) -> Vec<u32> {
        let is_jump = |address: &u32| matches!(self.step(*address), Step::Jump(_));
        let row = (0..self.len()).take_while(is_jump).count() as u32;
        let restarts = self.steps().filter_map(|(_, step)| match step {
            Step::Restart(target) => Some(target),
            _ => None,
        });
        (0..row.max(1)).chain(restarts).collect()
    }

    /// The interrupt handlers.
    pub(super) fn handlers(&self) -> Addresses {
        let mut handlers = self.none();
        for (_, step) in self.steps() {
            if let Step::Vector(target) = step {
                handlers.insert(target);
            }
        }
        handlers
    }
}

fn step(command: Command, len: usize) -> Step {
    let target = u32::try_from(command.value).ok().filter(|&address| (address as usize) < len);
    // What goes outside of the program ends it; of a call that does, the target is wrong, not the rest.
    let or_end = |step: fn(u32) -> Step| target.map_or(Step::End, step);
    let or_next = |step: fn(u32) -> Step| target.map_or(Step::Next, step);
    match Opcode::from_number(command.number) {
        None if command.number == 0 => Step::End,
        Some(Opcode::Stop) => Step::End,
        Some(Opcode::Ja) => or_end(Step::Jump),
        Some(Opcode::Jc | Opcode::Djnz) => or_next(Step::Branch),
        Some(Opcode::Csub) => or_next(Step::Call),
        Some(Opcode::Call) => or_next(Step::CallIf),
        Some(Opcode::Rst) => or_end(Step::Restart),
        Some(Opcode::Vect) => or_next(Step::Vector),
        Some(Opcode::Rsub) => Step::Return,
        Some(Opcode::Reti) => Step::ReturnFromInterrupt,
        _ => Step::Next,
    }
}

/// From where a way leads to RSUB in the same subroutine; a call on the way must return itself.
fn returning(steps: &[Step], sources: &Sources) -> Addresses {
    let mut found = Addresses(vec![false; steps.len()]);
    let returns = (0..).zip(steps).filter(|(_, step)| **step == Step::Return);
    let mut open: Vec<u32> = returns.map(|(address, _)| address).collect();
    for &address in &open {
        found.insert(address);
    }
    while let Some(address) = open.pop() {
        let before = address.checked_sub(1).filter(|&before| match steps[before as usize] {
            Step::Next | Step::Branch(_) | Step::CallIf(_) | Step::Vector(_) => true,
            Step::Call(target) => found.contains(target),
            _ => false,
        });
        for at in sources.of(address).iter().copied().chain(before) {
            let comes_back = match steps[at as usize] {
                Step::Call(_) => found.contains(at + 1) || Some(at) == before,
                Step::Jump(_) | Step::Branch(_) => true,
                _ => Some(at) == before,
            };
            if comes_back && found.insert(at) {
                open.push(at);
            }
        }
    }
    found
}

/// From which jumps and calls each address is reached.
#[derive(Clone, Debug)]
struct Sources {
    starts: Vec<u32>,
    sources: Vec<u32>,
}

impl Sources {
    fn new(steps: &[Step]) -> Self {
        let targets = || {
            (0..).zip(steps).filter_map(|(at, step)| match *step {
                Step::Jump(target)
                | Step::Branch(target)
                | Step::Call(target)
                | Step::CallIf(target) => Some((target as usize, at)),
                _ => None,
            })
        };
        let mut starts = vec![0; steps.len() + 1];
        for (target, _) in targets() {
            starts[target + 1] += 1;
        }
        for at in 1..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut free = starts.clone();
        let mut sources = vec![0; starts.last().map_or(0, |&count| count as usize)];
        for (target, at) in targets() {
            sources[free[target] as usize] = at;
            free[target] += 1;
        }
        Self { starts, sources }
    }

    fn of(&self, address: u32) -> &[u32] {
        let at = address as usize;
        &self.sources[self.starts[at] as usize..self.starts[at + 1] as usize]
    }
}
