//! What is wrong or doubtful in a program, as values.

use crate::span::Span;

/// One file of an [`Assembly`](crate::Assembly): its place in `files`; 0 is the main file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u16);

/// A part of one of the files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Location {
    /// The file.
    pub file: FileId,
    /// The part of its text.
    pub span: Span,
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; the program may well be as it should be.
    Hint,
    /// Most probably not what was meant.
    Warning,
    /// Cannot be assembled, or the module will refuse it.
    Error,
}

impl Severity {
    /// The word for it, lower case.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hint => "hint",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A replacement that mends the matter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// What is replaced, in the file of the diagnostic.
    pub span: Span,
    /// What comes in its place.
    pub replacement: String,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which kind of finding it is.
    pub code: Code,
    /// Where.
    pub location: Location,
    /// What is wrong, one sentence without a full stop.
    pub message: String,
    /// What would be right, where it can be known.
    pub help: Option<String>,
    /// A further place that explains it, and what is there.
    pub related: Option<(Location, String)>,
    /// A replacement that mends it.
    pub fix: Option<Fix>,
}

impl Diagnostic {
    /// A finding with nothing but its message.
    pub fn new(code: Code, location: Location, message: impl Into<String>) -> Self {
        let message = message.into();
        Self { code, location, message, help: None, related: None, fix: None }
    }

    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// The same, with what would be right.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// The same, with a further place.
    #[must_use]
    pub fn related(self, location: Location, message: impl Into<String>) -> Self {
        Self { related: Some((location, message.into())), ..self }
    }

    /// The same, with a replacement of the part that it is about.
    #[must_use]
    pub fn replace_with(self, replacement: impl Into<String>) -> Self {
        let fix = Fix { span: self.location.span, replacement: replacement.into() };
        Self { fix: Some(fix), ..self }
    }
}

/// What the table of codes says beside names: severities, and errors told apart.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The program cannot be assembled.
    Error,
    /// The program can be assembled, and does not work.
    Fault,
    Warning,
    Hint,
}

macro_rules! codes {
    ($($(#[doc = $doc:literal])+ $code:ident = $name:literal $kind:ident;)*) => {
        /// The kinds of findings. The documentation of each is what the book says of it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code {
            $($(#[doc = $doc])+ $code,)*
        }

        impl Code {
            /// All codes.
            pub const ALL: &[Self] = &[$(Self::$code),*];

            /// The name by which it is shown and silenced: `unknown-label`.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }

            const fn kind(self) -> Kind {
                match self { $(Self::$code => Kind::$kind,)* }
            }

            /// What it means and what to do, in a few sentences.
            pub const fn explanation(self) -> &'static str {
                match self { $(Self::$code => concat!($($doc),+).trim_ascii(),)* }
            }
        }
    };
}

codes! {
    /// The text fits no rule of the language: a stray character, or more than a line can hold.
    UnexpectedText = "unexpected-text" Error;
    /// No command has this mnemonic.
    UnknownCommand = "unknown-command" Error;
    /// The first operand follows the mnemonic behind a blank, not behind a comma.
    CommaAfterMnemonic = "comma-after-mnemonic" Error;
    /// Operands stand apart from each other by commas.
    MissingComma = "missing-comma" Error;
    /// The command needs more operands than are written, or there is nothing between two commas.
    MissingOperand = "missing-operand" Error;
    /// The command has fewer operands than are written.
    ExtraOperand = "extra-operand" Error;
    /// The operand must be one of the command's words or their number.
    UnknownKeyword = "unknown-keyword" Error;
    /// No constant has this name.
    UnknownConstant = "unknown-constant" Error;
    /// No label has this name.
    UnknownLabel = "unknown-label" Error;
    /// No function has this name.
    UnknownFunction = "unknown-function" Error;
    /// Two places have the same label.
    DuplicateLabel = "duplicate-label" Error;
    /// A constant has two definitions with different values.
    RedefinedConstant = "redefined-constant" Error;
    /// A constant depends on itself.
    CircularConstant = "circular-constant" Error;
    /// It begins as a number does and is none.
    BadNumber = "bad-number" Error;
    /// The value does not fit into the field of the command: 0..255 for type and motor, 32 bits for
    /// the value.
    ValueTooLarge = "value-too-large" Error;
    /// The expression has no value: a division by zero, a logarithm of a negative number.
    UndefinedValue = "undefined-value" Error;
    /// A parenthesis is not closed.
    UnclosedParenthesis = "unclosed-parenthesis" Error;
    /// The expression is nested more deeply than anybody can read.
    NestedTooDeeply = "nested-too-deeply" Error;
    /// The only directive is `#include`.
    UnknownDirective = "unknown-directive" Error;
    /// There is no such file beside the including one, in the include folders and among the built-in
    /// ones.
    IncludeNotFound = "include-not-found" Error;
    /// A file includes itself, directly or by way of others.
    CircularInclude = "circular-include" Error;
    /// The files of one program are too many or too large to be a program.
    TooMuchText = "too-much-text" Error;
    /// Only the first thousand findings of a program are told.
    TooManyFindings = "too-many-findings" Error;
    /// A comment for the tools names a module or a code that does not exist, or a code that cannot be
    /// silenced.
    UnknownNameInComment = "unknown-name-in-comment" Warning;
    /// A label stands where a number is expected. The address is taken, which is seldom meant.
    LabelAsNumber = "label-as-number" Warning;
    /// The module does not have this command, and refuses it.
    NoSuchCommand = "no-such-command" Fault;
    /// The module refuses this command in a program: it is for hosts only, or for customer specific
    /// firmware.
    CommandNotAvailable = "command-not-available" Fault;
    /// The command does not do this with its operands: SWAP and COMP are not defined for each of the
    /// CALC commands, and a number in place of a word must be that of one of the words.
    NoSuchOperation = "no-such-operation" Fault;
    /// The module has fewer axes, or the operand of MVP COORD chooses none.
    NoSuchAxis = "no-such-axis" Fault;
    /// The module, or this axis of it, has no axis parameter with this number.
    NoSuchAxisParameter = "no-such-axis-parameter" Fault;
    /// The module has no bank with this number.
    NoSuchBank = "no-such-bank" Fault;
    /// The bank has no global parameter with this number.
    NoSuchGlobalParameter = "no-such-global-parameter" Fault;
    /// The bank has no input (GIO) or no output (SIO) with this number.
    NoSuchPort = "no-such-port" Fault;
    /// The module has no interrupt with this number, or it is 255, which has no handler.
    NoSuchInterrupt = "no-such-interrupt" Fault;
    /// An axis has the coordinates 0..20.
    NoSuchCoordinate = "no-such-coordinate" Fault;
    /// There are the user variables 0..255.
    NoSuchVariable = "no-such-variable" Fault;
    /// The parameter can only be read.
    NotWritable = "not-writable" Fault;
    /// The parameter cannot be stored in the EEPROM.
    NotStorable = "not-storable" Fault;
    /// The module refuses this value for this parameter, output or speed.
    ValueOutOfRange = "value-out-of-range" Fault;
    /// A negative time counts as 0; only -1 has a meaning of its own, the time in the accumulator.
    NegativeTime = "negative-time" Warning;
    /// The command goes to an address where the program has no command.
    JumpOutsideProgram = "jump-outside-program" Fault;
    /// The program has more commands than program memory holds.
    ProgramTooLong = "program-too-long" Fault;
    /// Behind the last command the program goes on into whatever program memory holds there.
    RunsOffTheEnd = "runs-off-the-end" Warning;
    /// Nothing leads to these commands, and without a label nobody can start them either.
    UnreachableCode = "unreachable-code" Warning;
    /// The program never uses this label, and only by it are the commands behind it reached. That is as
    /// it should be if a host starts them by their address.
    UnreferencedCode = "unreferenced-code" Hint;
    /// More subroutines call each other than the stack has levels: the module ignores the last call.
    CallsTooDeep = "calls-too-deep" Warning;
    /// A subroutine is called again before it has returned. Each turn takes a level of the stack.
    RecursiveCall = "recursive-call" Warning;
    /// The program can come here without a call. The module then ignores RSUB and goes on behind it.
    ReturnWithoutCall = "return-without-call" Warning;
    /// An interrupt handler ends by RETI. RSUB takes the return address of the program that was
    /// interrupted, while the handler never ends.
    RsubInHandler = "rsub-in-handler" Warning;
    /// No way leads from the handler to RETI, STOP or RST: no other interrupt is served any more.
    HandlerWithoutReti = "handler-without-reti" Warning;
    /// The program can come here without an interrupt. The module then ignores RETI and goes on behind
    /// it.
    RetiOutsideHandler = "reti-outside-handler" Warning;
    /// A subroutine that a handler calls ends by RSUB. RETI leaves the return address on the stack, where
    /// the next RSUB finds it.
    RetiInSubroutine = "reti-in-subroutine" Warning;
    /// The program runs into an interrupt handler that stands behind it.
    FallsIntoHandler = "falls-into-handler" Warning;
    /// The interrupt is enabled and has no handler: nothing happens when it occurs.
    InterruptWithoutVector = "interrupt-without-vector" Warning;
    /// The interrupt has a handler and is never enabled, by itself or by EI 255.
    InterruptNotEnabled = "interrupt-not-enabled" Hint;
    /// WAIT REFSW and WAIT LIMSW with a time-out of 0 wait for ever for a switch that does not close.
    WaitWithoutTimeOut = "wait-without-time-out" Hint;
}

impl Code {
    /// How bad it is.
    pub const fn severity(self) -> Severity {
        match self.kind() {
            Kind::Error | Kind::Fault => Severity::Error,
            Kind::Warning => Severity::Warning,
            Kind::Hint => Severity::Hint,
        }
    }

    /// Whether a comment can silence it. What keeps the assembler from making a program cannot be
    /// silenced; what a module would refuse can, since there may be another firmware.
    pub const fn can_be_silenced(self) -> bool {
        !matches!(self.kind(), Kind::Error)
    }

    /// The code with this name, in any case.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| code.name().eq_ignore_ascii_case(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_codes_are_different_and_can_be_written_in_a_comment() {
        for (at, code) in Code::ALL.iter().enumerate() {
            let name = code.name();
            assert!(name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-'), "{name}");
            assert!(Code::ALL[..at].iter().all(|other| other.name() != name), "{name} twice");
            assert!(code.explanation().ends_with('.'), "{name}");
        }
    }
}
