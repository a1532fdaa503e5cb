//! The results of a regression run as Markdown, for the summary of a job in CI.

use super::Outcome;
use super::report::{About, Done, Filter, advice, made, summary};
use std::fmt::Write as _;

/// A table of all cases, failures first, and below it where each failure differs.
pub(super) fn markdown(done: &[Done], filter: Option<&Filter>, about: &About) -> String {
    let mut text = format!("### {}\n\n", plain(&summary(done, filter)));
    text += "| result | scene | |\n|---|---|---|\n";
    let mut ordered: Vec<&Done> = done.iter().collect();
    ordered.sort_by_key(|d| d.outcome.good());
    for d in &ordered {
        let word = d.outcome.word().to_lowercase();
        let mark = if d.outcome.good() { "" } else { "**" };
        let (name, detail) = (plain(&d.case.name), plain(&d.outcome.detail(&d.case)));
        let _ = writeln!(text, "| {mark}{word}{mark} | {name} | {detail} |");
    }
    for d in &ordered {
        if let Outcome::Failed {
            comparison,
            unsaved,
        } = &d.outcome
        {
            let name = plain(&d.case.name);
            let _ = write!(text, "\n#### {name}\n\n");
            // Indented text is code, whatever is in it.
            for line in comparison.findings_text().lines() {
                let _ = writeln!(text, "    {line}");
            }
            let advice = plain(&advice(&d.case, unsaved.as_deref()));
            let _ = write!(text, "\n{advice}\n");
        }
    }
    let _ = write!(text, "\n<sub>{}</sub>\n", plain(&made(about)));
    text
}

/// Text that Markdown shows as it is, in one line.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\n' | '\r' => out.push(' '),
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '#' | '~' => {
                out.push('\\');
                out.push(c);
            }
            c => out.push(c),
        }
    }
    out
}
