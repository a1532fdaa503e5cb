//! Metadata in picture headers: the same keys in EXR and PNG.

use crate::provenance::{Provenance, integrator_name, light_name};

/// Value of an entry.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// UTF-8.
    Text(String),
    /// Whole numbers too: exact up to 2^53.
    Number(f64),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(x) => x.fmt(f),
        }
    }
}

/// The keys whose values are numbers.
#[cfg(any(feature = "cli", test))]
pub const NUMBERS: [&str; 10] = [
    "samples",
    "replicates",
    "seed",
    "strata",
    "max_depth",
    "shadow_rays",
    "seconds",
    "relative_error",
    "relative_error_uncertainty",
    // Of PNG pictures alone.
    "exposure",
];

/// Keys and values, in a fixed order. Unknown values, such as a missing title or relative error, are left out.
pub fn entries(p: &Provenance) -> Vec<(&'static str, Value)> {
    let text = |s: &str| Some(Value::Text(s.into()));
    let number = |x: f64| Some(Value::Number(x));
    let s = &p.settings;
    let all = [
        ("software", text(&format!("{} {}", p.software, p.version))),
        ("scene", p.scene_title.as_deref().and_then(text)),
        ("scene_hash", text(&p.scene_hash)),
        ("samples", number(p.samples)),
        ("replicates", number(p.replicates.into())),
        ("seed", number(s.seed.into())),
        ("strata", number(s.strata.into())),
        ("max_depth", number(s.max_depth.into())),
        ("shadow_rays", number(s.shadow_rays.into())),
        ("light", text(&light_name(s.light))),
        ("integrator", text(integrator_name(s.integrator))),
        (
            "light_paths",
            text(if s.light_paths { "traced" } else { "off" }),
        ),
        ("adapter", text(&p.adapters())),
        ("driver", text(&p.drivers())),
        // Goldens have none.
        (
            "seconds",
            Some(p.seconds).filter(|s| *s > 0.0).and_then(number),
        ),
        (
            "relative_error",
            p.relative_error.filter(|e| e.is_finite()).and_then(number),
        ),
        (
            "relative_error_uncertainty",
            p.relative_error_uncertainty
                .filter(|e| e.is_finite())
                .and_then(number),
        ),
        (
            "relative_error_doubt",
            p.relative_error_doubt.as_deref().and_then(text),
        ),
    ];
    all.into_iter()
        .filter_map(|(key, value)| Some((key, value?)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::tests::example;

    #[test]
    fn numbers_are_known_by_their_keys() {
        let mut all = example([4, 3]);
        (all.relative_error, all.relative_error_uncertainty) = (Some(0.5), Some(0.25));
        let numbers: Vec<&str> = entries(&all)
            .iter()
            .filter(|(_, value)| matches!(value, Value::Number(_)))
            .map(|(key, _)| *key)
            .chain(["exposure"])
            .collect();
        assert_eq!(numbers, NUMBERS);
    }
}
