//! The last lines of a render: what was made, and what there is to doubt.

use super::args::RenderArgs;
use super::check::{PATHS, idle_lights};
use super::plan;
use super::progress::{clock, describe};
use super::say;
use crate::engine::Counters;
use crate::film::Film;
use crate::film::error::{Doubt, RelativeError};
use crate::run::{StopReason, Tally};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::stats::percent;

/// The last lines: samples, time, speed, error, and the files written.
pub(super) fn say_end(
    args: &RenderArgs,
    film: &Film,
    error: &RelativeError,
    tally: &Tally,
    reason: StopReason,
    written: Option<String>,
) {
    let mut text = String::new();
    if film.coverage.is_empty() {
        say!("interrupted: no samples rendered, no files written");
        return;
    }
    let samples = plan::samples_text(film);
    if tally.counters.paths == 0 {
        text += &format!(
            "the film already holds {samples}; nothing rendered (a larger --spp, or --time, takes more)"
        );
    } else {
        text += &format!("{samples} in {}", clock(tally.seconds));
        if tally.seconds > 0.0 {
            let speed = tally.counters.paths as f64 / tally.seconds / 1e6;
            text += &format!(" ({speed:.3} million paths per second)");
        }
    }
    match describe(error) {
        Some(error) => text += &format!(", {error}"),
        None => text += ", relative error unknown",
    }
    if let Some(wanted) = args.error.filter(|_| reason != StopReason::Error) {
        text += &format!("; not yet {} with certainty", percent(wanted));
    }
    say!("{text}");
    if let Some(list) = written {
        say!("wrote {list}");
    }
}

/// A note if most of a PNG picture is white or black, or nothing in it is bright, with an exposure that shows it.
pub(super) fn say_exposure(film: &Film, stops: f64) {
    let mut light = Vec::new();
    film.for_each(|_, _, e| light.push(e.mean.into_iter().fold(0.0, f64::max)));
    light.retain(|x| *x > 0.0);
    if let Some(note) = exposure_note(&mut light, stops) {
        say!("note: {note}");
    }
}

/// The note about a picture of these values above 0, each the largest of a pixel.
fn exposure_note(light: &mut [f64], stops: f64) -> Option<String> {
    /// Linear values that are pure white and pure black in 8 bits, and that of level 40, which is dark grey.
    const WHITE: f64 = 1.0;
    const BLACK: f64 = 0.5 / 255.0 / 12.92;
    const DARK: f64 = 0.021;
    /// Where the middle of the pixels is to lie, if the brightest must not matter.
    const GREY: f64 = 0.18;
    /// The share of lit pixels that may be white: lamps and highlights.
    const CLIPPED: f64 = 0.05;
    if light.is_empty() {
        return None;
    }
    light.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| light[((share * light.len() as f64) as usize).min(light.len() - 1)];
    let gain = stops.exp2();
    let share = |is: &dyn Fn(f64) -> bool| {
        let count = light.iter().filter(|x| is(**x * gain)).count();
        count as f64 / light.len() as f64
    };
    let (white, black) = (share(&|x| x > WHITE), share(&|x| x < BLACK));
    // The most light, in whole stops, that leaves all but those below white.
    let fits = (WHITE / at(1.0 - CLIPPED)).log2().floor();
    let (what, better) = if white > 0.5 {
        (
            format!("{} of the lit pixels are white in the PNG", percent(white)),
            fits,
        )
    } else if black > 0.5 {
        let middle = (GREY / at(0.5)).log2().round();
        (
            format!("{} of the lit pixels are black in the PNG", percent(black)),
            if fits > stops { fits } else { middle },
        )
    } else if at(1.0) * gain < DARK {
        ("the PNG is dark all over".to_owned(), fits)
    } else {
        return None;
    };
    Some(format!("{what}; try --exposure {better:+}"))
}

/// If fewer paths than this share are truncated, the picture is not visibly darker, so only the report gives their number.
const CUT_SHARE: f64 = 1e-5;

/// Warnings about the picture.
pub(super) fn warn(settings: &Settings, counters: &Counters, error: &RelativeError) {
    let share = counters.truncated as f64 / counters.paths.max(1) as f64;
    if share > CUT_SHARE && settings.max_depth_is_default {
        say!(
            "warning: {} of {} paths ({}) were truncated after {} vertices, which can darken the picture by about that \
             fraction; raise the limit with --max-depth N",
            counters.truncated,
            counters.paths,
            percent(share),
            settings.max_depth
        );
    }
    warn_of_doubt(error);
    if let Some((x, y, sample)) = counters.first_nonfinite {
        say!(
            "warning: {} samples were not finite and were left out, the first at pixel {x}, {y}, sample {sample}; \
             this is a bug, please report the scene",
            counters.nonfinite
        );
    }
}

/// Warns of lights of which a small trial has found no light. If it is there, no error that is stated knows of it.
pub(super) fn warn_of_idle_lights(scene: &Scene) {
    // Without glass and mirrors light samples find all light that there is.
    let specular = scene.materials.iter().any(|m| m.bsdf.kind().is_specular());
    if scene.lights.len() < 2 || !specular {
        return;
    }
    for place in idle_lights(scene) {
        say!(
            "warning: the light at line {} has lit nothing in a trial of {PATHS} paths: if it lights the picture, its light is rare, \
             and the stated error may not know of it",
            place.line
        );
    }
}

/// A warning if the stated error may be far from the true one.
pub(super) fn warn_of_doubt(error: &RelativeError) {
    match error.doubt {
        Some(Doubt::NoLight) => say!(
            "warning: no light found yet: the picture is black, and its error is not known; if the scene can show light at all \
             (see: etendue check), take more samples (--spp, --time)"
        ),
        Some(doubt @ (Doubt::Unlit(_) | Doubt::Hidden(_))) => say!(
            "warning: {doubt}, so the true relative error may be far above the stated one; take more samples (--spp, --time)"
        ),
        Some(doubt @ Doubt::Uncertain) => say!(
            "warning: the stated relative error is uncertain: {doubt}; take more samples (--spp, --time)"
        ),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::exposure_note;

    fn note(light: &[f64], stops: f64) -> String {
        exposure_note(&mut light.to_vec(), stops).unwrap_or_default()
    }

    #[test]
    fn an_exposure_shows_all_but_highlights() {
        // Lamps alone, which are all equal: -4 stops suffice.
        let said = note(&[12.0; 100], 0.0);
        assert_eq!(
            said,
            "100.0 % of the lit pixels are white in the PNG; try --exposure -4"
        );
        assert_eq!(note(&[12.0; 100], -4.0), "");
        assert!(note(&[1.0 / 16.0; 100], 9.0).ends_with("try --exposure +4"));
        // A few highlights do not count.
        let mut room = [3.0; 100];
        room[7] = 900.0;
        assert!(note(&room, 0.0).ends_with("try --exposure -2"));
        assert_eq!(
            note(&[0.02; 100], 0.0),
            "the PNG is dark all over; try --exposure +5"
        );
        assert_eq!(note(&[0.022; 100], 0.0), "");
        assert!(note(&[1e-5; 100], 0.0).ends_with("are black in the PNG; try --exposure +16"));
        // Nothing fits both: the middle counts.
        let mut both = [1e-5; 100];
        both[..20].fill(1.0);
        assert!(note(&both, 0.0).ends_with("are black in the PNG; try --exposure +14"));
        assert_eq!(note(&[], 0.0), "");
    }
}
