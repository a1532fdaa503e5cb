//! What is written while a render goes on: the film's checkpoints and the picture to follow.

use super::args::RenderArgs;
use super::progress::Progress;
use crate::engine::DeviceInfo;
use crate::film::{Film, store};
use crate::output::{FileError, write_png};
use crate::provenance::Provenance;
use crate::run::Tally;
use std::time::{Duration, Instant};

/// Between two checkpoints when the command line does not say.
const CHECKPOINT: Duration = Duration::from_secs(60);

/// Between two pictures to follow, at least.
const WATCH: Duration = Duration::from_secs(2);

/// The picture to follow may take this part of the time at most: large ones are written less often.
const WATCH_SHARE: u32 = 20;

/// Writes files at their intervals.
pub struct Saver<'a> {
    args: &'a RenderArgs,
    /// What the film came from before this run.
    before: &'a Provenance,
    device: &'a DeviceInfo,
    checkpoint: Timer,
    watch: Timer,
}

impl<'a> Saver<'a> {
    /// For a run on `device` that goes on from `before`.
    pub fn new(args: &'a RenderArgs, before: &'a Provenance, device: &'a DeviceInfo) -> Self {
        Self {
            args,
            before,
            device,
            checkpoint: Timer::new(args.checkpoint.unwrap_or(CHECKPOINT)),
            watch: Timer::new(WATCH),
        }
    }

    /// The film's provenance, this run included.
    pub fn provenance(&self, film: &Film, tally: &Tally) -> Provenance {
        let mut provenance = self.before.clone();
        provenance.add_work(self.device, tally.counters, tally.seconds);
        provenance.describe(film);
        provenance
    }

    /// Writes what is due. A file that can't be written now is warned of, not fatal: hours of rendering
    /// are worth more than this checkpoint, and the next may succeed.
    pub fn meanwhile(&mut self, film: &Film, tally: &Tally, progress: &Progress) {
        if let Some(path) = self
            .args
            .film
            .as_deref()
            .filter(|_| self.checkpoint.is_due())
        {
            let provenance = self.provenance(film, tally);
            self.checkpoint
                .time(|| store::save(path, film, &provenance), progress);
        }
        self.watch.interval = WATCH.max(self.watch.took * WATCH_SHARE);
        if let Some(path) = self.args.watch.as_deref().filter(|_| self.watch.is_due()) {
            let provenance = self.provenance(film, tally);
            let exposure = self.args.exposure;
            self.watch
                .time(|| write_png(path, film, &provenance, exposure), progress);
        }
    }
}

/// Says when something is due.
struct Timer {
    last: Instant,
    interval: Duration,
    /// How long it took when it was done last.
    took: Duration,
}

impl Timer {
    fn new(interval: Duration) -> Self {
        Self {
            last: Instant::now(),
            interval,
            took: Duration::ZERO,
        }
    }

    fn is_due(&self) -> bool {
        self.last.elapsed() >= self.interval
    }

    fn time(&mut self, write: impl FnOnce() -> Result<(), FileError>, progress: &Progress) {
        let begun = Instant::now();
        if let Err(e) = write() {
            progress.say(&format!("warning: {e}"));
        }
        self.last = Instant::now();
        self.took = begun.elapsed();
    }
}
