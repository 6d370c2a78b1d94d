//! SAP GAP AAP SAPX GAPX AAPX, SGP GGP AGP STGP RSGP.

use opentmcl_catalog::{
    Axis, AxisBehaviour, AxisParameter, GlobalBehaviour, GlobalParameter, Globals,
    InterruptSetting, Motion, Servo, Tmc429, Tmc5160, Unit, Variables,
};
use opentmcl_wire::Status;

use super::{Execution, Outcome};
use crate::axis::AxisNumber;
use crate::board::Board;
use crate::module::Module;
use crate::servo::Behaviour;
use crate::storage::{self, Key};
use crate::tmc5160::parameters::{speed, speed_to_register};

/// Values of the EEPROM lock that lock and unlock it.
const LOCK: i32 = 1234;
const UNLOCK: i32 = 4321;

impl<B: Board> Module<B> {
    /// STAP: the value in use becomes the one after power-up.
    pub(super) fn store_axis_parameter(&mut self, axis: AxisNumber, number: u8) -> Execution {
        let row = self.axis_row(axis, number)?;
        if !row.access.store {
            return self.without_access();
        }
        let Outcome::Read(value) = self.get_axis_parameter(axis, number)? else {
            return Err(Status::WRONG_TYPE);
        };
        self.keep(Key::AxisParameter(number, axis.get()), value)?;
        Ok(Outcome::Done)
    }

    /// RSAP: the stored value, or the default, becomes the one in use.
    pub(super) fn restore_axis_parameter(&mut self, axis: AxisNumber, number: u8) -> Execution {
        let row = self.axis_row(axis, number)?;
        if !row.access.store {
            return self.without_access();
        }
        let key = Key::AxisParameter(number, axis.get());
        let stored = storage::fetch(self.board.flash(), key).map_err(|_| Status::EEPROM_LOCKED)?;
        self.write_axis_parameter(axis, row, stored.unwrap_or(row.default))?;
        self.touch(axis);
        Ok(Outcome::Done)
    }

    pub(super) fn get_axis_parameter(&mut self, axis: AxisNumber, number: u8) -> Execution {
        let row = self.axis_row(axis, number)?;
        if !row.access.read {
            return Err(Status::WRONG_TYPE);
        }
        let value = match row.behaviour {
            AxisBehaviour::Tmc5160(parameter) => {
                let (mut chip, state) = self.tmc5160(axis);
                chip.get(state, parameter)
            }
            AxisBehaviour::Tmc429(parameter) => {
                let (mut chip, state) = self.tmc429(axis);
                chip.get(state, parameter)
            }
            AxisBehaviour::Tmc26x(parameter) => {
                let (mut chip, state) = self.tmc429(axis);
                chip.get_driver(state, parameter)
            }
            AxisBehaviour::Servo(parameter) => {
                let around = self.surroundings();
                self.servo.get(parameter, &around)
            }
            AxisBehaviour::Foc(parameter) => {
                let around = self.surroundings();
                self.servo.get_foc(parameter, number, &around)
            }
            AxisBehaviour::Block(parameter) => self.servo.get_block(parameter),
            AxisBehaviour::Axis(setting) => self.axis_setting(axis, setting),
            AxisBehaviour::Stored(_) => {
                let place = self.stored_place(row);
                self.axes[axis].stored.get(place).copied().unwrap_or_default()
            }
        };
        Ok(Outcome::Read(value))
    }

    pub(super) fn set_axis_parameter(
        &mut self,
        axis: AxisNumber,
        number: u8,
        value: i32,
    ) -> Execution {
        let row = self.axis_row(axis, number)?;
        if !row.access.write {
            return self.without_access();
        }
        self.check_range(axis, row, i64::from(value))?;
        self.write_axis_parameter(axis, row, value)?;
        self.touch(axis);
        Ok(Outcome::Done)
    }

    /// What comes of writing an axis parameter that can only be read, and of storing one that cannot be stored:
    /// modules with field-oriented control say that it is done.
    fn without_access(&self) -> Execution {
        if self.model.motion == Motion::Foc { Ok(Outcome::Done) } else { Err(Status::WRONG_TYPE) }
    }

    fn axis_row(&self, axis: AxisNumber, number: u8) -> Result<&'static AxisParameter, Status> {
        let row = self.model.axis_parameter(number).filter(|row| self.model.has(row.since));
        row.filter(|row| row.axes & axis.bit() != 0).ok_or(Status::WRONG_TYPE)
    }

    /// Whether a value is within the range that holds in the axis' present units.
    pub(super) fn check_range(
        &self,
        axis: AxisNumber,
        row: &AxisParameter,
        value: i64,
    ) -> Result<(), Status> {
        let is_internal =
            self.axes[axis].internal_units && matches!(row.unit, Unit::Pps | Unit::Pps2);
        let max = i64::from(if is_internal { row.internal_max } else { row.max });
        let min = match (is_internal, row.min) {
            (true, ..=-1) => -max,
            (_, min) => i64::from(min),
        };
        if (min..=max).contains(&value) { Ok(()) } else { Err(Status::INVALID_VALUE) }
    }

    /// Writes a value that is within the range of its row.
    pub(crate) fn write_axis_parameter(
        &mut self,
        axis: AxisNumber,
        row: &AxisParameter,
        value: i32,
    ) -> Result<(), Status> {
        match row.behaviour {
            AxisBehaviour::Tmc429(parameter) => {
                let (mut chip, state) = self.tmc429(axis);
                chip.set(state, parameter, value)?;
                match parameter {
                    Tmc429::TargetPosition if chip.is_positioning() => self.depart(axis, false),
                    Tmc429::TargetSpeed => {
                        self.begin_motion(axis);
                        self.give_up_target(axis);
                        self.touch(axis);
                    }
                    _ => {}
                }
            }
            AxisBehaviour::Tmc26x(parameter) => {
                let (mut chip, state) = self.tmc429(axis);
                chip.set_driver(state, parameter, value)?;
            }
            AxisBehaviour::Tmc5160(parameter) => {
                let (mut chip, state) = self.tmc5160(axis);
                chip.set(state, parameter, value)?;
                match parameter {
                    Tmc5160::TargetPosition if chip.is_positioning() => {
                        self.forget_deviation(axis);
                        self.depart(axis, false);
                    }
                    Tmc5160::TargetSpeed => {
                        self.begin_motion(axis);
                        self.give_up_target(axis);
                        self.touch_guarded(axis);
                    }
                    Tmc5160::MaxEncoderDeviation => self.guard_deviation(axis, value != 0),
                    Tmc5160::MicrostepResolution => {
                        let (mut chip, state) = self.tmc5160(axis);
                        chip.set_encoder_constant(state);
                    }
                    _ => {}
                }
            }
            AxisBehaviour::Servo(parameter) => {
                self.wake_servo();
                self.servo.set(parameter, value)?;
                match parameter {
                    Servo::TargetPosition => self.depart(axis, false),
                    Servo::TargetVelocity | Servo::TargetTorque => self.give_up_target(axis),
                    _ => {}
                }
            }
            AxisBehaviour::Foc(parameter) => {
                self.wake_servo();
                self.servo.set_foc(parameter, row.number, value)?;
            }
            AxisBehaviour::Block(parameter) => {
                self.wake_servo();
                self.servo.set_block(parameter, value)?;
            }
            AxisBehaviour::Axis(setting) => self.set_axis_setting(axis, setting, value)?,
            AxisBehaviour::Stored(_) => {
                let place = self.stored_place(row);
                if let Some(place) = self.axes[axis].stored.get_mut(place) {
                    *place = value;
                }
            }
        }
        Ok(())
    }

    /// Which of the stored values belongs to a row: the rows are counted.
    fn stored_place(&self, row: &AxisParameter) -> usize {
        let stored = |row: &&AxisParameter| matches!(row.behaviour, AxisBehaviour::Stored(_));
        let rows = self.model.axis_parameters.iter().filter(stored);
        rows.take_while(|other| other.number != row.number).count()
    }

    fn axis_setting(&mut self, axis: AxisNumber, setting: Axis) -> i32 {
        let state = &mut self.axes[axis];
        match setting {
            Axis::HomeSwitch => i32::from(self.board.home_switch(axis.get())),
            Axis::RelativePositioningOption => state.relative_positioning_option,
            Axis::ReferenceSearchMode => state.search_mode,
            Axis::ReferenceSearchSpeed => speed(state, i64::from(state.search_speed)),
            Axis::ReferenceSwitchSpeed => speed(state, i64::from(state.switch_speed)),
            Axis::EndSwitchDistance => state.end_switch_distance,
            Axis::LastReferencePosition => state.last_reference_position,
            Axis::StopOnStall => speed(state, i64::from(state.stall_speed)),
            // Reading clears them.
            Axis::ExtendedErrorFlags => i32::from(core::mem::take(&mut state.errors)),
            Axis::DeviationAction => state.deviation_action,
            Axis::MotorFullsteps => state.motor_fullsteps,
            Axis::EncoderResolution => state.encoder_resolution,
            Axis::GroupIndex => state.group_index,
            Axis::UnitMode => i32::from(!state.internal_units),
            Axis::MaxCurrent => state.currents.run,
            Axis::StandbyCurrent => state.currents.standby,
            Axis::SlowRunCurrent => state.currents.slow,
            Axis::BoostCurrent => state.currents.boost,
            Axis::FreewheelingDelay => state.currents.freewheeling_delay,
            Axis::PowerDownDelay => state.currents.power_down_delay,
            Axis::EndSwitchPowerDown => i32::from(state.currents.power_down_at_switch),
            Axis::CoolstepThresholdSpeed => state.currents.cool_speed as i32,
        }
    }

    fn set_axis_setting(
        &mut self,
        axis: AxisNumber,
        setting: Axis,
        value: i32,
    ) -> Result<(), Status> {
        const FROM_ENCODER: i32 = 2;
        let has_encoder = self.has_encoder(axis);
        let has_index = self.model.motion == Motion::Tmc5160;
        let state = &mut self.axes[axis];
        match setting {
            Axis::RelativePositioningOption if value == FROM_ENCODER && !has_encoder => {
                return Err(Status::INVALID_VALUE);
            }
            Axis::RelativePositioningOption => state.relative_positioning_option = value,
            Axis::ReferenceSearchMode => {
                // Bases 1..=10; +64 turns modes 1..=4 around, +128 inverts the switch of 5..=8.
                let exists = match value {
                    9 | 10 => has_index,
                    _ => matches!(value, 1..=8 | 65..=68 | 133..=136),
                };
                if !exists {
                    return Err(Status::INVALID_VALUE);
                }
                state.search_mode = value;
            }
            Axis::ReferenceSearchSpeed => state.search_speed = speed_to_register(state, value),
            Axis::ReferenceSwitchSpeed => state.switch_speed = speed_to_register(state, value),
            Axis::StopOnStall => {
                let speed = speed_to_register(state, value);
                self.guard_stall(axis, speed);
            }
            Axis::DeviationAction => state.deviation_action = value,
            Axis::MotorFullsteps => {
                state.motor_fullsteps = value;
                let (mut chip, state) = self.tmc5160(axis);
                chip.set_encoder_constant(state);
            }
            Axis::EncoderResolution => {
                state.encoder_resolution = value;
                let (mut chip, state) = self.tmc5160(axis);
                chip.set_encoder_constant(state);
            }
            Axis::GroupIndex => state.group_index = value,
            Axis::UnitMode => state.internal_units = value == 0,
            Axis::MaxCurrent => state.currents.run = value,
            Axis::StandbyCurrent => state.currents.standby = value,
            Axis::SlowRunCurrent => state.currents.slow = value,
            Axis::BoostCurrent => state.currents.boost = value,
            Axis::FreewheelingDelay => state.currents.freewheeling_delay = value,
            Axis::PowerDownDelay => state.currents.power_down_delay = value,
            Axis::EndSwitchPowerDown => state.currents.power_down_at_switch = value != 0,
            Axis::CoolstepThresholdSpeed => state.currents.cool_speed = value as u32,
            // Read-only, which the catalogue says.
            Axis::HomeSwitch
            | Axis::EndSwitchDistance
            | Axis::LastReferencePosition
            | Axis::ExtendedErrorFlags => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// Whether the catalogue gives this axis an encoder.
    pub(crate) fn has_encoder(&self, axis: AxisNumber) -> bool {
        self.model.axis_parameters.iter().any(|row| {
            row.axes & axis.bit() != 0
                && row.behaviour == AxisBehaviour::Tmc5160(Tmc5160::EncoderPosition)
        })
    }

    fn global_row(&self, bank: u8, number: u8) -> Result<&'static GlobalParameter, Status> {
        let row = self.model.global_parameter(bank, number);
        row.filter(|row| self.model.has(row.since)).ok_or(Status::WRONG_TYPE)
    }

    pub(super) fn get_global_parameter(&mut self, bank: u8, number: u8) -> Execution {
        let row = self.global_row(bank, number)?;
        let value = match row.behaviour {
            GlobalBehaviour::Variables(Variables::UserVariable) => {
                self.variables[usize::from(number)]
            }
            GlobalBehaviour::Interrupts(InterruptSetting::TimerPeriod) => {
                self.interrupts.timer_period(number) as i32
            }
            GlobalBehaviour::Interrupts(InterruptSetting::TriggerTransition) => {
                i32::from(self.interrupts.transitions(number))
            }
            GlobalBehaviour::Globals(setting) => match setting {
                Globals::ApplicationStatus => self.cpu.mode as i32,
                Globals::DownloadMode => i32::from(self.download.active),
                Globals::ProgramCounter => i32::from(self.cpu.pc),
                Globals::TickTimer => self.globals.ticks(self.now),
                Globals::RandomNumber => self.globals.random(),
                _ => self.globals.number(number),
            },
            GlobalBehaviour::Stored(_) => self.globals.number(number),
        };
        Ok(Outcome::Read(value))
    }

    pub(super) fn set_global_parameter(&mut self, bank: u8, number: u8, value: i32) -> Execution {
        let row = self.global_row(bank, number)?;
        if !row.access.write {
            return Err(Status::WRONG_TYPE);
        }
        // A range beyond 31 bit is that of an unsigned number.
        let comparable =
            if row.max > i64::from(i32::MAX) { i64::from(value as u32) } else { i64::from(value) };
        if !(row.min..=row.max).contains(&comparable) {
            return Err(Status::INVALID_VALUE);
        }
        match row.behaviour {
            GlobalBehaviour::Variables(Variables::UserVariable) => {
                self.variables[usize::from(number)] = value;
            }
            GlobalBehaviour::Interrupts(InterruptSetting::TimerPeriod) => {
                self.interrupts.set_timer_period(number, value as u32, self.now);
            }
            GlobalBehaviour::Interrupts(InterruptSetting::TriggerTransition) => {
                self.forget_past_events();
                self.interrupts.set_transitions(number, value as u8);
            }
            GlobalBehaviour::Globals(setting) => self.set_global(setting, number, value)?,
            GlobalBehaviour::Stored(_) => self.keep_global(number, value)?,
        }
        Ok(Outcome::Done)
    }

    fn set_global(&mut self, setting: Globals, number: u8, value: i32) -> Result<(), Status> {
        match setting {
            Globals::SerialAddress
            | Globals::TelegramPauseTime
            | Globals::SerialHostAddress
            | Globals::AutoStart
            | Globals::CoordinateStorage
            | Globals::DoNotRestoreUserVariables
            | Globals::SerialSecondaryAddress => self.keep_global(number, value)?,
            Globals::SerialHeartbeat => {
                self.keep_global(number, value)?;
                self.restart_heartbeat();
            }
            Globals::EepromMagic | Globals::AsciiMode => self.keep_global(number, value)?,
            Globals::ModuleBehaviour => {
                self.wake_servo();
                self.behave(Behaviour::of(value));
            }
            Globals::EepromLock => {
                let locked = match value {
                    LOCK => 1,
                    UNLOCK => 0,
                    _ => return Err(Status::INVALID_VALUE),
                };
                // The lock itself is not under lock.
                self.globals.set_number(number, 0);
                self.keep_global(number, locked)?;
            }
            Globals::EndSwitchPolarity | Globals::ReverseShaft => {
                self.keep_global(number, value)?;
                self.set_up_groups();
            }
            Globals::CodeProtection => self.set_code_protection(number, value)?,
            Globals::TickTimer => self.globals.set_ticks(self.now, value),
            Globals::RandomNumber => self.globals.seed_random(value),
            Globals::SuppressReply => self.globals.set_number(number, value),
            // Read-only, which the catalogue says.
            Globals::ApplicationStatus | Globals::DownloadMode | Globals::ProgramCounter => {
                return Err(Status::WRONG_TYPE);
            }
        }
        Ok(())
    }

    /// Sets a parameter in memory and in the EEPROM, first there: what is lost there is not set.
    pub(super) fn keep_global(&mut self, number: u8, value: i32) -> Result<(), Status> {
        if self.globals.number(number) != value {
            self.keep(Key::Global(number), value)?;
            self.globals.set_number(number, value);
        }
        Ok(())
    }

    /// Stores a number in the EEPROM.
    pub(super) fn keep(&mut self, key: Key, value: i32) -> Result<(), Status> {
        if self.globals.has(Globals::EepromLock) && self.globals[Globals::EepromLock] != 0 {
            return Err(Status::EEPROM_LOCKED);
        }
        storage::store(self.board.flash(), key, value).map_err(|_| Status::EEPROM_LOCKED)
    }

    pub(super) fn store_global_parameter(&mut self, bank: u8, number: u8) -> Execution {
        let row = self.global_row(bank, number)?;
        if row.access.store {
            let Outcome::Read(value) = self.get_global_parameter(bank, number)? else {
                return Err(Status::WRONG_TYPE);
            };
            if row.behaviour == GlobalBehaviour::Globals(Globals::ModuleBehaviour)
                && Behaviour::of(value) == Behaviour::Analog
            {
                // A module that starts so would hear nobody any more.
                return Err(Status::INVALID_VALUE);
            }
            self.keep(stored_under(row, number), value)?;
        } else if !row.access.automatic {
            return Err(Status::WRONG_TYPE);
        }
        Ok(Outcome::Done)
    }

    pub(super) fn restore_global_parameter(&mut self, bank: u8, number: u8) -> Execution {
        let row = self.global_row(bank, number)?;
        if row.access.store {
            let stored = storage::fetch(self.board.flash(), stored_under(row, number));
            let stored = stored.map_err(|_| Status::EEPROM_LOCKED)?;
            self.set_global_parameter(bank, number, stored.unwrap_or(row.default))?;
        } else if !row.access.automatic {
            return Err(Status::WRONG_TYPE);
        }
        Ok(Outcome::Done)
    }
}

/// Where a global parameter that is stored on request is kept.
const fn stored_under(row: &GlobalParameter, number: u8) -> Key {
    match row.behaviour {
        GlobalBehaviour::Interrupts(_) => Key::Interrupt(number),
        GlobalBehaviour::Globals(_) => Key::Global(number),
        _ => Key::Variable(number),
    }
}
