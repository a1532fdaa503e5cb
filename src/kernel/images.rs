//! Which lights are sought in which mirror balls, and generated WGSL that chooses among them: see `shaders/image/mirror_ball.wgsl`.

use super::access::Access;
use super::emit::fetch::{Scalars, chain};
use super::features::last_depth;
use super::layout::DiskLight;
use super::literal::{float, vector};
use crate::scene::Bsdf;
use crate::settings::{Integrator, Settings};
use crate::world::light_tree::LIGHT_COLORS;
use crate::world::{Geometry, Side, World, WorldLight, WorldPrimitive};
use glam::DVec3;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// The most images among which a path chooses: every diffuse vertex computes the weight of each. Other images are left to chance.
const MOST: usize = 8;

/// Bits in which a path remembers the number of a mirror. As many hold the number of a light.
pub(super) const MIRROR_BITS: u32 = 15;

/// Ratios of lengths whose fourth powers stay within the range of f32.
const LIKE_LENGTHS: RangeInclusive<f64> = 1e-4..=1e4;

/// Images weaker than this are left to chance: products with their weights might leave the range of f32.
const LEAST_STRENGTH: f64 = 1e-20;

/// No images are sought unless some ball has at least this many times the radius of a light that it shows. With a ratio of 1.1 a room
/// lost a fifth of its speed for 6 % less variance; with 1.5, a sixth for 22 % less.
const WORTH: f64 = 1.5;

/// The weight of not being sent to an image. At a place where the images weigh w and the lights themselves v, a path is sent with
/// probability w / (w + `BESIDE` (v + e)); e is the weight of the images right next to a ball. With 1, 2, 4 and 8 the efficiency was
/// the same up to the noise of its measurement.
const BESIDE: f64 = 4.0;

/// 1 / the greatest probability with which a path is sent.
const LEAST_ALL: f64 = 2.0;

/// A light seen in a mirror ball.
pub(super) struct Image {
    /// Index into [`World::primitives`].
    mirror: usize,
    center: DVec3,
    radius: f64,
    /// Index into [`World::lights`].
    light: usize,
    /// An estimate of the light that it gives to a receiver right next to the ball.
    strength: f64,
}

/// The images that the kernel of a scene seeks.
///
/// Only lights that are farther from a ball than their own radius are sought in it. Then a direction drawn to the image brings no more
/// light than a direction that leads there by chance. Light by way of a flat mirror could be sought in the same way. In a scene with
/// three flat mirrors that lowered the variance by 8 %, and the speed by a quarter.
pub(super) fn of(world: &World, settings: &Settings, access: Access) -> Vec<Image> {
    let uses = |wanted: fn(&Bsdf) -> bool| {
        let mut used = world
            .primitives
            .iter()
            .map(|p| &world.materials[p.material]);
        used.any(wanted)
    };
    let sought = settings.integrator == Integrator::Path
        && settings.light.indirect
        && last_depth(settings) >= 3
        && access != Access::Tree
        && world.lights.len() + world.primitives.len() < 1 << MIRROR_BITS
        && uses(|b| matches!(b, Bsdf::Diffuse { .. }))
        && uses(|b| matches!(b, Bsdf::Mirror { .. }));
    if !sought {
        return Vec::new();
    }
    let mut images = Vec::new();
    for (mirror, p) in world.primitives.iter().enumerate() {
        let lights = world.lights.iter().enumerate();
        images.extend(lights.filter_map(|(i, l)| image(world, (mirror, p), (i, l))));
    }
    let worth = |i: &Image| i.radius >= WORTH * world.lights[i.light].radius;
    if !images.iter().any(worth) {
        return Vec::new();
    }
    images.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    images.truncate(MOST);
    images
}

fn image(
    world: &World,
    (mirror, p): (usize, &WorldPrimitive),
    (light, l): (usize, &WorldLight),
) -> Option<Image> {
    let Bsdf::Mirror { reflectance } = world.materials[p.material] else {
        return None;
    };
    let Geometry::Sphere { center, radius } = p.geometry else {
        return None;
    };
    let distance = center.distance(l.center) - radius;
    // How far the ball extends in front of the light's plane.
    let before = l.normal.dot(center) - l.offset + radius;
    let like = |a: f64, b: f64| LIKE_LENGTHS.contains(&(a / b));
    let worth = p.side == Side::Outside
        && radius >= 0.5 * l.radius
        && distance >= 2.0 * l.radius
        && before > 0.0
        && like(radius, l.radius)
        && like(radius, distance);
    let cos = (before / (distance + radius)).min(1.0);
    let brightness = (l.radiance * reflectance).dot(LIGHT_COLORS);
    let strength = 0.25 * brightness * cos * (l.radius / distance).powi(2);
    (worth && strength >= LEAST_STRENGTH).then_some(Image {
        mirror,
        center,
        radius,
        light,
        strength,
    })
}

/// The kernel with a second loop inside the path loop, around the vertex. After some turns of it, all paths that wait to be sent to an
/// image are sent at once.
///
/// # Panics
/// If `wgsl` has no path loop.
pub(super) fn in_turns(wgsl: &str) -> String {
    const HEAD: &str = "    while film.s < film.end && trips_remain() {\n";
    const FOOT: &str = "\n    }\n    store_pixel(";
    let (before, rest) = wgsl.split_once(HEAD).expect("the path loop");
    let (vertex, after) = rest.split_once(FOOT).expect("its end");
    format!(
        "{before}{HEAD}    for (var turn = 0u; turn < TURNS && film.s < film.end && !path.trail.sends; turn++) {{
{vertex}
    }}
    if path.trail.sends {{
        send(&path);
    }}{FOOT}{after}"
    )
}

/// `counts_light`, `choose_image`, and the functions that fetch what belongs to an image.
pub(super) fn generate(world: &World, images: &[Image]) -> String {
    let number = |i: &Image| world.lights.len() + i.mirror;
    let pairs: Vec<String> = images
        .iter()
        .map(|i| format!("(by == {}u && light == {}u)", number(i), i.light))
        .collect();
    let mut s = format!(
        "
// Whether a path that remembers this counts the light with this number when it meets it.
fn counts_light(trail: ImageTrail, light: u32) -> bool {{
    let memory = trail.memory;
    let by = memory & MIRROR_MASK;
    let image = {};
    let right = memory >= SENT_AND_MET && ((memory >> MIRROR_BITS) & MIRROR_MASK) == light;
    return select(memory < BY_MIRROR || !image, right, memory >= SENT);
}}

",
        pairs.join(" || ")
    );
    s.push_str(&choice(images));

    let each = |fields: &dyn Fn(&Image) -> Scalars| -> Vec<(u32, Scalars)> {
        (0..).zip(images.iter().map(fields)).collect()
    };
    let balls = each(&|i| {
        let [x, y, z] = i.center.to_array().map(float);
        let names = ["center.x", "center.y", "center.z", "radius"];
        let names = names.map(str::to_owned).into_iter();
        names.zip([x, y, z, float(i.radius)]).collect()
    });
    let lights = each(&|i| DiskLight::of(&world.lights[i.light]).scalars());
    for (name, kind, elements) in [
        ("fn image_ball(index: u32) -> Sphere", "Sphere", balls),
        (
            "fn image_light(index: u32) -> DiskLight",
            "DiskLight",
            lights,
        ),
    ] {
        s.push_str(&chain(name, kind, "index", &elements));
        s.push('\n');
    }
    s.push_str("fn image_memory(index: u32) -> u32 {\n    var numbers = 0u;\n");
    for (k, i) in images.iter().enumerate() {
        let numbers = format!("{}u << MIRROR_BITS | {}u", i.light, number(i));
        let _ = writeln!(
            s,
            "    numbers = select(numbers, ({numbers}), index == {k}u);"
        );
    }
    s.push_str("    return SENT | numbers;\n}\n");
    s
}

/// `choose_image`, which works like an unrolled `choose_light`: all weights stay in registers, and the first image whose partial sum is
/// above u times the whole is chosen. The whole is more than the sum of all weights. The rest of it stands for the choice of none.
fn choice(images: &[Image]) -> String {
    let mut s = String::from(
        "fn choose_image(p: vec3f, n: vec3f, straight: f32, u: f32) -> ChosenImage {\n",
    );
    for (k, i) in images.iter().enumerate() {
        let ball = format!("Sphere({}, {})", vector(i.center), float(i.radius));
        let strength = float(i.strength);
        let _ = writeln!(s, "    let w_{k} = image_weight(p, n, {ball}, {strength});");
        let before = match k {
            0 => String::new(),
            _ => format!("sum_{} + ", k - 1),
        };
        let _ = writeln!(s, "    let sum_{k} = {before}w_{k};");
    }
    let balls: BTreeSet<usize> = images.iter().map(|i| i.mirror).collect();
    let near = images.iter().map(|i| i.strength).sum::<f64>() / balls.len() as f64;
    let _ = write!(
        s,
        "    let sum = sum_{};
    let all = fmax(sum + {} * (straight + {}), {} * sum);
    let at = u * all;
    let taken = at < sum;
    var chosen = w_0;
    var index = 0u;
",
        images.len() - 1,
        float(BESIDE),
        float(near),
        float(LEAST_ALL)
    );
    for k in 1..images.len() {
        let before = k - 1;
        let _ = write!(
            s,
            "    chosen = select(chosen, w_{k}, at >= sum_{before});
    index = select(index, {k}u, at >= sum_{before});
"
        );
    }
    s.push_str(
        "    return ChosenImage(index, taken, all / select(all - sum, chosen, taken));\n}\n\n",
    );
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Overrides;

    /// How many images are sought in a room with a mirror ball of this radius, 2 below a light of radius 0.2 and this radiance.
    fn sought(radius: f64, radiance: f64, overrides: &Overrides) -> usize {
        let text = format!(
            "[camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
             [material.silver]\ntype = 'mirror'\nreflectance = [0.9, 0.9, 0.9]\n\
             [[plane]]\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = {radius}\nmaterial = 'silver'\n\
             [[light]]\ncenter = [0, 2, 0]\nnormal = [0, -1, 0]\nradius = 0.2\n\
             radiance = [{radiance:e}, {radiance:e}, {radiance:e}]\n"
        );
        let scene = crate::scene::parse::parse_str("room.toml".as_ref(), &text).expect("a scene");
        let settings = Settings::resolve(&scene, overrides);
        of(&World::new(&scene, settings.size), &settings, Access::Baked).len()
    }

    #[test]
    fn images_are_sought_where_they_are_worth_it() {
        let all = Overrides::default();
        assert_eq!(sought(0.5, 10.0, &all), 1);
        assert_eq!(sought(0.29, 10.0, &all), 0, "a small ball");
        assert_eq!(sought(1.7, 10.0, &all), 0, "a light near the ball");
        assert_eq!(sought(0.5, 1e-30, &all), 0, "weights beyond f32");
        let flat = Overrides {
            max_depth: Some(2),
            ..Overrides::default()
        };
        assert_eq!(sought(0.5, 10.0, &flat), 0, "paths too short");
    }
}
