//! Key expressions as a Zenoh network matches them, for the forms that nodes subscribe to.

/// Whether a subscription's key expression meets a key: `*` is one chunk, `$*` ends a chunk, `**` ends the expression.
/// No wildcard meets a chunk that begins with `@`.
pub fn meets(expression: &str, key: &str) -> bool {
    let mut chunks = key.split('/');
    for wanted in expression.split('/') {
        if wanted == "**" {
            return !chunks.any(|chunk| chunk.starts_with('@'));
        }
        let Some(chunk) = chunks.next() else { return false };
        let wild = !chunk.starts_with('@');
        let fits = match wanted.strip_suffix("$*") {
            Some(head) => wild && chunk.starts_with(head),
            None if wanted == "*" => wild,
            None => wanted == chunk,
        };
        if !fits {
            return false;
        }
    }
    chunks.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_meet_as_zenoh_says() {
        for (expression, key, met) in [
            ("a/*/c", "a/b/c", true),
            ("a/*/c", "a/@b/c", false),
            ("a/@b/**", "a/@b/c/d", true),
            ("a/**", "a", true),
            ("a/**", "a/b/@c", false),
            ("a/b$*/**", "a/bc/d", true),
            ("a/b$*/**", "a/c", false),
            ("a/b", "a/b/c", false),
            ("a/b/c", "a/b", false),
        ] {
            assert_eq!(meets(expression, key), met, "{expression} {key}");
        }
    }
}
