//! Dispatch over the materials of a scene: `is_NAME`, `sample_bsdf`, `evaluate_bsdf`.

use super::super::access::Access;
use super::super::features::Features;
use crate::scene::MaterialKind;
use std::fmt::Write as _;

/// `sample_bsdf`, and `evaluate_bsdf` if it is called. With smooth normals they are `sample_material` and `evaluate_material`, which
/// `shaders/bsdf/smooth.wgsl` and `smooth_evaluated.wgsl` call.
pub(in crate::kernel) fn dispatch(features: &Features) -> String {
    let mut s = String::new();
    let what = if features.has_smooth_normals {
        "material"
    } else {
        "bsdf"
    };
    let all: Vec<MaterialKind> = features.materials().collect();
    s.push_str(&over(
        features,
        "sample",
        &format!("fn sample_{what}(x: ptr<function, Interaction>, u: Draws) -> Scattered"),
        "(x, u)",
        "Scattered",
        &all,
    ));
    if features.evaluates {
        let scattering: Vec<MaterialKind> = all.into_iter().filter(|m| !m.is_specular()).collect();
        s.push_str(&over(
            features,
            "evaluate",
            &format!("fn evaluate_{what}(x: ptr<function, Interaction>, wi: vec3f) -> BsdfValue"),
            "(x, wi)",
            "BsdfValue",
            &scattering,
        ));
    }
    s
}

/// `is_NAME(material)` of every kind, which is constant if the scene has none of the kind, or no other; and the traits of materials,
/// `is_specular` and `is_glossy`.
pub(in crate::kernel) fn predicates(features: &Features) -> String {
    let mut s = String::new();
    for kind in MaterialKind::ALL {
        let value = match (features.has_material(kind), features.materials().count()) {
            (false, _) => "false".to_owned(),
            (true, 1) => "true".to_owned(),
            (true, _) => format!("material.kind == MATERIAL_{}", kind.name().to_uppercase()),
        };
        let _ = writeln!(
            s,
            "fn is_{}(material: Material) -> bool {{\n    return {value};\n}}\n",
            kind.name()
        );
    }
    for name in ["specular", "glossy"] {
        let kinds = MaterialKind::ALL.into_iter().filter(|kind| match name {
            "specular" => kind.is_specular(),
            _ => kind.is_glossy(),
        });
        let any: Vec<String> = kinds
            .map(|k| format!("is_{}(material)", k.name()))
            .collect();
        let _ = writeln!(
            s,
            "fn is_{name}(material: Material) -> bool {{\n    return {};\n}}\n",
            any.join(" | ")
        );
    }
    s
}

/// A function that returns the result of `VERB_NAME` for the material that was met, one of `kinds`.
fn over(
    features: &Features,
    verb: &str,
    head: &str,
    arguments: &str,
    result: &str,
    kinds: &[MaterialKind],
) -> String {
    let call = |kind: &MaterialKind| format!("{verb}_{}{arguments}", kind.name());
    let mut s = format!("{head} {{\n");
    match (kinds, features.access) {
        ([], _) => {
            let _ = writeln!(s, "    return {result}();");
        }
        ([only], _) => {
            let _ = writeln!(s, "    return {};", call(only));
        }
        // Straight code: calls all of them and selects a result.
        ([first, rest @ ..], Access::Baked) => {
            let _ = writeln!(s, "    var r = {};", call(first));
            for kind in rest {
                let (call, name) = (call(kind), kind.name());
                let _ = writeln!(
                    s,
                    "    r = select_{verb}d(r, {call}, is_{name}(x.material));"
                );
            }
            s.push_str("    return r;\n");
        }
        (kinds, Access::Buffers | Access::Tree) => {
            let _ = writeln!(s, "    var r: {result};");
            for kind in kinds {
                let (call, name) = (call(kind), kind.name());
                let _ = writeln!(
                    s,
                    "    if is_{name}(x.material) {{\n        r = {call};\n    }}"
                );
            }
            s.push_str("    return r;\n");
        }
    }
    s + "}\n\n"
}
