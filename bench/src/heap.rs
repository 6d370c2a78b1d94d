//! Memory that a module takes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use opentmcl_virtual::VirtualModule;

use crate::{Measured, program};

/// The system's allocator, counting the bytes in use.
pub(crate) struct Counted;

static IN_USE: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        IN_USE.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Bytes of one module with everything it owns, when all of its EEPROM is in use; a new one takes less,
/// since pages of the flash come into being when they are written.
pub(crate) fn module_memory() -> Measured {
    let before = IN_USE.load(Ordering::Relaxed);
    let in_use = || IN_USE.load(Ordering::Relaxed) - before;
    let mut module: Box<VirtualModule> = Box::new(program::six_axis_module());
    program::advance_seconds(&mut module, 60);
    let new = in_use();
    let mut most = new;
    program::fill_eeprom(&mut module, || most = most.max(in_use()));
    Measured { value: most as f64, note: format!("{new} while the EEPROM holds little") }
}
