//! Plans a render: which pixels, which samples, and when to stop.

use super::args::{Backend, RenderArgs};
use super::audience::name_of;
use super::failure::Failure;
use super::progress::clock;
use crate::engine::DeviceInfo;
use crate::files::FileError;
use crate::film::Film;
use crate::film::coverage::{Coverage, Rect};
use crate::log::{Held, Start, Target};
use crate::provenance::Provenance;
use crate::render::plan::{end_for, held_regions};
use crate::render::{CPU_TIME, DEFAULT_SPP, MAX_SAMPLES};
use crate::run::Job;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::stats::percent;
use crate::stats::percent_to;
use std::ops::Range;
use std::path::Path;

/// Refuses `--adapter` together with `--backend cpu`.
pub fn check_flags(backend: Backend, adapter: Option<&str>) -> Result<(), Failure> {
    if backend == Backend::Cpu && adapter.is_some() {
        let message = "--adapter can't be used with --backend cpu, which uses no adapter";
        return Err(Failure::Input(message.into()));
    }
    Ok(())
}

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

/// Refuses regions outside the part of the picture that the film holds. `typed` are those of the command line.
pub fn check_bounds(path: &Path, film: &Film, bounds: Rect, typed: &[Rect]) -> Result<(), Failure> {
    if film.bounds.union(&bounds) == film.bounds {
        return Ok(());
    }
    let selected = match typed {
        [] => bounds.to_string(),
        _ => {
            let each = typed.iter().map(Rect::to_string);
            each.collect::<Vec<_>>().join(" and ")
        }
    };
    Err(Failure::Input(format!(
        "{}: this film holds the region {} of the picture, but the command line selects {selected}; render the rest \
         into another film and merge the two",
        path.display(),
        film.bounds
    )))
}

/// The arguments, completed with what a film that is resumed brings along: its regions, its slice of the samples, and whether it is
/// adaptive.
pub fn as_film(args: &RenderArgs, film: &Film, held: &Provenance) -> Result<RenderArgs, Failure> {
    let mut args = args.clone();
    if film.pilot.is_some() && args.samples.is_some() {
        let message = "--samples can't be used with an adaptive film";
        return Err(Failure::Input(message.into()));
    }
    args.adaptive |= film.pilot.is_some();
    if args.samples.is_none() && args.spp.or(args.rays).is_none() {
        args.samples = held.slice.map(|[first, end]| first..end);
    }
    if args.region.is_empty() {
        args.region = held_regions(film);
    }
    Ok(args)
}

/// The arguments, completed with the stop conditions that are the default on this device.
pub fn on_device(args: &RenderArgs, device: &DeviceInfo) -> RenderArgs {
    let mut args = args.clone();
    let given = args.samples.is_some() || args.error.is_some() || args.time.is_some();
    if device.backend == "cpu" && !given && args.spp.or(args.rays).is_none() {
        args.spp = Some(DEFAULT_SPP);
        args.time = Some(CPU_TIME);
    }
    args
}

/// Refuses to resume an adaptive film with other regions, and any other film with `--adaptive`.
pub fn check_adaptive(
    args: &RenderArgs,
    path: &Path,
    film: &Film,
    regions: &[Rect],
) -> Result<(), Failure> {
    let problem = match &film.pilot {
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
///
/// With the share of the pixels of its region that have any, if not all have.
pub fn samples_text(film: &Film) -> String {
    let text = match film.coverage.samples() {
        (a, b) if a == b => count(a),
        (a, b) if film.pilot.is_some() => format!(
            "{:.1} samples per pixel on average ({a} to {b})",
            film.coverage.mean()
        ),
        (a, b) => format!("{a} to {}", count(b)),
    };
    let covered: u64 = film.coverage.cells().map(|(rect, _)| rect.area()).sum();
    if covered == film.bounds.area() {
        text
    } else {
        let share = covered as f64 / film.bounds.area() as f64;
        format!(
            "{text} in {} of the pixels, none in the others",
            percent(share)
        )
    }
}

/// `120 spp`, or `119 to 120 spp`.
pub fn brief_samples(film: &Film) -> String {
    match film.coverage.samples() {
        (a, b) if a == b => format!("{a} spp"),
        (a, b) => format!("{a} to {b} spp"),
    }
}

/// The first event of a run, for logs and those who follow it.
pub fn start(
    args: &RenderArgs,
    provenance: &Provenance,
    job: &Job,
    film: &Film,
    device: &DeviceInfo,
) -> Start {
    let length = job.samples.end - job.samples.start;
    Start {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: name_of(&args.scene),
        title: provenance.scene_title.clone(),
        scene_hash: provenance.scene_hash.clone(),
        resolution: film.size,
        regions: args
            .region
            .iter()
            .map(|r| [r.x0, r.y0, r.x1, r.y1])
            .collect(),
        seed: provenance.settings.seed,
        adapter: device.clone(),
        film: args.film.as_deref().map(name_of),
        target: Target {
            samples: (length < MAX_SAMPLES).then_some(length),
            seconds: args.time.map(|t| t.as_secs_f64()),
            relative_error: args.error,
        },
        held: Held {
            samples: if film.coverage.is_empty() {
                0.0
            } else {
                film.coverage.mean()
            },
            seconds: provenance.seconds,
        },
    }
}

/// The stop conditions in few words: `256 spp`, `until error 2 % or 10 min`.
pub fn ends(args: &RenderArgs, settings: &Settings) -> Result<String, Failure> {
    let wanted = wanted(args, settings)?;
    let samples = match &args.samples {
        Some(range) => Some(format!("samples {}..{}", range.start, range.end)),
        None => (wanted < MAX_SAMPLES).then(|| format!("{wanted} spp")),
    };
    let error = args
        .error
        .map(|e| format!("error {}", percent_without_zeros(e)));
    let time = args
        .time
        .map(|t| clock(t.as_secs_f64()).replace(".0 s", " s"));
    let conditions: Vec<String> = [samples, error, time].into_iter().flatten().collect();
    let text = match conditions.split_last() {
        Some((last, [])) if wanted < MAX_SAMPLES || args.samples.is_some() => last.clone(),
        Some((last, [])) => format!("until {last}"),
        Some((last, others)) => format!("until {} or {last}", others.join(", ")),
        None => String::new(),
    };
    Ok(if args.adaptive {
        text + ", adaptive"
    } else {
        text
    })
}

/// `2 %`, `0.05 %`.
fn percent_without_zeros(share: f64) -> String {
    let text = percent_to(share, 6);
    let number = text.trim_end_matches(" %").trim_end_matches('0');
    format!("{} %", number.trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;
    use clap::Parser;

    #[test]
    fn stop_conditions_in_few_words() {
        let scene = parse_str(
            Path::new("three_materials.toml"),
            include_str!("../../scenes/three_materials.toml"),
        )
        .unwrap();
        for (flags, text) in [
            ("", "256 spp"),
            ("--spp 1", "1 spp"),
            ("--rays 8", "32 spp"),
            ("--samples 0..512", "samples 0..512"),
            ("--error 2% --time 10m", "until error 2 % or 10 min"),
            ("--error 0.0005", "until error 0.05 %"),
            ("--time 90s --adaptive", "until 90 s, adaptive"),
            ("--time 8s", "until 8 s"),
            (
                "--spp 300 --error 7% --time 1h30m",
                "until 300 spp, error 7 % or 90 min",
            ),
        ] {
            let words = format!("etendue render x.toml {flags}");
            let cli = super::super::args::Cli::try_parse_from(words.split_whitespace()).unwrap();
            let super::super::args::Command::Render(args) = cli.command else {
                panic!("{words}");
            };
            let settings = Settings::resolve(&scene, &args.overrides());
            assert_eq!(ends(&args, &settings).unwrap(), text);
        }
    }
}
