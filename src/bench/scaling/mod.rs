//! Measures seconds per path against the number of objects, and finds the number from which a tree is faster than testing
//! every object.
//!
//! The scenes have 1, 2, 4, ... spheres, in a sunflower or a cloud, or lamps, and similar pictures for every number. The engines take turns at each
//! count, so that other load on the machine affects all of them equally.

pub mod crossing;
pub mod text;

pub use crossing::{Crossing, crossing};

use super::engines::{Contender, EngineKind, Unready};
use crate::engine::{Counters, DeviceInfo, EngineError};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::gpu::Gpu;
use crate::kernel::BAKED_LIMIT;
use crate::run::{CALL, Job, Run, StopReason, Tally};
use crate::scene::{Diagnostic, Scene, generate};
use crate::settings::{Overrides, Settings};
use crate::world::{MAX_SCANNED_LIGHTS, World};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// If compiling a baked kernel takes longer than this, larger counts are skipped: compile time grows with the number of
/// objects, and compiling can't be interrupted.
const LONGEST_COMPILE: f64 = 4.0;

/// Pictures per count. The fastest one is used, since other load on the machine only adds time.
const PICTURES: u32 = 3;

/// The kind of object that grows in number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Series {
    /// [`generate::spheres`].
    Spheres,
    /// [`generate::cloud`].
    Cloud,
    /// [`generate::lights`].
    Lights,
}

impl Series {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Spheres, Self::Cloud, Self::Lights];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spheres => "spheres",
            Self::Cloud => "cloud",
            Self::Lights => "lights",
        }
    }

    /// Its objects, in the plural.
    pub fn things(self) -> &'static str {
        match self {
            Self::Spheres | Self::Cloud => "spheres",
            Self::Lights => "lights",
        }
    }

    /// So many of them, in words.
    pub fn of(self, count: usize) -> String {
        let things = self.things();
        let things = if count == 1 {
            &things[..things.len() - 1]
        } else {
            things
        };
        format!("{count} {things}")
    }

    /// The scene with `count` objects.
    pub fn scene(self, count: usize) -> Result<Scene, Vec<Diagnostic>> {
        let generated = match self {
            Self::Spheres => generate::spheres(count, 0, "rows.csv"),
            Self::Cloud => generate::cloud(count, 0, "rows.csv"),
            Self::Lights => generate::lights(count, 0, "rows.csv"),
        };
        generated.parse(Path::new(self.name()))
    }
}

/// What is to be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The largest count.
    pub most: usize,
    /// Rendering time of each engine over all counts, without warm-up. Its first count is always measured.
    pub time: Duration,
    /// Most samples per pixel.
    pub most_samples: u64,
}

impl Plan {
    /// Powers of two, and the largest count itself.
    fn counts(&self) -> Vec<usize> {
        let doubled = |n: &usize| n.checked_mul(2);
        let mut counts: Vec<usize> = std::iter::successors(Some(1), doubled)
            .take_while(|&n| n < self.most)
            .collect();
        counts.push(self.most);
        counts
    }
}

/// One engine at one count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Who.
    pub engine: EngineKind,
    /// How many things.
    pub count: usize,
    /// Surfaces of the scene, these things and lights among them.
    pub surfaces: usize,
    /// See [`Contender::compile_seconds`].
    pub compile_seconds: f64,
    /// See [`Contender::warm_up_seconds`].
    pub warm_up_seconds: f64,
    /// Samples per pixel, on average.
    pub samples: f64,
    /// Seconds in the engine, reading back included.
    pub seconds: f64,
    /// Seconds of those that went into bringing samples from the device into the film.
    pub read_back_seconds: f64,
    /// Paths, rays and mishaps.
    pub counters: Counters,
}

impl Timing {
    /// Seconds over camera paths.
    pub fn seconds_per_path(&self) -> f64 {
        self.seconds / self.counters.paths as f64
    }
}

/// Where an engine's line ends before the largest count.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    /// Whose.
    pub engine: EngineKind,
    /// The last count that was measured.
    pub count: usize,
    /// Why there is no more.
    pub why: String,
}

/// All that was measured of one series.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// Of what.
    pub series: Series,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The engines, in the order that was asked for, and what each of them runs on.
    pub engines: Vec<(EngineKind, Option<DeviceInfo>)>,
    /// Counts rise, and engines take turns at each.
    pub timings: Vec<Timing>,
    /// Lines that end early.
    pub ends: Vec<End>,
    /// Surfaces of every scene that are not counted; lights among them.
    pub others: usize,
    /// Lights of every scene that are not counted.
    pub other_lights: usize,
}

impl Scaling {
    /// Nothing yet, of these engines.
    pub fn new(series: Series, engines: &[EngineKind]) -> Self {
        Self {
            series,
            size: [0; 2],
            engines: engines.iter().map(|&kind| (kind, None)).collect(),
            timings: Vec::new(),
            ends: Vec::new(),
            others: 0,
            other_lights: 0,
        }
    }

    /// Counts and seconds per path of one engine.
    pub fn costs(&self, engine: EngineKind) -> Vec<(usize, f64)> {
        let mine = self.timings.iter().filter(|t| t.engine == engine);
        mine.map(|t| (t.count, t.seconds_per_path())).collect()
    }

    /// The engines without trees that were measured together with gpu-tree, and the counts where both are equally fast.
    pub fn crossings(&self) -> Vec<(EngineKind, Crossing)> {
        let tree = self.costs(EngineKind::GpuTree);
        [EngineKind::GpuBaked, EngineKind::GpuBuffers]
            .into_iter()
            .filter_map(|kind| Some((kind, crossing(&self.costs(kind), &tree)?)))
            .collect()
    }

    /// The largest count for which render uses gpu-baked by default.
    pub fn baked_up_to(&self) -> Option<usize> {
        let most = BAKED_LIMIT.checked_sub(self.others)?;
        (self.has(EngineKind::GpuBaked) && most > 0).then_some(most)
    }

    /// The largest count for which gpu-tree weighs every light when it chooses one.
    pub fn looked_at_up_to(&self) -> Option<usize> {
        let most = MAX_SCANNED_LIGHTS.checked_sub(self.other_lights)?;
        (self.series == Series::Lights && self.has(EngineKind::GpuTree)).then_some(most)
    }

    fn has(&self, engine: EngineKind) -> bool {
        self.engines.iter().any(|(kind, _)| *kind == engine)
    }

    fn end(&mut self, engine: EngineKind, why: String) {
        let count = self.costs(engine).last().map_or(0, |&(count, _)| count);
        self.ends.push(End { engine, count, why });
    }
}

/// An engine whose line has not ended.
struct Line {
    engine: EngineKind,
    /// Seconds of rendering that it still has.
    left: f64,
}

/// Runs the plan. `scaling` holds the results so far, even after an error. Returns false if `stop` was set. Calls `show` with
/// the fraction done and a description.
pub fn measure(
    scaling: &mut Scaling,
    gpu: Option<&Arc<Gpu>>,
    overrides: &Overrides,
    plan: &Plan,
    stop: &AtomicBool,
    mut show: impl FnMut(f64, &str),
) -> Result<bool, Unready> {
    let counts = plan.counts();
    let left = plan.time.as_secs_f64();
    let engines = scaling.engines.iter();
    let mut lines: Vec<Line> = engines.map(|&(engine, _)| Line { engine, left }).collect();
    for (k, &count) in counts.iter().enumerate() {
        if lines.is_empty() {
            break;
        }
        let things = scaling.series.of(count);
        show(share(k, 0.0, &counts), &format!("preparing {things}"));
        let scene = scaling.series.scene(count).map_err(|wrong| {
            let all: Vec<String> = wrong.iter().map(Diagnostic::to_string).collect();
            EngineError::Device(all.join("\n"))
        })?;
        let settings = Settings::resolve(&scene, overrides);
        let world = World::new(&scene, settings.size);
        let surfaces = world.primitives.len() + world.lights.len();
        scaling.size = settings.size;
        scaling.others = surfaces - count;
        scaling.other_lights = match scaling.series {
            Series::Lights => world.lights.len() - count,
            Series::Spheres | Series::Cloud => world.lights.len(),
        };
        let all = lines.len() as f64;
        let mut on = Vec::new();
        for (i, mut line) in lines.into_iter().enumerate() {
            let done = share(k, i as f64 / all, &counts);
            show(done, &format!("{things}: {}", line.engine.name()));
            let mut contender = match Contender::new(line.engine, gpu, &world, &settings, stop) {
                Ok(contender) => contender,
                Err(Unready::Engine(EngineError::Stopped)) => return Ok(false),
                // A driver that fails at a larger count ends the line; one that fails at the first count is an error.
                Err(Unready::Gpu(e)) if k > 0 => {
                    scaling.end(line.engine, e.to_string());
                    continue;
                }
                Err(e) => return Err(e),
            };
            let time = line.left / (counts.len() - k) as f64;
            let counted = [count, surfaces];
            let timed = time_paths(&mut contender, counted, &settings, plan, time, stop)?;
            let Some((timing, spent)) = timed else {
                return Ok(false);
            };
            let device = contender.device().clone();
            for (_, of) in scaling.engines.iter_mut().filter(|e| e.0 == line.engine) {
                *of = Some(device.clone());
            }
            scaling.timings.push(timing);
            line.left = (line.left - spent).max(0.0);
            match ends_with(&timing, line.left) {
                Some(why) if k + 1 < counts.len() => scaling.end(line.engine, why),
                _ => on.push(line),
            }
        }
        lines = on;
    }
    Ok(true)
}

/// The share of the work that is done when `part` of count number `k` is.
fn share(k: usize, part: f64, counts: &[usize]) -> f64 {
    (k as f64 + part) / counts.len() as f64
}

/// Why an engine's line ends here, given the seconds left.
fn ends_with(timing: &Timing, left: f64) -> Option<String> {
    if timing.engine == EngineKind::GpuBaked && timing.compile_seconds > LONGEST_COMPILE {
        return Some(format!("compiling took {:.1} s", timing.compile_seconds));
    }
    // For twice as many objects, if each one is tested.
    let sample = 2.0 * timing.seconds / timing.samples;
    (sample > left)
        .then(|| format!("the next count may take longer than the {left:.1} s left of --time"))
}

/// The fastest of [`PICTURES`] pictures in about `time`, fewer where one sample of every pixel takes long, and the seconds
/// of all of them; `None` when it was stopped. `counts` are the things and all surfaces.
fn time_paths(
    contender: &mut Contender,
    [count, surfaces]: [usize; 2],
    settings: &Settings,
    plan: &Plan,
    time: f64,
    stop: &AtomicBool,
) -> Result<Option<(Timing, f64)>, EngineError> {
    let job = Job {
        tiles: contender.tiles.clone(),
        samples: 0..plan.most_samples,
        round: settings.round(),
        time: Some(Duration::from_secs_f64(time / f64::from(PICTURES))),
        error: None,
        black: false,
        call: CALL,
        adaptive: None,
    };
    let mut best: Option<Timing> = None;
    let mut spent = 0.0;
    for made in 0..PICTURES {
        // The last picture predicts the time of the next.
        if made > 0 && spent * f64::from(made + 1) / f64::from(made) > 1.5 * time {
            break;
        }
        let before = contender.read_back_seconds();
        let mut film = Film::new(settings.size, Rect::whole(settings.size), settings.strata);
        let mut run = Run::new(&job, contender.engine_mut(), &mut film, stop);
        if run.go(|_, _: &Tally| Ok::<(), EngineError>(()))? == StopReason::Interrupted {
            return Ok(None);
        }
        let tally = run.tally;
        spent += tally.seconds;
        let one = Timing {
            engine: contender.kind,
            count,
            surfaces,
            compile_seconds: contender.compile_seconds,
            warm_up_seconds: contender.warm_up_seconds,
            samples: tally.samples,
            seconds: tally.seconds,
            read_back_seconds: contender.read_back_seconds() - before,
            counters: tally.counters,
        };
        if best.is_none_or(|b| one.seconds_per_path() < b.seconds_per_path()) {
            best = Some(one);
        }
    }
    Ok(best.map(|best| (best, spent)))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// `engine` at `count`, a path costing so many nanoseconds.
    pub fn timing(engine: EngineKind, count: usize, nanoseconds: u64) -> Timing {
        Timing {
            engine,
            count,
            surfaces: count + 3,
            compile_seconds: 0.2,
            warm_up_seconds: 0.1,
            samples: 10.0,
            seconds: nanoseconds as f64 * 1e-3,
            read_back_seconds: 0.01,
            counters: Counters {
                paths: 1_000_000,
                rays: 6_000_000,
                ..Counters::default()
            },
        }
    }

    /// Baked kernels whose cost is the count's, up to 256, and trees whose cost is 50 of it.
    pub fn scaling() -> Scaling {
        let mut s = Scaling::new(
            Series::Spheres,
            &[EngineKind::GpuBaked, EngineKind::GpuTree],
        );
        (s.size, s.others, s.other_lights) = ([512, 384], 3, 2);
        for k in 0..12 {
            if k <= 8 {
                s.timings
                    .push(timing(EngineKind::GpuBaked, 1 << k, 10 << k));
            }
            s.timings.push(timing(EngineKind::GpuTree, 1 << k, 500));
        }
        s.end(EngineKind::GpuBaked, "compiling took 4.2 s".into());
        s
    }

    #[test]
    fn counts_double_up_to_the_largest() {
        let counts = |most| {
            let time = Duration::ZERO;
            let most_samples = 1;
            Plan {
                most,
                time,
                most_samples,
            }
            .counts()
        };
        assert_eq!(counts(1), [1]);
        assert_eq!(counts(8), [1, 2, 4, 8]);
        assert_eq!(counts(9), [1, 2, 4, 8, 9]);
    }

    #[test]
    fn scenes_have_the_things_and_the_rule_counts_all_surfaces() {
        for series in Series::ALL {
            let of = |count| World::new(&series.scene(count).expect("a scene"), [4, 4]);
            let all = |w: &World| w.primitives.len() + w.lights.len();
            let (few, many) = (of(1), of(300));
            assert_eq!(all(&many) - all(&few), 299, "{}", series.name());
            let others = all(&few) - 1;
            let s = Scaling {
                others,
                ..Scaling::new(series, &[EngineKind::GpuBaked])
            };
            let limit = s.baked_up_to().expect("some are baked");
            assert_eq!(all(&of(limit)), BAKED_LIMIT);
            assert_eq!(
                s.looked_at_up_to(),
                None,
                "without trees there are none of lights"
            );
        }
    }

    #[test]
    fn a_line_ends_where_compiling_or_rendering_takes_too_long() {
        let t = timing(EngineKind::GpuBaked, 64, 1000);
        // A sample takes 0.1 s.
        assert_eq!(ends_with(&t, 0.21), None);
        assert!(ends_with(&t, 0.19).is_some_and(|why| why.contains("--time")));
        let slow = |engine| Timing {
            compile_seconds: 5.0,
            ..timing(engine, 64, 1000)
        };
        assert!(ends_with(&slow(EngineKind::GpuBaked), 9.0).is_some());
        assert_eq!(ends_with(&slow(EngineKind::GpuTree), 9.0), None);
    }
}
