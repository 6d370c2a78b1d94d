import * as vscode from "vscode";
import { DidChangeConfigurationNotification, LanguageClient } from "vscode-languageclient/node";
import { problemWith } from "./probe";
import { serverSettings, type ServerSettings } from "./settings";

const SECTION = "opentmcl";
const INSTALLATION = "https://github.com/opentmcl/opentmcl/blob/HEAD/docs/editors.md#visual-studio-code";

let client: LanguageClient | undefined;
/**
 * Where the server is started. Not the workspace: on Windows a program is looked for in this folder before
 * PATH, and a folder that is merely opened must not bring a program to run.
 */
let home: string;
/** Starts and stops run one after the other, however fast they are asked for. */
let queue: Promise<void> = Promise.resolve();

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  home = context.extensionPath;
  context.subscriptions.push(
    vscode.commands.registerCommand("opentmcl.restart", restart),
    vscode.workspace.onDidChangeConfiguration((event) => {
      if (event.affectsConfiguration(`${SECTION}.serverPath`)) {
        void restart();
      } else if (event.affectsConfiguration(SECTION)) {
        void announceSettings();
      }
    }),
    // A workspace that becomes trusted may bring its own serverPath.
    vscode.workspace.onDidGrantWorkspaceTrust(restart),
  );
  await restart();
}

export function deactivate(): Promise<void> {
  return enqueue(stop);
}

function restart(): Promise<void> {
  return enqueue(async () => {
    await stop();
    await start();
  });
}

function enqueue(step: () => Promise<void>): Promise<void> {
  queue = queue.then(step).catch((error: unknown) => {
    void vscode.window.showErrorMessage(`OpenTMCL: ${error instanceof Error ? error.message : String(error)}`);
  });
  return queue;
}

async function start(): Promise<void> {
  const program = configuration().get("serverPath", "tmcl").trim() || "tmcl";
  const problem = await problemWith(program, home);
  if (problem !== undefined) {
    // Not awaited: the message stays until the user answers it, and highlighting works meanwhile.
    void explain(problem);
    return;
  }
  client = new LanguageClient(
    SECTION,
    "OpenTMCL",
    { command: program, args: ["lsp"], options: { cwd: home } },
    {
      documentSelector: [
        { scheme: "file", language: "tmcl" },
        { scheme: "untitled", language: "tmcl" },
      ],
      initializationOptions: settings(),
    },
  );
  await client.start();
}

async function stop(): Promise<void> {
  const stopped = client;
  client = undefined;
  await stopped?.dispose();
}

async function explain(problem: string): Promise<void> {
  const open = "Open Settings";
  const read = "How to Install";
  const answer = await vscode.window.showErrorMessage(
    `OpenTMCL: ${problem} Until then there is highlighting only.`,
    open,
    read,
  );
  if (answer === open) {
    await vscode.commands.executeCommand("workbench.action.openSettings", `${SECTION}.serverPath`);
  } else if (answer === read) {
    await vscode.env.openExternal(vscode.Uri.parse(INSTALLATION));
  }
}

async function announceSettings(): Promise<void> {
  // A server that is not running gets them when it starts.
  if (client?.isRunning()) {
    await client.sendNotification(DidChangeConfigurationNotification.type, { settings: { [SECTION]: settings() } });
  }
}

function settings(): ServerSettings {
  const user = configuration();
  return serverSettings(
    { module: user.get("module"), includePaths: user.get("includePaths") },
    workspaceFolder(),
  );
}

function configuration(): vscode.WorkspaceConfiguration {
  return vscode.workspace.getConfiguration(SECTION);
}

function workspaceFolder(): string | undefined {
  return vscode.workspace.workspaceFolders?.find((folder) => folder.uri.scheme === "file")?.uri.fsPath;
}
