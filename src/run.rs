//! Drives an engine from an empty or half-done film to a stop condition.
//!
//! Time decides how much work an engine is given at once, and nothing else: which samples a pixel has
//! had when the run ends is decided by the [`Job`] (unless `time` or a signal ends it), and the picture does
//! not depend on how they were cut ([`crate::film`]). Error is looked at only after sample counts
//! of a fixed sequence, so that the same request stops at the same sample on every machine.

use crate::engine::{Counters, Engine, EngineError, MAX_TILE_PIXELS};
use crate::film::coverage::{Coverage, Rect};
use crate::film::{BLOCK, Film, REPLICATES};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a call to the engine should take: short enough for progress to move and for a signal to be
/// heeded, long enough that the calls' own cost does not matter.
const CALL_SECONDS: f64 = 0.4;

/// Factor between the sample counts at which the error is looked at.
const CHECK_FACTOR: f64 = 1.25;

/// The fewest samples at which the error may end a run.
const MIN_CHECKED_SAMPLES: u64 = 16;

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Disjoint rectangles of at most [`MAX_TILE_PIXELS`] pixels: see [`tiles`].
    pub tiles: Vec<Rect>,
    /// The sample numbers that every pixel is to have in the end.
    pub samples: Range<u64>,
    /// Samples in one round, strata².
    pub round: u64,
    /// Stop after this long in the engine.
    pub time: Option<Duration>,
    /// Stop when the relative error is at most this.
    pub error: Option<f64>,
}

/// What ended a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// Every pixel has its samples.
    Samples,
    /// The time was over.
    Time,
    /// The relative error was reached.
    Error,
    /// `stop` was set.
    Interrupted,
}

/// What a run has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Paths, rays and mishaps of this run.
    pub counters: Counters,
    /// Seconds spent in the engine by this run.
    pub seconds: f64,
    /// Of the samples that the job wants, those that a pixel has now, on average over the pixels.
    pub samples: f64,
    /// Relative error when it was last looked at, and the samples a pixel then.
    pub error: Option<(u64, f64)>,
    /// Where the end is, by the stop condition that looks nearest; `None` while nothing is known.
    pub forecast: Option<Forecast>,
}

/// When a run will end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Samples a pixel done, of those that it takes; 0..=1.
    pub fraction: f64,
    /// Seconds left.
    pub left: f64,
}

/// Cuts regions into tiles: disjoint rectangles that together hold the regions' pixels, each a band of
/// rows of at most `limit` pixels (at least one row). Where the cuts lie touches no bit of the picture.
pub fn tiles(regions: &[Rect], limit: u64) -> Vec<Rect> {
    let limit = limit.min(MAX_TILE_PIXELS);
    let mut out = Vec::new();
    for r in Rect::disjoint(regions) {
        // Bands of equal height: a sliver as the last one would cost a call of its own.
        let most = (limit / u64::from(r.width())).max(1);
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

/// The first sample count after `count` at which the error may be looked at: whole numbers of rounds of
/// all replicates, spaced by [`CHECK_FACTOR`], from [`MIN_CHECKED_SAMPLES`].
fn next_check(count: u64, round: u64) -> u64 {
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
    /// What it has done.
    pub tally: Tally,
    /// Seconds that one sample of one pixel takes, by the last call.
    pace: Option<f64>,
    /// Pixels of the largest tile.
    widest: u64,
    /// Pixels of all tiles.
    pixels: u64,
    /// What [`Tally::samples`] was at first.
    samples_before: f64,
}

impl<'a> Run<'a> {
    /// Readies a run; `film` holds the pixels of every tile. `stop` ends it at the next opportunity.
    pub fn new(
        job: &'a Job,
        engine: &'a mut dyn Engine,
        film: &'a mut Film,
        stop: &'a AtomicBool,
    ) -> Self {
        let pixels: u64 = job.tiles.iter().map(Rect::area).sum();
        let samples = (job.samples.end - job.samples.start) as f64
            - missing(&film.coverage, job) / pixels as f64;
        Self {
            job,
            engine,
            film,
            stop,
            tally: Tally {
                samples,
                ..Tally::default()
            },
            pace: None,
            widest: job.tiles.iter().map(Rect::area).max().unwrap_or(0),
            pixels,
            samples_before: samples,
        }
    }

    /// Renders until something ends the run. `after` is called after every call to the engine, to show,
    /// save or stop; what it fails with ends the run. On failure the film keeps what was done.
    pub fn go<E: From<EngineError>>(
        &mut self,
        mut after: impl FnMut(&Film, &Tally) -> Result<(), E>,
    ) -> Result<StopReason, E> {
        let job = self.job;
        let mut longest = 1;
        let mut at = job.samples.start;
        loop {
            at = first_missing(&self.film.coverage, job, at);
            let count = at - job.samples.start;
            let check = next_check(count.saturating_sub(1), job.round);
            if count == check && self.enough(count) {
                return Ok(StopReason::Error);
            }
            if at >= job.samples.end {
                return Ok(StopReason::Samples);
            }
            let next = next_check(count, job.round);
            let end = self.pass_end(at, longest).min(job.samples.start + next);
            // Pass lengths grow from 1: the first picture comes early.
            longest = longest.max((end - at) * 2);
            for tile in &job.tiles {
                for (rect, ranges) in self.film.coverage.missing(*tile, at..end) {
                    for part in ranges {
                        if self.stop.load(Ordering::Relaxed) {
                            return Ok(StopReason::Interrupted);
                        }
                        if self.too_late(rect, &part) {
                            return Ok(StopReason::Time);
                        }
                        if !self.call(rect, part)? {
                            return Ok(StopReason::Interrupted);
                        }
                        self.tally.forecast = self.forecast();
                        after(self.film, &self.tally)?;
                    }
                }
            }
        }
    }

    /// One call to the engine; false when it was stopped.
    fn call(&mut self, rect: Rect, samples: Range<u64>) -> Result<bool, EngineError> {
        let work = rect.area() as f64 * (samples.end - samples.start) as f64;
        let begun = Instant::now();
        let result = self.engine.render(self.film, rect, samples, self.stop);
        let seconds = begun.elapsed().as_secs_f64();
        self.tally.seconds += seconds;
        match result {
            Ok(counters) => self.tally.counters += counters,
            Err(EngineError::Stopped) => return Ok(false),
            Err(e) => return Err(e),
        }
        self.tally.samples += work / self.pixels as f64;
        self.pace = Some(seconds / work);
        Ok(true)
    }

    /// Where a pass that starts at `at` ends: after at most `longest` samples, at the end of their block, of
    /// the job, or of what a call can do in time.
    fn pass_end(&self, at: u64, longest: u64) -> u64 {
        let block_end = (at / BLOCK + 1) * BLOCK;
        let mut length = longest;
        if let Some(pace) = self.pace {
            let fits = |seconds: f64, pixels: u64| (seconds / (pace * pixels as f64)) as u64;
            length = length.min(fits(CALL_SECONDS, self.widest));
            if let Some(time) = self.job.time {
                // So that all tiles come to the same count when the time ends.
                let left = (time.as_secs_f64() - self.tally.seconds).max(0.0);
                length = length.min(fits(left, self.pixels));
            }
        }
        (at + length.max(1))
            .min(block_end)
            .min(self.job.samples.end)
    }

    /// Whether the time is over, or would be before half of this call were done. The first sample of
    /// a pixel is never too late: a picture has no holes.
    fn too_late(&self, rect: Rect, samples: &Range<u64>) -> bool {
        let Some(time) = self.job.time else {
            return false;
        };
        if samples.start == self.job.samples.start {
            return false;
        }
        let work = rect.area() as f64 * (samples.end - samples.start) as f64;
        self.tally.seconds + self.pace.unwrap_or(0.0) * work / 2.0 > time.as_secs_f64()
    }

    /// Looks at the error after `count` samples of every pixel; whether it is small enough.
    fn enough(&mut self, count: u64) -> bool {
        let Some(error) = self.film.relative_error() else {
            return false;
        };
        self.tally.error = Some((count, error));
        self.job.error.is_some_and(|wanted| error <= wanted)
    }

    /// See [`Tally::forecast`].
    fn forecast(&self) -> Option<Forecast> {
        let job = self.job;
        let done = self.tally.samples;
        let per_sample = self.tally.seconds / (done - self.samples_before);
        let mut needed = (job.samples.end - job.samples.start) as f64;
        if let Some(time) = job.time {
            needed = needed.min(done + (time.as_secs_f64() - self.tally.seconds) / per_sample);
        }
        match (job.error, self.tally.error) {
            // The error falls with the square root of the samples.
            (Some(target), Some((count, error))) => {
                needed = needed.min(count as f64 * (error / target).powi(2));
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

/// The first sample number from `from` on that some pixel of the job lacks; the job's end if none.
fn first_missing(coverage: &Coverage, job: &Job, from: u64) -> u64 {
    job.tiles
        .iter()
        .flat_map(|t| coverage.missing(*t, from..job.samples.end))
        .filter_map(|(_, ranges)| ranges.first().map(|r| r.start))
        .min()
        .unwrap_or(job.samples.end)
}

/// Samples times pixels that the job still lacks.
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
mod tests {
    use super::*;
    use crate::engine::DeviceInfo;
    use crate::film::Sums;

    /// An engine whose pixels are noise that depends on pixel and sample number alone; notes its calls.
    struct Fake {
        device: DeviceInfo,
        calls: Vec<(Rect, Range<u64>)>,
        nap: Duration,
        fail_at: Option<usize>,
    }

    impl Fake {
        fn new() -> Self {
            Self {
                device: DeviceInfo {
                    name: "fake".into(),
                    driver: String::new(),
                    backend: "cpu".into(),
                    software: true,
                },
                calls: Vec::new(),
                nap: Duration::ZERO,
                fail_at: None,
            }
        }
    }

    /// A value in 0..1 from a pixel and a sample.
    fn noise(x: u32, y: u32, s: u64) -> f64 {
        let h = (u64::from(x) << 40 ^ u64::from(y) << 20 ^ s).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / (1u64 << 24) as f64
    }

    impl Engine for Fake {
        fn render(
            &mut self,
            film: &mut Film,
            rect: Rect,
            samples: Range<u64>,
            stop: &AtomicBool,
        ) -> Result<Counters, EngineError> {
            assert!(rect.area() <= MAX_TILE_PIXELS);
            assert!(film.coverage.overlap(rect, &samples).is_none());
            if stop.load(Ordering::Relaxed) {
                return Err(EngineError::Stopped);
            }
            if self.fail_at == Some(self.calls.len()) {
                return Err(EngineError::Device("lost".into()));
            }
            std::thread::sleep(self.nap);
            let round = u64::from(film.strata * film.strata);
            film.put_block(rect, samples.clone(), |_, _| [[0.0; 4]; REPLICATES]);
            let pixels = (rect.y0..rect.y1)
                .flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)))
                .map(|(x, y)| {
                    let mut sums: [Sums<f64>; REPLICATES] = film.sums()[film.index(x, y)];
                    for s in samples.clone() {
                        let v = noise(x, y, s);
                        let r = &mut sums[(s / round) as usize % REPLICATES];
                        *r = [r[0] + v, r[1] + v, r[2] + v, r[3] + v * v];
                    }
                    sums
                });
            let (pixels, coverage) = (pixels.collect::<Vec<_>>(), film.coverage.clone());
            film.coverage = Coverage::default();
            film.put_samples(rect, samples.clone(), pixels);
            film.coverage = coverage;
            self.calls.push((rect, samples.clone()));
            Ok(Counters {
                paths: rect.area() * (samples.end - samples.start),
                ..Counters::default()
            })
        }

        fn device(&self) -> &DeviceInfo {
            &self.device
        }
    }

    fn job(size: [u32; 2], limit: u64, samples: Range<u64>) -> Job {
        Job {
            tiles: tiles(&[Rect::whole(size)], limit),
            samples,
            round: 4,
            time: None,
            error: None,
        }
    }

    fn run(job: &Job, engine: &mut Fake, film: &mut Film) -> StopReason {
        let stop = AtomicBool::new(false);
        let mut run = Run::new(job, engine, film, &stop);
        run.go(|_, _| Ok::<(), EngineError>(())).unwrap()
    }

    #[test]
    fn tiles_hold_each_pixel_once_within_the_limit() {
        let r = |x0, y0, x1, y1| Rect { x0, y0, x1, y1 };
        let regions = [r(0, 0, 50, 40), r(30, 20, 90, 70), r(95, 0, 96, 70)];
        let cut = tiles(&regions, 1000);
        for y in 0..80 {
            for x in 0..100 {
                let wanted = regions.iter().any(|r| r.contains(x, y));
                let found = cut.iter().filter(|t| t.contains(x, y)).count();
                assert_eq!(found, usize::from(wanted), "pixel {x}, {y}");
            }
        }
        assert!(cut.iter().all(|t| t.area() <= 1000));
        // A row longer than the limit is a tile of its own.
        assert_eq!(tiles(&[r(0, 0, 65536, 2)], 1000).len(), 2);
        assert_eq!(tiles(&[Rect::whole([65536, 65536])], u64::MAX).len(), 4096);
    }

    #[test]
    fn passes_cover_the_job_grow_and_stay_in_their_block() {
        let job = job([7, 5], 14, 0..700);
        let mut film = Film::new([7, 5], Rect::whole([7, 5]), 2);
        let mut engine = Fake::new();
        assert_eq!(run(&job, &mut engine, &mut film), StopReason::Samples);
        assert_eq!(film.coverage.samples(), (700, 700));
        assert_eq!(engine.calls[0].1, 0..1);
        for (_, s) in &engine.calls {
            assert_eq!(s.start / BLOCK, (s.end - 1) / BLOCK, "{s:?}");
        }
        assert!(engine.calls.iter().any(|(_, s)| s.end - s.start >= 64));
    }

    #[test]
    fn resuming_does_only_what_is_missing() {
        let size = [7, 5];
        let mut film = Film::new(size, Rect::whole(size), 2);
        run(&job(size, 14, 40..50), &mut Fake::new(), &mut film);
        let mut engine = Fake::new();
        run(&job(size, 21, 0..100), &mut engine, &mut film);
        let paths: u64 = engine
            .calls
            .iter()
            .map(|(r, s)| r.area() * (s.end - s.start))
            .sum();
        assert_eq!(paths, 35 * 90);
        assert_eq!(film.coverage.samples(), (100, 100));
        let mut again = Fake::new();
        assert_eq!(
            run(&job(size, 14, 0..100), &mut again, &mut film),
            StopReason::Samples
        );
        assert!(again.calls.is_empty());
    }

    #[test]
    fn the_error_ends_a_run_at_the_same_sample_however_slow_the_machine() {
        let size = [16, 16];
        let mut ends = Vec::new();
        for nap in [0, 30] {
            let mut film = Film::new(size, Rect::whole(size), 2);
            let mut job = job(size, 128, 0..4096);
            job.error = Some(0.06);
            let mut engine = Fake::new();
            engine.nap = Duration::from_millis(nap);
            assert_eq!(run(&job, &mut engine, &mut film), StopReason::Error);
            assert!(film.relative_error().unwrap() <= 0.06);
            let (least, most) = film.coverage.samples();
            assert_eq!(least, most);
            assert!(least > 16 && least < 400, "{least}");
            ends.push(least);
        }
        assert_eq!(ends[0], ends[1]);
    }

    #[test]
    fn checks_are_whole_rounds_of_all_replicates() {
        let mut count = 0;
        let mut seen = Vec::new();
        for _ in 0..6 {
            count = next_check(count, 4);
            seen.push(count);
        }
        assert_eq!(seen, [16, 32, 48, 64, 80, 112]);
        assert_eq!(next_check(0, 1), 16);
        assert_eq!(next_check(0, 9), 36);
    }

    #[test]
    fn time_ends_a_run_but_leaves_no_holes() {
        let size = [8, 8];
        let mut film = Film::new(size, Rect::whole(size), 2);
        let mut job = job(size, 16, 0..1_000_000);
        job.time = Some(Duration::from_millis(60));
        let mut engine = Fake::new();
        engine.nap = Duration::from_millis(40);
        let begun = Instant::now();
        assert_eq!(run(&job, &mut engine, &mut film), StopReason::Time);
        assert!(begun.elapsed() < Duration::from_secs(2));
        assert_eq!(film.coverage.samples().0, 1);
    }

    #[test]
    fn a_failing_device_leaves_what_was_done() {
        let size = [8, 8];
        let mut film = Film::new(size, Rect::whole(size), 2);
        let job = job(size, 64, 0..64);
        let mut engine = Fake::new();
        engine.fail_at = Some(3);
        let stop = AtomicBool::new(false);
        let mut run = Run::new(&job, &mut engine, &mut film, &stop);
        let e = run.go(|_, _| Ok::<(), EngineError>(())).unwrap_err();
        assert_eq!(e, EngineError::Device("lost".into()));
        assert!(film.coverage.samples().0 > 0);
    }

    #[test]
    fn a_stop_flag_is_heeded_between_calls() {
        let size = [8, 8];
        let mut film = Film::new(size, Rect::whole(size), 2);
        let job = job(size, 64, 0..1_000_000);
        let mut engine = Fake::new();
        let stop = AtomicBool::new(false);
        let mut run = Run::new(&job, &mut engine, &mut film, &stop);
        let reason = run.go(|_, tally| {
            stop.store(tally.samples >= 100.0, Ordering::Relaxed);
            Ok::<(), EngineError>(())
        });
        assert_eq!(reason.unwrap(), StopReason::Interrupted);
        assert!(film.coverage.samples().0 >= 100);
    }
}
