//! One port of a module: a kind of line, and what it does to frames.

use super::Endpoint;
use crate::faults::{Counts, Faults, Injector};

/// A port that is served, as seen by who controls the server.
#[derive(Clone, Debug)]
pub struct ServedPort {
    module: usize,
    name: String,
    endpoint: Endpoint,
    faults: Faults,
    pub(super) requests: Injector,
    pub(super) replies: Injector,
}

impl ServedPort {
    pub(super) fn new(module: usize, name: String, endpoint: Endpoint, faults: Faults) -> Self {
        let (requests, replies) = (faults.request_injector(), faults.reply_injector());
        Self { module, name, endpoint, faults, requests, replies }
    }

    /// Which module it belongs to.
    pub const fn module(&self) -> usize {
        self.module
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What kind of line it is.
    pub const fn endpoint(&self) -> Endpoint {
        self.endpoint
    }

    /// What it does to frames.
    pub const fn faults(&self) -> &Faults {
        &self.faults
    }

    /// From now on it does this. Frames are counted anew, and the sequence of faults begins anew.
    pub fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
        (self.requests, self.replies) = (faults.request_injector(), faults.reply_injector());
    }

    /// What happened to requests since the faults were set, over all connections.
    pub fn request_counts(&self) -> &Counts {
        self.requests.counts()
    }

    /// What happened to replies since the faults were set, over all connections.
    pub fn reply_counts(&self) -> &Counts {
        self.replies.counts()
    }
}
