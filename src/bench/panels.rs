//! What is drawn of results.

use super::scaling::Scaling;
use super::summary::Point;
use super::{EngineKind, Results};
use crate::plot::{Curve, ErrorPanel, Level, ScalingPanel};
use std::path::Path;

/// True errors against seconds, a curve for each engine.
pub fn errors(results: &Results) -> ErrorPanel {
    let points = results.points();
    let curve = |engine: EngineKind| {
        let drawn = |p: &Point| {
            let error = p.true_relative_error?;
            Some([p.seconds.mean, error.mean, error.sd.unwrap_or(0.0)])
        };
        Curve {
            name: engine.name().into(),
            points: points
                .iter()
                .filter(|p| p.engine == engine)
                .filter_map(drawn)
                .filter(|p| p[0] > 0.0 && p[1] > 0.0)
                .collect(),
        }
    };
    let name = Path::new(&results.scene).file_stem();
    let floor = results.reference.truth.noise_floor();
    ErrorPanel {
        title: name.map_or(results.scene.clone(), |n| n.to_string_lossy().into()),
        curves: results.engines().into_iter().map(curve).collect(),
        level: floor.filter(|&f| f > 0.0).map(|error| Level {
            name: "noise of the reference".into(),
            error,
        }),
    }
}

/// Seconds per path of a series.
pub fn scaling(scaling: &Scaling) -> ScalingPanel {
    let [width, height] = scaling.size;
    let device = scaling
        .engines
        .iter()
        .find_map(|(_, device)| device.as_ref());
    let on = device.map_or(String::new(), |d| format!(", {}", d.name));
    let curve = |&(engine, _): &(_, _)| {
        let costs = scaling.costs(engine).into_iter();
        (
            engine.name(),
            costs.map(|(n, s)| (n as f64, s * 1e9)).collect(),
        )
    };
    let baked = scaling
        .baked_up_to()
        .map(|n| (n as f64, format!("gpu-baked by default up to {n}")));
    let looked_at = scaling
        .looked_at_up_to()
        .map(|n| (n as f64, format!("no light tree up to {n}")));
    ScalingPanel {
        title: format!("{}, {width}x{height}{on}", scaling.series.name()),
        things: scaling.series.name(),
        curves: scaling.engines.iter().map(curve).collect(),
        marks: baked.into_iter().chain(looked_at).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Format, Panel, write};

    /// With `ETENDUE_KEEP_PLOTS` a folder, the pictures stay there to be looked at.
    #[test]
    fn a_series_is_drawn_with_the_limit_of_the_rule() {
        let temporary = tempfile::tempdir().unwrap();
        let kept = std::env::var_os("ETENDUE_KEEP_PLOTS");
        let dir = kept.map_or(temporary.path().to_owned(), Into::into);
        let panels = [scaling(&crate::bench::scaling::tests::scaling())].map(Panel::Scaling);
        let svg = dir.join("scaling.svg");
        write(&svg, Format::Svg, &panels).unwrap();
        let text = std::fs::read_to_string(&svg).unwrap();
        for word in [
            "gpu-baked",
            "gpu-tree",
            "nanoseconds per path",
            "gpu-baked by default up to 53",
            "spheres, 512x384",
        ] {
            assert!(text.contains(word), "no {word}");
        }
        assert!(!text.contains("light tree"));
        write(&dir.join("scaling.png"), Format::Png, &panels).unwrap();
    }
}
