//! Faults of the lines: on the command line, in scenarios, and in the world protocol.

use opentmcl_link::faults::{Counts, Fault, Faults, FaultsError};
use opentmcl_link::{Endpoint, ServedPort};
use opentmcl_virtual::{Effect, Scenario};
use serde::Serialize;

use crate::failure::Failure;

/// `SPEC` for all ports, or `PORT:SPEC` for those with this name.
#[derive(Clone, Debug)]
pub(super) struct PortFaults {
    pub(super) port: Option<String>,
    pub(super) faults: Faults,
}

/// Reads what stands behind `--faults`.
pub(super) fn parse_option(text: &str) -> Result<PortFaults, String> {
    let (port, spec) = match text.split_once(':') {
        Some((port, spec)) => (Some(port.trim().to_owned()), spec),
        None => (None, text),
    };
    Ok(PortFaults { port, faults: parse(spec)? })
}

/// Reads faults; the error says what would be right.
pub(super) fn parse(spec: &str) -> Result<Faults, String> {
    spec.parse().map_err(|error: FaultsError| format!("{error}; {}", error.help()))
}

/// Looks at everything in a scenario that is about faults, so that no mistake is found when it is too
/// late to tell.
///
/// # Errors
/// The first text that is wrong, and where it stands.
pub(super) fn check(scenario: &Scenario) -> Result<(), Failure> {
    for module in &scenario.modules {
        for port in &module.ports {
            if let Some(Err(error)) = port.faults.as_deref().map(parse) {
                return Err(Failure::new(format!(
                    "{}:{}: faults: {error}",
                    scenario.name, port.line
                )));
            }
        }
        let later = module.timeline.iter().map(|(_, action)| action);
        for action in module.start.iter().chain(later) {
            if let opentmcl_virtual::Action::Faults { spec, .. } = action
                && let Err(error) = parse(spec)
            {
                let (file, name) = (&scenario.name, &module.name);
                return Err(Failure::new(format!("{file}: {action} of module {name}: {error}")));
            }
        }
    }
    Ok(())
}

/// Gives the ports of a module that are meant the faults that are asked for.
///
/// # Errors
/// What is wrong with the text, or that there is no such port.
pub(super) fn apply(
    ports: &mut [ServedPort],
    module: usize,
    effect: &Effect,
) -> Result<(), String> {
    let Effect::Faults { port: name, spec } = effect;
    let faults = parse(spec)?;
    let mut own = ports.iter_mut().filter(|port| port.module() == module).peekable();
    if own.peek().is_none() {
        return Err("this module is served on no port".into());
    }
    let mut names = Vec::new();
    let mut found = false;
    for port in own {
        if name == "all" || port.name() == name {
            port.set_faults(faults);
            found = true;
        }
        names.push(port.name());
    }
    if found {
        return Ok(());
    }
    Err(format!("there is no port {name:?} (ports: {}, or all)", names.join(", ")))
}

/// One port, as the answer to `faults` has it.
#[derive(Serialize)]
struct Told<'a> {
    module: &'a str,
    port: &'a str,
    kind: &'static str,
    faults: String,
    requests: Counted,
    replies: Counted,
}

/// How many frames there were and how many of them met each fault.
#[derive(Serialize)]
struct Counted {
    frames: u64,
    drop: u64,
    corrupt: u64,
    truncate: u64,
    duplicate: u64,
    stray: u64,
    stale: u64,
    delay: u64,
}

impl From<&Counts> for Counted {
    fn from(counts: &Counts) -> Self {
        Self {
            frames: counts.frames,
            drop: counts[Fault::Drop],
            corrupt: counts[Fault::Corrupt],
            truncate: counts[Fault::Truncate],
            duplicate: counts[Fault::Duplicate],
            stray: counts[Fault::Stray],
            stale: counts[Fault::Stale],
            delay: counts[Fault::Delay],
        }
    }
}

/// The answer to `faults`: what each port does to frames, and what it has done.
pub(super) fn tell(ports: &[ServedPort], scenario: &Scenario) -> String {
    #[derive(Serialize)]
    struct Answer<'a> {
        ok: bool,
        faults: Vec<Told<'a>>,
    }
    let faults = ports.iter().map(|port| Told {
        module: scenario.modules.get(port.module()).map_or("", |module| &module.name),
        port: port.name(),
        kind: kind(port.endpoint()),
        faults: port.faults().to_string(),
        requests: port.request_counts().into(),
        replies: port.reply_counts().into(),
    });
    let answer = Answer { ok: true, faults: faults.collect() };
    serde_json::to_string(&answer).unwrap_or_default()
}

fn kind(endpoint: Endpoint) -> &'static str {
    match endpoint {
        Endpoint::Pty => "pty",
        Endpoint::Tcp => "tcp",
    }
}
