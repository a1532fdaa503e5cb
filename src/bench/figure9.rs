//! The report's Figure 9: seconds for 1, 32, 128 and 256 rays per pixel-sample, in four settings.
//!
//! A pixel-sample is a stratum, so N rays are strata² × N samples per pixel. Nothing is extrapolated: cells that were not
//! rendered stay blank.

use super::engines::{Contender, EngineKind};
use crate::engine::EngineError;
use crate::film::Film;
use crate::film::coverage::Rect;
use crate::run::{CALL, Job, Run, StopReason, Tally};
use crate::settings::{LightParts, Overrides, Settings};
use serde::Serialize;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The figure's rays per pixel-sample.
pub const RAYS: [u64; 4] = [1, 32, 128, 256];

/// One of the figure's curves.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// What it is, in the report's words.
    pub name: &'static str,
    /// A name for its scene in messages.
    pub scene: &'static str,
    /// The scene file's text.
    pub text: &'static str,
    light: LightParts,
    shadow_rays: Option<u32>,
}

/// The report's four settings, its Figures 5 to 8. The report's scenes were not published, so we use our own scenes of the
/// same description. As in the report, every picture includes emitted light.
pub const SETTINGS: [Setting; 4] = [
    Setting {
        name: "indirect light only",
        scene: "diffuse.toml",
        text: include_str!("../../scenes/diffuse.toml"),
        light: LightParts {
            direct: false,
            ..LightParts::ALL
        },
        shadow_rays: None,
    },
    Setting {
        name: "direct light only, two shadow rays",
        scene: "diffuse.toml",
        text: include_str!("../../scenes/diffuse.toml"),
        light: LightParts {
            indirect: false,
            ..LightParts::ALL
        },
        shadow_rays: Some(2),
    },
    Setting {
        name: "direct and indirect, several lights",
        scene: "several_lights.toml",
        text: include_str!("../../scenes/several_lights.toml"),
        light: LightParts::ALL,
        shadow_rays: None,
    },
    Setting {
        name: "three materials",
        scene: "three_materials.toml",
        text: include_str!("../../scenes/three_materials.toml"),
        light: LightParts::ALL,
        shadow_rays: None,
    },
];

impl Setting {
    /// The flags that make this picture, on top of `flags`.
    pub fn overrides(&self, flags: &Overrides) -> Overrides {
        Overrides {
            light: Some(self.light),
            shadow_rays: self.shadow_rays.or(flags.shadow_rays),
            ..*flags
        }
    }
}

/// One number of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The setting's name.
    pub setting: &'static str,
    /// Its scene.
    pub scene: &'static str,
    /// Who rendered.
    pub engine: &'static str,
    /// What on.
    pub adapter: String,
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// Rays per pixel-sample.
    pub rays: u64,
    /// Samples per pixel.
    pub samples: u64,
    /// Seconds in the engine from the first sample on, reading back included; `None` when it was not done in time.
    pub seconds: Option<f64>,
    /// The relative error that the picture states then.
    pub relative_error: Option<f64>,
}

/// Renders one picture through all counts of [`RAYS`] and records the time at each. `time` is for all of them; skips a count
/// that would not be reached in time at the speed so far. `cells` holds the results so far, even after an error. Returns
/// false if `stop` was set.
pub fn measure(
    setting: &Setting,
    contender: &mut Contender,
    settings: &Settings,
    time: Duration,
    stop: &AtomicBool,
    cells: &mut Vec<Cell>,
    mut show: impl FnMut(f64),
) -> Result<bool, EngineError> {
    let limit = time.as_secs_f64();
    let mut film = Film::new(settings.size, Rect::whole(settings.size), settings.strata);
    let mut seconds = 0.0;
    let mut done = 0;
    let mut over = false;
    contender.reseed(settings.seed);
    for rays in RAYS {
        let samples = rays * settings.round();
        // The first count is always rendered.
        over |= done > 0 && seconds * samples as f64 / done as f64 > limit;
        if !over {
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
            let mut run = Run::new(&job, contender.engine_mut(), &mut film, stop);
            let ended = run.go(|_, tally: &Tally| {
                show(((seconds + tally.seconds) / limit).min(1.0));
                Ok::<(), EngineError>(())
            })?;
            if ended == StopReason::Interrupted {
                return Ok(false);
            }
            seconds += run.tally.seconds;
            done = samples;
        }
        cells.push(Cell {
            setting: setting.name,
            scene: setting.scene,
            engine: contender.kind.name(),
            adapter: contender.device().name.clone(),
            resolution: settings.size,
            rays,
            samples,
            seconds: (!over).then_some(seconds),
            relative_error: if over {
                None
            } else {
                film.relative_error().value
            },
        });
    }
    Ok(true)
}

/// The engines in `cells` that have blank cells.
pub fn blank(cells: &[Cell]) -> Vec<&'static str> {
    let mut names: Vec<&str> = cells
        .iter()
        .filter(|c| c.seconds.is_none())
        .map(|c| c.engine)
        .collect();
    names.dedup();
    EngineKind::ALL
        .into_iter()
        .map(EngineKind::name)
        .filter(|n| names.contains(n))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;
    use std::path::Path;

    #[test]
    fn the_settings_are_those_of_the_report() {
        for s in &SETTINGS {
            let scene = parse::parse_str(Path::new(s.scene), s.text).unwrap();
            let settings = Settings::resolve(&scene, &s.overrides(&Overrides::default()));
            assert_eq!(settings.size, [512, 384], "{}", s.name);
            assert_eq!(settings.strata, 2, "{}", s.name);
        }
        let lights = |i: usize| (SETTINGS[i].light.direct, SETTINGS[i].light.indirect);
        assert_eq!((lights(0), lights(1)), ((false, true), (true, false)));
    }
}
