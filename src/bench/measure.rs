//! Measures pictures with sample counts in powers of two, with each engine in turn.
//!
//! Each picture is rendered from the first sample, so that no two of them share samples. The engines take turns at each
//! seed, so that other load on the machine affects all of them equally.

use super::engines::{Contender, EngineKind};
use super::errors::{Errors, Truth};
use crate::engine::{Counters, EngineError};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::run::{CALL, Job, Run, StopReason, Tally};
use crate::settings::Settings;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The plan of a benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The seeds: one picture per sample count and seed.
    pub seeds: Vec<u32>,
    /// Rendering time of each engine over all its pictures. Its first sample count is always measured.
    pub time: Duration,
    /// Most samples per pixel.
    pub most_samples: u64,
}

/// One picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Its engine.
    pub engine: EngineKind,
    /// Samples per pixel.
    pub samples: u64,
    /// Its seed.
    pub seed: u32,
    /// Seconds in the engine, reading back included.
    pub seconds: f64,
    /// Seconds of those that went into bringing samples from the device into the film.
    pub read_back_seconds: f64,
    /// Paths, rays and mishaps.
    pub counters: Counters,
    /// How far it is from the truth.
    pub errors: Errors,
}

/// The progress of a benchmark.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Fraction of the time of all engines, 0..=1.
    pub fraction: f64,
    /// The engine that is rendering.
    pub engine: EngineKind,
    /// Samples per pixel of the current picture.
    pub samples: u64,
}

/// Runs the plan. `done` holds the results so far, even after an error. Returns false if `stop` was set.
pub fn measure(
    contenders: &mut [Contender],
    truth: &Truth,
    settings: &Settings,
    plan: &Plan,
    stop: &AtomicBool,
    done: &mut Vec<Measurement>,
    mut show: impl FnMut(Standing),
) -> Result<bool, EngineError> {
    let limit = plan.time.as_secs_f64();
    let all = limit * contenders.len() as f64;
    let mut spent = vec![Spent::default(); contenders.len()];
    let mut samples = 1;
    while samples <= plan.most_samples {
        for s in &mut spent {
            // Twice the samples take twice as long.
            s.over |= s.total + 2.0 * s.last > limit;
            s.last = 0.0;
        }
        if spent.iter().all(|s| s.over) {
            break;
        }
        for &seed in &plan.seeds {
            for (i, contender) in contenders.iter_mut().enumerate() {
                if spent[i].over {
                    continue;
                }
                let before: f64 = spent.iter().map(|s| s.counted(limit)).sum();
                let engine = contender.kind;
                let show = |tally: &Tally| {
                    show(Standing {
                        fraction: ((before + tally.seconds) / all).min(1.0),
                        engine,
                        samples,
                    });
                };
                let Some(one) = picture(contender, truth, settings, seed, samples, stop, show)?
                else {
                    return Ok(false);
                };
                spent[i].total += one.seconds;
                spent[i].last += one.seconds;
                done.push(one);
            }
        }
        samples *= 2;
    }
    Ok(true)
}

/// Time that an engine has had.
#[derive(Debug, Clone, Copy, Default)]
struct Spent {
    /// Seconds over all its pictures.
    total: f64,
    /// Seconds over those of the last sample count.
    last: f64,
    /// Whether the next sample count would take too long.
    over: bool,
}

impl Spent {
    /// Its share of the progress, of `limit` seconds.
    fn counted(&self, limit: f64) -> f64 {
        if self.over {
            limit
        } else {
            self.total.min(limit)
        }
    }
}

/// Renders one picture and compares it with the reference; `None` if it was stopped.
fn picture(
    contender: &mut Contender,
    truth: &Truth,
    settings: &Settings,
    seed: u32,
    samples: u64,
    stop: &AtomicBool,
    mut show: impl FnMut(&Tally),
) -> Result<Option<Measurement>, EngineError> {
    contender.reseed(seed);
    let mut film = Film::new(settings.size, Rect::whole(settings.size), settings.strata);
    let job = Job {
        tiles: contender.tiles.clone(),
        samples: 0..samples,
        round: settings.round(),
        time: None,
        error: None,
        black: false,
        call: CALL,
        adaptive: None,
    };
    let before = contender.read_back_seconds();
    let mut run = Run::new(&job, contender.engine_mut(), &mut film, stop);
    show(&run.tally);
    let ended = run.go(|_, tally| {
        show(tally);
        Ok::<(), EngineError>(())
    })?;
    let tally = run.tally;
    if ended == StopReason::Interrupted {
        return Ok(None);
    }
    Ok(Some(Measurement {
        engine: contender.kind,
        samples,
        seed,
        seconds: tally.seconds,
        read_back_seconds: contender.read_back_seconds() - before,
        counters: tally.counters,
        errors: truth.errors(&film),
    }))
}
