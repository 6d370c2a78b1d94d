//! What is behind the axes of a module, and what it really does.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_plant::axis::View;
use opentmcl_plant::servo;

use crate::module::VirtualModule;
use crate::scenario::{MachineSetup, Scale};

impl<F: NorFlash> VirtualModule<F> {
    /// What a stepper axis really does, which no register tells; none if there is no such axis.
    pub fn view(&mut self, axis: u8) -> Option<View> {
        let now = self.now();
        self.board_mut().view(axis, now)
    }

    /// What a servo axis really does, which no parameter tells; none if there is no such axis.
    pub fn servo_view(&mut self, axis: u8) -> Option<servo::View> {
        let now = self.now();
        self.board_mut().servo_view(axis, now)
    }

    /// Where the stage of an axis really is, in fine steps: 1/256 full step of a stepper motor, 1/65536 turn of a
    /// servo motor. None if there is no such axis.
    pub fn stage(&mut self, axis: u8) -> Option<f64> {
        match self.view(axis) {
            Some(view) => Some(view.stage),
            None => self.servo_view(axis).map(|view| view.stage),
        }
    }

    /// How the stage of an axis is measured; that of a bare motor if there is no such axis.
    pub fn scale(&self, axis: u8) -> Scale {
        self.world().axes.get(usize::from(axis)).map(|axis| axis.scale).unwrap_or_default()
    }

    /// Whether there is a machine behind an axis: by the scenario, or because a servo axis always has one.
    pub fn has_machine(&self, axis: u8) -> bool {
        self.machine(axis).is_some()
    }

    /// The machine behind an axis; none if it moves in empty space or if there is no such axis.
    pub fn machine(&self, axis: u8) -> Option<&MachineSetup> {
        self.world().axes.get(usize::from(axis))?.machine.as_ref()
    }
}
