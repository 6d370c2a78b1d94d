//! One or more modules with their machines, and the line protocol by which a program outside looks at
//! them and acts upon them.
//!
//! A [`Lab`] has no port and no clock, as everything here: whoever serves it moves it through time and
//! carries its lines.

mod changes;
mod line;
mod servo;
mod state;

use embedded_storage::nor_flash::NorFlash;
use opentmcl_wire::Instant;

use crate::flash::MemoryFlash;
use crate::module::{Options, VirtualModule};
use crate::scenario::{ModuleSetup, Scenario};
use crate::world::{Action, ActionError, Effect};

pub use changes::{Snapshot, Subscription};
pub use line::{Response, SCHEMA};

/// What an action asks of whoever serves a lab.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabEffect {
    /// Which module, in the order of the scenario.
    pub module: usize,
    /// What.
    pub effect: Effect,
}

/// The modules of a scenario.
///
/// ```
/// use opentmcl_virtual::{Lab, Scenario};
/// use opentmcl_wire::Instant;
///
/// let text = r#"
/// [[module]]
/// model = "tmcm-6214"
/// [[module.at]]
/// time = "2 s"
/// do = "input 3 high"
/// "#;
/// let mut lab = Lab::new(Scenario::parse("lab.toml", text).unwrap());
/// assert_eq!(lab.next_event(), Some(Instant::from_ticks(2 * 16_000_000)));
/// lab.advance_to(Instant::from_ticks(3 * 16_000_000));
/// assert_eq!(lab.line("press left axis 0").json, r#"{"ok":true}"#);
/// ```
pub struct Lab<F = MemoryFlash> {
    scenario: Scenario,
    modules: Vec<VirtualModule<F>>,
}

impl Lab {
    /// New modules as they leave the factory, switched on at time 0.
    pub fn new(scenario: Scenario) -> Self {
        let modules = scenario
            .modules
            .iter()
            .map(|setup| VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default()));
        Self { modules: modules.collect(), scenario }
    }
}

impl<F: NorFlash> Lab<F> {
    /// Modules whose EEPROMs are these flashes, switched on at time 0.
    ///
    /// # Errors
    /// What finding the flash of a module fails with.
    pub fn with_flashes<E>(
        scenario: Scenario,
        options: Options,
        mut flash: impl FnMut(&ModuleSetup) -> Result<F, E>,
    ) -> Result<Self, E> {
        let modules = scenario
            .modules
            .iter()
            .map(|setup| Ok(VirtualModule::with_setup(setup, flash(setup)?, options)))
            .collect::<Result<Vec<_>, E>>()?;
        Ok(Self { scenario, modules })
    }

    /// What is loaded.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The modules in the order of the scenario.
    pub fn modules(&self) -> &[VirtualModule<F>] {
        &self.modules
    }

    /// One of the modules.
    pub fn module_mut(&mut self, module: usize) -> Option<&mut VirtualModule<F>> {
        self.modules.get_mut(module)
    }

    /// The place of the module with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.scenario.modules.iter().position(|setup| setup.name == name)
    }

    /// The lab's time, which is that of all its modules.
    pub fn now(&self) -> Instant {
        self.modules.iter().map(VirtualModule::now).max().unwrap_or(Instant::from_ticks(0))
    }

    /// When something will happen next by itself; `None` while all is at rest.
    pub fn next_event(&mut self) -> Option<Instant> {
        self.modules.iter_mut().filter_map(VirtualModule::next_event).min()
    }

    /// Lets time pass until `now`; everything due until then happens in its order.
    pub fn advance_to(&mut self, now: Instant) {
        for module in &mut self.modules {
            module.advance_to(now);
        }
    }

    /// Does something to a module, now.
    ///
    /// # Errors
    /// When it cannot be done; see [`VirtualModule::act`].
    pub fn act(&mut self, module: usize, action: &Action) -> Result<(), ActionError> {
        match self.modules.get_mut(module) {
            Some(module) => module.act(action),
            None => Err(ActionError::no_module(module)),
        }
    }

    /// What actions, scheduled ones included, have asked for since the last call.
    pub fn take_effects(&mut self) -> Vec<LabEffect> {
        let all = self.modules.iter_mut().enumerate().flat_map(|(module, own)| {
            own.take_effects().into_iter().map(move |effect| LabEffect { module, effect })
        });
        all.collect()
    }
}
