//! `--record`: samples at a set rate.

use std::path::Path;

use opentmcl_virtual::{Recorder, VirtualModule};
use opentmcl_wire::Instant;

use super::run::Observer;
use crate::failure::Failure;
use crate::recording::{Columns, Recording};

/// Takes the samples of a recording.
pub(super) struct Record {
    recording: Recording,
    recorder: Recorder,
}

impl Record {
    /// Begins the recording of a module whose inputs stay as they are.
    pub(super) fn create(
        path: &Path,
        module: &VirtualModule,
        rate: u32,
        variables: &[u8],
    ) -> Result<Self, Failure> {
        let columns = Columns::new(module, rate, variables, false);
        let recorder = Recorder::new(module.now(), rate, variables.to_vec());
        Ok(Self { recording: Recording::create(path, columns)?, recorder })
    }

    /// Writes what is still to be written.
    pub(super) fn finish(self) -> Result<(), Failure> {
        self.recording.finish()
    }
}

impl Observer for Record {
    fn due(&self) -> Option<Instant> {
        Some(self.recorder.due())
    }

    fn look(&mut self, module: &mut VirtualModule) -> Result<(), Failure> {
        self.recording.add(self.recorder.take(module))
    }
}
