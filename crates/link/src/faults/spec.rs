//! Which faults a line has, and how that is written.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use super::injector::Injector;

/// The longest delay that can be asked for.
const MAX_DELAY: Duration = Duration::from_secs(60);

/// Tells the random numbers of requests from those of replies.
const OF_REQUESTS: u64 = 0x5245_5155_4553_5453;

/// Something that happens to a frame on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It is lost.
    Drop,
    /// Bits of one of its bytes are inverted.
    Corrupt,
    /// Only its first one to eight bytes arrive.
    Truncate,
    /// It arrives twice.
    Duplicate,
    /// One to four bytes that nobody sent arrive before it.
    Stray,
    /// It is withheld and comes with the next one of its direction. At a rate of 1 every reply is
    /// that to the request before.
    Stale,
    /// It arrives late, and what follows waits for it.
    Delay,
}

impl Fault {
    /// All of them, in the order in which they are written.
    pub const ALL: [Self; 7] = [
        Self::Drop,
        Self::Corrupt,
        Self::Truncate,
        Self::Duplicate,
        Self::Stray,
        Self::Stale,
        Self::Delay,
    ];

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Corrupt => "corrupt",
            Self::Truncate => "truncate",
            Self::Duplicate => "duplicate",
            Self::Stray => "stray",
            Self::Stale => "stale",
            Self::Delay => "delay",
        }
    }
}

/// How often each fault happens in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// By fault; each 0.0..=1.0.
    rates: [f64; Fault::ALL.len()],
    delay: Duration,
}

impl Rates {
    /// The share of frames that meet this fault, 0.0..=1.0.
    pub const fn rate(&self, fault: Fault) -> f64 {
        self.rates[fault as usize]
    }

    /// How late a delayed frame arrives, in real time.
    pub const fn delay(&self) -> Duration {
        self.delay
    }

    /// Whether nothing ever happens.
    pub fn is_none(&self) -> bool {
        self.rates.iter().all(|&rate| rate == 0.0)
    }
}

/// What a line does to requests and replies.
///
/// As text it is a list such as `drop=0.001,corrupt=1/1000,delay=20ms@0.01,requests.drop=0.01,seed=7`,
/// or `none`. Names without `requests.` are about replies.
///
/// ```
/// use opentmcl_link::faults::{Fault, Faults};
///
/// let faults: Faults = "corrupt=1/1000,seed=7".parse().unwrap();
/// assert_eq!(faults.replies.rate(Fault::Corrupt), 0.001);
/// assert_eq!(faults.to_string(), "corrupt=0.001,seed=7");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// From the client to the module.
    pub requests: Rates,
    /// From the module to the client.
    pub replies: Rates,
    /// Which of the possible sequences of faults it is.
    pub seed: u64,
}

impl Faults {
    /// Whether nothing ever happens.
    pub fn is_none(&self) -> bool {
        self.requests.is_none() && self.replies.is_none()
    }

    pub(crate) fn request_injector(&self) -> Injector {
        Injector::new(self.requests, self.seed ^ OF_REQUESTS)
    }

    pub(crate) fn reply_injector(&self) -> Injector {
        Injector::new(self.replies, self.seed)
    }
}

/// Why a text says nothing about faults.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FaultsError {
    /// There is nothing.
    #[error("no fault is named")]
    Empty,
    /// A part has no `=`.
    #[error("{0:?} has no value")]
    NoValue(String),
    /// A name that means nothing.
    #[error("{0:?} is no fault of a line")]
    Name(String),
    /// The same name twice.
    #[error("{0} is there twice")]
    Twice(String),
    /// Not a rate.
    #[error("{name}: {text:?} is not a rate")]
    Rate {
        /// Of what.
        name: String,
        /// What stands there.
        text: String,
    },
    /// Not a delay.
    #[error("{name}: {text:?} is not a delay")]
    Delay {
        /// `delay`, or `requests.delay`.
        name: String,
        /// What stands there.
        text: String,
    },
    /// Not a seed.
    #[error("seed: {0:?} is not a number from 0 to {max}", max = u64::MAX)]
    Seed(String),
}

impl FaultsError {
    /// What would be right.
    pub fn help(&self) -> String {
        match self {
            Self::Empty | Self::NoValue(_) => {
                "write NAME=RATE, with commas between several: drop=0.001,corrupt=1/1000,seed=7; \
                 or none"
                    .into()
            }
            Self::Name(_) => format!(
                "the names are {}, each also with requests. before it, and seed",
                Fault::ALL.map(Fault::name).join(", ")
            ),
            Self::Twice(_) => "write each name once".into(),
            Self::Rate { .. } => "a rate is a number from 0 to 1, or 1/N: 0.001, 1/1000".into(),
            Self::Delay { .. } => {
                "write a time up to 60 s and the rate behind @: 20ms@0.01; without @ every frame is \
                 delayed"
                    .into()
            }
            Self::Seed(_) => "write a whole number: seed=7".into(),
        }
    }
}

impl FromStr for Faults {
    type Err = FaultsError;

    fn from_str(text: &str) -> Result<Self, FaultsError> {
        let mut faults = Self::default();
        match text.trim() {
            "" => return Err(FaultsError::Empty),
            "none" => return Ok(faults),
            _ => {}
        }
        let mut seen = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (name, value) = part
                .split_once('=')
                .map(|(name, value)| (name.trim(), value.trim()))
                .ok_or_else(|| FaultsError::NoValue(part.to_owned()))?;
            let (requests, fault) = match name.split_once('.') {
                Some(("requests", fault)) => (true, fault),
                Some(("replies", fault)) => (false, fault),
                _ => (false, name),
            };
            if name == "seed" {
                faults.seed = value.parse().map_err(|_| FaultsError::Seed(value.to_owned()))?;
            } else {
                let fault = Fault::ALL
                    .into_iter()
                    .find(|known| known.name() == fault)
                    .ok_or_else(|| FaultsError::Name(name.to_owned()))?;
                let rates = if requests { &mut faults.requests } else { &mut faults.replies };
                let (delay, rate) = match fault {
                    Fault::Delay => parse_delay(name, value)?,
                    _ => (Duration::ZERO, parse_rate(name, value)?),
                };
                rates.rates[fault as usize] = rate;
                if fault == Fault::Delay && rate > 0.0 {
                    rates.delay = delay;
                }
            }
            let said = (requests, fault);
            if seen.contains(&said) {
                return Err(FaultsError::Twice(name.to_owned()));
            }
            seen.push(said);
        }
        Ok(faults)
    }
}

fn parse_rate(name: &str, text: &str) -> Result<f64, FaultsError> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let rate = match text.split_once('/') {
        Some((over, under)) => number(over).zip(number(under)).map(|(over, under)| over / under),
        None => number(text),
    };
    rate.filter(|rate| (0.0..=1.0).contains(rate))
        .map(f64::abs) // Without a sign, so that zero is one number only.
        .ok_or_else(|| FaultsError::Rate { name: name.to_owned(), text: text.to_owned() })
}

fn parse_delay(name: &str, text: &str) -> Result<(Duration, f64), FaultsError> {
    let (time, rate) = match text.split_once('@') {
        Some((time, rate)) => (time.trim(), parse_rate(name, rate.trim())?),
        None => (text, 1.0),
    };
    let units = [("us", 1_000), ("µs", 1_000), ("ms", 1_000_000), ("s", 1_000_000_000)];
    units
        .into_iter()
        .find_map(|(unit, nanos)| Some((time.strip_suffix(unit)?, nanos)))
        .and_then(|(count, nanos)| count.trim_end().parse::<u64>().ok()?.checked_mul(nanos))
        .map(Duration::from_nanos)
        .filter(|delay| (Duration::from_micros(1)..=MAX_DELAY).contains(delay))
        .map(|delay| (delay, rate))
        .ok_or_else(|| FaultsError::Delay { name: name.to_owned(), text: text.to_owned() })
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::default() {
            return f.write_str("none");
        }
        let mut separator = "";
        for (prefix, rates) in [("", &self.replies), ("requests.", &self.requests)] {
            for fault in Fault::ALL {
                let rate = rates.rate(fault);
                if rate == 0.0 {
                    continue;
                }
                write!(f, "{separator}{prefix}{}=", fault.name())?;
                separator = ",";
                if fault == Fault::Delay {
                    write_time(f, rates.delay)?;
                    f.write_str("@")?;
                }
                write!(f, "{rate}")?;
            }
        }
        if self.seed != 0 || separator.is_empty() {
            write!(f, "{separator}seed={}", self.seed)?;
        }
        Ok(())
    }
}

/// In the largest unit that leaves no fraction.
fn write_time(f: &mut fmt::Formatter<'_>, time: Duration) -> fmt::Result {
    match time.as_micros() {
        micros if micros % 1_000_000 == 0 => write!(f, "{}s", micros / 1_000_000),
        micros if micros % 1_000 == 0 => write!(f, "{}ms", micros / 1_000),
        micros => write!(f, "{micros}us"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<Faults, FaultsError> {
        text.parse()
    }

    #[test]
    fn each_name_sets_the_rate_of_its_fault() {
        let faults = parse(
            "drop=0.5, corrupt=1/1000,truncate=0.25,duplicate=1,stray=0,stale=1/8,\
             delay=20ms@0.01,requests.drop=0.125,requests.delay=3 s,seed=7",
        )
        .unwrap();
        let replies = Fault::ALL.map(|fault| faults.replies.rate(fault));
        assert_eq!(replies, [0.5, 0.001, 0.25, 1.0, 0.0, 0.125, 0.01]);
        let requests = Fault::ALL.map(|fault| faults.requests.rate(fault));
        assert_eq!(requests, [0.125, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(faults.replies.delay(), Duration::from_millis(20));
        assert_eq!(faults.requests.delay(), Duration::from_secs(3));
        assert_eq!(faults.seed, 7);
    }

    #[test]
    fn names_without_a_direction_are_about_replies() {
        assert_eq!(parse("drop=0.5"), parse("replies.drop=0.5"));
        assert_ne!(parse("drop=0.5"), parse("requests.drop=0.5"));
    }

    #[test]
    fn none_is_no_fault() {
        assert!(parse("none").unwrap().is_none());
        assert!(parse("drop=0,delay=20ms@0").unwrap().is_none());
        assert_eq!(Faults::default().to_string(), "none");
    }

    #[test]
    fn an_error_names_the_wrong_part_and_what_would_be_right() {
        let cases = [
            ("", "no fault is named", "drop=0.001"),
            ("drop", "\"drop\" has no value", "NAME=RATE"),
            (
                "dorp=0.1",
                "\"dorp\" is no fault",
                "drop, corrupt, truncate, duplicate, stray, stale",
            ),
            ("answers.drop=1", "\"answers.drop\" is no fault", "requests."),
            ("drop=0.1,corrupt=2", "corrupt: \"2\" is not a rate", "from 0 to 1, or 1/N"),
            ("drop=-0.1", "drop: \"-0.1\" is not a rate", "1/1000"),
            ("drop=nan", "drop: \"nan\" is not a rate", "1/1000"),
            ("drop=1/0", "drop: \"1/0\" is not a rate", "1/1000"),
            ("drop=0/0", "drop: \"0/0\" is not a rate", "1/1000"),
            ("delay=0.5", "delay: \"0.5\" is not a delay", "20ms@0.01"),
            ("requests.delay=61s", "requests.delay: \"61s\" is not a delay", "60 s"),
            ("delay=99999999999999999999s", "is not a delay", "60 s"),
            ("delay=20ms@7", "delay: \"7\" is not a rate", "from 0 to 1"),
            ("seed=-1", "seed: \"-1\" is not a number", "seed=7"),
            ("drop=1,seed=1,replies.drop=1", "replies.drop is there twice", "once"),
            ("drop=1,", "\"\" has no value", "NAME=RATE"),
        ];
        for (text, message, help) in cases {
            let error = parse(text).unwrap_err();
            assert!(error.to_string().contains(message), "{text}: {error}");
            assert!(error.help().contains(help), "{text}: {}", error.help());
        }
    }

    fn rates() -> impl Strategy<Value = Rates> {
        let rate = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
        (prop::array::uniform7(rate), 1_u64..60_000_000).prop_map(|(rates, micros)| {
            let delayed = rates[Fault::Delay as usize] > 0.0;
            let delay = if delayed { Duration::from_micros(micros) } else { Duration::ZERO };
            Rates { rates, delay }
        })
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(requests in rates(), replies in rates(), seed: u64) {
            let faults = Faults { requests, replies, seed };
            prop_assert_eq!(parse(&faults.to_string()), Ok(faults));
        }

        #[test]
        fn no_text_breaks_the_parser(text in ".{0,60}") {
            let _ = parse(&text);
        }
    }
}
