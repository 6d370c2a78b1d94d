//! The commands of the language: number, mnemonic and the place of each operand.
//!
//! One table, [`FORMS`], says it for reading and writing text, for the catalogue's checks and for
//! whoever explains a command to a user. It holds the commands of all modules; which of them a module
//! knows, the catalogue says. Source: firmware manual 3.4, 3.5.7 and 3.6; the errata for CALL, GIV
//! and AIV; STAP, RSAP and SAC from the manuals of older modules.

/// Which field of a [`crate::Command`] an operand fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The type field, 0..=255.
    Kind,
    /// The motor or bank field, 0..=255.
    Motor,
    /// The value field, 32 bit signed.
    Value,
}

/// What the number in an operand counts, so that a tool can look it up for a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// One of the operand's words.
    Choice,
    /// An axis; with MVP COORD a set of them.
    Axis,
    /// A bank of global parameters or of ports.
    Bank,
    /// An axis parameter.
    AxisParameter,
    /// A global parameter of the bank in the bank operand.
    GlobalParameter,
    /// An input or output of the bank in the bank operand.
    Port,
    /// A coordinate.
    Coordinate,
    /// An interrupt.
    Interrupt,
    /// A user variable.
    Variable,
    /// An address in the program, written as a label.
    Address,
    /// A time in steps of 10 ms.
    Ticks,
    /// A speed.
    Velocity,
    /// A position, a distance, or with MVP COORD a coordinate.
    Position,
    /// Whatever the command makes of it.
    Number,
}

/// One operand of a command's mnemonic form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operand {
    /// What the operand means, one or two words.
    pub name: &'static str,
    /// What its number counts.
    pub meaning: Meaning,
    /// The field it fills.
    pub field: Field,
    /// Keywords that may be written instead of a number, each with its number.
    pub words: &'static [(&'static str, u8)],
}

/// The mnemonic form of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// The command.
    pub opcode: Opcode,
    /// Its name, upper case.
    pub mnemonic: &'static str,
    /// Its operands in the order in which they are written.
    pub operands: &'static [Operand],
}

const fn operand(name: &'static str, field: Field, meaning: Meaning) -> Operand {
    Operand { name, meaning, field, words: &[] }
}

const fn choice(name: &'static str, words: &'static [(&'static str, u8)]) -> Operand {
    Operand { name, meaning: Meaning::Choice, field: Field::Kind, words }
}

const MOVES: Operand = choice("kind of move", &[("ABS", 0), ("REL", 1), ("COORD", 2)]);
const SEARCH: Operand = choice("action", &[("START", 0), ("STOP", 1), ("STATUS", 2)]);
const WAIT: Operand =
    choice("condition", &[("TICKS", 0), ("POS", 1), ("REFSW", 2), ("LIMSW", 3), ("RFS", 4)]);
const FLAG: Operand =
    choice("flag", &[("ALL", 0), ("ETO", 1), ("EAL", 2), ("EDV", 3), ("EPO", 4), ("ESD", 5)]);
const CONDITION: Operand = choice(
    "condition",
    &[
        ("ZE", 0),
        ("NZ", 1),
        ("EQ", 2),
        ("NE", 3),
        ("GT", 4),
        ("GE", 5),
        ("LT", 6),
        ("LE", 7),
        ("ETO", 8),
        ("EAL", 9),
        ("EDV", 10),
        ("EPO", 11),
        ("ESD", 12),
    ],
);
const OPERATION: Operand = choice(
    "operation",
    &[
        ("ADD", 0),
        ("SUB", 1),
        ("MUL", 2),
        ("DIV", 3),
        ("MOD", 4),
        ("AND", 5),
        ("OR", 6),
        ("XOR", 7),
        ("NOT", 8),
        ("LOAD", 9),
        ("SWAP", 10),
        ("COMP", 11),
    ],
);
const MOTOR: Operand = operand("motor", Field::Motor, Meaning::Axis);
const BANK: Operand = operand("bank", Field::Motor, Meaning::Bank);
const AXIS_PARAMETER: Operand = operand("parameter", Field::Kind, Meaning::AxisParameter);
const GLOBAL_PARAMETER: Operand = operand("parameter", Field::Kind, Meaning::GlobalParameter);
const PORT: Operand = operand("port", Field::Kind, Meaning::Port);
const COORDINATE: Operand = operand("coordinate", Field::Kind, Meaning::Coordinate);
const INTERRUPT: Operand = operand("interrupt", Field::Kind, Meaning::Interrupt);
const VELOCITY: Operand = operand("velocity", Field::Value, Meaning::Velocity);
const POSITION: Operand = operand("position", Field::Value, Meaning::Position);
const VALUE: Operand = operand("value", Field::Value, Meaning::Number);
const ADDRESS: Operand = operand("address", Field::Value, Meaning::Address);
const TICKS: Operand = operand("ticks", Field::Value, Meaning::Ticks);
const VARIABLE: Operand = operand("variable", Field::Motor, Meaning::Variable);
const SECOND_VARIABLE: Operand = operand("variable", Field::Value, Meaning::Variable);
const COUNTER: Operand = operand("variable", Field::Kind, Meaning::Variable);
const BUS: Operand = operand("bus", Field::Kind, Meaning::Number);
const LENGTH: Operand = operand("length", Field::Motor, Meaning::Number);

macro_rules! commands {
    ($($(#[$doc:meta])* $name:ident = $number:literal $mnemonic:literal [$($operand:expr),*];)*) => {
        /// A command that has a mnemonic.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Opcode {
            $($(#[$doc])* $name = $number,)*
        }

        impl Opcode {
            /// The command with this number.
            pub const fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)*
                    _ => None,
                }
            }
        }

        /// All commands that have a mnemonic, by number.
        pub const FORMS: &[Form] = &[
            $(Form { opcode: Opcode::$name, mnemonic: $mnemonic, operands: &[$($operand),*] },)*
        ];
    };
}

commands! {
    /// Rotate right.
    Ror = 1 "ROR" [MOTOR, VELOCITY];
    /// Rotate left.
    Rol = 2 "ROL" [MOTOR, VELOCITY];
    /// Motor stop.
    Mst = 3 "MST" [MOTOR];
    /// Move to position.
    Mvp = 4 "MVP" [MOVES, MOTOR, POSITION];
    /// Set axis parameter.
    Sap = 5 "SAP" [AXIS_PARAMETER, MOTOR, VALUE];
    /// Get axis parameter.
    Gap = 6 "GAP" [AXIS_PARAMETER, MOTOR];
    /// Store axis parameter.
    Stap = 7 "STAP" [AXIS_PARAMETER, MOTOR];
    /// Restore axis parameter.
    Rsap = 8 "RSAP" [AXIS_PARAMETER, MOTOR];
    /// Set global parameter.
    Sgp = 9 "SGP" [GLOBAL_PARAMETER, BANK, VALUE];
    /// Get global parameter.
    Ggp = 10 "GGP" [GLOBAL_PARAMETER, BANK];
    /// Store global parameter.
    Stgp = 11 "STGP" [GLOBAL_PARAMETER, BANK];
    /// Restore global parameter.
    Rsgp = 12 "RSGP" [GLOBAL_PARAMETER, BANK];
    /// Reference search.
    Rfs = 13 "RFS" [SEARCH, MOTOR];
    /// Set output.
    Sio = 14 "SIO" [PORT, BANK, VALUE];
    /// Get input.
    Gio = 15 "GIO" [PORT, BANK];
    /// Set axis parameter, axis in X.
    Sapx = 16 "SAPX" [AXIS_PARAMETER, VALUE];
    /// Get axis parameter, axis in X.
    Gapx = 17 "GAPX" [AXIS_PARAMETER];
    /// Accumulator to axis parameter, axis in X.
    Aapx = 18 "AAPX" [AXIS_PARAMETER];
    /// Calculate with accumulator and constant.
    Calc = 19 "CALC" [OPERATION, VALUE];
    /// Compare accumulator with constant.
    Comp = 20 "COMP" [VALUE];
    /// Jump if condition.
    Jc = 21 "JC" [CONDITION, ADDRESS];
    /// Jump always.
    Ja = 22 "JA" [ADDRESS];
    /// Call subroutine.
    Csub = 23 "CSUB" [ADDRESS];
    /// Return from subroutine.
    Rsub = 24 "RSUB" [];
    /// Enable interrupt.
    Ei = 25 "EI" [INTERRUPT];
    /// Disable interrupt.
    Di = 26 "DI" [INTERRUPT];
    /// Wait for an event.
    Wait = 27 "WAIT" [WAIT, MOTOR, TICKS];
    /// End of program.
    Stop = 28 "STOP" [];
    /// Access to the SPI bus of older modules.
    Sac = 29 "SAC" [BUS, LENGTH, VALUE];
    /// Set coordinate.
    Sco = 30 "SCO" [COORDINATE, MOTOR, POSITION];
    /// Get coordinate.
    Gco = 31 "GCO" [COORDINATE, MOTOR];
    /// Capture coordinate.
    Cco = 32 "CCO" [COORDINATE, MOTOR];
    /// Calculate with accumulator and X.
    Calcx = 33 "CALCX" [OPERATION];
    /// Accumulator to axis parameter.
    Aap = 34 "AAP" [AXIS_PARAMETER, MOTOR];
    /// Accumulator to global parameter.
    Agp = 35 "AGP" [GLOBAL_PARAMETER, BANK];
    /// Clear error flags.
    Cle = 36 "CLE" [FLAG];
    /// Define interrupt vector.
    Vect = 37 "VECT" [INTERRUPT, ADDRESS];
    /// Return from interrupt.
    Reti = 38 "RETI" [];
    /// Accumulator to coordinate.
    Aco = 39 "ACO" [COORDINATE, MOTOR];
    /// Calculate with two user variables.
    Calcvv = 40 "CALCVV" [OPERATION, VARIABLE, SECOND_VARIABLE];
    /// Calculate with user variable and accumulator.
    Calcva = 41 "CALCVA" [OPERATION, VARIABLE];
    /// Calculate with accumulator and user variable.
    Calcav = 42 "CALCAV" [OPERATION, VARIABLE];
    /// Calculate with user variable and X.
    Calcvx = 43 "CALCVX" [OPERATION, VARIABLE];
    /// Calculate with X and user variable.
    Calcxv = 44 "CALCXV" [OPERATION, VARIABLE];
    /// Calculate with user variable and constant.
    Calcv = 45 "CALCV" [OPERATION, VARIABLE, VALUE];
    /// Move to position in the accumulator.
    Mvpa = 46 "MVPA" [MOVES, MOTOR];
    /// Move to position in the accumulator, axis in X.
    Mvpxa = 47 "MVPXA" [MOVES];
    /// Restart program at address.
    Rst = 48 "RST" [ADDRESS];
    /// Decrement variable and jump if not zero.
    Djnz = 49 "DJNZ" [COUNTER, ADDRESS];
    /// Rotate left with speed in the accumulator.
    Rola = 50 "ROLA" [MOTOR];
    /// Rotate right with speed in the accumulator.
    Rora = 51 "RORA" [MOTOR];
    /// Rotate left with speed in the accumulator, axis in X.
    Rolxa = 52 "ROLXA" [];
    /// Rotate right with speed in the accumulator, axis in X.
    Rorxa = 53 "RORXA" [];
    /// Stop the axis in X.
    Mstx = 54 "MSTX" [];
    /// Set variable indexed by X.
    Siv = 55 "SIV" [VALUE];
    /// Get variable indexed by X.
    Giv = 56 "GIV" [];
    /// Accumulator to variable indexed by X.
    Aiv = 57 "AIV" [];
    /// User function 0.
    Uf0 = 64 "UF0" [];
    /// User function 1.
    Uf1 = 65 "UF1" [];
    /// User function 2.
    Uf2 = 66 "UF2" [];
    /// User function 3.
    Uf3 = 67 "UF3" [];
    /// User function 4.
    Uf4 = 68 "UF4" [];
    /// User function 5.
    Uf5 = 69 "UF5" [];
    /// User function 6.
    Uf6 = 70 "UF6" [];
    /// User function 7.
    Uf7 = 71 "UF7" [];
    /// Call subroutine if condition.
    Call = 80 "CALL" [CONDITION, ADDRESS];
}

impl Opcode {
    /// The command number.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Whether a program may go on at the address in the command's value.
    pub const fn may_jump(self) -> bool {
        matches!(self, Self::Ja | Self::Jc | Self::Csub | Self::Call | Self::Djnz | Self::Rst)
    }
}

impl Form {
    /// An operand that may be written behind the others and means nothing: the manual itself writes
    /// `GCO 0, 255, 0` (3.6.23).
    pub const fn surplus(&self) -> Option<Operand> {
        match self.opcode {
            Opcode::Gco => Some(VALUE),
            _ => None,
        }
    }

    /// Whether the last operand may be left out although there is one: that of `CALC NOT`, where
    /// `kind` is the type field that the first operand gives.
    pub const fn may_end_early(&self, kind: u8) -> bool {
        const NOT: u8 = 8;
        matches!(self.opcode, Opcode::Calc) && kind == NOT
    }
}

/// The form of the command with this number, if it has a mnemonic.
pub fn form(number: u8) -> Option<&'static Form> {
    FORMS
        .binary_search_by_key(&number, |form| form.opcode.number())
        .ok()
        .and_then(|at| FORMS.get(at))
}

/// The form of the command with this name, in any case.
pub fn form_by_mnemonic(mnemonic: &str) -> Option<&'static Form> {
    FORMS.iter().find(|form| form.mnemonic.eq_ignore_ascii_case(mnemonic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_sorted_by_number_and_each_is_found_by_number_and_by_name() {
        assert!(FORMS.windows(2).all(|pair| pair[0].opcode.number() < pair[1].opcode.number()));
        for entry in FORMS {
            assert_eq!(form(entry.opcode.number()), Some(entry));
            assert_eq!(form_by_mnemonic(entry.mnemonic), Some(entry));
            assert_eq!(Opcode::from_number(entry.opcode.number()), Some(entry.opcode));
        }
        assert_eq!(form(0), None);
        assert_eq!(form_by_mnemonic("RET"), None);
    }
}
