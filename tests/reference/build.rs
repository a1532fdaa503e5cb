//! Scenes made in memory, and helpers to trace them.

use etendue::engine::{Counters, Engine};
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::reference::{CpuEngine, Estimator};
pub use etendue::selftest::build::*;
use etendue::settings::Settings;
use etendue::stats::luminance;
use etendue::world::trace::{Hit, Ray};
use etendue::world::{AIR, World};
use glam::DVec3;
use std::sync::atomic::AtomicBool;

pub const BOTH: [Estimator; 2] = [Estimator::LightSampling, Estimator::NoLightSampling];

/// A scene of 8 x 6 pixels.
pub fn small(eye: DVec3, look_at: DVec3, vfov: f64) -> Build {
    Build::new(eye, look_at, vfov).size(8, 6)
}

/// What is asked of a scene.
pub trait Ask {
    fn world(&self) -> World;
    /// A whole picture.
    fn render(&self, settings: &Settings, estimator: Estimator, samples: u64) -> (Film, Counters);
    /// Mean luminance of the picture, and its standard error.
    fn measure(&self, estimator: Estimator, samples: u64) -> Measured;
}

impl Ask for Build {
    fn world(&self) -> World {
        World::new(&self.0, self.0.camera.resolution)
    }

    fn render(&self, settings: &Settings, estimator: Estimator, samples: u64) -> (Film, Counters) {
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

    fn measure(&self, estimator: Estimator, samples: u64) -> Measured {
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

/// The ray that continues from a hit.
pub fn from_hit(hit: &Hit, direction: DVec3, medium: u32) -> Ray {
    Ray {
        origin: hit.point,
        direction: direction.normalize(),
        medium,
        face: hit.face,
    }
}
