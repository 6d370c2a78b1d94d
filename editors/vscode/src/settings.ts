import * as path from "node:path";

/** What the server is told, when it starts and whenever it changes. */
export interface ServerSettings {
  /** The module for which programs are checked, or null where each program says it. */
  readonly module: string | null;
  /** Folders in which `#include` looks after the program's own; absolute where there is a workspace. */
  readonly includePaths: readonly string[];
}

/** The settings of section `opentmcl` as the user has written them; `undefined` is one of a wrong type. */
export interface UserSettings {
  readonly module: unknown;
  readonly includePaths: unknown;
}

/**
 * The settings for the server. The server need not know where the workspace is: a relative include path
 * begins at `folder`. What is not of the type that package.json gives counts as not set, because the
 * editor marks it in the settings but delivers it all the same.
 */
export function serverSettings(user: UserSettings, folder: string | undefined): ServerSettings {
  const paths: readonly unknown[] = Array.isArray(user.includePaths) ? user.includePaths : [];
  return {
    module: typeof user.module === "string" && user.module.trim() !== "" ? user.module.trim() : null,
    includePaths: paths
      .filter((entry): entry is string => typeof entry === "string" && entry !== "")
      .map((entry) => (folder === undefined ? entry : path.resolve(folder, entry))),
  };
}
