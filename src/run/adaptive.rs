//! Adaptive runs: noisy tiles get more samples. [`crate::film::pilot`] explains how the noise is measured.
//!
//! Up to [`even`] samples all pixels get the same number. From there on the mean number of samples grows through the counts
//! at which the error is checked. The pilots alone decide how many samples each tile has at such a count; between two
//! counts the number is interpolated linearly. So a tile's samples depend on the mean that was reached, but not on the
//! calls or runs that reached it.

use super::{Run, StopReason, next_check, paths};
use crate::engine::{EngineError, Part};
use crate::film::coverage::Rect;
use crate::film::pilot::Pilot;
use crate::film::splats::Passes;
use crate::film::{BLOCK, Film, REPLICATES};
use crate::kernel::pilot_seed;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// The approximate number of samples up to which all pixels get the same: with fewer, a pilot costs more than it gains.
const EVEN: u64 = 32;

/// The first pilot has this fraction of those samples.
const FIRST_PILOT: u64 = 8;

/// After each pilot the mean grows by this factor before the next one, which doubles the number of pilot samples. Pilots are
/// rare because four samples per pixel are already many in a tile: sixteen give at most 1 % less error on any scene measured,
/// and cost 5 %.
const PILOT_LASTS: u64 = 16;

/// See [`EVEN`]; whole rounds of all replicates.
fn even(round: u64) -> u64 {
    next_check(EVEN - 1, round)
}

/// The number of pilots that decide how samples are distributed up to the mean `goal`.
fn stages_for(goal: u64, round: u64) -> usize {
    let mut until = even(round);
    let mut stages = 0;
    while goal > until {
        until = until.saturating_mul(PILOT_LASTS);
        stages += 1;
    }
    stages
}

/// The sample numbers of a pilot.
fn pilot_samples(stage: usize, round: u64) -> Range<u64> {
    let first = (even(round) / FIRST_PILOT).max(2);
    match stage {
        0 => 0..first,
        k => first << (k - 1)..first << k,
    }
}

/// Samples of each tile when their mean over the pixels is `mean`; `pilot` has the stages that the next check takes.
fn counts(pilot: &Pilot, tiles: &[Rect], mean: u64, round: u64) -> Vec<u64> {
    let mut at = even(round);
    let mut have = vec![at.min(mean); tiles.len()];
    let step = round * REPLICATES as u64;
    while at < mean {
        let goal = next_check(at, round);
        let then = pilot.fill(tiles, &have, goal, stages_for(goal, round), step);
        if goal > mean {
            let share = (mean - at) as f64 / (goal - at) as f64;
            let between = |(a, b): (&u64, u64)| a + ((b - a) as f64 * share).round() as u64;
            return have.iter().zip(then).map(between).collect();
        }
        (at, have) = (goal, then);
    }
    have
}

impl Run<'_> {
    /// [`Run::go`] for an adaptive job, whose engine has this seed.
    pub(super) fn go_adaptive<E: From<EngineError>>(
        &mut self,
        seed: u32,
        mut after: impl FnMut(&Film, &super::Tally) -> Result<(), E>,
    ) -> Result<StopReason, E> {
        let job = self.job;
        let pilot = self
            .film
            .pilot
            .get_or_insert_with(|| Pilot::new(&job.tiles));
        let tiles = pilot.tiles();
        self.film.coverage.split(&tiles);
        let mut mean = 0;
        'waves: loop {
            let check = self.next_check(mean);
            let goal = check.min(job.samples.end);
            while let Some(stage) = self.lacks_pilot(check) {
                if self.too_late_for_pilot(stage) {
                    return Ok(StopReason::Time);
                }
                match self.make_pilot(stage, seed)? {
                    true => after(self.film, &self.tally)?,
                    false => return Ok(StopReason::Interrupted),
                }
            }
            let mut next = goal;
            let mut wanted = self.counts(&tiles, goal);
            if !self.has_just(&tiles, &wanted) {
                next = self.affordable(mean, goal);
                wanted = self.counts(&tiles, next);
            }
            let learning = self.pace.is_none();
            // How far a tile gets depends on its noise, so all pixels get as many passes as samples on average.
            for (lacking, rects) in self.film.lacking_passes(&job.tiles, 0..next) {
                let put = |film: &mut Film, numbers, splats: Vec<_>| {
                    let passes = Passes::new(numbers, film.size[0], splats);
                    rects.iter().for_each(|r| film.put_passes(*r, &passes));
                };
                if !self.trace_light(lacking, &mut after, put)? {
                    return Ok(StopReason::Interrupted);
                }
            }
            for &tile in &job.tiles {
                loop {
                    let parts = self.in_time(self.lacking(tile, &tiles, &wanted));
                    if parts.is_empty() {
                        break;
                    }
                    if self.stop.load(Ordering::Relaxed) {
                        return Ok(StopReason::Interrupted);
                    }
                    if self.too_late(&parts) {
                        return Ok(StopReason::Time);
                    }
                    if !self.call(tile, &parts)? {
                        return Ok(StopReason::Interrupted);
                    }
                    self.tally.forecast = self.forecast();
                    after(self.film, &self.tally)?;
                    // One call tells the pace; all others are of the right length.
                    if learning {
                        continue 'waves;
                    }
                }
            }
            mean = next;
            if mean == check && self.has_just(&tiles, &wanted) && self.enough(mean) {
                return Ok(StopReason::Error);
            }
            if mean >= job.samples.end {
                return Ok(StopReason::Samples);
            }
        }
    }

    /// The next mean at which the error is checked. If the error can't end the run, skips some: calls with more samples per
    /// pixel are cheaper.
    fn next_check(&self, mean: u64) -> u64 {
        let round = self.job.round;
        let mut check = next_check(mean, round);
        let far = if mean < even(round) {
            even(round)
        } else {
            4 * mean
        };
        while self.job.error.is_none() && next_check(check, round) <= far {
            check = next_check(check, round);
        }
        check
    }

    fn counts(&self, tiles: &[Rect], mean: u64) -> Vec<u64> {
        match &self.film.pilot {
            Some(pilot) => counts(pilot, tiles, mean, self.job.round),
            None => vec![mean; tiles.len()],
        }
    }

    /// The pilot that must still be rendered for samples up to the mean `check`.
    fn lacks_pilot(&self, check: u64) -> Option<usize> {
        let made = self.film.pilot.as_ref().map_or(0, Pilot::stages);
        let ends_before = self.job.samples.end <= even(self.job.round);
        (!ends_before && made < stages_for(check, self.job.round)).then_some(made)
    }

    /// Whether the time would be used up before half of a pilot is done.
    fn too_late_for_pilot(&self, stage: usize) -> bool {
        let samples = pilot_samples(stage, self.job.round);
        let tiles = self.job.tiles.iter().zip(std::iter::repeat(samples));
        let half: f64 = tiles
            .map(|(t, s)| t.area() as f64 * (s.end - s.start) as f64 / 2.0)
            .sum();
        let Some(time) = self.job.time else {
            return false;
        };
        self.tally.seconds + self.pace.unwrap_or(0.0) * half > time.as_secs_f64()
    }

    /// Renders a pilot in pieces, and drops each piece once its noise is measured. Returns false if it was stopped.
    fn make_pilot(&mut self, stage: usize, seed: u32) -> Result<bool, EngineError> {
        self.engine.reseed(pilot_seed(seed));
        let done = self.measure(pilot_samples(stage, self.job.round));
        self.engine.reseed(seed);
        done
    }

    fn measure(&mut self, samples: Range<u64>) -> Result<bool, EngineError> {
        let Some(mut pilot) = self.film.pilot.take() else {
            return Ok(true);
        };
        let mut measured = pilot.measurement();
        let mut done = Ok(true);
        'tiles: for tile in &self.job.tiles {
            let mut piece = Film::new(self.film.size, *tile, self.film.strata);
            let mut at = samples.start;
            while at < samples.end {
                let end = samples.end.min((at / BLOCK + 1) * BLOCK);
                let part = Part {
                    rect: *tile,
                    samples: at..end,
                };
                done = self.call_on(Some(&mut piece), *tile, &[part]);
                if !matches!(done, Ok(true)) {
                    break 'tiles;
                }
                at = end;
            }
            measured.take(&piece, samples.end - samples.start);
        }
        if let Ok(true) = done {
            pilot.add(&measured, samples.end - samples.start);
        }
        self.film.pilot = Some(pilot);
        done
    }

    /// The next samples that pixels of the job's tile `tile` need, each up to the end of a block.
    fn lacking(&self, tile: Rect, tiles: &[Rect], wanted: &[u64]) -> Vec<Part> {
        let here = tiles.iter().zip(wanted);
        let here = here.filter_map(|(t, &n)| Some((t.intersection(&tile)?, n)));
        let missing = here.flat_map(|(t, n)| self.film.coverage.missing(t, 0..n));
        let next = missing.filter_map(|(rect, ranges)| {
            let all = ranges.into_iter().next()?;
            let block_end = (all.start / BLOCK + 1) * BLOCK;
            let samples = all.start..all.end.min(block_end);
            Some(Part { rect, samples })
        });
        next.filter(|p| p.paths() > 0).collect()
    }

    /// Shortens the parts to what one call can do in time: by the same factor, but to at least one sample each.
    fn in_time(&self, mut parts: Vec<Part>) -> Vec<Part> {
        let share = match self.pace {
            Some(pace) => self.job.call.as_secs_f64() / (pace * paths(&parts)),
            None => 0.0,
        };
        if share < 1.0 {
            for Part { samples, .. } in &mut parts {
                let fits = (samples.end - samples.start) as f64 * share;
                samples.end = samples.start + (fits as u64).max(1);
            }
        }
        parts
    }

    /// The largest mean, at most `goal`, that the remaining time allows.
    fn affordable(&self, mean: u64, goal: u64) -> u64 {
        let Some(time) = self.job.time else {
            return goal;
        };
        // The speed is not known yet: take only the first samples.
        if self.tally.counters.paths == 0 {
            return goal.min(mean + 1);
        }
        let left = (time.as_secs_f64() - self.tally.seconds).max(0.0);
        let pace = self.tally.seconds / self.tally.counters.paths as f64;
        let reached = self.tally.samples + left / (pace * self.pixels as f64);
        goal.min((reached as u64).max(mean + 1))
    }

    /// Whether the tiles have exactly these samples.
    fn has_just(&self, tiles: &[Rect], wanted: &[u64]) -> bool {
        let all = tiles
            .iter()
            .zip(wanted)
            .map(|(t, &n)| u128::from(t.area()) * u128::from(n));
        self.film.coverage.total() == all.sum::<u128>()
    }
}
