//! What is wrong, told without being asked.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::client::{Client, Folder, shown};

const URI: &str = "untitled:findings";

#[test]
fn a_finding_says_where_what_and_how_to_mend_it() {
    let mut client = Client::new();
    client.open(URI, "Loop: MST 0\nLoop: MST 1\n  JA Lop // no\n");
    let findings = client.findings(URI);
    let [second, unknown] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!(shown(&second["range"]), "1:0-1:4");
    assert_eq!(second["code"], "duplicate-label");
    assert_eq!((&second["severity"], &second["source"]), (&json!(1), &json!("tmcl")));
    let related = &second["relatedInformation"][0];
    assert_eq!(related["location"]["uri"], URI);
    assert_eq!(shown(&related["location"]["range"]), "0:0-0:4");
    assert_eq!(shown(&unknown["range"]), "2:5-2:8");
    let message = unknown["message"].as_str().unwrap();
    assert!(message.contains("there is no label Lop\nhelp: did you mean Loop?"), "{message}");
}

#[test]
fn code_that_is_never_reached_is_marked_as_such() {
    let mut client = Client::new();
    client.open(URI, "Loop: MST 0\nJA Loop\nMST 1\n");
    let findings = client.findings(URI);
    let found = findings.iter().find(|finding| finding["code"] == "unreachable-code").unwrap();
    assert_eq!((&found["severity"], &found["tags"]), (&json!(2), &json!([1])));
    assert_eq!(found["range"]["start"]["line"], 2);
}

#[test]
fn findings_need_the_module_and_comments_silence_them() {
    // The TMCM-6214 has no STAP.
    let mut client = Client::greeted(Value::Null);
    client.open(URI, "STAP 4, 0\nSTOP\n");
    assert_eq!(client.codes(URI), [""; 0]);
    client.replace(URI, 2, "// module: tmcm-6214\nSTAP 4, 0\nSTOP\n");
    assert_eq!(client.codes(URI), ["1:0-1:4 no-such-command"]);
    client.replace(
        URI,
        3,
        "// module: tmcm-6214\nSTAP 4, 0 // tmcl-allow: no-such-command\nSTOP\n",
    );
    assert_eq!(client.codes(URI), [""; 0]);
}

#[test]
fn findings_follow_the_text_and_go_with_it() {
    let mut client = Client::new();
    client.open(URI, "XYZ\n");
    assert_eq!(client.codes(URI), ["0:0-0:3 unknown-command"]);
    client.replace(URI, 2, "\nXYZ\n");
    let told = client.wait_for(|message| message["method"] == "textDocument/publishDiagnostics");
    assert_eq!(told["params"]["version"], 2);
    assert_eq!(shown(&told["params"]["diagnostics"][0]["range"]), "1:0-1:3");
    client.replace(URI, 3, "STOP\n");
    assert_eq!(client.codes(URI), [""; 0]);
    client.replace(URI, 4, "XYZ\n");
    assert_eq!(client.codes(URI).len(), 1);
    client.close(URI);
    assert_eq!(client.codes(URI), [""; 0]);
}

#[test]
fn included_files_have_findings_of_their_own() {
    let folder = Folder::new(&[("main.tmc", ""), ("lib.inc", "Good = 1\nBad = 1 / 0\nSTOP\n")]);
    let (main, lib) = (folder.uri("main.tmc"), folder.uri("lib.inc"));
    let mut client = Client::new();
    client.open(&main, "#include lib.inc\nMST Good\n");
    assert_eq!(client.codes(&lib), ["1:6-1:11 undefined-value"]);
    assert_eq!(client.codes(&main), [""; 0]);

    // What is open in the editor counts, saved or not.
    client.open(&lib, "Good = 1\n");
    assert_eq!(client.codes(&lib), [""; 0]);
    client.replace(&lib, 2, "Better = 1\n");
    assert_eq!(client.codes(&lib), [""; 0]);
    assert_eq!(client.codes(&main), ["1:4-1:8 unknown-constant"]);
    client.replace(&lib, 3, "Good = 1\n");
    assert_eq!(client.codes(&lib), [""; 0]);
    assert_eq!(client.codes(&main), [""; 0]);

    // Closed, the file on disk counts again, until nobody includes it.
    client.close(&lib);
    assert_eq!(client.codes(&lib), ["1:6-1:11 undefined-value"]);
    client.close(&main);
    assert_eq!(client.codes(&lib), [""; 0]);
}

#[test]
fn a_file_that_is_included_twice_is_told_of_once() {
    let folder = Folder::new(&[("main.tmc", ""), ("lib.inc", "Bad = 1 / 0\n")]);
    let mut client = Client::new();
    client.open(&folder.uri("main.tmc"), "#include lib.inc\n#include lib.inc\nSTOP\n");
    assert_eq!(client.codes(&folder.uri("lib.inc")), ["0:6-0:11 undefined-value"]);
}

#[test]
fn an_included_file_is_looked_at_in_the_program_that_includes_it() {
    let folder = Folder::new(&[("main.tmc", ""), ("a-part.inc", "")]);
    let (main, part) = (folder.uri("main.tmc"), folder.uri("a-part.inc"));
    let mut client = Client::new();
    client.open(&part, "Turn: MVP REL, 0, Step\nRSUB\n");
    assert_eq!(client.codes(&part), ["0:18-0:22 unknown-constant"]);
    client.open(&main, "Step = 200\nCSUB Turn\nSTOP\n#include a-part.inc\n");
    assert_eq!(client.codes(&part), [""; 0]);
    let hover = client.at("textDocument/hover", &part, 0, 19);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("Step = 200"));
    let found = client.at("textDocument/definition", &part, 0, 19);
    assert_eq!(found["uri"], main);
    client.close(&main);
    assert_eq!(client.codes(&part).len(), 1);
}

#[test]
fn files_that_include_each_other_are_told_once_and_answered() {
    let folder =
        Folder::new(&[("a.tmc", "#include b.tmc\n"), ("b.tmc", "#include a.tmc\nMST 0\n")]);
    let (a, b) = (folder.uri("a.tmc"), folder.uri("b.tmc"));
    let mut client = Client::new();
    client.open(&a, "#include b.tmc\n");
    assert_eq!(client.codes(&b), ["0:9-0:14 circular-include"]);
    client.open(&b, "#include a.tmc\nMST 0\n");
    for (uri, line) in [(&a, 0), (&b, 1)] {
        let hover = client.at("textDocument/hover", uri, line, 1);
        assert_eq!(hover.is_null(), *uri == a, "{hover}");
    }
}

#[test]
fn one_file_under_two_names_is_one() {
    let folder = Folder::new(&[("sub/main.tmc", ""), ("Lib.inc", "Step = 1\n")]);
    let (main, lib) = (folder.uri("sub/main.tmc"), folder.uri("Lib.inc"));
    let mut client = Client::new();
    client.open(&main, "#include ..\\LIB.INC\nMST Step\n");
    assert_eq!(client.codes(&main), [""; 0]);
    let found = client.at("textDocument/definition", &main, 1, 5);
    assert_eq!(found["uri"], lib);
    client.open(&lib, "Leap = 1\n");
    assert_eq!(client.codes(&main), ["1:4-1:8 unknown-constant"]);
}

#[test]
fn a_file_that_was_never_saved_can_be_included() {
    let folder = Folder::new(&[("main.tmc", "")]);
    let (main, new) = (folder.uri("main.tmc"), folder.uri("new.inc"));
    let mut client = Client::new();
    client.open(&main, "#include new.inc\nMST Axis\n");
    assert_eq!(client.codes(&main).len(), 2);
    client.open(&new, "Axis = 1\n");
    assert_eq!(client.codes(&main), [""; 0]);
}

#[test]
fn a_change_on_disk_is_noticed_when_the_editor_tells_it() {
    let folder = Folder::new(&[("main.tmc", ""), ("lib.inc", "A = 1\n")]);
    let main = folder.uri("main.tmc");
    let mut client = Client::start(&[]);
    let watching = json!({ "didChangeWatchedFiles": { "dynamicRegistration": true } });
    client.greet(json!({ "capabilities": { "workspace": watching } }));
    let asked = client.wait_for(|message| message["method"] == "client/registerCapability");
    let registration = &asked["params"]["registrations"][0];
    assert_eq!(registration["method"], "workspace/didChangeWatchedFiles");
    client.send_text(&json!({ "jsonrpc": "2.0", "id": asked["id"], "result": null }).to_string());
    client.open(&main, "#include lib.inc\nMST A\n");
    assert_eq!(client.codes(&main), [""; 0]);
    folder.write("lib.inc", "B = 1\n");
    let changes = json!({ "changes": [{ "uri": folder.uri("lib.inc"), "type": 2 }] });
    client.notify("workspace/didChangeWatchedFiles", changes);
    assert_eq!(client.codes(&main), ["1:4-1:5 unknown-constant"]);
}

#[test]
fn a_full_memory_is_quick_at_every_key() {
    // As much as the module can hold with the STOP at the end, and a hundred keys at once.
    let program = "SAP 4, 0, 51200 // speed\n".repeat(2047);
    let mut client = Client::new();
    client.open(URI, &program);
    assert_eq!(client.codes(URI), [""; 0]);
    let start = Instant::now();
    let key = |line: u32, column: u32, text: &str| {
        let place = json!({ "line": line, "character": column });
        json!([{ "range": { "start": place, "end": place }, "text": text }])
    };
    for version in 2..102 {
        client.change(URI, version, key(2046, 0, "X"));
    }
    let hover = client.at("textDocument/hover", URI, 2045, 5);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("Maximum positioning speed"));
    let told = client.wait_for(|message| message["params"]["version"] == 101);
    let range = &told["params"]["diagnostics"][0]["range"];
    assert_eq!(shown(range), "2046:0-2046:103");
    // A hundredth of it would do on an idle machine.
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
}

#[test]
fn a_name_with_a_blank_is_told_under_the_uri_that_the_editor_uses() {
    let folder = Folder::new(&[("my lib.inc", "X\n"), ("a.tmc", "")]);
    let uri = folder.uri("a.tmc");
    let mut client = Client::new();
    client.open(&uri, "#include my lib.inc\n");
    let lib: Value = folder.uri("my%20lib.inc").into();
    assert_eq!(client.codes(lib.as_str().unwrap()), ["0:0-0:1 unknown-command"]);
    let odd = folder.uri("my%20li%62.inc");
    client.open(&odd, "Y\n");
    assert_eq!(client.codes(&odd), ["0:0-0:1 unknown-command"]);
}
