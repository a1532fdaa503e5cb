//! `etendue regress`: every scene of a folder against its golden picture.

use super::args::RegressArgs;
use super::failure::Failure;
use super::files::{Files, is_stdout, write_text};
use super::progress::Progress;
use super::signals::Signals;
use super::{plan, review, say, write_stdout};
use crate::compare::Limits;
use crate::engine::{DeviceInfo, Engine};
use crate::files::{FileError, atomic};
use crate::reference::CpuEngine;
use crate::regress::report::{self, About, Done, Filter};
use crate::regress::{Case, LABELS, Outcome, Trouble, Wanted, almost_scenes, cases, left_films};
use crate::render::{Error, backend, memory};
use crate::scene::parse;
use crate::settings::Settings;
use crate::world::World;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Instant, SystemTime};

/// Runs every case and lists the results. The exit status is 1 if one differs, 2 if one can't be compared.
pub fn regress(args: &RegressArgs) -> Result<(), Failure> {
    plan::check_flags(args.backend, args.adapter.as_deref())?;
    super::set_threads(args.talk.threads);
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    let all = cases(&args.dir)?;
    let unknown = |name: &&String| all.iter().all(|case| case.name != **name);
    if let Some(name) = args.scene.iter().find(unknown) {
        let why = format!("no scene or golden has the name \"{name}\"");
        return Err(FileError::content(&args.dir, why).into());
    }
    let filter = Filter::of(args.filter.as_deref(), &args.scene, all.len());
    let chosen = |case: &Case| {
        let text = args.filter.as_deref().unwrap_or_default();
        case.name.contains(text) && (args.scene.is_empty() || args.scene.contains(&case.name))
    };
    let cases: Vec<Case> = all.into_iter().filter(chosen).collect();
    if !args.talk.quiet {
        for path in almost_scenes(&args.dir)? {
            let path = path.display();
            say!("note: {path} is ignored: the name of a scene ends in .toml");
        }
    }
    let usable = cases.iter().filter(|c| c.scene || !args.bless).count();
    if usable == 0 {
        let what = match &args.filter {
            Some(filter) => format!("no scene or golden whose name contains \"{filter}\""),
            None => "no scenes (*.toml) and no goldens".into(),
        };
        return Err(FileError::content(&args.dir, format!("{what}, so nothing to compare")).into());
    }
    check_files(args, &cases)?;
    if let Some(results) = &args.accept {
        return accept(args, &cases, filter.as_ref(), results);
    }
    // Without the selected adapter every case would fail.
    let (gpu, note) = backend::open(args.backend, args.adapter.as_deref())?;
    if let Some(note) = note.filter(|_| !args.talk.quiet) {
        say!("{note}");
    }
    let device = gpu.map_or_else(CpuEngine::device_info, |gpu| gpu.info().clone());
    let mut done = if args.review {
        review::review(args, &cases, &signals)
    } else {
        run(args, &cases, &signals)
    };
    done.sort_by(|a, b| a.case.name.cmp(&b.case.name));
    let finished = finish(args, &done, filter.as_ref(), device);
    if signals.stop.load(Ordering::Relaxed) {
        let (done, of) = (done.len(), cases.len());
        say!("interrupted: {done} of {of} scenes were done");
        let signal = signals.number();
        return Err(Failure::Interrupted { signal });
    }
    finished
}

/// Refuses output files that would overwrite a scene, a golden, or each other.
fn check_files(args: &RegressArgs, cases: &[Case]) -> Result<(), Failure> {
    if args.html.is_none() && args.junit.is_none() && args.summary.is_none() {
        return Ok(());
    }
    let mut files = Files::default();
    for case in cases {
        files.reads("a scene", &case.scene_path())?;
        files.reads("a golden picture", &case.golden_path())?;
        files.reads("the film of a failed scene", &case.actual_path())?;
        files.reads("the report of a failed scene", &case.report_path())?;
        // Errors in a scene are reported when its case runs.
        for file in parse::read(&case.scene_path())
            .iter()
            .flat_map(|s| &s.row_files)
        {
            files.reads("a table of a scene", &file.path)?;
        }
    }
    if let Some(path) = &args.html {
        files.writes("--html", path)?;
    }
    if let Some(path) = &args.junit {
        files.writes_text("--junit", path)?;
    }
    if let Some(path) = &args.summary {
        files.writes("--summary", path)?;
    }
    Ok(())
}

/// Runs every case, `--jobs` at a time. Cases that a signal interrupted are left out.
fn run(args: &RegressArgs, cases: &[Case], signals: &Signals) -> Vec<Done> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let progress = Mutex::new(Progress::new(&args.talk));
    std::thread::scope(|scope| {
        for _ in 0..usize::from(args.jobs).min(cases.len()) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let finished = done.lock().unwrap_or_else(|p| p.into_inner()).len();
                    let mut shown = progress.lock().unwrap_or_else(|p| p.into_inner());
                    shown.step(finished, cases.len(), &case.name);
                    drop(shown);
                    let Some(one) = run_one(args, case, signals) else {
                        return;
                    };
                    if !one.outcome.good() {
                        let progress = progress.lock().unwrap_or_else(|p| p.into_inner());
                        progress.news(&format!("{}: {}", one.case.name, one.outcome.word()));
                    }
                    done.lock().unwrap_or_else(|p| p.into_inner()).push(one);
                }
            });
        }
    });
    done.into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The engine that the flags select, for a scene.
pub(super) fn engine(
    args: &RegressArgs,
    world: &World,
    settings: &Settings,
) -> Result<(Box<dyn Engine>, u64), Trouble> {
    let [width, height] = settings.size.map(u64::from);
    let adapter = args.adapter.as_deref();
    let chosen = memory::check(width * height, true)
        .and_then(|()| backend::choose(args.backend, adapter, world, settings, |_| ()));
    match chosen {
        Ok(chosen) => Ok((chosen.engine, chosen.tile_pixels)),
        Err(Error::Device(why)) => Err(Trouble::Device(why)),
        Err(other) => Err(Trouble::Input(other.to_string())),
    }
}

/// Runs a case. `None` if a signal interrupted it.
pub(super) fn run_one(args: &RegressArgs, case: &Case, signals: &Signals) -> Option<Done> {
    let begun = Instant::now();
    let engine = |world: &World, settings: &Settings| engine(args, world, settings);
    let (outcome, pictures) = if args.bless && case.scene {
        case.bless(&engine, &wanted(args), &limits(args), &signals.stop)?
    } else {
        case.run(&engine, &limits(args), &args.layers, &signals.stop)?
    };
    Some(Done {
        case: case.clone(),
        outcome,
        pictures: LABELS
            .into_iter()
            .zip(pictures.into_iter().flatten())
            .collect(),
        time: begun.elapsed(),
    })
}

/// Makes goldens of the films that a failed run left.
fn accept(
    args: &RegressArgs,
    cases: &[Case],
    filter: Option<&Filter>,
    results: &Path,
) -> Result<(), Failure> {
    let films = left_films(results)?;
    for (name, film) in &films {
        let known = cases.iter().any(|case| case.scene && case.name == *name);
        if !known && filter.is_none() {
            let (film, dir) = (film.display(), args.dir.display());
            say!("note: {film} is ignored: {dir} has no scene of this name");
        }
    }
    let mut done = Vec::new();
    for case in cases.iter().filter(|case| case.scene) {
        let begun = Instant::now();
        if let Some(film) = films.get(&case.name) {
            done.push(Done {
                case: case.clone(),
                outcome: case.accept(film, &wanted(args), &limits(args)),
                pictures: Vec::new(),
                time: begun.elapsed(),
            });
        }
    }
    if done.is_empty() {
        let why = format!("no film of a scene in {}", args.dir.display());
        return Err(FileError::content(results, why).into());
    }
    tell(args, &done, filter)?;
    verdict(&done)
}

pub(super) fn wanted(args: &RegressArgs) -> Wanted {
    Wanted {
        size: args.size,
        power: args.power,
        most_samples: args.max_spp,
        alpha: args.alpha,
        layers: args.layers.clone(),
    }
}

pub(super) fn limits(args: &RegressArgs) -> Limits {
    Limits {
        alpha: args.alpha,
        ..Limits::default()
    }
}

fn finish(
    args: &RegressArgs,
    done: &[Done],
    filter: Option<&Filter>,
    device: DeviceInfo,
) -> Result<(), Failure> {
    let about = About {
        device,
        time: SystemTime::now(),
    };
    tell(args, done, filter)?;
    if let Some(path) = &args.junit {
        write_text(path, &report::junit(done, &about))?;
    }
    if let Some(path) = &args.html {
        let base = path.parent().unwrap_or(Path::new(""));
        let page = report::index(done, filter, &about, base);
        atomic::replace(path, |f| f.write_all(page.as_bytes()))?;
    }
    if let Some(path) = &args.summary {
        let text = report::markdown(done, filter, &about);
        atomic::replace(path, |f| f.write_all(text.as_bytes()))?;
    }
    verdict(done)
}

/// Prints the results: on stdout, unless JUnit XML goes there.
fn tell(args: &RegressArgs, done: &[Done], filter: Option<&Filter>) -> Result<(), Failure> {
    let told = done
        .iter()
        .filter(|d| !(args.talk.quiet && d.outcome.good()));
    let mut list: String = told.map(lines).collect();
    if !args.talk.quiet || !list.is_empty() {
        list += &format!("{}\n", report::summary(done, filter));
    }
    if args.junit.as_deref().is_some_and(is_stdout) {
        if !args.talk.quiet {
            say!("{}", list.trim_end());
        }
    } else {
        write_stdout(&list)?;
    }
    for d in done {
        if let Outcome::Blessed(golden) = &d.outcome {
            for warning in golden.warnings(&wanted(args)) {
                say!("warning: {}: {warning}", d.case.name);
            }
        }
    }
    Ok(())
}

/// A case in the list, with where it differs.
pub(super) fn lines(d: &Done) -> String {
    let detail = d.outcome.detail(&d.case);
    let mut lines = format!("{:>9}  {}: {detail}\n", d.outcome.word(), d.case.name);
    if let Outcome::Failed {
        comparison,
        unsaved,
    } = &d.outcome
    {
        for line in comparison.findings_text().lines() {
            lines += &format!("          {line}\n");
        }
        let advice = report::advice(&d.case, unsaved.as_deref());
        lines += &format!("          {advice}\n");
    }
    lines
}

/// The exit status for the results.
fn verdict(done: &[Done]) -> Result<(), Failure> {
    let any = |what: fn(&Outcome) -> bool| done.iter().any(|d| what(&d.outcome));
    if any(|o| matches!(o, Outcome::NoDevice(_))) {
        Err(Failure::Said(3))
    } else if any(|o| matches!(o, Outcome::NoAccess(_))) {
        Err(Failure::Said(4))
    } else if any(|o| matches!(o, Outcome::Unusable(_))) {
        Err(Failure::Said(2))
    } else if done.iter().any(|d| !d.outcome.good()) {
        Err(Failure::Said(1))
    } else {
        Ok(())
    }
}
