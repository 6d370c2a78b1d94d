//! The bridge: what its three legs do to the terminals of the motor, averaged over the control period.
//!
//! A leg that is switched has its part of the bus voltage. A leg that is open conducts through its diodes: a current
//! into the motor comes from ground, one out of it goes to the bus, and a leg without current floats until the EMF
//! lifts it above the bus or below ground.
//!
//! Currents and voltages are vectors in the stationary frame, with the first component along phase A; a phase's value
//! is the component along its axis. A motor with brushes has legs A and B as ends of one axis.

use opentmcl_motion::servo::Leg;

/// A vector in the stationary frame.
pub(super) type Vector = [f64; 2];

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Part of the bus voltage in a count of a duty.
const PART: f64 = 1.0 / 65535.0;

/// Directions of the phases.
const PHASES: [Vector; 3] = [[1.0, 0.0], [-0.5, SQRT_3 / 2.0], [-0.5, -SQRT_3 / 2.0]];

/// Legs A and B at the ends of one winding.
const ENDS: [Vector; 3] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]];

/// A current in ampere below which a diode does not conduct.
const IDLE: f64 = 1e-9;

/// The driver's switches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// Resistance of a switch in ohm; diodes count with the same.
    pub switch_resistance: f64,
}

/// Assumed: 4 mΩ.
impl Default for Bridge {
    fn default() -> Self {
        Self { switch_resistance: 0.004 }
    }
}

/// What a leg does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Terminal {
    /// Has this part of the bus voltage, 0..=1.
    Driven(f64),
    /// Only its diodes are left.
    Open,
    /// Its wire is off, or there is none.
    Cut,
}

/// The legs as they have been set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Legs {
    /// What they shall do.
    pub(super) told: [Leg; 3],
    /// Whether the gate driver keeps all switches open.
    pub(super) fault: bool,
    /// Which wires of the motor are off.
    pub(super) cut: [bool; 3],
    usual: Usual,
    /// Voltage vector per volt of the bus, where all legs or two of three are driven.
    duty: Vector,
    /// Direction of the current between two of three.
    way: Vector,
    /// Voltage per volt of the bus in the middle between them.
    middle: f64,
    /// Axis of the third one.
    floating: Vector,
}

/// How currents flow while no diode conducts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Usual {
    /// All legs of the motor are driven.
    All,
    /// Two of three are driven.
    Two,
    /// None is driven.
    Open,
    /// Something else.
    Other,
}

/// How currents can flow in a span of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Voltage vector per volt of the bus.
    pub(super) duty: Vector,
    /// Vector of the EMF per volt of its amplitude, as far as it can drive a current.
    pub(super) field: Vector,
    /// Square of its length.
    pub(super) square: f64,
    /// Current as far as it can flow.
    pub(super) current: Vector,
}

/// No way for a current.
const NOWHERE: Path = Path { duty: [0.0; 2], field: [0.0; 2], square: 0.0, current: [0.0; 2] };

/// What is connected with the bus in a span of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connection {
    pub(super) path: Path,
    /// Legs whose diodes conduct, and the sign of their currents; 0 for all others.
    pub(super) diodes: [f64; 3],
}

/// Which winding is behind the legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wiring {
    /// Three phases in star.
    Star,
    /// One winding between legs A and B.
    Single,
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Vector of three values of phases.
fn star(a: f64, b: f64, c: f64) -> Vector {
    [(2.0 * a - b - c) * (1.0 / 3.0), (b - c) * (1.0 / SQRT_3)]
}

impl Wiring {
    fn axes(self) -> &'static [Vector; 3] {
        match self {
            Self::Star => &PHASES,
            Self::Single => &ENDS,
        }
    }

    /// Currents into the motor.
    pub(super) fn currents(self, current: Vector) -> [f64; 3] {
        let [a, b, c] = self.axes();
        [dot(*a, current), dot(*b, current), dot(*c, current)]
    }

    /// Legs of the motor.
    fn count(self) -> usize {
        match self {
            Self::Star => 3,
            Self::Single => 2,
        }
    }

    /// Current without the part that flows into a leg.
    pub(super) fn without(self, leg: usize, current: Vector) -> Vector {
        let Some(&axis) = self.axes().get(leg) else { return current };
        let part = dot(axis, current);
        [current[0] - axis[0] * part, current[1] - axis[1] * part]
    }

    /// Voltage of a terminal as far as the EMF makes it differ from the others'.
    fn emf(self, leg: usize, emf: Vector) -> f64 {
        match self {
            Self::Star => dot(PHASES[leg], emf),
            Self::Single => dot(ENDS[leg], emf) / 2.0,
        }
    }
}

impl Legs {
    /// All legs open, all wires on.
    pub(super) fn new() -> Self {
        Self {
            told: [Leg::Open; 3],
            fault: false,
            cut: [false; 3],
            usual: Usual::Open,
            duty: [0.0; 2],
            way: [0.0; 2],
            middle: 0.0,
            floating: [0.0; 2],
        }
    }

    /// Drives them like this.
    #[inline(always)]
    pub(super) fn drive(&mut self, wiring: Wiring, told: &[Leg; 3]) {
        self.told = *told;
        if self.fault || self.cut != [false; 3] {
            self.usual = Usual::Other;
            return;
        }
        match (wiring, *told) {
            (Wiring::Star, [Leg::Duty(a), Leg::Duty(b), Leg::Duty(c)]) => {
                let [a, b, c] = [i32::from(a), i32::from(b), i32::from(c)];
                let (along, across) = (f64::from(2 * a - b - c), f64::from(b - c));
                self.duty = [along * (PART / 3.0), across * (PART / SQRT_3)];
                self.usual = Usual::All;
            }
            (Wiring::Star, [Leg::Duty(a), Leg::Duty(b), Leg::Open]) => self.drive_two(a, b, 2),
            (Wiring::Star, [Leg::Open, Leg::Duty(b), Leg::Duty(c)]) => self.drive_two(b, c, 0),
            (Wiring::Star, [Leg::Duty(a), Leg::Open, Leg::Duty(c)]) => self.drive_two(c, a, 1),
            (Wiring::Single, [Leg::Duty(a), Leg::Duty(b), _]) => {
                self.duty = [f64::from(i32::from(a) - i32::from(b)) * PART, 0.0];
                self.usual = Usual::All;
            }
            (Wiring::Star, [Leg::Open, Leg::Open, Leg::Open])
            | (Wiring::Single, [Leg::Open, Leg::Open, _]) => self.usual = Usual::Open,
            _ => self.usual = Usual::Other,
        }
    }

    /// With these duties of the legs on both sides of the one that floats, in the order of phases.
    #[inline(never)]
    fn drive_two(&mut self, from: u16, to: u16, floating: usize) {
        let floating = PHASES[floating];
        // At right angles to the axis of the floating one.
        let way = [-floating[1], floating[0]];
        let between = f64::from(i32::from(from) - i32::from(to)) * (PART / SQRT_3);
        self.usual = Usual::Two;
        self.way = way;
        self.duty = [way[0] * between, way[1] * between];
        self.middle = f64::from(i32::from(from) + i32::from(to)) * (PART / 2.0);
        self.floating = floating;
    }

    /// How currents flow with this current (ampere), direction of the EMF, amplitude of it (volt) and bus voltage; none
    /// if a diode may conduct.
    #[inline(always)]
    pub(super) fn path(&self, current: Vector, field: Vector, emf: f64, bus: f64) -> Option<Path> {
        match self.usual {
            Usual::All => Some(Path { duty: self.duty, field, square: 1.0, current }),
            Usual::Two => {
                let (way, floating) = (self.way, self.floating);
                let volts = self.middle * bus + 1.5 * emf * dot(floating, field);
                if dot(floating, current).abs() > IDLE || volts < 0.0 || volts > bus {
                    return None;
                }
                let (flow, part) = (dot(way, current), dot(way, field));
                Some(Path {
                    duty: self.duty,
                    field: [way[0] * part, way[1] * part],
                    square: part * part,
                    current: [way[0] * flow, way[1] * flow],
                })
            }
            // The EMF between two terminals is below twice that of one.
            Usual::Open if current == [0.0; 2] && 2.0 * emf.abs() < bus => {
                Some(Path { current, ..NOWHERE })
            }
            Usual::Open | Usual::Other => None,
        }
    }

    fn terminal(&self, wiring: Wiring, leg: usize) -> Terminal {
        match self.told[leg] {
            _ if self.cut[leg] || leg >= wiring.count() => Terminal::Cut,
            Leg::Duty(duty) if !self.fault => Terminal::Driven(f64::from(duty) / 65535.0),
            Leg::Duty(_) | Leg::Open => Terminal::Open,
        }
    }

    /// What conducts with this current (ampere), EMF (volt) in the direction `field`, and bus voltage. Diodes of the
    /// `refused` legs do not begin to conduct.
    pub(super) fn connect(
        &self,
        wiring: Wiring,
        current: Vector,
        (field, emf): (Vector, f64),
        bus: f64,
        refused: [bool; 3],
    ) -> Connection {
        let emf = [field[0] * emf, field[1] * emf];
        let terminals = [0, 1, 2].map(|leg| self.terminal(wiring, leg));
        let mut ends = Ends { levels: [None; 3], diodes: [0.0; 3] };
        for (leg, flow) in wiring.currents(current).into_iter().enumerate() {
            match terminals[leg] {
                Terminal::Driven(duty) => ends.levels[leg] = Some(duty),
                Terminal::Open if flow > IDLE => ends.conduct(leg, 1.0),
                Terminal::Open if flow < -IDLE => ends.conduct(leg, -1.0),
                Terminal::Open | Terminal::Cut => {}
            }
        }
        let emfs = [0, 1, 2].map(|leg| wiring.emf(leg, emf));
        let ready = |leg: &usize| terminals[*leg] == Terminal::Open && !refused[*leg];
        if let [None, None, None] = ends.levels {
            // As a rectifier.
            let by_emf = |a: &usize, b: &usize| emfs[*a].total_cmp(&emfs[*b]);
            let high = (0..3).filter(ready).max_by(by_emf);
            let low = (0..3).filter(ready).min_by(by_emf);
            if let (Some(high), Some(low)) = (high, low)
                && emfs[high] - emfs[low] > bus
            {
                ends.conduct(high, -1.0);
                ends.conduct(low, 1.0);
            }
        }
        if let Some((only, level)) = ends.only() {
            let floating = |leg: usize| level * bus + emfs[leg] - emfs[only];
            ends.lift((0..3).filter(|leg| *leg != only).filter(ready), floating, bus);
        }
        if let (Wiring::Star, Some(last)) = (wiring, ends.last()) {
            let middle: f64 = ends.levels.iter().flatten().sum::<f64>() / 2.0 * bus;
            let floating = |leg: usize| middle + 1.5 * emfs[leg];
            ends.lift(Some(last).into_iter().filter(ready), floating, bus);
        }
        ends.connection(wiring, current, field)
    }
}

/// Voltages of the terminals in parts of the bus voltage; none for those that float.
struct Ends {
    levels: [Option<f64>; 3],
    diodes: [f64; 3],
}

impl Ends {
    /// The diode conducts a current of this sign.
    fn conduct(&mut self, leg: usize, sign: f64) {
        self.levels[leg] = Some(if sign > 0.0 { 0.0 } else { 1.0 });
        self.diodes[leg] = sign;
    }

    /// The diode of that leg conducts that would be farthest outside of the supply, if any is.
    fn lift(
        &mut self,
        legs: impl Iterator<Item = usize>,
        floating: impl Fn(usize) -> f64,
        bus: f64,
    ) {
        let outside = |leg: usize| (floating(leg) - bus).max(-floating(leg));
        let farthest = legs.max_by(|a, b| outside(*a).total_cmp(&outside(*b)));
        if let Some(leg) = farthest.filter(|&leg| outside(leg) > 0.0) {
            self.conduct(leg, if floating(leg) > bus { -1.0 } else { 1.0 });
        }
    }

    /// The leg that is connected, if it is a single one.
    fn only(&self) -> Option<(usize, f64)> {
        match self.levels {
            [Some(level), None, None] => Some((0, level)),
            [None, Some(level), None] => Some((1, level)),
            [None, None, Some(level)] => Some((2, level)),
            _ => None,
        }
    }

    /// The leg that floats, if it is a single one.
    fn last(&self) -> Option<usize> {
        match self.levels {
            [None, Some(_), Some(_)] => Some(0),
            [Some(_), None, Some(_)] => Some(1),
            [Some(_), Some(_), None] => Some(2),
            _ => None,
        }
    }

    fn connection(&self, wiring: Wiring, current: Vector, field: Vector) -> Connection {
        let pair = |from: usize, to: usize, between: f64| {
            // The current can only flow from one to the other.
            let (from, to) = (PHASES[from], PHASES[to]);
            let way = [(from[0] - to[0]) / SQRT_3, (from[1] - to[1]) / SQRT_3];
            let along = |vector: Vector| [way[0] * dot(way, vector), way[1] * dot(way, vector)];
            let duty = [way[0] * between / SQRT_3, way[1] * between / SQRT_3];
            let part = dot(way, field);
            Path { duty, field: along(field), square: part * part, current: along(current) }
        };
        let path = match (wiring, self.levels) {
            (Wiring::Star, [Some(a), Some(b), Some(c)]) => {
                Path { duty: star(a, b, c), field, square: 1.0, current }
            }
            (Wiring::Star, [Some(a), Some(b), None]) => pair(0, 1, a - b),
            (Wiring::Star, [None, Some(b), Some(c)]) => pair(1, 2, b - c),
            (Wiring::Star, [Some(a), None, Some(c)]) => pair(2, 0, c - a),
            (Wiring::Single, [Some(a), Some(b), _]) => {
                Path { duty: [a - b, 0.0], field, square: 1.0, current }
            }
            _ => NOWHERE,
        };
        Connection { path, diodes: self.diodes }
    }
}
