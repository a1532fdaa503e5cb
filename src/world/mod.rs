//! The scene made ready for rays, in f64.
//!
//! The world moves the scene to where f32 is fine enough, and gives flat surfaces that coincide one equation. It decides all that
//! concerns *sides*, so that no ray has to infer from a rounded number which side of a surface it is on.
//!
//! Three facts make that possible:
//!
//! - Nothing passes an opaque surface. A path always stays on the eye's side of an opaque plane. It stays outside an opaque solid
//!   if the eye is outside, and inside if the eye is inside. So [`Side`] says which root of the intersection a ray can meet, and
//!   rounding can move a hit but never lose it.
//! - Dielectric solids nest. A ray in solid M can meet only two kinds of dielectric surface: that of M, from inside, and those of
//!   the solids whose parent is M, from outside. A path carries the number of its solid ([`AIR`] for none).
//! - Radiance over n² is constant along a path. The factors of all refractions between a light and the eye therefore multiply to
//!   (n at the eye / n at the light)². [`WorldLight::radiance`] contains that factor, and the path carries nothing. The
//!   exception is a light that pokes through the surface of a solid: [`World::light_scales`].

pub(crate) mod aims;
mod bounds;
pub(crate) mod bulbs;
mod faces;
mod geometry;
pub(crate) mod light_tree;
mod media;
pub(crate) mod near_light;
mod origin;
pub mod trace;
pub(crate) mod tree;
pub(crate) mod visibility;

pub use bounds::Bounds;
pub use geometry::Geometry;
pub use light_tree::MAX_SCANNED_LIGHTS;
pub use tree::{Below, Box32, Node, Tree};

use crate::coincidence::slack;
use crate::scene::{Bsdf, Canonical, Scene};
use glam::DVec3;
use media::Media;

/// The medium outside every dielectric solid.
pub const AIR: u32 = 0;

/// On which side of a primitive rays can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// Always outside this opaque solid, or in front of this opaque plane.
    Outside,
    /// Always inside this opaque solid, where the eye is.
    Inside,
    /// On both sides, of a dielectric or a disk.
    Both,
}

/// A primitive in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldPrimitive {
    /// Its shape.
    pub geometry: Geometry,
    /// Index into [`World::materials`].
    pub material: usize,
    /// On which side rays can be.
    pub side: Side,
    /// Number of the dielectric solid that it bounds, from 1; [`AIR`] for opaque things.
    pub solid: u32,
    /// The solid just outside `solid`.
    pub parent: u32,
    /// Identities of its faces: side, base cap and top cap of a cylinder; surface and cap of an implicit surface; other shapes use the
    /// first. The identity is the
    /// [`face`] of its own key, or of the key of the first flat face that coincides with it. Never 0.
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
    /// The radiance that the *eye* sees through clear media: `emitted` times (n at the eye / n at the light)². If there are
    /// [`World::light_scales`], that factor is not included.
    pub radiance: DVec3,
    /// The radiance that it emits, from the scene.
    pub emitted: DVec3,
    /// Identity of its plane, shared with flat faces that coincide.
    pub face: u32,
    /// The dielectric solid that it shines in; `None` if the surface of one may cut it.
    pub medium: Option<u32>,
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

/// The key of part `part` of surface number `number`. Lights are numbered first, then primitives.
pub fn key(number: usize, part: usize) -> u32 {
    (4 * number + part) as u32
}

/// The identity of the face with this key, unless the face coincides with one that is met earlier. 0 means no face.
pub fn face(key: u32) -> u32 {
    key + 1
}

/// The scene, ready for rays.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// world position = (scene position - origin) / unit.
    pub origin: DVec3,
    /// A power of two; 1 unless lengths of the scene are extreme.
    pub unit: f64,
    /// The camera for a picture of the size given to [`World::new`].
    pub camera: WorldCamera,
    /// The scattering models that are in use, each once.
    pub materials: Vec<Bsdf>,
    /// Lights that some ray can meet. A ray meets a light before anything that coincides with it.
    pub lights: Vec<WorldLight>,
    /// Primitives that some ray can meet: disks, cylinders, planes, spheres, then formulas and volumes. Each kind is in the order of
    /// [`Canonical`]. Of primitives that coincide, a ray meets the first.
    pub primitives: Vec<WorldPrimitive>,
    /// Index of refraction of every medium, relative to air: first of air, then of the solids.
    pub indices: Vec<f64>,
    /// (n at the eye / n)² of every medium, if some light may lie in several media. A path that ends on a light in medium m
    /// sees the light's radiance times element m. `None` if every light lies in one medium.
    pub light_scales: Option<Vec<f64>>,
    /// Lights in glass balls that can be sampled from outside.
    pub(crate) bulbs: Vec<bulbs::Bulb>,
}

impl World {
    /// Prepares `scene` for a picture of `size` pixels.
    pub fn new(scene: &Scene, size: [u32; 2]) -> Self {
        Self::of(&Canonical::new(scene), size)
    }

    /// The same as [`World::new`], of a scene in canonical order. The world depends on the order of the file only where
    /// surfaces coincide.
    pub fn of(scene: &Canonical, size: [u32; 2]) -> Self {
        let scene_origin = origin::choose_origin(scene.scene());
        let unit = origin::choose_unit(scene.scene(), scene_origin);
        let in_units = (unit != 1.0).then(|| origin::in_units(scene.scene(), unit));
        let scene = in_units.as_ref().unwrap_or(scene.scene());
        let origin = scene_origin / unit;
        let eye = scene.camera.eye - origin;
        let mut primitives: Vec<WorldPrimitive> = Vec::with_capacity(scene.primitives.len());
        for kind in [
            "disk",
            "cylinder",
            "plane",
            "sphere",
            "implicit",
            "isosurface",
        ] {
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
                medium: None,
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
        for l in &mut lights {
            l.medium = media.of_light(l);
        }
        let shines_in: Option<Vec<u32>> = lights.iter().map(|l| l.medium).collect();
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
        let mut world = Self {
            origin: scene_origin,
            unit,
            camera,
            materials,
            lights,
            primitives,
            indices: media.indices(),
            light_scales: shines_in.is_none().then_some(scales),
            bulbs: Vec::new(),
        };
        world.bulbs = bulbs::bulbs(&world);
        world
    }

    /// How many lights and primitives there are.
    pub fn surface_count(&self) -> usize {
        self.lights.len() + self.primitives.len()
    }

    /// The primitive with this number among lights and primitives; `None` for a light.
    pub(crate) fn primitive(&self, number: usize) -> Option<&WorldPrimitive> {
        number
            .checked_sub(self.lights.len())
            .map(|i| &self.primitives[i])
    }
}

/// Removes what lies wholly behind an opaque plane, where no path comes.
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
    // `reach` says how far a thing extends from `center` towards the eye's side of a wall. A thing that touches the wall stays.
    let reachable = |center: DVec3, reach: &dyn Fn(DVec3) -> f64, size: f64| {
        walls
            .iter()
            .all(|&(n, offset)| n.dot(center) + reach(n) >= offset - slack(size))
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
        Geometry::Implicit(ref implicit) => {
            let (center, radius) = implicit.ball();
            reachable(center, &|_| radius, radius) || p.geometry.holds(eye)
        }
        Geometry::Plane { .. } | Geometry::HugeSphere { .. } => true,
    });
}
