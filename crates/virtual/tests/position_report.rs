//! Command 138 promises two replies: at once, and when the motor is there. They come in that order.

use opentmcl_virtual::{Line, Port, VirtualModule};
use opentmcl_wire::{Command, Duration, mnemonic, serial};

fn command(text: &str) -> Command {
    mnemonic::parse(text).unwrap()
}

/// Sends commands and gives status, number and value of each frame that comes by then.
fn replies(module: &mut VirtualModule, line: Line, commands: &[&str]) -> Vec<(u8, u8, i32)> {
    for text in commands {
        let request = serial::Request { address: 1, command: command(text) };
        module.receive(Port::new(line), Ok(request));
    }
    let mut frames = Vec::new();
    module.advance(Duration::from_millis(100));
    while let Some((port, content)) = module.transmit() {
        assert_eq!(port.line, line);
        let reply = serial::decode_reply(content.frame().unwrap()).unwrap().reply;
        frames.push((reply.status.0, reply.number, reply.value));
    }
    frames
}

#[test]
fn a_move_to_where_the_motor_stands_is_answered_before_its_arrival_is_reported() {
    for line in [Line::Usb, Line::Rs485] {
        let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
        module.execute(command("SGP 75, 0, 20"));
        assert_eq!(
            replies(&mut module, line, &["138 1, 0, 1", "MVP ABS, 0, 0"]),
            [(100, 138, 1), (100, 4, 0), (128, 138, 1)]
        );
    }
}

#[test]
fn a_position_that_becomes_the_target_is_an_arrival() {
    let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
    let begun = ["138 0, 0, 2", "MVP ABS, 1, 512000"];
    assert_eq!(
        replies(&mut module, Line::Usb, &begun),
        [(100, 138, 2), (100, 4, 512_000)],
        "still on its way"
    );
    assert_eq!(
        replies(&mut module, Line::Usb, &["SAP 1, 1, 512000"]),
        [(100, 5, 512_000), (128, 138, 2)]
    );
}
