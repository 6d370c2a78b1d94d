//! An axis on a test bench.

use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::{Axis, View};
use opentmcl_plant::machine::{Load, Machine, Motor, Stage, Switches};
use opentmcl_plant::tmc5160::registers::*;

/// A motor of which all is known: 0.4 Nm at 1 A RMS, 2 ohm, 4 mH, 5e-6 kg m².
pub(crate) fn motor() -> Motor {
    Motor {
        full_steps: 200,
        resistance: 2.0,
        inductance: 4e-3,
        holding_torque: 0.4,
        rated_current: 1.0,
        detent_torque: 0.0,
        inertia: 5e-6,
    }
}

/// That motor alone: no load, no ends, no switches.
pub(crate) fn machine() -> Machine {
    Machine {
        motor: motor(),
        load: Load::default(),
        stage: Stage::default(),
        switches: Switches::default(),
        encoder: None,
    }
}

/// CHOPCONF with 256 microsteps: TOFF 3, and TOFF 0 which opens all bridges.
pub(crate) const CHOPPER_ON: u32 = 0x0041_0153;
pub(crate) const CHOPPER_OFF: u32 = 0x0041_0150;

pub(crate) struct Bench {
    pub(crate) axis: Axis,
    pub(crate) now: Instant,
}

impl Bench {
    /// The machine with a driver of 2.8 A that gives all of it, moving and standing.
    pub(crate) fn new(machine: Machine) -> Self {
        let mut bench =
            Self { axis: Axis::with_machine(machine, 2.8), now: Instant::from_ticks(0) };
        bench.write(IHOLD_IRUN, 31 << 8 | 31);
        bench.write(CHOPCONF, CHOPPER_ON);
        bench
    }

    pub(crate) fn write(&mut self, address: u8, value: u32) {
        self.axis.write(address, value, self.now);
    }

    pub(crate) fn read(&mut self, address: u8) -> u32 {
        self.axis.read(address, self.now)
    }

    /// Turns to the right with this acceleration and speed, in register units.
    pub(crate) fn turn(&mut self, acceleration: u32, speed: u32) {
        self.write(AMAX, acceleration);
        self.write(VMAX, speed);
        self.write(RAMPMODE, 1);
    }

    /// Moves and arrives.
    pub(crate) fn move_to(&mut self, position: i32) {
        for (address, value) in [(AMAX, 5_000), (DMAX, 5_000), (VMAX, 53_687), (RAMPMODE, 0)] {
            self.write(address, value);
        }
        self.write(XTARGET, position.cast_unsigned());
        while let Some(event) = self.axis.next_event(self.now) {
            self.now = event;
        }
        assert_eq!(self.read(XACTUAL).cast_signed(), position);
    }

    pub(crate) fn wait_ms(&mut self, time: f64) {
        self.now += Duration::from_ticks((time * 16_000.0) as u64);
    }

    pub(crate) fn view(&mut self) -> View {
        self.axis.view(self.now)
    }

    /// The position counter.
    pub(crate) fn position(&mut self) -> f64 {
        f64::from(self.read(XACTUAL).cast_signed())
    }
}
