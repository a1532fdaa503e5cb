//! Scenes made in memory, and what is asked of them.

use etendue::engine::{Counters, Engine};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::reference::{CpuEngine, Estimator, Hit, Ray, Tracer};
use etendue::scene::{Bsdf, Camera, Light, Material, Primitive, RenderHints, Scene, Shape};
use etendue::settings::{Overrides, Settings};
use etendue::stats::luminance;
use etendue::world::{AIR, World};
use glam::DVec3;
use std::sync::atomic::AtomicBool;

pub const GLASS: Bsdf = Bsdf::Dielectric {
    ior: 1.52,
    transmittance: DVec3::ONE,
};
pub const MIRROR: Bsdf = Bsdf::Mirror {
    reflectance: DVec3::ONE,
};
pub const BOTH: [Estimator; 2] = [Estimator::LightSampling, Estimator::NoLightSampling];

pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub fn grey(reflectance: f64) -> Bsdf {
    Bsdf::Diffuse {
        reflectance: DVec3::splat(reflectance),
    }
}

pub fn sphere(center: DVec3, radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

pub fn plane(point: DVec3, normal: DVec3) -> Shape {
    Shape::Plane { point, normal }
}

pub fn disk(center: DVec3, normal: DVec3, radius: f64) -> Shape {
    Shape::Disk {
        center,
        normal,
        radius,
    }
}

pub fn cylinder(base: DVec3, top: DVec3, radius: f64) -> Shape {
    Shape::Cylinder { base, top, radius }
}

/// A scene under construction.
#[derive(Clone)]
pub struct Build(pub Scene);

impl Build {
    /// Nothing but a camera, 8 x 6 pixels.
    pub fn new(eye: DVec3, look_at: DVec3, vfov: f64) -> Self {
        let forward = look_at - eye;
        let up = if forward.cross(DVec3::Y).length() > 1e-6 * forward.length() {
            DVec3::Y
        } else {
            DVec3::Z
        };
        Self(Scene {
            path: Default::default(),
            title: None,
            camera: Camera {
                eye,
                look_at,
                up,
                vfov,
                resolution: [8, 6],
            },
            render: RenderHints::default(),
            materials: Vec::new(),
            primitives: Vec::new(),
            lights: Vec::new(),
        })
    }

    pub fn add(mut self, shape: Shape, bsdf: Bsdf) -> Self {
        self.0.primitives.push(Primitive {
            shape,
            material: self.0.materials.len(),
            line: 0,
        });
        self.0.materials.push(Material {
            name: String::new(),
            bsdf,
        });
        self
    }

    pub fn light(mut self, center: DVec3, normal: DVec3, radius: f64, radiance: f64) -> Self {
        self.0.lights.push(Light {
            center,
            normal: normal.normalize(),
            radius,
            radiance: DVec3::splat(radiance),
            line: 0,
        });
        self
    }

    /// One stratum, so that the samples of a pixel are independent and their variance is their own.
    pub fn settings(&self) -> Settings {
        Settings {
            strata: 1,
            max_depth: 500,
            ..Settings::resolve(&self.0, &Overrides::default())
        }
    }

    pub fn world(&self) -> World {
        World::new(&self.0, self.0.camera.resolution)
    }

    pub fn tracer(&self) -> Tracer {
        Tracer::new(self.world(), self.settings(), Estimator::LightSampling)
    }

    /// A whole picture.
    pub fn render(
        &self,
        settings: &Settings,
        estimator: Estimator,
        samples: u64,
    ) -> (Film, Counters) {
        let size = settings.size;
        let mut film = Film::new(size, Rect::whole(size), settings.strata);
        let mut engine = CpuEngine::new(World::new(&self.0, size), settings.clone(), estimator);
        let stop = AtomicBool::new(false);
        let counters = engine
            .render(&mut film, Rect::whole(size), 0..samples, &stop)
            .unwrap();
        assert_eq!(counters.nonfinite, 0);
        (film, counters)
    }

    /// Mean luminance of the picture, and its standard error.
    pub fn measure(&self, estimator: Estimator, samples: u64) -> Measured {
        let (film, _) = self.render(&self.settings(), estimator, samples);
        measured(&film, Rect::whole(film.size), samples)
    }
}

/// A mean and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    pub mean: f64,
    pub error: f64,
}

impl Measured {
    /// Panics unless `expected` is within 4.5 standard errors (false alarms: 7·10⁻⁶ each, 3·10⁻³ for the
    /// 400 comparisons of this program together), and unless those are at most `precision`; 10⁻¹² stands for
    /// the rounding of sums that have no variance.
    pub fn assert_is(&self, what: &str, expected: f64, precision: f64) {
        assert!(
            (self.mean - expected).abs() <= 4.5 * self.error + 1e-12,
            "{what}: {self:?}, expected {expected}"
        );
        assert!(
            4.5 * self.error <= precision,
            "{what}: {self:?} is too noisy to show anything"
        );
    }
}

/// Mean luminance over `rect` of a film whose pixels have `samples` independent samples each.
pub fn measured(film: &Film, rect: Rect, samples: u64) -> Measured {
    let n = samples as f64;
    let pixels = rect.area() as f64;
    let (mut sum, mut variance) = (0.0, 0.0);
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            let total = film.total(x, y);
            let mean = total
                .iter()
                .map(|s| luminance([s[0], s[1], s[2]]))
                .sum::<f64>()
                / n;
            let square = total.iter().map(|s| s[3]).sum::<f64>() / n;
            sum += mean;
            variance += (square - mean * mean).max(0.0) / n;
        }
    }
    Measured {
        mean: sum / pixels,
        error: variance.sqrt() / pixels,
    }
}

/// A ray from free space in air.
pub fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray {
        origin,
        direction: direction.normalize(),
        medium: AIR,
        face: 0,
    }
}

/// The ray that goes on from a hit.
pub fn from_hit(hit: &Hit, direction: DVec3, medium: u32) -> Ray {
    Ray {
        origin: hit.point,
        direction: direction.normalize(),
        medium,
        face: hit.face,
    }
}
