//! Programs and scenarios in files of their own, which a transcript names and whoever runs it brings along.

use std::rc::Rc;

use opentmcl_catalog::Module;
use opentmcl_wire::Command;

/// Finds and assembles the programs that transcripts name.
pub trait Programs {
    /// Reads a program for this module; `file` is as the transcript has it.
    ///
    /// # Errors
    /// Why there is no such program, or what is wrong with it.
    fn load(
        &mut self,
        file: &str,
        transcript: &str,
        module: &'static Module,
    ) -> Result<Rc<Assembled>, String>;

    /// Reads a scenario whose first module is one of this kind; `file` is as the transcript has it.
    ///
    /// # Errors
    /// Why there is no such scenario, or what is wrong with it.
    fn scenario(
        &mut self,
        file: &str,
        _transcript: &str,
        _module: &'static Module,
    ) -> Result<ScenarioFile, String> {
        Err(format!("cannot read {file}: scenarios are not available here"))
    }

    /// Looks whether something can be done to the module of a scenario, or to one with nothing around it.
    ///
    /// # Errors
    /// Why it cannot.
    fn action(
        &mut self,
        _action: &str,
        _scenario: Option<&ScenarioFile>,
        _module: &'static Module,
    ) -> Result<(), String> {
        Ok(())
    }
}

/// A scenario as it stands in its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioFile {
    /// The path by which it was read.
    pub name: String,
    /// Its text.
    pub text: Rc<str>,
}

/// Has no files: transcripts stand for themselves.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoPrograms;

impl Programs for NoPrograms {
    fn load(&mut self, file: &str, _: &str, _: &Module) -> Result<Rc<Assembled>, String> {
        Err(format!("cannot read {file}: programs from files are not available here"))
    }
}

/// A program from a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Assembled {
    /// By which number whoever has read it knows it.
    pub number: usize,
    /// Its commands from address 0.
    pub commands: Vec<Command>,
    /// Its labels with their addresses.
    pub labels: Vec<(String, u16)>,
    /// Its constants, rounded; without those that do not fit into a value.
    pub constants: Vec<(String, i32)>,
}

impl Assembled {
    /// The address of a label, in any case.
    pub fn label(&self, name: &str) -> Option<u16> {
        find(&self.labels, name)
    }

    /// The value of a constant, in any case.
    pub fn constant(&self, name: &str) -> Option<i32> {
        find(&self.constants, name)
    }
}

fn find<T: Copy>(names: &[(String, T)], name: &str) -> Option<T> {
    names.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|&(_, meaning)| meaning)
}
