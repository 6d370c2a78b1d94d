//! What the editor's user can set.

use std::path::{Path, PathBuf};

use opentmcl_catalog::{MODULES, Module};
use serde::Deserialize;
use serde_json::Value;

/// How programs are looked at.
#[derive(Clone, Debug, Default)]
pub(super) struct Settings {
    /// The module of programs that do not name theirs.
    pub(super) module: Option<&'static Module>,
    /// Folders in which included files are looked for.
    pub(super) include: Vec<PathBuf>,
}

/// As the editor sends them; what is missing stays as the command line says.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Sent {
    module: Option<String>,
    include_paths: Option<Vec<PathBuf>>,
}

impl Settings {
    /// The settings in `sent`, and otherwise these; relative folders begin at `root`.
    ///
    /// What cannot be used is left out, and the second value says why.
    pub(super) fn with(&self, sent: &Value, root: Option<&Path>) -> (Self, Option<String>) {
        // Some editors wrap them in their section, some do not.
        let sent = sent.get("opentmcl").unwrap_or(sent);
        let sent = match Option::<Sent>::deserialize(sent) {
            Ok(sent) => sent.unwrap_or_default(),
            Err(error) => return (self.clone(), Some(format!("settings of TMCL: {error}"))),
        };
        let mut settings = self.clone();
        let mut problem = None;
        if let Some(name) = sent.module.filter(|name| !name.trim().is_empty()) {
            match opentmcl_catalog::find(name.trim()) {
                Some(module) => settings.module = Some(module),
                None => problem = Some(unknown_module(&name)),
            }
        }
        if let Some(folders) = sent.include_paths {
            let absolute = |folder: PathBuf| match root {
                Some(root) => root.join(folder),
                None => folder,
            };
            settings.include = folders.into_iter().map(absolute).collect();
        }
        (settings, problem)
    }
}

fn unknown_module(name: &str) -> String {
    let known: Vec<_> = MODULES.iter().map(|module| module.name).collect();
    format!("there is no module {name:?}; the setting opentmcl.module can be {}", known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(sent: Value) -> (Option<&'static str>, Vec<PathBuf>, Option<String>) {
        let before = Settings { module: None, include: vec!["/before".into()] };
        let (settings, problem) = before.with(&sent, Some(Path::new("/root")));
        (settings.module.map(|module| module.name), settings.include, problem)
    }

    #[test]
    fn both_are_read_with_and_without_their_section() {
        let sent = json!({ "module": "TMCM-6214", "includePaths": ["lib", "/abs"] });
        let include = vec![PathBuf::from("/root/lib"), PathBuf::from("/abs")];
        let expected = (Some("tmcm-6214"), include, None);
        assert_eq!(read(json!({ "opentmcl": sent.clone(), "other": 1 })), expected);
        assert_eq!(read(sent), expected);
    }

    #[test]
    fn what_is_not_set_stays() {
        let before = (None, vec![PathBuf::from("/before")], None);
        for sent in [json!(null), json!({}), json!({ "module": null }), json!({ "module": "" })] {
            assert_eq!(read(sent), before);
        }
    }

    #[test]
    fn what_cannot_be_used_is_told() {
        let (module, _, problem) = read(json!({ "module": "tmcm-1" }));
        assert_eq!(module, None);
        let problem = problem.unwrap();
        let names = MODULES.iter().map(|module| module.name);
        assert!(
            problem.contains("can be ") && names.into_iter().all(|name| problem.contains(name))
        );
        let (_, include, problem) = read(json!({ "includePaths": "lib" }));
        assert_eq!(include, [PathBuf::from("/before")]);
        assert!(problem.is_some());
    }
}
