//! Requests and what is answered to them.

mod completion;
mod semantic_tokens;

use std::io::Write;

use lsp_server::ErrorCode;
use lsp_types::request::{
    CodeActionRequest, Completion, DocumentHighlightRequest, DocumentSymbolRequest, Formatting,
    GotoDefinition, HoverRequest, InlayHintRequest, PrepareRenameRequest, References, Rename,
    Request, SemanticTokensFullRequest,
};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse,
    DocumentFormattingParams, DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams,
    DocumentSymbol, DocumentSymbolParams, DocumentSymbolResponse, GotoDefinitionParams,
    GotoDefinitionResponse, Hover, HoverContents, HoverParams, InlayHint, InlayHintKind,
    InlayHintLabel, InlayHintParams, Location, MarkupContent, MarkupKind, PrepareRenameResponse,
    ReferenceParams, RenameParams, SymbolKind, TextDocumentIdentifier, TextDocumentPositionParams,
    TextEdit, WorkspaceEdit,
};
use opentmcl_lang::service::{self, HintKind, Service};
use opentmcl_lang::{self as lang, FileId};
use serde_json::Value;

use super::convert::{Files, Places};
use super::edits;
use super::publish::diagnostic;
use super::server::{Problem, Server, read, written};
use super::uri;
use super::workspace::{Program, Workspace};

/// A file that a request is about.
pub(super) struct Asked<'a> {
    workspace: &'a Workspace,
    program: &'a Program,
    file: FileId,
    files: Files<'a>,
}

impl<'a> Asked<'a> {
    fn service(&self) -> Service<'a> {
        self.program.service()
    }

    fn places(&self) -> &Places<'a> {
        self.files.of(self.file)
    }
}

impl<W: Write> Server<W> {
    /// The result of a request.
    pub(super) fn answer(&mut self, method: &str, params: Value) -> Result<Value, Problem> {
        // Whatever is asked, it is asked about the texts as they are now.
        self.workspace.assemble();
        match method {
            Completion::METHOD => self.with::<Completion>(params, completion::answer),
            HoverRequest::METHOD => self.with::<HoverRequest>(params, hover),
            GotoDefinition::METHOD => self.with::<GotoDefinition>(params, definition),
            References::METHOD => self.with::<References>(params, references),
            DocumentHighlightRequest::METHOD => {
                self.with::<DocumentHighlightRequest>(params, highlights)
            }
            PrepareRenameRequest::METHOD => {
                self.with::<PrepareRenameRequest>(params, prepare_rename)
            }
            Rename::METHOD => self.with::<Rename>(params, rename),
            DocumentSymbolRequest::METHOD => self.with::<DocumentSymbolRequest>(params, symbols),
            Formatting::METHOD => self.with::<Formatting>(params, formatting),
            SemanticTokensFullRequest::METHOD => {
                self.with::<SemanticTokensFullRequest>(params, semantic_tokens::answer)
            }
            InlayHintRequest::METHOD => self.with::<InlayHintRequest>(params, hints),
            CodeActionRequest::METHOD => self.with::<CodeActionRequest>(params, actions),
            _ => Err(Problem::new(
                ErrorCode::MethodNotFound,
                format!("there is no request {method}"),
            )),
        }
    }

    fn with<R: Request>(
        &self,
        params: Value,
        answer: impl FnOnce(&Asked<'_>, R::Params) -> Result<R::Result, Problem>,
    ) -> Result<Value, Problem>
    where
        R::Params: About,
    {
        let params: R::Params = read(R::METHOD, params)?;
        let uri = &params.document().uri;
        let Some((program, file)) = self.workspace.context(&uri::name(uri)) else {
            let message = format!("{} is not open", uri.as_str());
            return Err(Problem::new(ErrorCode::InvalidParams, message));
        };
        let files = Files::new(program, &self.workspace, self.unit);
        let asked = Asked { workspace: &self.workspace, program, file, files };
        written(answer(&asked, params)?)
    }
}

/// Parameters of a request about a file.
trait About {
    fn document(&self) -> &TextDocumentIdentifier;
}

macro_rules! about {
    ($($params:ty: $($field:ident).+;)*) => {$(
        impl About for $params {
            fn document(&self) -> &TextDocumentIdentifier {
                &self.$($field).+
            }
        }
    )*};
}

about! {
    lsp_types::CompletionParams: text_document_position.text_document;
    HoverParams: text_document_position_params.text_document;
    GotoDefinitionParams: text_document_position_params.text_document;
    ReferenceParams: text_document_position.text_document;
    DocumentHighlightParams: text_document_position_params.text_document;
    TextDocumentPositionParams: text_document;
    RenameParams: text_document_position.text_document;
    DocumentSymbolParams: text_document;
    DocumentFormattingParams: text_document;
    lsp_types::SemanticTokensParams: text_document;
    InlayHintParams: text_document;
    CodeActionParams: text_document;
}

fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}

fn hover(asked: &Asked<'_>, params: HoverParams) -> Result<Option<Hover>, Problem> {
    let offset = asked.places().offset(params.text_document_position_params.position);
    let hover = asked.service().hover(asked.file, offset);
    Ok(hover.map(|hover| Hover {
        contents: HoverContents::Markup(markdown(hover.markdown)),
        range: Some(asked.places().range(hover.span)),
    }))
}

fn definition(
    asked: &Asked<'_>,
    params: GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>, Problem> {
    let offset = asked.places().offset(params.text_document_position_params.position);
    let found = asked.service().definition(asked.file, offset);
    // A file that comes with the tools is nowhere on disk; hovering shows what is defined there.
    let location = found.and_then(|location| asked.files.location(location));
    Ok(location.map(GotoDefinitionResponse::Scalar))
}

fn references(
    asked: &Asked<'_>,
    params: ReferenceParams,
) -> Result<Option<Vec<Location>>, Problem> {
    let offset = asked.places().offset(params.text_document_position.position);
    let all = asked.service().references(asked.file, offset).into_iter();
    let wanted = all.filter(|it| params.context.include_declaration || !it.is_definition);
    Ok(Some(wanted.filter_map(|it| asked.files.location(it.location)).collect()))
}

fn highlights(
    asked: &Asked<'_>,
    params: DocumentHighlightParams,
) -> Result<Option<Vec<DocumentHighlight>>, Problem> {
    let offset = asked.places().offset(params.text_document_position_params.position);
    let all = asked.service().highlights(asked.file, offset).into_iter();
    let highlight = |it: service::Reference| DocumentHighlight {
        range: asked.places().range(it.location.span),
        kind: Some(match it.is_definition {
            true => DocumentHighlightKind::WRITE,
            false => DocumentHighlightKind::READ,
        }),
    };
    Ok(Some(all.map(highlight).collect()))
}

fn refused(error: service::RenameError) -> Problem {
    Problem::new(ErrorCode::RequestFailed, error.to_string())
}

fn prepare_rename(
    asked: &Asked<'_>,
    params: TextDocumentPositionParams,
) -> Result<Option<PrepareRenameResponse>, Problem> {
    let offset = asked.places().offset(params.position);
    let (span, name) = match asked.service().prepare_rename(asked.file, offset) {
        Ok(found) => found,
        // So the protocol says it, without an error to show.
        Err(service::RenameError::NothingHere) => return Ok(None),
        Err(error) => return Err(refused(error)),
    };
    let (range, placeholder) = (asked.places().range(span), name.to_owned());
    Ok(Some(PrepareRenameResponse::RangeWithPlaceholder { range, placeholder }))
}

fn rename(asked: &Asked<'_>, params: RenameParams) -> Result<Option<WorkspaceEdit>, Problem> {
    let offset = asked.places().offset(params.text_document_position.position);
    let new = &params.new_name;
    let edits = asked.service().rename(asked.file, offset, new).map_err(refused)?;
    Ok(edits::workspace_edit(edits, &asked.files))
}

fn symbols(
    asked: &Asked<'_>,
    _params: DocumentSymbolParams,
) -> Result<Option<DocumentSymbolResponse>, Problem> {
    let places = asked.places();
    #[expect(deprecated, reason = "the field `deprecated` is required and itself deprecated")]
    let symbol = |symbol: service::Symbol| DocumentSymbol {
        name: symbol.name,
        detail: symbol.detail,
        kind: match symbol.kind {
            service::SymbolKind::Label => SymbolKind::FUNCTION,
            service::SymbolKind::Constant => SymbolKind::CONSTANT,
            service::SymbolKind::Include => SymbolKind::FILE,
        },
        tags: None,
        deprecated: None,
        range: places.range(symbol.extent),
        selection_range: places.range(symbol.span),
        children: None,
    };
    let symbols = asked.service().symbols(asked.file).into_iter().map(symbol).collect();
    Ok(Some(DocumentSymbolResponse::Nested(symbols)))
}

fn formatting(
    asked: &Asked<'_>,
    _params: DocumentFormattingParams,
) -> Result<Option<Vec<TextEdit>>, Problem> {
    let tree = &asked.program.assembly.file(asked.file).tree;
    let formatted = opentmcl_lang::format(tree);
    Ok(Some(edits::difference(tree.text(), &formatted, asked.places())))
}

fn hints(asked: &Asked<'_>, params: InlayHintParams) -> Result<Option<Vec<InlayHint>>, Problem> {
    let part = asked.places().span(params.range);
    let hint = |hint: service::Hint| {
        let is_name = hint.kind == HintKind::Name;
        InlayHint {
            position: asked.places().position(hint.offset),
            label: InlayHintLabel::String(hint.text),
            kind: is_name.then_some(InlayHintKind::PARAMETER),
            text_edits: None,
            tooltip: None,
            padding_left: Some(!is_name),
            padding_right: Some(is_name),
            data: None,
        }
    };
    Ok(Some(asked.service().hints(asked.file, part).into_iter().map(hint).collect()))
}

fn actions(
    asked: &Asked<'_>,
    params: CodeActionParams,
) -> Result<Option<CodeActionResponse>, Problem> {
    let is_wanted = |kinds: &Vec<CodeActionKind>| {
        // A kind stands for all that begin with it.
        let quick_fix = CodeActionKind::QUICKFIX;
        kinds.iter().any(|kind| kind.as_str().is_empty() || *kind == quick_fix)
    };
    if !params.context.only.as_ref().is_none_or(is_wanted) {
        return Ok(Some(Vec::new()));
    }
    let span = asked.places().span(params.range);
    let place = lang::Location { file: asked.file, span };
    let findings = &asked.program.findings;
    let action = |action: service::Action| {
        let finding = findings.get(action.finding)?;
        Some(CodeActionOrCommand::CodeAction(CodeAction {
            title: action.title,
            kind: Some(CodeActionKind::QUICKFIX),
            diagnostics: diagnostic(&asked.files, finding).map(|finding| vec![finding]),
            edit: Some(edits::workspace_edit([action.edit], &asked.files)?),
            is_preferred: action.is_fix.then_some(true),
            ..Default::default()
        }))
    };
    let actions = asked.service().actions(place, findings);
    Ok(Some(actions.into_iter().filter_map(action).collect()))
}
