//! The pins of a module by the numbers that SIO and GIO have for them.

use opentmcl_catalog::{Module, Port, PortBehaviour};

use crate::failure::Failure;

/// Number and bit of each general purpose output.
pub(super) fn outputs(model: &'static Module) -> impl Iterator<Item = (u8, u8)> {
    rows(model, PortBehaviour::DigitalOutput)
        .filter(|port| port.access.write)
        .map(|port| (port.number, port.index % 8))
}

/// The digital input with this number; the failure lists those that there are.
pub(super) fn digital_input(model: &'static Module, number: u8) -> Result<&'static Port, Failure> {
    input(model, PortBehaviour::DigitalInput, "digital", number)
}

/// The analog input with this number; the failure lists those that there are.
pub(super) fn analog_input(model: &'static Module, number: u8) -> Result<&'static Port, Failure> {
    input(model, PortBehaviour::AnalogInput, "analog", number)
}

fn input(
    model: &'static Module,
    behaviour: PortBehaviour,
    kind: &str,
    number: u8,
) -> Result<&'static Port, Failure> {
    model.port(behaviour, number).ok_or_else(|| {
        let numbers: Vec<String> =
            rows(model, behaviour).map(|port| port.number.to_string()).collect();
        Failure::usage(format!("the {} has no {kind} input {number}", model.title))
            .help(format!("its {kind} inputs are {}", numbers.join(", ")))
    })
}

fn rows(model: &'static Module, behaviour: PortBehaviour) -> impl Iterator<Item = &'static Port> {
    model.ports.iter().filter(move |port| port.behaviour == behaviour)
}
