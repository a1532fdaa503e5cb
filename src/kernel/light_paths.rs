//! Light paths: whether a scene has any, how many, and where they are aimed. `shaders/light_path/` says what they are.

use super::access::Access;
use super::bulbs;
use super::emit::fetch::{Scalars, chain};
use super::features::{constant, last_depth};
use super::literal::float;
use crate::settings::Settings;
use crate::world::World;
use crate::world::aims::Aims;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Light paths of a pass for each pixel, at least and where mirrors and glass get all of the light. In between it is in proportion to the root
/// of what they get. By squared error and CPU time the best numbers were 1/64 and fewer where they get 0.2 to 2 % of the light (clouds
/// with a sixteenth of glass, torus), 1/16 to 1/8 for 7 to 30 % (caustic, three_materials, cylinders), and 1/4 to 1/2 for all of it (lamps
/// in glass, when their light was not sampled through it); half as many or twice as many had at least 0.8 times the best efficiency.
const PATHS_A_PIXEL: [f64; 2] = [1.0 / 64.0, 1.0 / 4.0];

/// The fewest and the most light paths of a pass. A small region needs all of them, however large the picture is.
const LIMITS: [f64; 2] = [64.0, 262_144.0];

/// The most pairs that stand in a kernel's text. Every turn of the path loop looks a pair up, and a load from a buffer would cost it more
/// than so many selections.
const MOST_IN_TEXT: usize = 24;

/// Light paths of a pass, which goes with one sample of every pixel of a picture of this size.
pub(super) fn photons(aims: &Aims, size: [u32; 2]) -> u32 {
    let pixels = f64::from(size[0]) * f64::from(size[1]);
    let [least, most] = PATHS_A_PIXEL;
    let a_pixel = (most * aims.share.sqrt()).clamp(least, most);
    (pixels * a_pixel).ceil().clamp(LIMITS[0], LIMITS[1]) as u32
}

/// The pairs of lights and specular surfaces, if the picture has light paths. The shortest has two vertices, and the light is a third.
pub(super) fn aims(world: &World, settings: &Settings) -> Option<Aims> {
    let wanted = settings.allows_light_paths();
    let mut used = (world.primitives.iter()).map(|p| world.materials[p.material].kind());
    let scatters = used.any(|kind| !kind.is_specular());
    if wanted && scatters && last_depth(settings) > 2 {
        Aims::new(world, bulbs::sampled(world, settings))
    } else {
        None
    }
}

/// What the kernels must know of the pairs.
#[derive(Debug, Clone)]
pub(super) struct LightPaths {
    photons: u32,
    aims: usize,
    pairs: usize,
    surfaces: usize,
    /// The path kernel has them in its text.
    pub in_text: bool,
}

impl LightPaths {
    pub fn new(world: &World, settings: &Settings, access: Access, aims: &Aims) -> Self {
        let pairs = aims.cumulative.len();
        Self {
            photons: photons(aims, settings.size),
            aims: aims.targets.len(),
            pairs,
            surfaces: world.surface_count(),
            in_text: access == Access::Baked && pairs <= MOST_IN_TEXT,
        }
    }

    /// The constants of `shaders/light_path/`: see [`pack`].
    pub fn constants(&self, s: &mut String) {
        let places = self.pairs;
        let numbers = places + 5 * self.aims;
        let sums = numbers + self.surfaces;
        for (name, value) in [
            ("PHOTONS", self.photons as usize),
            ("AIM_COUNT", self.aims),
            ("AIM_PAIRS", self.pairs),
            ("AIM_PLACES", places),
            ("AIM_NUMBERS", numbers),
            ("AIM_SUMS", sums),
        ] {
            constant(s, name, "u32", format!("{value}u"));
        }
    }
}

/// The density of each pair's light paths: how many go with one sample of every pixel, over the area of the light. Times the square of the
/// index of refraction at the eye over that at the light, for the étendue is n² times what it would be in air.
fn densities(world: &World, aims: &Aims, photons: u32) -> Vec<f32> {
    let index = |medium: u32| world.indices[medium as usize];
    let of_light = |l: usize| {
        let light = &world.lights[l];
        let scale = light
            .medium
            .map_or(0.0, |m| (index(world.camera.medium) / index(m)).powi(2));
        f64::from(photons) * scale / (PI * light.radius * light.radius)
    };
    let targets = aims.targets.len();
    (0..world.lights.len())
        .flat_map(|l| (0..targets).map(move |t| (l, t)))
        .map(|(l, t)| (of_light(l) * aims.probability(l, t)) as f32)
        .collect()
}

/// The aims as the kernels read them from a buffer: see `shaders/light_path/aims_in_buffer.wgsl`.
pub(crate) fn pack(world: &World, aims: &Aims, photons: u32) -> Vec<u32> {
    let mut words: Vec<u32> =
        (densities(world, aims, photons).iter().map(|d| d.to_bits())).collect();
    let mut numbers = vec![aims.targets.len() as u32; world.surface_count()];
    for (t, target) in aims.targets.iter().enumerate() {
        let place = target.center.extend(target.radius).as_vec4().to_array();
        words.extend(place.map(f32::to_bits));
        words.push(target.number as u32);
        numbers[target.number] = t as u32;
    }
    words.extend(numbers);
    words.extend(&aims.cumulative);
    words
}

/// `aim_of` and `aim_density` with the values in the text.
pub(super) fn aims_in_text(world: &World, aims: &Aims, photons: u32) -> String {
    let place = |(t, target): (usize, &crate::world::aims::Target)| -> (u32, Scalars) {
        let [x, y, z] = target.center.to_array().map(float);
        let names = ["center.x", "center.y", "center.z", "radius", "index"];
        let values = [x, y, z, float(target.radius), format!("{t}u")];
        let scalars = names.map(str::to_owned).into_iter().zip(values).collect();
        (target.number as u32, scalars)
    };
    let places: Vec<_> = aims.targets.iter().enumerate().map(place).collect();
    let mut s = String::from("\n");
    s.push_str(&chain(
        "fn aim_of(surface: u32) -> Aim",
        "Aim",
        "surface",
        &places,
    ));
    s.push_str("fn aim_density(light: u32, index: u32) -> f32 {\n    var density = 0.0;\n");
    let targets = aims.targets.len();
    for (pair, density) in densities(world, aims, photons).into_iter().enumerate() {
        let (light, index) = (pair / targets, pair % targets);
        let value = float(f64::from(density));
        let only = aims.cumulative.len() == 1;
        let condition = if only {
            "true".to_owned()
        } else {
            format!("light == {light}u & index == {index}u")
        };
        if density > 0.0 {
            let _ = writeln!(s, "    density = select(density, {value}, {condition});");
        }
    }
    s + "    return density;\n}\n"
}
