//! Sensors of the rotor's position: hall lines, incremental encoder, absolute encoder.

use opentmcl_motion::servo::{PERIOD_TICKS, Senses};

use super::Machine;
use super::mechanics::{TURN, floor};
use super::motor::Motor;
use crate::machine::Encoder;

/// Levels of the hall lines 0 to 2 in the sectors of 60 electrical degrees, the first one centred at 0.
const HALL_LEVELS: [u8; 6] = [0b101, 0b001, 0b011, 0b010, 0b110, 0b100];

/// Hall sensors of a brushless motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Halls {
    /// By how many electrical degrees they tell more than the rotor's angle.
    pub offset: f64,
    /// Whether all lines are inverted.
    pub inverted: bool,
}

/// An absolute encoder on the motor's shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Absolute {
    /// Its angle at position 0, in 1/65536 turn.
    pub offset: f64,
    /// Whether it counts down while the position counts up.
    pub reversed: bool,
}

/// What is wrong with the wire of a hall line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LineFault {
    /// Nothing.
    #[default]
    None,
    /// It is always low.
    StuckLow,
    /// It is always high.
    StuckHigh,
}

/// Constants of a machine's sensors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensors {
    halls: Option<Halls>,
    /// Hall sectors per fine step.
    sectors: f64,
    absolute: Option<Absolute>,
    encoder: Option<Encoder>,
    /// Counts per fine step, negative if reversed.
    counts: f64,
    /// Counts at power-up.
    origin: i64,
    /// Count in the middle of which the index is, in turns of `counts`.
    index_count: i64,
}

/// What the sensors remember from one control interrupt to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Memory {
    /// Position in hall sectors.
    sectors: f64,
    halls: u8,
    /// Turns since the index.
    turn: i64,
    latch: u16,
}

impl Sensors {
    pub(super) fn new(machine: &Machine) -> Self {
        let pole_pairs = match &machine.motor {
            Motor::Brushless(motor) => f64::from(motor.pole_pairs),
            Motor::Brushed(_) => 0.0,
        };
        let encoder = machine.encoder;
        let counts = encoder.map_or(0.0, |encoder| {
            encoder.counts.abs() / TURN * if encoder.reversed { -1.0 } else { 1.0 }
        });
        Self {
            halls: machine.halls.filter(|_| pole_pairs > 0.0),
            sectors: 6.0 * pole_pairs / TURN,
            absolute: machine.absolute,
            encoder,
            counts,
            origin: floor(counts * machine.stage.start),
            index_count: encoder.map_or(0, |encoder| floor(counts * encoder.index)),
        }
    }

    /// Memory of sensors that have not been asked yet, on a rotor and a stage at these positions.
    pub(super) fn memory(&self, rotor: f64, stage: f64) -> Memory {
        let sectors = self.hall_sectors(rotor);
        Memory {
            sectors,
            halls: self.hall_levels(sectors, [LineFault::None; 3]),
            turn: self.index_turn(rotor, stage),
            latch: 0,
        }
    }

    /// What the sensors tell, `ticks` after they have been asked last.
    #[inline(always)]
    pub(super) fn read(
        &self,
        memory: &mut Memory,
        (rotor, stage): (f64, f64),
        faults: [LineFault; 3],
        ticks: u64,
        senses: &mut Senses,
    ) {
        if self.halls.is_some() {
            let sectors = self.hall_sectors(rotor);
            senses.halls = self.hall_levels(sectors, faults);
            if senses.halls != memory.halls {
                senses.hall_age = age(memory.sectors, sectors, ticks);
            }
            memory.sectors = sectors;
            memory.halls = senses.halls;
        }
        if let Some(encoder) = &self.encoder {
            let shaft = if encoder.on_stage { stage } else { rotor };
            let count = floor(shaft * self.counts);
            senses.encoder = (count - self.origin) as u16;
            let turn = self.index_turn(rotor, stage);
            if turn != memory.turn {
                // Upwards it has come to the beginning of this turn, downwards below the one of the next.
                let passed = if turn > memory.turn { turn } else { turn + 1 };
                let at = encoder.index + passed as f64 * TURN;
                memory.latch = (floor(at * self.counts) - self.origin) as u16;
                memory.turn = turn;
                senses.index_passed = true;
            }
            senses.index_latch = memory.latch;
            senses.encoder_lines = self.encoder_lines(encoder, count);
        }
        if let Some(absolute) = &self.absolute {
            let way = if absolute.reversed { -rotor } else { rotor };
            senses.absolute = floor(way + absolute.offset) as u16;
        }
    }

    fn hall_sectors(&self, rotor: f64) -> f64 {
        rotor * self.sectors + self.halls.map_or(0.0, |halls| halls.offset / 60.0)
    }

    fn hall_levels(&self, sectors: f64, faults: [LineFault; 3]) -> u8 {
        let Some(halls) = self.halls else { return 0 };
        let sector = floor(sectors + 0.5).rem_euclid(6) as usize;
        let mut levels = HALL_LEVELS[sector] ^ if halls.inverted { 0b111 } else { 0 };
        for (line, fault) in faults.into_iter().enumerate() {
            match fault {
                LineFault::None => {}
                LineFault::StuckLow => levels &= !(1 << line),
                LineFault::StuckHigh => levels |= 1 << line,
            }
        }
        levels
    }

    fn index_turn(&self, rotor: f64, stage: f64) -> i64 {
        self.encoder.map_or(0, |encoder| {
            let shaft = if encoder.on_stage { stage } else { rotor };
            floor((shaft - encoder.index) / TURN)
        })
    }

    /// A is ahead of B while it counts up; the index is high for one count.
    fn encoder_lines(&self, encoder: &Encoder, count: i64) -> u8 {
        const QUADRATURE: [u8; 4] = [0b00, 0b01, 0b11, 0b10];
        let lines = QUADRATURE[(count & 3) as usize];
        let turn = encoder.counts.abs() as i64;
        let index = turn > 0 && (count - self.index_count).rem_euclid(turn) == 0;
        lines | u8::from(index) << 2
    }
}

/// How long ago the last border between two sectors was crossed, in 1/256 control period, at least 1.
fn age(before: f64, now: f64, ticks: u64) -> u8 {
    let sector = floor(now + 0.5) as f64;
    let border = if now > before { sector - 0.5 } else { sector + 0.5 };
    let way = now - before;
    let part = if way == 0.0 { 0.0 } else { (now - border) / way };
    let age = part.clamp(0.0, 1.0) * ticks as f64 * 256.0 / PERIOD_TICKS as f64;
    ((age + 0.5) as u8).max(1)
}
