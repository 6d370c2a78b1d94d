//! What the user sets in the editor.

use serde_json::{Value, json};

use crate::client::{Client, Folder};

const URI: &str = "untitled:settings";

/// Whether the names of parameters are known, which needs a module.
#[track_caller]
fn knows_parameters(client: &mut Client) -> bool {
    let hover = client.at("textDocument/hover", URI, 0, 4);
    hover["contents"]["value"].as_str().unwrap().contains("Maximum positioning speed")
}

#[test]
fn the_module_comes_from_the_editor_and_can_change() {
    let mut client = Client::greeted(Value::Null);
    client.open(URI, "SAP 4, 0, 1\n");
    assert!(!knows_parameters(&mut client));
    let set = |module: Value| json!({ "settings": { "opentmcl": { "module": module } } });
    client.notify("workspace/didChangeConfiguration", set(json!("tmcm-6214")));
    assert!(knows_parameters(&mut client));
    client.notify("workspace/didChangeConfiguration", set(Value::Null));
    assert!(!knows_parameters(&mut client));
    client.notify("workspace/didChangeConfiguration", set(json!("tmcm-1")));
    let message = client.shown();
    assert!(message.contains("tmcm-1") && message.contains("tmcm-6214"), "{message}");
    client.notify("workspace/didChangeConfiguration", json!({ "settings": null }));
    assert!(!knows_parameters(&mut client));
}

#[test]
fn the_module_comes_from_the_command_line_or_from_the_program() {
    let mut client = Client::start(&["--module", "TMCM-6214"]);
    client.greet(json!({ "capabilities": {} }));
    client.open(URI, "SAP 4, 0, 1\n");
    assert!(knows_parameters(&mut client));
    let mut client = Client::greeted(Value::Null);
    client.open(URI, "SAP 4, 0, 1 // note\n// module: tmcm-6214\n");
    assert!(knows_parameters(&mut client));
}

#[test]
fn include_folders_are_looked_through_behind_the_own_one() {
    let folder = Folder::new(&[
        ("main/a.tmc", ""),
        ("main/near.inc", "Near = 1\n"),
        ("lib/near.inc", "Near = 2\n"),
        ("lib/far.inc", "Far = 3\n"),
    ]);
    let main = folder.uri("main/a.tmc");
    let text = "#include near.inc\n#include far.inc\nMVP ABS, Near, Far\n";
    let mut client = Client::start(&[]);
    client.greet(json!({
        "capabilities": {},
        "workspaceFolders": [{ "uri": folder.uri(""), "name": "all" }],
        "initializationOptions": { "includePaths": ["lib"] },
    }));
    client.open(&main, text);
    assert_eq!(client.codes(&main), [""; 0]);
    let found = client.at("textDocument/definition", &main, 2, 10);
    assert_eq!(found["uri"], folder.uri("main/near.inc"));
    let found = client.at("textDocument/definition", &main, 2, 16);
    assert_eq!(found["uri"], folder.uri("lib/far.inc"));

    let lib = format!("{}/lib", folder.path());
    let mut client = Client::start(&["-I", &lib]);
    client.greet(json!({ "capabilities": {} }));
    client.open(URI, text);
    assert_eq!(client.codes(URI), [""; 0]);
}
