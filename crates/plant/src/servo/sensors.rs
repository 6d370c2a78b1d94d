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

/// What is wrong with the hall lines, as masks of their levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Faults {
    low: u8,
    high: u8,
}

impl Faults {
    /// A line that there is not has no faults.
    pub(super) fn set(&mut self, line: u8, fault: LineFault) {
        let line = if line < 3 { 1 << line } else { 0 };
        self.low &= !line;
        self.high &= !line;
        match fault {
            LineFault::None => {}
            LineFault::StuckLow => self.low |= line,
            LineFault::StuckHigh => self.high |= line,
        }
    }
}

/// Constants of a machine's sensors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensors {
    halls: Option<Halls>,
    /// Hall sectors per fine step, and where the rotor at 0 is in them.
    sectors: f64,
    sector_offset: f64,
    absolute: Option<Absolute>,
    encoder: Option<Encoder>,
    /// Counts per fine step, negative if reversed.
    counts: f64,
    /// Counts at power-up.
    origin: i64,
}

/// What the sensors remember from one control interrupt to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Memory {
    /// Position in hall sectors, and the sector.
    position: f64,
    sector: i64,
    /// Levels in that sector, without faults; and what has been told of them.
    levels: u8,
    told: u8,
    /// The last index below the encoder's shaft, in fine steps.
    index: f64,
    /// Counts at which that index and the next one are high.
    index_counts: [i64; 2],
    latch: u16,
}

impl Sensors {
    pub(super) fn new(machine: &Machine) -> Self {
        let pole_pairs = match &machine.motor {
            Motor::Brushless(motor) => f64::from(motor.pole_pairs),
            Motor::Brushed(_) => 0.0,
        };
        let halls = machine.halls.filter(|_| pole_pairs > 0.0);
        let encoder = machine.encoder;
        let counts = encoder.map_or(0.0, |encoder| {
            encoder.counts.abs() / TURN * if encoder.reversed { -1.0 } else { 1.0 }
        });
        Self {
            halls,
            sectors: 6.0 * pole_pairs / TURN,
            sector_offset: halls.map_or(0.0, |halls| halls.offset / 60.0),
            absolute: machine.absolute,
            encoder,
            counts,
            origin: floor(counts * machine.stage.start),
        }
    }

    /// Memory of sensors that have not been asked yet, on a rotor and a stage at these positions.
    pub(super) fn memory(&self, rotor: f64, stage: f64) -> Memory {
        let position = rotor * self.sectors + self.sector_offset;
        let sector = floor(position + 0.5);
        let levels = self.levels(sector);
        let mut memory = Memory {
            position,
            sector,
            levels,
            told: levels,
            index: 0.0,
            index_counts: [0; 2],
            latch: 0,
        };
        if let Some(encoder) = self.encoder {
            self.find_index(&mut memory, &encoder, if encoder.on_stage { stage } else { rotor });
        }
        memory
    }

    /// What the sensors tell, `ticks` after they have been asked last.
    #[inline(always)]
    pub(super) fn read(
        &self,
        memory: &mut Memory,
        (rotor, stage): (f64, f64),
        faults: Faults,
        ticks: u64,
        senses: &mut Senses,
    ) {
        if self.halls.is_some() {
            let position = rotor * self.sectors + self.sector_offset;
            let sector = floor(position + 0.5);
            if sector != memory.sector {
                memory.sector = sector;
                memory.levels = self.levels(sector);
            }
            let told = memory.levels & !faults.low | faults.high;
            if told != memory.told {
                memory.told = told;
                senses.hall_age = age(memory.position, position, ticks);
            }
            memory.position = position;
            senses.halls = told;
        }
        if let Some(encoder) = &self.encoder {
            let shaft = if encoder.on_stage { stage } else { rotor };
            let count = floor(shaft * self.counts);
            let turned = shaft - memory.index;
            if !(0.0..TURN).contains(&turned) {
                let upwards = turned > 0.0;
                self.find_index(memory, encoder, shaft);
                // Upwards the index below is the last one it has passed, downwards the one above.
                let passed = memory.index_counts[usize::from(!upwards)];
                memory.latch = (passed - self.origin) as u16;
                senses.index_passed = true;
            }
            senses.encoder = (count - self.origin) as u16;
            senses.index_latch = memory.latch;
            // A is ahead of B while it counts up; the index is high for one count.
            let quarter = count as u8 & 0b11;
            let lines = quarter ^ quarter >> 1;
            senses.encoder_lines = lines | u8::from(memory.index_counts.contains(&count)) << 2;
        }
        if let Some(absolute) = &self.absolute {
            let way = if absolute.reversed { -rotor } else { rotor };
            senses.absolute = floor(way + absolute.offset) as u16;
        }
    }

    fn levels(&self, sector: i64) -> u8 {
        let Some(halls) = self.halls else { return 0 };
        let levels = HALL_LEVELS[sector.rem_euclid(6) as usize];
        if halls.inverted { levels ^ 0b111 } else { levels }
    }

    #[inline(never)]
    fn find_index(&self, memory: &mut Memory, encoder: &Encoder, shaft: f64) {
        let turn = floor((shaft - encoder.index) / TURN) as f64;
        // Both ends from their turns, so that all turns have the same borders.
        let [below, above] = [turn, turn + 1.0].map(|turn| encoder.index + turn * TURN);
        memory.index = below;
        memory.index_counts = [floor(below * self.counts), floor(above * self.counts)];
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

#[cfg(test)]
mod tests {
    use super::super::motor::preset;
    use super::*;

    const PERIOD: u64 = PERIOD_TICKS;

    fn machine() -> Machine {
        Machine::new(Motor::Brushless(preset("qbl4208-61-04-013").unwrap()))
    }

    /// What sensors tell on a way of the rotor in fine steps, a period after the other.
    fn along(machine: &Machine, faults: Faults, way: &[f64]) -> Vec<Senses> {
        let sensors = Sensors::new(machine);
        let mut memory = sensors.memory(way[0], way[0]);
        let read = |at: &f64| {
            let mut senses = Senses::default();
            sensors.read(&mut memory, (*at, *at), faults, PERIOD, &mut senses);
            senses
        };
        way.iter().map(read).collect()
    }

    /// Fine steps of the rotor, at which the electrical angle of 4 pole pairs is so many degrees.
    fn electrical(degrees: f64) -> f64 {
        degrees / 360.0 * TURN / 4.0
    }

    #[test]
    fn hall_lines_are_high_for_half_an_electrical_turn_each() {
        for degrees in (-719..720).step_by(2).map(f64::from) {
            let senses = along(&machine(), Faults::default(), &[electrical(degrees)])[0];
            for (line, from) in [(0, -30.0), (1, 90.0), (2, 210.0)] {
                let high = (degrees - from).rem_euclid(360.0) < 180.0;
                assert_eq!(senses.halls >> line & 1 == 1, high, "{degrees} {line}");
            }
        }
    }

    #[test]
    fn halls_can_be_turned_inverted_and_stuck() {
        let at = [electrical(20.0)];
        let mut turned = machine();
        turned.halls = Some(Halls { offset: 15.0, inverted: true });
        assert_eq!(along(&turned, Faults::default(), &at)[0].halls, 0b110, "35° are sector 1");
        let mut faults = Faults::default();
        faults.set(1, LineFault::StuckHigh);
        faults.set(2, LineFault::StuckLow);
        faults.set(3, LineFault::StuckHigh);
        assert_eq!(along(&machine(), faults, &at)[0].halls, 0b011);
        faults.set(2, LineFault::None);
        assert_eq!(along(&machine(), faults, &at)[0].halls, 0b111);
    }

    #[test]
    fn the_age_of_a_change_is_the_part_of_the_period_since() {
        let way = [25.0, 33.0, 34.0, 88.0, 152.0, 148.0].map(electrical);
        let ages: Vec<u8> = along(&machine(), Faults::default(), &way)
            .iter()
            .map(|senses| senses.hall_age)
            .collect();
        // 3 of 8 degrees, none, none, 62 of 64 since 90 and 2 since 150, 2 of 4 on the way back.
        assert_eq!(ages, [0, 96, 0, 0, 8, 128]);
    }

    #[test]
    fn a_stuck_line_hides_its_changes() {
        let mut faults = Faults::default();
        faults.set(2, LineFault::StuckHigh);
        let way = [20.0, 25.0, 35.0].map(electrical);
        let told = along(&machine(), faults, &way);
        assert!(told.iter().all(|senses| senses.halls == 0b101 && senses.hall_age == 0));
    }

    #[test]
    fn the_encoder_counts_both_ways_and_wraps() {
        let way = [0.0, 16.0, 31.9, -0.1, 65536.0 * 17.0];
        let counts: Vec<u16> = along(&machine(), Faults::default(), &way)
            .iter()
            .map(|senses| senses.encoder)
            .collect();
        assert_eq!(counts, [0, 1, 1, 65535, 4096]);
        let mut reversed = machine();
        reversed.encoder = reversed.encoder.map(|encoder| Encoder { reversed: true, ..encoder });
        let told = along(&reversed, Faults::default(), &way);
        assert_eq!(told.iter().map(|senses| senses.encoder).collect::<Vec<_>>()[4], 61440);
    }

    #[test]
    fn its_lines_are_gray_coded_and_the_index_is_high_for_one_count_of_a_turn() {
        let mut machine = machine();
        machine.encoder = machine.encoder.map(|encoder| Encoder { index: 160.0, ..encoder });
        let way: Vec<f64> = (0..2 * 4096).map(|count| f64::from(count) * 16.0 + 8.0).collect();
        let told = along(&machine, Faults::default(), &way);
        for (count, senses) in told.iter().enumerate() {
            assert_eq!(senses.encoder_lines & 3, [0, 1, 3, 2][count % 4]);
            assert_eq!(senses.encoder_lines >> 2 == 1, count % 4096 == 10, "{count}");
            assert_eq!(senses.index_passed, count % 4096 == 10, "{count}");
        }
        assert_eq!(
            (told[9].index_latch, told[10].index_latch, told[4200].index_latch),
            (0, 10, 4106)
        );
    }

    #[test]
    fn the_index_latches_on_the_way_back_too() {
        let mut machine = machine();
        machine.encoder = machine.encoder.map(|encoder| Encoder { index: 1600.0, ..encoder });
        let told = along(&machine, Faults::default(), &[0.0, 2000.0, 2000.0, 1500.0, -70_000.0]);
        let passed: Vec<bool> = told.iter().map(|senses| senses.index_passed).collect();
        assert_eq!(passed, [false, true, false, true, true]);
        assert_eq!((told[1].index_latch, told[3].index_latch), (100, 100));
        assert_eq!(told[4].index_latch, (100i32 - 4096) as u16);
    }

    #[test]
    fn the_absolute_encoder_knows_its_angle_from_the_beginning() {
        let mut machine = machine();
        machine.absolute = Some(Absolute { offset: 100.0, reversed: false });
        let way = [0.0, 70_000.0, -200.0];
        let angles = |machine: &Machine| -> Vec<u16> {
            along(machine, Faults::default(), &way).iter().map(|senses| senses.absolute).collect()
        };
        assert_eq!(angles(&machine), [100, 4564, 65436]);
        machine.absolute = Some(Absolute { offset: 100.0, reversed: true });
        assert_eq!(angles(&machine), [100, 61172, 300]);
    }
}
