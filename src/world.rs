//! The scene made ready for rays, in f64: moved to where f32 is fine enough, coincident planar
//! surfaces given one equation, and everything about *sides* settled once, so that no ray ever has
//! to infer from a rounded number which side of a surface it is on.
//!
//! Three facts make that possible:
//!
//! - Nothing passes an opaque surface. A path is for ever on the eye's side of an opaque plane and
//!   outside (or inside) an opaque solid as the eye is: [`Side`] says which root of the intersection
//!   can be met, and rounding can move a hit but never lose it.
//! - Dielectric solids nest. The only dielectric surfaces a ray in solid M can meet are M's own, from
//!   inside, and those of the solids whose parent is M, from outside. A path carries the number of
//!   its solid ([`AIR`] for none).
//! - Radiance over n² is constant along a path, so the factors of all refractions between a light
//!   and the eye telescope to (n at the eye / n at the light)², which is part of
//!   [`WorldLight::radiance`] here; nothing is left for the path to carry.

use crate::scene::{Bsdf, Scene, Shape};
use glam::DVec3;
use std::collections::HashMap;

/// The medium outside every dielectric solid.
pub const AIR: u32 = 0;

/// Surfaces closer than this, relative to their size, coincide.
pub const COINCIDENT: f64 = 1e-6;

/// Where rays can be, seen from a primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// Always outside this opaque solid (in front of this opaque plane).
    Outside,
    /// Always inside this opaque solid, where the eye is.
    Inside,
    /// On either side: a dielectric, or a disk.
    Both,
}

/// World-space shapes; `offset`s are n·p of the planes that faces lie in, bit-identical (up to
/// sign) for faces that coincide.
#[expect(missing_docs, reason = "each variant's text names its fields")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Geometry {
    /// Two-sided flat disk.
    Disk {
        center: DVec3,
        normal: DVec3,
        offset: f64,
        radius: f64,
    },
    /// Solid with two caps: `axis` has unit length; cap planes are axis·p = offsets\[0\] (at `base`) and
    /// offsets\[1\] = offsets\[0\] + length.
    Cylinder {
        base: DVec3,
        axis: DVec3,
        offsets: [f64; 2],
        radius: f64,
    },
    /// Infinite plane n·p = offset. An opaque one has its normal turned to the eye.
    Plane { normal: DVec3, offset: f64 },
    /// Sphere of ordinary size.
    Sphere { center: DVec3, radius: f64 },
    /// Sphere far larger than the scene: `pole` is its point nearest the world's origin, `normal`
    /// the outward normal there, `radius` its radius.
    HugeSphere {
        pole: DVec3,
        normal: DVec3,
        radius: f64,
    },
}

/// A primitive in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldPrimitive {
    /// Its shape.
    pub geometry: Geometry,
    /// Index into [`World::materials`].
    pub material: usize,
    /// Where rays can be.
    pub side: Side,
    /// Number of the dielectric solid it bounds, from 1; [`AIR`] for opaque things.
    pub solid: u32,
    /// The solid just outside `solid`.
    pub parent: u32,
    /// Identity of its faces (cylinder: side, base cap, top cap; others use the first): [`face`] of
    /// its key, or of the key of the first of the planar faces that coincide; never 0.
    pub faces: [u32; 3],
    /// Line in the scene file.
    pub line: usize,
}

/// A disk light in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldLight {
    /// Centre.
    pub center: DVec3,
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// normal · center.
    pub offset: f64,
    /// Radius.
    pub radius: f64,
    /// Radiance that the *eye* sees it with through clear media: emitted radiance times (n_eye / n_light)².
    pub radiance: DVec3,
    /// Radiance that it emits, as the scene says.
    pub emitted: DVec3,
    /// Identity of its plane, shared with coincident planar faces.
    pub face: u32,
    /// Line in the scene file.
    pub line: usize,
}

/// Pinhole camera in world space: the ray through film position (x, y), in pixels from the top
/// left, has direction forward + (x - width/2) dx + (y - height/2) dy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldCamera {
    /// The pinhole.
    pub eye: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// One pixel to the right, at unit distance along `forward`.
    pub dx: DVec3,
    /// One pixel down.
    pub dy: DVec3,
    /// The dielectric solid that holds the eye.
    pub medium: u32,
}

/// The key of part `part` of surface number `number`: lights come first, then the primitives.
pub fn key(number: usize, part: usize) -> u32 {
    (4 * number + part) as u32
}

/// The identity of the face with this key, if nothing that is met earlier coincides with it; 0 is no face.
pub fn face(key: u32) -> u32 {
    key + 1
}

/// The scene, ready for rays.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// world position = scene position - origin.
    pub origin: DVec3,
    /// The camera for a picture of the size given to [`World::new`].
    pub camera: WorldCamera,
    /// Scattering models, as in the scene.
    pub materials: Vec<Bsdf>,
    /// Lights that can be met at all; they are met before anything that coincides with them.
    pub lights: Vec<WorldLight>,
    /// Primitives that can be met at all, in the order in which coincident ones are met: disks,
    /// cylinders, planes, spheres, each in file order.
    pub primitives: Vec<WorldPrimitive>,
}

impl World {
    /// Prepares `scene` for a picture of `size` pixels.
    pub fn new(scene: &Scene, size: [u32; 2]) -> Self {
        let origin = choose_origin(scene);
        let eye = scene.camera.eye - origin;
        let mut primitives: Vec<WorldPrimitive> = Vec::with_capacity(scene.primitives.len());
        for kind in ["disk", "cylinder", "plane", "sphere"] {
            for p in scene.primitives.iter().filter(|p| p.shape.kind() == kind) {
                primitives.push(WorldPrimitive {
                    geometry: to_world(&p.shape, origin),
                    material: p.material,
                    side: Side::Both,
                    solid: AIR,
                    parent: AIR,
                    faces: [0; 3],
                    line: p.line,
                });
            }
        }
        let mut lights: Vec<WorldLight> = scene
            .lights
            .iter()
            .map(|l| WorldLight {
                center: l.center - origin,
                normal: l.normal,
                offset: l.normal.dot(l.center - origin),
                radius: l.radius,
                radiance: l.radiance,
                emitted: l.radiance,
                face: 0,
                line: l.line,
            })
            .collect();

        share_planes(&mut lights, &mut primitives);
        let materials: Vec<Bsdf> = scene.materials.iter().map(|m| m.bsdf).collect();
        settle_sides(&mut primitives, &materials, eye);
        number_solids(&mut primitives, &materials);
        drop_what_no_path_reaches(&mut lights, &mut primitives, eye);
        let medium = medium_at(&primitives, eye);
        scale_radiance(&mut lights, &primitives, &materials, medium);
        find_huge_spheres(&mut primitives, &lights, eye);
        name_faces(&mut lights, &mut primitives);

        let forward = (scene.camera.look_at - scene.camera.eye).normalize();
        let right = forward.cross(scene.camera.up.normalize()).normalize();
        let pixel = 2.0 * (scene.camera.vfov.to_radians() / 2.0).tan() / f64::from(size[1]);
        let camera = WorldCamera {
            eye,
            forward,
            dx: right * pixel,
            dy: forward.cross(right) * pixel,
            medium,
        };
        Self {
            origin,
            camera,
            materials,
            lights,
            primitives,
        }
    }

    /// Whether any part of a light lies inside dielectric solid `solid`, as far as 64 points of it tell.
    pub fn holds_light(&self, solid: u32) -> bool {
        let Some(s) = self.primitives.iter().find(|p| p.solid == solid) else {
            return false;
        };
        self.lights
            .iter()
            .any(|l| points_before(l).any(|p| inside(&s.geometry, p)))
    }

    /// Index of refraction of a medium relative to air: the product of the iors of the solids around it.
    pub fn index_of(&self, medium: u32) -> f64 {
        index_of(&self.primitives, &self.materials, medium)
    }
}

/// The middle of eye, lights and things of ordinary size if f32 coordinates about the file's origin would
/// be too coarse for some radius (one part in 10⁴), else the file's own origin, whose zeros make simpler
/// arithmetic.
fn choose_origin(scene: &Scene) -> DVec3 {
    let mut sized: Vec<(DVec3, f64)> = scene.lights.iter().map(|l| (l.center, l.radius)).collect();
    for p in &scene.primitives {
        match p.shape {
            Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
                sized.push((center, radius));
            }
            Shape::Cylinder { base, top, radius } => {
                sized.push((base, radius));
                sized.push((top, radius));
            }
            Shape::Plane { .. } => {}
        }
    }
    let ulp = f64::from(f32::EPSILON) / 2.0;
    if !sized.iter().any(|(c, r)| c.length() * ulp > 1e-4 * r) {
        return DVec3::ZERO;
    }
    sized.sort_by(|a, b| a.1.total_cmp(&b.1));
    let median = sized[sized.len() / 2].1;
    // Walls made of huge spheres have their centres far away.
    let ordinary = sized
        .iter()
        .filter(|(_, r)| *r <= 10.0 * median)
        .map(|(c, _)| *c);
    let middle: Vec<DVec3> = ordinary.chain([scene.camera.eye]).collect();
    middle.iter().sum::<DVec3>() / middle.len() as f64
}

fn to_world(shape: &Shape, origin: DVec3) -> Geometry {
    match *shape {
        Shape::Sphere { center, radius } => Geometry::Sphere {
            center: center - origin,
            radius,
        },
        Shape::Plane { point, normal } => Geometry::Plane {
            normal,
            offset: normal.dot(point - origin),
        },
        Shape::Disk {
            center,
            normal,
            radius,
        } => {
            let center = center - origin;
            Geometry::Disk {
                center,
                normal,
                offset: normal.dot(center),
                radius,
            }
        }
        Shape::Cylinder { base, top, radius } => {
            let axis = (top - base).normalize();
            let base = base - origin;
            let offset = axis.dot(base);
            Geometry::Cylinder {
                base,
                axis,
                offsets: [offset, offset + top.distance(base + origin)],
                radius,
            }
        }
    }
}

/// A planar face on its way to an identity.
#[derive(Clone, Copy)]
struct Face {
    owner: Owner,
    normal: DVec3,
    offset: f64,
    center: DVec3,
    /// Radius; infinite for planes.
    size: f64,
}

#[derive(Clone, Copy)]
enum Owner {
    Light(usize),
    Flat(usize),
    Cap(usize, usize),
}

/// Gives every face its identity and faces that lie in one plane (within [`COINCIDENT`]) the same
/// one, with the equation of the largest.
fn share_planes(lights: &mut [WorldLight], primitives: &mut [WorldPrimitive]) {
    let mut faces = Vec::new();
    for (i, l) in lights.iter().enumerate() {
        faces.push(Face {
            owner: Owner::Light(i),
            normal: l.normal,
            offset: l.offset,
            center: l.center,
            size: l.radius,
        });
    }
    for (i, p) in primitives.iter().enumerate() {
        match p.geometry {
            Geometry::Disk {
                center,
                normal,
                offset,
                radius,
            } => {
                faces.push(Face {
                    owner: Owner::Flat(i),
                    normal,
                    offset,
                    center,
                    size: radius,
                });
            }
            Geometry::Plane { normal, offset } => faces.push(Face {
                owner: Owner::Flat(i),
                normal,
                offset,
                center: normal * offset,
                size: f64::INFINITY,
            }),
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                for (end, &offset) in offsets.iter().enumerate() {
                    let center = base + axis * (offset - offsets[0]);
                    faces.push(Face {
                        owner: Owner::Cap(i, end),
                        normal: axis,
                        offset,
                        center,
                        size: radius,
                    });
                }
            }
            Geometry::Sphere { .. } | Geometry::HugeSphere { .. } => {}
        }
    }
    // The largest first: smaller faces take its equation. Stable, so file order decides among equals.
    faces.sort_by(|a, b| b.size.total_cmp(&a.size));
    let mut next = 1;
    let mut groups: Vec<(u32, Face)> = Vec::new();
    for face in faces {
        let found = groups.iter().find(|(_, g)| coincide(g, &face)).copied();
        let (id, normal, offset) = match found {
            Some((id, g)) => {
                let sign = g.normal.dot(face.normal).signum();
                (id, g.normal * sign, g.offset * sign)
            }
            None => {
                groups.push((next, face));
                next += 1;
                (next - 1, face.normal, face.offset)
            }
        };
        let on_plane = |p: DVec3| p - normal * (normal.dot(p) - offset);
        match face.owner {
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
                if found.is_some()
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
    for p in primitives {
        if matches!(
            p.geometry,
            Geometry::Cylinder { .. } | Geometry::Sphere { .. }
        ) {
            p.faces[0] = next;
            next += 1;
        }
    }
}

fn coincide(a: &Face, b: &Face) -> bool {
    if a.normal.cross(b.normal).length() > COINCIDENT {
        return false;
    }
    // `b` is the smaller one; two infinite planes are compared at their points nearest the origin.
    let size = if b.size.is_finite() {
        b.size
    } else {
        a.offset.abs().max(b.offset.abs())
    };
    (a.normal.dot(b.center) - a.offset).abs() <= COINCIDENT * size
}

fn is_dielectric(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Dielectric { .. })
}

/// Whether `p` is strictly inside the solid bounded by `g` (behind it, for a plane).
fn inside(g: &Geometry, p: DVec3) -> bool {
    match *g {
        Geometry::Sphere { center, radius } => p.distance_squared(center) < radius * radius,
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => {
            let v = p - pole;
            v.length_squared() / radius + 2.0 * normal.dot(v) < 0.0
        }
        Geometry::Plane { normal, offset } => normal.dot(p) < offset,
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let h = axis.dot(p);
            let m = p - base;
            h > offsets[0] && h < offsets[1] && (m - axis * axis.dot(m)).length() < radius
        }
        Geometry::Disk { .. } => false,
    }
}

/// Opaque planes turn to the eye, opaque solids learn whether the eye is inside.
fn settle_sides(primitives: &mut [WorldPrimitive], materials: &[Bsdf], eye: DVec3) {
    for p in primitives {
        if is_dielectric(&materials[p.material]) || matches!(p.geometry, Geometry::Disk { .. }) {
            continue;
        }
        let eye_inside = inside(&p.geometry, eye);
        p.side = if eye_inside {
            Side::Inside
        } else {
            Side::Outside
        };
        if let Geometry::Plane { normal, offset } = &mut p.geometry {
            p.side = Side::Outside;
            if eye_inside {
                (*normal, *offset) = (-*normal, -*offset);
            }
        }
    }
}

/// A point well inside a solid, and its volume.
fn core_of(g: &Geometry) -> (DVec3, f64) {
    match *g {
        Geometry::Sphere { center, radius } => {
            (center, radius.powi(3) * 4.0 / 3.0 * std::f64::consts::PI)
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let length = offsets[1] - offsets[0];
            (
                base + axis * (length / 2.0),
                radius * radius * length * std::f64::consts::PI,
            )
        }
        Geometry::Plane { normal, offset } => (normal * offset, f64::INFINITY),
        Geometry::HugeSphere { .. } | Geometry::Disk { .. } => (DVec3::ZERO, 0.0),
    }
}

/// Whether solid `outer` holds solid `inner`; of two equal ones the `first` in the file is the outer.
fn encloses(outer: &Geometry, inner: &Geometry, first: bool) -> bool {
    if let (
        Geometry::Plane { normal, offset },
        Geometry::Plane {
            normal: n,
            offset: o,
        },
    ) = (outer, inner)
    {
        // Half-spaces that are not parallel cross, and neither holds the other.
        let parallel = normal.cross(*n).length() <= COINCIDENT && normal.dot(*n) > 0.0;
        return parallel && (offset > o || (offset == o && first));
    }
    let (core, volume) = core_of(inner);
    let larger = core_of(outer).1;
    inside(outer, core) && (larger > volume || (larger == volume && first))
}

/// Numbers the dielectric solids from 1, and finds the one just outside each.
fn number_solids(primitives: &mut [WorldPrimitive], materials: &[Bsdf]) {
    let solids: Vec<usize> = (0..primitives.len())
        .filter(|&i| is_dielectric(&materials[primitives[i].material]))
        .collect();
    for (k, &i) in solids.iter().enumerate() {
        primitives[i].solid = k as u32 + 1;
    }
    let around: Vec<Vec<usize>> = (0..solids.len())
        .map(|k| {
            let inner = &primitives[solids[k]].geometry;
            (0..solids.len())
                .filter(|&m| m != k && encloses(&primitives[solids[m]].geometry, inner, m < k))
                .collect()
        })
        .collect();
    for (k, &i) in solids.iter().enumerate() {
        // Those around it lie in each other like the skins of an onion: the innermost has the most around it.
        let innermost = around[k].iter().max_by_key(|&&m| around[m].len());
        primitives[i].parent = innermost.map_or(AIR, |&m| primitives[solids[m]].solid);
    }
}

/// The innermost dielectric solid around a point.
fn medium_at(primitives: &[WorldPrimitive], p: DVec3) -> u32 {
    primitives
        .iter()
        .filter(|s| s.solid != AIR && inside(&s.geometry, p))
        .max_by_key(|s| nesting(primitives, s.solid))
        .map_or(AIR, |s| s.solid)
}

/// How many solids deep `solid` lies; 0 is air.
fn nesting(primitives: &[WorldPrimitive], solid: u32) -> usize {
    let mut depth = 0;
    let mut at = solid;
    while let Some(s) = primitives.iter().find(|s| at != AIR && s.solid == at) {
        depth += 1;
        at = s.parent;
    }
    depth
}

fn index_of(primitives: &[WorldPrimitive], materials: &[Bsdf], medium: u32) -> f64 {
    let mut index = 1.0;
    let mut at = medium;
    while let Some(s) = primitives.iter().find(|s| at != AIR && s.solid == at) {
        if let Bsdf::Dielectric { ior, .. } = materials[s.material] {
            index *= ior;
        }
        at = s.parent;
    }
    index
}

/// Whatever lies wholly behind an opaque plane is out of every path's reach.
fn drop_what_no_path_reaches(
    lights: &mut Vec<WorldLight>,
    primitives: &mut Vec<WorldPrimitive>,
    eye: DVec3,
) {
    let walls: Vec<(DVec3, f64)> = primitives
        .iter()
        .filter(|p| p.side == Side::Outside)
        .filter_map(|p| match p.geometry {
            Geometry::Plane { normal, offset } => Some((normal, offset)),
            _ => None,
        })
        .collect();
    // `reach`: how far a thing extends towards the eye's side of a wall. What touches it stays.
    let reachable = |center: DVec3, reach: &dyn Fn(DVec3) -> f64, size: f64| {
        walls
            .iter()
            .all(|&(n, offset)| n.dot(center) + reach(n) >= offset - COINCIDENT * size)
    };
    let disk = |n: DVec3, normal: DVec3, radius: f64| radius * n.cross(normal).length();
    lights.retain(|l| reachable(l.center, &|n| disk(n, l.normal, l.radius), l.radius));
    primitives.retain(|p| match p.geometry {
        Geometry::Disk {
            center,
            normal,
            radius,
            ..
        } => reachable(center, &|n| disk(n, normal, radius), radius),
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let length = offsets[1] - offsets[0];
            reachable(
                base,
                &|n| disk(n, axis, radius) + (n.dot(axis) * length).max(0.0),
                radius,
            )
        }
        Geometry::Sphere { center, radius } => {
            reachable(center, &|_| radius, radius) || inside(&p.geometry, eye)
        }
        Geometry::Plane { .. } | Geometry::HugeSphere { .. } => true,
    });
}

/// Points spread evenly over a light, just before its front: a light flush on glass shines into what is before it.
fn points_before(l: &WorldLight) -> impl Iterator<Item = DVec3> {
    const COUNT: u32 = 64;
    let x = l.normal.any_orthonormal_vector();
    let y = l.normal.cross(x);
    let (center, radius) = (l.center + l.normal * (COINCIDENT * l.radius), l.radius);
    (0..COUNT).map(move |k| {
        // A sunflower's seeds: the golden angle, and rings of equal area; the last lies on the rim.
        let (sin, cos) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
        center + (x * cos + y * sin) * radius * (f64::from(k) / f64::from(COUNT - 1)).sqrt()
    })
}

/// The medium that most of a light shines in; its centre alone may just touch a glass ball.
fn medium_before(l: &WorldLight, primitives: &[WorldPrimitive]) -> u32 {
    let mut counts: HashMap<u32, u32> = HashMap::new();
    for p in points_before(l) {
        *counts.entry(medium_at(primitives, p)).or_default() += 1;
    }
    let most = counts
        .into_iter()
        .max_by_key(|&(medium, count)| (count, std::cmp::Reverse(medium)));
    most.map_or(AIR, |(medium, _)| medium)
}

fn scale_radiance(
    lights: &mut [WorldLight],
    primitives: &[WorldPrimitive],
    materials: &[Bsdf],
    eye_medium: u32,
) {
    if primitives.iter().all(|p| p.solid == AIR) {
        return;
    }
    let n_eye = index_of(primitives, materials, eye_medium);
    for l in lights {
        let n_light = index_of(primitives, materials, medium_before(l, primitives));
        if n_light != n_eye {
            l.radiance *= (n_eye / n_light).powi(2);
        }
    }
}

/// Replaces the identities of faces by the keys of those that are met first.
fn name_faces(lights: &mut [WorldLight], primitives: &mut [WorldPrimitive]) {
    let mut names = HashMap::new();
    let first = lights.len();
    for (i, l) in lights.iter_mut().enumerate() {
        l.face = *names.entry(l.face).or_insert(face(key(i, 0)));
    }
    for (i, p) in primitives.iter_mut().enumerate() {
        for part in 0..if matches!(p.geometry, Geometry::Cylinder { .. }) {
            3
        } else {
            1
        } {
            p.faces[part] = *names
                .entry(p.faces[part])
                .or_insert(face(key(first + i, part)));
        }
    }
}

/// Spheres more than 50 times as large as all that is smaller get the curvature form: in f32 the
/// ordinary one would place their surface only to 10⁻⁷ of the radius.
fn find_huge_spheres(primitives: &mut [WorldPrimitive], lights: &[WorldLight], eye: DVec3) {
    let mut extent = eye.length();
    for l in lights {
        extent = extent.max(l.center.length() + l.radius);
    }
    let mut spheres = Vec::new();
    for (i, p) in primitives.iter().enumerate() {
        match p.geometry {
            Geometry::Disk { center, radius, .. } => extent = extent.max(center.length() + radius),
            Geometry::Cylinder {
                base,
                axis,
                offsets,
                radius,
            } => {
                let top = base + axis * (offsets[1] - offsets[0]);
                extent = extent.max(base.length().max(top.length()) + radius);
            }
            Geometry::Sphere { center, radius } => spheres.push((radius, center, i)),
            Geometry::Plane { .. } | Geometry::HugeSphere { .. } => {}
        }
    }
    spheres.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (radius, center, i) in spheres {
        let distance = center.length();
        if radius > 50.0 * extent && distance > 0.5 * radius {
            // The surface point nearest the origin lies on the line through the centre.
            let normal = -center / distance;
            primitives[i].geometry = Geometry::HugeSphere {
                pole: center + normal * radius,
                normal,
                radius,
            };
        } else if radius <= 50.0 * extent {
            extent = extent.max(distance + radius);
        }
    }
}
