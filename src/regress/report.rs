//! What a regression run found: JUnit for machines, a page for people.

use super::{Case, Outcome};
use crate::compare::{Picture, html};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use std::time::Duration;

const TEMPLATE: &str = include_str!("index.html");

/// A case that has been run.
#[derive(Debug, Clone)]
pub struct Done {
    /// The case.
    pub case: Case,
    /// What became of it.
    pub outcome: Outcome,
    /// Golden and actual picture, where there are both.
    pub pictures: Option<[Picture; 2]>,
    /// How long it took.
    pub time: Duration,
}

/// The last line of a list: how many of each.
pub fn summary(done: &[Done]) -> String {
    let words = ["passed", "FAILED", "new", "orphaned", "unusable", "blessed"];
    let count = |word: &str| done.iter().filter(|d| d.outcome.word() == word).count();
    let told: Vec<String> = words
        .into_iter()
        .filter(|w| count(w) > 0)
        .map(|w| format!("{} {}", count(w), w.to_lowercase()))
        .collect();
    format!("{} scenes: {}", done.len(), told.join(", "))
}

/// JUnit XML: a failure for what differs or is new or orphaned, an error for what could not be compared.
pub fn junit(done: &[Done]) -> Result<String, String> {
    let mut suite = TestSuite::new("etendue regress");
    for d in done {
        let status = match &d.outcome {
            o if o.good() => TestCaseStatus::success(),
            o => {
                let kind = match o {
                    Outcome::Unusable(_) => NonSuccessKind::Error,
                    _ => NonSuccessKind::Failure,
                };
                let mut status = TestCaseStatus::non_success(kind);
                status.set_type(o.word().to_lowercase());
                status.set_message(o.detail(&d.case));
                if let Outcome::Failed(comparison) = o {
                    status.set_description(comparison.report());
                }
                status
            }
        };
        let mut case = TestCase::new(d.case.name.clone(), status);
        case.set_classname(d.case.dir.display().to_string());
        case.set_time(d.time);
        if d.outcome.good() {
            case.set_system_out(d.outcome.detail(&d.case));
        }
        suite.add_test_case(case);
    }
    let mut report = Report::new("etendue regress");
    report.add_test_suite(suite);
    report.to_string().map_err(|e| e.to_string())
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
            Outcome::Failed(_) => {
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
