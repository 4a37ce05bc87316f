//! Text to tokens (IDL 4.2, 7.2).

use super::error::IdlError;

/// A piece of IDL.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    /// A word; the `_` that escapes a keyword is taken away.
    Word(String),
    /// A whole number.
    Integer(i128),
    /// A number with a point or an exponent.
    Float(f64),
    /// A text in quotes; neighbours are one.
    Text(String),
    /// A character in quotes.
    Character(char),
    /// Punctuation.
    Sign(char),
    /// `::`
    Scope,
}

/// A token with its line.
pub(super) type Placed = (Token, usize);

/// The tokens of a text without comments and directives.
pub(super) fn tokens(file: &str, text: &str) -> Result<Vec<Placed>, IdlError> {
    let mut lexer = Lexer { file, rest: text, line: 1 };
    let mut tokens: Vec<Placed> = Vec::new();
    while let Some((token, line)) = lexer.next()? {
        match (tokens.last_mut(), &token) {
            (Some((Token::Text(before), _)), Token::Text(more)) => before.push_str(more),
            _ => tokens.push((token, line)),
        }
    }
    Ok(tokens)
}

struct Lexer<'a> {
    file: &'a str,
    rest: &'a str,
    line: usize,
}

impl<'a> Lexer<'a> {
    fn error(&self, what: impl Into<String>) -> IdlError {
        IdlError { file: self.file.to_owned(), line: self.line, what: what.into() }
    }

    fn skip(&mut self, bytes: usize) -> &'a str {
        let (skipped, rest) = self.rest.split_at(bytes);
        self.line += skipped.matches('\n').count();
        self.rest = rest;
        skipped
    }

    fn skip_while(&mut self, wanted: impl Fn(char) -> bool) -> &'a str {
        let end = self.rest.find(|c| !wanted(c)).unwrap_or(self.rest.len());
        self.skip(end)
    }

    fn next(&mut self) -> Result<Option<Placed>, IdlError> {
        self.skip_while(char::is_whitespace);
        let line = self.line;
        let Some(first) = self.rest.chars().next() else { return Ok(None) };
        let token = match first {
            '"' => Token::Text(self.quoted('"')?),
            '\'' => {
                let text = self.quoted('\'')?;
                let mut units = text.chars();
                match (units.next(), units.next()) {
                    (Some(unit), None) => Token::Character(unit),
                    _ => return Err(self.error("one character belongs between `'` and `'`")),
                }
            }
            'L' if self.rest[1..].starts_with(['"', '\'']) => {
                self.skip(1);
                return self.next();
            }
            _ if is_word(first) && !first.is_ascii_digit() => {
                let word = self.skip_while(is_word);
                Token::Word(word.strip_prefix('_').unwrap_or(word).to_owned())
            }
            _ if first.is_ascii_digit() || first == '.' => self.number()?,
            ':' if self.rest.starts_with("::") => {
                self.skip(2);
                Token::Scope
            }
            '{' | '}' | '<' | '>' | '(' | ')' | '[' | ']' | ',' | ';' | ':' | '=' | '@' | '+' | '-' | '*'
            | '/' | '%' | '|' | '&' | '^' | '~' => {
                self.skip(1);
                Token::Sign(first)
            }
            _ => {
                return Err(
                    self.error(format!("`{}` is no part of IDL: take it out", first.escape_default()))
                );
            }
        };
        Ok(Some((token, line)))
    }

    fn quoted(&mut self, quote: char) -> Result<String, IdlError> {
        let mut text = String::new();
        let mut chars = self.rest.char_indices().skip(1);
        let not_ended = |it: &Self| it.error(format!("a text that is not ended: put `{quote}` at its end"));
        while let Some((at, c)) = chars.next() {
            match c {
                '\n' => return Err(not_ended(self)),
                '\\' => {
                    let Some((_, escaped)) = chars.next() else { return Err(not_ended(self)) };
                    text.push(match escaped {
                        'n' => '\n',
                        't' => '\t',
                        'r' => '\r',
                        '0' => '\0',
                        '\\' | '"' | '\'' | '?' => escaped,
                        _ => {
                            return Err(self
                                .error(format!("the escape `\\{}` is not read", escaped.escape_default())));
                        }
                    });
                }
                c if c == quote => {
                    self.skip(at + c.len_utf8());
                    return Ok(text);
                }
                c => text.push(c),
            }
        }
        Err(not_ended(self))
    }

    fn number(&mut self) -> Result<Token, IdlError> {
        let bytes = self.rest.as_bytes();
        let mut end = 0;
        while let Some(&byte) = bytes.get(end) {
            let signed = matches!(byte, b'+' | b'-')
                && matches!(bytes.get(end.wrapping_sub(1)), Some(b'e' | b'E'))
                && !self.rest.starts_with("0x");
            if !(byte.is_ascii_alphanumeric() || byte == b'.' || signed) {
                break;
            }
            end += 1;
        }
        let text = self.skip(end.max(1));
        let read = if let Some(digits) = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
            i128::from_str_radix(digits, 16).ok().map(Token::Integer)
        } else if text.contains(['.', 'e', 'E']) {
            text.trim_end_matches(['f', 'F', 'd', 'D', 'l', 'L']).parse().ok().map(Token::Float)
        } else if text.len() > 1 && text.starts_with('0') {
            i128::from_str_radix(text, 8).ok().map(Token::Integer)
        } else {
            text.trim_end_matches(['u', 'U', 'l', 'L']).parse().ok().map(Token::Integer)
        };
        read.ok_or_else(|| self.error(format!("`{}` is no number", crate::name::shortened(text))))
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}
