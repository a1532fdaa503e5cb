//! A volume: the density of a chain of atoms, and two of its isosurfaces.

use super::{Generated, uniform};
use crate::files::npy;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Atoms of the chain.
const ATOMS: usize = 14;

/// The least points along a side, and the most.
pub const SIDES: [usize; 2] = [8, 1024];

/// The width of an atom: one standard deviation.
const WIDTH: f64 = 0.2;

/// What an atom's middle has.
const HEIGHT: f64 = 20_000.0;

/// Half of the volume's side.
const HALF: f64 = 1.2;

/// The atoms: each near the one before, and apart from all others, within a ball.
fn atoms(seed: u32) -> Vec<DVec3> {
    const BALL: f64 = 0.72;
    const STEP: f64 = 0.36;
    const APART: f64 = 0.3;
    let mut all = vec![DVec3::ZERO];
    let mut tries = 0;
    while all.len() < ATOMS {
        let [u, v] = [0, 1].map(|purpose| uniform(seed, tries, purpose));
        tries += 1;
        let (height, turn) = (2.0 * u - 1.0, TAU * v);
        let out = (1.0 - height * height).sqrt();
        let step = DVec3::new(out * turn.cos(), height, out * turn.sin());
        // After many tries that led nowhere it goes on from an earlier atom.
        let from = all[all.len() - 1 - (tries / 50).min(all.len() - 1)];
        let next = from + STEP * step;
        let free = all.iter().all(|a| a.distance(next) > APART) || tries > 10_000;
        if free && next.length() < BALL {
            all.push(next);
            tries = tries / 50 * 50;
        }
    }
    all
}

/// A scene of a volume with `side` points along each side. `file` names its NumPy file.
pub fn volume(side: usize, seed: u32, file: &str) -> Generated {
    let atoms = atoms(seed);
    let spacing = 2.0 * HALF / (side - 1) as f64;
    let at = |k: usize| k as f64 * spacing - HALF;
    let density = |p: DVec3| -> f64 {
        let one = |a: &DVec3| (-a.distance_squared(p) / (2.0 * WIDTH * WIDTH)).exp();
        atoms.iter().map(one).sum()
    };
    let mut numbers = vec![0u16; side * side * side];
    numbers
        .par_chunks_mut(side * side)
        .enumerate()
        .for_each(|(z, slab)| {
            for (i, number) in slab.iter_mut().enumerate() {
                let p = DVec3::new(at(i % side), at(i / side), at(z));
                *number = (HEIGHT * density(p)).round().min(65_535.0) as u16;
            }
        });
    let shape = [side as u64; 3];
    let mut bytes = npy::header("<u2", &shape);
    bytes.extend_from_slice(bytemuck::cast_slice(&numbers));
    let place = format!(
        "file     = {file:?}\norigin   = [{:.1}, {:.2}, {:.1}]\nspacing  = [{spacing}, {spacing}, {spacing}]",
        -HALF,
        1.05 - HALF,
        -HALF
    );
    let scene = format!(
        "title = \"The density of a chain of atoms, {side} points a side\"

[camera]
eye        = [0.0, 1.9, 4.2]
look_at    = [0.0, 0.95, 0.0]
vfov       = 34.0
resolution = [512, 384]

[material.floor]
type        = \"diffuse\"
reflectance = [0.7, 0.7, 0.7]

[material.core]
type     = \"phong\"
diffuse  = [0.62, 0.2, 0.06]
specular = [0.3, 0.3, 0.3]
exponent = 60.0

[material.shell]
type          = \"dielectric\"
ior           = 1.25
transmittance = [0.93, 0.97, 1.0]

[[plane]]
point    = [0.0, -0.08, 0.0]
normal   = [0.0, 1.0, 0.0]
material = \"floor\"

[[plane]]
point    = [0.0, 0.0, -3.0]
normal   = [0.0, 0.0, 1.0]
material = \"floor\"

# Where the density is high.
[[isosurface]]
{place}
level    = 15000.0
material = \"core\"

# A shell of glass where it is low.
[[isosurface]]
{place}
level    = 5000.0
material = \"shell\"

[[light]]
center   = [2.2, 4.0, 1.6]
normal   = [-2.2, -3.0, -1.6]
radius   = 0.7
radiance = [26.0, 25.0, 23.0]
"
    );
    Generated {
        scene,
        rows: None,
        volume: Some(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::check::lint;
    use crate::scene::parse::parse_str;

    #[test]
    fn volumes_of_each_seed_are_scenes_without_warnings() {
        let folder = tempfile::tempdir().expect("a folder");
        for seed in 0..4 {
            let made = volume(40, seed, "x.npy");
            let bytes = made.volume.expect("a volume");
            std::fs::write(folder.path().join("x.npy"), bytes).expect("written");
            let path = folder.path().join("x.toml");
            let scene = parse_str(&path, &made.scene).expect("a scene");
            let warnings = lint(&scene).into_iter().map(|w| w.to_string());
            let other: Vec<String> = warnings.filter(|w| !w.contains("scene is open")).collect();
            assert_eq!(other, [""; 0], "{seed}");
        }
    }
}
