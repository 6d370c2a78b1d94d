//! How a machine goes on in a span of time: winding, rotor and supply at once.
//!
//! In a span, the duties are constant, and the rotor's angle is that of its middle. Winding and capacitor follow their
//! exponentials. The mean current, the mean speed and the mean bus voltage depend on each other, linearly, and are
//! solved for together: what the EMF takes from the winding is what the rotor gets, and what the winding takes from the
//! bus is what the bus loses. So energy is kept, and no span, inductance, inertia or capacitance is too small.

use super::bridge::{Connection, Legs, Path, Vector, Wiring, dot};
use super::decay::Decay;
use super::mechanics::{Motion, RADIANS, Shaft, ShaftSpan, TURN, sine_cosine};
use super::motor::Motor;
use super::supply::SupplySpan;
use super::thermal::Heat;
use super::{Machine, PERIOD_SECONDS};

/// A current in ampere that is none.
const NO_CURRENT: f64 = 1e-15;

/// Constants of a winding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Winding {
    pub(super) wiring: Wiring,
    /// Electrical turns per fine step.
    pub(super) turns: f64,
    /// Resistance of a phase, switches included, in ohm.
    resistance: f64,
    inductance: f64,
    /// Amplitude of a phase's EMF in volt per rad/s.
    pub(super) emf: f64,
    /// Power is so many times the product of the vectors of voltage and current.
    pub(super) scale: f64,
}

/// What follows from the data of a machine.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) machine: Machine,
    pub(super) winding: Winding,
    pub(super) shaft: Shaft,
    pub(super) heat: Heat,
    source_conductance: f64,
    period: Span,
}

/// What follows from the length of a span.
#[derive(Clone, Copy, Debug)]
struct Span {
    seconds: f64,
    /// Fine steps in half of it at 1 rad/s.
    half: f64,
    shaft: ShaftSpan,
    winding: Decay,
    supply: SupplySpan,
}

/// What a span changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dynamics {
    /// Current in ampere.
    pub(super) current: Vector,
    /// Position in fine steps.
    pub(super) position: f64,
    /// Speed in rad/s.
    pub(super) speed: f64,
    /// Bus voltage in volt.
    pub(super) bus: f64,
    /// Mean current out of the bus in the last span in ampere.
    pub(super) bus_current: f64,
    /// Direction of the EMF in the middle of a control period that begins now. It is found at the end of a step and
    /// not at the beginning of the next one, so that the processor has it ready then.
    pub(super) field: Vector,
}

/// What acts on it in a span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inputs {
    pub(super) legs: Legs,
    pub(super) chopper: bool,
    /// Dry friction in Nm, that of the holding brake included.
    pub(super) friction: f64,
    /// Torque from outside in Nm.
    pub(super) external: f64,
    pub(super) blocked: bool,
    /// Voltage of the source in volt.
    pub(super) source: f64,
}

/// Solution for one span.
struct Solved {
    next: Dynamics,
    /// Mean square of the current.
    square: f64,
}

impl Plan {
    pub(super) fn new(machine: Machine) -> Self {
        let switches = machine.bridge.switch_resistance;
        let mut winding = match &machine.motor {
            Motor::Brushless(motor) => Winding {
                wiring: Wiring::Star,
                turns: f64::from(motor.pole_pairs) / TURN,
                resistance: motor.resistance,
                inductance: motor.inductance,
                emf: motor.flux_linkage * f64::from(motor.pole_pairs),
                scale: 1.5,
            },
            Motor::Brushed(motor) => Winding {
                wiring: Wiring::Single,
                turns: 1.0 / TURN,
                resistance: motor.resistance,
                inductance: motor.inductance,
                emf: motor.torque_constant,
                scale: 1.0,
            },
        };
        let switches = match winding.wiring {
            Wiring::Star => switches,
            Wiring::Single => 2.0 * switches,
        };
        let scale = winding.scale;
        let heat = Heat::new(&machine.thermal, scale * winding.resistance, scale * switches);
        winding.resistance += switches;
        let shaft = Shaft::new(&machine);
        Self {
            period: Span::new(&winding, &shaft, &machine, PERIOD_SECONDS, None),
            source_conductance: machine.supply.source_conductance(),
            machine,
            winding,
            shaft,
            heat,
        }
    }

    /// Goes on by one control period.
    pub(super) fn period(&self, now: &mut Dynamics, inputs: &Inputs) -> f64 {
        self.pass(now, inputs, &self.period)
    }

    /// Goes on by a part of a control period. Gives the integral of the square of the current.
    pub(super) fn part(&self, now: &mut Dynamics, inputs: &Inputs, seconds: f64) -> f64 {
        self.pass(now, inputs, &self.span(seconds, inputs))
    }

    #[inline(always)]
    fn pass(&self, now: &mut Dynamics, inputs: &Inputs, span: &Span) -> f64 {
        let field = self.field(now, span);
        let emf = self.winding.emf * now.speed;
        let Some(path) = inputs.legs.path(now.current, field, emf, now.bus) else {
            return self.pass_with_diodes(now, inputs, span);
        };
        let solved = self.solve(now, inputs, span, &path);
        *now = solved.next;
        self.look_ahead(now);
        solved.square * span.seconds
    }

    /// To be done when position or speed has been changed.
    #[inline(always)]
    pub(super) fn look_ahead(&self, now: &mut Dynamics) {
        now.field = self.direction_ahead(now, self.period.half);
    }

    /// Diodes let go when their current ends, which divides the span.
    #[inline(never)]
    fn pass_with_diodes(&self, now: &mut Dynamics, inputs: &Inputs, whole: &Span) -> f64 {
        /// There are three diodes that can end and begin; the bound is for what nobody has thought of.
        const ENDS: usize = 8;
        let mut squares = 0.0;
        let mut left = whole.seconds;
        let mut refused = [false; 3];
        let mut rest = None;
        for round in 1..=ENDS {
            let span = rest.as_ref().unwrap_or(whole);
            let connection = self.connect(now, inputs, span, refused);
            let solved = self.solve(now, inputs, span, &connection.path);
            let end = self.diode_end(&connection, &solved.next, span);
            let Some((leg, part)) = end.filter(|_| round < ENDS) else {
                *now = solved.next;
                self.look_ahead(now);
                return squares + solved.square * left;
            };
            if part <= 0.0 {
                // It does not begin to conduct after all.
                refused[leg] = true;
                continue;
            }
            let until = left * part.min(1.0);
            let span = self.span(until, inputs);
            let connection = self.connect(now, inputs, &span, refused);
            let solved = self.solve(now, inputs, &span, &connection.path);
            *now = solved.next;
            now.current = self.winding.wiring.without(leg, now.current);
            self.look_ahead(now);
            squares += solved.square * until;
            left -= until;
            refused[leg] = true;
            if left <= 1e-9 {
                break;
            }
            rest = Some(self.span(left, inputs));
        }
        squares
    }

    /// The first diode whose current would have changed its sign at the end, and the part of the span after which
    /// it is 0.
    fn diode_end(
        &self,
        connection: &Connection,
        next: &Dynamics,
        span: &Span,
    ) -> Option<(usize, f64)> {
        let wiring = self.winding.wiring;
        let before = wiring.currents(connection.path.current);
        let after = wiring.currents(next.current);
        let keep = span.winding.keep;
        (0..3)
            .filter(|&leg| connection.diodes[leg] * after[leg] < 0.0)
            .map(|leg| {
                if connection.diodes[leg] * before[leg] <= 0.0 {
                    return (leg, 0.0);
                }
                // Towards a final value, so that what is left of the way to it goes from 1 to `keep`.
                let end = (after[leg] - keep * before[leg]) / (1.0 - keep);
                (leg, libm::log(end / (end - before[leg])) / libm::log(keep))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Direction of the EMF in the middle of a span.
    #[inline(always)]
    fn field(&self, now: &Dynamics, span: &Span) -> Vector {
        if span.seconds == PERIOD_SECONDS {
            now.field
        } else {
            self.direction_ahead(now, span.half)
        }
    }

    /// Direction of the EMF after a way in fine steps per rad/s.
    #[inline(always)]
    fn direction_ahead(&self, now: &Dynamics, way: f64) -> Vector {
        match self.winding.wiring {
            Wiring::Star => self.direction(now.position + now.speed * way),
            Wiring::Single => [1.0, 0.0],
        }
    }

    /// Direction of the EMF of a motor with three phases at a position.
    #[inline(always)]
    pub(super) fn direction(&self, position: f64) -> Vector {
        let (sine, cosine) = sine_cosine(position * self.winding.turns);
        [-sine, cosine]
    }

    fn span(&self, seconds: f64, inputs: &Inputs) -> Span {
        Span::new(&self.winding, &self.shaft, &self.machine, seconds, Some(inputs.chopper))
    }

    fn connect(
        &self,
        now: &Dynamics,
        inputs: &Inputs,
        span: &Span,
        refused: [bool; 3],
    ) -> Connection {
        let field = (self.field(now, span), self.winding.emf * now.speed);
        inputs.legs.connect(self.winding.wiring, now.current, field, now.bus, refused)
    }

    #[inline(always)]
    fn solve(&self, now: &Dynamics, inputs: &Inputs, span: &Span, path: &Path) -> Solved {
        let mut with_source = now.bus <= inputs.source;
        let (mut motion, mut bus) = self.means(now, inputs, span, path, with_source);
        if with_source && bus > inputs.source {
            // The diode keeps power from flowing into the source.
            with_source = false;
            (motion, bus) = self.means_without_source(now, inputs, span, path);
        }
        let Winding { emf, scale, .. } = self.winding;
        let Path { duty, field, current, .. } = *path;
        let winding = &span.winding;
        let lost = emf * motion.mean;
        let volts = [duty[0] * bus - field[0] * lost, duty[1] * bus - field[1] * lost];
        let mean = [winding.mean(current[0], volts[0]), winding.mean(current[1], volts[1])];
        let end = [winding.end(current[0], volts[0]), winding.end(current[1], volts[1])];
        let bus_current = scale * dot(duty, mean);
        let change = [end[0] - current[0], end[1] - current[1]];
        let supply = span.supply.decay(with_source, inputs.chopper);
        let push = self.push(inputs, with_source) - bus_current;
        let next = Dynamics {
            current: [or_none(end[0]), or_none(end[1])],
            position: motion.position,
            speed: motion.speed,
            bus: supply.end(now.bus, push).max(0.0),
            bus_current,
            field: now.field,
        };
        Solved { next, square: dot(mean, mean) + dot(change, change) * (1.0 / 12.0) }
    }

    /// What the source pushes into the bus, in ampere at 0 V.
    #[inline(always)]
    fn push(&self, inputs: &Inputs, with_source: bool) -> f64 {
        if with_source { inputs.source * self.source_conductance } else { 0.0 }
    }

    #[cold]
    #[inline(never)]
    fn means_without_source(
        &self,
        now: &Dynamics,
        inputs: &Inputs,
        span: &Span,
        path: &Path,
    ) -> (Motion, f64) {
        self.means(now, inputs, span, path, false)
    }

    /// Motion of the rotor and mean bus voltage, with or without the source.
    #[inline(always)]
    fn means(
        &self,
        now: &Dynamics,
        inputs: &Inputs,
        span: &Span,
        path: &Path,
        with_source: bool,
    ) -> (Motion, f64) {
        let Winding { emf, scale, .. } = self.winding;
        let Path { duty, field, current, square } = *path;
        let winding = &span.winding;
        let supply = span.supply.decay(with_source, inputs.chopper);

        // The bus feels the EMF of the speed that the rotor has now, the rotor feels that bus.
        let along = dot(duty, field);
        let feedback = supply.mean_gain * scale * winding.mean_gain;
        let divisor = 1.0 / (1.0 + feedback * dot(duty, duty));
        let drawn = scale * winding.mean_keep * dot(current, duty);
        let push = self.push(inputs, with_source) - drawn;
        let bus = (supply.mean(now.bus, push) + feedback * emf * now.speed * along) * divisor;
        if inputs.blocked {
            return (Motion { mean: 0.0, speed: 0.0, position: now.position }, bus);
        }

        // Torque of the motor = torque - drag * mean speed.
        let constant = scale * emf;
        let torque =
            constant * (winding.mean_keep * dot(current, field) + winding.mean_gain * bus * along);
        let drag = constant * winding.mean_gain * emf * square;
        let mut acting = self.shaft.acting(&self.machine, now.position, inputs.external);
        acting.torque += torque;
        let at = (now.position, now.speed);
        (self.shaft.motion(at, acting, drag, inputs.friction, &span.shaft), bus)
    }
}

#[inline(always)]
fn or_none(current: f64) -> f64 {
    if current.abs() < NO_CURRENT { 0.0 } else { current }
}

impl Span {
    fn new(
        winding: &Winding,
        shaft: &Shaft,
        machine: &Machine,
        seconds: f64,
        chopper: Option<bool>,
    ) -> Self {
        Self {
            seconds,
            half: seconds / 2.0 / RADIANS,
            shaft: shaft.span(seconds),
            winding: Decay::new(winding.resistance, winding.inductance, seconds),
            supply: machine.supply.span(seconds, chopper),
        }
    }
}
