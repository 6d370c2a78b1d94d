// Every command and keyword of the library's table is coloured, each keyword in its place and in no other.
// The table is read from the Rust source, so that the grammar cannot fall behind it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import path from "node:path";
import { before, test } from "node:test";
import { createOnigScanner, createOnigString, loadWASM } from "vscode-oniguruma";
import { INITIAL, type IGrammar, parseRawGrammar, Registry } from "vscode-textmate";

const EXTENSION = path.resolve(__dirname, "../..");
const GRAMMAR = path.join(EXTENSION, "syntaxes/tmcl.tmLanguage.json");
const TABLE = path.join(EXTENSION, "../../crates/wire/src/opcode.rs");

const MNEMONIC = /^(?:support\.function|keyword\.control)\./;
const KEYWORD = /^constant\.language\./;

/** The operands of each command: the keywords that may stand there, none where only numbers do. */
type Commands = Map<string, readonly (readonly string[])[]>;

let grammar: IGrammar;
const commands = readTable(readFileSync(TABLE, "utf8"));
const allKeywords = [...new Set([...commands.values()].flat(2))];

function readTable(source: string): Commands {
  const keywords = new Map<string, readonly string[]>();
  for (const [, name, list] of source.matchAll(/const (\w+): Operand =\s*choice\([^[]*\[(.*?)\]/gs)) {
    keywords.set(name!, [...list!.matchAll(/\("(\w+)", \d+\)/g)].map((word) => word[1]!));
  }
  const found = new Map<string, readonly (readonly string[])[]>();
  for (const [, mnemonic, operands] of source.matchAll(/^\s+\w+ = \d+ "(\w+)" \[([\w, ]*)\];$/gm)) {
    const names = operands!.split(",").map((name) => name.trim()).filter((name) => name !== "");
    found.set(mnemonic!, names.map((name) => keywords.get(name) ?? []));
  }
  return found;
}

/** The innermost scope of `word` where it ends `before`, or "" if that scope is not of this word alone. */
function scope(before: string, word: string, behind = ""): string {
  const start = before.length;
  const end = start + word.length;
  const tokens = grammar.tokenizeLine(before + word + behind, INITIAL).tokens;
  return tokens.find((token) => token.startIndex === start && token.endIndex === end)?.scopes.at(-1) ?? "";
}

before(async () => {
  const wasm = readFileSync(require.resolve("vscode-oniguruma/release/onig.wasm"));
  await loadWASM(wasm.buffer.slice(wasm.byteOffset, wasm.byteOffset + wasm.byteLength));
  const registry = new Registry({
    onigLib: Promise.resolve({ createOnigScanner, createOnigString }),
    loadGrammar: async () => parseRawGrammar(readFileSync(GRAMMAR, "utf8"), GRAMMAR),
  });
  grammar = (await registry.loadGrammar("source.tmcl"))!;
});

test("the table is read in full", () => {
  // Commands 1 to 57, the functions UF0 to UF7, and CALL.
  assert.ok(commands.size >= 57 + 8 + 1, `only ${commands.size} commands; has the form of the table changed?`);
  assert.deepEqual(commands.get("MVP"), [["ABS", "REL", "COORD"], [], []]);
  assert.deepEqual(commands.get("RSUB"), []);
  assert.ok(commands.get("WAIT")?.[0]?.includes("REFSW"));
});

test("every mnemonic is coloured, in any case, alone and with operands", () => {
  for (const mnemonic of commands.keys()) {
    for (const word of [mnemonic, mnemonic.toLowerCase()]) {
      assert.match(scope("Here: ", word, " 1, 2, 3"), MNEMONIC, word);
      assert.match(scope("", word), MNEMONIC, `${word} alone`);
    }
  }
});

test("every keyword is coloured where it may stand", () => {
  for (const [mnemonic, operands] of commands) {
    operands.forEach((keywords, position) => {
      for (const keyword of keywords) {
        const before = `${mnemonic} ${"0, ".repeat(position)}`;
        assert.match(scope(before, keyword, ", 0".repeat(operands.length - position - 1)), KEYWORD, before + keyword);
      }
    });
  }
});

test("no keyword is coloured where it means nothing", () => {
  for (const [mnemonic, operands] of commands) {
    for (const keyword of allKeywords) {
      for (let position = 0; position < 3; position += 1) {
        if (!operands[position]?.includes(keyword)) {
          const before = `${mnemonic} ${"0, ".repeat(position)}`;
          assert.doesNotMatch(scope(before, keyword), KEYWORD, before + keyword);
        }
      }
    }
  }
});

test("nothing is coloured as a command that is none", () => {
  const known = new Set(commands.keys());
  // All words of up to two letters, and each command with a letter more or less.
  const letters = [..."ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"];
  const words = new Set(letters.slice(0, 26).flatMap((first) => [first, ...letters.map((second) => first + second)]));
  for (const mnemonic of known) {
    words.add(mnemonic.slice(0, -1));
    letters.forEach((letter) => words.add(mnemonic + letter));
    for (let at = 0; at < mnemonic.length; at += 1) {
      letters.forEach((letter) => words.add(mnemonic.slice(0, at) + letter + mnemonic.slice(at + 1)));
    }
  }
  for (const word of [...words].filter((word) => /^[A-Z]/.test(word) && !known.has(word))) {
    assert.doesNotMatch(scope("", word, " 1, 2, 3"), MNEMONIC, word);
  }
});
