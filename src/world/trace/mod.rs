//! Exact rays: what a ray meets in the world, and where a mirror or glass sends it, in f64.
//!
//! The reference follows its paths with these functions. The GPU's host uses them to find the pixels in which mirrors and glass
//! show a light. Each shape has a file of its own, with the name of the shader module that does the same in f32.

pub mod camera;
pub mod cylinder;
pub mod dielectric;
pub mod disk;
mod finder;
pub mod huge_sphere;
pub mod mirror;
pub mod plane;
pub mod sphere;

#[cfg(test)]
pub(crate) mod brute_force;

pub use camera::camera_ray;
pub use finder::Finder;

use super::{AIR, Geometry, Side, World, WorldPrimitive};
use crate::implicit::roots::Start;
use crate::scene::Bsdf;
use cylinder::Cylinder;
use dielectric::Boundary;
use glam::DVec3;
use huge_sphere::HugeSphere;

/// A ray, with what its path knows about the place where it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// The dielectric solid that it is in; [`AIR`] for none.
    pub medium: u32,
    /// The face that it starts on ([`WorldPrimitive::faces`]); 0 for none.
    pub face: u32,
}

impl Ray {
    /// The point at distance `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// What a ray has met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Met {
    /// A light.
    Light {
        /// Index into [`World::lights`].
        index: usize,
        /// Whether the ray has met the side that emits.
        front: bool,
    },
    /// A primitive, by its index into [`World::primitives`].
    Primitive(usize),
}

/// Where a ray has met something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, >= 0.
    pub t: f64,
    /// The point met, moved onto the surface.
    pub point: DVec3,
    /// Unit normal, on the side that the ray comes from.
    pub normal: DVec3,
    /// Unit normal about which light is scattered, on the same side. It is [`normal`](Self::normal), but where a volume has smooth ones.
    pub shading: DVec3,
    /// Identity of the face that was met.
    pub face: u32,
    /// What was met.
    pub met: Met,
}

impl Hit {
    /// The normal about which a mirror or glass scatters what comes in `direction`: the one of the two shading normals that faces it. A smooth
    /// normal may turn away from a ray that meets the surface's front.
    pub fn facing(&self, direction: DVec3) -> DVec3 {
        if self.shading.dot(direction) > 0.0 {
            -self.shading
        } else {
            self.shading
        }
    }

    /// Whether `direction` leads to the side of the surface that it should: to that of the ray, or beyond if it crosses. About a smooth
    /// normal light may be scattered to the wrong side, where it is lost.
    pub fn leads_to_side(&self, direction: DVec3, crosses: bool) -> bool {
        // About the surface's own normal nothing is: what rounding does at grazing angles is no reason to lose light.
        self.shading == self.normal || (self.normal.dot(direction) < 0.0) == crosses
    }
}

/// The nearest surface so far, by its number among lights and primitives.
struct Nearest {
    number: usize,
    hit: Hit,
}

impl World {
    /// The nearest thing that the ray meets. If several are at the same distance, it is the first of them: lights come before
    /// primitives, and each kind is in the order of the world. [`Finder`] finds the same, faster where there are many.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = None;
        for number in 0..self.surface_count() {
            self.meet_nearer(number, ray, &mut nearest);
        }
        nearest.map(|n: Nearest| n.hit)
    }

    /// Puts surface number `number` in place of `nearest` if the ray meets it first. Lights are numbered first, then primitives.
    fn meet_nearer(&self, number: usize, ray: &Ray, nearest: &mut Option<Nearest>) {
        let is_first = |t: f64| {
            nearest
                .as_ref()
                .is_none_or(|n| t < n.hit.t || t == n.hit.t && number < n.number)
        };
        let hit = match self.primitive(number) {
            None => {
                let l = &self.lights[number];
                let met = disk::intersect(l.center, l.normal, l.offset, l.radius, l.face, ray);
                met.filter(|&t| is_first(t)).map(|t| {
                    let front = l.normal.dot(ray.direction) < 0.0;
                    let normal = if front { l.normal } else { -l.normal };
                    Hit {
                        t,
                        point: plane::project(l.normal, l.offset, ray.at(t)),
                        normal,
                        shading: normal,
                        face: l.face,
                        met: Met::Light {
                            index: number,
                            front,
                        },
                    }
                })
            }
            Some(p) => is_inside(p, ray.medium).and_then(|inside| {
                let (t, face) = meet(p, inside, ray).filter(|&(t, _)| is_first(t))?;
                let (point, outward) = surface(p, face, ray, t);
                let turn = if p.geometry.is_sheet() {
                    outward.dot(ray.direction) > 0.0
                } else {
                    inside
                };
                let side = if turn { -1.0 } else { 1.0 };
                let shading = match &p.geometry {
                    Geometry::Implicit(implicit) => {
                        implicit.shading_normal(point, outward, face == 1)
                    }
                    _ => outward,
                };
                Some(Hit {
                    t,
                    point,
                    normal: outward * side,
                    shading: shading * side,
                    face: p.faces[face],
                    met: Met::Primitive(number - self.lights.len()),
                })
            }),
        };
        if let Some(hit) = hit {
            *nearest = Some(Nearest { number, hit });
        }
    }

    /// Whether a ray that is aimed at the front of light `light` meets something before it. A ray that misses the light, or comes
    /// from behind it, counts as occluded.
    pub fn occluded(&self, ray: &Ray, light: usize) -> bool {
        let aimed_at = Met::Light {
            index: light,
            front: true,
        };
        self.intersect(ray).is_none_or(|hit| hit.met != aimed_at)
    }

    /// The ray that leaves `hit`, where `ray` has met a mirror or glass. At glass it refracts if it can, or is reflected if
    /// `reflects`. `None` from other surfaces, and where a smooth normal leads to the wrong side.
    pub fn specular(&self, hit: &Hit, ray: &Ray, reflects: bool) -> Option<Ray> {
        let Met::Primitive(index) = hit.met else {
            return None;
        };
        let p = &self.primitives[index];
        let normal = hit.facing(ray.direction);
        let (direction, medium) = match self.materials[p.material] {
            Bsdf::Mirror { .. } => (mirror::reflect(ray.direction, normal), ray.medium),
            Bsdf::Dielectric { ior, .. } => {
                let boundary = Boundary::new(p, ior, ray.medium);
                let u = if reflects { 1.0 } else { 0.0 };
                let (direction, crossed) =
                    dielectric::sample(ray.direction, normal, boundary.eta, u);
                let medium = if crossed { boundary.beyond } else { ray.medium };
                (direction, medium)
            }
            _ => return None,
        };
        if !hit.leads_to_side(direction, medium != ray.medium) {
            return None;
        }
        Some(Ray {
            origin: hit.point,
            direction,
            medium,
            face: hit.face,
        })
    }
}

/// Whether a ray in `medium` is inside the solid `p`; `None` if it cannot meet `p` at all. No ray is inside a disk.
fn is_inside(p: &WorldPrimitive, medium: u32) -> Option<bool> {
    match p.side {
        Side::Outside => Some(false),
        Side::Inside => Some(true),
        Side::Both if p.solid == AIR => Some(false),
        Side::Both if p.solid == medium => Some(true),
        Side::Both if p.parent == medium => Some(false),
        Side::Both => None,
    }
}

/// Distance to `p` along a ray that is inside or outside it, and the number of the face that the ray meets.
fn meet(p: &WorldPrimitive, inside: bool, ray: &Ray) -> Option<(f64, usize)> {
    let on_it = ray.face == p.faces[0];
    match p.geometry {
        Geometry::Disk {
            center,
            normal,
            offset,
            radius,
        } => disk::intersect(center, normal, offset, radius, p.faces[0], ray).map(|t| (t, 0)),
        Geometry::Plane { normal, offset } => {
            plane::intersect(normal, offset, p.faces[0], inside, ray).map(|t| (t, 0))
        }
        Geometry::Sphere { center, radius } => {
            if inside {
                Some((sphere::leave(center, radius, on_it, ray), 0))
            } else if on_it {
                None
            } else {
                sphere::enter(center, radius, ray).map(|t| (t, 0))
            }
        }
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => {
            let huge = HugeSphere {
                pole,
                normal,
                radius,
            };
            if inside {
                Some((huge.leave(on_it, ray), 0))
            } else if on_it {
                None
            } else {
                huge.enter(ray).map(|t| (t, 0))
            }
        }
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => {
            let solid = Cylinder {
                base,
                axis,
                offsets,
                radius,
                faces: p.faces,
            };
            if inside {
                Some(solid.leave(ray))
            } else {
                solid.enter(ray)
            }
        }
        Geometry::Implicit(ref implicit) => {
            let on = (0..2).find(|&part| ray.face == p.faces[part]);
            implicit.meet(ray.origin, ray.direction, Start { inside, on })
        }
    }
}

/// Where `ray` meets face number `face` of `p`, at distance `t`: the point, moved onto the face, and the outward unit normal there.
fn surface(p: &WorldPrimitive, face: usize, ray: &Ray, t: f64) -> (DVec3, DVec3) {
    let point = ray.at(t);
    match p.geometry {
        Geometry::Implicit(ref implicit) => implicit.project(face, point, -ray.direction),
        Geometry::Disk { normal, offset, .. } | Geometry::Plane { normal, offset } => {
            (plane::project(normal, offset, point), normal)
        }
        Geometry::Sphere { center, radius } => sphere::project(center, radius, point),
        Geometry::HugeSphere {
            pole,
            normal,
            radius,
        } => HugeSphere {
            pole,
            normal,
            radius,
        }
        .project(point),
        Geometry::Cylinder {
            base,
            axis,
            offsets,
            radius,
        } => Cylinder {
            base,
            axis,
            offsets,
            radius,
            faces: p.faces,
        }
        .project(face, point),
    }
}
