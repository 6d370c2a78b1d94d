//! Interrupts of a program: which are enabled, which have occurred, where their handlers are.
//!
//! An interrupt is remembered from its event until its handler starts, once, and only while it is
//! enabled. Handlers start between two commands of a running program, lowest number first, and never
//! inside another handler (firmware manual 3.5.6).

use opentmcl_wire::{Duration, Instant};

/// Interrupt number that switches all of them (EI 255).
pub(crate) const GLOBAL: u8 = 255;

/// Interrupt numbers are below this.
const NUMBERS: usize = 64;

/// Timers, the interrupts 0..=2.
pub(crate) const TIMERS: usize = 3;

/// One periodic timer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Timer {
    /// Milliseconds between two interrupts; 0 off.
    period_ms: u32,
    /// When it is due, while it runs.
    due: Option<Instant>,
}

/// State of all interrupts.
#[derive(Clone, Debug)]
pub(crate) struct Interrupts {
    global: bool,
    enabled: u64,
    pending: u64,
    defined: u64,
    vectors: [u16; NUMBERS],
    /// Which edges trigger: bit 0 rising, bit 1 falling.
    transitions: [u8; NUMBERS],
    timers: [Timer; TIMERS],
}

const fn bit(number: u8) -> u64 {
    if (number as usize) < NUMBERS { 1 << (number % 64) } else { 0 }
}

impl Interrupts {
    pub(crate) const fn new() -> Self {
        Self {
            global: false,
            enabled: 0,
            pending: 0,
            defined: 0,
            vectors: [0; NUMBERS],
            transitions: [0; NUMBERS],
            timers: [Timer { period_ms: 0, due: None }; TIMERS],
        }
    }

    pub(crate) fn enable(&mut self, number: u8, now: Instant) {
        if number == GLOBAL {
            self.global = true;
            return;
        }
        self.enabled |= bit(number);
        if let Some(timer) = self.timers.get_mut(usize::from(number)) {
            timer.start(now);
        }
    }

    pub(crate) fn disable(&mut self, number: u8) {
        if number == GLOBAL {
            self.global = false;
            return;
        }
        self.enabled &= !bit(number);
        self.pending &= !bit(number);
        if let Some(timer) = self.timers.get_mut(usize::from(number)) {
            timer.due = None;
        }
    }

    pub(crate) const fn is_enabled(&self, number: u8) -> bool {
        self.enabled & bit(number) != 0
    }

    /// Whether an interrupt with this number or a higher one is enabled.
    pub(crate) const fn any_enabled_from(&self, number: u8) -> bool {
        self.enabled >> (number % 64) != 0
    }

    pub(crate) fn set_vector(&mut self, number: u8, address: u16) {
        if let Some(vector) = self.vectors.get_mut(usize::from(number)) {
            *vector = address;
            self.defined |= bit(number);
        }
    }

    /// An event has occurred.
    pub(crate) fn raise(&mut self, number: u8) {
        self.pending |= bit(number) & self.enabled;
    }

    /// A level has changed; occurs if this edge is configured.
    pub(crate) fn edge(&mut self, number: u8, rising: bool) {
        let edges = self.transitions(number);
        if edges & if rising { 1 } else { 2 } != 0 {
            self.raise(number);
        }
    }

    /// Takes the most urgent interrupt whose handler may start, and its address.
    pub(crate) fn take(&mut self) -> Option<u16> {
        let ready = self.pending & self.enabled & self.defined;
        if !self.global || ready == 0 {
            return None;
        }
        let number = ready.trailing_zeros();
        self.pending &= !(1 << number);
        self.vectors.get(number as usize).copied()
    }

    /// Whether [`Interrupts::take`] would give one.
    pub(crate) const fn is_ready(&self) -> bool {
        self.global && self.pending & self.enabled & self.defined != 0
    }

    /// Forgets what has occurred.
    pub(crate) fn clear_pending(&mut self) {
        self.pending = 0;
    }

    pub(crate) fn transitions(&self, number: u8) -> u8 {
        self.transitions.get(usize::from(number)).copied().unwrap_or_default()
    }

    pub(crate) fn set_transitions(&mut self, number: u8, edges: u8) {
        if let Some(place) = self.transitions.get_mut(usize::from(number)) {
            *place = edges;
        }
    }

    pub(crate) fn timer_period(&self, timer: u8) -> u32 {
        self.timers.get(usize::from(timer)).map_or(0, |timer| timer.period_ms)
    }

    pub(crate) fn set_timer_period(&mut self, number: u8, period_ms: u32, now: Instant) {
        let enabled = self.is_enabled(number);
        if let Some(timer) = self.timers.get_mut(usize::from(number)) {
            timer.period_ms = period_ms;
            timer.due = None;
            if enabled {
                timer.start(now);
            }
        }
    }

    /// Starts the enabled timers anew when a program starts: they stand still without one.
    pub(crate) fn restart_timers(&mut self, now: Instant) {
        for number in 0..TIMERS as u8 {
            let enabled = self.is_enabled(number);
            if let Some(timer) = self.timers.get_mut(usize::from(number)) {
                timer.due = None;
                if enabled {
                    timer.start(now);
                }
            }
        }
    }

    /// When the next timer is due.
    pub(crate) fn next_timer(&self) -> Option<Instant> {
        self.timers.iter().filter_map(|timer| timer.due).min()
    }

    /// Raises the interrupts of timers that are due.
    pub(crate) fn run_timers(&mut self, now: Instant) {
        for number in 0..TIMERS as u8 {
            let Some(timer) = self.timers.get_mut(usize::from(number)) else { continue };
            if let Some(due) = timer.due.filter(|&due| due <= now) {
                timer.due = Some(due + timer.period());
                self.raise(number);
            }
        }
    }
}

impl Timer {
    fn period(self) -> Duration {
        Duration::from_millis(u64::from(self.period_ms))
    }

    fn start(&mut self, now: Instant) {
        if self.period_ms != 0 && self.due.is_none() {
            self.due = Some(now + self.period());
        }
    }
}
