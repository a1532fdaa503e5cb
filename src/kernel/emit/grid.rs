//! Isosurfaces of volumes as code, and what textures that code reads.

use super::super::literal::{float, vector};
use super::super::modules::{IMPLICIT_GRID, IMPLICIT_SMOOTH};
use super::super::preprocess::fill;
use super::implicit::{Sides, axes, grids, name};
use crate::files::npy::Numbers;
use crate::implicit::hierarchy::BELOW;
use crate::implicit::{Grid, Implicit};
use crate::world::{World, WorldPrimitive, key};
use glam::DVec3;
use std::fmt::Write as _;

/// The binding of the first volume's numbers in group 0. Those below are the scene's in other kernels.
pub(crate) const FIRST_BINDING: u32 = 8;

/// How far a hit is moved at most onto the surface, in cells.
const REACH: f64 = 0.1;

/// Roundings of a place, over the largest coordinate that it is made of.
const ROUNDINGS: f64 = 1.5;

/// The volumes of a world, in the order of their bindings: each takes one for its numbers and one for its cubes.
pub(crate) fn volumes(world: &World) -> Vec<(&Grid, f64)> {
    let all = grids(world);
    all.filter_map(|(.., implicit)| Some((implicit.grid()?, implicit.level)))
        .collect()
}

/// Whether the texture of these numbers holds heights: floats less the level, which differ from it by more in f32 than they do. Others hold
/// the numbers.
pub(crate) fn holds_heights(numbers: &Numbers) -> bool {
    matches!(numbers, Numbers::F32(_) | Numbers::F64(_))
}

/// The textures and functions of surface `number`, which is volume `k`.
pub(super) fn surface(k: usize, number: usize, p: &WorldPrimitive, implicit: &Implicit) -> String {
    let Some(grid) = implicit.grid() else {
        unreachable!("it is a volume's surface");
    };
    let name = name(number);
    let cells = DVec3::from_array(grid.volume.cells().map(|n| n as f64));
    let gain = grid.gain(implicit.level);
    let (texel, height) = if holds_heights(grid.volume.numbers()) {
        ("f32", format!("textureLoad({name}_numbers, c, 0).x"))
    } else {
        let shift = float(-implicit.level * gain);
        let number = format!("f32(textureLoad({name}_numbers, c, 0).x)");
        ("u32", format!("{number} * {} + {shift}", float(gain)))
    };
    let binding = FIRST_BINDING + 2 * k as u32;
    let mut s = format!("@group(0) @binding({binding}) var {name}_numbers: texture_3d<{texel}>;\n");
    let _ = writeln!(
        s,
        "@group(0) @binding({}) var {name}_cubes: texture_3d<u32>;\n",
        binding + 1
    );

    // A cell's sides in the scene.
    let sides = (grid.spacing * implicit.scale).to_array();
    let least = sides.into_iter().fold(f64::MAX, f64::min);
    let axes = axes(implicit, DVec3::from_array(sides));
    let normals = [0, 1, 2].map(|k| vector(implicit.rotation.col(k) * (least / sides[k])));
    let metric = DVec3::from_array(sides.map(|side| (least / side).powi(2)));
    // Places are rounded in the scene, and again in cells.
    let (middle, radius) = implicit.ball();
    let in_scene = (middle.abs().max_element() + radius) / least;
    let slack = ROUNDINGS * f64::from(f32::EPSILON) * in_scene.max(cells.max_element());
    let surface = Sides::of(number, p, implicit);
    let [x, y, z] = grid.volume.cells().map(|n| n - 1);
    let last = format!("vec3i({x}, {y}, {z})");
    let values: &[(&str, &str)] = &[
        ("name", &name),
        ("height", &height),
        ("center", &vector(implicit.center)),
        ("normal_x", &normals[0]),
        ("normal_y", &normals[1]),
        ("normal_z", &normals[2]),
        ("metric", &vector(metric)),
        ("cells", &vector(cells)),
        ("last", &last),
        ("inside", &surface.inside),
        ("asked", &surface.asked),
        ("solid", surface.solid),
        ("sign", surface.sign),
        ("result", &surface.result),
        ("key", &format!("{}u", key(number, 0))),
        ("near", &float(slack)),
        ("noise", &float(3.0 * slack + 4.0 * f64::from(f32::EPSILON))),
        ("positive", if gain > 0.0 { "true" } else { "false" }),
        ("below", &format!("{BELOW}u")),
        ("newton", "2u"),
        ("reach", &float(REACH)),
    ];
    let axes = axes.each_ref().map(|(name, value)| (*name, value.as_str()));
    let values = [values, &axes].concat();
    s += &fill(IMPLICIT_GRID.text, &values);
    if grid.smooth {
        s.push('\n');
        s += &fill(IMPLICIT_SMOOTH.text, &values);
    }
    s + "\n"
}
