//! What a render is to do: which pixels, which samples, and what ends it.

use super::args::{Backend, RenderArgs};
use super::failure::Failure;
use super::progress::{clock, percent};
use crate::files::FileError;
use crate::film::Film;
use crate::film::coverage::{Coverage, Rect};
use crate::render::plan::end_for;
use crate::render::{DEFAULT_SPP, MAX_SAMPLES};
use crate::scene::Scene;
use crate::settings::Settings;
use std::ops::Range;
use std::path::Path;

/// Refuses an adapter's name beside the reference.
pub fn check_flags(backend: Backend, adapter: Option<&str>) -> Result<(), Failure> {
    if backend == Backend::Cpu && adapter.is_some() {
        let message = "--adapter names a GPU adapter, which --backend cpu does not use";
        return Err(Failure::Input(message.into()));
    }
    Ok(())
}

/// The pixels to render: the regions asked for, or the whole picture. A region that reaches out of
/// the picture is refused.
pub fn regions(args: &RenderArgs, settings: &Settings) -> Result<Vec<Rect>, Failure> {
    let [width, height] = settings.size;
    if args.region.is_empty() {
        return Ok(vec![Rect::whole(settings.size)]);
    }
    for r in &args.region {
        if r.x1 > width || r.y1 > height {
            return Err(Failure::Input(format!(
                "--region {}: it reaches out of the picture of {width}x{height} pixels",
                r
            )));
        }
    }
    Ok(args.region.clone())
}

/// Refuses regions that a film of another part of the picture has no room for.
pub fn check_bounds(path: &Path, film: &Film, bounds: Rect) -> Result<(), Failure> {
    if film.bounds.union(&bounds) == film.bounds {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: this film holds the part {} of the picture, and the part asked for is {}; render the rest into a film \
         of its own, and merge",
        path.display(),
        film.bounds,
        bounds
    )))
}

/// Refuses to go on adaptively with a film that was not made so, or of other regions, and evenly with one that was.
pub fn check_adaptive(
    args: &RenderArgs,
    path: &Path,
    film: &Film,
    regions: &[Rect],
) -> Result<(), Failure> {
    let problem = match &film.pilot {
        Some(_) if !args.adaptive => "this film was made with --adaptive, and only goes on with it",
        None if args.adaptive => "this film was made without --adaptive, and only goes on without",
        Some(pilot) if !pilot.is_for(regions) => {
            "this is an adaptive film of other regions, and only goes on with those"
        }
        _ => return Ok(()),
    };
    Err(FileError::content(path, problem).into())
}

/// The sample numbers that every pixel of `regions` is to have in the end.
pub fn samples(
    args: &RenderArgs,
    settings: &Settings,
    regions: &[Rect],
    held: &Coverage,
) -> Result<Range<u64>, Failure> {
    if let Some(range) = &args.samples {
        return Ok(range.clone());
    }
    let wanted = wanted(args, settings)?;
    if args.adaptive {
        return Ok(0..wanted);
    }
    Ok(0..end_for(wanted, regions, held))
}

/// Samples that a pixel is to have in all, what a film holds included; [`MAX_SAMPLES`] when time or error
/// alone end the run.
fn wanted(args: &RenderArgs, settings: &Settings) -> Result<u64, Failure> {
    let by_rays = match args.rays {
        None => None,
        Some(rays) => Some(
            rays.checked_mul(settings.round())
                .filter(|&n| n <= MAX_SAMPLES)
                .ok_or_else(|| {
                    let strata = settings.strata;
                    Failure::Input(format!(
                        "--rays {rays}: with {strata} x {strata} strata that is more than {MAX_SAMPLES} samples a pixel"
                    ))
                })?,
        ),
    };
    Ok(match [args.spp, by_rays].into_iter().flatten().min() {
        Some(n) => n,
        None if args.time.is_some() || args.error.is_some() => MAX_SAMPLES,
        None => DEFAULT_SPP,
    })
}

/// `4 surfaces`: primitives and lights, of which every scene has several or one.
pub fn things(scene: &Scene) -> String {
    let n = scene.primitives.len() + scene.lights.len();
    let s = if n == 1 { "" } else { "s" };
    format!("{n} surface{s}")
}

/// `1 sample a pixel`, `2 samples a pixel`.
pub fn count(samples: u64) -> String {
    let s = if samples == 1 { "" } else { "s" };
    format!("{samples} sample{s} a pixel")
}

/// `120 samples a pixel`, or `119 to 120`.
pub fn samples_text(film: &Film) -> String {
    match film.coverage.samples() {
        (a, b) if a == b => count(a),
        (a, b) if film.pilot.is_some() => format!(
            "{:.1} samples a pixel on average ({a} to {b})",
            film.coverage.mean()
        ),
        (a, b) => format!("{a} to {}", count(b)),
    }
}

/// What will end the run, for the start-up line.
pub fn ends(args: &RenderArgs, settings: &Settings) -> Result<String, Failure> {
    let mut conditions = Vec::new();
    if let Some(range) = &args.samples {
        conditions.push(format!("samples {}..{} are done", range.start, range.end));
    } else {
        let wanted = wanted(args, settings)?;
        if wanted < MAX_SAMPLES {
            let mean = if args.adaptive { " on average" } else { "" };
            conditions.push(count(wanted) + mean);
        }
    }
    if let Some(error) = args.error {
        conditions.push(format!("relative error {}", percent(error)));
    }
    if let Some(time) = args.time {
        conditions.push(format!("{} of rendering", clock(time.as_secs_f64())));
    }
    Ok(format!("until {}", conditions.join(", or ")))
}
