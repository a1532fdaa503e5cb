//! The results of a regression run: as JUnit XML and as an HTML page.

use super::{Case, Outcome};
use crate::compare::{Picture, html};
use std::fmt::Write as _;
use std::time::Duration;

const TEMPLATE: &str = include_str!("index.html");

/// A case that has been run.
#[derive(Debug, Clone)]
pub struct Done {
    /// The case.
    pub case: Case,
    /// Its result.
    pub outcome: Outcome,
    /// Golden and actual picture, where there are both.
    pub pictures: Option<[Picture; 2]>,
    /// How long it took.
    pub time: Duration,
}

/// The last line of a list: how many of each.
pub fn summary(done: &[Done]) -> String {
    let words = [
        "passed",
        "FAILED",
        "new",
        "orphaned",
        "unusable",
        "no device",
        "blessed",
    ];
    let count = |word: &str| done.iter().filter(|d| d.outcome.word() == word).count();
    let told: Vec<String> = words
        .into_iter()
        .filter(|w| count(w) > 0)
        .map(|w| format!("{} {}", count(w), w.to_lowercase()))
        .collect();
    let s = if done.len() == 1 { "" } else { "s" };
    format!("{} scene{s}: {}", done.len(), told.join(", "))
}

/// JUnit XML: a failure for what differs or is new or orphaned, an error for what could not be compared.
pub fn junit(done: &[Done]) -> String {
    let errors = done.iter().filter(|d| unusable(d)).count();
    let failures = done.iter().filter(|d| !d.outcome.good()).count() - errors;
    let time: f64 = done.iter().map(|d| d.time.as_secs_f64()).sum();
    let counts = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"{errors}\" time=\"{time:.3}\"",
        done.len()
    );
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(xml, "<testsuites {counts}>");
    let _ = writeln!(xml, "<testsuite name=\"etendue regress\" {counts}>");
    for d in done {
        let detail = xml_text(&d.outcome.detail(&d.case));
        let _ = writeln!(
            xml,
            "<testcase name=\"{}\" classname=\"{}\" time=\"{:.3}\">",
            xml_text(&d.case.name),
            xml_text(&d.case.dir.display().to_string()),
            d.time.as_secs_f64()
        );
        if d.outcome.good() {
            let _ = writeln!(xml, "<system-out>{detail}</system-out>");
        } else {
            let element = if unusable(d) { "error" } else { "failure" };
            let kind = d.outcome.word().to_lowercase();
            let text = match &d.outcome {
                Outcome::Failed { comparison, .. } => xml_text(&comparison.report()),
                _ => String::new(),
            };
            let _ = writeln!(
                xml,
                "<{element} type=\"{kind}\" message=\"{detail}\">{text}</{element}>"
            );
        }
        xml += "</testcase>\n";
    }
    xml + "</testsuite>\n</testsuites>\n"
}

fn unusable(done: &Done) -> bool {
    matches!(done.outcome, Outcome::Unusable(_) | Outcome::NoDevice(_))
}

/// Text for XML, which knows no control characters but tab and line break.
fn xml_text(text: &str) -> String {
    let legal = |c: &char| !c.is_control() || matches!(c, '\t' | '\n');
    html::escape(&text.chars().filter(legal).collect::<String>())
}

/// One page with all cases; it links the reports of failures by their paths from `base`, the page's folder.
pub fn index(done: &[Done], base: &std::path::Path) -> String {
    let mut rows = String::new();
    for d in done {
        let class = if d.outcome.good() { "" } else { "different" };
        let pictures = d.pictures.iter().flatten().map(|p| {
            format!(
                "<img alt=\"{}\" src=\"{}\">",
                html::escape(&p.name),
                html::picture_uri(p)
            )
        });
        let report = match d.outcome {
            Outcome::Failed { unsaved: None, .. } => {
                let path = d.case.report_path();
                let link = path.strip_prefix(base).unwrap_or(&path);
                let link = html::escape(&link.display().to_string());
                format!(" <a href=\"{link}\">Report</a>")
            }
            _ => String::new(),
        };
        rows += &format!(
            "<section class=\"verdict {class}\"><h2>{}: {}</h2><p>{}{report}</p><div class=\"pictures\">{}</div></section>",
            html::escape(&d.case.name),
            d.outcome.word().to_lowercase(),
            html::escape(&d.outcome.detail(&d.case)),
            pictures.collect::<String>()
        );
    }
    html::fill(TEMPLATE, &[("summary", summary(done)), ("rows", rows)])
}
