//! Rooms with light that comes by way of mirrors and glass.

use super::common::scene;
use etendue::scene::Scene;

/// A box with the eye in it, and materials.
pub const BOX: &str = "
[camera]
eye = [0, 1.2, 2.6]
look_at = [0, 0.7, 0]
vfov = 55
resolution = [32, 24]
[render]
max_depth = 9
[material.white]
type = 'diffuse'
reflectance = [0.6, 0.5, 0.4]
[material.dark]
type = 'diffuse'
reflectance = [0.1, 0.1, 0.1]
[material.silver]
type = 'mirror'
reflectance = [0.95, 0.95, 0.9]
[material.glass]
type = 'dielectric'
ior = 1.5
[material.tinted]
type = 'dielectric'
ior = 1.4
transmittance = [0.9, 0.7, 0.5]
[material.air]
type = 'dielectric'
ior = 1.0
[material.dense]
type = 'dielectric'
ior = 3
transmittance = [0.9, 0.8, 0.7]
[material.cavity]
type = 'dielectric'
ior = 0.33333334
[material.bubble]
type = 'dielectric'
ior = 0.7142857
[material.gloss]
type = 'phong'
diffuse = [0.2, 0.3, 0.3]
specular = [0.4, 0.3, 0.2]
exponent = 20
[material.sharp]
type = 'phong'
diffuse = [0.0, 0.0, 0.0]
specular = [0.8, 0.8, 0.8]
exponent = 200
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = 'white'
[[plane]]
point = [0, 0, -1.5]
normal = [0, 0, 1]
material = 'dark'
";

pub const LAMP: &str = "
[[light]]
center = [0.3, 2.3, 0.2]
normal = [0.1, -1, 0]
radius = 0.5
radiance = [9, 8, 6]
";

/// A case: its name, what is in the box, and what is replaced in the text of the box.
pub type Case = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

pub const CASES: [Case; 24] = [
    (
        "glass and mirror balls",
        "[[sphere]]\ncenter = [-0.6, 0.5, 0]\nradius = 0.5\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.7, 0.45, -0.3]\nradius = 0.45\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a glass cylinder and a mirror disk",
        "[[cylinder]]\nbase = [-0.7, 0.3, 0.2]\ntop = [0.1, 0.4, 0.4]\nradius = 0.25\nmaterial = 'glass'\n\
         [[disk]]\ncenter = [0.8, 0.8, 0]\nnormal = [-1, 0.2, 0.3]\nradius = 0.5\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a mirror wall",
        "[[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.4\nmaterial = 'white'\n",
        &[],
    ),
    (
        "facing mirror walls",
        "[[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n\
         [[plane]]\npoint = [1.2, 0, 0]\nnormal = [-1, 0.1, 0]\nmaterial = 'silver'\n",
        &[],
    ),
    (
        "a floor of water",
        "[[plane]]\npoint = [0, 0.3, 0]\nnormal = [0, 1, 0]\nmaterial = 'glass'\n",
        &[],
    ),
    (
        "the eye in glass",
        "[[sphere]]\ncenter = [0, 1.2, 2.5]\nradius = 0.3\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [-0.4, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[],
    ),
    (
        "the eye in a glass room with things in it",
        "[[sphere]]\ncenter = [0, 1.2, 1.2]\nradius = 2.2\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.2, 0.8, 0.4]\nradius = 0.4\nmaterial = 'white'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 4.5, 0.2]")],
    ),
    (
        "a light in a glass ball",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'glass'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.6, 0.2]")],
    ),
    (
        "a light in a hollow bulb",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.62\nmaterial = 'air'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.6, 0.2]")],
    ),
    (
        "a light that cuts a glass ball, beside another",
        "[[sphere]]\ncenter = [0.3, 1.8, 0.2]\nradius = 0.6\nmaterial = 'glass'\n\
         [[light]]\ncenter = [-1, 1.6, 0.5]\nnormal = [1, -0.4, 0]\nradius = 0.4\nradiance = [3, 4, 6]\n",
        &[],
    ),
    (
        "nested and touching glass",
        "[[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.25\nmaterial = 'white'\n\
         [[sphere]]\ncenter = [0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.3\nmaterial = 'air'\n",
        &[],
    ),
    (
        "gloss under glass",
        "[[sphere]]\ncenter = [-0.5, 0.6, 0.2]\nradius = 0.4\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.7, 0.45, -0.3]\nradius = 0.45\nmaterial = 'silver'\n",
        &[("material = 'white'", "material = 'gloss'")],
    ),
    (
        "a sharp lobe under glass",
        "[[sphere]]\ncenter = [-0.5, 0.6, 0.2]\nradius = 0.4\nmaterial = 'glass'\n\
         [[disk]]\ncenter = [0.6, 0.3, 0]\nnormal = [-0.4, 1, 0]\nradius = 0.5\nmaterial = 'sharp'\n",
        &[],
    ),
    (
        "the eye just above the floor",
        "[[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[
            ("eye = [0, 1.2, 2.6]", "eye = [0, 0.03, 1.6]"),
            ("look_at = [0, 0.7, 0]", "look_at = [0, 0.0, 0.3]"),
        ],
    ),
    (
        "lights that overlap, and one that pokes through the floor",
        "[[sphere]]\ncenter = [-0.5, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n\
         [[light]]\ncenter = [0.3, 2.3, 0.2]\nnormal = [0.1, -1, 0]\nradius = 0.3\nradiance = [2, 8, 2]\n\
         [[light]]\ncenter = [0.9, 0.1, 0.2]\nnormal = [-1, 0, 0.1]\nradius = 0.4\nradiance = [2, 3, 5]\n",
        &[],
    ),
    (
        "a huge mirror ball",
        "[[sphere]]\ncenter = [-10000001.2, 0, 0]\nradius = 10000000\nmaterial = 'silver'\n\
         [[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 0.4\nmaterial = 'white'\n",
        &[],
    ),
    ("sixty glass balls", "@crowd", &[]),
    (
        "the eye just above a glossy floor",
        "[[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\nmaterial = 'glass'\n",
        &[
            ("eye = [0, 1.2, 2.6]", "eye = [0, 0.03, 1.6]"),
            ("look_at = [0, 0.7, 0]", "look_at = [0, 0.0, 0.3]"),
            ("material = 'white'", "material = 'gloss'"),
            ("material = 'dark'", "material = 'gloss'"),
        ],
    ),
    // Lights whose light is sampled through glass, straight alone or reflected once as well.
    (
        "a light that fills much of a glass ball",
        "[[sphere]]\ncenter = [0.3, 1.6, 0.2]\nradius = 0.9\nmaterial = 'glass'\n",
        &[("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.62, 0.2]")],
    ),
    (
        "a small light in a dense ball beside a mirror",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 1.2\nmaterial = 'dense'\n\
         [[plane]]\npoint = [-1.2, 0, 0]\nnormal = [1, 0, 0]\nmaterial = 'silver'\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 1, -0.3]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.44, 1.5, 0.2]"),
            ("radius = 0.5", "radius = 0.13"),
        ],
    ),
    (
        "a light in a hollow tinted ball over a glossy floor",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.7\nmaterial = 'tinted'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.6\nmaterial = 'bubble'\n",
        &[
            ("center = [0.3, 2.3, 0.2]", "center = [0.32, 1.6, 0.2]"),
            ("radius = 0.5", "radius = 0.3"),
            ("material = 'white'", "material = 'gloss'"),
        ],
    ),
    (
        "a small light in a hollow ball, seen in another ball",
        "[[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 1.1\nmaterial = 'dense'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.9\nmaterial = 'cavity'\n\
         [[sphere]]\ncenter = [-0.9, 0.4, 0.6]\nradius = 0.3\nmaterial = 'glass'\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 0.3, -1]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.34, 1.5, 0.2]"),
            ("radius = 0.5", "radius = 0.14"),
        ],
    ),
    (
        "the eye in a glass room with a lamp in a bubble, and two more lamps",
        "[[sphere]]\ncenter = [0, 1.2, 1.2]\nradius = 2.6\nmaterial = 'glass'\n\
         [[sphere]]\ncenter = [0.3, 1.5, 0.2]\nradius = 0.5\nmaterial = 'bubble'\n\
         [[sphere]]\ncenter = [-0.7, 0.9, 0.2]\nradius = 0.4\nmaterial = 'tinted'\n\
         [[light]]\ncenter = [-0.7, 0.9, 0.2]\nnormal = [1, -1, 0]\nradius = 0.12\nradiance = [9, 20, 30]\n\
         [[light]]\ncenter = [-0.7, 0.91, 0.21]\nnormal = [-1, 1, 0]\nradius = 0.1\nradiance = [30, 20, 9]\n",
        &[
            ("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.5, 0.21]"),
            ("radius = 0.5", "radius = 0.2"),
        ],
    ),
    (
        "a bulb that touches the floor, and another lamp",
        "[[sphere]]\ncenter = [0.3, 1.0, 0.2]\nradius = 1.0\nmaterial = 'dense'\n\
         [[light]]\ncenter = [-1, 1.6, 0.5]\nnormal = [1, -0.4, 0]\nradius = 0.4\nradiance = [0.3, 0.4, 0.6]\n",
        &[
            ("normal = [0.1, -1, 0]", "normal = [0.1, 1, -0.3]"),
            ("center = [0.3, 2.3, 0.2]", "center = [0.3, 1.01, 0.2]"),
            ("radius = 0.5", "radius = 0.2"),
        ],
    ),
];

/// The first of the cases whose lights are sampled through glass, with light paths or without: the reference alone is their judge.
pub const FIRST_BULB: usize = 18;

/// Scene number `case`.
pub fn case(case: usize) -> (&'static str, Scene) {
    let (name, things, changes) = CASES[case];
    let crowd: String = (0..60)
        .map(|k| {
            let (x, z) = (
                f64::from(k % 10) * 0.3 - 1.35,
                f64::from(k / 10) * 0.3 - 1.0,
            );
            format!(
                "[[sphere]]\ncenter = [{x:.2}, 0.2, {z:.2}]\nradius = 0.13\nmaterial = 'glass'\n"
            )
        })
        .collect();
    let mut text = format!("{BOX}{LAMP}{}", things.replace("@crowd", &crowd));
    for (old, new) in changes {
        assert!(text.contains(old), "{name}: {old}");
        text = text.replacen(old, new, 1);
    }
    (name, scene(&text))
}
