//! Colours.

use lsp_types::{SemanticToken, SemanticTokens, SemanticTokensParams, SemanticTokensResult};
use opentmcl_lang::service::TokenClass;

use super::Asked;
use crate::lsp::server::Problem;

/// The bit of the only modifier in the legend.
const DEFINITION: u32 = 1;

/// Each token as its distance from the one before.
pub(super) fn answer(
    asked: &Asked<'_>,
    _params: SemanticTokensParams,
) -> Result<Option<SemanticTokensResult>, Problem> {
    let (mut line, mut column) = (0, 0);
    let tokens = asked.service().semantic_tokens(asked.file).into_iter().map(|token| {
        let range = asked.places().range(token.span);
        let delta_line = range.start.line - line;
        let from = if delta_line == 0 { column } else { 0 };
        let delta_start = range.start.character - from;
        (line, column) = (range.start.line, range.start.character);
        let class = TokenClass::ALL.iter().position(|&class| class == token.class);
        SemanticToken {
            delta_line,
            delta_start,
            length: range.end.character - range.start.character,
            token_type: class.unwrap_or_default() as u32,
            token_modifiers_bitset: if token.is_definition { DEFINITION } else { 0 },
        }
    });
    let data = tokens.collect();
    Ok(Some(SemanticTokensResult::Tokens(SemanticTokens { result_id: None, data })))
}
