//! The hardware of a virtual module: chips, pins, converters and a flash.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::{Module, PortBehaviour};
use opentmcl_firmware::{Analog, Board};
use opentmcl_plant::axis::{Axis, View};
use opentmcl_plant::machine::Machine;
use opentmcl_wire::Instant;

use crate::flash::MemoryFlash;

/// A board with one TMC5160 for each axis. Axes move in empty space: there are no switches.
#[derive(Clone, Debug)]
pub struct VirtualBoard<F = MemoryFlash> {
    model: &'static Module,
    now: Instant,
    axes: Vec<Axis>,
    /// When each chip next changes by itself, after `now`; kept until the chip is touched.
    events: Vec<Foreseen>,
    digital_inputs: u8,
    digital_outputs: u8,
    torque_inputs: u8,
    analog_inputs: [i32; 8],
    analog_ranges: [u8; 8],
    supply_voltage: i32,
    temperature: i32,
    supply_current: i32,
    pull_ups: u8,
    flash: F,
}

/// What is known of a chip's next event.
#[derive(Clone, Copy, Debug)]
enum Foreseen {
    Unknown,
    At(Option<Instant>),
}

impl<F> VirtualBoard<F> {
    /// A board for a module, with nothing connected to its pins.
    pub fn new(model: &'static Module, flash: F) -> Self {
        let axes = usize::from(model.axes);
        let at_rest = |behaviour| {
            let mut rows = model.ports.iter();
            rows.find(|row| row.behaviour == behaviour).map_or(0, |row| row.default)
        };
        Self {
            model,
            now: Instant::from_ticks(0),
            axes: (0..axes).map(|_| Axis::new()).collect(),
            events: vec![Foreseen::Unknown; axes],
            digital_inputs: levels(model, PortBehaviour::DigitalInput),
            digital_outputs: 0,
            torque_inputs: levels(model, PortBehaviour::StoInput),
            analog_inputs: [at_rest(PortBehaviour::AnalogInput); 8],
            analog_ranges: [0; 8],
            supply_voltage: at_rest(PortBehaviour::SupplyVoltage),
            temperature: at_rest(PortBehaviour::Temperature),
            supply_current: at_rest(PortBehaviour::SupplyCurrent),
            pull_ups: 0,
            flash,
        }
    }

    /// Sets the level of a general purpose input, 0..=7.
    pub fn set_digital_input(&mut self, input: u8, level: bool) {
        let bit = 1 << (input % 8);
        self.digital_inputs =
            if level { self.digital_inputs | bit } else { self.digital_inputs & !bit };
    }

    /// Sets the reading of an analog input, 0..=4095.
    pub fn set_analog_input(&mut self, input: u8, reading: u16) {
        self.analog_inputs[usize::from(input % 8)] = i32::from(reading.min(4095));
    }

    /// The machine behind an axis; none if it moves in empty space or if there is no such axis.
    pub fn machine(&self, axis: u8) -> Option<&Machine> {
        self.axes.get(usize::from(axis))?.machine()
    }

    /// What an axis really does at this time; none if there is no such axis.
    pub fn view(&mut self, axis: u8, now: Instant) -> Option<View> {
        self.axes.get_mut(usize::from(axis)).map(|axis| axis.view(now))
    }

    /// Levels of the general purpose outputs, bit n for output n.
    pub fn digital_outputs(&self) -> u8 {
        self.digital_outputs
    }

    /// Range that has been selected for an analog input: 0 is 0..10 V, 1 is 0..20 V, 2 is -10..10 V.
    pub fn analog_range(&self, input: u8) -> u8 {
        self.analog_ranges[usize::from(input % 8)]
    }

    /// Groups of switch inputs whose pull-up resistors are on: bit 0 axes 0..=2, bit 1 axes 3..=5.
    pub fn pull_ups(&self) -> u8 {
        self.pull_ups
    }

    /// The flash, to cut its power or to keep its contents.
    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Takes the flash out of the board.
    pub fn into_flash(self) -> F {
        self.flash
    }

    fn touch(&mut self, axis: u8) -> Option<&mut Axis> {
        *self.events.get_mut(usize::from(axis))? = Foreseen::Unknown;
        self.axes.get_mut(usize::from(axis))
    }
}

/// Levels of all inputs of one kind with nothing connected.
fn levels(model: &Module, behaviour: PortBehaviour) -> u8 {
    let rows = model.ports.iter().filter(|row| row.behaviour == behaviour && row.default != 0);
    rows.fold(0, |levels, row| levels | 1 << (row.index % 8))
}

impl<F: NorFlash> Board for VirtualBoard<F> {
    type Flash = F;

    fn set_time(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&mut self) -> Option<Instant> {
        let now = self.now;
        let mut next: Option<Instant> = None;
        for (foreseen, axis) in self.events.iter_mut().zip(&mut self.axes) {
            let event = match *foreseen {
                Foreseen::At(None) => None,
                Foreseen::At(Some(at)) if at > now => Some(at),
                _ => {
                    let event = axis.next_event(now);
                    *foreseen = Foreseen::At(event);
                    event
                }
            };
            if let Some(event) = event {
                next = Some(next.map_or(event, |next| next.min(event)));
            }
        }
        next
    }

    fn read_register(&mut self, axis: u8, address: u8) -> u32 {
        let now = self.now;
        self.axes.get_mut(usize::from(axis)).map_or(0, |axis| axis.read(address, now))
    }

    fn write_register(&mut self, axis: u8, address: u8, value: u32) {
        let now = self.now;
        if let Some(chip) = self.touch(axis) {
            chip.write(address, value, now);
        }
    }

    fn digital_inputs(&mut self) -> u8 {
        self.digital_inputs
    }

    fn home_switch(&mut self, _axis: u8) -> bool {
        false
    }

    fn torque_inputs(&mut self) -> u8 {
        self.torque_inputs
    }

    fn analog(&mut self, channel: Analog) -> i32 {
        match channel {
            Analog::Input(input) => self.analog_inputs[usize::from(input % 8)],
            Analog::SupplyVoltage => self.supply_voltage,
            Analog::Temperature => self.temperature,
            Analog::SupplyCurrent => self.supply_current,
        }
    }

    fn set_analog_range(&mut self, input: u8, range: u8) {
        self.analog_ranges[usize::from(input % 8)] = range;
    }

    fn set_digital_outputs(&mut self, levels: u8) {
        self.digital_outputs = levels;
    }

    fn set_pull_ups(&mut self, groups: u8) {
        self.pull_ups = groups;
    }

    fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    fn reset(&mut self) {
        for axis in 0..self.model.axes {
            let now = self.now;
            if let Some(chip) = self.touch(axis) {
                chip.reset(now);
            }
        }
        self.digital_outputs = 0;
    }
}
