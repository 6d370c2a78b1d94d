//! Motors of servo axes.

use core::f64::consts::PI;

/// The motor of a servo axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motor {
    /// Three phases, commutated by the module.
    Brushless(Brushless),
    /// A commutator and brushes, between legs A and B of the bridge.
    Brushed(Brushed),
}

/// A permanent magnet motor with three phases in star, or its equivalent in star, and sinusoidal EMF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brushless {
    /// Pole pairs: a turn has as many electrical turns.
    pub pole_pairs: u32,
    /// Resistance of a phase of the star in ohm.
    pub resistance: f64,
    /// Inductance of a phase of the star in henry, the same in all positions of the rotor.
    pub inductance: f64,
    /// Flux of the magnets linked with a phase in weber, peak. Times the electrical speed in rad/s it is the
    /// amplitude of a phase's EMF.
    pub flux_linkage: f64,
    /// Inertia of the rotor in kg m².
    pub inertia: f64,
    /// Torque of the bearings' dry friction in Nm.
    pub friction: f64,
    /// Viscous friction in Nm per rad/s.
    pub viscous: f64,
    /// Cogging.
    pub cogging: Cogging,
    /// Rated current of a phase in ampere.
    pub rated_current: f64,
}

/// Torque by which the magnets prefer certain positions: `-torque sin(per_turn angle)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cogging {
    /// Its amplitude in Nm; 0 is none.
    pub torque: f64,
    /// Positions of rest in a turn.
    pub per_turn: u32,
}

/// A motor with brushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brushed {
    /// Resistance between its terminals in ohm.
    pub resistance: f64,
    /// Inductance between its terminals in henry.
    pub inductance: f64,
    /// Torque in Nm per ampere, which is the EMF in volt per rad/s too.
    pub torque_constant: f64,
    /// Inertia of the rotor in kg m².
    pub inertia: f64,
    /// Torque of dry friction of bearings and brushes in Nm.
    pub friction: f64,
    /// Viscous friction in Nm per rad/s.
    pub viscous: f64,
}

/// What a data sheet tells of a brushless motor, between two terminals, whether its winding is star or delta.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSheet {
    /// Pole pairs.
    pub pole_pairs: u32,
    /// Resistance between two terminals in ohm.
    pub resistance: f64,
    /// Inductance between two terminals in henry.
    pub inductance: f64,
    /// Torque constant in Nm per ampere with current through two terminals, as in block commutation.
    pub torque_constant: f64,
    /// Inertia of the rotor in kg m².
    pub inertia: f64,
    /// Rated current in ampere.
    pub rated_current: f64,
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

impl Brushless {
    /// The motor in star that behaves between its terminals as a data sheet says. Bearings have the friction
    /// that is customary for motors of this size, since data sheets do not tell it: 2.5 mNm and 10 µNm per rad/s.
    ///
    /// The torque constant counts as the peak of the EMF between two terminals in volt per rad/s.
    pub const fn from_data_sheet(sheet: DataSheet) -> Self {
        Self {
            pole_pairs: sheet.pole_pairs,
            resistance: sheet.resistance / 2.0,
            inductance: sheet.inductance / 2.0,
            flux_linkage: sheet.torque_constant / (SQRT_3 * sheet.pole_pairs as f64),
            inertia: sheet.inertia,
            friction: 2.5e-3,
            viscous: 1e-5,
            cogging: Cogging { torque: 0.0, per_turn: 0 },
            rated_current: sheet.rated_current,
        }
    }

    /// Torque in Nm per ampere of amplitude, with the current at right angles to the flux.
    pub const fn torque_constant(&self) -> f64 {
        1.5 * self.pole_pairs as f64 * self.flux_linkage
    }

    /// Speed in revolutions per minute at which the peak of the EMF between two terminals is this voltage.
    pub const fn no_load_speed(&self, volts: f64) -> f64 {
        volts / (SQRT_3 * self.flux_linkage * self.pole_pairs as f64) * 30.0 / PI
    }
}

impl Motor {
    /// Inertia of the rotor in kg m².
    pub const fn inertia(&self) -> f64 {
        match self {
            Self::Brushless(motor) => motor.inertia,
            Self::Brushed(motor) => motor.inertia,
        }
    }
}

/// A motor under the name by which it is ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Name in lower case.
    pub name: &'static str,
    /// Its data.
    pub motor: Brushless,
}

const fn qbl4208(
    name: &'static str,
    rated_current: f64,
    resistance: f64,
    millihenry: f64,
    gram_square_centimetre: f64,
) -> Preset {
    let motor = Brushless::from_data_sheet(DataSheet {
        pole_pairs: 4,
        resistance,
        inductance: millihenry * 1e-3,
        torque_constant: 0.036,
        inertia: gram_square_centimetre * 1e-7,
        rated_current,
    });
    Preset { name, motor }
}

/// Motors by name. Source: the manufacturer's manual of QBL4208, V1.40.
///
/// It prints inertias that are ten times those of other makers' motors of the same size and weight, and more than a
/// solid rotor of steel would have. The names that end in `-light` have a tenth of them.
pub const PRESETS: &[Preset] = &[
    qbl4208("qbl4208-61-04-013", 3.47, 0.72, 1.2, 480.0),
    qbl4208("qbl4208-61-04-013-light", 3.47, 0.72, 1.2, 48.0),
    qbl4208("qbl4208-100-04-025", 6.95, 0.28, 0.54, 960.0),
    qbl4208("qbl4208-100-04-025-light", 6.95, 0.28, 0.54, 96.0),
];

/// The motor of this name.
pub fn preset(name: &str) -> Option<Brushless> {
    PRESETS.iter().find(|preset| preset.name == name).map(|preset| preset.motor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(value: f64, expected: f64, part: f64) -> bool {
        (value - expected).abs() <= expected.abs() * part
    }

    #[test]
    fn data_between_terminals_become_those_of_a_star() {
        let motor = preset("qbl4208-61-04-013").unwrap();
        assert_eq!((motor.resistance, motor.inductance), (0.36, 0.6e-3));
        assert!(near(motor.flux_linkage, 5.20e-3, 1e-3));
        assert!(near(motor.torque_constant(), 0.0312, 1e-3));
        assert!(near(motor.no_load_speed(24.0), 6370.0, 1e-3));
        assert_eq!(motor.inertia, 48e-6);
    }

    #[test]
    fn a_light_rotor_has_a_tenth_of_the_printed_inertia_and_all_else_the_same() {
        for name in ["qbl4208-61-04-013", "qbl4208-100-04-025"] {
            let (printed, light) =
                (preset(name).unwrap(), preset(&format!("{name}-light")).unwrap());
            assert!(near(light.inertia, printed.inertia / 10.0, 1e-12));
            assert_eq!(Brushless { inertia: printed.inertia, ..light }, printed);
        }
        assert_eq!(preset("qbl4208"), None);
    }
}
