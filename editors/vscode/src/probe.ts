import { execFile } from "node:child_process";

/** How long a program may take to print its help, in milliseconds. */
const PATIENCE = 10_000;

/**
 * Whether `program`, started in the folder `cwd`, is a `tmcl` that has a language server. Returns undefined
 * if so, and otherwise sentences for the user that say what is wrong and what to do.
 *
 * The operating system looks for the program, so that this finds what starting the server would find.
 */
export function problemWith(program: string, cwd: string): Promise<string | undefined> {
  return new Promise((resolve) => {
    const answer = (error: (Error & { code?: unknown; killed?: boolean }) | null) => {
      if (error === null) {
        resolve(undefined);
      } else if (error.code === "ENOENT") {
        resolve(notFound(program));
      } else if (typeof error.code === "number") {
        resolve(`\`${program}\` has no language server. Install a current tmcl, or set opentmcl.serverPath to one.`);
      } else {
        const reason = error.killed ? "it does not answer" : error.message;
        resolve(`\`${program}\` cannot be run: ${reason}. Set opentmcl.serverPath to the program tmcl.`);
      }
    };
    try {
      execFile(program, ["lsp", "--help"], { cwd, timeout: PATIENCE }, answer).stdin?.end();
    } catch (error) {
      // An empty name, or one with a null character, is refused before anything starts.
      answer(error as Error);
    }
  });
}

function notFound(program: string): string {
  return /[\\/]/.test(program)
    ? `There is no program \`${program}\`. Set opentmcl.serverPath to the program tmcl.`
    : `There is no program \`${program}\` in PATH. Install tmcl, or set opentmcl.serverPath to where it is.`;
}
