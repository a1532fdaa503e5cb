//! Scenes made in memory, for the cases and for tests.

use crate::scene::{Bsdf, Camera, Light, Material, Place, Primitive, RenderHints, Scene, Shape};
use crate::settings::{Overrides, Settings};
use glam::DVec3;

/// Clear glass of index 1.52 in air.
pub const GLASS: Bsdf = Bsdf::Dielectric {
    ior: 1.52,
    transmittance: DVec3::ONE,
};
/// An air bubble in such glass.
pub const AIR_IN_GLASS: Bsdf = Bsdf::Dielectric {
    ior: 1.0 / 1.52,
    transmittance: DVec3::ONE,
};
/// A mirror that loses nothing.
pub const MIRROR: Bsdf = Bsdf::Mirror {
    reflectance: DVec3::ONE,
};

/// A vector.
pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Diffuse, the same reflectance in every channel.
pub fn grey(reflectance: f64) -> Bsdf {
    Bsdf::Diffuse {
        reflectance: DVec3::splat(reflectance),
    }
}

/// A sphere.
pub fn sphere(center: DVec3, radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

/// An infinite plane; `normal` has unit length.
pub fn plane(point: DVec3, normal: DVec3) -> Shape {
    Shape::Plane { point, normal }
}

/// A disk; `normal` of any length.
pub fn disk(center: DVec3, normal: DVec3, radius: f64) -> Shape {
    Shape::Disk {
        center,
        normal: normal.normalize(),
        radius,
    }
}

/// A capped cylinder between the centres of its caps.
pub fn cylinder(base: DVec3, top: DVec3, radius: f64) -> Shape {
    Shape::Cylinder { base, top, radius }
}

/// A scene under construction.
#[derive(Clone)]
pub struct Build(pub Scene);

impl Build {
    /// Nothing but a camera, 48 x 36 pixels.
    pub fn new(eye: DVec3, look_at: DVec3, vfov: f64) -> Self {
        let forward = look_at - eye;
        let up = if forward.cross(DVec3::Y).length() > 1e-3 * forward.length() {
            DVec3::Y
        } else {
            DVec3::Z
        };
        Self(Scene {
            path: Default::default(),
            row_files: Vec::new(),
            title: None,
            camera: Camera {
                eye,
                look_at,
                up,
                vfov,
                resolution: [48, 36],
            },
            render: RenderHints::default(),
            materials: Vec::new(),
            primitives: Vec::new(),
            lights: Vec::new(),
        })
    }

    /// Another size in pixels.
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.0.camera.resolution = [width, height];
        self
    }

    /// Adds a thing with a material of its own.
    pub fn add(mut self, shape: Shape, bsdf: Bsdf) -> Self {
        self.0.primitives.push(Primitive {
            shape,
            material: self.0.materials.len(),
            line: 0,
            column: 0,
        });
        self.0.materials.push(Material {
            name: String::new(),
            bsdf,
            place: Place::default(),
        });
        self
    }

    /// Adds several.
    pub fn add_all(self, things: &[(Shape, Bsdf)]) -> Self {
        things.iter().fold(self, |b, (s, m)| b.add(s.clone(), *m))
    }

    /// Adds a disk light; `normal` of any length, `radiance` the same in every channel.
    pub fn light(mut self, center: DVec3, normal: DVec3, radius: f64, radiance: f64) -> Self {
        self.0.lights.push(Light {
            center,
            normal: normal.normalize(),
            radius,
            radiance: DVec3::splat(radiance),
            line: 0,
            column: 0,
        });
        self
    }

    /// Independent samples, one stratum, so that their variance is their own; paths as long as they like.
    pub fn settings(&self) -> Settings {
        Settings {
            strata: 1,
            max_depth: 1500,
            // The errors of measured values are those of independent samples, but one light path may reach many pixels.
            light_paths: false,
            ..Settings::resolve(&self.0, &Overrides::default())
        }
    }

    /// The same for paths of at most `max_depth` vertices.
    pub fn depth(&self, max_depth: u32) -> Settings {
        Settings {
            max_depth,
            ..self.settings()
        }
    }
}
