//! The supply of the bridge: a source behind a diode, the capacitor of the module, its own consumption, and the brake
//! chopper.

use super::decay::Decay;

/// What feeds the bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Voltage of the source in volt.
    pub voltage: f64,
    /// Resistance of source and wires in ohm. Behind it a diode keeps the source from taking power back.
    pub resistance: f64,
    /// Capacitance at the bridge in farad.
    pub capacitance: f64,
    /// What the module itself draws, in ampere per volt.
    pub conductance: f64,
    /// Resistor of the brake chopper in ohm; infinity where there is none.
    pub chopper: f64,
}

/// 24 V. Assumed: 50 mΩ of source and wires, 1 mF, 48 mA for the module, 10 Ω for the chopper.
impl Default for Supply {
    fn default() -> Self {
        Self {
            voltage: 24.0,
            resistance: 0.05,
            capacitance: 1e-3,
            conductance: 0.002,
            chopper: 10.0,
        }
    }
}

/// How the capacitor's voltage goes on in a span of time: with and without the source, with and without the chopper.
#[derive(Clone, Copy, Debug)]
pub(super) struct SupplySpan([[Decay; 2]; 2]);

impl Supply {
    /// In ampere per volt of the source.
    pub(super) fn source_conductance(&self) -> f64 {
        1.0 / self.resistance.max(1e-6)
    }

    /// In ampere per volt of the bus.
    pub(super) fn chopper_conductance(&self) -> f64 {
        1.0 / self.chopper.max(1e-3)
    }

    /// For a span with this chopper alone, or for any.
    pub(super) fn span(&self, seconds: f64, chopper: Option<bool>) -> SupplySpan {
        let decay = |source, chopper| {
            Decay::new(self.conductance + source + chopper, self.capacitance, seconds)
        };
        let row = |source| {
            let with = |on| decay(source, if on { self.chopper_conductance() } else { 0.0 });
            chopper.map_or_else(|| [with(false), with(true)], |on| [with(on); 2])
        };
        SupplySpan([row(0.0), row(self.source_conductance())])
    }
}

impl SupplySpan {
    pub(super) fn decay(&self, source: bool, chopper: bool) -> &Decay {
        &self.0[usize::from(source)][usize::from(chopper)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capacitor_is_filled_by_the_source_and_emptied_by_the_chopper() {
        let supply = Supply { conductance: 0.0, ..Supply::default() };
        let span = supply.span(100e-6, None);
        let filled = span.decay(true, false).end(0.0, supply.voltage / supply.resistance);
        assert!((filled - 24.0 * (1.0 - (-2.0f64).exp())).abs() < 1e-9);
        let emptied = span.decay(false, true).end(24.0, 0.0);
        assert!((emptied - 24.0 * (-0.01f64).exp()).abs() < 1e-9);
        let kept = span.decay(false, false).end(24.0, -2.0);
        assert!((kept - (24.0 - 2.0 * 100e-6 / 1e-3)).abs() < 1e-9);
    }
}
