//! The hardware of a virtual module: chips, pins, converters and a flash.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::{Module, Port as PortRow, PortBehaviour};
use opentmcl_firmware::{Analog, Board, Power, Senses};
use opentmcl_plant::axis::{Influence, SwitchInput, View};
use opentmcl_plant::servo;
use opentmcl_wire::Instant;

use crate::axes::Axes;
use crate::flash::MemoryFlash;
use crate::scenario::MachineSetup;
use crate::world::AnalogLevel;

/// Largest reading of an analog input.
const FULL_SCALE: u16 = 4095;

/// A board with the chips that the catalogue names, and a machine behind those axes that have one.
#[derive(Clone, Debug)]
pub struct VirtualBoard<F = MemoryFlash> {
    model: &'static Module,
    now: Instant,
    axes: Axes,
    /// When each axis next changes by itself, after `now`; kept until it is touched.
    events: Vec<Foreseen>,
    digital_inputs: u8,
    digital_outputs: u8,
    torque_inputs: u8,
    analog_inputs: [AnalogLevel; 8],
    analog_ranges: [u8; 8],
    /// In volt.
    supply_voltage: f64,
    /// In degrees Celsius.
    temperature: f64,
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
    /// A board for a module, with nothing connected to its pins and motors that follow every step, or the usual
    /// machine of a servo module.
    pub fn new(model: &'static Module, flash: F) -> Self {
        Self::with_machines(model, Vec::new(), flash)
    }

    /// A board with these machines behind its axes, by number; without one, an axis is as in
    /// [`VirtualBoard::new`].
    pub fn with_machines(
        model: &'static Module,
        machines: Vec<Option<MachineSetup>>,
        flash: F,
    ) -> Self {
        let at_rest = |behaviour| {
            let mut rows = model.ports.iter();
            rows.find(|row| row.behaviour == behaviour).map_or(0, |row| row.default)
        };
        let reading_at_rest = u16::try_from(at_rest(PortBehaviour::AnalogInput)).unwrap_or(0);
        Self {
            model,
            now: Instant::from_ticks(0),
            events: vec![Foreseen::Unknown; usize::from(model.axes)],
            axes: Axes::new(model, machines),
            digital_inputs: levels(model, PortBehaviour::DigitalInput),
            digital_outputs: 0,
            torque_inputs: levels(model, PortBehaviour::StoInput),
            analog_inputs: [AnalogLevel::Reading(reading_at_rest); 8],
            analog_ranges: [0; 8],
            supply_voltage: f64::from(at_rest(PortBehaviour::SupplyVoltage)) / 10.0,
            temperature: f64::from(at_rest(PortBehaviour::Temperature)),
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
        self.set_analog_level(input, AnalogLevel::Reading(reading));
    }

    /// Sets the reading or the voltage of an analog input. A voltage is read in the range that is
    /// selected at that time.
    pub fn set_analog_level(&mut self, input: u8, level: AnalogLevel) {
        self.analog_inputs[usize::from(input % 8)] = level;
    }

    /// What the converter of an analog input reads, 0..=4095.
    pub fn analog_reading(&self, input: u8) -> u16 {
        let input = usize::from(input % 8);
        let volts = match self.analog_inputs[input] {
            AnalogLevel::Reading(reading) => return reading.min(FULL_SCALE),
            AnalogLevel::Volts(volts) => volts,
        };
        let part = match self.analog_ranges[input] {
            0 => volts / 10.0,
            1 => volts / 20.0,
            _ => (volts + 10.0) / 20.0,
        };
        // Saturates at both ends, as the converter does.
        (part * f64::from(FULL_SCALE)).round().clamp(0.0, f64::from(FULL_SCALE)) as u16
    }

    /// Levels of the general purpose inputs, bit n for input n.
    pub fn input_levels(&self) -> u8 {
        self.digital_inputs
    }

    /// Levels of the safe-torque-off inputs, bit n for input n.
    pub fn torque_levels(&self) -> u8 {
        self.torque_inputs
    }

    /// Supply voltage in volt.
    pub fn supply(&self) -> f64 {
        self.supply_voltage
    }

    /// Sets the supply voltage in volt, of the board and of all drivers.
    pub fn set_supply(&mut self, volts: f64) {
        self.supply_voltage = volts;
        self.influence_all(Influence::Supply(volts));
    }

    /// Temperature of the board in degrees Celsius.
    pub fn temperature(&self) -> f64 {
        self.temperature
    }

    /// Sets the temperature of the board in degrees Celsius.
    pub fn set_temperature(&mut self, celsius: f64) {
        self.temperature = celsius;
    }

    /// Sets the level of a safe-torque-off input. Motors have torque while all of them allow it.
    pub fn set_torque_input(&mut self, input: u8, allowed: bool) {
        let bit = 1 << (input % 8);
        self.torque_inputs =
            if allowed { self.torque_inputs | bit } else { self.torque_inputs & !bit };
        let all = levels_of(self.model, PortBehaviour::StoInput, |_| true);
        let allowed = self.torque_inputs & all == all;
        self.influence_all(Influence::TorqueAllowed(allowed));
    }

    /// Does something to the machine of an axis at the board's time; nothing if there is none.
    pub(crate) fn influence(&mut self, axis: u8, influence: Influence) {
        let now = self.now;
        self.touch(self.axes.moved_with(axis));
        self.axes.influence(axis, influence, now);
    }

    /// Does something that only the machine of a servo axis knows.
    pub(crate) fn influence_servo(&mut self, influence: servo::Influence) {
        let now = self.now;
        if let Some(servo) = self.axes.servo() {
            servo.influence(influence, now);
        }
    }

    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    pub(crate) fn hold_switch(&mut self, axis: u8, switch: SwitchInput, held: Option<bool>) {
        let now = self.now;
        self.touch(self.axes.moved_with(axis));
        self.axes.hold_switch(axis, switch, held, now);
    }

    fn influence_all(&mut self, influence: Influence) {
        for axis in 0..self.model.axes {
            self.influence(axis, influence);
        }
    }

    /// What a stepper axis really does at this time; none if there is no such axis.
    pub fn view(&mut self, axis: u8, now: Instant) -> Option<View> {
        self.axes.view(axis, now)
    }

    /// What the driver of an axis tells at this time: the stall in bit 0, and the errors of its bits 25 to 30 in bits
    /// 1 to 6, as in [`Sense`](opentmcl_plant::driver::Sense).
    pub fn driver_flags(&mut self, axis: u8, now: Instant) -> u32 {
        self.axes.driver_flags(axis, now)
    }

    /// What a servo axis really does at this time; none if there is no such axis.
    pub fn servo_view(&mut self, axis: u8, now: Instant) -> Option<servo::View> {
        if axis == 0 { self.axes.servo().map(|servo| servo.view(now)) } else { None }
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

    /// What the machine of a servo axis tells by a converter; none if there is none, or if it does not.
    fn servo_reading(&mut self, channel: Analog) -> Option<i32> {
        let now = self.now;
        let servo = self.axes.servo()?;
        let reading = match channel {
            Analog::SupplyVoltage => servo.supply(now) * 10.0,
            Analog::Temperature => servo.temperatures(now)[1],
            Analog::MotorTemperature => servo.temperatures(now)[0],
            Analog::Input(_) | Analog::SupplyCurrent => return None,
        };
        Some(reading.round() as i32)
    }

    /// Something is done to some axes: what was foreseen of them may change.
    fn touch(&mut self, axes: u8) {
        for (number, event) in self.events.iter_mut().enumerate() {
            if axes >> number & 1 == 1 {
                *event = Foreseen::Unknown;
            }
        }
    }
}

/// Levels of all inputs of one kind with nothing connected.
fn levels(model: &Module, behaviour: PortBehaviour) -> u8 {
    levels_of(model, behaviour, |row| row.default != 0)
}

/// The bits of all inputs of one kind that are wanted.
fn levels_of(model: &Module, behaviour: PortBehaviour, wanted: impl Fn(&PortRow) -> bool) -> u8 {
    let rows = model.ports.iter().filter(|row| row.behaviour == behaviour && wanted(row));
    rows.fold(0, |levels, row| levels | 1 << (row.index % 8))
}

/// A converter's value within the range that the catalogue gives it.
fn converted(model: &Module, behaviour: PortBehaviour, value: f64) -> i32 {
    let row = model.ports.iter().find(|row| row.behaviour == behaviour);
    let (least, most) = row.map_or((i32::MIN, i32::MAX), |row| (row.min, row.max));
    (value.round() as i32).clamp(least, most)
}

impl<F: NorFlash> Board for VirtualBoard<F> {
    type Flash = F;

    fn set_time(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&mut self) -> Option<Instant> {
        let now = self.now;
        let mut next: Option<Instant> = None;
        for (axis, foreseen) in (0..).zip(self.events.iter_mut()) {
            let event = match *foreseen {
                Foreseen::At(None) => None,
                Foreseen::At(Some(at)) if at > now => Some(at),
                _ => {
                    let event = self.axes.next_event(axis, now);
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

    fn axes_with_event(&mut self) -> u8 {
        let now = self.now;
        let due = |event: &Foreseen| match *event {
            Foreseen::At(event) => event.is_some_and(|at| at <= now),
            Foreseen::Unknown => true,
        };
        let events = (0..).zip(&self.events).filter(|(_, event)| due(event));
        events.fold(0, |axes, (axis, _)| axes | 1 << axis)
    }

    fn read_register(&mut self, axis: u8, address: u8) -> u32 {
        self.axes.read(axis, address, self.now)
    }

    fn write_register(&mut self, axis: u8, address: u8, value: u32) {
        self.touch(self.axes.touched_with(axis, address));
        self.axes.write(axis, address, value, self.now);
    }

    #[inline]
    fn sense(&mut self, _: u8, senses: &mut Senses) {
        let now = self.now;
        if let Some(servo) = self.axes.servo() {
            servo.sense(senses, now);
        }
    }

    #[inline]
    fn drive(&mut self, _: u8, power: &Power) {
        let now = self.now;
        if let Some(servo) = self.axes.servo() {
            servo.drive(power, now);
        }
    }

    fn is_still(&mut self, _: u8) -> bool {
        self.axes.servo().is_none_or(|servo| servo.is_still())
    }

    fn limit_switches(&mut self, _: u8) -> (bool, bool) {
        let now = self.now;
        let switches = self.axes.servo().map(|servo| servo.switches(now)).unwrap_or_default();
        (switches[0], switches[1])
    }

    fn digital_inputs(&mut self) -> u8 {
        self.digital_inputs
    }

    fn home_switch(&mut self, axis: u8) -> bool {
        self.axes.home_switch(axis, self.now)
    }

    fn torque_inputs(&mut self) -> u8 {
        self.torque_inputs
    }

    fn analog(&mut self, channel: Analog) -> i32 {
        if let Some(reading) = self.servo_reading(channel) {
            return reading;
        }
        match channel {
            Analog::Input(input) => i32::from(self.analog_reading(input)),
            Analog::SupplyVoltage => {
                converted(self.model, PortBehaviour::SupplyVoltage, self.supply_voltage * 10.0)
            }
            Analog::Temperature | Analog::MotorTemperature => {
                converted(self.model, PortBehaviour::Temperature, self.temperature)
            }
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
        self.events.fill(Foreseen::Unknown);
        self.axes.reset(self.now);
        self.digital_outputs = 0;
    }
}
