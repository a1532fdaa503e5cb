//! Plans a render: which pixels, which samples, and when to stop.

use super::args::RenderArgs;
use super::failure::Failure;
use super::progress::{clock, percent};
use super::values::MAX_SAMPLES;
use crate::film::Film;
use crate::film::coverage::{Coverage, Rect};
use crate::output::FileError;
use crate::scene::Scene;
use crate::settings::Settings;
use std::ops::Range;
use std::path::Path;

/// Samples per pixel when no stop condition is given.
const DEFAULT_SPP: u64 = 256;

/// The pixels to render: the given regions, or the whole picture. Refuses a region that exceeds the picture.
pub fn regions(args: &RenderArgs, settings: &Settings) -> Result<Vec<Rect>, Failure> {
    let [width, height] = settings.size;
    if args.region.is_empty() {
        return Ok(vec![Rect::whole(settings.size)]);
    }
    for r in &args.region {
        if r.x1 > width || r.y1 > height {
            return Err(Failure::Input(format!(
                "--region {} exceeds the picture of {width}x{height} pixels",
                r
            )));
        }
    }
    Ok(args.region.clone())
}

/// The smallest rectangle around all regions. `regions` must not be empty.
pub fn bounds(regions: &[Rect]) -> Rect {
    regions[1..].iter().fold(regions[0], |a, b| a.union(b))
}

/// Refuses regions outside the part of the picture that the film holds.
pub fn check_bounds(path: &Path, film: &Film, bounds: Rect) -> Result<(), Failure> {
    if film.bounds.union(&bounds) == film.bounds {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: this film holds the region {} of the picture, but the command line selects {}; render the rest into \
         another film and merge the two",
        path.display(),
        film.bounds,
        bounds
    )))
}

/// Refuses to resume an adaptive film without `--adaptive` or with other regions, and any other film with `--adaptive`.
pub fn check_adaptive(
    args: &RenderArgs,
    path: &Path,
    film: &Film,
    regions: &[Rect],
) -> Result<(), Failure> {
    let problem = match &film.pilot {
        Some(_) if !args.adaptive => "this film is adaptive: resume it with --adaptive",
        None if args.adaptive => "this film is not adaptive: resume it without --adaptive",
        Some(pilot) if !pilot.is_for(regions) => {
            "this adaptive film has other regions: resume it with the same --region flags"
        }
        _ => return Ok(()),
    };
    Err(FileError::content(path, problem).into())
}

/// The sample numbers that every pixel of `regions` shall have at the end.
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

/// Total samples per pixel, including those in the film. [`MAX_SAMPLES`] if only time or error end the run.
fn wanted(args: &RenderArgs, settings: &Settings) -> Result<u64, Failure> {
    let by_rays = match args.rays {
        None => None,
        Some(rays) => Some(
            rays.checked_mul(settings.round())
                .filter(|&n| n <= MAX_SAMPLES)
                .ok_or_else(|| {
                    let strata = settings.strata;
                    Failure::Input(format!(
                        "--rays {rays}: with {strata} x {strata} strata this is more than {MAX_SAMPLES} samples per pixel"
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

/// The end of the range from 0 that gives every pixel `wanted` samples, counting those that it already has.
fn end_for(wanted: u64, regions: &[Rect], held: &Coverage) -> u64 {
    let regions = Rect::disjoint(regions);
    let mut end = 0;
    let mut bare: u64 = regions.iter().map(Rect::area).sum();
    for (rect, ranges) in held.cells() {
        let inside = regions.iter().filter_map(|r| r.intersection(&rect));
        let pixels: u64 = inside.map(|r| r.area()).sum();
        if pixels > 0 {
            bare -= pixels;
            end = end.max(end_for_pixel(wanted, ranges));
        }
    }
    if bare > 0 { wanted } else { end }
}

/// [`end_for`] for a pixel that holds `ranges` (sorted, disjoint).
fn end_for_pixel(wanted: u64, ranges: &[Range<u64>]) -> u64 {
    let held: u64 = ranges.iter().map(|r| r.end - r.start).sum();
    let mut lacking = wanted.saturating_sub(held);
    if lacking == 0 {
        return 0;
    }
    let mut at = 0;
    for r in ranges {
        let gap = r.start - at;
        if lacking <= gap {
            break;
        }
        lacking -= gap;
        at = r.end;
    }
    at + lacking
}

/// The number of primitives and lights, such as `4 surfaces`.
pub fn things(scene: &Scene) -> String {
    let n = scene.primitives.len() + scene.lights.len();
    let s = if n == 1 { "" } else { "s" };
    format!("{n} surface{s}")
}

/// `1 sample per pixel`, `2 samples per pixel`.
pub fn count(samples: u64) -> String {
    let s = if samples == 1 { "" } else { "s" };
    format!("{samples} sample{s} per pixel")
}

/// `120 samples per pixel`, or `119 to 120 samples per pixel`.
pub fn samples_text(film: &Film) -> String {
    match film.coverage.samples() {
        (a, b) if a == b => count(a),
        (a, b) if film.pilot.is_some() => format!(
            "{:.1} samples per pixel on average ({a} to {b})",
            film.coverage.mean()
        ),
        (a, b) => format!("{a} to {}", count(b)),
    }
}

/// The stop conditions, for the start-up line.
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
        conditions.push(format!("{} of rendering time", clock(time.as_secs_f64())));
    }
    Ok(format!("until {}", conditions.join(", or ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x0: u32, y0: u32, x1: u32, y1: u32) -> Rect {
        Rect { x0, y0, x1, y1 }
    }

    #[test]
    fn samples_in_the_film_count() {
        let whole = rect(0, 0, 4, 4);
        let end = |held: &[(u64, u64)], wanted| {
            let mut c = Coverage::default();
            for &(a, b) in held {
                c.add(whole, a..b);
            }
            end_for(wanted, &[whole], &c)
        };
        assert_eq!(end(&[], 100), 100);
        assert_eq!(end(&[(0, 40)], 100), 100);
        assert_eq!(end(&[(512, 1024)], 512), 0);
        assert_eq!(end(&[(512, 1024)], 600), 88);
        assert_eq!(end(&[(10, 20), (30, 40)], 35), 25);
        assert_eq!(end(&[(10, 20)], 10), 0);
        assert_eq!(end(&[(10, 20), (30, 40)], 45), 45);
    }

    #[test]
    fn pixels_without_samples_need_all() {
        let mut c = Coverage::default();
        c.add(rect(0, 0, 2, 4), 0..500);
        assert_eq!(end_for(100, &[rect(0, 0, 4, 4)], &c), 100);
        assert_eq!(end_for(100, &[rect(0, 0, 2, 2), rect(1, 1, 2, 3)], &c), 0);
    }

    #[test]
    fn bounds_hold_all_regions() {
        assert_eq!(
            bounds(&[rect(4, 4, 6, 6), rect(1, 5, 2, 9)]),
            rect(1, 4, 6, 9)
        );
    }
}
