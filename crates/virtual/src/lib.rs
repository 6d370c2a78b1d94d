//! A virtual module: the firmware, the hardware that is not there, and a clock.
//!
//! [`VirtualModule`] is what a program holds: requests in, replies out, time by explicit steps. Its
//! clock is a number that only [`VirtualModule::advance`] and [`VirtualModule::advance_to`] move, so an
//! hour of motion takes no longer than its events, and two runs with the same inputs are the same.
//!
//! - [`board`]: chips of `opentmcl-plant`, pins and a flash as the firmware's `Board`.
//! - [`flash`]: a NOR flash in memory whose power can be cut at any operation.
//! - [`scenario`]: machines behind the axes and what happens by itself, from a TOML text; [`world`]: what
//!   somebody does to a module from outside; [`lab`]: one or more modules, and a line protocol.
//! - [`watch`]: a program's commands, outputs and motions while time passes; [`recording`]: samples at
//!   a set rate.
//!
//! ```
//! use opentmcl_virtual::VirtualModule;
//! use opentmcl_wire::{Duration, mnemonic};
//!
//! let model = opentmcl_catalog::find("tmcm-6214").unwrap();
//! let mut module = VirtualModule::new(model);
//! module.execute(mnemonic::parse("MVP ABS, 0, 512000").unwrap());
//! module.advance(Duration::from_secs(12));
//! let position = module.execute(mnemonic::parse("GAP 1, 0").unwrap()).value;
//! assert_eq!(position, 512000);
//! ```
#![forbid(unsafe_code)]

mod axes;
pub mod board;
pub mod flash;
pub mod lab;
mod module;
mod quantity;
mod reality;
pub mod recording;
pub mod scenario;
mod servo;
mod suggest;
pub mod watch;
pub mod world;

pub use board::VirtualBoard;
pub use flash::MemoryFlash;
pub use lab::{Lab, LabEffect, Response, Snapshot, Subscription};
pub use module::{Options, VirtualModule};
pub use opentmcl_firmware::{
    Answer, ErrorFlags, Executed, Flags, Line, Mode, Port, ProgramState, ServoState,
};
pub use opentmcl_plant::axis::{Coil, CoilFault, Rotor, SwitchInput, View};
pub use opentmcl_plant::servo::{LineFault, View as ServoView};
pub use recording::{MachineSample, Recorder, Sample, ServoSample};
pub use scenario::{
    MachineSetup, Mistakes, ModuleSetup, PortKind, PortSetup, Scale, Scenario, ServoSetup,
    StageUnit,
};
pub use watch::{Event, Travel, Watch};
pub use world::{Action, ActionError, AnalogLevel, Effect, Place, Push};
