//! A series as text.

use super::{Crossing, Scaling};
use crate::bench::EngineKind;
use crate::bench::table::{Columns, number};

/// Everything about one series.
pub fn text(scaling: &Scaling) -> String {
    let [width, height] = scaling.size;
    let name = scaling.series.name();
    let mut text = format!(
        "{name}: {width}x{height}, {} other surfaces\n",
        scaling.others
    );
    if scaling.timings.is_empty() {
        return text + "nothing measured\n";
    }
    text += &devices(scaling);
    text += &format!("\n{}\n", columns(scaling));
    for end in &scaling.ends {
        let at = scaling.series.of(end.count);
        text += &format!("{} ends at {at}: {}\n", end.engine.name(), end.why);
    }
    for (engine, crossing) in scaling.crossings() {
        text += &even(scaling, engine, crossing);
    }
    text + &rule(scaling)
}

fn devices(scaling: &Scaling) -> String {
    let mut lines: Vec<String> = Vec::new();
    for device in scaling
        .engines
        .iter()
        .filter_map(|(_, device)| device.as_ref())
    {
        let line = format!("on {} ({})\n", device.name, device.driver);
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.concat()
}

fn columns(scaling: &Scaling) -> String {
    let mut columns = Columns::new(&[
        "engine",
        scaling.series.things(),
        "compile, s",
        "warm-up, s",
        "samples",
        "ns per path",
        "million paths/s",
        "rays/path",
    ]);
    for (engine, _) in &scaling.engines {
        for t in scaling.timings.iter().filter(|t| t.engine == *engine) {
            columns.push(vec![
                engine.name().into(),
                t.count.to_string(),
                format!("{:.2}", t.compile_seconds),
                format!("{:.2}", t.warm_up_seconds),
                number(t.samples),
                number(t.seconds_per_path() * 1e9),
                number(1e-6 / t.seconds_per_path()),
                number(t.counters.rays as f64 / t.counters.paths as f64),
            ]);
        }
    }
    columns.text()
}

/// Where an engine and gpu-tree are equally fast.
fn even(scaling: &Scaling, engine: EngineKind, crossing: Crossing) -> String {
    let (first, tree) = (engine.name(), EngineKind::GpuTree.name());
    let things = |n| scaling.series.of(n);
    match crossing {
        Crossing::At(n) => {
            let at = things(n.round() as usize);
            format!("{first} and {tree} are equally fast at {at}\n")
        }
        Crossing::Beyond(n) => format!(
            "{first} is faster than {tree} up to {} or more\n",
            things(n)
        ),
        Crossing::Before(n) => format!("{tree} is faster than {first} from {} on\n", things(n)),
    }
}

/// What the renderer uses by default.
fn rule(scaling: &Scaling) -> String {
    let mut text = String::new();
    if let Some(most) = scaling.baked_up_to() {
        text += &format!(
            "render uses gpu-baked by default up to {}, since compiling takes time too\n",
            scaling.series.of(most)
        );
    }
    if let Some(most) = scaling.looked_at_up_to() {
        text += &format!(
            "gpu-tree weighs every light up to {}, and uses a light tree beyond that\n",
            scaling.series.of(most)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::Series;
    use super::super::tests::{scaling, timing};
    use super::*;

    #[test]
    fn a_series_reports_ends_crossings_and_defaults() {
        let text = text(&scaling());
        for line in [
            "spheres: 512x384, 3 other surfaces",
            "engine     spheres  compile, s  warm-up, s  samples  ns per path  million paths/s  rays/path",
            "gpu-baked      256        0.20        0.10     10.0         2560            0.391       6.00",
            "gpu-baked ends at 256 spheres: compiling took 4.2 s",
            "gpu-baked and gpu-tree are equally fast at 50 spheres",
            "render uses gpu-baked by default up to 53 spheres, since compiling takes time too",
        ] {
            assert!(text.lines().any(|l| l == line), "no {line:?} in {text}");
        }
    }

    #[test]
    fn lights_have_a_tree_of_their_own() {
        let mut s = Scaling::new(Series::Lights, &[EngineKind::GpuTree]);
        s.timings.push(timing(EngineKind::GpuTree, 1, 500));
        let text = text(&s);
        assert!(text.contains("every light up to 48 lights"), "{text}");
        assert!(!text.contains("gpu-baked"), "{text}");
    }
}
