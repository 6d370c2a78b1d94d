//! Any keys at a terminal: every line for the module is answered once, others never; what is echoed is the
//! line; what is read prints as text that reads the same.
//!
//! Input: the address of the module, global parameter 67, then keys.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_wire::ascii::{
    ECHO_MAX, Echo, LINE_MAX, LineEditor, REPLY_MAX, Request, encode_reply, letter, parse_line,
};
use opentmcl_wire::{Reply, Status, opcode};

fuzz_target!(|input: &[u8]| {
    let [address, parameter, ref keys @ ..] = *input else {
        return;
    };
    let echo = Echo::from_parameter(parameter.into());
    let mut editor = LineEditor::new();
    // The line by the rules alone, and what the terminal shows of it.
    let (mut line, mut screen) = (Vec::new(), Vec::new());
    for &key in keys {
        let mine = is_for(&line, address);
        let typed = editor.push(key, address, echo);
        assert!(typed.echo.len() <= ECHO_MAX);
        match key {
            b'\r' | b'\n' => {
                assert_eq!(typed.request.is_some(), mine);
                assert_eq!(typed.request, parse_line(&line, address));
                let expected = match echo {
                    Echo::Characters if mine => b"\r".to_vec(),
                    Echo::Line if mine => [&line[..line.len().min(LINE_MAX + 1)], b"\r"].concat(),
                    _ => Vec::new(),
                };
                assert_eq!(typed.echo, expected);
                if let Some(request) = typed.request {
                    check(request, line.len(), address);
                }
                line.clear();
                screen.clear();
            }
            _ => {
                match key {
                    0x08 | 0x7F => drop(line.pop()),
                    b' ' if line.is_empty() => {}
                    b' '.. => line.push(key),
                    _ => {}
                }
                assert_eq!(typed.request, None);
                match typed.echo {
                    b"\x08 \x08" => assert!(screen.pop().is_some(), "backspace over the edge"),
                    text => screen.extend_from_slice(text),
                }
                let shown = echo == Echo::Characters && is_for(&line, address);
                assert_eq!(screen, if shown { &line[..] } else { b"" });
            }
        }
    }
});

fn is_for(line: &[u8], address: u8) -> bool {
    line.first().is_some_and(|first| letter(address) == Some(first.to_ascii_uppercase()))
}

fn check(request: Result<Request, Status>, line_len: usize, address: u8) {
    let reply = match request {
        Err(status) => {
            assert!((2..=4).contains(&status.0), "{status}");
            Reply { status, number: 0, value: 0 }
        }
        Ok(request) => {
            assert!(line_len <= LINE_MAX);
            let Request::Command(command) = request else {
                return;
            };
            let form = opcode::form(command.number);
            if form.is_some_and(|form| form.shows_all_of(command)) {
                let letter = letter(address).expect("a module that is meant has a letter");
                let printed = format!("{}{command}", char::from(letter));
                assert_eq!(parse_line(printed.as_bytes(), address), Some(Ok(request)), "{printed}");
            }
            Reply { status: Status::OK, number: command.number, value: command.value }
        }
    };
    let text = encode_reply(2, address, reply);
    assert!(text.as_bytes().len() <= REPLY_MAX);
    let numbers = format!(" {} {}\r", reply.status.0, reply.value);
    assert_eq!(&text.as_bytes()[2..], numbers.as_bytes());
}
