//! Proposals.

use std::collections::BTreeSet;
use std::path::Path;

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionParams, CompletionResponse, CompletionTextEdit,
    Documentation, TextEdit,
};
use opentmcl_lang::service::{Completion, CompletionKind};

use super::{Asked, markdown};
use crate::lsp::server::Problem;

/// How many files of one folder are proposed.
const MAX_FILES: usize = 1000;

/// Endings of files that programs include, lower case.
const ENDINGS: [&str; 3] = ["tmc", "tmcl", "inc"];

pub(super) fn answer(
    asked: &Asked<'_>,
    params: CompletionParams,
) -> Result<Option<CompletionResponse>, Problem> {
    let offset = asked.places().offset(params.text_document_position.position);
    let mut proposals = asked.service().completion(asked.file, offset);
    let trigger = params.context.and_then(|context| context.trigger_character);
    let is_start = proposals.iter().any(|it| it.kind == CompletionKind::Mnemonic);
    // A list at each blank of an indentation would be in the way.
    if is_start && trigger.is_some_and(|trigger| trigger != "#") {
        return Ok(None);
    }
    if let Some(replace) = asked.service().include_name(asked.file, offset) {
        proposals.extend(files(asked).into_iter().map(|name| Completion {
            label: name.clone(),
            kind: CompletionKind::File,
            detail: None,
            documentation: None,
            filter: None,
            replace,
            insert: name,
        }));
    }
    let item = |(at, proposal): (usize, Completion)| {
        let range = asked.places().range(proposal.replace);
        CompletionItem {
            label: proposal.label,
            kind: Some(kind(proposal.kind)),
            detail: proposal.detail,
            documentation: proposal
                .documentation
                .map(|text| Documentation::MarkupContent(markdown(text))),
            filter_text: proposal.filter,
            // Editors sort by letters; the order is that of the proposals.
            sort_text: Some(format!("{at:06}")),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit::new(range, proposal.insert))),
            ..Default::default()
        }
    };
    let items = proposals.into_iter().enumerate().map(item).collect();
    Ok(Some(CompletionResponse::Array(items)))
}

/// Files that the asking one may include: beside it, and in the include folders.
fn files(asked: &Asked<'_>) -> BTreeSet<String> {
    let own = Path::new(&asked.program.assembly.file(asked.file).name);
    let beside = own.parent().filter(|_| own.is_absolute());
    let folders = asked.workspace.include_folders().iter().map(|folder| folder.as_path());
    let mut names = BTreeSet::new();
    for folder in beside.into_iter().chain(folders) {
        let Ok(entries) = folder.read_dir() else { continue };
        for entry in entries.take(MAX_FILES).flatten() {
            let path = entry.path();
            let ending = path.extension().and_then(|ending| ending.to_str());
            let is_meant = ending.is_some_and(|ending| {
                ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending))
            });
            if is_meant
                && path != own
                && let Ok(name) = entry.file_name().into_string()
            {
                names.insert(name);
            }
        }
    }
    names
}

const fn kind(kind: CompletionKind) -> CompletionItemKind {
    match kind {
        CompletionKind::Mnemonic => CompletionItemKind::KEYWORD,
        CompletionKind::Keyword => CompletionItemKind::ENUM_MEMBER,
        CompletionKind::Parameter => CompletionItemKind::PROPERTY,
        CompletionKind::Value => CompletionItemKind::VALUE,
        CompletionKind::Label => CompletionItemKind::REFERENCE,
        CompletionKind::Constant => CompletionItemKind::CONSTANT,
        CompletionKind::Function => CompletionItemKind::FUNCTION,
        CompletionKind::File => CompletionItemKind::FILE,
        CompletionKind::Module => CompletionItemKind::MODULE,
        CompletionKind::Finding => CompletionItemKind::EVENT,
    }
}
