//! A virtual module in virtual time, for transcripts.

use std::ops::ControlFlow;

use opentmcl_conform::{Line, Moment, Program, ProgramMoment, ScenarioFile, Target, TargetError};
use opentmcl_firmware as firmware;
use opentmcl_firmware::{Executed, Mode};
use opentmcl_virtual::{Action, ActionError, MemoryFlash, ModuleSetup, Options, VirtualModule};
use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Duration, Instant, Opcode};

/// How long nothing is looked at while a condition is awaited although motors turn.
const PAUSE: Duration = Duration::from_millis(1);

/// Who is told what programs do.
pub(crate) trait Observer {
    /// A new module takes the place of the present one.
    fn fresh(&mut self);
    /// A program is about to be loaded.
    fn loading(&mut self, program: &Program);
    /// A command has been executed.
    fn executed(&mut self, executed: &Executed);
}

/// A virtual module in virtual time.
pub(crate) struct VirtualTarget<'a> {
    setup: ModuleSetup,
    module: VirtualModule,
    observer: Option<&'a mut dyn Observer>,
    /// Whether the observer is told of what happens now.
    observing: bool,
    /// When it gives up.
    limit: Option<Duration>,
}

impl<'a> VirtualTarget<'a> {
    /// A new module as it leaves the factory, with what is around it.
    pub(crate) fn new(setup: ModuleSetup) -> Self {
        Self { module: new_module(&setup), setup, observer: None, observing: true, limit: None }
    }

    /// The same, with a limit of its time.
    pub(crate) fn limited(self, limit: Duration) -> Self {
        Self { limit: Some(limit), ..self }
    }

    /// The same, observed.
    pub(crate) fn observed(self, observer: &'a mut dyn Observer) -> Self {
        observer.fresh();
        Self { observer: Some(observer), ..self }
    }

    /// Lets time pass; nobody pays for an observer that is not there.
    fn advance_to(&mut self, until: Instant) -> Result<(), TargetError> {
        let end = self.limit.map(|limit| Instant::from_ticks(0) + limit);
        let reached = end.map_or(until, |end| until.min(end));
        match &mut self.observer {
            Some(observer) if self.observing => {
                let _ = self.module.advance_watched(reached, |executed| {
                    observer.executed(executed);
                    ControlFlow::Continue(())
                });
            }
            _ => self.module.advance_to(reached),
        }
        match self.limit {
            Some(limit) if reached < until => Err(TargetError::TimeIsUp(limit)),
            _ => Ok(()),
        }
    }

    /// Commands that are due now are told before something else happens at the same time.
    fn look(&mut self) -> Result<(), TargetError> {
        self.advance_to(self.module.now())
    }
}

fn new_module(setup: &ModuleSetup) -> VirtualModule {
    VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default())
}

fn broken(error: ActionError) -> TargetError {
    TargetError::Broken(error.to_string())
}

impl Target for VirtualTarget<'_> {
    fn send(&mut self, line: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError> {
        let line = match line {
            None | Some(Line::Usb) => firmware::Line::Usb,
            Some(Line::Rs485) => firmware::Line::Rs485,
            Some(Line::Rs232) => firmware::Line::Rs232,
        };
        self.look()?;
        let port = firmware::Port::new(line);
        if self.module.is_in_ascii_mode(port) {
            frame.into_iter().for_each(|byte| self.module.receive_key(port, byte));
        } else {
            self.module.receive(port, serial::decode_request(frame));
        }
        self.look()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
        let end = self.module.now() + timeout;
        loop {
            if let Some((_, content)) = self.module.transmit() {
                // Transcripts know frames only.
                let Some(frame) = content.frame() else { continue };
                return Ok(Some(frame));
            }
            match self.module.next_event() {
                Some(event) if event <= end => self.advance_to(event)?,
                _ if self.module.now() < end => self.advance_to(end)?,
                _ => return Ok(None),
            }
        }
    }

    fn wait(&mut self, time: Duration) -> Result<(), TargetError> {
        self.advance_to(self.module.now() + time)
    }

    fn pause(&mut self, at_most: Duration) -> Result<(), TargetError> {
        let now = self.module.now();
        let end = now + at_most;
        // The next command of a program; between them positions and times change steadily.
        let soon = self.module.next_event().filter(|event| *event > now);
        let next = soon.map_or(now + PAUSE, |event| event.min(now + PAUSE));
        self.advance_to(next.min(end))
    }

    fn moment(&mut self) -> Moment {
        let state = self.module.program_state();
        let running = matches!(state.mode, Mode::Run | Mode::Step);
        // STOP leaves the counter behind itself.
        let stop = state.address.checked_sub(1).filter(|&before| {
            let command = self.module.program_command(before);
            !running && command.is_some_and(|c| c.number == Opcode::Stop.number())
        });
        let address = stop.unwrap_or(state.address);
        let time = self.module.now() - Instant::from_ticks(0);
        Moment { time, program: Some(ProgramMoment { running, address }) }
    }

    fn loading(&mut self, program: &Program) {
        if let Some(observer) = &mut self.observer {
            observer.loading(program);
        }
    }

    fn case_over(&mut self) {
        self.observing = false;
    }

    fn power_cycle(&mut self) -> Result<(), TargetError> {
        self.look()?;
        self.module.power_cycle();
        Ok(())
    }

    fn set_input(&mut self, number: u8, high: bool) -> Result<(), TargetError> {
        self.look()?;
        self.module.set_digital_input(number, high);
        Ok(())
    }

    fn set_analog(&mut self, number: u8, reading: u16) -> Result<(), TargetError> {
        self.look()?;
        self.module.set_analog_input(number, reading);
        Ok(())
    }

    fn scenario(&mut self, scenario: &ScenarioFile) -> Result<(), TargetError> {
        self.setup = crate::scenario::first(scenario).map_err(TargetError::Broken)?;
        self.fresh()
    }

    fn world(&mut self, action: &str) -> Result<(), TargetError> {
        self.look()?;
        let action: Action = action.parse().map_err(broken)?;
        self.module.act(&action).map_err(broken)
    }

    fn stage(&mut self, axis: u8, unit: &str) -> Result<Option<f64>, TargetError> {
        self.look()?;
        let scale = self.module.scale(axis);
        let stage = self.module.stage(axis);
        Ok(match unit {
            "usteps" if !self.module.model().motion.is_servo() => stage,
            _ if unit == scale.unit().symbol() => stage.map(|stage| scale.to_stage(stage)),
            _ => None,
        })
    }

    fn fresh(&mut self) -> Result<(), TargetError> {
        self.module = new_module(&self.setup);
        self.observing = true;
        if let Some(observer) = &mut self.observer {
            observer.fresh();
        }
        Ok(())
    }
}
