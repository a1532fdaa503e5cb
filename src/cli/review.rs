//! `etendue regress --review`: shows what changed, old beside new, and asks before it replaces a golden.

use super::args::RegressArgs;
use super::regress::{engine, limits, lines, run_one, wanted};
use super::say;
use super::signals::Signals;
use crate::compare::{Side, html};
use crate::files::{FileError, atomic, kind};
use crate::reference::CpuEngine;
use crate::regress::report::{self, About, Done};
use crate::regress::{Candidate, Case, LABELS, Outcome, Trouble};
use crate::render::backend;
use crate::settings::Settings;
use crate::world::World;
use std::io::{self, BufRead as _};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, SystemTime};

/// What is said to a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    Accept,
    Skip,
    Quit,
}

/// Runs the cases one by one, and asks about each that fails, is new, or was changed. Ends at `quit` or at a signal; the cases after
/// that are not in the list.
pub(super) fn review(args: &RegressArgs, cases: &[Case], signals: &Signals) -> Vec<Done> {
    let answers = answers();
    let mut done = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let Some(mut one) = run_one(args, case, signals) else {
            break;
        };
        let answer = match candidate(args, &mut one, signals) {
            Some(candidate) => {
                let answer = ask(&answers, signals);
                if answer == Answer::Accept {
                    let blessed = candidate.put(case, &wanted(args));
                    one.outcome = blessed.map_or_else(Outcome::from, Outcome::Blessed);
                }
                answer
            }
            None => Answer::Skip,
        };
        done.push(one);
        if answer == Answer::Quit {
            let rest = cases.len() - k - 1;
            say!("{rest} of {} scenes were not looked at", cases.len());
            break;
        }
    }
    done
}

/// What could become the golden of a case, after showing it. `None` if there is nothing to ask.
fn candidate(args: &RegressArgs, one: &mut Done, signals: &Signals) -> Option<Candidate> {
    let case = one.case.clone();
    let (outcome, limits) = (&one.outcome, limits(args));
    let old = Side::read(&case.golden_path()).ok();
    let made = match outcome {
        Outcome::Failed { unsaved: None, .. } => {
            Candidate::left(&case, &case.actual_path(), &wanted(args)).map(Some)
        }
        // Nobody knows whether it still passes.
        Outcome::Unusable(_) if kind::is_lfs_pointer(&case.golden_path()) => return None,
        Outcome::Failed { .. } | Outcome::New | Outcome::Unusable(_) => {
            let engine = |world: &World, settings: &Settings| engine(args, world, settings);
            let (wanted, stop) = (wanted(args), &signals.stop);
            Candidate::render(&case, &engine, &wanted, old.as_ref(), stop)
        }
        _ => return None,
    };
    let candidate = match made {
        Ok(candidate) => candidate?,
        // A scene with errors is told in the list already.
        Err(Trouble::Input(_)) if matches!(one.outcome, Outcome::Unusable(_)) => return None,
        Err(trouble) => {
            one.outcome = trouble.into();
            return None;
        }
    };
    let mut told = lines(one);
    // A comparison has left its own page.
    if !matches!(one.outcome, Outcome::Failed { unsaved: None, .. }) {
        let now = candidate.picture();
        let changes = old
            .as_ref()
            .map(|old| (old, candidate.changes(old, &limits)));
        let page = match &changes {
            Some((old, Ok(comparison))) => {
                told += &comparison.report();
                Some(html::page(old, now, LABELS, comparison))
            }
            Some((old, Err(why))) => {
                told += &format!("{why}\n");
                for line in candidate.changed_text(old) {
                    told += &format!("{line}\n");
                }
                None
            }
            None => None,
        };
        let labels = LABELS.into_iter();
        let pictures = [old.clone(), Some(now.clone())];
        one.pictures = labels
            .zip(pictures)
            .filter_map(|(label, picture)| Some((label, picture?)))
            .collect();
        let page = page.unwrap_or_else(|| index(args, one));
        if let Err(e) = write(&case, &page) {
            say!("warning: the page could not be written: {e}");
        }
    }
    let mut told = told.lines().filter(|line| !line.trim().is_empty());
    say!("{}", told.next().unwrap_or_default());
    told.for_each(|line| say!("          {}", line.trim_start()));
    say!("          old beside new: {}", case.report_path().display());
    Some(candidate)
}

/// A page with the pictures of one case.
fn index(args: &RegressArgs, one: &Done) -> String {
    let gpu = backend::open(args.backend, args.adapter.as_deref());
    let gpu = gpu.ok().and_then(|(gpu, _)| gpu);
    let about = About {
        device: gpu.map_or_else(CpuEngine::device_info, |gpu| gpu.info().clone()),
        time: SystemTime::now(),
    };
    let path = one.case.report_path();
    let folder = path.parent().unwrap_or(&one.case.dir);
    report::index(std::slice::from_ref(one), None, &about, folder)
}

/// Writes the page of a case.
fn write(case: &Case, page: &str) -> Result<(), FileError> {
    let path = case.report_path();
    let folder = path.parent().unwrap_or(&case.dir);
    std::fs::create_dir_all(folder).map_err(|e| FileError::io(folder, "cannot create", &e))?;
    atomic::replace(&path, |f| io::Write::write_all(f, page.as_bytes()))
}

/// Lines of stdin. They come from a thread, so that a signal ends the waiting.
fn answers() -> Receiver<String> {
    let (to, from) = channel();
    std::thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if to.send(line).is_err() {
                return;
            }
        }
    });
    from
}

/// Asks until there is an answer. The end of stdin, and a signal, quit.
fn ask(answers: &Receiver<String>, signals: &Signals) -> Answer {
    loop {
        say!("accept it as the golden, skip it, or quit? [a/s/q]");
        let line = loop {
            match answers.recv_timeout(Duration::from_millis(50)) {
                Ok(line) => break line,
                Err(RecvTimeoutError::Timeout) if !signals.stop.load(Ordering::Relaxed) => {}
                Err(_) => return Answer::Quit,
            }
        };
        match line.trim().to_ascii_lowercase().as_str() {
            "a" | "accept" => return Answer::Accept,
            "s" | "skip" => return Answer::Skip,
            "q" | "quit" => return Answer::Quit,
            _ => {}
        }
    }
}
