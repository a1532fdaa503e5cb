//! Generated WGSL: `choose_light`, where lights are too few for a tree of their own.

use super::Access;
use super::literal::{float, vector};
use crate::world::{World, WorldLight};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// What is chosen; of the light tree too.
pub(super) const CHOSEN: &str = "\
struct Chosen {
    light: DiskLight,
    index: u32,
    cap: Cap,
    // 1 / probability of this light among all, and the sum of all weights.
    inverse_probability: f32,
    weights: f32,
}

";

/// Chooses one light with probability in proportion to its weight.
pub(super) fn generate(world: &World, access: Access, features: &BTreeSet<&str>) -> String {
    let mut s = String::from(CHOSEN);
    let weighs = features.contains("LIGHT_WEIGHTS");
    let receiver = if weighs { "to: Receiver, " } else { "" };
    let _ = writeln!(
        s,
        "fn choose_light(p: vec3f, {receiver}u: f32) -> Chosen {{"
    );
    if let [only] = world.lights.as_slice() {
        let _ = writeln!(s, "    let light = {};", light_literal(only));
        // Images are chosen against the light's own weight.
        let weight = match weighs {
            true => "light_weight(light, p, to)",
            false => "1.0",
        };
        let _ = writeln!(
            s,
            "    return Chosen(light, 0u, cap_of(light, p), 1.0, {weight});\n}}"
        );
        return s;
    }
    // With trees, lights too few for a tree of their own are chosen as in a small scene.
    match access {
        Access::Baked | Access::Tree => {
            // All weights stay in registers; the first partial sum above u times the whole chooses.
            for (i, l) in world.lights.iter().enumerate() {
                let _ = writeln!(s, "    let light_{i} = {};", light_literal(l));
                let _ = writeln!(s, "    let w_{i} = light_weight(light_{i}, p, to);");
                let before = if i == 0 {
                    String::new()
                } else {
                    format!("sum_{} + ", i - 1)
                };
                let _ = writeln!(s, "    let sum_{i} = {before}w_{i};");
            }
            let last = world.lights.len() - 1;
            let _ = writeln!(
                s,
                "    let sum = sum_{last};\n    let at = u * sum;\n    var index = 0u;\n    var chosen = w_0;"
            );
            for i in 1..=last {
                let _ = writeln!(s, "    index = select(index, {i}u, at >= sum_{});", i - 1);
                let _ = writeln!(
                    s,
                    "    chosen = select(chosen, w_{i}, at >= sum_{});",
                    i - 1
                );
            }
        }
        Access::Buffers => {
            // One pass: each light replaces the choice with its share of the sum so far, and the random number is
            // stretched to be used again.
            let _ = write!(
                s,
                "    var index = 0u;
    var chosen = 0.0;
    var sum = 0.0;
    var v = u;
    for (var i = 0u; i < {}u; i++) {{
        let light = lights[i];
        let w = light_weight(light, p, to);
        sum += w;
        let share = w / select(sum, 1.0, sum <= 0.0);
        let take = v < share;
        v = select((v - share) / fmax(1.0 - share, TINY), v / fmax(share, TINY), take);
        index = select(index, i, take);
        chosen = select(chosen, w, take);
    }}
",
                world.lights.len()
            );
        }
    }
    s.push_str("    let light = light_at(index);\n");
    s.push_str("    return Chosen(light, index, cap_of(light, p), select(sum / fmax(chosen, TINY), 0.0, chosen <= 0.0), sum);\n}\n");
    s
}

fn light_literal(l: &WorldLight) -> String {
    format!(
        "DiskLight({}, {}, {}, {}, {}, {}u)",
        vector(l.center),
        float(l.radius),
        vector(l.normal),
        float(l.offset),
        vector(l.radiance),
        l.face
    )
}
