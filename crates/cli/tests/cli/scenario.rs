//! Scenarios on the command line: in connections, in `tmcl sim` and in transcripts.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use crate::common::{failure_of, run, serve, stdout_of};

const LAB: &str = "\
[[module]]
name = \"first\"
model = \"tmcm-6214\"
supply = \"18 V\"
[[module]]
name = \"second\"
model = \"tmcm-6214\"
supply = \"12 V\"
[[module.axis]]
axis = 0
motor = \"nema17\"
[[module.at]]
time = \"2 s\"
do = \"input 3 high\"
";

struct Folder(TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            fs::write(folder.path(name), text).unwrap();
        }
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }
}

#[test]
fn a_connection_leads_to_a_module_of_a_scenario() {
    let folder = Folder::new(&[("lab.toml", LAB)]);
    // GIO 8, 1 is the supply in 0.1 V.
    for (module, supply) in [("", "180"), ("#first", "180"), ("#second", "120")] {
        let uri = format!("virtual:{}{module}", folder.text("lab.toml"));
        let reply = stdout_of(&["exec", "-c", &uri, "GIO 8, 1"]);
        assert!(reply.contains(supply), "{reply}");
    }
    let uri = format!("virtual:{}#third", folder.text("lab.toml"));
    let (code, error) = failure_of(&["exec", "-c", &uri, "GIO 8, 1"]);
    assert_eq!(code, 2);
    assert!(error.contains("has no module \"third\"") && error.contains("first, second"));
}

#[test]
fn all_mistakes_of_a_scenario_are_told() {
    let folder = Folder::new(&[("lab.toml", "[[module]]\nmodel = \"tmcm-6214\"\na = 1\nb = 2\n")]);
    let file = folder.text("lab.toml");
    let (code, error) = failure_of(&["exec", "-c", &format!("virtual:{file}"), "GIO 8, 1"]);
    assert_eq!(code, 1);
    assert!(error.starts_with(&format!("error: {file}:3:1: a module has no key \"a\"")), "{error}");
    assert!(error.contains(&format!("\n       {file}:4:1: a module has no key \"b\"")), "{error}");
    fs::write(folder.path("lab.toml"), b"[[module]]\n# \xFF").unwrap();
    let (_, error) = failure_of(&["exec", "-c", &format!("virtual:{file}"), "GIO 8, 1"]);
    assert!(error.contains("lab.toml:2: this is no UTF-8"), "{error}");
    let (_, error) = failure_of(&["exec", "-c", "virtual:/nowhere/lab.toml", "GIO 8, 1"]);
    assert!(error.contains("cannot read /nowhere/lab.toml"), "{error}");
}

#[test]
fn a_simulation_has_the_scenario_around_it() {
    let program = "Again: GIO 3, 0\nJC ZE, Again\nSIO 0, 2, 1\nSTOP\n";
    let folder = Folder::new(&[("lab.toml", LAB), ("wait.tmc", program)]);
    let (lab, file) = (folder.text("lab.toml"), folder.text("wait.tmc"));
    let out = stdout_of(&["sim", &file, "--scenario", &format!("{lab}#second")]);
    assert!(out.contains("output 0   high at 2.000 s"), "{out}");
    let plot = folder.text("lab.toml");
    let args = ["sim", &file, "--scenario", &format!("{lab}#second"), "--plot", &plot];
    assert_eq!(failure_of(&args).0, 2, "a scenario is not overwritten by a picture");
    // The first module has no such plan.
    let out = stdout_of(&["sim", &file, "--scenario", &lab, "--until", "5s"]);
    assert!(out.contains("time up after 5.000 s"), "{out}");
}

#[test]
fn a_transcript_acts_on_its_scenario() {
    let transcript = "module tmcm-6214\nscenario lab.toml\nworld supply 15 V\n> GIO 8, 1\n< 100 150\n\
                      expect stage 0 = 0 deg\nexpect stage 0 = 1..2 deg\nexpect stage 0 = 0 mm\n";
    let lab = LAB.replace("[[module.axis]]", "[[module.axis]] # of the second\n");
    let folder = Folder::new(&[("a.txt", transcript), ("lab.toml", &lab)]);
    let output = run(&["conform", &folder.text("a.txt")]);
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(out.contains("2 of 4 expectations"), "{out}");
    assert!(out.contains("got      stage 0 = 0.0000 deg"), "{out}");
    assert!(out.contains("got      a stage that is not measured in mm"), "{out}");
}

#[test]
fn what_a_transcript_asks_of_its_scenario_is_checked_before_it_runs() {
    let transcript =
        "module tmcm-6214\nscenario lab.toml\nworld blokc axis 0\nworld block axis 0\n";
    let folder = Folder::new(&[("a.txt", transcript), ("lab.toml", LAB)]);
    let (_, error) = failure_of(&["conform", &folder.text("a.txt")]);
    assert!(error.contains("a.txt:3: \"blokc\" is no action; did you mean \"block\"?"), "{error}");
    // It is the second module that has a machine.
    assert!(error.contains("a.txt:4: axis 0 has no machine"), "{error}");
}

#[test]
fn a_served_module_skips_what_only_a_virtual_one_can_do() {
    let transcript = "module tmcm-6214\nscenario lab.toml\n> GIO 8, 1\n< 100 180\n";
    let folder = Folder::new(&[("a.txt", transcript), ("lab.toml", LAB)]);
    let served = serve(&["--tcp"]);
    let address = served.endpoints["tcp"].as_str().unwrap();
    let out = stdout_of(&["conform", &folder.text("a.txt"), "-c", &format!("tcp:{address}")]);
    assert!(out.contains("skipped from line 2: there is a scenario only on a virtual"), "{out}");
}
