//! A run: a module with a program, moved through virtual time under the eyes of observers.

use std::ops::ControlFlow;

use opentmcl_firmware::{Executed, Mode};
use opentmcl_virtual::{Event, MemoryFlash, ModuleSetup, Options, Travel, VirtualModule, Watch};
use opentmcl_wire::limits::PROGRAM_LEN;
use opentmcl_wire::{Command, Duration, Instant, Status, control};

use crate::failure::Failure;

/// Who looks on while a program runs.
pub(super) trait Observer {
    /// Something has happened.
    fn event(&mut self, _event: &Event<'_>) -> Result<(), Failure> {
        Ok(())
    }

    /// When the observer next wants to look at the module.
    fn due(&self) -> Option<Instant> {
        None
    }

    /// It is due.
    fn look(&mut self, _module: &mut VirtualModule) -> Result<(), Failure> {
        Ok(())
    }
}

/// A module with a program that is about to start. Time counts from there.
pub(super) struct Run {
    pub(super) module: VirtualModule,
    watch: Watch,
    /// When the program starts.
    pub(super) start: Instant,
}

/// How a run ended.
pub(super) struct Outcome {
    /// The command with which the program ended; none if it was still running when the time was up.
    pub(super) last: Option<Executed>,
    /// When the run was over: see [`Run::play`].
    pub(super) end: Duration,
}

impl Run {
    /// Switches a module on, with what is around it, and downloads a program into it.
    pub(super) fn new(
        setup: &ModuleSetup,
        options: Options,
        commands: &[Command],
    ) -> Result<Self, Failure> {
        let mut module = VirtualModule::with_setup(setup, MemoryFlash::new(), options);
        execute(&mut module, Command::new(control::START_DOWNLOAD, 0, 0, 0))?;
        for (address, &command) in commands.iter().enumerate() {
            let status = module.execute(command).status;
            if status != Status::LOADED {
                return Err(Failure::new(format!(
                    "the module does not take the command at address {address}: status {status}"
                ))
                .help(format!("program memory holds {} commands", PROGRAM_LEN)));
            }
        }
        execute(&mut module, Command::new(control::END_DOWNLOAD, 0, 0, 0))?;
        let (watch, start) = (Watch::new(&mut module), module.now());
        Ok(Self { module, watch, start })
    }

    /// Starts the program and lets time pass until it has ended and each axis stands or turns with the
    /// speed that it will keep, at most for `longest`.
    pub(super) fn play(
        &mut self,
        longest: Duration,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Outcome, Failure> {
        self.watch = Watch::new(&mut self.module);
        execute(&mut self.module, Command::new(control::RUN_PROGRAM, 1, 0, 0))?;
        let until = self.start + longest;
        let last = self.advance(until, observers)?;
        while last.is_some()
            && self.axes().iter().any(|axis| axis.speed != 0)
            && self.module.is_on_its_way()
            && let Some(event) = self.module.next_motion_event()
            && self.module.now() < until
        {
            self.advance(event.min(until), observers)?;
        }
        Ok(Outcome { last, end: self.module.now() - self.start })
    }

    /// What each axis has done so far.
    pub(super) fn axes(&self) -> &[Travel] {
        self.watch.axes()
    }

    /// Lets time pass until then or until the program ends, with the command that ended it.
    fn advance(
        &mut self,
        until: Instant,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Option<Executed>, Failure> {
        loop {
            let due = observers.iter().filter_map(|observer| observer.due()).min();
            let next = due.map_or(until, |due| due.min(until));
            let mut told = Ok(());
            let mut last = None;
            // What broke off stands in these two.
            let _: ControlFlow<()> = self.watch.advance(&mut self.module, next, |event| {
                told = observers.iter_mut().try_for_each(|observer| observer.event(&event));
                if let Event::Executed(executed) = event
                    && executed.mode != Mode::Run
                {
                    last = Some(*executed);
                }
                if told.is_err() || last.is_some() {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            });
            told?;
            let now = self.module.now();
            for observer in &mut *observers {
                if observer.due().is_some_and(|due| due <= now) {
                    observer.look(&mut self.module)?;
                }
            }
            if last.is_some() || now >= until {
                return Ok(last);
            }
        }
    }
}

/// Executes a command as a host.
pub(super) fn execute(module: &mut VirtualModule, command: Command) -> Result<(), Failure> {
    let status = module.execute(command).status;
    if status.is_ok() {
        return Ok(());
    }
    Err(Failure::new(format!("{command}: the module answers with status {status}")))
}
