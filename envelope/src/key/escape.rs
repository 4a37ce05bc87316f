//! Names as chunks of a key: separators become `/`, everything unusual becomes `%XX`.
//!
//! A separator (`.` or `::`) becomes `/` unless the chunk before it is empty or it ends the text: Zenoh knows no empty
//! chunks. Then each of its bytes is escaped, as is every byte outside `[A-Za-z0-9_-]`.

/// How a name was spelled before its separators became `/`: the header says it, the key does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Spelling {
    /// Each `/` was a `.`; a name without separators too.
    Dots,
    /// Each `/` was a `::`.
    Colons,
    /// Both occur: this is the exact text.
    Exact(String),
}

const HEX: &[u8; 16] = b"0123456789ABCDEF";

fn push_escaped(byte: u8, out: &mut String) {
    out.push('%');
    out.push(char::from(HEX[usize::from(byte >> 4)]));
    out.push(char::from(HEX[usize::from(byte & 15)]));
}

fn separator(rest: &[u8]) -> usize {
    match rest {
        [b'.', ..] => 1,
        [b':', b':', ..] => 2,
        _ => 0,
    }
}

/// Appends a name as chunks of a key.
pub fn escape(text: &str, out: &mut String) {
    let mut rest = text.as_bytes();
    let mut chunk_is_empty = true;
    while !rest.is_empty() {
        let width = separator(rest);
        if width > 0 && !chunk_is_empty && rest.len() > width {
            out.push('/');
            chunk_is_empty = true;
            rest = &rest[width..];
            continue;
        }
        let taken = width.max(1);
        for &byte in &rest[..taken] {
            if width == 0 && (byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-') {
                out.push(char::from(byte));
            } else {
                push_escaped(byte, out);
            }
        }
        chunk_is_empty = false;
        rest = &rest[taken..];
    }
}

/// Appends the key expression of a text prefix. What ends in a separator or half of one may be followed by either in a
/// longer name, so it is left off: the expression matches too much, never too little.
pub fn escape_prefix(text: &str, out: &mut String) {
    let certain = text.trim_end_matches(['.', ':']);
    if certain.is_empty() {
        out.push_str("**");
        return;
    }
    escape(certain, out);
    out.push_str("$*/**");
}

/// How a name is spelled.
pub fn spelling(text: &str) -> Spelling {
    let (mut dots, mut colons) = (false, false);
    let mut rest = text.as_bytes();
    while !rest.is_empty() {
        let width = separator(rest);
        dots |= width == 1;
        colons |= width == 2;
        rest = &rest[width.max(1)..];
    }
    match (dots, colons) {
        (true, true) => Spelling::Exact(text.to_owned()),
        (false, true) => Spelling::Colons,
        _ => Spelling::Dots,
    }
}

/// The name that stands in chunks of a key.
///
/// # Errors
/// What is wrong, in words: an escape that is none, or chunks that are not the ones that the name has.
pub fn unescape(chunks: &str, spelling: &Spelling) -> Result<String, String> {
    let text = match spelling {
        Spelling::Exact(text) => text.clone(),
        Spelling::Dots => unescape_with(chunks, ".")?,
        Spelling::Colons => unescape_with(chunks, "::")?,
    };
    let mut again = String::with_capacity(chunks.len());
    escape(&text, &mut again);
    if again == chunks { Ok(text) } else { Err(format!("the chunks `{chunks}` are not those of `{text}`")) }
}

fn unescape_with(chunks: &str, separator: &str) -> Result<String, String> {
    let mut text = Vec::with_capacity(chunks.len());
    let mut bytes = chunks.bytes();
    while let Some(byte) = bytes.next() {
        match byte {
            b'/' => text.extend_from_slice(separator.as_bytes()),
            b'%' => {
                let digits = (bytes.next().and_then(hex), bytes.next().and_then(hex));
                let (Some(high), Some(low)) = digits else {
                    return Err(format!("`{chunks}` holds a `%` without two digits"));
                };
                text.push(high << 4 | low);
            }
            other => text.push(other),
        }
    }
    String::from_utf8(text).map_err(|_| format!("`{chunks}` is not UTF-8 once its escapes are read"))
}

fn hex(digit: u8) -> Option<u8> {
    HEX.iter().position(|&h| h == digit).and_then(|n| u8::try_from(n).ok())
}
