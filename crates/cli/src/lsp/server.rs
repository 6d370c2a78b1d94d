//! The course of a conversation: beginning, messages, end.

use std::io::Write;
use std::path::PathBuf;

use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response, ResponseError};
use lsp_types::notification::{
    DidChangeConfiguration, DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument,
    DidOpenTextDocument, Exit, Initialized, Notification as _, ShowMessage,
};
use lsp_types::request::{Initialize, RegisterCapability, Request as _, Shutdown};
use lsp_types::{
    ClientCapabilities, DidChangeConfigurationParams, DidChangeTextDocumentParams,
    DidChangeWatchedFilesRegistrationOptions, DidCloseTextDocumentParams,
    DidOpenTextDocumentParams, FileSystemWatcher, GlobPattern, InitializeParams, MessageType,
    PositionEncodingKind, Registration, RegistrationParams, ShowMessageParams,
};
use opentmcl_lang::span::ColumnUnit;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::capabilities::initialize_result;
use super::documents::Document;
use super::publish::Published;
use super::settings::Settings;
use super::transport::{self, Incoming};
use super::uri;
use super::workspace::Workspace;
use crate::failure::Failure;

/// Files that may be included, by the endings that are in use.
const WATCHED: &str = "**/*.{tmc,tmcl,inc,TMC,TMCL,INC}";

/// How far the conversation has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// Nothing has been agreed upon yet.
    New,
    /// Questions are answered.
    Running,
    /// The editor is about to go.
    ShutDown,
    /// The editor has gone.
    Ended,
}

/// The server.
pub(super) struct Server<W> {
    output: W,
    /// What is to be sent.
    outbox: Vec<Message>,
    state: State,
    was_shut_down: bool,
    pub(super) workspace: Workspace,
    /// As the command line says; the editor's settings come on top.
    defaults: Settings,
    root: Option<PathBuf>,
    /// What columns count.
    pub(super) unit: ColumnUnit,
    watches_files: bool,
    pub(super) published: Published,
}

/// What is wrong with a message.
pub(super) struct Problem {
    code: ErrorCode,
    message: String,
}

impl Problem {
    pub(super) fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }
}

impl<W: Write> Server<W> {
    pub(super) fn new(defaults: Settings, output: W) -> Self {
        Self {
            output,
            outbox: Vec::new(),
            state: State::New,
            was_shut_down: false,
            workspace: Workspace::default(),
            defaults,
            root: None,
            unit: ColumnUnit::Utf16,
            watches_files: false,
            published: Published::new(),
        }
    }

    pub(super) fn state(&self) -> State {
        self.state
    }

    /// Whether the editor has said that it is about to go.
    pub(super) fn was_shut_down(&self) -> bool {
        self.was_shut_down
    }

    /// Handles one message. Fails only when the editor cannot be talked to any more.
    pub(super) fn handle(&mut self, incoming: Incoming) -> Result<(), Failure> {
        match incoming {
            Incoming::Message(Message::Request(request)) => self.request(request),
            Incoming::Message(Message::Notification(notification)) => {
                self.notification(notification)
            }
            // What is asked of the editor is nothing whose answer would matter.
            Incoming::Message(Message::Response(_)) => {}
            Incoming::NotAMessage(answer) => transport::write(&mut self.output, &answer)?,
            Incoming::Broken(why) => {
                let failure = Failure::new(format!("cannot understand the editor: {why}"));
                return Err(failure.help("the server is started by editors, not by people"));
            }
        }
        self.flush()
    }

    /// Sends what is waiting.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        for message in self.outbox.drain(..) {
            transport::write(&mut self.output, &message)?;
        }
        Ok(())
    }

    fn request(&mut self, request: Request) {
        let Request { id, method, params } = request;
        let result = match (self.state, method.as_str()) {
            (State::New, Initialize::METHOD) => self.initialize(params),
            (State::New, _) => Err(Problem::new(
                ErrorCode::ServerNotInitialized,
                format!("{method} before initialize"),
            )),
            (State::Running, Shutdown::METHOD) => {
                self.state = State::ShutDown;
                self.was_shut_down = true;
                Ok(Value::Null)
            }
            (State::Running, Initialize::METHOD) => {
                Err(Problem::new(ErrorCode::InvalidRequest, "initialize comes once"))
            }
            (State::Running, _) => self.answer(&method, params),
            (State::ShutDown | State::Ended, _) => {
                Err(Problem::new(ErrorCode::InvalidRequest, format!("{method} after shutdown")))
            }
        };
        let response_result = result.map_err(|problem| ResponseError {
            code: problem.code as i32,
            message: problem.message,
            data: None,
        });
        self.outbox.push(Response { id, response_result }.into());
    }

    fn initialize(&mut self, params: Value) -> Result<Value, Problem> {
        let params: InitializeParams = read(Initialize::METHOD, params)?;
        let general = params.capabilities.general.as_ref();
        let offered = general.and_then(|general| general.position_encodings.as_deref());
        // Texts are in UTF-8: what the editor counts so needs no conversion.
        if offered.is_some_and(|offered| offered.contains(&PositionEncodingKind::UTF8)) {
            self.unit = ColumnUnit::Utf8;
        }
        self.watches_files = watches_files(&params.capabilities);
        self.root = root(&params);
        self.set(&params.initialization_options.unwrap_or_default());
        self.state = State::Running;
        written(initialize_result(self.unit))
    }

    fn notification(&mut self, notification: Notification) {
        let Notification { method, params } = notification;
        if method == Exit::METHOD {
            self.state = State::Ended;
        } else if self.state == State::Running
            && let Err(problem) = self.notice(&method, params)
        {
            self.complain(problem.message);
        }
    }

    /// Takes notice of what has happened in the editor.
    fn notice(&mut self, method: &str, params: Value) -> Result<(), Problem> {
        match method {
            Initialized::METHOD if self.watches_files => self.watch_files(),
            DidOpenTextDocument::METHOD => {
                let item = read::<DidOpenTextDocumentParams>(method, params)?.text_document;
                let name = uri::name(&item.uri);
                let document = Document::new(item.uri, &name, item.version, item.text);
                self.workspace.open(name, document);
            }
            DidChangeTextDocument::METHOD => {
                let params: DidChangeTextDocumentParams = read(method, params)?;
                let name = uri::name(&params.text_document.uri);
                let unit = self.unit;
                if let Some(document) = self.workspace.change(&name) {
                    document.change(params.text_document.version, params.content_changes, unit);
                }
            }
            DidCloseTextDocument::METHOD => {
                let params: DidCloseTextDocumentParams = read(method, params)?;
                self.workspace.close(&uri::name(&params.text_document.uri));
            }
            DidChangeWatchedFiles::METHOD => self.workspace.forget_all(),
            DidChangeConfiguration::METHOD => {
                let params: DidChangeConfigurationParams = read(method, params)?;
                self.set(&params.settings);
            }
            // The protocol allows to ignore what is not known.
            _ => {}
        }
        Ok(())
    }

    fn set(&mut self, sent: &Value) {
        let (settings, problem) = self.defaults.with(sent, self.root.as_deref());
        self.workspace.set(settings);
        if let Some(problem) = problem {
            self.complain(problem);
        }
    }

    /// Tells the user.
    fn complain(&mut self, message: String) {
        let params = ShowMessageParams { typ: MessageType::WARNING, message };
        self.notify::<ShowMessage>(params);
    }

    pub(super) fn notify<N: lsp_types::notification::Notification>(&mut self, params: N::Params) {
        self.outbox.push(Notification::new(N::METHOD.into(), params).into());
    }

    /// Asks to be told when a file changes that may be included.
    fn watch_files(&mut self) {
        let watcher =
            FileSystemWatcher { glob_pattern: GlobPattern::String(WATCHED.into()), kind: None };
        let options = DidChangeWatchedFilesRegistrationOptions { watchers: vec![watcher] };
        let registration = Registration {
            id: "files".into(),
            method: DidChangeWatchedFiles::METHOD.into(),
            register_options: serde_json::to_value(options).ok(),
        };
        let params = RegistrationParams { registrations: vec![registration] };
        let id = RequestId::from("files".to_owned());
        self.outbox.push(Request::new(id, RegisterCapability::METHOD.into(), params).into());
    }
}

/// Parameters as they should be.
pub(super) fn read<T: DeserializeOwned>(method: &str, params: Value) -> Result<T, Problem> {
    serde_json::from_value(params).map_err(|error| {
        Problem::new(ErrorCode::InvalidParams, format!("parameters of {method}: {error}"))
    })
}

/// A result as it is sent.
pub(super) fn written(result: impl Serialize) -> Result<Value, Problem> {
    serde_json::to_value(result)
        .map_err(|error| Problem::new(ErrorCode::InternalError, error.to_string()))
}

fn watches_files(capabilities: &ClientCapabilities) -> bool {
    let workspace = capabilities.workspace.as_ref();
    let files = workspace.and_then(|workspace| workspace.did_change_watched_files);
    files.and_then(|files| files.dynamic_registration).unwrap_or(false)
}

/// The folder that the editor has opened.
fn root(params: &InitializeParams) -> Option<PathBuf> {
    let first = params.workspace_folders.as_ref().and_then(|folders| folders.first());
    // Editors from before there were several folders know one root.
    #[expect(deprecated, reason = "older editors send nothing else")]
    let uri = first.map(|folder| &folder.uri).or(params.root_uri.as_ref())?;
    Some(PathBuf::from(uri::name(uri))).filter(|path| path.is_absolute())
}
