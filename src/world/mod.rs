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
//!   [`WorldLight::radiance`] here; nothing is left for the path to carry. Only for a light that pokes
//!   through the surface of a solid does it matter where on it a path ends: [`World::light_scales`].

mod faces;
mod geometry;
mod media;
mod origin;
mod tree;

pub use crate::scene::COINCIDENT;
pub use geometry::Geometry;
pub use tree::{Bounds, Node, Tree};

use crate::scene::{Bsdf, Canonical, Scene};
use glam::DVec3;
use media::Media;

/// The medium outside every dielectric solid.
pub const AIR: u32 = 0;

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
    /// Whether any part of a light may lie inside this dielectric solid.
    pub holds_light: bool,
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
    /// Radiance that the *eye* sees it with through clear media: emitted radiance times (n_eye / n_light)²
    /// (that factor not yet in it if there are [`World::light_scales`]).
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
    /// world position = (scene position - origin) / unit.
    pub origin: DVec3,
    /// A power of two; 1 but where the scene's lengths are out of the ordinary.
    pub unit: f64,
    /// The camera for a picture of the size given to [`World::new`].
    pub camera: WorldCamera,
    /// Scattering models that something has, each once.
    pub materials: Vec<Bsdf>,
    /// Lights that can be met at all; they are met before anything that coincides with them.
    pub lights: Vec<WorldLight>,
    /// Primitives that can be met at all, in the order in which coincident ones are met: disks,
    /// cylinders, planes, spheres, each sorted by what it is, but coincident ones in file order.
    pub primitives: Vec<WorldPrimitive>,
    /// Index of refraction of every medium, relative to air: air's, then those of the solids.
    pub indices: Vec<f64>,
    /// (n_eye / n)² of every medium where a light may lie in several: a path that ends on a light in medium m
    /// sees its radiance times element m. `None` where every light lies in one.
    pub light_scales: Option<Vec<f64>>,
}

impl World {
    /// Prepares `scene` for a picture of `size` pixels.
    pub fn new(scene: &Scene, size: [u32; 2]) -> Self {
        Self::of(&Canonical::new(scene), size)
    }

    /// The same of a scene that was put in order: nothing depends on the order of the file that means nothing.
    pub fn of(scene: &Canonical, size: [u32; 2]) -> Self {
        let scene_origin = origin::choose_origin(scene.scene());
        let unit = origin::choose_unit(scene.scene(), scene_origin);
        let in_units = (unit != 1.0).then(|| origin::in_units(scene.scene(), unit));
        let scene = in_units.as_ref().unwrap_or(scene.scene());
        let origin = scene_origin / unit;
        let eye = scene.camera.eye - origin;
        let mut primitives: Vec<WorldPrimitive> = Vec::with_capacity(scene.primitives.len());
        for kind in ["disk", "cylinder", "plane", "sphere"] {
            for p in scene.primitives.iter().filter(|p| p.shape.kind() == kind) {
                primitives.push(WorldPrimitive {
                    geometry: Geometry::new(&p.shape, origin),
                    material: p.material,
                    side: Side::Both,
                    solid: AIR,
                    parent: AIR,
                    faces: [0; 3],
                    holds_light: false,
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

        faces::identify(&mut lights, &mut primitives);
        let materials: Vec<Bsdf> = scene.materials.iter().map(|m| m.bsdf).collect();
        media::settle_sides(&mut primitives, &materials, eye);
        let media = Media::new(&mut primitives, &materials);
        drop_what_no_path_reaches(&mut lights, &mut primitives, eye);
        faces::name(&mut lights, &mut primitives);
        let medium = media.at(eye);
        let scales = media.light_scales(medium);
        let shines_in: Option<Vec<u32>> = lights.iter().map(|l| media.of_light(l)).collect();
        for (l, &m) in lights.iter_mut().zip(shines_in.iter().flatten()) {
            l.radiance *= scales[m as usize];
        }
        let holding = media.holding(&lights);
        for p in &mut primitives {
            p.holds_light = holding[p.solid as usize];
        }
        origin::find_huge_spheres(&mut primitives, &lights, eye);

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
            origin: scene_origin,
            unit,
            camera,
            materials,
            lights,
            primitives,
            indices: media.indices(),
            light_scales: shines_in.is_none().then_some(scales),
        }
    }
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
            reachable(center, &|_| radius, radius) || p.geometry.holds(eye)
        }
        Geometry::Plane { .. } | Geometry::HugeSphere { .. } => true,
    });
}
