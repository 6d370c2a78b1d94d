//! What the server can do, as it tells the editor.

use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionOptions,
    HoverProviderCapability, InitializeResult, OneOf, PositionEncodingKind, RenameOptions,
    SemanticTokenModifier, SemanticTokenType, SemanticTokensFullOptions, SemanticTokensLegend,
    SemanticTokensOptions, SemanticTokensServerCapabilities, ServerCapabilities, ServerInfo,
    TextDocumentSyncCapability, TextDocumentSyncKind, TextDocumentSyncOptions,
    WorkDoneProgressOptions,
};
use opentmcl_lang::service::TokenClass;
use opentmcl_lang::span::ColumnUnit;

/// With these characters an editor asks for proposals although no word has been begun.
const TRIGGERS: [&str; 4] = [" ", ",", "#", ":"];

/// The answer to the first request.
pub(super) fn initialize_result(unit: ColumnUnit) -> InitializeResult {
    let encoding = match unit {
        ColumnUnit::Utf8 => PositionEncodingKind::UTF8,
        _ => PositionEncodingKind::UTF16,
    };
    let capabilities = ServerCapabilities {
        position_encoding: Some(encoding),
        text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
            open_close: Some(true),
            change: Some(TextDocumentSyncKind::INCREMENTAL),
            ..Default::default()
        })),
        completion_provider: Some(CompletionOptions {
            trigger_characters: Some(TRIGGERS.map(str::to_owned).to_vec()),
            ..Default::default()
        }),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: WorkDoneProgressOptions::default(),
        })),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..Default::default()
        })),
        semantic_tokens_provider: Some(SemanticTokensServerCapabilities::SemanticTokensOptions(
            SemanticTokensOptions {
                legend: SemanticTokensLegend {
                    token_types: TokenClass::ALL.iter().copied().map(token_type).collect(),
                    token_modifiers: vec![SemanticTokenModifier::DEFINITION],
                },
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..Default::default()
            },
        )),
        inlay_hint_provider: Some(OneOf::Left(true)),
        ..Default::default()
    };
    let version = Some(env!("CARGO_PKG_VERSION").to_owned());
    InitializeResult {
        capabilities,
        server_info: Some(ServerInfo { name: "tmcl".into(), version }),
    }
}

/// The type under which editors colour it. Only types that the protocol defines have a colour
/// everywhere, so labels, which it lacks, are the functions of a program.
const fn token_type(class: TokenClass) -> SemanticTokenType {
    match class {
        TokenClass::Mnemonic => SemanticTokenType::KEYWORD,
        TokenClass::Keyword => SemanticTokenType::ENUM_MEMBER,
        TokenClass::Label => SemanticTokenType::FUNCTION,
        TokenClass::Constant => SemanticTokenType::VARIABLE,
        TokenClass::Function => SemanticTokenType::MACRO,
        TokenClass::Number => SemanticTokenType::NUMBER,
        TokenClass::Comment => SemanticTokenType::COMMENT,
        TokenClass::Operator => SemanticTokenType::OPERATOR,
        TokenClass::FileName => SemanticTokenType::STRING,
    }
}
