//! Lines about the machine behind the module.

use super::{Begun, Parser};
use crate::transcript::{Stage, StepKind};

const STAGE_FORM: &str = "expect stage 0 = 12.4..12.6 mm (mm, deg or usteps)";

impl Parser<'_> {
    /// `scenario FILE`.
    pub(super) fn scenario(&mut self, file: &str) -> Result<Begun, String> {
        let module = self.module.ok_or("it is not known for which module the scenario is")?;
        if !self.setup_steps.is_empty() || !self.cases.is_empty() {
            return Err("the scenario comes before everything else; write it behind the line \
                        module"
                .into());
        }
        if file.is_empty() {
            return Err("a scenario has a file: scenario lab.toml".into());
        }
        let bare = file.strip_prefix('"').and_then(|file| file.strip_suffix('"'));
        let scenario = self.programs.scenario(bare.unwrap_or(file), self.name, module)?;
        self.scenario = Some(scenario.clone());
        Ok(Begun::Step(StepKind::Scenario(scenario)))
    }

    /// `world ACTION`.
    pub(super) fn world(&mut self, action: &str) -> Result<Begun, String> {
        let module = self.module.ok_or("it is not known for which module the action is")?;
        self.programs.action(action, self.scenario.as_ref(), module)?;
        Ok(Begun::Step(StepKind::World(action.to_owned())))
    }
}

/// What comes behind `expect` about the stage itself; none if it is a condition.
pub(super) fn stage(text: &str) -> Option<Result<Stage, String>> {
    let rest = text.strip_prefix("stage")?;
    let stage = rest.starts_with(char::is_whitespace).then(|| read(text, rest)).flatten();
    Some(stage.ok_or_else(|| format!("{text:?} says nothing of a stage; write {STAGE_FORM}")))
}

fn read(text: &str, rest: &str) -> Option<Stage> {
    let (axis, value) = rest.split_once('=')?;
    let (range, unit) = value.trim().split_once(char::is_whitespace)?;
    let unit = ["mm", "deg", "usteps"].into_iter().find(|known| *known == unit.trim())?;
    let (low, high) = range.split_once("..").unwrap_or((range, range));
    let (low, high) = (number(low)?, number(high)?);
    let axis = axis.trim().parse().ok()?;
    (low <= high).then(|| Stage { text: text.to_owned(), axis, range: low..=high, unit })
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::parse;
    use crate::programs::{Assembled, Programs, ScenarioFile};
    use opentmcl_catalog::Module;
    use std::rc::Rc;

    /// Has one scenario, in which one thing can be done.
    struct OneScenario;

    impl Programs for OneScenario {
        fn load(&mut self, _: &str, _: &str, _: &Module) -> Result<Rc<Assembled>, String> {
            Err("no programs".into())
        }

        fn scenario(&mut self, file: &str, _: &str, _: &Module) -> Result<ScenarioFile, String> {
            match file {
                "lab.toml" => Ok(ScenarioFile { name: file.into(), text: "here".into() }),
                _ => Err(format!("there is no {file}")),
            }
        }

        fn action(
            &mut self,
            action: &str,
            scenario: Option<&ScenarioFile>,
            _: &Module,
        ) -> Result<(), String> {
            match (action, scenario) {
                ("block axis 1", Some(_)) => Ok(()),
                _ => Err("this cannot be done".into()),
            }
        }
    }

    fn parsed(lines: &str) -> Result<Vec<StepKind>, Vec<String>> {
        parse("test.txt", &format!("module tmcm-6214\n{lines}"), &mut OneScenario)
            .map(|transcript| transcript.steps().map(|step| step.kind.clone()).collect())
            .map_err(|mistakes| mistakes.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn a_scenario_an_action_and_a_stage_are_read() {
        let lines = "scenario lab.toml\ntest \"a\"\nworld block axis 1\n\
                     expect stage 0 = -0.5..12.6 mm\nexpect stage 3 = 90 deg";
        let steps = parsed(lines).unwrap();
        let lab = ScenarioFile { name: "lab.toml".into(), text: "here".into() };
        let stage = |text: &str, axis, range, unit| {
            StepKind::Stage(Stage { text: text.into(), axis, range, unit })
        };
        let expected = [
            StepKind::Scenario(lab),
            StepKind::World("block axis 1".into()),
            stage("stage 0 = -0.5..12.6 mm", 0, -0.5..=12.6, "mm"),
            stage("stage 3 = 90 deg", 3, 90.0..=90.0, "deg"),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn mistakes_are_told_with_their_lines() {
        let lines = "scenario no.toml\nworld block axis 1\nwait 1 s\nscenario lab.toml\n\
                     expect stage 0 = 5\nexpect stage 0 = 5..4 mm\nexpect stages 0 = 5 mm";
        let mistakes = parsed(lines).unwrap_err();
        let begin = [
            "test.txt:2: there is no no.toml",
            "test.txt:3: this cannot be done",
            "test.txt:5: the scenario comes before everything else",
            "test.txt:6: \"stage 0 = 5\" says nothing of a stage; write expect stage 0 = 12.4",
            "test.txt:7: \"stage 0 = 5..4 mm\" says nothing",
            "test.txt:8: \"stages 0 = 5 mm\" says nothing",
        ];
        assert_eq!(mistakes.len(), begin.len(), "{mistakes:#?}");
        for (found, begin) in mistakes.iter().zip(begin) {
            assert!(found.starts_with(begin), "{found} should begin with {begin}");
        }
    }
}
