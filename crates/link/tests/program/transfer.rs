//! Download, read, verify.

use std::time::Duration;

use opentmcl_firmware::Line;
use opentmcl_link::program::{
    ATTEMPTS, Doubt, END_MARK, Identity, Programmer, Step, TransferError,
};
use opentmcl_link::{Connection, ConnectionError};
use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Reply, Status, mnemonic};

use crate::line::{FAULTS, Fault, FaultyLine};

/// Commands that the TMCM-6214 holds.
const MEMORY: usize = 2048;

/// Neighbours that are equal, or differ in one field only, and commands whose bytes resemble
/// replies: type 128 is the status of a late report, 134 the number of the command that reads, and
/// `1 1, 0, 0` the answer of module 1 to a damaged request; `ROL` has the number of the host's
/// address, behind which a reply begins.
const PROGRAM: [&str; 10] = [
    "MVP ABS, 0, 100",
    "MVP ABS, 0, 100",
    "MVP ABS, 0, 200",
    "GAP 128, 0",
    "CALCVV ADD, 134, 5",
    "1 1, 0, 0",
    "ROL 0, 5",
    "WAIT POS, 0, 0",
    "ROR 0, -1",
    "JA 0",
];

fn program() -> Vec<Command> {
    PROGRAM.map(|text| mnemonic::parse(text).unwrap()).to_vec()
}

/// What fills the memory before; a command of it that changes its place is seen.
fn old_program() -> Vec<Command> {
    (0..20).map(|address| Command::new(9, 1, 2, 1000 + address)).collect()
}

fn no_progress(_: usize) {}

fn open(line: &mut dyn Connection) -> Result<Programmer<'_>, TransferError> {
    Programmer::open(line, 1, MEMORY)
}

/// Downloads the program over a line with these faults, and looks at the memory.
#[track_caller]
fn assert_download_survives(kind: Line, plan: &[(usize, Fault)]) -> usize {
    let mut line = FaultyLine::of_kind(kind, plan);
    let old = old_program();
    line.store(&old);
    let result = open(&mut line).and_then(|mut host| host.download(&program(), &mut no_progress));
    assert!(result.is_ok(), "{plan:?}: {result:?}");
    let memory = line.memory(20);
    assert_eq!(memory[..11], [program(), vec![END_MARK]].concat(), "{plan:?}");
    // Behind the end mark nothing is executed; a request that leaves download mode may end up there
    // in a wrong shape.
    assert_eq!(memory[12..], old[12..], "{plan:?}");
    assert_eq!(line.execute(&["GGP 129, 0"]), 0, "{plan:?}: still in download mode");
    line.exchanges
}

#[test]
fn a_download_takes_one_exchange_per_command_and_four_more() {
    // 136, 132, the end mark and 133.
    assert_eq!(assert_download_survives(Line::Rs485, &[]), PROGRAM.len() + 4);
}

#[test]
fn any_fault_at_any_place_of_a_download_leaves_the_right_program() {
    for kind in [Line::Rs485, Line::Usb] {
        for place in 0..PROGRAM.len() + 4 {
            for fault in FAULTS {
                let exchanges = assert_download_survives(kind, &[(place, fault)]);
                assert!(exchanges > PROGRAM.len() + 4, "{fault:?} at {place} was not noticed");
            }
        }
    }
}

#[test]
fn any_two_faults_in_a_row_leave_the_right_program() {
    for place in 0..PROGRAM.len() + 4 {
        for first in FAULTS {
            for second in FAULTS {
                assert_download_survives(Line::Rs485, &[(place, first), (place + 1, second)]);
            }
        }
    }
}

#[test]
fn any_one_byte_that_slips_in_before_a_request_does_no_harm() {
    // One in 256 makes a frame with a correct checksum of itself and the next eight bytes.
    for place in 0..PROGRAM.len() + 4 {
        for stray in 0..=u8::MAX {
            assert_download_survives(Line::Usb, &[(place, Fault::StrayBeforeRequest(stray))]);
        }
    }
}

/// Reads and verifies the program over a line with this fault; gives the number of exchanges.
#[track_caller]
fn assert_reading_survives(plan: &[(usize, Fault)]) -> usize {
    let mut line = FaultyLine::with_plan(plan);
    line.store(&[program(), vec![END_MARK]].concat());
    let mut read = Vec::new();
    let result = open(&mut line).and_then(|mut host| {
        read = host.read(&mut no_progress)?;
        host.verify(&program(), &mut no_progress)
    });
    assert!(result.is_ok(), "{plan:?}: {result:?}");
    assert_eq!(read, program(), "{plan:?}");
    line.exchanges
}

#[test]
fn any_fault_at_any_place_of_reading_gives_the_right_program() {
    for place in 0..assert_reading_survives(&[]) {
        for fault in FAULTS {
            assert_reading_survives(&[(place, fault)]);
        }
    }
}

#[test]
fn any_one_byte_that_slips_in_before_a_reply_does_no_harm() {
    for place in 0..assert_reading_survives(&[]) {
        for stray in 0..=u8::MAX {
            assert_reading_survives(&[(place, Fault::StrayBeforeReply(stray))]);
            assert_download_survives(Line::Rs485, &[(place, Fault::StrayBeforeReply(stray))]);
        }
    }
}

#[test]
fn what_arrived_before_does_not_cost_an_attempt() {
    let mut line = FaultyLine::new();
    line.arrive(&[2, 1, 100]);
    open(&mut line).unwrap();
    assert_eq!(line.exchanges, 1);
}

#[test]
fn a_damaged_request_for_a_command_of_the_program_costs_no_time_out() {
    // The byte that is left over makes the next request a damaged one, too, unless the line is
    // silent before it.
    let mut line = FaultyLine::with_plan(&[(2, Fault::StrayBeforeRequest(1))]);
    line.store(&program());
    open(&mut line).unwrap().read(&mut no_progress).unwrap();
    assert!(line.millis() < 1_000, "{} ms", line.millis());
}

/// The first reply comes when it is given up, the one to the next request when the first was taken
/// for it.
const TWO_LATE: [Fault; 2] =
    [Fault::ReplyLate(Duration::from_millis(1_500)), Fault::ReplyLate(Duration::from_millis(600))];

#[test]
fn replies_one_step_out_are_not_taken_for_each_other() {
    for place in 0..assert_reading_survives(&[]) {
        assert_reading_survives(&[(place, TWO_LATE[0]), (place + 1, TWO_LATE[1])]);
    }
}

#[test]
fn a_module_that_is_silent_for_two_seconds_does_not_end_it() {
    let long = Fault::ReplyLate(Duration::from_millis(2_200));
    for place in 0..PROGRAM.len() + 4 {
        assert_download_survives(Line::Rs485, &[(place, long)]);
        assert_reading_survives(&[(place, long)]);
    }
}

#[test]
fn a_byte_that_slips_in_before_the_last_command_of_a_full_memory_is_noticed_at_the_end() {
    // 254 + 1 + 1 is 0, the lowest byte of the value, for a checksum: ROR of type 1.
    let mut full = vec![Command::new(28, 0, 0, 0); MEMORY];
    full[MEMORY - 1] = Command::new(1, 0, 0, 0);
    let plan = [(MEMORY + 1, Fault::StrayBeforeRequest(254))];
    let mut line = FaultyLine::of_kind(Line::Usb, &plan);
    open(&mut line).unwrap().download(&full, &mut no_progress).unwrap();
    assert_eq!(line.memory(MEMORY as i32), full);
    assert!(line.exchanges > MEMORY + 3, "it was not noticed");
}

#[test]
fn a_parameter_that_becomes_part_of_another_hosts_download_is_not_taken_for_read() {
    let mut line = FaultyLine::with_plan(&[(2, Fault::OtherHost)]);
    let error = open(&mut line).unwrap().set_auto_start(true).unwrap_err();
    assert!(matches!(error, TransferError::Refused { status: Status::LOADED, .. }), "{error:?}");
    assert!(error.help().contains("another program may be downloading"), "{}", error.help());
}

#[test]
fn a_command_of_the_program_is_not_taken_for_a_late_report() {
    // Type 128, where a reply has the status of a late report.
    let mut line = FaultyLine::new();
    line.store(&[Command::new(6, 128, 0, 0)]);
    let read = Command::new(134, 0, 0, 0);
    let frame = line.exchange(serial::encode_request(1, read)).unwrap();
    assert_eq!(frame, [2, 6, 128, 0, 0, 0, 0, 0, 136]);
}

#[test]
fn a_reply_that_can_be_read_in_two_ways_is_asked_for_twice() {
    // 136, one exchange for each of ten commands and the end mark, twice; and a marker and one
    // exchange more for each of the two commands that look like something else, twice.
    assert_eq!(assert_reading_survives(&[]), 1 + 2 * 11 + 2 * 2 * 2);
}

#[test]
fn a_module_that_does_not_return_the_value_of_what_it_stores_is_understood() {
    let mut line = FaultyLine::new();
    line.echoes = false;
    open(&mut line).unwrap().download(&program(), &mut no_progress).unwrap();
    // The first command is stored a second time, the others once.
    assert_eq!(line.exchanges, PROGRAM.len() + 6);
    assert_eq!(line.memory(PROGRAM.len() as i32), program());
}

#[test]
fn the_module_tells_its_type_and_progress_is_told_up_to_the_last_command() {
    let mut line = FaultyLine::new();
    let mut host = open(&mut line).unwrap();
    assert_eq!(host.identity(), Some(Identity { number: 6214, firmware: (1, 16) }));
    let mut told = Vec::new();
    host.download(&program()[..3], &mut |done| told.push(done)).unwrap();
    assert_eq!(told, [1, 2, 3, 3]);
}

#[test]
fn a_full_memory_has_no_end_mark() {
    let full = vec![Command::new(28, 0, 0, 0); MEMORY];
    let mut line = FaultyLine::new();
    let mut host = open(&mut line).unwrap();
    host.download(&full, &mut no_progress).unwrap();
    host.verify(&full, &mut no_progress).unwrap();
    assert_eq!(host.read(&mut no_progress).unwrap(), full);
}

#[test]
fn reading_ends_where_the_memory_of_the_module_does() {
    let mut line = FaultyLine::new();
    let full = vec![Command::new(28, 0, 0, 0); MEMORY];
    line.store(&full);
    let mut host = Programmer::open(&mut line, 1, MEMORY + 1).unwrap();
    assert_eq!(host.read(&mut no_progress).unwrap().len(), MEMORY);
}

#[test]
fn what_does_not_fit_or_would_be_executed_is_refused_before_anything_is_sent() {
    let mut line = FaultyLine::new();
    line.store(&old_program());
    let mut host = open(&mut line).unwrap();
    let long = vec![Command::new(28, 0, 0, 0); MEMORY + 1];
    let error = host.download(&long, &mut no_progress).unwrap_err();
    assert_eq!(error.to_string(), "the program has 2049 commands, the module's memory holds 2048");
    // Command 137 forgets all settings.
    let reset = [Command::new(28, 0, 0, 0), Command::new(137, 0, 0, 1234)];
    let error = host.download(&reset, &mut no_progress).unwrap_err();
    assert_eq!(error.to_string(), "command 137 at address 1 cannot be part of a program");
    assert_eq!(line.exchanges, 1, "that of opening");
    assert_eq!(line.memory(20), old_program());
}

#[test]
fn a_protected_program_is_not_overwritten_and_the_error_says_what_to_do() {
    let mut line = FaultyLine::new();
    line.store(&old_program());
    line.execute(&["SGP 81, 0, 2"]);
    let mut host = open(&mut line).unwrap();
    let protection = host.protection().unwrap();
    assert!(protection.overwriting && !protection.reading);
    let error = host.download(&program(), &mut no_progress).unwrap_err();
    assert!(matches!(error, TransferError::Refused { status: Status::EEPROM_LOCKED, .. }));
    assert!(error.help().contains("SGP 81, 0, 0"), "{}", error.help());
    assert_eq!(line.memory(20), old_program());
}

#[test]
fn a_silent_module_is_given_up_after_a_few_attempts_with_what_to_check() {
    let mut line = FaultyLine::new();
    line.cut();
    let error = open(&mut line).map(drop).unwrap_err();
    assert_eq!(
        error.to_string(),
        "asking for the type of the module (command 136) failed in 3 attempts; at last: no reply \
         within 1000 ms"
    );
    for what in ["cable", "termination", "--address", "?baud=N"] {
        assert!(error.help().contains(what), "{}", error.help());
    }
    assert_eq!(line.exchanges, ATTEMPTS as usize);
    assert!(line.millis() < 4_000, "{} ms", line.millis());
}

#[test]
fn a_download_that_cannot_go_on_names_the_place_and_leaves_download_mode() {
    // Exchange 2 stores address 0. Each attempt after the first is two exchanges, of which the first
    // fails here, so that the sixth is to leave download mode.
    let plan: Vec<_> = (4..7).map(|place| (place, Fault::ReplyLost)).collect();
    let mut line = FaultyLine::with_plan(&plan);
    let error = open(&mut line).unwrap().download(&program(), &mut no_progress).unwrap_err();
    assert!(
        matches!(
            error,
            TransferError::NoAnswer {
                step: Step::Store(2, _),
                attempts: ATTEMPTS,
                doubt: Doubt::Line(ConnectionError::Timeout(_)),
            }
        ),
        "{error:?}"
    );
    assert!(error.to_string().starts_with("storing MVP ABS, 0, 200 at address 2 (command 4)"));
    assert!(error.help().contains("not complete"), "{}", error.help());
    assert_eq!(line.execute(&["GGP 129, 0"]), 0);
}

#[test]
fn a_module_that_restarts_meanwhile_is_noticed_by_its_first_answer() {
    let mut line = FaultyLine::with_plan(&[(3, Fault::PowerCycle)]);
    let error = open(&mut line).unwrap().download(&program(), &mut no_progress).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the module executed MVP ABS, 0, 100, which was to be stored at address 1: it has left \
         download mode"
    );
}

#[test]
fn the_first_difference_is_named() {
    let mut line = FaultyLine::new();
    line.store(&[program(), vec![END_MARK]].concat());
    let mut host = open(&mut line).unwrap();
    let mut other = program();
    other[2].value = 300;
    other[4].value = 6;
    let error = host.verify(&other, &mut no_progress).unwrap_err();
    assert_eq!(error.to_string(), "address 2 holds MVP ABS, 0, 200 instead of MVP ABS, 0, 300");
    let error = host.verify(&program()[..9], &mut no_progress).unwrap_err();
    assert_eq!(error.to_string(), "address 9 holds JA 0 instead of 0 0, 0, 0");
}

#[test]
fn auto_start_is_set_and_read_back_over_any_fault() {
    for place in 0..4 {
        for fault in FAULTS {
            let mut line = FaultyLine::with_plan(&[(place, fault)]);
            let result = open(&mut line).and_then(|mut host| host.set_auto_start(true));
            assert!(result.is_ok(), "{fault:?} at {place}: {result:?}");
            assert_eq!(line.execute(&["GGP 77, 0"]), 1);
        }
    }
}

/// A module that says yes to everything and reads 0.
#[derive(Default)]
struct Forgetful {
    reply: Option<[u8; FRAME_LEN]>,
}

impl Connection for Forgetful {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        let reply = Reply { status: Status::OK, number: bytes[1], value: 0 };
        self.reply = Some(serial::encode_reply(2, 1, reply));
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError> {
        Ok(self.reply.take())
    }

    fn discard(&mut self) -> Result<(), ConnectionError> {
        self.reply = None;
        Ok(())
    }

    fn timeout(&self) -> Duration {
        Duration::ZERO
    }
}

#[test]
fn auto_start_that_is_acknowledged_and_not_kept_is_an_error() {
    let mut line = Forgetful::default();
    let error = open(&mut line).unwrap().set_auto_start(true).unwrap_err();
    assert_eq!(error.to_string(), "global parameter 77 was set to 1 and reads 0");
}

#[test]
fn a_forgotten_download_mode_is_left_before_a_parameter_is_asked_for() {
    let mut line = FaultyLine::new();
    line.store(&old_program());
    line.execute(&["132 0, 0, 3"]);
    open(&mut line).unwrap().protection().unwrap();
    line.execute(&["132 0, 0, 3"]);
    open(&mut line).unwrap().set_auto_start(true).unwrap();
    assert_eq!(line.memory(20), old_program());
}

#[test]
fn the_end_of_a_program_tells_whether_something_has_slipped_in() {
    let program = program();
    let mut line = FaultyLine::of_kind(Line::Usb, &[]);
    let mut host = open(&mut line).unwrap();
    host.download(&program, &mut no_progress).unwrap();
    host.verify_end(&program).unwrap();
    // One command less was meant: there is one too many behind it, or in front of its end.
    let (&last, shorter) = program.split_last().unwrap();
    let moved = host.verify_end(shorter).unwrap_err();
    let end = TransferError::Different { address: 9, expected: END_MARK, found: last };
    assert_eq!(format!("{moved:?}"), format!("{end:?}"));
    let mut other = program.clone();
    other.swap(8, 9);
    let moved = host.verify_end(&other).unwrap_err();
    let differs = TransferError::Different { address: 9, expected: other[9], found: last };
    assert_eq!(format!("{moved:?}"), format!("{differs:?}"));
}
