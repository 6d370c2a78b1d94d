//! A program's commands, the outputs that switch and how far axes go, while time passes.

use std::ops::ControlFlow;

use embedded_storage::nor_flash::NorFlash;
use opentmcl_firmware::Executed;
use opentmcl_wire::{Command, Instant, Opcode};

use crate::module::VirtualModule;

/// What has happened on a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// The program has executed a command.
    Executed(&'a Executed),
    /// General purpose outputs have switched.
    Outputs {
        /// When.
        at: Instant,
        /// Levels before, bit n for output n.
        before: u8,
        /// Levels after.
        after: u8,
    },
}

/// Where an axis has been, and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Travel {
    /// Position in microsteps when the watch began.
    pub from: i32,
    /// Position now.
    pub to: i32,
    /// Smallest position.
    pub lowest: i32,
    /// Largest position.
    pub highest: i32,
    /// Speed now in microsteps per second, positive to the right.
    pub speed: i32,
    /// Largest speed in either direction.
    pub top_speed: u32,
}

impl Travel {
    /// Whether the axis has turned at all; a position that was only set is no motion.
    pub fn has_moved(&self) -> bool {
        self.top_speed != 0
    }
}

/// Watches a module while time passes.
///
/// Positions and speeds are looked at when the program has changed something and when a motion reaches
/// a constant speed or stops, so that their extremes are exact however rarely anything happens, and an
/// hour of motion costs no more than its events.
///
/// ```
/// use std::ops::ControlFlow;
/// use opentmcl_virtual::{Event, VirtualModule, Watch};
/// use opentmcl_wire::{Instant, mnemonic};
///
/// let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
/// for text in ["132 0, 0, 0", "SIO 3, 2, 1", "MVP ABS, 0, 512000", "STOP", "133 0, 0, 0"] {
///     module.execute(mnemonic::parse(text).unwrap());
/// }
/// let mut watch = Watch::new(&mut module);
/// module.execute(mnemonic::parse("129 1, 0, 0").unwrap());
/// let mut switched = Vec::new();
/// let minute = Instant::from_ticks(60 * 16_000_000);
/// let _ = watch.advance(&mut module, minute, |event| {
///     if let Event::Outputs { after, .. } = event {
///         switched.push(after);
///     }
///     ControlFlow::Continue(())
/// });
/// assert_eq!(switched, [0b1000]);
/// let travel = watch.axes()[0];
/// assert_eq!((travel.from, travel.to, travel.top_speed), (0, 512_000, 51_200));
/// ```
#[derive(Clone, Debug)]
pub struct Watch {
    outputs: u8,
    axes: Vec<Travel>,
}

impl Watch {
    /// Begins to watch at the module's present time.
    pub fn new<F: NorFlash>(module: &mut VirtualModule<F>) -> Self {
        let axes = (0..module.model().axes)
            .map(|axis| {
                let (position, speed) = state(module, axis);
                Travel {
                    from: position,
                    to: position,
                    lowest: position,
                    highest: position,
                    speed,
                    top_speed: speed.unsigned_abs(),
                }
            })
            .collect();
        Self { outputs: module.digital_outputs(), axes }
    }

    /// Lets time pass until `until` and hands over what happens, in its order.
    ///
    /// Whoever breaks off finds the module at the time of that event.
    pub fn advance<F: NorFlash>(
        &mut self,
        module: &mut VirtualModule<F>,
        until: Instant,
        mut on: impl FnMut(Event<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        loop {
            let next = module.next_motion_event().map_or(until, |event| event.min(until));
            let mut wish = ControlFlow::Continue(());
            let flow = module.advance_watched(next, |executed| {
                wish = on(Event::Executed(executed));
                if wish.is_break() || may_touch_hardware(executed.command) {
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            });
            self.look(module, &mut on)?;
            wish?;
            if flow.is_continue() && module.now() >= until {
                return ControlFlow::Continue(());
            }
        }
    }

    /// Each axis since the watch began.
    pub fn axes(&self) -> &[Travel] {
        &self.axes
    }

    fn look<F: NorFlash>(
        &mut self,
        module: &mut VirtualModule<F>,
        on: &mut impl FnMut(Event<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for (axis, travel) in (0..).zip(&mut self.axes) {
            let (position, speed) = state(module, axis);
            travel.to = position;
            travel.lowest = travel.lowest.min(position);
            travel.highest = travel.highest.max(position);
            travel.speed = speed;
            travel.top_speed = travel.top_speed.max(speed.unsigned_abs());
        }
        let before = std::mem::replace(&mut self.outputs, module.digital_outputs());
        if before == self.outputs {
            return ControlFlow::Continue(());
        }
        on(Event::Outputs { at: module.now(), before, after: self.outputs })
    }
}

/// Position and speed of an axis that exists.
fn state<F: NorFlash>(module: &mut VirtualModule<F>, axis: u8) -> (i32, i32) {
    (module.position(axis).unwrap_or_default(), module.speed(axis).unwrap_or_default())
}

/// Whether a command may move an axis or switch an output: all but those that calculate, jump, wait
/// or read.
fn may_touch_hardware(command: Command) -> bool {
    !matches!(
        Opcode::from_number(command.number),
        Some(
            Opcode::Gap
                | Opcode::Gapx
                | Opcode::Ggp
                | Opcode::Gio
                | Opcode::Gco
                | Opcode::Calc
                | Opcode::Comp
                | Opcode::Calcx
                | Opcode::Calcvv
                | Opcode::Calcva
                | Opcode::Calcav
                | Opcode::Calcvx
                | Opcode::Calcxv
                | Opcode::Calcv
                | Opcode::Siv
                | Opcode::Giv
                | Opcode::Aiv
                | Opcode::Jc
                | Opcode::Ja
                | Opcode::Csub
                | Opcode::Rsub
                | Opcode::Djnz
                | Opcode::Call
                | Opcode::Reti
                | Opcode::Wait
        )
    )
}
