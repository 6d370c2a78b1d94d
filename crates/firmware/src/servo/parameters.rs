//! Axis parameters of servo modules: what each reads, and what happens when it is written.

use opentmcl_catalog::{Block, Foc, Servo as Shared};
use opentmcl_wire::Status;

use super::sensors::Source;
use super::{Mode, STEPPER, Servo, Surroundings};

/// What parameters 230 to 232 read: runs of each loop in a second.
const MAIN_LOOPS: i32 = super::TICKS_PER_SECOND as i32;
const TORQUE_LOOPS: i32 = opentmcl_motion::servo::PERIODS_PER_SECOND as i32;
const VELOCITY_LOOPS: i32 = TORQUE_LOOPS / 10;

/// What the gate driver of a TMCM-1613 tells by its diagnostic output, in 0.1 %.
const DRIVER_IS_WELL: i32 = 0;
const DRIVER_HAS_ERROR: i32 = 500;

impl Servo {
    /// The value of a parameter that both modules have.
    pub(crate) fn get(&mut self, parameter: Shared, around: &Surroundings) -> i32 {
        match parameter {
            Shared::TargetPosition => self.target_position,
            Shared::ActualPosition => self.external(self.position()),
            Shared::TargetVelocity => self.target_velocity,
            Shared::ActualVelocity => self.counted_speed(self.speed()),
            Shared::RampVelocity => self.counted_speed(self.speed_ramp.speed()),
            // At once, and not with the next run of the regulators only.
            Shared::TargetTorque if self.mode == Mode::Torque => {
                let limit = self.settings[Shared::MaxCurrent];
                self.target_torque.clamp(-limit, limit)
            }
            Shared::TargetTorque => self.demand.q.saturating_mul(self.current_unit()),
            Shared::ActualTorque => self.measured.mean.q,
            Shared::SupplyVoltage => i32::from(self.senses.supply) / 10,
            Shared::DriverTemperature => around.temperature,
            Shared::StatusFlags => self.take_flags(),
            Shared::TorqueError => self.torque.error(),
            Shared::TorqueErrorSum => self.torque.error_sum(self.torque_gains()),
            Shared::VelocityError => self.counted_speed(self.velocity_error),
            Shared::VelocityErrorSum => self.velocity.error_sum(self.velocity_gains()),
            Shared::PositionError if self.mode == Mode::Position => {
                self.external(i64::from(self.position_error))
            }
            Shared::PositionError => 0,
            Shared::MaxVelocity
            | Shared::MaxCurrent
            | Shared::ReachedVelocity
            | Shared::ReachedDistance
            | Shared::HaltedVelocity
            | Shared::Acceleration
            | Shared::RampEnable
            | Shared::TorqueP
            | Shared::TorqueI
            | Shared::VelocityP
            | Shared::VelocityI
            | Shared::PositionP
            | Shared::HallPolarity => self.settings[parameter],
        }
    }

    /// Sets a parameter that both modules have.
    pub(crate) fn set(&mut self, parameter: Shared, value: i32) -> Result<(), Status> {
        match parameter {
            Shared::TargetPosition => self.move_to(value),
            Shared::ActualPosition => self.set_position(value),
            Shared::TargetVelocity => self.rotate(value),
            Shared::TargetTorque => self.pull(value),
            Shared::MaxVelocity
            | Shared::MaxCurrent
            | Shared::ReachedVelocity
            | Shared::ReachedDistance
            | Shared::HaltedVelocity
            | Shared::Acceleration
            | Shared::RampEnable
            | Shared::TorqueP
            | Shared::TorqueI
            | Shared::VelocityP
            | Shared::VelocityI
            | Shared::PositionP => self.settings[parameter] = value,
            Shared::HallPolarity => {
                self.settings[parameter] = value;
                self.update_reading();
            }
            // Read-only, which the catalogue says.
            Shared::ActualVelocity
            | Shared::RampVelocity
            | Shared::ActualTorque
            | Shared::SupplyVoltage
            | Shared::DriverTemperature
            | Shared::StatusFlags
            | Shared::TorqueError
            | Shared::TorqueErrorSum
            | Shared::VelocityError
            | Shared::VelocityErrorSum
            | Shared::PositionError => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// The value of a parameter of a TMCM-1613.
    pub(crate) fn get_block(&self, parameter: Block) -> i32 {
        match parameter {
            Block::ShuntMeasurement => i32::from(self.shunt.is_measured()),
            Block::DriverDiagnostic if self.has_driver_error() => DRIVER_HAS_ERROR,
            Block::DriverDiagnostic => DRIVER_IS_WELL,
            // Written only.
            Block::Reinitialize | Block::DriverAcknowledge | Block::DriverSpi => 0,
            // There is one mode.
            Block::CommutationMode => 0,
            Block::VelocityLoopDelay
            | Block::CurrentLoopDelay
            | Block::ShuntOffset
            | Block::DriverRegister2
            | Block::DriverRegister3
            | Block::DriverRegister4
            | Block::MotorPoles => self.settings[parameter],
        }
    }

    /// Sets a parameter of a TMCM-1613.
    pub(crate) fn set_block(&mut self, parameter: Block, value: i32) -> Result<(), Status> {
        match parameter {
            Block::Reinitialize => self.reinitialize(),
            Block::ShuntMeasurement if value == 0 => {}
            Block::ShuntMeasurement if self.is_moving() => return Err(Status::NOT_AVAILABLE),
            Block::ShuntMeasurement => self.begin_shunt_measurement(),
            Block::DriverAcknowledge => self.acknowledge_driver(),
            Block::DriverSpi => {
                self.status.driver_spi = true;
                self.set_mode(Mode::Stop);
                self.update_enabled();
            }
            Block::DriverRegister2 | Block::DriverRegister3 | Block::DriverRegister4
                if !self.status.driver_spi =>
            {
                return Err(Status::NOT_AVAILABLE);
            }
            Block::DriverRegister2
            | Block::DriverRegister3
            | Block::DriverRegister4
            | Block::VelocityLoopDelay
            | Block::CurrentLoopDelay
            | Block::ShuntOffset => self.settings[parameter] = value,
            Block::MotorPoles => {
                self.settings[parameter] = value;
                self.update_reading();
                self.update_sensors();
            }
            // Read-only, which the catalogue says.
            Block::CommutationMode | Block::DriverDiagnostic => return Err(Status::WRONG_TYPE),
        }
        Ok(())
    }

    /// The value of a parameter of a TMCM-1636; `number` tells rows with the same effect apart.
    pub(crate) fn get_foc(&self, parameter: Foc, number: u8, around: &Surroundings) -> i32 {
        let [a, b] = self.phase_currents;
        let angle = |angle: u16| i32::from(angle as i16);
        let open_loop = self.angle_of(Source::OpenLoop);
        match parameter {
            Foc::AdcPhaseA => i32::from(self.senses.currents[0]),
            Foc::AdcPhaseB => i32::from(self.senses.currents[1]),
            Foc::CurrentPhaseA => a,
            Foc::CurrentPhaseB => b,
            Foc::CurrentPhaseC => -(a + b),
            Foc::OpenLoopAngle => angle(open_loop),
            Foc::EncoderAngle => angle(self.angle_of(Source::Encoder)),
            Foc::HallAngle => angle(self.angle_of(Source::Halls)),
            Foc::AbsoluteAngle => angle(self.angle_of(Source::Absolute)),
            Foc::EncoderOpenLoopDifference => {
                angle(self.angle_of(Source::Encoder).wrapping_sub(open_loop))
            }
            Foc::HallOpenLoopDifference => {
                angle(self.angle_of(Source::Halls).wrapping_sub(open_loop))
            }
            Foc::TargetFlux => self.target_flux,
            Foc::ActualFlux => self.measured.mean.d,
            Foc::RampPosition => {
                let position = i64::from(self.position_ramp.position());
                self.external(if self.ramp_is_on() { position } else { self.position() })
            }
            Foc::PositionReached => i32::from(self.status.reached),
            Foc::FluxError => self.flux.error(),
            Foc::FluxErrorSum => self.flux.error_sum(self.torque_gains()),
            Foc::HallInputs => i32::from(self.senses.halls),
            Foc::EncoderInitState => self.init.state as i32,
            Foc::EncoderInputs => i32::from(self.senses.encoder_lines),
            Foc::EncoderCounter => self.sensors.encoder.within() as i32,
            Foc::ChopperActive => i32::from(self.power.chopper),
            Foc::RightSwitch => i32::from(self.switches(around).right),
            Foc::LeftSwitch => i32::from(self.switches(around).left),
            Foc::HomeSwitch => i32::from(around.home),
            Foc::MainLoops => MAIN_LOOPS,
            Foc::TorqueLoops => TORQUE_LOOPS,
            Foc::VelocityLoops => VELOCITY_LOOPS,
            Foc::DebugValue => {
                self.debug.get(usize::from(number % 10)).copied().unwrap_or_default()
            }
            Foc::AdcOffsetA
            | Foc::AdcOffsetB
            | Foc::PolePairs
            | Foc::OpenLoopCurrent
            | Foc::MotorDirection
            | Foc::MotorType
            | Foc::CommutationMode
            | Foc::PositionSensor
            | Foc::VelocitySensor
            | Foc::VelocityUnit
            | Foc::VelocityFilter
            | Foc::PositionScaler
            | Foc::VelocityFeedForward
            | Foc::HallDirection
            | Foc::HallInterpolation
            | Foc::HallOffset
            | Foc::EncoderSteps
            | Foc::EncoderDirection
            | Foc::EncoderInitMode
            | Foc::EncoderInitDelay
            | Foc::EncoderInitVelocity
            | Foc::EncoderOffset
            | Foc::ClearOnNull
            | Foc::ClearOnce
            | Foc::BrakeRelease
            | Foc::BrakePullInDuty
            | Foc::BrakeHoldDuty
            | Foc::BrakePullInTime
            | Foc::BrakeEnable
            | Foc::BrakeInvert
            | Foc::ChopperEnable
            | Foc::ChopperLimit
            | Foc::ChopperHysteresis
            | Foc::VelocityOffset
            | Foc::TorqueOffset
            | Foc::AbsoluteType
            | Foc::AbsoluteInitMode
            | Foc::AbsoluteDirection
            | Foc::AbsoluteOffset
            | Foc::SwitchEnable
            | Foc::SwitchPolarity
            | Foc::DriverEnable => self.settings[parameter],
        }
    }

    /// Sets a parameter of a TMCM-1636.
    pub(crate) fn set_foc(&mut self, parameter: Foc, number: u8, value: i32) -> Result<(), Status> {
        match parameter {
            Foc::TargetFlux => self.target_flux = value,
            Foc::DebugValue => {
                if let Some(place) = self.debug.get_mut(usize::from(number % 10)) {
                    *place = value;
                }
            }
            Foc::CommutationMode => self.set_commutation(value),
            Foc::PolePairs
            | Foc::MotorDirection
            | Foc::HallDirection
            | Foc::EncoderDirection
            | Foc::AbsoluteDirection => {
                self.settings[parameter] = value;
                self.update_reading();
                if matches!(parameter, Foc::PolePairs) {
                    self.update_sensors();
                }
            }
            Foc::EncoderSteps => {
                self.settings[parameter] = value;
                self.update_sensors();
            }
            Foc::AbsoluteType => {
                let position = self.position();
                self.settings[parameter] = value;
                self.update_reading();
                self.sensors.restart_absolute(&self.senses, &self.reading);
                self.take_sensors(position);
            }
            Foc::PositionSensor | Foc::VelocitySensor => {
                let position = self.position();
                self.settings[parameter] = value;
                self.take_sensors(position);
            }
            // A stepper motor in the coding of the chip, of which the bridge has too few legs.
            Foc::MotorType if value == STEPPER => return Err(Status::INVALID_VALUE),
            Foc::MotorType | Foc::DriverEnable => {
                self.settings[parameter] = value;
                self.update_enabled();
                if !self.is_enabled() {
                    self.set_mode(Mode::Stop);
                }
            }
            // Read-only, which the catalogue says.
            Foc::AdcPhaseA
            | Foc::AdcPhaseB
            | Foc::CurrentPhaseA
            | Foc::CurrentPhaseB
            | Foc::CurrentPhaseC
            | Foc::OpenLoopAngle
            | Foc::EncoderAngle
            | Foc::HallAngle
            | Foc::AbsoluteAngle
            | Foc::EncoderOpenLoopDifference
            | Foc::HallOpenLoopDifference
            | Foc::ActualFlux
            | Foc::RampPosition
            | Foc::PositionReached
            | Foc::FluxError
            | Foc::FluxErrorSum
            | Foc::HallInputs
            | Foc::EncoderInitState
            | Foc::EncoderInputs
            | Foc::EncoderCounter
            | Foc::ChopperActive
            | Foc::RightSwitch
            | Foc::LeftSwitch
            | Foc::HomeSwitch
            | Foc::MainLoops
            | Foc::TorqueLoops
            | Foc::VelocityLoops => return Err(Status::WRONG_TYPE),
            // Plain settings: those that reading gives back as they are.
            _ => self.settings[parameter] = value,
        }
        Ok(())
    }
}
