//! What each token is, for colours.

use super::Service;
use super::parts::{Role, parts, span};
use crate::diagnostic::FileId;
use crate::span::Span;

/// One token that has a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SemanticToken {
    /// Where it is; within one line.
    pub span: Span,
    /// What it is.
    pub class: TokenClass,
    /// Whether it defines the name that it is.
    pub is_definition: bool,
}

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenClass {
    /// A command's mnemonic or number.
    Mnemonic,
    /// A word of an operand, or a directive.
    Keyword,
    /// A label.
    Label,
    /// A constant.
    Constant,
    /// A function.
    Function,
    /// A number.
    Number,
    /// A comment.
    Comment,
    /// An operator, a comma or a parenthesis.
    Operator,
    /// The name of an included file.
    FileName,
}

impl TokenClass {
    /// All classes.
    pub const ALL: &[Self] = &[
        Self::Mnemonic,
        Self::Keyword,
        Self::Label,
        Self::Constant,
        Self::Function,
        Self::Number,
        Self::Comment,
        Self::Operator,
        Self::FileName,
    ];
}

impl Service<'_> {
    /// All tokens of a file that have a colour, in order. Names that mean nothing have none.
    pub fn semantic_tokens(&self, file: FileId) -> Vec<SemanticToken> {
        let lines = self.assembly.file(file).tree.lines();
        let all = lines.iter().flat_map(|line| parts(self.assembly, file, line));
        all.filter_map(|part| {
            let class = match part.role {
                Role::Mnemonic(Some(_)) | Role::CommandNumber => TokenClass::Mnemonic,
                Role::Keyword(..) | Role::Directive => TokenClass::Keyword,
                Role::LabelDefinition => TokenClass::Label,
                Role::ConstantDefinition => TokenClass::Constant,
                Role::Label | Role::Constant => {
                    // A name without a definition is an error, and looks like none of the others.
                    let target = self.target(file, &part)?;
                    self.definition_of(&target)?;
                    if part.role == Role::Label { TokenClass::Label } else { TokenClass::Constant }
                }
                Role::Function(Some(_)) => TokenClass::Function,
                Role::Number => TokenClass::Number,
                Role::Comment => TokenClass::Comment,
                Role::Operator => TokenClass::Operator,
                Role::IncludeName => TokenClass::FileName,
                Role::Mnemonic(None) | Role::Function(None) => return None,
            };
            let is_definition =
                matches!(part.role, Role::LabelDefinition | Role::ConstantDefinition);
            Some(SemanticToken { span: span(self.assembly, file, &part), class, is_definition })
        })
        .collect()
    }
}
