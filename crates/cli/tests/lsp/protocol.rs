//! Beginning, end, and messages that are wrong.

use serde_json::{Value, json};

use crate::client::{Client, place};

const PARSE_ERROR: i64 = -32700;
const INVALID_REQUEST: i64 = -32600;
const METHOD_NOT_FOUND: i64 = -32601;
const INVALID_PARAMS: i64 = -32602;
const NOT_INITIALIZED: i64 = -32002;

/// A request about nothing in particular shows that the server is well.
#[track_caller]
fn assert_answers(client: &mut Client) {
    client.open("untitled:well", "MST 0\n");
    let hover = client.at("textDocument/hover", "untitled:well", 0, 0);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("MST <motor>"), "{hover}");
}

#[test]
fn the_editor_learns_what_the_server_can_do() {
    let mut client = Client::start(&["--stdio"]);
    let result = client.greet(json!({ "capabilities": {} }));
    assert_eq!(result["serverInfo"]["name"], "tmcl");
    let capabilities = &result["capabilities"];
    assert_eq!(capabilities["positionEncoding"], "utf-16");
    assert_eq!(capabilities["textDocumentSync"]["change"], 2);
    for provider in [
        "hover",
        "definition",
        "references",
        "documentHighlight",
        "documentSymbol",
        "documentFormatting",
        "inlayHint",
    ] {
        assert_eq!(capabilities[format!("{provider}Provider")], true, "{provider}");
    }
    assert_eq!(capabilities["renameProvider"]["prepareProvider"], true);
    assert_answers(&mut client);
}

#[test]
fn shutdown_and_exit_end_it_with_success() {
    let mut client = Client::new();
    assert_eq!(client.request("shutdown", Value::Null), Value::Null);
    let (code, _) = client.refused("textDocument/hover", place("untitled:a", 0, 0));
    assert_eq!(code, INVALID_REQUEST);
    client.notify("exit", Value::Null);
    let (status, errors) = client.end();
    assert_eq!((status.code(), errors.as_str()), (Some(0), ""));
}

#[test]
fn exit_without_shutdown_is_a_failure_as_the_protocol_says() {
    let mut client = Client::new();
    client.notify("exit", Value::Null);
    assert_eq!(client.end().0.code(), Some(1));
    let mut client = Client::start(&[]);
    client.notify("exit", Value::Null);
    assert_eq!(client.end().0.code(), Some(1));
}

#[test]
fn it_ends_with_its_input() {
    let (status, errors) = Client::new().hang_up();
    assert_eq!((status.code(), errors.as_str()), (Some(1), ""));
    let mut client = Client::new();
    client.request("shutdown", Value::Null);
    assert_eq!(client.hang_up().0.code(), Some(0));
    // In the middle of a message.
    let mut client = Client::new();
    client.send_bytes(b"Content-Length: 100\r\n\r\n{\"json");
    assert_eq!(client.hang_up().0.code(), Some(1));
}

#[test]
fn nothing_is_answered_before_the_greeting() {
    let mut client = Client::start(&[]);
    let (code, _) = client.refused("textDocument/hover", place("untitled:a", 0, 0));
    assert_eq!(code, NOT_INITIALIZED);
    let (code, _) = client.refused("shutdown", Value::Null);
    assert_eq!(code, NOT_INITIALIZED);
    // Notifications are dropped.
    client.open("untitled:a", "MST 0");
    client.greet(json!({ "capabilities": {} }));
    let (code, _) = client.refused("textDocument/hover", place("untitled:a", 0, 0));
    assert_eq!(code, INVALID_PARAMS);
    let (code, _) = client.refused("initialize", json!({ "capabilities": {} }));
    assert_eq!(code, INVALID_REQUEST);
    assert_answers(&mut client);
}

#[test]
fn a_greeting_that_is_wrong_can_be_repeated() {
    let mut client = Client::start(&[]);
    let (code, _) = client.refused("initialize", json!({ "capabilities": 1 }));
    assert_eq!(code, INVALID_PARAMS);
    client.greet(json!({ "capabilities": {} }));
    assert_answers(&mut client);
}

#[test]
fn what_is_not_known_is_refused_or_ignored() {
    let mut client = Client::new();
    let (code, message) = client.refused("textDocument/teleport", json!({}));
    assert_eq!(code, METHOD_NOT_FOUND);
    assert!(message.contains("textDocument/teleport"), "{message}");
    client.notify("$/setTrace", json!({ "value": "off" }));
    client.notify("$/cancelRequest", json!({ "id": 77 }));
    client.notify("workspace/teleported", json!([1, 2]));
    assert_answers(&mut client);
}

#[test]
fn wrong_parameters_are_named() {
    let mut client = Client::new();
    for params in [Value::Null, json!({}), json!([]), json!({ "textDocument": 1 })] {
        let (code, message) = client.refused("textDocument/hover", params);
        assert_eq!(code, INVALID_PARAMS);
        assert!(message.contains("textDocument/hover"), "{message}");
    }
    let (code, message) = client.refused("textDocument/hover", place("untitled:nobody", 0, 0));
    assert_eq!(code, INVALID_PARAMS);
    assert!(message.contains("untitled:nobody is not open"), "{message}");
    client.notify("textDocument/didOpen", json!({ "textDocument": "x" }));
    assert!(client.shown().contains("textDocument/didOpen"));
    client.replace("untitled:nobody", 2, "MST 0");
    client.close("untitled:nobody");
    assert_answers(&mut client);
}

#[test]
fn a_text_that_is_no_message_is_answered_and_the_next_one_read() {
    let mut client = Client::new();
    let deep = "[".repeat(100_000);
    for (text, code) in [
        ("{", PARSE_ERROR),
        ("", PARSE_ERROR),
        ("\u{FEFF}{}", PARSE_ERROR),
        (&*deep, PARSE_ERROR),
        ("[]", INVALID_REQUEST),
        ("17", INVALID_REQUEST),
        ("{\"jsonrpc\":\"2.0\"}", INVALID_REQUEST),
        ("{\"jsonrpc\":\"2.0\",\"id\":1.5,\"method\":\"shutdown\"}", INVALID_REQUEST),
        ("{\"jsonrpc\":\"2.0\",\"id\":{},\"method\":\"shutdown\"}", INVALID_REQUEST),
    ] {
        client.send_text(text);
        let answer =
            client.wait_for(|message| message["id"].is_null() && !message["error"].is_null());
        assert_eq!(answer["error"]["code"], code, "{text:.40}");
    }
    client.send_text("{\"jsonrpc\":\"2.0\",\"id\":\"x\",\"method\":5}");
    let answer = client.wait_for(|message| message["id"] == "x");
    assert_eq!(answer["error"]["code"], INVALID_REQUEST);
    client.send_bytes(b"Content-Length: 2\r\n\r\n\xFF\xFE");
    client.wait_for(|message| message["error"]["code"] == PARSE_ERROR);
    // A response to a question that was never asked.
    client.send_text("{\"jsonrpc\":\"2.0\",\"id\":99,\"result\":null}");
    assert_answers(&mut client);
}

#[test]
fn headers_are_read_as_editors_write_them() {
    let mut client = Client::new();
    let text = json!({ "jsonrpc": "2.0", "id": "a", "method": "shutdown" }).to_string();
    let kind = "Content-Type: application/vscode-jsonrpc; charset=utf-8";
    let header = format!("{kind}\r\ncontent-length:{}\r\n\r\n{text}", text.len());
    client.send_bytes(header.as_bytes());
    let answer = client.wait_for(|message| message["id"] == "a");
    assert_eq!(answer["result"], Value::Null);
}

#[test]
fn what_cannot_be_followed_ends_it_with_a_word_about_it() {
    let long = [b'x'; 10_000];
    for (bytes, part) in [
        (&b"MST 0\r\n"[..], "no header of a message: \"MST 0"),
        (&b"\r\n"[..], "without Content-Length"),
        (&b"Content-Length: many\r\n"[..], "Content-Length must be a number"),
        (&b"Content-Length: 99999999999999\r\n"[..], "Content-Length must be a number"),
        (&b"Content-Length: -1\r\n"[..], "Content-Length must be a number"),
        (&long[..], "no header of a message"),
    ] {
        let mut client = Client::start(&[]);
        client.send_bytes(bytes);
        let (status, errors) = client.end();
        assert_eq!(status.code(), Some(1), "{errors}");
        assert!(errors.contains(part), "{errors}");
    }
}

#[test]
fn a_wrong_module_on_the_command_line_is_wrong_usage() {
    let (status, errors) = Client::start(&["--module", "tmcm-6241"]).end();
    assert_eq!(status.code(), Some(2));
    assert!(errors.contains("did you mean tmcm-6214?"), "{errors}");
}
