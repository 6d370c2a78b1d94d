import assert from "node:assert/strict";
import { chmodSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, test } from "node:test";
import { problemWith } from "../src/probe";

const folder = mkdtempSync(path.join(tmpdir(), "opentmcl-"));
after(() => rmSync(folder, { recursive: true }));

/** An executable script in the folder. */
function script(name: string, text: string, mode = 0o755): string {
  const file = path.join(folder, name);
  writeFileSync(file, `#!/bin/sh\n${text}\n`);
  chmodSync(file, mode);
  return file;
}

test("a program that knows the subcommand is taken", async () => {
  const program = script("good", 'test "$*" = "lsp --help"');
  assert.equal(await problemWith(program, folder), undefined);
});

test("a name that is not in PATH is to be installed or set", async () => {
  const problem = await problemWith("tmcl-that-nobody-has", folder);
  assert.match(problem!, /no program `tmcl-that-nobody-has` in PATH.*Install tmcl.*opentmcl\.serverPath/);
});

test("a path that leads nowhere is to be corrected, without a word of PATH", async () => {
  const problem = await problemWith(path.join(folder, "nothing"), folder);
  assert.match(problem!, /no program `.*nothing`.*opentmcl\.serverPath/);
  assert.doesNotMatch(problem!, /PATH\b/);
});

test("a program without the subcommand is too old", async () => {
  const problem = await problemWith(script("old", "exit 2"), folder);
  assert.match(problem!, /has no language server.*current tmcl/);
});

test("a file that cannot be executed is named with the reason", async () => {
  const problem = await problemWith(script("plain", "exit 0", 0o644), folder);
  assert.match(problem!, /cannot be run: .*EACCES/);
});

test("an impossible name is a message, not an exception", async () => {
  assert.match((await problemWith("", folder))!, /cannot be run/);
  assert.match((await problemWith("a\0b", folder))!, /cannot be run/);
});

test("the workspace is no place to look for a program by its name", { skip: process.platform === "win32" }, async () => {
  script("tmcl-of-this-folder", "exit 0");
  assert.match((await problemWith("tmcl-of-this-folder", folder))!, /in PATH/);
});
