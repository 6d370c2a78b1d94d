//! Steps against a target that answers by simple rules.

use super::*;
use crate::parse::parse;
use crate::programs::{NoPrograms, ScenarioFile};
use opentmcl_wire::{Opcode, Reply};

/// Answers every command with status 100 and the value of the request plus one; GGP with the
/// time in milliseconds, GAP of axis 5 with a refusal; commands to other addresses than 1 with
/// silence.
struct Echo {
    replies: VecDeque<[u8; FRAME_LEN]>,
    time: Duration,
}

impl Target for Echo {
    fn send(&mut self, _: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError> {
        let request = serial::decode_request(frame).unwrap();
        let Command { number, value, .. } = request.command;
        if number == control::POSITION_REPORT {
            let event = Reply { status: Status::DELAYED, number, value: 1 };
            self.replies.push_back(serial::encode_reply(2, 1, event));
        }
        if request.address == 1 {
            let loaded = matches!(number, 1..=100);
            let refused = number == Opcode::Gap.number() && request.command.motor == 5;
            let status = match refused {
                true => Status::INVALID_VALUE,
                false if loaded && value == 7 => Status::LOADED,
                false => Status::OK,
            };
            let millis = i32::try_from(self.time.as_millis()).unwrap();
            let is_clock = number == Opcode::Ggp.number();
            let reply = Reply { status, number, value: if is_clock { millis } else { value + 1 } };
            self.replies.push_back(serial::encode_reply(2, 1, reply));
        }
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
        Ok(self.replies.pop_front())
    }

    fn wait(&mut self, time: Duration) -> Result<(), TargetError> {
        self.time += time;
        Ok(())
    }

    fn pause(&mut self, at_most: Duration) -> Result<(), TargetError> {
        self.time += at_most.min(Duration::from_millis(1));
        Ok(())
    }

    fn moment(&mut self) -> Moment {
        Moment { time: self.time, program: None }
    }

    fn power_cycle(&mut self) -> Result<(), TargetError> {
        Err(TargetError::Unable("it has no switch".to_owned()))
    }

    fn set_input(&mut self, _: u8, _: bool) -> Result<(), TargetError> {
        Err(TargetError::Broken("the cable is out".to_owned()))
    }

    fn set_analog(&mut self, _: u8, _: u16) -> Result<(), TargetError> {
        Ok(())
    }

    fn scenario(&mut self, _: &ScenarioFile) -> Result<(), TargetError> {
        Err(TargetError::Unable("it has no machine".to_owned()))
    }

    fn world(&mut self, _: &str) -> Result<(), TargetError> {
        Err(TargetError::Unable("it has no machine".to_owned()))
    }

    fn stage(&mut self, axis: u8, unit: &str) -> Result<Option<f64>, TargetError> {
        Ok((unit == "mm").then(|| f64::from(axis) + 0.5))
    }

    fn fresh(&mut self) -> Result<(), TargetError> {
        self.time = Duration::from_ticks(0);
        Ok(())
    }
}

fn outcome(text: &str) -> Outcome {
    let text = format!("module tmcm-6214\n{text}");
    let transcript = parse("test.txt", &text, &mut NoPrograms).unwrap();
    let echo = Echo { replies: VecDeque::new(), time: Duration::from_ticks(0) };
    run(&transcript, &mut { echo })
}

#[test]
fn what_comes_as_expected_passes() {
    let text = "> SAP 1, 0, 5\n< 100\n> SAP 1, 0, 5\n< 100 6\n> SAP 1, 0, 5\n< 100 0..6\n\
                > module 9: GAP 1, 0\n< silence\n>> 01 06 01 00 00 00 00 00 08\n\
                << 02 01 64 06 00 00 00 01 ..\nwait 10 ms\nprogram\nSGP 1, 2, 7\nend\n";
    let outcome = outcome(text);
    assert_eq!(outcome.failures, []);
    assert_eq!(outcome.expectations, 8);
}

#[test]
fn a_failure_names_line_command_and_both_replies_and_the_file_goes_on() {
    let outcome = outcome("> SAP 1, 0, 5\n< 100 5\n> GAP 1, 0\n< 4\n> GAP 1, 0\n< 100 1");
    assert_eq!(outcome.expectations, 3);
    assert!(!outcome.passed());
    let [first, second] = &outcome.failures[..] else { panic!("{:?}", outcome.failures) };
    assert_eq!((first.line, second.line), (3, 5));
    assert_eq!(first.command, "SAP 1, 0, 5");
    assert_eq!(first.expected, "status 100, value 5");
    assert!(first.got.starts_with("status 100 (successfully executed), value 6 (02 01 64 05"));
    assert_eq!(second.expected, "status 4");
}

#[test]
fn a_reply_where_silence_belongs_and_silence_where_a_reply_belongs_fail() {
    let outcome = outcome("> GAP 1, 0\n< silence\n> module 5: GAP 1, 0\n< 100");
    assert_eq!(outcome.failures.len(), 2);
    assert_eq!(outcome.failures[1].got, "silence");
}

#[test]
fn a_second_reply_is_kept_until_it_is_asked_for() {
    assert!(outcome("> 138 0, 0, 1\n< 100 2\n<+ 128 1").passed());
    let bytes = "> 138 0, 0, 1\n< 100\n<<+ 02 01 80 8A 00 00 00 01 0E";
    assert!(outcome(bytes).passed());
    assert_eq!(outcome("<+ 128 1").failures[0].got, "silence");
}

#[test]
fn a_second_reply_that_nobody_expects_fails() {
    let outcome = outcome("> 138 0, 0, 1\n< 100 2");
    assert_eq!(outcome.failures.len(), 1);
    assert_eq!(outcome.failures[0].expected, "no more replies");
}

#[test]
fn what_a_target_cannot_do_skips_the_rest() {
    let outcome = outcome("> GAP 1, 0\n< 100\npower cycle\n> GAP 1, 0\n< 4");
    assert!(outcome.passed());
    assert_eq!(outcome.skipped, [Skipped { line: 4, reason: "it has no switch".to_owned() }]);
}

#[test]
fn a_lost_connection_is_a_failure_and_ends_the_file() {
    let outcome = outcome("input 0 high\n> GAP 1, 0\n< 4");
    assert_eq!(outcome.failures.len(), 1);
    assert_eq!(outcome.failures[0].got, "the cable is out");
}

#[test]
fn a_program_is_loaded_command_by_command() {
    // The target answers a command with value 7 as loaded, any other as executed.
    let outcome = outcome("program\nSGP 1, 2, 7\nSGP 1, 2, 8\nend");
    assert_eq!(outcome.expectations, 4);
    assert_eq!(outcome.failures.len(), 1);
    assert_eq!(outcome.failures[0].line, 4);
    assert_eq!(outcome.failures[0].expected, "status 101");
}

#[test]
fn an_expected_condition_is_asked_for_and_each_one_that_does_not_hold_is_told() {
    // Whatever is asked with the value 0 is answered with 1; GGP with the time.
    assert!(outcome("expect position 0 = 1, output 2 high, variable 3 = 0").passed());
    let outcome = outcome("wait 4 ms\nexpect speed 0 > 1, output 2 low, variable 3 = 5..9");
    let told: Vec<_> = outcome
        .failures
        .iter()
        .map(|f| (f.line, f.command.as_str(), f.expected.as_str(), f.got.as_str()))
        .collect();
    assert_eq!(
        told,
        [
            (3, "expect speed 0 > 1", "> 1", "1"),
            (3, "expect output 2 low", "low", "high"),
            (3, "expect variable 3 = 5..9", "5..9", "4"),
        ]
    );
    assert_eq!(outcome.expectations, 3);
    assert_eq!(outcome.failures[0].moment.time, Duration::from_millis(4));
}

#[test]
fn a_wait_goes_on_until_all_conditions_hold_at_once() {
    // The clock is 5 after five looks that failed, and goes on by 1 with each.
    let text = "wait until variable 0 >= 5, position 0 = 1, at most 5 ms\n\
                expect variable 0 = 5";
    assert_eq!(outcome(text).failures, []);
    let never = outcome("wait until variable 0 < 2, variable 0 > 3, at most 20 ms");
    assert_eq!(never.failures.len(), 1, "each holds for a while, never both");
}

#[test]
fn a_wait_whose_time_is_over_fails_with_the_condition_and_goes_on() {
    let outcome = outcome("wait until variable 0 = 5, at most 4 ms\nexpect variable 0 = 4");
    let [failure] = &outcome.failures[..] else { panic!("{:?}", outcome.failures) };
    assert_eq!(failure.command, "wait until variable 0 = 5, at most 4 ms");
    assert_eq!(failure.expected, "variable 0 = 5 within 4 ms");
    assert_eq!(failure.got, "4");
    assert_eq!(outcome.expectations, 2);
}

#[test]
fn what_the_module_refuses_to_say_is_told_at_once() {
    for text in ["expect position 5 = 1", "wait until position 5 reached, at most 1 s"] {
        let outcome = outcome(text);
        assert!(outcome.failures[0].got.starts_with("status 4 (invalid value)"), "{text}");
        assert_eq!(outcome.failures[0].moment.time, Duration::from_ticks(0), "{text}");
    }
}

#[test]
fn each_case_begins_anew_with_the_set_up() {
    let text = "wait 7 ms\ntest \"a\"\nexpect variable 0 = 7\nwait 1 ms\n\
                test \"b\"\nexpect variable 0 = 7";
    assert_eq!(outcome(text).failures, []);
}

#[test]
fn what_a_target_cannot_do_skips_the_rest_of_the_case_alone() {
    let text = "test \"a\"\npower cycle\nexpect position 0 = 2\n\
                test \"b\"\nexpect position 0 = 2";
    let outcome = outcome(text);
    assert_eq!(outcome.skipped.len(), 1);
    assert_eq!(outcome.skipped[0].line, 3);
    let lines: Vec<_> = outcome.failures.iter().map(|failure| failure.line).collect();
    assert_eq!(lines, [6]);
}

#[test]
fn a_stage_is_expected_where_it_is_and_what_no_target_can_do_ends_the_file() {
    let outcome = outcome(
        "expect stage 2 = 2.4..2.6 mm\nexpect stage 2 = 3 mm\nexpect stage 2 = 3 deg\n\
         world block axis 0\nexpect stage 2 = 9 mm",
    );
    assert_eq!(outcome.expectations, 3);
    let [second, third] = &outcome.failures[..] else { panic!("{:?}", outcome.failures) };
    assert_eq!((second.line, second.got.as_str()), (3, "stage 2 = 2.5000 mm"));
    assert_eq!(third.got, "a stage that is not measured in deg");
    let skipped = Skipped { line: 5, reason: "it has no machine".to_owned() };
    assert_eq!(outcome.skipped, [skipped]);
}
