//! Programs and scenarios that transcripts name, from files beside them.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use opentmcl_catalog::Module;
use opentmcl_conform::{Assembled, Programs, ScenarioFile};
use opentmcl_virtual::{Action, ActionError, ModuleSetup};

use crate::program::{self, Program, Refusals, SourceArgs};
use crate::{scenario, sources};

/// Reads each program once, however many transcripts name it.
pub(crate) struct ProgramFiles<'a> {
    args: &'a SourceArgs,
    files: Vec<File>,
}

struct File {
    path: PathBuf,
    module: &'static str,
    /// Why there is none.
    program: Result<(Rc<Assembled>, Program), String>,
}

impl<'a> ProgramFiles<'a> {
    /// Nothing is read yet.
    pub(crate) fn new(args: &'a SourceArgs) -> Self {
        Self { args, files: Vec::new() }
    }

    /// The program that [`Assembled::number`] stands for.
    pub(crate) fn program(&self, number: usize) -> Option<&Program> {
        self.files.get(number)?.program.as_ref().ok().map(|(_, program)| program)
    }

    /// All programs that could be read, with their numbers.
    pub(crate) fn programs(&self) -> impl Iterator<Item = (usize, &Program)> {
        let read = self.files.iter().map(|file| file.program.as_ref().ok());
        read.enumerate().filter_map(|(number, program)| Some((number, &program?.1)))
    }
}

impl Programs for ProgramFiles<'_> {
    fn load(
        &mut self,
        file: &str,
        transcript: &str,
        module: &'static Module,
    ) -> Result<Rc<Assembled>, String> {
        let path = beside(transcript, file);
        let known =
            self.files.iter().position(|known| known.path == path && known.module == module.name);
        let number = known.unwrap_or_else(|| {
            let number = self.files.len();
            let program = program::load(&path, self.args, Some(module), Refusals::Tell)
                .map(|program| (Rc::new(assembled(number, &program)), program))
                .map_err(|failure| failure.message().to_owned());
            self.files.push(File { path, module: module.name, program });
            number
        });
        match &self.files[number].program {
            Ok((assembled, _)) => Ok(Rc::clone(assembled)),
            Err(message) => Err(message.clone()),
        }
    }

    fn scenario(
        &mut self,
        file: &str,
        transcript: &str,
        module: &'static Module,
    ) -> Result<ScenarioFile, String> {
        let path = beside(transcript, file);
        let bytes = sources::read(&path).map_err(|failure| failure.message().to_owned())?;
        let name = path.display().to_string();
        let text = String::from_utf8(bytes).map_err(|_| format!("{name} is no UTF-8"))?;
        let scenario = ScenarioFile { name, text: text.into() };
        let model = scenario::first(&scenario)?.model;
        if model.name != module.name {
            let name = scenario.name;
            return Err(format!("the first module of {name} is a {}", model.title));
        }
        Ok(scenario)
    }

    fn action(
        &mut self,
        action: &str,
        scenario: Option<&ScenarioFile>,
        module: &'static Module,
    ) -> Result<(), String> {
        let setup = match scenario {
            Some(scenario) => scenario::first(scenario)?,
            None => ModuleSetup::new(module),
        };
        let action: Action = action.parse().map_err(|error: ActionError| error.to_string())?;
        setup.check(&action).map_err(|error| error.to_string())
    }
}

/// A file beside a transcript.
fn beside(transcript: &str, file: &str) -> PathBuf {
    Path::new(transcript).parent().unwrap_or(Path::new("")).join(file)
}

fn assembled(number: usize, program: &Program) -> Assembled {
    let assembly = program.assembly.as_ref();
    let constants = assembly.into_iter().flat_map(|assembly| assembly.constants());
    Assembled {
        number,
        commands: program.commands.clone(),
        labels: program.labels().map(|(name, address)| (name.to_owned(), address)).collect(),
        constants: constants
            .filter_map(|constant| Some((constant.name.to_owned(), whole(constant.value?)?)))
            .collect(),
    }
}

/// The whole number that stands in a command for a constant; none if it does not fit.
fn whole(value: f64) -> Option<i32> {
    let rounded = value.round();
    let range = f64::from(i32::MIN)..=f64::from(u32::MAX);
    // Above the largest signed number it is the bit pattern that counts, as in a program.
    range.contains(&rounded).then_some((rounded as i64) as i32)
}
