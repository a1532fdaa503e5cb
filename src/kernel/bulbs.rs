//! Lights in glass balls, whose light is sampled from outside: see `crate::world::bulbs` and `shaders/bulb/`.

use super::emit::fetch::{Scalars, chain};
use super::features::{constant, last_depth};
use super::layout::single;
use super::literal::{float, vector};
use crate::settings::{Integrator, Settings};
use crate::stats::luminance;
use crate::world::World;
use crate::world::bulbs::Bulb;
use glam::DVec3;
use std::fmt::Write as _;

/// The probability of a ray that the shells reflect once. Glass reflects about a twentieth of the light at each.
const REFLECTED: f64 = 0.125;

/// The least weight of a bulb in the choice among bulbs, before the distance counts: no weight is rounded to 0.
const LEAST_WEIGHT: f64 = 1e-6;

/// The bulbs that the kernel samples. Their light has been scattered by matt or glossy things, and then crossed one or two shells.
/// [Whitted's integrator](Integrator::Whitted) gathers no such light.
pub(super) fn sampled<'w>(world: &'w World, settings: &Settings) -> &'w [Bulb] {
    let wanted = settings.integrator != Integrator::Whitted
        && settings.light.indirect
        && last_depth(settings) > 2;
    if wanted { &world.bulbs } else { &[] }
}

/// `bulb_of`, `choose_bulb` and `bulb_probability`.
pub(super) fn text(world: &World, bulbs: &[Bulb]) -> String {
    let mut s = String::new();
    constant(
        &mut s,
        "BULBS_ARE_ALL",
        "bool",
        are_all(world, bulbs).to_string(),
    );
    s.push_str("\nstruct ChosenBulb {\n    light: u32,\n    inverse_probability: f32,\n}\n\n");
    let head = "fn bulb_of(light: u32) -> Bulb";
    let fields = with_none(world, bulbs.iter().map(|b| (b.light as u32, scalars(b))));
    s.push_str(&chain(head, "Bulb", "light", &fields));
    s.push_str("// In proportion to its light, over the squared distance from its rim.\n");
    s.push_str("fn choose_bulb(p: vec3f, u: f32) -> ChosenBulb {\n");
    s.push_str(&weights(world, bulbs));
    s.push_str("    let at = u * sum;\n    var chosen = ChosenBulb(");
    let _ = writeln!(s, "{}u, sum / w_0);", bulbs[0].light);
    let mut before = String::from("w_0");
    for (i, b) in bulbs.iter().enumerate().skip(1) {
        let _ = write!(
            s,
            "    chosen.light = select(chosen.light, {}u, at >= {before});
    chosen.inverse_probability = select(chosen.inverse_probability, sum / w_{i}, at >= {before});
",
            b.light
        );
        let _ = write!(before, " + w_{i}");
    }
    s.push_str("    return chosen;\n}\n\nfn bulb_probability(light: u32, p: vec3f) -> f32 {\n");
    s.push_str(&weights(world, bulbs));
    s.push_str("    var own = w_0;\n");
    for (i, b) in bulbs.iter().enumerate().skip(1) {
        let _ = writeln!(s, "    own = select(own, w_{i}, light == {}u);", b.light);
    }
    s + "    return own / sum;\n}\n\n"
}

/// `bulb_shells`: the bulb of a light. Empty if there are no bulbs, for a module of the shaders has it then.
pub(super) fn shells(world: &World, bulbs: &[Bulb]) -> String {
    if bulbs.is_empty() {
        return String::new();
    }
    let fields = |b: &Bulb| -> (u32, Scalars) {
        let [inner, outer] = b.shells.map(|s| format!("{}u", s.number));
        let all = [
            ("count", format!("{}u", b.count)),
            ("inner", inner),
            ("outer", outer),
            ("reflected", b.reflects.to_string()),
        ];
        let named = all.map(|(name, value)| (name.to_owned(), value));
        (b.light as u32, named.into())
    };
    let all = with_none(world, bulbs.iter().map(fields));
    let head = "fn bulb_shells(light: u32) -> BulbShells";
    chain(head, "BulbShells", "light", &all)
}

/// The fields of bulbs by the numbers of their lights, and a struct of zeros if some lights are in none.
fn with_none(world: &World, bulbs: impl Iterator<Item = (u32, Scalars)>) -> Vec<(u32, Scalars)> {
    let mut all: Vec<(u32, Scalars)> = bulbs.collect();
    if all.len() < world.lights.len() {
        all.push((u32::MAX, Scalars::new()));
    }
    all
}

/// Whether bulbs are all lights there are, and their shells all that is specular: then the only other light that
/// comes by way of glass has been reflected twice, and there is hardly any.
fn are_all(world: &World, bulbs: &[Bulb]) -> bool {
    let is_shell = |n: usize| bulbs.iter().flat_map(|b| b.shells).any(|s| s.number == n);
    let mut numbered = (world.lights.len()..).zip(&world.primitives);
    bulbs.len() == world.lights.len()
        && bulbs.iter().all(|b| b.reflects)
        && numbered.all(|(n, p)| !world.materials[p.material].kind().is_specular() || is_shell(n))
}

/// Lines that set the weights `w_0` and so on at `p`, and their `sum`.
fn weights(world: &World, bulbs: &[Bulb]) -> String {
    let mut s = String::new();
    let shines = |b: &Bulb| luminance(world.lights[b.light].radiance.to_array());
    let most = bulbs.iter().map(shines).fold(0.0, f64::max);
    for (i, b) in bulbs.iter().enumerate() {
        // No length has a unit, so that all numbers are within f32 whatever the scene's size.
        let outer = b.shells[1].radius;
        let size = world.lights[b.light].radius / outer;
        let power = float((shines(b) / most * size * size).max(LEAST_WEIGHT));
        let (center, inverse) = (vector(b.center), float(1.0 / outer));
        let _ = write!(
            s,
            "    let v_{i} = (p - {center}) * {inverse};
    let w_{i} = {power} / (1.0 + fmin(dot(v_{i}, v_{i}), 1.0e30));
"
        );
    }
    let all: Vec<String> = (0..bulbs.len()).map(|i| format!("w_{i}")).collect();
    let _ = writeln!(s, "    let sum = {};", all.join(" + "));
    s
}

/// The fields of `Bulb` of bulb/ray.wgsl.
fn scalars(b: &Bulb) -> Scalars {
    let [inner, outer] = b.shells;
    let k = |n: f64, r: f64| float(1.0 / (n * r));
    let single_shell = b.count == 1;
    // The inner shell of one is a sphere within one medium.
    let indices = if single_shell {
        [inner.indices[0]; 2]
    } else {
        inner.indices
    };
    let transmittance = if single_shell {
        outer.transmittance
    } else {
        inner.transmittance * outer.transmittance
    };
    let mut all = Scalars::new();
    let mut add = |field: &str, values: &[String]| {
        for (axis, value) in ["x", "y", "z", "w"].iter().zip(values) {
            all.push((format!("{field}.{axis}"), value.clone()));
        }
    };
    add("center", &single(b.center).map(|v| float(f64::from(v))));
    add(
        "inverse_impacts",
        &[
            k(indices[0], inner.radius),
            k(indices[1], inner.radius),
            k(outer.indices[0], outer.radius),
            k(outer.indices[1], outer.radius),
        ],
    );
    add(
        "etas",
        &[
            float(indices[0] / indices[1]),
            float(outer.indices[0] / outer.indices[1]),
        ],
    );
    add(
        "inner_transmittance",
        &single(if single_shell {
            DVec3::ONE
        } else {
            inner.transmittance
        })
        .map(|v| float(f64::from(v))),
    );
    add("indices", &[float(indices[0]), float(outer.indices[1])]);
    add(
        "transmittance",
        &single(transmittance).map(|v| float(f64::from(v))),
    );
    let numbers = [
        ("shells", format!("{}u", b.count)),
        ("reflected", float(if b.reflects { REFLECTED } else { 0.0 })),
        ("surface", format!("{}u", outer.number)),
        ("inner_surface", format!("{}u", inner.number)),
        ("medium", format!("{}u", b.medium)),
    ];
    all.extend(numbers.map(|(name, value)| (name.to_owned(), value)));
    all
}
