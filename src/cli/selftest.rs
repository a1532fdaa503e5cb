//! `etendue selftest`: the hard cases on this adapter, as a table.

use super::args::SelftestArgs;
use super::failure::Failure;
use super::progress::{Progress, clock};
use super::signals::Signals;
use super::{plan, say};
use crate::render::backend;
use crate::selftest::{Backend, Case, Measure, Trouble, cases};
use std::time::Instant;

/// Runs the cases and prints a line for every quantity as soon as its case has run.
pub fn selftest(args: &SelftestArgs) -> Result<(), Failure> {
    let begun = Instant::now();
    plan::check_flags(args.backend, args.adapter.as_deref())?;
    let chosen = choose_cases(args.filter.as_deref())?;
    super::set_threads(args.talk.threads);
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    let (gpu, note) = backend::open(args.backend, args.adapter.as_deref())?;
    if let Some(note) = note.filter(|_| !args.talk.quiet) {
        say!("{note}");
    }
    let backend = match gpu {
        Some(gpu) => Backend::gpu(gpu, signals.stop.clone()),
        None => Backend::cpu(signals.stop.clone()),
    };

    let table = Table {
        markdown: args.markdown,
    };
    super::write_stdout(&table.head(&backend))?;
    let mut progress = Progress::new(&args.talk);
    let (mut measures, mut failed) = (0, 0);
    for (done, case) in chosen.iter().enumerate() {
        progress.step(done, chosen.len(), &case.id());
        let lines = match case.run(&backend) {
            Ok(found) => {
                measures += found.len();
                failed += found.iter().filter(|m| !m.passed()).count();
                table.lines(case, &found)
            }
            Err(Trouble::Unable(why)) => {
                measures += 1;
                failed += 1;
                let why: Vec<&str> = why.split_whitespace().collect();
                table.row([case.row, case.name, &why.join(" "), "", "", "", "FAILED"])
            }
            Err(Trouble::Device(why)) => return Err(Failure::Device(why)),
            Err(Trouble::Stopped) => {
                return Err(Failure::Interrupted {
                    signal: signals.number(),
                });
            }
        };
        progress.aside(|| super::write_stdout(&lines))?;
    }
    progress.finish();
    let verdict = match failed {
        0 => "all passed".to_owned(),
        n => format!("{n} failed"),
    };
    super::write_stdout(&format!(
        "\n{} cases, {measures} quantities: {verdict}\n",
        chosen.len()
    ))?;
    if !args.talk.quiet {
        say!("finished in {}", clock(begun.elapsed().as_secs_f64()));
    }
    if failed > 0 {
        return Err(Failure::Said(1));
    }
    Ok(())
}

fn choose_cases(filter: Option<&str>) -> Result<Vec<Case>, Failure> {
    let wanted = filter.unwrap_or_default().to_lowercase();
    let mut chosen = cases();
    chosen.retain(|c| {
        c.id().to_lowercase().contains(&wanted) || c.what.to_lowercase().contains(&wanted)
    });
    if chosen.is_empty() {
        let names: Vec<String> = cases().iter().map(Case::id).collect();
        return Err(Failure::Input(format!(
            "no case contains {wanted:?}; the cases are: {}",
            names.join(", ")
        )));
    }
    Ok(chosen)
}

/// The layout of the table.
struct Table {
    markdown: bool,
}

/// Column widths except for the last. A longer text shifts the rest of its line.
const WIDTHS: [usize; 6] = [3, 29, 58, 22, 11, 14];

impl Table {
    /// The device under test, and the column names.
    fn head(&self, backend: &Backend) -> String {
        let device = backend.device();
        let version = env!("CARGO_PKG_VERSION");
        let what = format!("{} ({}), etendue {version}\n\n", device.name, device.driver);
        let names = [
            "row",
            "case",
            "quantity",
            "measured",
            "expected",
            "tolerance",
            "verdict",
        ];
        let mut text = what + &self.row(names);
        if self.markdown {
            text += &self.row(["---"; 7]);
        }
        text
    }

    /// The lines of one case. In Markdown the first has its description.
    fn lines(&self, case: &Case, measures: &[Measure]) -> String {
        let mut text = String::new();
        for (k, m) in measures.iter().enumerate() {
            let [measured, expected, tolerance] = m.texts();
            let verdict = if m.passed() { "passed" } else { "FAILED" };
            let name = match k {
                0 if self.markdown => format!("{}: {}", case.name, case.what),
                _ if self.markdown => String::new(),
                _ => case.name.to_owned(),
            };
            text += &self.row([
                case.row,
                &name,
                &m.quantity,
                &measured,
                &expected,
                &tolerance,
                verdict,
            ]);
        }
        text
    }

    fn row(&self, cells: [&str; 7]) -> String {
        if self.markdown {
            return format!("| {} |\n", cells.join(" | "));
        }
        let mut line = String::new();
        for (cell, width) in cells.iter().zip(WIDTHS) {
            line += &format!("{cell:width$} ");
        }
        line + cells[6] + "\n"
    }
}
