//! Every question that an editor can ask.

use serde_json::{Value, json};

use crate::client::{Client, Folder, place, shown};

const URI: &str = "untitled:features";

const PROGRAM: &str = "\
#include TMCLParam.tmc
Speed = 2 * 25600 // two turns
Start: ROR Motor0, Speed
  SAP 4, 0, Speed
  JA start
";

fn open(text: &str) -> Client {
    let mut client = Client::new();
    client.open(URI, text);
    client
}

fn strings(values: &Value, of: impl Fn(&Value) -> String) -> Vec<String> {
    values.as_array().unwrap().iter().map(of).collect()
}

fn document() -> Value {
    json!({ "textDocument": { "uri": URI } })
}

#[test]
fn proposals_replace_the_word_that_is_being_written() {
    let mut client = open("SAP max, 0, 1\n");
    let items = client.at("textDocument/completion", URI, 0, 7);
    let items = items.as_array().unwrap();
    let speed = items.iter().find(|item| item["label"] == "max_positioning_speed").unwrap();
    assert_eq!(speed["textEdit"]["newText"], "4");
    assert_eq!(shown(&speed["textEdit"]["range"]), "0:4-0:7");
    assert_eq!(speed["detail"], "axis parameter 4: 0..7999774 pps");
    assert_eq!(speed["documentation"]["kind"], "markdown");
    assert!(speed["filterText"].as_str().unwrap().starts_with("max_positioning_speed"));
    // The first proposal is the first in the list.
    let texts: Vec<_> = items.iter().map(|item| item["sortText"].as_str().unwrap()).collect();
    assert!(texts.is_sorted());
}

#[test]
fn a_blank_asks_for_operands_and_not_for_commands() {
    let mut client = open("  \nMVP \n");
    let mut asked = |line: u32, column: u32| {
        let mut params = place(URI, line, column);
        params["context"] = json!({ "triggerKind": 2, "triggerCharacter": " " });
        client.request("textDocument/completion", params)
    };
    assert_eq!(asked(0, 2), Value::Null);
    assert_eq!(strings(&asked(1, 4), |item| item["label"].to_string())[0], "\"ABS\"");
}

#[test]
fn included_files_are_proposed_from_disk() {
    let folder = Folder::new(&[("a.tmc", ""), ("b.inc", ""), ("c.TMC", ""), ("d.txt", "")]);
    let uri = folder.uri("a.tmc");
    let mut client = Client::new();
    client.open(&uri, "#include \n");
    let items = client.at("textDocument/completion", &uri, 0, 9);
    let labels = strings(&items, |item| item["label"].as_str().unwrap().to_owned());
    assert_eq!(labels[0], "TMCLParam.tmc");
    assert_eq!(labels[labels.len() - 2..], ["b.inc", "c.TMC"]);
}

#[test]
fn hovering_explains() {
    let mut client = open(PROGRAM);
    let hover = client.at("textDocument/hover", URI, 3, 6);
    assert_eq!(hover["contents"]["kind"], "markdown");
    assert!(hover["contents"]["value"].as_str().unwrap().contains("Maximum positioning speed"));
    assert_eq!(shown(&hover["range"]), "3:6-3:7");
    assert_eq!(client.at("textDocument/hover", URI, 99, 0), Value::Null);
}

#[test]
fn definitions_are_jumped_to_where_there_is_a_file() {
    let mut client = open(PROGRAM);
    let found = client.at("textDocument/definition", URI, 4, 6);
    assert_eq!((found["uri"].as_str(), shown(&found["range"])), (Some(URI), "2:0-2:5".into()));
    // The built-in file is not on disk; what is defined there is shown.
    assert_eq!(client.at("textDocument/definition", URI, 2, 12), Value::Null);
    let hover = client.at("textDocument/hover", URI, 2, 12);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("Defined in TMCLParam.tmc"));
}

#[test]
fn uses_are_found_with_and_without_the_definition() {
    let mut client = open(PROGRAM);
    let mut uses = |with: bool| {
        let mut params = place(URI, 2, 20);
        params["context"] = json!({ "includeDeclaration": with });
        let found = client.request("textDocument/references", params);
        strings(&found, |it| shown(&it["range"]))
    };
    assert_eq!(uses(true), ["1:0-1:5", "2:19-2:24", "3:12-3:17"]);
    assert_eq!(uses(false), ["2:19-2:24", "3:12-3:17"]);
    let found = client.at("textDocument/documentHighlight", URI, 1, 0);
    let seen = strings(&found, |it| format!("{} {}", shown(&it["range"]), it["kind"]));
    // 3 is writing, 2 is reading.
    assert_eq!(seen, ["1:0-1:5 3", "2:19-2:24 2", "3:12-3:17 2"]);
}

#[test]
fn a_name_is_changed_in_all_files() {
    let folder = Folder::new(&[("a.tmc", ""), ("b.inc", "STEP = 1\n")]);
    let (a, b) = (folder.uri("a.tmc"), folder.uri("b.inc"));
    let mut client = Client::new();
    client.open(&a, "#include b.inc\nMVP REL, 0, Step\n");
    let found = client.at("textDocument/prepareRename", &a, 1, 13);
    assert_eq!(
        (shown(&found["range"]), &found["placeholder"]),
        ("1:12-1:16".into(), &json!("Step"))
    );
    let mut params = place(&a, 1, 13);
    params["newName"] = json!("Turn");
    let edit = client.request("textDocument/rename", params.clone());
    let edits = |uri: &str| {
        strings(&edit["changes"][uri], |it| format!("{} {}", shown(&it["range"]), it["newText"]))
    };
    assert_eq!(edits(&a), ["1:12-1:16 \"Turn\""]);
    assert_eq!(edits(&b), ["0:0-0:4 \"Turn\""]);
    params["newName"] = json!("two words");
    let (code, message) = client.refused("textDocument/rename", params);
    // RequestFailed: the parameters are well, the wish is not.
    assert_eq!(code, -32803);
    assert!(message.contains("\"two words\" is not a name"), "{message}");
    assert_eq!(client.at("textDocument/prepareRename", &a, 1, 0), Value::Null);
    client.replace(&a, 2, "#include TMCLParam.tmc\nMST Motor1\n");
    let (code, message) = client.refused("textDocument/prepareRename", place(&a, 1, 5));
    assert_eq!(code, -32803);
    assert!(message.contains("TMCLParam.tmc, which comes with the tools"), "{message}");
}

#[test]
fn the_outline_lists_what_is_defined() {
    let mut client = open(PROGRAM);
    let symbols = client.request("textDocument/documentSymbol", document());
    let seen = strings(&symbols, |it| {
        let (name, detail) = (it["name"].as_str().unwrap(), it["detail"].as_str());
        format!("{name} {} {} {}", detail.unwrap_or("-"), shown(&it["range"]), it["kind"])
    });
    // 1 file, 14 constant, 12 function.
    assert_eq!(
        seen,
        ["TMCLParam.tmc - 0:0-0:22 1", "Speed 51200 1:0-1:17 14", "Start address 0 2:0-4:10 12",]
    );
    for symbol in symbols.as_array().unwrap() {
        assert!(!shown(&symbol["selectionRange"]).is_empty());
    }
}

#[test]
fn every_token_has_a_type_of_the_legend() {
    let mut client = Client::start(&[]);
    let result = client.greet(json!({ "capabilities": {} }));
    let legend = &result["capabilities"]["semanticTokensProvider"]["legend"];
    client.open(URI, "L: MVP ABS, 0, 5 // x\n");
    let tokens = client.request("textDocument/semanticTokens/full", document());
    let data: Vec<u64> =
        tokens["data"].as_array().unwrap().iter().map(|it| it.as_u64().unwrap()).collect();
    let kinds: Vec<_> = data
        .chunks(5)
        .map(|it| legend["tokenTypes"][it[3] as usize].as_str().unwrap())
        .filter(|&kind| kind != "operator")
        .collect();
    assert_eq!(kinds, ["function", "keyword", "enumMember", "number", "number", "comment"]);
    assert_eq!(legend["tokenModifiers"], json!(["definition"]));
    // Only the label is defined here.
    let defined: Vec<_> = data.chunks(5).map(|it| it[4]).collect();
    assert_eq!(defined, [1, 0, 0, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn hints_name_parameters_and_addresses_of_the_lines_that_are_seen() {
    let mut client = open(PROGRAM);
    let mut hints = |first: u32, last: u32| {
        let start = json!({ "line": first, "character": 0 });
        let end = json!({ "line": last, "character": 0 });
        let mut params = document();
        params["range"] = json!({ "start": start, "end": end });
        let found = client.request("textDocument/inlayHint", params);
        strings(&found, |it| {
            let place = &it["position"];
            format!("{}:{} {}", place["line"], place["character"], it["label"].as_str().unwrap())
        })
    };
    assert_eq!(hints(0, 4), ["2:6 @0", "3:6 maximum positioning speed:"]);
    assert_eq!(hints(3, 3), ["3:6 maximum positioning speed:"]);
}

#[test]
fn formatting_touches_only_lines_that_change() {
    let mut client = open("Loop:    mst 0\nSTOP\n");
    let mut params = document();
    params["options"] = json!({ "tabSize": 8, "insertSpaces": true });
    let edits = client.request("textDocument/formatting", params.clone());
    let edits = edits.as_array().unwrap();
    assert!(!edits.is_empty());
    // Applied from the last to the first, they make a text that needs no further formatting.
    let mut lines: Vec<String> = vec!["Loop:    mst 0\n".into(), "STOP\n".into()];
    for edit in edits.iter().rev() {
        let line = edit["range"]["start"]["line"].as_u64().unwrap() as usize;
        assert_eq!(shown(&edit["range"]), format!("{line}:0-{}:0", line + 1));
        lines[line] = edit["newText"].as_str().unwrap().into();
    }
    let formatted = lines.concat();
    assert!(formatted.contains("MST 0"), "{formatted}");
    client.replace(URI, 2, &formatted);
    assert_eq!(client.request("textDocument/formatting", params), json!([]));
}

#[test]
fn a_mistake_has_a_quick_fix() {
    let mut client = open("Loop: MST 0\nJA Lop\n");
    let place = json!({ "line": 1, "character": 4 });
    let mut params = document();
    params["range"] = json!({ "start": place, "end": place });
    params["context"] = json!({ "diagnostics": [] });
    let actions = client.request("textDocument/codeAction", params.clone());
    let action = &actions[0];
    assert_eq!(
        (&action["title"], &action["kind"]),
        (&json!("Replace Lop by Loop"), &json!("quickfix"))
    );
    assert_eq!(action["isPreferred"], true);
    assert_eq!(action["diagnostics"][0]["code"], "unknown-label");
    let edit = &action["edit"]["changes"][URI][0];
    assert_eq!((shown(&edit["range"]), &edit["newText"]), ("1:3-1:6".into(), &json!("Loop")));
    params["context"]["only"] = json!(["refactor"]);
    assert_eq!(client.request("textDocument/codeAction", params), json!([]));
}

#[test]
fn a_warning_can_be_allowed_on_its_line() {
    let mut client = open("Loop: MST 0\nMVP ABS, 0, Loop\n");
    assert_eq!(client.codes(URI), ["1:12-1:16 label-as-number"]);
    let place = json!({ "line": 1, "character": 13 });
    let mut params = document();
    params["range"] = json!({ "start": place, "end": place });
    params["context"] = json!({ "diagnostics": [], "only": ["quickfix"] });
    let actions = client.request("textDocument/codeAction", params);
    let edit = &actions[0]["edit"]["changes"][URI][0];
    assert_eq!(edit["newText"], " // tmcl-allow: label-as-number");
    assert_eq!(shown(&edit["range"]), "1:16-1:16");
}
