//! What is written while a render goes on: the film's checkpoints and the picture to follow.

use super::args::RenderArgs;
use super::progress::Progress;
use crate::engine::DeviceInfo;
use crate::files::FileError;
use crate::film::Film;
use crate::output::store;
use crate::output::write_png;
use crate::provenance::Provenance;
use crate::render;
use crate::run::{self, Tally};
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
        render::provenance(self.before, self.device, film, tally)
    }

    /// Writes what is due. A file that can't be written now is warned of, not fatal: hours of rendering
    /// are worth more than this checkpoint, and the next may succeed.
    pub fn meanwhile(&mut self, film: &Film, tally: &Tally, progress: &Progress) {
        if self.checkpoint.is_due()
            && let Some(path) = self.args.film.as_deref()
        {
            let began = Instant::now();
            let saved = store::save(path, film, &self.provenance(film, tally));
            self.checkpoint.done(began, saved, progress);
        }
        self.watch.interval = WATCH.max(self.watch.took * WATCH_SHARE);
        if self.watch.is_due()
            && let Some(path) = self.args.watch.as_deref()
        {
            let began = Instant::now();
            let provenance = self.provenance(film, tally);
            let written = write_png(path, film, &provenance, self.args.exposure);
            self.watch.done(began, written, progress);
        }
    }
}

/// The longest call to the engine that leaves a checkpoint every so often possible.
pub fn longest_call(args: &RenderArgs) -> Duration {
    match (&args.film, args.checkpoint) {
        (Some(_), Some(interval)) => run::CALL.min(interval / 4),
        _ => run::CALL,
    }
}

/// Says when something is due.
struct Timer {
    interval: Duration,
    /// When it was begun last.
    began: Instant,
    /// How long it took then.
    took: Duration,
    /// When it was last asked whether it is due.
    asked: Instant,
}

impl Timer {
    fn new(interval: Duration) -> Self {
        let now = Instant::now();
        Self {
            interval,
            began: now,
            took: Duration::ZERO,
            asked: now,
        }
    }

    fn is_due(&mut self) -> bool {
        let call = self.asked.elapsed();
        self.asked = Instant::now();
        is_due(self.interval, self.began.elapsed(), call, self.took)
    }

    fn done(&mut self, began: Instant, result: Result<(), FileError>, progress: &Progress) {
        if let Err(e) = result {
            progress.say(&format!("warning: {e}"));
        }
        self.began = began;
        self.asked = Instant::now();
        self.took = began.elapsed();
    }
}

/// Whether a film that was last saved as it stood `since` ago, which took `took`, is to be saved now, when the next
/// chance comes about a `call` later. Until a save is complete a kill costs everything since the one before was begun:
/// all of that is to fit into the interval. Saves that take longer than half of it leave as much time to render as
/// they take.
fn is_due(interval: Duration, since: Duration, call: Duration, took: Duration) -> bool {
    since + call + took >= interval && since >= 2 * took
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most that a kill can cost, and the share of time spent on saving, when calls and saves always take as long.
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
                // The first one comes without knowledge of how long it takes.
                if saves > 1 {
                    worst = worst.max(now - before);
                }
            }
        }
        // Time is up in the midst of a turn: its save is left out.
        (
            worst,
            ((saves - 1) * took).as_secs_f64() / now.as_secs_f64(),
        )
    }

    #[test]
    fn a_kill_costs_at_most_an_interval_and_saving_at_most_half_of_the_time() {
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
            // And it is not saved more often than that takes.
            assert!(worst >= interval / 2, "{worst:?} of {interval:?}");
            assert!(share <= 0.5, "{share}");
        }
        // A disk too slow for the interval: half of the time is left for rendering.
        let (worst, share) = simulate(1000, 100, 3000);
        assert!((0.45..=0.5).contains(&share), "{share}");
        assert!(worst <= Duration::from_millis(9100), "{worst:?}");
    }
}
