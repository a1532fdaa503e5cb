//! Drives an engine, from an empty or resumed film, until a stop condition is met.
//!
//! Time decides only how much work an engine gets per call. The [`Job`] decides which samples each pixel has
//! at the end (unless `time` or a signal ends the run), and the picture does not depend on how the work was cut
//! ([`crate::film`]). The error is checked only after fixed sample counts, so that the same command stops at the same sample
//! on every machine.

use crate::engine::{Counters, Engine, EngineError, MAX_TILE_PIXELS, Part};
use crate::film::coverage::{Coverage, Rect};
use crate::film::error::RelativeError;
use crate::film::splats::{Passes, Splat};
use crate::film::{BLOCK, Film, REPLICATES};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

mod adaptive;

/// How long a call to the engine should take. Short enough that progress moves and a signal is obeyed soon; long
/// enough that the overhead of a call (reading back and folding, 10 to 20 ms at 512 x 384) does not matter.
pub const CALL: Duration = Duration::from_millis(1000);

/// Factor between the sample counts at which the error is checked, if it can end the run.
const CHECK_FACTOR: f64 = 1.25;

/// The smallest sample count at which the error can end a run.
const MIN_CHECKED_SAMPLES: u64 = 16;

/// Samples in the first pass over all tiles. A short pass soon gives every pixel samples, so that a `--watch` picture has no
/// holes. An even shorter one would leave lanes of a software adapter idle.
const FIRST_PASS: u64 = 64;

/// Bytes of splats that may wait for the samples that they go with, in a picture of so many pixels: passes through the tiles are shorter
/// where there would be more. A quarter of the film, but more of a small one, and less of a large one,
/// whose passes have no more light paths.
pub(crate) fn waiting_bytes(pixels: u64) -> u64 {
    pixels.saturating_mul(84).clamp(32 << 20, 2 << 30)
}

/// The work of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Disjoint rectangles of at most [`MAX_TILE_PIXELS`] pixels: see [`tiles`].
    pub tiles: Vec<Rect>,
    /// The sample numbers that every pixel shall have at the end.
    pub samples: Range<u64>,
    /// Samples in one round, strata².
    pub round: u64,
    /// Stop after this long in the engine.
    pub time: Option<Duration>,
    /// Stop when the relative error ([`Film::relative_error`]) is at most this, and not in doubt.
    pub error: Option<f64>,
    /// Whether the picture is black by construction.
    pub black: bool,
    /// How long a call to the engine should take at most, usually [`CALL`].
    pub call: Duration,
    /// The engine's seed, for an adaptive run. Its pilots use another seed. `samples` then starts at 0 and ends at the mean
    /// sample count of the pixels.
    pub adaptive: Option<u32>,
}

/// What ended a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// Every pixel has its samples.
    Samples,
    /// The time was used up.
    Time,
    /// The relative error was reached.
    Error,
    /// `stop` was set.
    Interrupted,
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Counts of paths, rays, and truncated or non-finite samples of this run.
    pub counters: Counters,
    /// Seconds spent in the engine by this run.
    pub seconds: f64,
    /// Samples of the job that a pixel has now, averaged over the pixels.
    pub samples: f64,
    /// Whether every pixel has at least one sample of the job.
    pub complete: bool,
    /// If the error can end the run: the error at the last check, and the samples per pixel at that time.
    pub error: Option<(u64, RelativeError)>,
    /// The tile that has got samples last.
    pub tile: Option<Rect>,
    /// The expected end, by the stop condition that will be met first; `None` while it is unknown.
    pub forecast: Option<Forecast>,
}

/// When a run will end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Fraction of the samples that are done, 0..=1.
    pub fraction: f64,
    /// Seconds left.
    pub left: f64,
}

/// The longest side of a tile. Every adapter allows larger textures (WebGPU guarantees 8192 texels), also with the extra
/// texel that a GPU tile may need.
const MAX_TILE_SIDE: u32 = 4096;

/// Cuts regions into tiles: disjoint rectangles that together cover the regions. Each is at most 4096 pixels wide and high,
/// and has at most `limit` pixels (but at least one row). The cuts do not change any bit of the picture.
pub fn tiles(regions: &[Rect], limit: u64) -> Vec<Rect> {
    let limit = limit.min(MAX_TILE_PIXELS);
    let mut out = Vec::new();
    for r in Rect::disjoint(regions).into_iter().flat_map(columns) {
        // Bands of equal height: a thin last band would cost a whole call.
        let most = (limit / u64::from(r.width())).clamp(1, MAX_TILE_SIDE.into());
        let bands = u64::from(r.height()).div_ceil(most);
        let rows = u64::from(r.height()).div_ceil(bands) as u32;
        let mut y0 = r.y0;
        while y0 < r.y1 {
            let y1 = r.y1.min(y0.saturating_add(rows));
            out.push(Rect { y0, y1, ..r });
            y0 = y1;
        }
    }
    out
}

/// A rectangle cut into columns of equal width, none wider than [`MAX_TILE_SIDE`].
fn columns(r: Rect) -> impl Iterator<Item = Rect> {
    let width = r
        .width()
        .div_ceil(r.width().div_ceil(MAX_TILE_SIDE).max(1))
        .max(1);
    (r.x0..r.x1).step_by(width as usize).map(move |x0| Rect {
        x0,
        x1: r.x1.min(x0.saturating_add(width)),
        ..r
    })
}

/// The first sample count after `count` at which the error is checked: a multiple of one round of every replicate,
/// starting at [`MIN_CHECKED_SAMPLES`], with [`CHECK_FACTOR`] between two checks. Beyond the largest possible sample count it
/// returns the same count for every `count`.
fn next_check(count: u64, round: u64) -> u64 {
    // A forecast may pass any count; beyond this one the numbers below would overflow.
    let count = count.min(u32::MAX.into());
    let period = round * REPLICATES as u64;
    let mut check = MIN_CHECKED_SAMPLES.div_ceil(period) * period;
    while check <= count {
        let next = (check as f64 * CHECK_FACTOR).ceil() as u64;
        check = next.div_ceil(period) * period;
    }
    check
}

/// A run in progress.
pub struct Run<'a> {
    job: &'a Job,
    engine: &'a mut dyn Engine,
    film: &'a mut Film,
    stop: &'a AtomicBool,
    /// Progress so far.
    pub tally: Tally,
    /// Seconds per sample of one pixel, measured in the last call.
    pace: Option<f64>,
    /// Seconds of a pass of light paths, measured in the last call; 0 without them.
    light_pace: f64,
    /// Splats of a pass, counted in the last pass through the tiles.
    splats_of_a_pass: u64,
    /// Pixels of the largest tile.
    widest: u64,
    /// Pixels of all tiles.
    pixels: u64,
    /// What [`Tally::samples`] was at first.
    samples_before: f64,
    /// Samples and seconds after the first call, which a driver may use to compile.
    first: Option<(f64, f64)>,
}

impl<'a> Run<'a> {
    /// Prepares a run. `film` holds the pixels of every tile. Setting `stop` ends the run at the next opportunity.
    pub fn new(
        job: &'a Job,
        engine: &'a mut dyn Engine,
        film: &'a mut Film,
        stop: &'a AtomicBool,
    ) -> Self {
        if let Some(setup) = engine.light_paths()
            && film.coverage.is_empty()
            && film.splats().is_none()
        {
            film.begin_splats(setup);
        }
        let pixels: u64 = job.tiles.iter().map(Rect::area).sum();
        let samples = match job.adaptive {
            Some(_) => held(&film.coverage, job) / pixels as f64,
            None => {
                (job.samples.end - job.samples.start) as f64
                    - missing(&film.coverage, job) / pixels as f64
            }
        };
        let complete = is_complete(&film.coverage, job);
        Self {
            job,
            engine,
            film,
            stop,
            tally: Tally {
                samples,
                complete,
                ..Tally::default()
            },
            pace: None,
            light_pace: 0.0,
            splats_of_a_pass: 0,
            widest: job.tiles.iter().map(Rect::area).max().unwrap_or(0),
            pixels,
            samples_before: samples,
            first: None,
        }
    }

    /// Renders until a stop condition is met. Calls `after` after every call to the engine, to show progress or
    /// save; an error from it ends the run. After an error the film keeps the samples so far.
    pub fn go<E: From<EngineError>>(
        &mut self,
        mut after: impl FnMut(&Film, &Tally) -> Result<(), E>,
    ) -> Result<StopReason, E> {
        if let Some(seed) = self.job.adaptive {
            return self.go_adaptive(seed, after);
        }
        let job = self.job;
        let mut at = job.samples.start;
        'passes: loop {
            at = first_missing(&self.film.coverage, job, at);
            let count = at - job.samples.start;
            let is_check = count == next_check(count.saturating_sub(1), job.round);
            if is_check && self.enough(count) {
                return Ok(StopReason::Error);
            }
            if at >= job.samples.end {
                return Ok(StopReason::Samples);
            }
            let end = self.even_end(at, self.pass_end(at));
            let learning = self.pace.is_none();
            // Pixels get their passes with their samples, so that a run that stops anywhere leaves a film of certain samples.
            let mut passes: Vec<Passes> = Vec::new();
            if !self.film.lacking_passes(&job.tiles, at..end).is_empty() {
                let mut count = 0;
                let keep = |film: &mut Film, numbers, mut splats: Vec<Splat>| {
                    let width = film.size[0];
                    splats.retain(|s| s.is_within(film.bounds, width));
                    count += splats.len() as u64;
                    passes.push(Passes::new(numbers, width, splats));
                };
                if !self.trace_light(at..end, &mut after, keep)? {
                    return Ok(StopReason::Interrupted);
                }
                self.splats_of_a_pass = count / (end - at);
            }
            for tile in &job.tiles {
                for (rect, ranges) in self.film.coverage.missing(*tile, at..end) {
                    for samples in ranges {
                        let part = [Part { rect, samples }];
                        if self.stop.load(Ordering::Relaxed) {
                            return Ok(StopReason::Interrupted);
                        }
                        if self.too_late(&part) {
                            return Ok(StopReason::Time);
                        }
                        if !self.call(rect, &part)? {
                            return Ok(StopReason::Interrupted);
                        }
                        passes
                            .iter()
                            .for_each(|p| self.film.put_lacking_passes(rect, p));
                        self.tally.forecast = self.forecast();
                        after(self.film, &self.tally)?;
                        // The first call measures the speed; all later ones then have the right length.
                        if learning {
                            continue 'passes;
                        }
                    }
                }
            }
        }
    }

    /// Traces the light paths of `passes` in calls of the right length, and gives the splats of each to `put`. Returns false if it was
    /// stopped.
    fn trace_light<E: From<EngineError>>(
        &mut self,
        passes: Range<u64>,
        after: &mut impl FnMut(&Film, &Tally) -> Result<(), E>,
        mut put: impl FnMut(&mut Film, Range<u64>, Vec<Splat>),
    ) -> Result<bool, E> {
        let mut at = passes.start;
        while at < passes.end {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let fits = match self.light_pace {
                0.0 => 1,
                pace => (self.job.call.as_secs_f64() / pace) as u64,
            };
            let end = passes.end.min(at + fits.max(1));
            let begun = Instant::now();
            let result = self.engine.trace_light(at..end, self.stop);
            let seconds = begun.elapsed().as_secs_f64();
            self.tally.seconds += seconds;
            match result {
                Ok((splats, counters)) => {
                    self.tally.counters += counters;
                    put(self.film, at..end, splats);
                }
                Err(EngineError::Stopped) => return Ok(false),
                Err(e) => return Err(e.into()),
            }
            self.light_pace = seconds / (end - at) as f64;
            at = end;
            if !self.film.coverage.is_empty() {
                after(self.film, &self.tally)?;
            }
        }
        Ok(true)
    }

    /// Calls the engine once. Returns false if it was stopped.
    fn call(&mut self, tile: Rect, parts: &[Part]) -> Result<bool, EngineError> {
        let done = self.call_on(None, tile, parts)?;
        if done {
            self.tally.tile = Some(tile);
            self.tally.samples += paths(parts) / self.pixels as f64;
            self.tally.complete = self.tally.complete || is_complete(&self.film.coverage, self.job);
            self.first
                .get_or_insert((self.tally.samples, self.tally.seconds));
        }
        Ok(done)
    }

    /// Calls the engine once, on `film` if given, else on the run's film. Returns false if it was stopped.
    fn call_on(
        &mut self,
        other: Option<&mut Film>,
        tile: Rect,
        parts: &[Part],
    ) -> Result<bool, EngineError> {
        let begun = Instant::now();
        let film = other.unwrap_or(self.film);
        let result = self.engine.render_parts(film, tile, parts, self.stop);
        let seconds = begun.elapsed().as_secs_f64();
        self.tally.seconds += seconds;
        match result {
            Ok(counters) => self.tally.counters += counters,
            Err(EngineError::Stopped) => return Ok(false),
            Err(e) => return Err(e),
        }
        self.pace = Some(seconds / paths(parts));
        Ok(true)
    }

    /// Where a pass that starts at `at` ends: at the end of the block or the job, at the next check of the error, or when the
    /// call has taken long enough. The first pass has one sample.
    fn pass_end(&self, at: u64) -> u64 {
        let block_end = (at / BLOCK + 1) * BLOCK;
        let count = at - self.job.samples.start;
        let stop = match self.job.error {
            Some(_) => next_check(count, self.job.round),
            None if count < FIRST_PASS => FIRST_PASS,
            None => self.job.samples.end,
        };
        let mut length = 1;
        if let Some(pace) = self.pace {
            length = (self.job.call.as_secs_f64() / (pace * self.widest as f64)) as u64;
            let splats = self.splats_of_a_pass.max(1) * size_of::<Splat>() as u64;
            length = length
                .min(waiting_bytes(self.film.bounds.area()) / splats)
                .max(1);
            // Equal parts of what is left of the block: a short rest would leave lanes idle.
            let rest = block_end - at;
            length = rest.div_ceil(((rest + length / 2) / length).max(1));
            if let Some(time) = self.job.time {
                // All tiles must have the same count when the time is used up.
                let left = (time.as_secs_f64() - self.tally.seconds).max(0.0);
                let sample = pace * self.pixels as f64 + self.light_pace;
                length = length.min((left / sample) as u64);
            }
        }
        (at + length.max(1))
            .min(block_end)
            .min(self.job.samples.start + stop)
            .min(self.job.samples.end)
    }

    /// Where a pass must end so that every pixel has all of its samples, and of its light paths, or none. Films whose parts were rendered
    /// apart need shorter passes.
    fn even_end(&self, at: u64, end: u64) -> u64 {
        let film = &self.film;
        let samples = (self.job.tiles.iter()).flat_map(|t| film.coverage.missing(*t, at..end));
        let samples = samples.flat_map(|(_, ranges)| ranges);
        let passes = film.lacking_passes(&self.job.tiles, at..end);
        let ends = samples.chain(passes.into_iter().map(|(range, _)| range));
        let ends = ends.flat_map(|r| [r.start, r.end]);
        ends.filter(|k| (at + 1..end).contains(k))
            .min()
            .unwrap_or(end)
    }

    /// Whether the time is used up, or would be before half of this call is done. The first sample of
    /// a pixel is never too late, so that the picture has no holes.
    fn too_late(&self, parts: &[Part]) -> bool {
        let Some(time) = self.job.time else {
            return false;
        };
        let first = self.job.samples.start;
        if parts.iter().any(|p| p.samples.start == first) {
            return false;
        }
        self.tally.seconds + self.pace.unwrap_or(0.0) * paths(parts) / 2.0 > time.as_secs_f64()
    }

    /// Checks the error after `count` samples per pixel, if it can end the run. Returns whether it is small enough.
    fn enough(&mut self, count: u64) -> bool {
        let Some(wanted) = self.job.error else {
            return false;
        };
        let error = self.film.relative_error().of_black(self.job.black);
        self.tally.error = Some((count, error));
        error.upper().is_some_and(|e| e <= wanted)
    }

    /// See [`Tally::forecast`].
    fn forecast(&self) -> Option<Forecast> {
        let job = self.job;
        let done = self.tally.samples;
        // The first call counts only while there is no other.
        let (samples, seconds) = self
            .first
            .filter(|first| done > first.0)
            .unwrap_or((self.samples_before, 0.0));
        let per_sample = (self.tally.seconds - seconds) / (done - samples);
        let mut needed = (job.samples.end - job.samples.start) as f64;
        if let Some(time) = job.time {
            let in_time = done + (time.as_secs_f64() - self.tally.seconds) / per_sample;
            // The time can't end the run before every pixel has a sample.
            needed = needed.min(in_time.max(1.0));
        }
        let known = self
            .tally
            .error
            .and_then(|(count, e)| Some((count, e.upper()?)));
        match (job.error, known) {
            // The error falls with the square root of the samples. The run ends at the first check after that.
            (Some(target), Some((count, error))) => {
                let reached = count as f64 * (error / target).powi(2);
                let check = next_check((reached as u64).max(count), job.round);
                needed = needed.min(check as f64);
            }
            (Some(_), None) if job.time.is_none() => return None,
            _ => {}
        }
        let needed = needed.max(done);
        Some(Forecast {
            fraction: done / needed,
            left: (needed - done) * per_sample,
        })
    }
}

/// The first sample number from `from` on that some pixel of the job does not have; the job's end if there is none.
fn first_missing(coverage: &Coverage, job: &Job, from: u64) -> u64 {
    job.tiles
        .iter()
        .flat_map(|t| coverage.missing(*t, from..job.samples.end))
        .filter_map(|(_, ranges)| ranges.first().map(|r| r.start))
        .min()
        .unwrap_or(job.samples.end)
}

/// Paths of a call.
fn paths(parts: &[Part]) -> f64 {
    parts.iter().map(|p| p.paths() as f64).sum()
}

/// See [`Tally::complete`].
fn is_complete(coverage: &Coverage, job: &Job) -> bool {
    let has = |r: &[Range<u64>]| r.iter().any(|r| r.end > job.samples.start);
    let covered = coverage.cells().filter(|(_, ranges)| has(ranges));
    let cells: Vec<Rect> = covered.map(|(rect, _)| rect).collect();
    let area = |tile: &Rect| -> u64 {
        let parts = cells.iter().filter_map(|c| c.intersection(tile));
        parts.map(|r| r.area()).sum()
    };
    job.tiles.iter().all(|t| area(t) == t.area())
}

/// Samples times pixels of the job's tiles that the film has.
fn held(coverage: &Coverage, job: &Job) -> f64 {
    let of = |(rect, ranges): (Rect, &[Range<u64>])| {
        let parts = job.tiles.iter().filter_map(|t| t.intersection(&rect));
        let pixels: u64 = parts.map(|r| r.area()).sum();
        pixels as f64 * ranges.iter().map(|r| r.end - r.start).sum::<u64>() as f64
    };
    coverage.cells().map(of).sum()
}

/// Samples times pixels that the job still needs.
fn missing(coverage: &Coverage, job: &Job) -> f64 {
    let of = |(rect, ranges): (Rect, Vec<Range<u64>>)| {
        rect.area() as f64 * ranges.iter().map(|r| r.end - r.start).sum::<u64>() as f64
    };
    job.tiles
        .iter()
        .flat_map(|t| coverage.missing(*t, job.samples.clone()))
        .map(of)
        .sum()
}

#[cfg(test)]
mod tests;
