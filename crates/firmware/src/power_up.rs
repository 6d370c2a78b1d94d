//! What happens when the supply comes: settings from the EEPROM, defaults of the catalogue, the chips. And
//! what a board does that has its motor supply apart from its own.

use opentmcl_catalog::{
    self as catalog, AxisBehaviour, AxisParameter, GlobalBehaviour, Globals, Motion, PortBehaviour,
    Variables,
};
use opentmcl_wire::Status;
use opentmcl_wire::limits::{COORDINATES, VARIABLES};

use crate::axis::{AxisNumber, PerAxis};
use crate::board::{Analog, Board};
use crate::globals::GlobalSettings;
use crate::interrupts::{Interrupts, TIMERS};
use crate::module::Module;
use crate::storage;
use crate::terminal::Terminals;
use crate::tmc429::registers::{AXES_OF_A_TMC429, INVERT_DIRECTION, INVERT_SWITCHES};

/// Supply of the motors in 0.1 V from which on they have one. No source tells the threshold.
const LEAST_MOTOR_SUPPLY: i32 = 70;

impl<B: Board> Module<B> {
    /// What power-up, a software reset and a factory reset have in common, with all state new.
    pub(crate) fn start(&mut self) {
        self.load_eeprom();
        if self.has_lost_magic() {
            // A failed reset leaves what there is: the next start tries again.
            let _ = storage::factory_reset(self.board.flash());
            self.forget_settings();
        }
        self.terminals = Terminals::new(self.starts_in_ascii_mode());
        self.set_up_ports();
        for axis in AxisNumber::all(self.model.axes) {
            self.set_up_axis(axis);
        }
        self.start_servo();
        self.had_motor_supply = self.has_motor_supply();
        self.set_up_groups();
        self.levels = self.read_levels();
        self.tend(u8::MAX);
        self.restart_heartbeat();
        if self.globals[Globals::AutoStart] != 0 {
            self.run_program();
        }
    }

    /// What the EEPROM keeps takes its factory settings in memory.
    pub(crate) fn forget_settings(&mut self) {
        self.globals = GlobalSettings::new(self.model, self.now);
        self.variables = [0; VARIABLES];
        self.coordinates = PerAxis::new(|| [0; COORDINATES]);
        self.program.erase();
        self.interrupts = Interrupts::new();
    }

    /// Whether the EEPROM magic has been overwritten: whoever does that wants the factory settings back.
    fn has_lost_magic(&self) -> bool {
        let rows = self.model.global_parameters.iter();
        let effect = GlobalBehaviour::Globals(Globals::EepromMagic);
        let mut magic = rows.filter(|row| row.behaviour == effect);
        magic.any(|row| self.globals.number(row.number) != row.default)
    }

    /// Writes the defaults of the catalogue to an axis that has just been switched on.
    fn set_up_axis(&mut self, axis: AxisNumber) {
        let is_in_pps = self.model.motion == Motion::Tmc5160;
        let (mut drive, state) = self.drive(axis);
        // The others have no other units than their own, and their moves count from where the axis stands.
        state.internal_units = !is_in_pps;
        state.relative_positioning_option = i32::from(!is_in_pps);
        drive.initialize();
        for row in self.model.axis_parameters {
            // Where an axis stands and how it moves is no setting.
            let is_motion = matches!(
                row.behaviour,
                AxisBehaviour::Tmc5160(
                    catalog::Tmc5160::TargetPosition
                        | catalog::Tmc5160::ActualPosition
                        | catalog::Tmc5160::TargetSpeed
                        | catalog::Tmc5160::EncoderPosition
                ) | AxisBehaviour::Tmc429(
                    catalog::Tmc429::TargetPosition
                        | catalog::Tmc429::ActualPosition
                        | catalog::Tmc429::TargetSpeed
                        | catalog::Tmc429::RampMode
                ) | AxisBehaviour::Servo(
                    catalog::Servo::TargetPosition
                        | catalog::Servo::ActualPosition
                        | catalog::Servo::TargetVelocity
                        | catalog::Servo::TargetTorque
                ) | AxisBehaviour::Block(
                    catalog::Block::Reinitialize
                        | catalog::Block::DriverAcknowledge
                        | catalog::Block::DriverSpi
                )
            );
            if row.access.write && row.axes & axis.bit() != 0 && !is_motion {
                // The catalogue's defaults are within its ranges, so nothing is refused.
                let _: Result<(), Status> = self.write_axis_parameter(axis, row, row.default);
            }
        }
        self.restore_axis(axis);
    }

    /// Gives an axis the values that are stored for it.
    fn restore_axis(&mut self, axis: AxisNumber) {
        let storable = |row: &&AxisParameter| row.access.store && row.axes & axis.bit() != 0;
        for row in self.model.axis_parameters.iter().filter(storable) {
            let key = storage::Key::AxisParameter(row.number, axis.get());
            if let Ok(Some(value)) = storage::fetch(self.board.flash(), key) {
                // Only values that were in use are stored.
                let _: Result<(), Status> = self.write_axis_parameter(axis, row, value);
            }
        }
        if self.model.motion == Motion::Tmc429 {
            // The acceleration has been written before the divisors.
            let (now, has_supply) = (self.now, self.has_motor_supply());
            let (mut chip, state) = self.tmc429(axis);
            if !has_supply {
                chip.leave_half_restored();
            }
            chip.compute_braking_factor();
            state.stands_from(now);
        }
    }

    /// Whether the motors have their supply. A board with TMC429 also runs from the USB line alone, and then
    /// does not do everything.
    pub(crate) fn has_motor_supply(&mut self) -> bool {
        self.model.motion != Motion::Tmc429
            || self.board.analog(Analog::SupplyVoltage) >= LEAST_MOTOR_SUPPLY
    }

    /// When the motors get their supply back, the user variables are as after power-up: clients tell by
    /// them that it was gone.
    pub(crate) fn observe_supply(&mut self) {
        let has_supply = self.has_motor_supply();
        if has_supply && !self.had_motor_supply {
            self.restore_variables();
        }
        self.had_motor_supply = has_supply;
    }

    fn restore_variables(&mut self) {
        self.variables = [0; VARIABLES];
        if self.globals[Globals::DoNotRestoreUserVariables] != 0 {
            return;
        }
        let variables = GlobalBehaviour::Variables(Variables::UserVariable);
        let rows = self.model.global_parameters.iter();
        for row in rows.filter(|row| row.behaviour == variables && row.access.store) {
            for number in row.number..=row.last {
                let stored = storage::fetch(self.board.flash(), storage::Key::Variable(number));
                if let (Ok(Some(value)), Some(variable)) =
                    (stored, self.variables.get_mut(usize::from(number)))
                {
                    *variable = value;
                }
            }
        }
    }

    /// Tells each TMC429 the polarity of its switches and the direction of its motors.
    pub(crate) fn set_up_groups(&mut self) {
        if self.model.motion != Motion::Tmc429 {
            return;
        }
        let inverted = self.globals[Globals::EndSwitchPolarity];
        let reversed = self.globals[Globals::ReverseShaft];
        for axis in
            AxisNumber::all(self.model.axes).filter(|axis| axis.get() % AXES_OF_A_TMC429 == 0)
        {
            let bit = axis.get() / AXES_OF_A_TMC429;
            let (mut chip, _) = self.tmc429(axis);
            chip.write_field(INVERT_SWITCHES, (inverted >> bit) as u32 & 1);
            chip.write_field(INVERT_DIRECTION, (reversed >> bit) as u32 & 1);
        }
    }

    fn set_up_ports(&mut self) {
        for port in self.model.ports.iter().filter(|port| port.access.write) {
            match port.behaviour {
                PortBehaviour::PullUps => self.board.set_pull_ups(port.default as u8),
                PortBehaviour::AdcRange => {
                    self.board.set_analog_range(port.index, port.default as u8);
                }
                _ => {}
            }
        }
        self.board.set_digital_outputs(self.digital_outputs);
    }

    fn load_eeprom(&mut self) {
        let Self { board, globals, variables, coordinates, program, model, interrupts, .. } = self;
        let (axes, now) = (model.axes, self.now);
        storage::load(board.flash(), |key, item| match (key, item) {
            (storage::Key::Global(number), storage::Item::Number(value)) => {
                let row = model.global_parameter(0, number);
                if row.is_some_and(|row| row.access.automatic || row.access.store) {
                    globals.set_number(number, value);
                }
            }
            (storage::Key::Variable(number), storage::Item::Number(value)) => {
                variables[usize::from(number)] = value;
            }
            (storage::Key::Coordinate(coordinate, axis), storage::Item::Number(value)) => {
                if let Some(axis) = AxisNumber::new(axis, axes)
                    && let Some(place) = coordinates[axis].get_mut(usize::from(coordinate))
                {
                    *place = value;
                }
            }
            (storage::Key::Chunk(chunk), storage::Item::Commands(bytes)) => {
                program.load_chunk(chunk, bytes);
            }
            (storage::Key::Interrupt(number), storage::Item::Number(value)) => {
                if usize::from(number) < TIMERS {
                    interrupts.set_timer_period(number, value as u32, now);
                } else {
                    interrupts.set_transitions(number, value as u8);
                }
            }
            _ => {}
        });
        if self.globals[Globals::DoNotRestoreUserVariables] != 0 {
            self.variables = [0; VARIABLES];
        }
    }
}
