//! What each axis parameter reads from the chip and writes to it.
//!
//! Most parameters are a bit field and stand in [`field`]; those that convert units, touch more
//! than one field or mean something the chip does not have follow in [`Chip::set`] and [`Chip::get`].
//! Source: firmware manual chapter 4, chips as in the datasheet; conversions as in the vendor's
//! open firmware for this chip.

use opentmcl_catalog::Tmc5160 as Parameter;
use opentmcl_wire::Status;

use super::Chip;
use super::registers::{Field, *};
use crate::axis::AxisState;
use crate::board::Board;
use crate::units;

/// Register values of V1 have 20 bits; the parameter's range in pps reaches one beyond.
const V1_LIMIT: u32 = (1 << 20) - 1;

/// TPOWERDOWN counts 2^18 clocks = 16.384 ms, the parameter 10 ms.
const POWER_DOWN_NUMERATOR: i64 = 16_384;
const POWER_DOWN_DENOMINATOR: i64 = 10_000;

/// Parameters that are a bit field, with the value as it is.
const fn field(parameter: Parameter) -> Option<Field> {
    Some(match parameter {
        Parameter::TargetPosition => Field::whole(XTARGET),
        Parameter::ActualPosition => Field::whole(XACTUAL),
        Parameter::PositionReached => RAMP_STAT_POSITION_REACHED,
        Parameter::RightLimitSwitch => RAMP_STAT_STOP_RIGHT,
        Parameter::LeftLimitSwitch => RAMP_STAT_STOP_LEFT,
        Parameter::SwapLimitSwitches => SWAP_LEFT_RIGHT,
        Parameter::RampWaitTime => Field::whole(TZEROWAIT),
        Parameter::RightLimitPolarity => STOP_RIGHT_POLARITY,
        Parameter::LeftLimitPolarity => STOP_LEFT_POLARITY,
        Parameter::SoftStop => SOFT_STOP,
        Parameter::HighSpeedChopper => VHIGHCHM,
        Parameter::HighSpeedFullstep => VHIGHFS,
        Parameter::PowerDownRamp => IHOLDDELAY,
        Parameter::DcstepTime => DC_TIME,
        Parameter::DcstepStallguard => DC_SG,
        Parameter::ChopperBlankTime => TBL,
        Parameter::ConstantToff => CHM,
        Parameter::DisableFastDecayComparator => DISFDCC,
        Parameter::ChopperOffTime => TOFF,
        Parameter::SmartenergyCurrentMinimum => SEIMIN,
        Parameter::SmartenergyCurrentDownStep => SEDN,
        Parameter::SmartenergyHysteresis => SEMAX,
        Parameter::SmartenergyCurrentUpStep => SEUP,
        Parameter::SmartenergyHysteresisStart => SEMIN,
        Parameter::StallguardFilter => SFILT,
        Parameter::SmartenergyActualCurrent => CS_ACTUAL,
        Parameter::RandomToff => RNDTF,
        Parameter::ChopperSynchronization => TPFD,
        Parameter::PwmAmplitude => PWM_OFS,
        Parameter::PwmScale => PWM_SCALE_SUM,
        Parameter::PwmFrequency => PWM_FREQ,
        Parameter::PwmAutoscale => PWM_AUTOSCALE,
        Parameter::LatchedPosition => Field::whole(XLATCH),
        Parameter::LatchedEncoderPosition => Field::whole(ENC_LATCH),
        Parameter::FreewheelingMode => FREEWHEEL,
        Parameter::LoadValue => SG_RESULT,
        Parameter::DriverErrorFlags => DRIVER_FLAGS,
        Parameter::EncoderPosition => Field::whole(X_ENC),
        Parameter::MaxEncoderDeviation => Field::whole(ENC_DEVIATION),
        Parameter::ReverseShaft => GCONF_SHAFT,
        // These are computed. Named one by one so that a new row of the catalogue does not compile
        // before it has a place here.
        Parameter::TargetSpeed
        | Parameter::ActualSpeed
        | Parameter::MaxPositioningSpeed
        | Parameter::MaxAcceleration
        | Parameter::MaxCurrent
        | Parameter::StandbyCurrent
        | Parameter::RightLimitDisable
        | Parameter::LeftLimitDisable
        | Parameter::AccelerationA1
        | Parameter::VelocityV1
        | Parameter::MaxDeceleration
        | Parameter::DecelerationD1
        | Parameter::VelocityVstart
        | Parameter::VelocityVstop
        | Parameter::HighSpeedThreshold
        | Parameter::DcstepMinSpeed
        | Parameter::MeasuredSpeed
        | Parameter::MicrostepResolution
        | Parameter::ChopperHysteresisEnd
        | Parameter::ChopperHysteresisStart
        | Parameter::EncoderMode
        | Parameter::StallguardThreshold
        | Parameter::SmartenergyThresholdSpeed
        | Parameter::PwmThresholdSpeed
        | Parameter::PwmGradient
        | Parameter::PwmMode
        | Parameter::PowerDownDelay => return None,
    })
}

impl<B: Board> Chip<'_, B> {
    /// Writes a parameter whose value is within the catalogue's range.
    ///
    /// Fails with [`Status::INVALID_VALUE`], changing nothing, where the register cannot hold it.
    pub(crate) fn set(
        &mut self,
        axis: &mut AxisState,
        parameter: Parameter,
        value: i32,
    ) -> Result<(), Status> {
        if let Some(field) = field(parameter) {
            self.write_field(field, value as u32);
            return Ok(());
        }
        let speed = || speed_to_register(axis, value);
        let acceleration = || acceleration_to_register(axis, value);
        match parameter {
            Parameter::TargetSpeed => {
                let velocity = signed_speed_to_register(axis, value);
                self.rotate(axis, velocity);
            }
            Parameter::MaxPositioningSpeed => {
                self.state.settings.v_max = speed();
                if self.is_positioning() && !axis.scaled_limits {
                    self.write(VMAX, self.state.settings.v_max);
                }
            }
            Parameter::MaxAcceleration => {
                self.state.settings.a_max = acceleration();
                self.write(AMAX, self.state.settings.a_max);
            }
            Parameter::AccelerationA1 => {
                self.state.settings.a1 = acceleration();
                self.write(A1, self.state.settings.a1);
            }
            Parameter::VelocityV1 => {
                self.state.settings.v1 = speed().min(V1_LIMIT);
                self.write(V1, self.state.settings.v1);
            }
            Parameter::MaxDeceleration => {
                self.state.settings.d_max = acceleration();
                self.write(DMAX, self.state.settings.d_max);
            }
            Parameter::DecelerationD1 => {
                self.state.settings.d1 = acceleration();
                self.write(D1, self.state.settings.d1);
            }
            Parameter::VelocityVstart => self.write(VSTART, speed()),
            Parameter::VelocityVstop => self.write(VSTOP, speed()),
            Parameter::DcstepMinSpeed => self.write(VDCMIN, speed()),
            Parameter::HighSpeedThreshold => self.write(THIGH, threshold_to_register(axis, value)),
            Parameter::SmartenergyThresholdSpeed => {
                self.write(TCOOLTHRS, threshold_to_register(axis, value));
            }
            Parameter::PwmThresholdSpeed => {
                self.write(TPWMTHRS, threshold_to_register(axis, value));
            }
            // The currents have 32 steps, the parameters 256.
            Parameter::MaxCurrent => self.write_field(IRUN, value as u32 / 8),
            Parameter::StandbyCurrent => self.write_field(IHOLD, value as u32 / 8),
            Parameter::RightLimitDisable => {
                self.set_stop(axis, STOP_RIGHT_ENABLE, value == 0);
            }
            Parameter::LeftLimitDisable => {
                self.set_stop(axis, STOP_LEFT_ENABLE, value == 0);
            }
            Parameter::EncoderMode => match &mut axis.suspended_encoder_mode {
                Some(mode) => *mode = value as u32,
                None => self.write_field(ENCMODE_SETTINGS, value as u32),
            },
            Parameter::MicrostepResolution => self.write_field(MRES, (8 - value) as u32),
            Parameter::ChopperHysteresisEnd => self.set_hysteresis_end(value as u32),
            Parameter::ChopperHysteresisStart => return self.set_hysteresis_start(value as u32),
            Parameter::StallguardThreshold => self.write_field(SGT, value as u32),
            Parameter::PwmGradient => {
                self.write_field(PWM_GRAD, value as u32);
                self.write_field(GCONF_STEALTHCHOP, u32::from(value != 0));
            }
            Parameter::PowerDownDelay => {
                let periods = i64::from(value) * POWER_DOWN_DENOMINATOR / POWER_DOWN_NUMERATOR;
                self.write(TPOWERDOWN, periods.min(255) as u32);
            }
            // Fields are written above; the rest cannot be written, which the catalogue says.
            _ => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// Reads a parameter.
    pub(crate) fn get(&mut self, axis: &AxisState, parameter: Parameter) -> i32 {
        if let Some(field) = field(parameter) {
            return self.read_field(field) as i32;
        }
        match parameter {
            Parameter::TargetSpeed => match self.read(RAMPMODE) {
                RAMPMODE_VELOCITY_POSITIVE => speed(axis, i64::from(self.read(VMAX))),
                RAMPMODE_VELOCITY_NEGATIVE => speed(axis, -i64::from(self.read(VMAX))),
                _ => 0,
            },
            Parameter::ActualSpeed => speed(axis, i64::from(self.velocity())),
            Parameter::MaxPositioningSpeed => speed(axis, i64::from(self.state.settings.v_max)),
            Parameter::MaxAcceleration => acceleration(axis, self.state.settings.a_max),
            Parameter::AccelerationA1 => acceleration(axis, self.state.settings.a1),
            Parameter::VelocityV1 => speed(axis, i64::from(self.state.settings.v1)),
            Parameter::MaxDeceleration => acceleration(axis, self.state.settings.d_max),
            Parameter::DecelerationD1 => acceleration(axis, self.state.settings.d1),
            Parameter::VelocityVstart => speed(axis, i64::from(self.read(VSTART))),
            Parameter::VelocityVstop => speed(axis, i64::from(self.read(VSTOP))),
            Parameter::DcstepMinSpeed => speed(axis, i64::from(self.read(VDCMIN))),
            Parameter::HighSpeedThreshold => threshold(axis, self.read(THIGH)),
            Parameter::SmartenergyThresholdSpeed => threshold(axis, self.read(TCOOLTHRS)),
            Parameter::PwmThresholdSpeed => threshold(axis, self.read(TPWMTHRS)),
            Parameter::MeasuredSpeed => self.measured_speed(axis),
            Parameter::MaxCurrent => self.read_field(IRUN) as i32 * 8,
            Parameter::StandbyCurrent => self.read_field(IHOLD) as i32 * 8,
            Parameter::RightLimitDisable => i32::from(!self.stop_as_set(axis, STOP_RIGHT_ENABLE)),
            Parameter::LeftLimitDisable => i32::from(!self.stop_as_set(axis, STOP_LEFT_ENABLE)),
            Parameter::EncoderMode => {
                let register = || self.read_field(ENCMODE_SETTINGS);
                axis.suspended_encoder_mode.unwrap_or_else(register) as i32
            }
            Parameter::MicrostepResolution => 8 - self.read_field(MRES).min(8) as i32,
            Parameter::ChopperHysteresisEnd => self.hysteresis_end(),
            Parameter::ChopperHysteresisStart => self.hysteresis_start(),
            Parameter::StallguardThreshold => SGT.signed(self.read_field(SGT)),
            Parameter::PwmGradient => self.read_field(PWM_GRAD) as i32,
            Parameter::PwmMode => {
                let enabled = self.read_field(GCONF_STEALTHCHOP) != 0;
                i32::from(enabled && self.read_field(STEALTH_ACTIVE) != 0)
            }
            Parameter::PowerDownDelay => {
                let time = i64::from(self.read(TPOWERDOWN)) * POWER_DOWN_NUMERATOR;
                ((time + POWER_DOWN_DENOMINATOR - 1) / POWER_DOWN_DENOMINATOR) as i32
            }
            // All others are fields, read above.
            _ => 0,
        }
    }

    /// Switches the stop by a limit switch; during a reference search once that has ended.
    fn set_stop(&mut self, axis: &mut AxisState, stop: Field, on: bool) {
        match &mut axis.suspended_stops {
            Some(stops) => *stops = stop.insert(*stops, u32::from(on)),
            None => self.write_field(stop, u32::from(on)),
        }
    }

    /// Whether a limit switch stops the axis, apart from a reference search.
    fn stop_as_set(&mut self, axis: &AxisState, stop: Field) -> bool {
        stop.extract(axis.suspended_stops.unwrap_or_else(|| self.read(SW_MODE))) != 0
    }

    /// Relates encoder counts to microsteps: X_ENC += ENC_CONST per count, 16.16, with a binary
    /// fraction where that is exact and a decimal one of four digits where it is not.
    pub(crate) fn set_encoder_constant(&mut self, axis: &AxisState) {
        let microsteps = i64::from(axis.motor_fullsteps) << (8 - self.read_field(MRES).min(8));
        let counts = i64::from(axis.encoder_resolution);
        if counts == 0 {
            return;
        }
        let exact = microsteps * 65536 % counts == 0;
        let (whole, fraction) = if exact {
            (microsteps / counts, (microsteps * 65536 / counts) & 0xFFFF)
        } else {
            (microsteps / counts, microsteps * 10_000 / counts % 10_000)
        };
        self.write_field(ENCMODE_DECIMAL, u32::from(!exact));
        self.write(ENC_CONST, ((whole << 16) | fraction) as u32);
    }

    /// The speed that the step pulses have, from the time between the last two.
    fn measured_speed(&mut self, axis: &AxisState) -> i32 {
        const STANDSTILL: u32 = (1 << 20) - 1;
        match self.read(TSTEP) {
            STANDSTILL => 0,
            // TSTEP counts 1/256 steps whatever the resolution.
            clocks => threshold(axis, clocks) >> self.read_field(MRES).min(8),
        }
    }

    fn classic_chopper(&mut self) -> bool {
        self.read_field(CHM) != 0
    }

    fn set_hysteresis_end(&mut self, value: u32) {
        if self.classic_chopper() {
            self.write_field(FAST_DECAY_TIME, value & 7);
            self.write_field(FAST_DECAY_TIME_MSB, value >> 3);
        } else {
            self.write_field(HEND, value);
        }
    }

    fn hysteresis_end(&mut self) -> i32 {
        let value = if self.classic_chopper() {
            self.read_field(FAST_DECAY_TIME) | self.read_field(FAST_DECAY_TIME_MSB) << 3
        } else {
            self.read_field(HEND)
        };
        value as i32
    }

    fn set_hysteresis_start(&mut self, value: u32) -> Result<(), Status> {
        if self.classic_chopper() {
            self.write_field(SINE_OFFSET, value);
        } else if value < 8 {
            self.write_field(HSTRT, value);
        } else {
            return Err(Status::INVALID_VALUE);
        }
        Ok(())
    }

    fn hysteresis_start(&mut self) -> i32 {
        let field = if self.classic_chopper() { SINE_OFFSET } else { HSTRT };
        self.read_field(field) as i32
    }
}

fn signed_speed_to_register(axis: &AxisState, value: i32) -> i32 {
    if axis.internal_units { value } else { units::speed_to_register(value) as i32 }
}

/// A speed that is not negative, in the chip's unit.
pub(crate) fn speed_to_register(axis: &AxisState, value: i32) -> u32 {
    signed_speed_to_register(axis, value).unsigned_abs()
}

fn acceleration_to_register(axis: &AxisState, value: i32) -> u32 {
    if axis.internal_units { value as u32 } else { units::acceleration_to_register(value) as u32 }
}

fn threshold_to_register(axis: &AxisState, value: i32) -> u32 {
    if axis.internal_units { value as u32 } else { units::threshold_to_register(value) }
}

/// A speed register as the parameter shows it.
pub(crate) fn speed(axis: &AxisState, register: i64) -> i32 {
    if axis.internal_units { register as i32 } else { units::speed_from_register(register) }
}

fn acceleration(axis: &AxisState, register: u32) -> i32 {
    let register = i64::from(register);
    if axis.internal_units { register as i32 } else { units::acceleration_from_register(register) }
}

fn threshold(axis: &AxisState, register: u32) -> i32 {
    if axis.internal_units { register as i32 } else { units::threshold_from_register(register) }
}
