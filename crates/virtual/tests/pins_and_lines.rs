//! What goes out by the pins and lines of a module, which no command reads back.

use opentmcl_firmware::{Analog, Board, Config, Module};
use opentmcl_virtual::{Line, MemoryFlash, Port, VirtualBoard, VirtualModule};
use opentmcl_wire::{Command, Duration, Instant, mnemonic, serial};

fn millis(time: u64) -> Instant {
    Instant::from_ticks(time * 16_000)
}

fn command(text: &str) -> Command {
    mnemonic::parse(text).unwrap()
}

fn new_module() -> VirtualModule {
    VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap())
}

fn execute(module: &mut VirtualModule, text: &str) -> i32 {
    let reply = module.execute(command(text));
    assert_eq!(reply.status.0, 100, "{text}");
    reply.value
}

#[test]
fn outputs_follow_sio_and_are_off_after_a_reset() {
    let mut module = new_module();
    execute(&mut module, "SIO 0, 2, 1");
    execute(&mut module, "SIO 7, 2, 1");
    assert_eq!(module.board().digital_outputs(), 0b1000_0001);
    execute(&mut module, "SIO 0, 2, 0");
    assert_eq!(module.board().digital_outputs(), 0b1000_0000);
    execute(&mut module, "SIO 255, 2, 85");
    assert_eq!(module.board().digital_outputs(), 0b0101_0101);
    module.power_cycle();
    assert_eq!(module.board().digital_outputs(), 0);
}

#[test]
fn pull_ups_are_on_at_first_and_follow_sio() {
    // Firmware manual 3.6.12: bit 0 for the motors 0 to 2, bit 1 for 3 to 5.
    let mut module = new_module();
    assert_eq!(module.board().pull_ups(), 3);
    for groups in [0, 1, 2] {
        execute(&mut module, &format!("SIO 0, 0, {groups}"));
        assert_eq!(i32::from(module.board().pull_ups()), groups);
    }
    module.power_cycle();
    assert_eq!(module.board().pull_ups(), 3);
}

#[test]
fn each_analog_input_has_its_own_range() {
    let mut module = new_module();
    execute(&mut module, "SIO 0, 1, 2");
    execute(&mut module, "SIO 4, 1, 1");
    assert_eq!((module.board().analog_range(0), module.board().analog_range(4)), (2, 1));
    execute(&mut module, "SIO 0, 1, 0");
    assert_eq!((module.board().analog_range(0), module.board().analog_range(4)), (0, 1));
}

#[test]
fn an_input_keeps_its_level_when_it_is_set_again_and_converters_end_at_4095() {
    let mut module = new_module();
    for _ in 0..2 {
        module.set_digital_input(3, true);
        assert_eq!(execute(&mut module, "GIO 3, 0"), 1);
    }
    module.board_mut().set_analog_input(4, 5000);
    assert_eq!(execute(&mut module, "GIO 4, 1"), 4095);
    assert_eq!(execute(&mut module, "GIO 0, 1"), 0);
    // Nothing draws current, and the board is not at 0 °C.
    assert_eq!(execute(&mut module, "GIO 10, 1"), 0);
}

/// Sends `SGP variable, 2, 0` by a line; the reply names nothing but its port and value.
fn request(module: &mut VirtualModule, line: Line, value: i32) {
    let command = Command::new(9, 0, 2, value);
    module.receive(Port::new(line), Ok(serial::Request { address: 1, command }));
}

/// The lines and values of all replies that have come.
fn replies(module: &mut VirtualModule) -> Vec<(Line, i32)> {
    std::iter::from_fn(|| module.transmit())
        .map(|(port, content)| (port, content.frame().unwrap()))
        .map(|(port, frame)| (port.line, serial::decode_reply(frame).unwrap().reply.value))
        .collect()
}

#[test]
fn replies_behind_the_telegram_pause_leave_in_the_order_of_their_requests() {
    let mut module = new_module();
    execute(&mut module, "SGP 75, 0, 10");
    request(&mut module, Line::Rs485, 1);
    module.advance_to(millis(5));
    request(&mut module, Line::Rs485, 2);
    assert_eq!(replies(&mut module), []);
    module.advance_to(millis(10));
    assert_eq!(replies(&mut module), [(Line::Rs485, 1)]);
    module.advance_to(millis(12));
    request(&mut module, Line::Rs485, 3);
    module.advance_to(millis(30));
    assert_eq!(replies(&mut module), [(Line::Rs485, 2), (Line::Rs485, 3)]);
}

#[test]
fn a_line_without_pause_does_not_wait_for_one_with_a_pause() {
    let mut module = new_module();
    execute(&mut module, "SGP 75, 0, 10");
    request(&mut module, Line::Rs485, 1);
    request(&mut module, Line::Usb, 2);
    assert_eq!(module.next_event(), Some(millis(0)));
    assert_eq!(replies(&mut module), [(Line::Usb, 2)]);
    assert_eq!(module.next_event(), Some(millis(10)));
    module.advance(Duration::from_millis(10));
    assert_eq!(replies(&mut module), [(Line::Rs485, 1)]);
}

#[test]
fn a_power_cycle_loses_the_replies_on_their_way() {
    let mut module = new_module();
    execute(&mut module, "SGP 75, 0, 10");
    request(&mut module, Line::Rs485, 1);
    module.power_cycle();
    module.advance_to(millis(100));
    assert_eq!(replies(&mut module), []);
}

/// A virtual board with a switch and torque inputs that a test can operate.
struct Wired {
    board: VirtualBoard,
    home: bool,
    torque: u8,
}

impl Board for Wired {
    type Flash = MemoryFlash;
    fn set_time(&mut self, now: Instant) {
        self.board.set_time(now);
    }
    fn next_event(&mut self) -> Option<Instant> {
        self.board.next_event()
    }
    fn read_register(&mut self, axis: u8, address: u8) -> u32 {
        self.board.read_register(axis, address)
    }
    fn write_register(&mut self, axis: u8, address: u8, value: u32) {
        self.board.write_register(axis, address, value);
    }
    fn digital_inputs(&mut self) -> u8 {
        self.board.digital_inputs()
    }
    fn home_switch(&mut self, axis: u8) -> bool {
        self.home && axis == 2
    }
    fn torque_inputs(&mut self) -> u8 {
        self.torque
    }
    fn analog(&mut self, channel: Analog) -> i32 {
        self.board.analog(channel)
    }
    fn set_analog_range(&mut self, input: u8, range: u8) {
        self.board.set_analog_range(input, range);
    }
    fn set_digital_outputs(&mut self, levels: u8) {
        self.board.set_digital_outputs(levels);
    }
    fn set_pull_ups(&mut self, groups: u8) {
        self.board.set_pull_ups(groups);
    }
    fn flash(&mut self) -> &mut MemoryFlash {
        self.board.flash()
    }
    fn reset(&mut self) {
        self.board.reset();
    }
}

fn wired_module() -> Module<Wired> {
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    let board = VirtualBoard::new(model, MemoryFlash::new());
    let board = Wired { board, home: false, torque: 3 };
    Module::power_up(model, board, Config::default(), millis(0))
}

/// The value of the reply to a command at a time.
fn ask(module: &mut Module<Wired>, text: &str, time: u64) -> i32 {
    match module.execute_direct(command(text), millis(time)) {
        opentmcl_firmware::Answer::Reply(reply) => reply.value,
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn torque_is_enabled_by_both_inputs_together() {
    // Firmware manual 3.6.13: GIO 10 tells whether torque is on, 13 and 14 are the two inputs.
    let mut module = wired_module();
    for (torque, enabled) in [(3, 1), (1, 0), (2, 0), (0, 0)] {
        module.board_mut().torque = torque;
        assert_eq!(ask(&mut module, "GIO 10, 0", 0), enabled, "inputs {torque}");
    }
}

#[test]
fn a_wait_for_the_home_switch_ends_when_its_pin_changes() {
    let mut module = wired_module();
    let program = ["WAIT REFSW, 2, 0", "SGP 0, 2, 1", "STOP"];
    ask(&mut module, "132 0, 0, 0", 0);
    for line in program {
        ask(&mut module, line, 0);
    }
    ask(&mut module, "133 0, 0, 0", 0);
    ask(&mut module, "129 1, 0, 0", 0);
    assert_eq!(ask(&mut module, "GAP 9, 2", 500), 0);
    assert_eq!(ask(&mut module, "GGP 0, 2", 500), 0);
    module.board_mut().home = true;
    module.hardware_changed(millis(600));
    assert_eq!(ask(&mut module, "GGP 0, 2", 601), 1);
    assert_eq!(ask(&mut module, "GAP 9, 2", 601), 1);
}
