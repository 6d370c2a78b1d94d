//! What each axis parameter of the TMC429 and of the TMC26x reads and writes.
//!
//! # Readings
//!
//! - Writing the target position writes the register and nothing else: it does not leave velocity mode.
//! - Step interpolation works with 16 microsteps only: switching it on selects them, and selecting another
//!   resolution switches it off.
//! - In the constant off time mode (163) the hysteresis parameters 165 and 166 are the fast decay time and
//!   the offset of the sine wave; values that the mode does not have are refused.

use opentmcl_catalog::{Tmc26x, Tmc429};
use opentmcl_wire::Status;

use super::Chip;
use super::registers::*;
use crate::axis::AxisState;
use crate::board::Board;

/// 16 microsteps, as MRES says it.
const MRES_16: u32 = 4;

/// Value of the field HEND for a hysteresis of 0.
const HYSTERESIS_END_ZERO: i32 = 3;

/// Parameters of the motion controller that are a bit field, with the value as it is.
const fn controller_field(parameter: Tmc429) -> Option<Field> {
    Some(match parameter {
        Tmc429::MinSpeed => Field::whole(V_MIN),
        Tmc429::ReferenceSwitchTolerance => Field::whole(DX_REF_TOLERANCE),
        Tmc429::RampMode => RAMP_MODE,
        Tmc429::RightLimitDisable => DISABLE_STOP_RIGHT,
        Tmc429::LeftLimitDisable => DISABLE_STOP_LEFT,
        Tmc429::SoftStop => SOFT_STOP,
        Tmc429::RampDivisor => RAMP_DIV,
        Tmc429::PulseDivisor => PULSE_DIV,
        // These are computed.
        Tmc429::TargetPosition
        | Tmc429::ActualPosition
        | Tmc429::TargetSpeed
        | Tmc429::ActualSpeed
        | Tmc429::MaxPositioningSpeed
        | Tmc429::MaxAcceleration
        | Tmc429::ActualAcceleration
        | Tmc429::PositionReached
        | Tmc429::RightLimitSwitch
        | Tmc429::LeftLimitSwitch => return None,
    })
}

/// Parameters of the driver that are a bit field, with the value as it is.
const fn driver_field(parameter: Tmc26x) -> Option<Field> {
    Some(match parameter {
        Tmc26x::DoubleStep => DEDGE,
        Tmc26x::ChopperBlankTime => TBL,
        Tmc26x::ConstantToff => CHM,
        Tmc26x::ChopperHysteresisDecrement => HDEC,
        Tmc26x::SmartenergyCurrentMinimum => SEIMIN,
        Tmc26x::SmartenergyCurrentDownStep => SEDN,
        Tmc26x::SmartenergyHysteresis => SEMAX,
        Tmc26x::SmartenergyCurrentUpStep => SEUP,
        Tmc26x::StallguardFilter => SFILT,
        Tmc26x::SlopeControlHighSide => SLPH,
        Tmc26x::SlopeControlLowSide => SLPL,
        Tmc26x::ShortProtectionDisable => DISS2G,
        Tmc26x::ShortDetectionTimer => TS2G,
        Tmc26x::SenseResistorVoltage => VSENSE,
        Tmc26x::RandomToff => RNDTF,
        // These are computed.
        Tmc26x::MicrostepResolution
        | Tmc26x::StepInterpolation
        | Tmc26x::ChopperHysteresisEnd
        | Tmc26x::ChopperHysteresisStart
        | Tmc26x::ChopperOffTime
        | Tmc26x::SmartenergyHysteresisStart
        | Tmc26x::StallguardThreshold
        | Tmc26x::SmartenergyActualCurrent
        | Tmc26x::LoadValue
        | Tmc26x::DriverErrorFlags => return None,
    })
}

impl<B: Board> Chip<'_, B> {
    /// Writes a parameter of the motion controller whose value is within the catalogue's range.
    pub(crate) fn set(
        &mut self,
        axis: &mut AxisState,
        parameter: Tmc429,
        value: i32,
    ) -> Result<(), Status> {
        if let Some(field) = controller_field(parameter) {
            if matches!(parameter, Tmc429::RightLimitDisable | Tmc429::LeftLimitDisable) {
                self.set_stop_disable(axis, field, value as u32);
            } else {
                self.write_field(field, value as u32);
            }
            return Ok(());
        }
        match parameter {
            Tmc429::TargetPosition => self.write(X_TARGET, value as u32 & 0xFF_FFFF),
            Tmc429::ActualPosition => self.set_position(value),
            Tmc429::TargetSpeed => self.rotate(axis, value),
            Tmc429::MaxPositioningSpeed => {
                self.state.settings.v_max = value as u32;
                if self.is_positioning() && !axis.scaled_limits {
                    self.write(V_MAX, value as u32);
                }
            }
            Tmc429::MaxAcceleration => {
                self.state.settings.a_max = value as u32;
                self.state.settings.d_max = value as u32;
                self.write(A_MAX, value as u32);
                self.compute_braking_factor();
            }
            // Fields are written above; the rest cannot be written, which the catalogue says.
            _ => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// Reads a parameter of the motion controller.
    pub(crate) fn get(&mut self, axis: &AxisState, parameter: Tmc429) -> i32 {
        if let Some(field) = controller_field(parameter) {
            return match (parameter, axis.suspended_stops) {
                (Tmc429::RightLimitDisable | Tmc429::LeftLimitDisable, Some(stops)) => {
                    field.extract(stops) as i32
                }
                _ => self.read_field(field) as i32,
            };
        }
        match parameter {
            Tmc429::TargetPosition => self.target(),
            Tmc429::ActualPosition => self.position(),
            Tmc429::TargetSpeed => sign_extend(self.read(V_TARGET), 12),
            Tmc429::ActualSpeed => self.velocity(),
            Tmc429::MaxPositioningSpeed => self.state.settings.v_max as i32,
            Tmc429::MaxAcceleration => self.state.settings.a_max as i32,
            Tmc429::ActualAcceleration => sign_extend(self.read(A_ACTUAL), 12).abs(),
            Tmc429::PositionReached => i32::from(self.position_reached()),
            Tmc429::RightLimitSwitch => i32::from(self.limit_switches().1),
            Tmc429::LeftLimitSwitch => i32::from(self.limit_switches().0),
            // All others are fields, read above.
            _ => 0,
        }
    }

    /// Writes a parameter of the driver whose value is within the catalogue's range.
    pub(crate) fn set_driver(
        &mut self,
        axis: &mut AxisState,
        parameter: Tmc26x,
        value: i32,
    ) -> Result<(), Status> {
        if let Some(field) = driver_field(parameter) {
            self.write_field(field, value as u32);
            return Ok(());
        }
        match parameter {
            Tmc26x::MicrostepResolution => {
                let mres = 8 - value as u32;
                self.write_field(MRES, mres);
                if mres != MRES_16 {
                    self.write_field(INTPOL, 0);
                }
            }
            Tmc26x::StepInterpolation => {
                self.write_field(INTPOL, value as u32);
                if value != 0 {
                    self.write_field(MRES, MRES_16);
                }
            }
            Tmc26x::ChopperHysteresisEnd => {
                let zero = if self.has_constant_off_time() { 0 } else { HYSTERESIS_END_ZERO };
                self.write_field(HEND, code(value, zero, 15)?);
            }
            Tmc26x::ChopperHysteresisStart => self.write_field(HSTRT, code(value, 0, 7)?),
            // The driver has no off time of 1.
            Tmc26x::ChopperOffTime if value == 1 => return Err(Status::INVALID_VALUE),
            Tmc26x::ChopperOffTime => {
                axis.currents.toff = value as u32;
                self.write_field(TOFF, value as u32);
            }
            Tmc26x::SmartenergyHysteresisStart => {
                axis.currents.semin = value as u32;
                self.write_field(SEMIN, value as u32);
            }
            Tmc26x::StallguardThreshold => self.write_field(SGT, value as u32),
            // Fields are written above; the rest cannot be written, which the catalogue says.
            _ => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// Reads a parameter of the driver.
    pub(crate) fn get_driver(&mut self, axis: &AxisState, parameter: Tmc26x) -> i32 {
        if let Some(field) = driver_field(parameter) {
            return self.read_field(field) as i32;
        }
        match parameter {
            Tmc26x::MicrostepResolution => 8 - self.read_field(MRES).min(8) as i32,
            Tmc26x::StepInterpolation => self.read_field(INTPOL) as i32,
            Tmc26x::ChopperHysteresisEnd => {
                let code = self.read_field(HEND) as i32;
                if self.has_constant_off_time() { code } else { code - HYSTERESIS_END_ZERO }
            }
            Tmc26x::ChopperHysteresisStart => self.read_field(HSTRT) as i32,
            Tmc26x::ChopperOffTime => axis.currents.toff as i32,
            Tmc26x::SmartenergyHysteresisStart => axis.currents.semin as i32,
            Tmc26x::StallguardThreshold => SGT.signed(self.read_field(SGT)),
            Tmc26x::SmartenergyActualCurrent => {
                ACTUAL_CURRENT.extract(self.driver_answer(RDSEL_CURRENT)) as i32
            }
            Tmc26x::LoadValue => LOAD.extract(self.driver_answer(RDSEL_STALLGUARD)) as i32,
            Tmc26x::DriverErrorFlags => FLAGS.extract(self.driver_answer(RDSEL_STALLGUARD)) as i32,
            // All others are fields, read above.
            _ => 0,
        }
    }

    /// Whether a limit switch stops the axis; during a reference search once that has ended.
    fn set_stop_disable(&mut self, axis: &mut AxisState, stop: Field, disabled: u32) {
        match &mut axis.suspended_stops {
            Some(stops) => *stops = stop.insert(*stops, disabled),
            None => self.write_field(stop, disabled),
        }
    }

    fn has_constant_off_time(&mut self) -> bool {
        self.read_field(CHM) != 0
    }
}

/// What a field holds for a value; one that it cannot hold is invalid.
fn code(value: i32, zero: i32, largest: i32) -> Result<u32, Status> {
    let code = value.saturating_add(zero);
    if (0..=largest).contains(&code) { Ok(code as u32) } else { Err(Status::INVALID_VALUE) }
}
