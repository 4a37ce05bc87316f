//! JUnit XML, as continuous integration reads it.

use super::{Report, Verdict};
use std::fmt::Write;

/// The whole document.
pub(super) fn render(report: &Report) -> String {
    let (tests, failures) = (report.clauses.len(), report.count(Verdict::Broken));
    let skipped = report.count(Verdict::NotSeen);
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let suite = format!("name=\"UMAA SO ICD 5.2.1\" tests=\"{tests}\" failures=\"{failures}\" errors=\"0\"");
    // Writing to a string cannot fail.
    let _ = writeln!(xml, "<testsuite {suite} skipped=\"{skipped}\">");
    for found in &report.clauses {
        let case =
            format!("classname=\"ICD {}\" name=\"{}\"", escaped(found.clause.place()), found.clause.name());
        let _ = match (found.verdict(), &found.first) {
            (Verdict::Held, _) => writeln!(xml, "  <testcase {case}/>"),
            (Verdict::NotSeen, _) => writeln!(xml, "  <testcase {case}><skipped/></testcase>"),
            (Verdict::Broken, first) => {
                let seen = first.as_ref().map(|first| {
                    format!("{:.3} s, {}: {}", first.at.elapsed().as_secs_f64(), first.topic, first.text)
                });
                let (text, seen) = (escaped(found.clause.text()), escaped(&seen.unwrap_or_default()));
                writeln!(xml, "  <testcase {case}><failure message=\"{text}\">{seen}</failure></testcase>")
            }
        };
    }
    xml.push_str("</testsuite>\n");
    xml
}

/// What XML cannot hold at all becomes a question mark.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('?'),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{Clause, ClauseReport, Evidence};
    use aldis_envelope::Monotonic;

    #[test]
    fn what_others_wrote_cannot_break_the_document() {
        let text = "\"<a>&\u{1}\n".to_owned();
        let first = Some(Evidence { at: Monotonic::START, topic: "UMAA::SO::A::B".to_owned(), text });
        let broken = ClauseReport { clause: Clause::Range, held: 1, broken: 2, first };
        let unseen = ClauseReport { clause: Clause::Key, held: 0, broken: 0, first: None };
        let xml = render(&Report { observations: 3, open: 0, unfollowed: 0, clauses: vec![broken, unseen] });
        assert!(xml.contains("tests=\"2\" failures=\"1\" errors=\"0\" skipped=\"1\""), "{xml}");
        assert!(xml.contains("UMAA::SO::A::B: &quot;&lt;a&gt;&amp;? </failure>"), "{xml}");
        assert!(xml.contains("name=\"key\"><skipped/>"), "{xml}");
    }
}
