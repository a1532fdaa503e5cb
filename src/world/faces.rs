//! Identities of faces. Flat faces that coincide share an identity, and the equation of their plane.

use super::{Geometry, WorldLight, WorldPrimitive, face, key};
use crate::coincidence::{self, COINCIDENT};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// A flat face that gets an identity.
#[derive(Clone, Copy)]
struct Face {
    owner: Owner,
    normal: DVec3,
    offset: f64,
    center: DVec3,
    /// Infinite for planes.
    radius: f64,
}

/// What a flat face belongs to.
#[derive(Clone, Copy)]
enum Owner {
    /// A light, by its index.
    Light(usize),
    /// A disk or a plane, by its index among the primitives.
    Flat(usize),
    /// A cylinder, by its index among the primitives, and which end: 0 is the base, 1 the top.
    Cap(usize, usize),
}

/// Gives flat faces that coincide (within [`COINCIDENT`]) the equation of the largest of them. Each plane gets a number, from 1,
/// which stands in the identities of its faces until [`name`] replaces it.
pub(super) fn identify(lights: &mut [WorldLight], primitives: &mut [WorldPrimitive]) {
    let mut faces = flat_faces(lights, primitives);
    // The largest face comes first, and smaller ones take its equation. The sort is stable: among faces of one size the first
    // stays first.
    faces.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    let mut planes = Planes::default();
    for face in faces {
        let (plane, shared) = planes.join(&face);
        move_onto(plane, shared, face.owner, lights, primitives);
    }
}

fn flat_faces(lights: &[WorldLight], primitives: &[WorldPrimitive]) -> Vec<Face> {
    let mut faces = Vec::new();
    let mut add = |owner, normal, offset, center, radius| {
        faces.push(Face {
            owner,
            normal,
            offset,
            center,
            radius,
        });
    };
    for (i, l) in lights.iter().enumerate() {
        add(Owner::Light(i), l.normal, l.offset, l.center, l.radius);
    }
    for (i, p) in primitives.iter().enumerate() {
        match p.geometry {
            Geometry::Disk {
                center,
                normal,
                offset,
                radius,
            } => add(Owner::Flat(i), normal, offset, center, radius),
            Geometry::Plane { normal, offset } => {
                add(
                    Owner::Flat(i),
                    normal,
                    offset,
                    normal * offset,
                    f64::INFINITY,
                );
            }
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                for (end, &offset) in offsets.iter().enumerate() {
                    let center = base + axis * (offset - offsets[0]);
                    add(Owner::Cap(i, end), axis, offset, center, radius);
                }
            }
            Geometry::Sphere { .. } | Geometry::HugeSphere { .. } | Geometry::Implicit(_) => {}
        }
    }
    faces
}

/// A plane that faces lie in; `id` counts from 1.
#[derive(Clone, Copy)]
struct Shared {
    id: u32,
    normal: DVec3,
    offset: f64,
}

/// The planes found so far, in an index that finds those near a face. They are sorted by the cell of a grid that their normal lies
/// in, and by their offset.
#[derive(Default)]
struct Planes {
    cells: HashMap<[i32; 3], BTreeMap<OrderedFloat, Vec<Shared>>>,
    count: u32,
}

/// A number that can be the key of a map.
#[derive(Clone, Copy, PartialEq)]
struct OrderedFloat(f64);

impl Eq for OrderedFloat {}

impl PartialOrd for OrderedFloat {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OrderedFloat {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Edge of a cell of the grid of normals. Normals of planes that coincide differ by far less.
const CELL: f64 = 1e-3;

fn cell_of(n: DVec3) -> [i32; 3] {
    (n / CELL).to_array().map(|x| x.floor() as i32)
}

/// The cells that may hold normals like `n`: one cell, or up to eight if `n` is near the border of its cell.
fn cells_around(n: DVec3) -> impl Iterator<Item = [i32; 3]> {
    let (low, high) = (cell_of(n - 2.0 * COINCIDENT), cell_of(n + 2.0 * COINCIDENT));
    (low[0]..=high[0]).flat_map(move |x| {
        (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z]))
    })
}

impl Planes {
    /// The plane of the face, with its normal turned like that of the face, and whether an earlier face is in it too.
    fn join(&mut self, face: &Face) -> (Shared, bool) {
        if let Some(found) = self.find(face) {
            let sign = found.normal.dot(face.normal).signum();
            let turned = Shared {
                normal: found.normal * sign,
                offset: found.offset * sign,
                ..found
            };
            return (turned, true);
        }
        self.count += 1;
        let plane = Shared {
            id: self.count,
            normal: face.normal,
            offset: face.offset,
        };
        let cell = cell_of(face.normal);
        let offsets = self.cells.entry(cell).or_default();
        offsets
            .entry(OrderedFloat(face.offset))
            .or_default()
            .push(plane);
        (plane, false)
    }

    /// The first plane that coincides with the face.
    fn find(&self, face: &Face) -> Option<Shared> {
        let reach = if face.radius.is_finite() {
            face.radius + face.center.length()
        } else {
            face.offset.abs()
        };
        let slack = 3.0 * COINCIDENT * reach;
        [1.0, -1.0]
            .into_iter()
            .flat_map(|sign| {
                let offset = face.offset * sign;
                let range = OrderedFloat(offset - slack)..=OrderedFloat(offset + slack);
                cells_around(face.normal * sign)
                    .filter_map(|cell| self.cells.get(&cell))
                    .flat_map(move |offsets| offsets.range(range.clone()))
            })
            .flat_map(|(_, planes)| planes)
            .filter(|plane| coincide(plane, face))
            .min_by_key(|plane| plane.id)
            .copied()
    }
}

fn coincide(plane: &Shared, face: &Face) -> bool {
    let height = plane.normal.dot(face.center) - plane.offset;
    let size = coincidence::face_size(face.radius, [plane.offset, face.offset]);
    coincidence::in_plane([plane.normal, face.normal], height, size, COINCIDENT)
}

/// Gives the owner of a face the number and the equation of the plane. A cylinder keeps its own axis unless another face shares the
/// plane.
fn move_onto(
    plane: Shared,
    shared: bool,
    owner: Owner,
    lights: &mut [WorldLight],
    primitives: &mut [WorldPrimitive],
) {
    let Shared { id, normal, offset } = plane;
    let on_plane = |p: DVec3| p - normal * (normal.dot(p) - offset);
    match owner {
        Owner::Light(i) => {
            let l = &mut lights[i];
            (l.normal, l.offset, l.center, l.face) = (normal, offset, on_plane(l.center), id);
        }
        Owner::Flat(i) => {
            primitives[i].faces[0] = id;
            match &mut primitives[i].geometry {
                Geometry::Disk {
                    center,
                    normal: n,
                    offset: o,
                    ..
                } => {
                    (*n, *o, *center) = (normal, offset, on_plane(*center));
                }
                Geometry::Plane {
                    normal: n,
                    offset: o,
                } => (*n, *o) = (normal, offset),
                _ => unreachable!("only disks and planes are flat"),
            }
        }
        Owner::Cap(i, end) => {
            primitives[i].faces[1 + end] = id;
            if shared
                && let Geometry::Cylinder {
                    base,
                    axis,
                    offsets,
                    ..
                } = &mut primitives[i].geometry
            {
                *axis = normal;
                offsets[end] = offset;
                if end == 0 {
                    *base = on_plane(*base);
                }
            }
        }
    }
}

/// Gives every face its identity. The number of a plane becomes the identity of the face that is met first in the plane. A curved face
/// lies in no plane: its number is 0, and it gets an identity of its own.
pub(super) fn name(lights: &mut [WorldLight], primitives: &mut [WorldPrimitive]) {
    let mut names = HashMap::new();
    let first = lights.len();
    let mut name = |face_id: &mut u32, number, part| {
        let own = face(key(number, part));
        *face_id = match *face_id {
            0 => own,
            plane => *names.entry(plane).or_insert(own),
        };
    };
    for (i, l) in lights.iter_mut().enumerate() {
        name(&mut l.face, i, 0);
    }
    for (i, p) in primitives.iter_mut().enumerate() {
        for part in 0..p.geometry.parts() {
            name(&mut p.faces[part], first + i, part);
        }
    }
}
