//! Layers of goldens: what the eye meets first in each pixel. They have no noise, so they are held to rounding, and a change of them
//! is told apart from one of the light.

use super::text;
use crate::compare::layers::differing_from;
use crate::film::coverage::Rect;
use crate::layers::{Layer, View, beside};
use crate::output::{ExrLayer, Extra, read_exr_header};
use crate::scene::Scene;
use crate::settings::Settings;
use std::path::Path;

/// Those that a golden has; none of one that can't be read.
pub(super) fn held(golden: &Path) -> Vec<Layer> {
    let channels = read_exr_header(golden).map_or_else(|_| Vec::new(), |header| header.channels);
    let has = |layer: &Layer| {
        let start = format!("{}.", layer.name());
        channels.iter().any(|c| c.starts_with(&start))
    };
    Layer::ALL.into_iter().filter(has).collect()
}

/// The layers of a scene as these settings render it.
pub(super) fn made(scene: &Scene, settings: &Settings, layers: &[Layer]) -> Extra {
    let view = View::new(scene, settings);
    beside(&view, layers, Rect::whole(settings.size), |_| ())
}

/// What differs between the layers of a golden and those of the scene, in words.
pub(super) fn differing(
    golden: &Path,
    scene: &Scene,
    settings: &Settings,
    layers: &[Layer],
) -> Result<Vec<String>, String> {
    if layers.is_empty() {
        return Ok(Vec::new());
    }
    let now = made(scene, settings, layers);
    let of = |layer: &Layer| {
        let start = format!("{}.", layer.name());
        let own = now.channels.iter().filter(|c| c.0.starts_with(&start));
        let mut channels: Vec<(String, Vec<f32>)> = own
            .map(|(name, v)| (String::from(*name), v.clone()))
            .collect();
        // As in files.
        channels.sort_by(|a, b| a.0.cmp(&b.0));
        ExrLayer {
            width: settings.size[0] as usize,
            channels,
        }
    };
    let now: Vec<ExrLayer> = layers.iter().map(of).collect();
    let names: Vec<String> = layers.iter().map(|l| l.name().into()).collect();
    let lacking = |e| {
        format!(
            "{}; add it with --bless --layers {}",
            text(e),
            names.join(",")
        )
    };
    differing_from(golden, &now, &names).map_err(lacking)
}
