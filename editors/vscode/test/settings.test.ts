import assert from "node:assert/strict";
import path from "node:path";
import { test } from "node:test";
import { serverSettings } from "../src/settings";

const FOLDER = path.resolve("/home/me/lab");

test("nothing set is no module and no folders", () => {
  const nothing = { module: null, includePaths: [] };
  assert.deepEqual(serverSettings({ module: null, includePaths: [] }, FOLDER), nothing);
  assert.deepEqual(serverSettings({ module: undefined, includePaths: undefined }, undefined), nothing);
});

test("a module that is only space is none", () => {
  assert.equal(serverSettings({ module: "  ", includePaths: [] }, FOLDER).module, null);
  assert.equal(serverSettings({ module: " tmcm-6214 ", includePaths: [] }, FOLDER).module, "tmcm-6214");
});

test("a relative include path begins at the workspace folder, an absolute one stays", () => {
  const absolute = path.resolve("/opt/tmcl");
  assert.deepEqual(serverSettings({ module: null, includePaths: ["inc", "../shared", absolute] }, FOLDER).includePaths, [
    path.join(FOLDER, "inc"),
    path.resolve(FOLDER, "..", "shared"),
    absolute,
  ]);
});

test("without a workspace a relative include path is passed on as it is", () => {
  assert.deepEqual(serverSettings({ module: null, includePaths: ["inc"] }, undefined).includePaths, ["inc"]);
});

test("a setting of a wrong type counts as not set", () => {
  assert.deepEqual(serverSettings({ module: 6214, includePaths: "inc" }, FOLDER), { module: null, includePaths: [] });
  assert.deepEqual(serverSettings({ module: null, includePaths: [7, "", "inc", null] }, FOLDER).includePaths, [
    path.join(FOLDER, "inc"),
  ]);
});
