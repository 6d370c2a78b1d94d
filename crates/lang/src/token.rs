//! Text to tokens. Every byte of a text belongs to exactly one token.

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum TokenKind {
    /// Blanks, tabs and what else shows nothing.
    Blank,
    /// The end of a line.
    Newline,
    /// `//` or `;` and what follows it on the line.
    Comment,
    /// A mnemonic, keyword, label, constant or function.
    Name,
    /// Something that begins as a number does; it need not be a valid one.
    Number,
    /// `,`
    Comma,
    /// `:`
    Colon,
    /// `=`
    Equals,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Star,
    /// `/`
    Slash,
    /// `^`
    Caret,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `#` and the word that touches it.
    Directive,
    /// What follows a directive: the rest of the line up to a comment, without blanks around it.
    Argument,
    /// A character that has no meaning here.
    Unknown,
    /// The end of the text; empty.
    End,
}

/// A token; it ends where the next one begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    /// First byte of it in the text.
    pub start: u32,
    /// What it is.
    pub kind: TokenKind,
}

/// The tokens of a text, [`TokenKind::End`] last. The text has at most `u32::MAX` bytes.
pub fn tokens(text: &str) -> Vec<Token> {
    // A guess that spares most programs a second allocation: a command has seven or so.
    let mut tokens = Vec::with_capacity(text.len() / 3 + 1);
    let mut lexer = Lexer { text, bytes: text.as_bytes(), at: 0, argument: false };
    loop {
        let start = lexer.at as u32;
        let kind = lexer.next();
        tokens.push(Token { start, kind });
        if kind == TokenKind::End {
            return tokens;
        }
    }
}

struct Lexer<'a> {
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    /// A directive has come: what follows on the line is its argument.
    argument: bool,
}

impl Lexer<'_> {
    fn peek(&self) -> u8 {
        self.bytes.get(self.at).copied().unwrap_or_default()
    }

    fn skip_while(&mut self, mut wanted: impl FnMut(u8) -> bool) {
        while self.at < self.bytes.len() && wanted(self.bytes[self.at]) {
            self.at += 1;
        }
    }

    fn next(&mut self) -> TokenKind {
        let Some(&first) = self.bytes.get(self.at) else { return TokenKind::End };
        self.at += 1;
        let class = CLASSES[usize::from(first)];
        if self.argument {
            match class {
                Class::Blank | Class::Newline | Class::Return | Class::Semicolon => {}
                Class::Slash if self.peek() == b'/' => {}
                _ => return self.argument(),
            }
        }
        match class {
            Class::Blank => {
                self.skip_while(|byte| CLASSES[usize::from(byte)] == Class::Blank);
                TokenKind::Blank
            }
            Class::Newline => self.newline(),
            Class::Return => {
                if self.peek() == b'\n' {
                    self.at += 1;
                }
                self.newline()
            }
            Class::Letter => self.name(),
            Class::Digit => self.number(),
            Class::Dollar | Class::Percent => {
                self.skip_while(is_word);
                TokenKind::Number
            }
            Class::Point => {
                if self.peek().is_ascii_digit() {
                    return self.number();
                }
                TokenKind::Unknown
            }
            Class::Slash if self.peek() == b'/' => self.comment(),
            Class::Semicolon => self.comment(),
            Class::Slash => TokenKind::Slash,
            Class::Hash => {
                self.skip_while(is_word);
                self.argument = true;
                TokenKind::Directive
            }
            Class::Comma => TokenKind::Comma,
            Class::Colon => TokenKind::Colon,
            Class::Equals => TokenKind::Equals,
            Class::Plus => TokenKind::Plus,
            Class::Minus => TokenKind::Minus,
            Class::Star => TokenKind::Star,
            Class::Caret => TokenKind::Caret,
            Class::Open => TokenKind::Open,
            Class::Close => TokenKind::Close,
            Class::Other => TokenKind::Unknown,
            Class::NotAscii => self.not_ascii(),
        }
    }

    fn newline(&mut self) -> TokenKind {
        self.argument = false;
        TokenKind::Newline
    }

    fn name(&mut self) -> TokenKind {
        self.skip_while(is_word);
        while self.peek() >= 0x80 && self.character().is_some_and(char::is_alphanumeric) {
            self.skip_character();
            self.skip_while(is_word);
        }
        TokenKind::Name
    }

    /// Digits with a fraction and an exponent, and whatever touches them, so that `12abc` is one
    /// mistake and not two tokens.
    fn number(&mut self) -> TokenKind {
        let start = self.at.saturating_sub(1);
        self.skip_while(is_word);
        if matches!(self.bytes[start..self.at], [b'0', b'x' | b'X', ..]) {
            return TokenKind::Number;
        }
        if self.peek() == b'.' {
            self.at += 1;
            self.skip_while(is_word);
        }
        let exponent = self.bytes[self.at - 1].eq_ignore_ascii_case(&b'e')
            && matches!(self.peek(), b'+' | b'-')
            && self.bytes.get(self.at + 1).is_some_and(u8::is_ascii_digit);
        if exponent {
            self.at += 1;
            self.skip_while(is_word);
        }
        TokenKind::Number
    }

    fn comment(&mut self) -> TokenKind {
        self.skip_while(|byte| byte != b'\n' && byte != b'\r');
        TokenKind::Comment
    }

    fn argument(&mut self) -> TokenKind {
        self.at -= 1;
        let rest = &self.bytes[self.at..];
        let mut length = 0;
        for (at, &byte) in rest.iter().enumerate() {
            match CLASSES[usize::from(byte)] {
                Class::Newline | Class::Return | Class::Semicolon => break,
                Class::Slash if rest.get(at + 1) == Some(&b'/') => break,
                Class::Blank => {}
                _ => length = at + 1,
            }
        }
        self.at += length;
        TokenKind::Argument
    }

    fn not_ascii(&mut self) -> TokenKind {
        self.at -= 1;
        let character = self.character().unwrap_or(char::REPLACEMENT_CHARACTER);
        self.skip_character();
        if character.is_alphabetic() {
            self.name()
        } else if character.is_whitespace() || character == '\u{FEFF}' {
            TokenKind::Blank
        } else {
            TokenKind::Unknown
        }
    }

    fn character(&self) -> Option<char> {
        self.text.get(self.at..).and_then(|rest| rest.chars().next())
    }

    fn skip_character(&mut self) {
        self.at += self.character().map_or(1, char::len_utf8);
    }
}

const fn is_word(byte: u8) -> bool {
    matches!(CLASSES[byte as usize], Class::Letter | Class::Digit)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    Blank,
    Newline,
    Return,
    Letter,
    Digit,
    Dollar,
    Percent,
    Point,
    Slash,
    Semicolon,
    Hash,
    Comma,
    Colon,
    Equals,
    Plus,
    Minus,
    Star,
    Caret,
    Open,
    Close,
    Other,
    NotAscii,
}

static CLASSES: [Class; 256] = classes();

const fn classes() -> [Class; 256] {
    let mut classes = [Class::Other; 256];
    let mut byte = 0;
    while byte < 256 {
        classes[byte] = match byte as u8 {
            // $1A is the end-of-file mark of DOS editors.
            b' ' | b'\t' | 0x0B | 0x0C | 0x1A => Class::Blank,
            b'\n' => Class::Newline,
            b'\r' => Class::Return,
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => Class::Letter,
            b'0'..=b'9' => Class::Digit,
            b'$' => Class::Dollar,
            b'%' => Class::Percent,
            b'.' => Class::Point,
            b'/' => Class::Slash,
            b';' => Class::Semicolon,
            b'#' => Class::Hash,
            b',' => Class::Comma,
            b':' => Class::Colon,
            b'=' => Class::Equals,
            b'+' => Class::Plus,
            b'-' => Class::Minus,
            b'*' => Class::Star,
            b'^' => Class::Caret,
            b'(' => Class::Open,
            b')' => Class::Close,
            0x80.. => Class::NotAscii,
            _ => Class::Other,
        };
        byte += 1;
    }
    classes
}

#[cfg(test)]
mod tests {
    use super::TokenKind::*;
    use super::*;

    #[track_caller]
    fn reads(text: &str, expected: &[(TokenKind, &str)]) {
        let tokens = tokens(text);
        let pieces: Vec<_> = tokens
            .windows(2)
            .map(|pair| (pair[0].kind, &text[pair[0].start as usize..pair[1].start as usize]))
            .collect();
        assert_eq!(pieces, expected);
    }

    #[test]
    fn comments_may_touch_the_token_before() {
        reads("205//text", &[(Number, "205"), (Comment, "//text")]);
        reads("50;ticks\r\n", &[(Number, "50"), (Comment, ";ticks"), (Newline, "\r\n")]);
        reads("6/2", &[(Number, "6"), (Slash, "/"), (Number, "2")]);
    }

    #[test]
    fn numbers_keep_what_touches_them() {
        reads(
            "$C8 %101 0x1F",
            &[(Number, "$C8"), (Blank, " "), (Number, "%101"), (Blank, " "), (Number, "0x1F")],
        );
        reads("12abc", &[(Number, "12abc")]);
        reads("1.5e-3-2", &[(Number, "1.5e-3"), (Minus, "-"), (Number, "2")]);
        reads(".5", &[(Number, ".5")]);
        reads("0x1E-2", &[(Number, "0x1E"), (Minus, "-"), (Number, "2")]);
        reads("$1E-2", &[(Number, "$1E"), (Minus, "-"), (Number, "2")]);
        reads("0X1E-2", &[(Number, "0X1E"), (Minus, "-"), (Number, "2")]);
        reads("1x2.5", &[(Number, "1x2.5")]);
        // Whether one is hexadecimal is no matter of the others.
        reads("0x1 1.5", &[(Number, "0x1"), (Blank, " "), (Number, "1.5")]);
        reads(
            "1 0x1E-2",
            &[(Number, "1"), (Blank, " "), (Number, "0x1E"), (Minus, "-"), (Number, "2")],
        );
    }

    #[test]
    fn an_exponent_has_a_sign_only_in_front_of_a_digit() {
        reads("1e+3", &[(Number, "1e+3")]);
        reads("1E-3", &[(Number, "1E-3")]);
        reads("1e*2", &[(Number, "1e"), (Star, "*"), (Number, "2")]);
        reads("1e-x", &[(Number, "1e"), (Minus, "-"), (Name, "x")]);
    }

    #[test]
    fn what_has_no_meaning_is_unknown_character_by_character() {
        reads(".x", &[(Unknown, "."), (Name, "x")]);
        // The neighbours of the letters, and what no name begins with.
        for text in ["!", "@", "[", "`", "{", "?", "'", "\"", "\\", "\0", "\u{7F}", "²", "→"] {
            reads(&text.repeat(2), &[(Unknown, text), (Unknown, text)]);
        }
    }

    #[test]
    fn whatever_shows_nothing_is_blank() {
        reads("A \t\x0B\x0C B", &[(Name, "A"), (Blank, " \t\x0B\x0C "), (Name, "B")]);
        reads("\u{FEFF}A", &[(Blank, "\u{FEFF}"), (Name, "A")]);
    }

    #[test]
    fn an_include_takes_the_rest_of_the_line() {
        reads(
            "#include my file.tmc // x\nA",
            &[
                (Directive, "#include"),
                (Blank, " "),
                (Argument, "my file.tmc"),
                (Blank, " "),
                (Comment, "// x"),
                (Newline, "\n"),
                (Name, "A"),
            ],
        );
        reads("#include\nA", &[(Directive, "#include"), (Newline, "\n"), (Name, "A")]);
        reads("#a\r\nA", &[(Directive, "#a"), (Newline, "\r\n"), (Name, "A")]);
        reads(
            "#a b\rA",
            &[(Directive, "#a"), (Blank, " "), (Argument, "b"), (Newline, "\r"), (Name, "A")],
        );
    }

    #[test]
    fn a_path_may_have_slashes_and_a_comment_may_touch_it() {
        reads("#a /b/c;x", &[(Directive, "#a"), (Blank, " "), (Argument, "/b/c"), (Comment, ";x")]);
        reads("#a b//x", &[(Directive, "#a"), (Blank, " "), (Argument, "b"), (Comment, "//x")]);
        reads("#a ;x", &[(Directive, "#a"), (Blank, " "), (Comment, ";x")]);
        reads("#a //x", &[(Directive, "#a"), (Blank, " "), (Comment, "//x")]);
        reads("#a /", &[(Directive, "#a"), (Blank, " "), (Argument, "/")]);
    }

    #[test]
    fn letters_of_other_languages_belong_to_names() {
        reads("Zähler_1:", &[(Name, "Zähler_1"), (Colon, ":")]);
        reads("Länge²", &[(Name, "Länge²")]);
        reads("Ä\u{A0}€", &[(Name, "Ä"), (Blank, "\u{A0}"), (Unknown, "€")]);
    }

    #[test]
    fn the_end_mark_of_dos_is_blank() {
        reads("STOP\r\n\u{1A}", &[(Name, "STOP"), (Newline, "\r\n"), (Blank, "\u{1A}")]);
    }
}
