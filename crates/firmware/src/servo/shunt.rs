//! The offset of the single shunt of a TMCM-1613, measured.

use opentmcl_catalog::Block;

use super::{Mode, Servo};

/// The measurement of the shunt's offset (parameters 174 and 175): the mean of some readings with the bridge off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Shunt {
    sum: i32,
    remaining: u16,
    is_measured: bool,
}

/// Readings that make an offset.
const SHUNT_READINGS: u16 = 64;

impl Shunt {
    pub(super) fn is_measuring(&self) -> bool {
        self.remaining != 0
    }

    /// Whether a measurement has been made: what parameter 174 reads.
    pub(super) fn is_measured(&self) -> bool {
        self.is_measured
    }
}

impl Servo {
    pub(super) fn begin_shunt_measurement(&mut self) {
        self.shunt = Shunt { remaining: SHUNT_READINGS, ..Shunt::default() };
        self.set_mode(Mode::Stop);
        self.update_enabled();
    }

    /// Takes a reading, its offset subtracted already.
    #[inline]
    pub(super) fn measure_shunt(&mut self, reading: i32) {
        if self.shunt.remaining == 0 {
            return;
        }
        let shunt = &mut self.shunt;
        shunt.sum = shunt.sum.saturating_add(reading);
        shunt.remaining -= 1;
        if shunt.remaining == 0 {
            shunt.is_measured = true;
            let readings = i32::from(SHUNT_READINGS);
            let mean = (shunt.sum + readings / 2).div_euclid(readings);
            let offset = &mut self.settings[Block::ShuntOffset];
            *offset = offset.saturating_add(mean).clamp(0, 4096);
            self.update_enabled();
        }
    }
}
