//! Columns behind characters that are more than one unit or byte.

use serde_json::json;

use crate::client::{Client, shown};

/// ä is one unit of UTF-16 and two bytes of UTF-8, 𝄞 two units and four bytes.
const TEXT: &str = "Zähler: MST 0 // ä𝄞\nJC ZE, Zähler // 𝄞\nJC ZE, Zähle // 𝄞\n";

const URI: &str = "untitled:columns";

#[test]
fn without_an_agreement_columns_are_units_of_utf_16() {
    let mut client = Client::new();
    client.open(URI, TEXT);
    assert_eq!(client.codes(URI), ["2:7-2:12 unknown-label"]);
    let found = client.at("textDocument/definition", URI, 1, 13);
    assert_eq!(shown(&found["range"]), "0:0-0:6");
    // From behind the last letter of the name to the end of the line.
    client.change(
        URI,
        2,
        json!([{
            "range": { "start": { "line": 2, "character": 12 }, "end": { "line": 2, "character": 99 } },
            "text": "r",
        }]),
    );
    assert_eq!(client.codes(URI), [""; 0]);
}

#[test]
fn an_editor_that_counts_bytes_is_answered_in_bytes() {
    let mut client = Client::start(&[]);
    let encodings = json!({ "positionEncodings": ["utf-32", "utf-8", "utf-16"] });
    let result = client.greet(json!({ "capabilities": { "general": encodings } }));
    assert_eq!(result["capabilities"]["positionEncoding"], "utf-8");
    client.open(URI, TEXT);
    assert_eq!(client.codes(URI), ["2:7-2:13 unknown-label"]);
    let found = client.at("textDocument/definition", URI, 1, 14);
    assert_eq!(shown(&found["range"]), "0:0-0:7");
    client.change(
        URI,
        2,
        json!([{
            "range": { "start": { "line": 2, "character": 13 }, "end": { "line": 2, "character": 21 } },
            "text": "r",
        }]),
    );
    assert_eq!(client.codes(URI), [""; 0]);
}

#[test]
fn tokens_and_hints_behind_such_characters_are_where_they_belong() {
    let mut client = Client::new();
    client.open(URI, "Ä: Größe = 5\nÄ2: SAP 4, 0, 1 // 𝄞\n");
    let document = json!({ "textDocument": { "uri": URI } });
    let tokens = client.request("textDocument/semanticTokens/full", document);
    let data: Vec<u64> =
        tokens["data"].as_array().unwrap().iter().map(|it| it.as_u64().unwrap()).collect();
    let starts: Vec<_> = data.chunks(5).map(|it| (it[0], it[1], it[2])).collect();
    let first_line = [(0, 0, 1), (0, 1, 1), (0, 2, 5), (0, 6, 1), (0, 2, 1)];
    // Label, colon, SAP, 4, comma, 0, comma, 1, comment of three characters and a clef.
    let second_line = [
        (1, 0, 2),
        (0, 2, 1),
        (0, 2, 3),
        (0, 4, 1),
        (0, 1, 1),
        (0, 2, 1),
        (0, 1, 1),
        (0, 2, 1),
        (0, 2, 5),
    ];
    assert_eq!(starts, [&first_line[..], &second_line[..]].concat());
    let range =
        json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9, "character": 0 } });
    let params = json!({ "textDocument": { "uri": URI }, "range": range });
    let hints = client.request("textDocument/inlayHint", params);
    let places: Vec<_> =
        hints.as_array().unwrap().iter().map(|it| it["position"].clone()).collect();
    let place = |line: u32, column: u32| json!({ "line": line, "character": column });
    assert_eq!(places, [place(0, 2), place(1, 3), place(1, 8)]);
}
