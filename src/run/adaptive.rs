//! Runs whose samples go where the noise is: see [`crate::film::pilot`] for how that is known.
//!
//! Up to [`even`] samples all pixels are alike. From there on the mean number of samples grows through the counts at
//! which the error may be looked at; what each tile has at one of them follows from the pilots alone, and what it has
//! in between lies on a straight line. So a tile's samples depend on the mean that was reached, and not
//! on how it was.

use super::{Run, StopReason, next_check};
use crate::engine::EngineError;
use crate::film::coverage::Rect;
use crate::film::pilot::Pilot;
use crate::film::{BLOCK, Film, REPLICATES};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// The mean number of samples up to which all pixels are alike, about: fewer could not pay for a pilot.
const EVEN: u64 = 32;

/// The first pilot has this part of those samples.
const FIRST_PILOT: u64 = 8;

/// Each pilot lasts until the mean has grown by this factor; together they then double. Rarely, for four samples a pixel
/// are many in a tile: sixteen steer no more than 1 % better on any scene measured, and would cost 5 %.
const PILOT_LASTS: u64 = 16;

/// What makes a pilot's seed differ from the picture's.
const PILOT_SEED: u32 = 0x9e37_79b9;

/// See [`EVEN`]; whole rounds of all replicates.
fn even(round: u64) -> u64 {
    next_check(EVEN - 1, round)
}

/// How many pilots decide how the samples beyond the mean `goal` before it are spread.
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
        loop {
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
            let mut calls = self.calls(&tiles, &wanted);
            if !calls.is_empty() {
                next = self.affordable(mean, goal);
                if next < goal {
                    wanted = self.counts(&tiles, next);
                    calls = self.calls(&tiles, &wanted);
                }
            }
            for (rect, samples) in calls {
                let mut at = samples.start;
                while at < samples.end {
                    let part = at..self.part_end(rect, at, samples.end);
                    if self.stop.load(Ordering::Relaxed) {
                        return Ok(StopReason::Interrupted);
                    }
                    if self.too_late(rect, &part) {
                        return Ok(StopReason::Time);
                    }
                    at = part.end;
                    if !self.call(rect, part)? {
                        return Ok(StopReason::Interrupted);
                    }
                    self.tally.forecast = self.forecast();
                    after(self.film, &self.tally)?;
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

    /// The next mean at which the error may be looked at. Where that ends no run, some are passed over once there are tiles
    /// to be called one by one: a call for few samples of a tile costs a tenth more than it must.
    fn next_check(&self, mean: u64) -> u64 {
        let mut check = next_check(mean, self.job.round);
        while self.job.error.is_none()
            && mean >= even(self.job.round)
            && next_check(check, self.job.round) <= 4 * mean
        {
            check = next_check(check, self.job.round);
        }
        check
    }

    fn counts(&self, tiles: &[Rect], mean: u64) -> Vec<u64> {
        match &self.film.pilot {
            Some(pilot) => counts(pilot, tiles, mean, self.job.round),
            None => vec![mean; tiles.len()],
        }
    }

    /// The pilot that is still to be made for samples up to the mean `check`.
    fn lacks_pilot(&self, check: u64) -> Option<usize> {
        let made = self.film.pilot.as_ref().map_or(0, Pilot::stages);
        let ends_before = self.job.samples.end <= even(self.job.round);
        (!ends_before && made < stages_for(check, self.job.round)).then_some(made)
    }

    /// Whether the time would be over before half of a pilot were done.
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

    /// Renders a pilot, in pieces that are forgotten once they are measured; false when it was stopped.
    fn make_pilot(&mut self, stage: usize, seed: u32) -> Result<bool, EngineError> {
        self.engine.reseed(seed ^ PILOT_SEED);
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
                done = self.call_on(Some(&mut piece), *tile, at..end);
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

    /// What is missing for the tiles to have their samples, each call for a rectangle of as many tiles as lack the same.
    fn calls(&self, tiles: &[Rect], wanted: &[u64]) -> Vec<(Rect, Range<u64>)> {
        let mut calls = Vec::new();
        for (tile, &n) in tiles.iter().zip(wanted) {
            for (rect, ranges) in self.film.coverage.missing(*tile, 0..n) {
                calls.extend(ranges.into_iter().map(|r| (rect, r)));
            }
        }
        let mut calls = joined(calls, self.widest);
        // Rectangles of one size follow each other: an engine keeps what it has for them.
        calls.sort_by_key(|(r, s)| (r.width(), r.height(), r.y0, r.x0, s.start));
        calls
    }

    /// The largest mean up to `goal` that the time allows.
    fn affordable(&self, mean: u64, goal: u64) -> u64 {
        let Some(time) = self.job.time else {
            return goal;
        };
        // Before anything is known: the first samples alone.
        if self.tally.counters.paths == 0 {
            return goal.min(mean + 1);
        }
        let left = (time.as_secs_f64() - self.tally.seconds).max(0.0);
        let pace = self.tally.seconds / self.tally.counters.paths as f64;
        let reached = self.tally.samples + left / (pace * self.pixels as f64);
        goal.min((reached as u64).max(mean + 1))
    }

    /// Where a call that starts at `at` ends: at the end of its block, or of what it can do in time.
    fn part_end(&self, rect: Rect, at: u64, end: u64) -> u64 {
        let fits = match self.pace {
            Some(pace) => self.job.call.as_secs_f64() / (pace * rect.area() as f64),
            None => 1.0,
        };
        end.min((at / BLOCK + 1) * BLOCK)
            .min(at + (fits as u64).max(1))
    }

    /// Whether the tiles have these samples and no more.
    fn has_just(&self, tiles: &[Rect], wanted: &[u64]) -> bool {
        let all = tiles
            .iter()
            .zip(wanted)
            .map(|(t, &n)| u128::from(t.area()) * u128::from(n));
        self.film.coverage.total() == all.sum::<u128>()
    }
}

/// The longer side.
fn longest_side(r: &Rect) -> u32 {
    r.width().max(r.height())
}

/// Joins rectangles beside and below each other that lack the same samples, up to `most` pixels.
fn joined(mut calls: Vec<(Rect, Range<u64>)>, most: u64) -> Vec<(Rect, Range<u64>)> {
    let mut join = |key: fn(&Rect) -> [u32; 4], fits: fn(&Rect, &Rect) -> bool| {
        calls.sort_by_key(|(r, s)| (s.start, s.end, key(r)));
        let mut out: Vec<(Rect, Range<u64>)> = Vec::new();
        for (rect, samples) in calls.drain(..) {
            match out.last_mut() {
                Some((last, same))
                    if *same == samples
                        && fits(last, &rect)
                        && last.area() + rect.area() <= most
                        && longest_side(&last.union(&rect)) <= super::MAX_TILE_SIDE =>
                {
                    *last = last.union(&rect);
                }
                _ => out.push((rect, samples)),
            }
        }
        calls = out;
    };
    join(
        |r| [r.y0, r.y1, r.x0, r.x1],
        |a, b| (a.y0, a.y1, a.x1) == (b.y0, b.y1, b.x0),
    );
    join(
        |r| [r.x0, r.x1, r.y0, r.y1],
        |a, b| (a.x0, a.x1, a.y1) == (b.x0, b.x1, b.y0),
    );
    calls
}
