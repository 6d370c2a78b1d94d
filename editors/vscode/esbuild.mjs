// Builds dist/: the extension in one file, the licences of what is in it, and the tests.

import { readFile, readdir, writeFile } from "node:fs/promises";
import path from "node:path";
import { build } from "esbuild";

const common = { bundle: true, platform: "node", target: "node20", logLevel: "warning" };

const extension = await build({
  ...common,
  entryPoints: ["src/extension.ts"],
  outfile: "dist/extension.js",
  format: "cjs",
  external: ["vscode"],
  minify: true,
  metafile: true,
});

await writeFile("dist/THIRD-PARTY-LICENSES.txt", await licences(Object.keys(extension.metafile.inputs)));

await build({
  ...common,
  entryPoints: ["test/*.test.ts"],
  outdir: "dist/test",
  format: "cjs",
  // They read files beside themselves when they are loaded.
  external: ["vscode-textmate", "vscode-oniguruma"],
});

/** The licence of each package from which the bundle has a file. */
async function licences(inputs) {
  const folders = new Set(inputs.map((input) => /^.*node_modules\/(?:@[^/]+\/)?[^/]+/.exec(input)?.[0]).filter(Boolean));
  const texts = await Promise.all([...folders].sort().map(licence));
  return texts.join(`\n${"-".repeat(80)}\n\n`);
}

async function licence(folder) {
  const { name, version, license } = JSON.parse(await readFile(path.join(folder, "package.json"), "utf8"));
  const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
  if (file === undefined) {
    throw new Error(`${name} is in the extension, but brings no licence`);
  }
  return `${name} ${version} (${license})\n\n${await readFile(path.join(folder, file), "utf8")}`;
}
