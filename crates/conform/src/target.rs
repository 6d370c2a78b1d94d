//! What transcripts run against.

use opentmcl_wire::Duration;
use opentmcl_wire::serial::FRAME_LEN;

use crate::programs::ScenarioFile;
use crate::transcript::{Line, Program};

/// A module that transcripts can be run against.
pub trait Target {
    /// Sends nine bytes by this line; `None` is whatever line there is, on a virtual module USB.
    ///
    /// # Errors
    /// When the connection is lost, or the target has no such line.
    fn send(&mut self, line: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError>;

    /// The next nine bytes from the module; `None` if none come within `timeout`.
    ///
    /// # Errors
    /// When the connection is lost.
    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError>;

    /// Lets time pass.
    ///
    /// # Errors
    /// When the connection is lost.
    fn wait(&mut self, time: Duration) -> Result<(), TargetError>;

    /// Lets time pass until something may have changed, and no more than this.
    ///
    /// # Errors
    /// When the connection is lost.
    fn pause(&mut self, at_most: Duration) -> Result<(), TargetError>;

    /// What time it is, and what the program does if that can be known without asking.
    fn moment(&mut self) -> Moment;

    /// A program is about to be loaded.
    fn loading(&mut self, _: &Program) {}

    /// The steps of a case are over; what follows only looks for replies that nobody expects.
    fn case_over(&mut self) {}

    /// Switches the module off and on.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn power_cycle(&mut self) -> Result<(), TargetError>;

    /// Sets the level of a digital input.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn set_input(&mut self, number: u8, high: bool) -> Result<(), TargetError>;

    /// Sets the reading of an analog input.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn set_analog(&mut self, number: u8, reading: u16) -> Result<(), TargetError>;

    /// Takes a new module with the machines of this scenario; each new one from now on has them.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn scenario(&mut self, scenario: &ScenarioFile) -> Result<(), TargetError>;

    /// Does something to the module from outside.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn world(&mut self, action: &str) -> Result<(), TargetError>;

    /// Where the stage of an axis stands, in this unit: `mm`, `deg` or `usteps`; none if it is not
    /// measured so.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be known.
    fn stage(&mut self, axis: u8, unit: &str) -> Result<Option<f64>, TargetError>;

    /// Takes a new module as it leaves the factory; where there is only one, restarts it, so that
    /// at least what it has in RAM is new.
    ///
    /// # Errors
    /// When it does not come back.
    fn fresh(&mut self) -> Result<(), TargetError>;
}

/// Why a target does not do what a step asks for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// It cannot, by its nature: the rest of the file is skipped.
    #[error("{0}")]
    Unable(String),
    /// Something broke: the file has failed.
    #[error("{0}")]
    Broken(String),
    /// It may run for so long and no longer: the case has failed.
    #[error("its time is up after {} s", .0.as_secs())]
    TimeIsUp(Duration),
}

/// When and where something happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// How long the target has been running: the module's own time, or that on the wall.
    pub time: Duration,
    /// What the program does.
    pub program: Option<ProgramMoment>,
}

/// What a program does at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramMoment {
    /// Whether it runs.
    pub running: bool,
    /// Where it stands: the command that comes next; of one that STOP has ended, that STOP.
    pub address: u16,
}
