//! `etendue regress`: every scene of a folder against its golden picture.

use super::args::RegressArgs;
use super::failure::Failure;
use super::signals::Signals;
use super::{backend, say, write_stdout};
use crate::compare::Limits;
use crate::engine::Engine;
use crate::output::{FileError, atomic};
use crate::regress::report::{self, Done};
use crate::regress::{Case, Outcome, Wanted, bless, cases};
use crate::settings::Settings;
use crate::world::World;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Runs every case and lists them; exit status 1 when one is not as it was, 2 when one can't be compared.
pub fn regress(args: &RegressArgs) -> Result<(), Failure> {
    for path in [&args.html, &args.junit].into_iter().flatten() {
        atomic::check_writable(path)?;
    }
    super::set_threads(args.threads);
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    let cases = cases(&args.dir, args.filter.as_deref().unwrap_or(""))?;
    let usable = cases.iter().filter(|c| c.scene || !args.bless).count();
    if usable == 0 {
        let what = match &args.filter {
            Some(filter) => format!("no scene or golden whose name contains \"{filter}\""),
            None => "no scenes (*.toml) and no goldens".into(),
        };
        return Err(FileError::content(&args.dir, format!("{what}: nothing to compare")).into());
    }
    let mut done = run(args, &cases, &signals);
    done.sort_by(|a, b| a.case.name.cmp(&b.case.name));
    if signals.stop.load(Ordering::Relaxed) {
        let signal = signals.number();
        return Err(Failure::Interrupted { signal });
    }
    finish(args, &done)
}

/// Every case, `--jobs` at a time; those that a signal cut off are left out.
fn run(args: &RegressArgs, cases: &[Case], signals: &Signals) -> Vec<Done> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..usize::from(args.jobs).min(cases.len()) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let Some(one) = run_one(args, case, signals) else {
                        return;
                    };
                    if !args.quiet {
                        say!("{:>8}  {}", one.outcome.word(), case.name);
                    }
                    done.lock()
                        .unwrap_or_else(|poisoned| poisoned.into_inner())
                        .push(one);
                }
            });
        }
    });
    done.into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn run_one(args: &RegressArgs, case: &Case, signals: &Signals) -> Option<Done> {
    let begun = Instant::now();
    let engine = |world: &World, settings: &Settings| -> Result<(Box<dyn Engine>, u64), String> {
        let adapter = args.adapter.as_deref();
        let chosen =
            backend::choose(args.backend, adapter, world, settings).map_err(|e| e.to_string())?;
        Ok((chosen.engine, chosen.tile_pixels))
    };
    let limits = Limits {
        alpha: args.alpha,
        ..Limits::default()
    };
    let (outcome, pictures) = if args.bless && case.scene {
        let wanted = Wanted {
            size: args.size,
            power: args.power,
            most_samples: args.max_spp,
            alpha: args.alpha,
        };
        let outcome = match bless(case, &engine, &wanted, &signals.stop) {
            Ok(Some(blessed)) => Outcome::Blessed(blessed),
            Ok(None) => return None,
            Err(why) => Outcome::Unusable(why),
        };
        (outcome, None)
    } else {
        case.run(&engine, &limits, &signals.stop)?
    };
    Some(Done {
        case: case.clone(),
        outcome,
        pictures,
        time: begun.elapsed(),
    })
}

fn finish(args: &RegressArgs, done: &[Done]) -> Result<(), Failure> {
    let mut list = String::new();
    for d in done {
        let detail = d.outcome.detail(&d.case);
        list += &format!("{:>8}  {}: {detail}\n", d.outcome.word(), d.case.name);
        if let Outcome::Failed(comparison) = &d.outcome {
            for line in comparison.findings_text().lines() {
                list += &format!("          {line}\n");
            }
            list += &format!(
                "          see {} and {}; if the change is meant: --bless --filter {}\n",
                d.case.report_path().display(),
                d.case.actual_path().display(),
                d.case.name
            );
        }
    }
    list += &format!("{}\n", report::summary(done));
    write_stdout(&list)?;
    if let Some(path) = &args.junit {
        let xml = report::junit(done);
        atomic::replace(path, |f| f.write_all(xml.as_bytes()))?;
    }
    if let Some(path) = &args.html {
        let base = path.parent().unwrap_or(Path::new(""));
        let page = report::index(done, base);
        atomic::replace(path, |f| f.write_all(page.as_bytes()))?;
    }
    if done
        .iter()
        .any(|d| matches!(d.outcome, Outcome::Unusable(_)))
    {
        Err(Failure::Said(2))
    } else if done.iter().any(|d| !d.outcome.good()) {
        Err(Failure::Said(1))
    } else {
        Ok(())
    }
}
