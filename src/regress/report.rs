//! The results of a regression run: as JUnit XML and as an HTML page.

use super::{Case, Outcome};
use crate::compare::{Side, html};
use crate::date::{iso, utc};
use crate::engine::DeviceInfo;
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, SystemTime};

const TEMPLATE: &str = include_str!("index.html");

/// A case that has been run.
#[derive(Debug, Clone)]
pub struct Done {
    /// The case.
    pub case: Case,
    /// Its result.
    pub outcome: Outcome,
    /// Golden and actual picture, those that there are, with what pages call them.
    pub pictures: Vec<(&'static str, Side)>,
    /// How long it took.
    pub time: Duration,
}

/// Which scenes were chosen.
#[derive(Debug, Clone)]
pub struct Filter {
    /// The flags that chose them.
    pub flags: String,
    /// How many scenes there are without them.
    pub of: usize,
}

impl Filter {
    /// `--filter` and `--scene`; none if they choose all.
    pub fn of(text: Option<&str>, scenes: &[String], of: usize) -> Option<Self> {
        let text = text.iter().map(|text| format!("--filter {text}"));
        let scenes = scenes.iter().map(|name| format!("--scene {name}"));
        let flags: Vec<String> = text.chain(scenes).collect();
        (!flags.is_empty()).then(|| Self {
            flags: flags.join(" "),
            of,
        })
    }
}

/// What a page says about the run.
#[derive(Debug, Clone)]
pub struct About {
    /// What rendered.
    pub device: DeviceInfo,
    /// When it ended.
    pub time: SystemTime,
}

/// The last line of a list: how many of each.
pub fn summary(done: &[Done], filter: Option<&Filter>) -> String {
    let words = [
        "passed",
        "FAILED",
        "new",
        "orphaned",
        "unusable",
        "no device",
        "no access",
        "blessed",
        "kept",
    ];
    let count = |word: &str| done.iter().filter(|d| d.outcome.word() == word).count();
    let told: Vec<String> = words
        .into_iter()
        .filter(|w| count(w) > 0)
        .map(|w| format!("{} {}", count(w), w.to_lowercase()))
        .collect();
    let scenes = |n: usize| format!("{n} scene{}", if n == 1 { "" } else { "s" });
    let which = match filter {
        Some(Filter { flags, of }) => format!("{} of {} ({flags})", done.len(), scenes(*of)),
        None => scenes(done.len()),
    };
    format!("{which}: {}", told.join(", "))
}

/// JUnit XML: a failure for what differs or is new or orphaned, an error for what could not be compared.
pub fn junit(done: &[Done], about: &About) -> String {
    let errors = done.iter().filter(|d| unusable(d)).count();
    let failures = done.iter().filter(|d| !d.outcome.good()).count() - errors;
    let time: f64 = done.iter().map(|d| d.time.as_secs_f64()).sum();
    let counts = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"{errors}\" time=\"{time:.3}\"",
        done.len()
    );
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(xml, "<testsuites {counts}>");
    let _ = writeln!(
        xml,
        "<testsuite name=\"etendue regress\" {counts} timestamp=\"{}\">",
        iso(about.time)
    );
    let adapter = format!("{}, {}", about.device.name, about.device.driver);
    let _ = writeln!(xml, "<properties>");
    for (name, value) in [
        ("etendue", env!("CARGO_PKG_VERSION")),
        ("adapter", &adapter),
    ] {
        let value = xml_text(value);
        let _ = writeln!(xml, "<property name=\"{name}\" value=\"{value}\"/>");
    }
    let _ = writeln!(xml, "</properties>");
    for d in done {
        let detail = xml_text(&d.outcome.detail(&d.case));
        let _ = writeln!(
            xml,
            "<testcase name=\"{}\" classname=\"{}\" time=\"{:.3}\">",
            xml_text(&d.case.name),
            xml_text(&folder(&d.case.dir)),
            d.time.as_secs_f64()
        );
        if d.outcome.good() {
            let _ = writeln!(xml, "<system-out>{detail}</system-out>");
        } else {
            let element = if unusable(d) { "error" } else { "failure" };
            let kind = d.outcome.word().to_lowercase();
            let text = match &d.outcome {
                Outcome::Failed {
                    comparison,
                    unsaved,
                } => {
                    let advice = advice(&d.case, unsaved.as_deref());
                    xml_text(&format!("{}\n{advice}\n", comparison.report()))
                }
                _ => detail.clone(),
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

/// Where the evidence of a failure is, and what to type if the change is intended.
pub fn advice(case: &Case, unsaved: Option<&str>) -> String {
    let evidence = match unsaved {
        None => format!(
            "see {} and {}",
            case.report_path().display(),
            case.actual_path().display()
        ),
        Some(why) => format!("its film and page could not be saved: {why}"),
    };
    let command = case.bless_command();
    format!("{evidence}; if the change is intended, re-create the golden: {command}")
}

/// The name of a folder, whatever path leads to it.
fn folder(dir: &Path) -> String {
    let real = dir.canonicalize();
    let name = real.as_deref().unwrap_or(dir).file_name();
    name.unwrap_or_default().to_string_lossy().into_owned()
}

fn unusable(done: &Done) -> bool {
    matches!(
        done.outcome,
        Outcome::Unusable(_) | Outcome::NoDevice(_) | Outcome::NoAccess(_)
    )
}

/// Text for XML, which knows no control characters but tab and line break.
fn xml_text(text: &str) -> String {
    let legal = |c: &char| !c.is_control() || matches!(c, '\t' | '\n');
    html::escape(&text.chars().filter(legal).collect::<String>())
}

/// One page with all cases, failures first; it links the reports of failures by their paths from `base`, the page's folder.
pub fn index(done: &[Done], filter: Option<&Filter>, about: &About, base: &Path) -> String {
    let mut ordered: Vec<&Done> = done.iter().collect();
    ordered.sort_by_key(|d| d.outcome.good());
    let mut rows = String::new();
    for d in ordered {
        let class = if d.outcome.good() { "" } else { "different" };
        let name = html::escape(&d.case.name);
        let pictures = d.pictures.iter().map(|(label, p)| {
            format!(
                "<figure><img alt=\"{name}, {label}\" src=\"{}\"><figcaption>{label}</figcaption></figure>",
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
            "<section class=\"verdict {class}\"><h2>{name}: {}</h2><p>{}{report}</p><div class=\"pictures\">{}</div></section>",
            d.outcome.word().to_lowercase(),
            html::escape(&d.outcome.detail(&d.case)),
            pictures.collect::<String>()
        );
    }
    let values = [
        ("summary", html::escape(&summary(done, filter))),
        ("made", html::escape(&made(about))),
        ("rows", rows),
    ];
    html::fill(TEMPLATE, &values)
}

/// What rendered, and when.
pub(super) fn made(about: &About) -> String {
    let About { device, time } = about;
    format!(
        "etendue {} on {}, {}; {}",
        env!("CARGO_PKG_VERSION"),
        device.name,
        device.driver,
        utc(*time)
    )
}

/// The results as Markdown.
pub fn markdown(done: &[Done], filter: Option<&Filter>, about: &About) -> String {
    super::summary::markdown(done, filter, about)
}
