//! The measuring: samples in powers of two, every engine in turn.
//!
//! Each number comes from a picture begun anew, so that no two of them share samples. Engines take turns at each
//! seed: what else the machine does meanwhile hits all of them alike.

use super::engines::{Contender, EngineKind};
use super::errors::{Errors, Truth};
use crate::engine::{Counters, EngineError};
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::run::{CALL, Job, Run, StopReason, Tally};
use crate::settings::Settings;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// What is to be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// A picture of each sample count for each of them.
    pub seeds: Vec<u32>,
    /// Rendering time of each engine over all its pictures. Its first sample count is measured whatever it takes.
    pub time: Duration,
    /// The most samples a pixel.
    pub most_samples: u64,
}

/// One picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Who made it.
    pub engine: EngineKind,
    /// Samples a pixel.
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

/// Where the measuring stands, for those who wait.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Of the time that all engines have; 0..=1.
    pub fraction: f64,
    /// Who is rendering.
    pub engine: EngineKind,
    /// The samples a pixel of the picture in work.
    pub samples: u64,
}

/// Measures; what is done is in `done` whatever happens. True unless `stop` was set.
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
    /// Whether the next sample count would be too much.
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

/// Renders one picture and holds it against the truth; `None` when it was stopped.
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
