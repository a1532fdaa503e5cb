//! `choose_light` with a line of code for each light, `keeps`, and `light_scale`.

use super::super::features::{Features, LightChoice};
use super::super::layout::DiskLight;
use super::super::literal::float;
use crate::settings::LightParts;
use crate::world::{AIR, World};
use std::fmt::Write as _;

/// `choose_light`, which chooses one light with a probability in proportion to its weight. Empty if a module of the shaders has it.
pub(in crate::kernel) fn choose(world: &World, features: &Features) -> String {
    const HEAD: &str = "fn choose_light(p: vec3f, to: Receiver, u: vec2f) -> Chosen {\n";
    match features.choice {
        LightChoice::Loop | LightChoice::Tree => String::new(),
        LightChoice::Only => {
            let light = DiskLight::of(&world.lights[0]).constructor();
            format!(
                "{HEAD}    let light = {light};
    return Chosen(light, 0u, cap_of(light, p), 1.0, 1.0);
}}

"
            )
        }
        LightChoice::Unrolled => {
            // All weights stay in registers. The first light whose partial sum is above u times the whole is chosen.
            let mut s = String::from(HEAD);
            let mut before = String::new();
            for (i, l) in world.lights.iter().enumerate() {
                let weight = if features.bulbs.iter().any(|b| b.light == i) {
                    // No straight shadow ray arrives there.
                    float(0.0)
                } else {
                    format!("light_weight({}, p, to)", DiskLight::of(l).constructor())
                };
                let _ = write!(
                    s,
                    "    let w_{i} = {weight};
    let sum_{i} = {before}w_{i};
"
                );
                before = format!("sum_{i} + ");
            }
            let last = world.lights.len() - 1;
            let _ = write!(
                s,
                "    let sum = sum_{last};
    let at = u.x * sum;
    var index = 0u;
    var chosen = w_0;
"
            );
            for i in 1..=last {
                let before = i - 1;
                let _ = write!(
                    s,
                    "    index = select(index, {i}u, at >= sum_{before});
    chosen = select(chosen, w_{i}, at >= sum_{before});
"
                );
            }
            s + "    let light = light_at(index);
    return Chosen(light, index, cap_of(light, p), select(sum / fmax(chosen, TINY), 0.0, chosen <= 0.0), sum);
}

"
        }
    }
}

/// `keeps`: whether the picture keeps light that was scattered this many times on its way to the eye.
pub(in crate::kernel) fn keeps(parts: LightParts) -> String {
    let kept = [
        (parts.emitted, "scatterings == 0u"),
        (parts.direct, "scatterings == 1u"),
        (parts.indirect, "scatterings >= 2u"),
    ];
    let kept: Vec<&str> = kept.iter().filter(|k| k.0).map(|k| k.1).collect();
    let condition = match kept.len() {
        0 => "false".to_owned(),
        3 => "true".to_owned(),
        _ => kept.join(" || "),
    };
    format!("fn keeps(scatterings: u32) -> bool {{\n    return {condition};\n}}\n\n")
}

/// `light_scale`: see [`World::light_scales`]. Consecutive media with the same scale share a line.
pub(in crate::kernel) fn scale(world: &World) -> String {
    let Some(scales) = &world.light_scales else {
        return "fn light_scale(medium: u32) -> f32 {\n    return 1.0;\n}\n\n".to_owned();
    };
    let mut s = format!(
        "fn light_scale(medium: u32) -> f32 {{\n    var scale = {};\n",
        float(scales[0])
    );
    let mut first = 1;
    for run in scales[1..].chunk_by(|a, b| a == b) {
        let (x, last) = (float(run[0]), first + run.len() - 1);
        let _ = writeln!(
            s,
            "    scale = select(scale, {x}, medium >= {first}u && medium <= {last}u);"
        );
        first = last + 1;
    }
    s + "    return scale;\n}\n\n"
}

/// `light_medium`: the solid that a light shines in.
pub(in crate::kernel) fn medium(world: &World) -> String {
    let mut s = "fn light_medium(light: u32) -> u32 {\n    var medium = AIR;\n"
        .replace("AIR", &format!("{AIR}u"));
    for (i, l) in world.lights.iter().enumerate() {
        if let Some(m) = l.medium.filter(|m| *m != AIR) {
            let _ = writeln!(s, "    medium = select(medium, {m}u, light == {i}u);");
        }
    }
    s + "    return medium;\n}\n\n"
}
