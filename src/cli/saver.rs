//! Writes files during a render: checkpoints of the film, and the `--watch` picture.

use super::args::RenderArgs;
use super::progress::Progress;
use crate::date::utc;
use crate::engine::DeviceInfo;
use crate::files::FileError;
use crate::film::Film;
use crate::film::error::RelativeError;
use crate::output::store;
use crate::output::write_png;
use crate::provenance::Provenance;
use crate::render;
use crate::run::{self, Tally};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Default time between two checkpoints.
const CHECKPOINT: Duration = Duration::from_secs(60);

/// Shortest time between two `--watch` pictures.
const WATCH: Duration = Duration::from_secs(2);

/// Writing the `--watch` picture takes at most 1/20 of the time: large ones are written less often.
const WATCH_SHARE: u32 = 20;

/// A file that still can't be written, for the same reason, is warned of again after this time.
const WARN_AGAIN: Duration = Duration::from_secs(3600);

/// Saves a film that can't be saved under its name in the working directory, or else in the one for temporary files. Its new name is
/// that of no other file.
pub fn rescue(path: &Path, film: &Film, provenance: &Provenance) -> Option<PathBuf> {
    let stem = path.file_stem()?.to_string_lossy();
    let name = format!("{stem}.rescued-{}.npz", std::process::id());
    let folders = [PathBuf::new(), std::env::temp_dir()];
    let mut files = folders.into_iter().map(|folder| folder.join(&name));
    files.find(|file| !file.exists() && store::save(file, film, provenance).is_ok())
}

/// Writes each file at its interval.
pub struct Saver<'a> {
    args: &'a RenderArgs,
    /// The film's provenance before this run.
    before: &'a Provenance,
    device: &'a DeviceInfo,
    checkpoint: Timer,
    watch: Timer,
}

impl<'a> Saver<'a> {
    /// For a run on `device` that resumes from `before`.
    pub fn new(args: &'a RenderArgs, before: &'a Provenance, device: &'a DeviceInfo) -> Self {
        Self {
            args,
            before,
            device,
            checkpoint: Timer::new(args.checkpoint.unwrap_or(CHECKPOINT)),
            watch: Timer::new(WATCH),
        }
    }

    /// The film's provenance, including this run, and its relative error.
    pub fn provenance(&self, film: &Film, tally: &Tally) -> (Provenance, RelativeError) {
        render::provenance(self.before, self.device, film, tally)
    }

    /// Writes the files that are due. If one can't be written, prints a warning and goes on: hours of rendering are worth
    /// more than this checkpoint, and the next may succeed.
    pub fn meanwhile(&mut self, film: &Film, tally: &Tally, progress: &Progress) {
        if self.checkpoint.is_due()
            && let Some(path) = self.args.film.as_deref()
        {
            let began = Instant::now();
            let (provenance, _) = self.provenance(film, tally);
            let saved = store::save(path, film, &provenance);
            self.checkpoint.done(began, saved, progress);
        }
        self.watch.interval = WATCH.max(self.watch.took * WATCH_SHARE);
        if self.watch.is_due()
            && let Some(path) = self.args.watch.as_deref()
        {
            let began = Instant::now();
            let (provenance, _) = self.provenance(film, tally);
            let written = write_png(path, film, &provenance, self.args.pictures.exposure);
            self.watch.done(began, written, progress);
        }
    }
}

/// The longest call to the engine that still allows a checkpoint at every interval.
pub fn longest_call(args: &RenderArgs) -> Duration {
    match (&args.film, args.checkpoint) {
        (Some(_), Some(interval)) => run::CALL.min(interval / 4),
        _ => run::CALL,
    }
}

/// Decides when a file is due.
struct Timer {
    interval: Duration,
    /// When the last save began.
    began: Instant,
    /// How long the last save took.
    took: Duration,
    /// When `is_due` was last called.
    asked: Instant,
    /// The last warning, until a save succeeds.
    warned: Option<(String, Instant)>,
}

impl Timer {
    fn new(interval: Duration) -> Self {
        let now = Instant::now();
        Self {
            interval,
            began: now,
            took: Duration::ZERO,
            asked: now,
            warned: None,
        }
    }

    fn is_due(&mut self) -> bool {
        let call = self.asked.elapsed();
        self.asked = Instant::now();
        is_due(self.interval, self.began.elapsed(), call, self.took)
    }

    fn done(&mut self, began: Instant, result: Result<(), FileError>, progress: &Progress) {
        match result {
            Ok(()) => self.warned = None,
            Err(e) => self.warn(e.to_string(), progress),
        }
        self.began = began;
        self.asked = Instant::now();
        self.took = began.elapsed();
    }
}

impl Timer {
    /// Warns once of each reason, and again after a long time: a full disk may stay full for a week.
    fn warn(&mut self, why: String, progress: &Progress) {
        let told = self.warned.as_ref();
        if told.is_some_and(|(told, when)| *told == why && when.elapsed() < WARN_AGAIN) {
            return;
        }
        let now = utc(SystemTime::now());
        progress.say(&format!(
            "warning: {why} ({now}); it is tried again until the end"
        ));
        self.warned = Some((why, Instant::now()));
    }
}

/// Whether to save the film now. The last save began `since` ago and took `took`; the next chance comes a `call` later.
/// If the process is killed before this save is complete, everything since the last one began is lost, and that must not
/// exceed the interval. Saves that take longer than half the interval leave at least as much time for rendering.
fn is_due(interval: Duration, since: Duration, call: Duration, took: Duration) -> bool {
    since + call + took >= interval && since >= 2 * took
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The longest rendering that a kill can lose, and the share of time spent on saving, for constant `call` and `took`.
    fn simulate(interval: u64, call: u64, took: u64) -> (Duration, f64) {
        let [interval, call, took] = [interval, call, took].map(Duration::from_millis);
        let (mut now, mut began, mut last_took) = (Duration::ZERO, Duration::ZERO, Duration::ZERO);
        let (mut worst, mut saves) = (Duration::ZERO, 0);
        while now < 1000 * interval {
            now += call;
            if is_due(interval, now - began, call, last_took) {
                let before = began;
                (began, last_took) = (now, took);
                now += took;
                saves += 1;
                // The duration of the first save was not known in advance.
                if saves > 1 {
                    worst = worst.max(now - before);
                }
            }
        }
        // The last turn is incomplete: leave its save out.
        (
            worst,
            ((saves - 1) * took).as_secs_f64() / now.as_secs_f64(),
        )
    }

    #[test]
    fn a_kill_loses_at_most_an_interval_and_saving_takes_at_most_half_the_time() {
        for (interval, call, took) in [
            (60_000, 400, 100),
            (60_000, 400, 20_000),
            (60_000, 14_000, 3),
            (1000, 250, 240),
            (50, 12, 12),
        ] {
            let (worst, share) = simulate(interval, call, took);
            let interval = Duration::from_millis(interval);
            assert!(worst <= interval, "{worst:?} of {interval:?}");
            // And it is not saved more often than necessary.
            assert!(worst >= interval / 2, "{worst:?} of {interval:?}");
            assert!(share <= 0.5, "{share}");
        }
        // The disk is too slow for the interval: half of the time is left for rendering.
        let (worst, share) = simulate(1000, 100, 3000);
        assert!((0.45..=0.5).contains(&share), "{share}");
        assert!(worst <= Duration::from_millis(9100), "{worst:?}");
    }
}
