//! The interface of all engines: GPU and CPU reference.

use crate::film::Film;
use crate::film::coverage::Rect;
use crate::film::splats::{Passes, Splat, SplatSetup};
use std::ops::{AddAssign, Range};
use std::sync::atomic::AtomicBool;

/// Most pixels in one call to an engine; larger pictures are tiled.
pub const MAX_TILE_PIXELS: u64 = 1 << 20;

/// Most pixels in one call to an engine on this device. The CPU reference gets few, so that one sample of each takes a fraction
/// of a second. A software adapter gets few, so that a call takes many samples per pixel and its lanes wait less for
/// each other's longer paths.
pub fn tile_pixels(device: &DeviceInfo) -> u64 {
    match (device.backend.as_str(), device.software) {
        ("cpu", _) => 1 << 16,
        (_, true) => 1 << 14,
        _ => MAX_TILE_PIXELS,
    }
}

/// Samples of the pixels of a rectangle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The pixels.
    pub rect: Rect,
    /// The numbers of the samples of each: at least one.
    pub samples: Range<u64>,
}

impl Part {
    /// Paths: samples times pixels.
    pub fn paths(&self) -> u64 {
        self.rect.area() * (self.samples.end - self.samples.start)
    }
}

/// Takes samples.
pub trait Engine {
    /// Adds the samples of `parts` to `film`. Each part has its own sample numbers; pixels of `tile` outside all parts get no
    /// samples.
    ///
    /// The parts are disjoint and lie in `tile`, which has at most [`MAX_TILE_PIXELS`] pixels. Consecutive calls for the same
    /// tile are cheapest. The samples of a part lie within one [block](crate::film::BLOCK). All pixels of a part have the same
    /// earlier samples of that block, and none of these. When `stop` becomes true, the call may return
    /// [`EngineError::Stopped`]. After an error the film is unchanged.
    fn render_parts(
        &mut self,
        film: &mut Film,
        tile: Rect,
        parts: &[Part],
        stop: &AtomicBool,
    ) -> Result<Counters, EngineError>;

    /// [`render_parts`](Self::render_parts) with a single part, of all pixels of `rect`, and the same numbers of passes of light paths, if
    /// the engine has any.
    fn render(
        &mut self,
        film: &mut Film,
        rect: Rect,
        samples: Range<u64>,
        stop: &AtomicBool,
    ) -> Result<Counters, EngineError> {
        let mut counters = Counters::default();
        if let Some(setup) = self.light_paths()
            && film.splats().is_none()
        {
            film.begin_splats(setup);
        }
        let mut traced = Vec::new();
        for (passes, rects) in film.lacking_passes(&[rect], samples.clone()) {
            let (splats, more) = self.trace_light(passes.clone(), stop)?;
            counters += more;
            let width = film.size[0];
            traced.push((Passes::new(passes, width, splats), rects));
        }
        counters += self.render_parts(film, rect, &[Part { rect, samples }], stop)?;
        for (passes, rects) in traced {
            rects.into_iter().for_each(|r| film.put_passes(r, &passes));
        }
        Ok(counters)
    }

    /// What passes of light paths add to a film; `None` if samples are the whole picture.
    fn light_paths(&self) -> Option<SplatSetup> {
        None
    }

    /// Traces `passes` of light paths, and gives all their splats, for [`Film::put_passes`]. Every pass brings light to the whole picture,
    /// so the work does not depend on which pixels are wanted. When `stop` becomes true, the call may return [`EngineError::Stopped`].
    fn trace_light(
        &mut self,
        passes: Range<u64>,
        stop: &AtomicBool,
    ) -> Result<(Vec<Splat>, Counters), EngineError> {
        let _ = (passes, stop);
        Ok((Vec::new(), Counters::default()))
    }

    /// Changes the seed of later samples.
    fn reseed(&mut self, seed: u32);

    /// What it runs on.
    fn device(&self) -> &DeviceInfo;
}

/// The device that rendered a picture.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct DeviceInfo {
    /// The adapter's name, or the CPU reference's.
    pub name: String,
    /// Driver and version.
    pub driver: String,
    /// `gpu` or `cpu`: the `--backend` that chooses it.
    pub backend: String,
    /// Whether it is a software adapter.
    pub software: bool,
}

impl DeviceInfo {
    /// Name, kind and driver in few words: `llvmpipe (software, Mesa 22.3.6)`.
    pub fn brief(&self) -> String {
        fn first(text: &str) -> &str {
            text.split(" (").next().unwrap_or(text)
        }
        let (name, driver) = (first(&self.name), first(&self.driver));
        let driver = driver.strip_prefix(name).unwrap_or(driver).trim();
        let is_software_adapter = self.software && self.backend != "cpu";
        let kind = is_software_adapter.then_some("software");
        let kind_and_driver: Vec<&str> = kind
            .into_iter()
            .chain(Some(driver).filter(|driver| !driver.is_empty()))
            .collect();
        match kind_and_driver[..] {
            [] => name.into(),
            _ => format!("{name} ({})", kind_and_driver.join(", ")),
        }
    }

    /// Whether samples have the same bits on both devices. The CPU reference's number of threads does not matter.
    pub fn rounds_like(&self, other: &Self) -> bool {
        // llvmpipe names the width of its vectors, which changes no bit.
        fn name(device: &DeviceInfo) -> &str {
            let width = device.name.rsplit_once(", ");
            let width = width.filter(|(_, rest)| rest.ends_with(" bits)"));
            width.map_or(&device.name, |(name, _)| name)
        }
        (name(self), &self.backend) == (name(other), &other.backend)
            && (self.backend == "cpu" || self.driver == other.driver)
    }
}

/// Counts over a call or a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct Counters {
    /// Camera paths: samples times pixels.
    pub paths: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Paths cut at max_depth.
    pub truncated: u64,
    /// Light paths.
    #[serde(default)]
    pub light_paths: u64,
    /// Samples left out because they were NaN or infinite.
    pub nonfinite: u64,
    /// Pixel x, y and number of the first of those.
    pub first_nonfinite: Option<(u32, u32, u64)>,
}

impl AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.truncated += other.truncated;
        self.light_paths += other.light_paths;
        self.nonfinite += other.nonfinite;
        self.first_nonfinite = self.first_nonfinite.or(other.first_nonfinite);
    }
}

/// Why an engine gave up.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineError {
    /// `stop` was set.
    #[error("stopped")]
    Stopped,
    /// The device was lost, ran out of memory, or misbehaved.
    #[error("{0}")]
    Device(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_named_in_few_words() {
        for (name, driver, backend, software, brief) in [
            (
                "llvmpipe (LLVM 15.0.6, 512 bits)",
                "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)",
                "gpu",
                true,
                "llvmpipe (software, Mesa 22.3.6)",
            ),
            (
                "NVIDIA H200",
                "NVIDIA 550.54.15",
                "gpu",
                false,
                "NVIDIA H200 (NVIDIA 550.54.15)",
            ),
            (
                "AMD Radeon RX 6800 (RADV NAVI21)",
                "radv Mesa 24.0.1",
                "gpu",
                false,
                "AMD Radeon RX 6800 (radv Mesa 24.0.1)",
            ),
            (
                "CPU reference (f64)",
                "2 threads",
                "cpu",
                true,
                "CPU reference (2 threads)",
            ),
            ("X", "", "gpu", false, "X"),
        ] {
            let device = DeviceInfo {
                name: name.into(),
                driver: driver.into(),
                backend: backend.into(),
                software,
            };
            assert_eq!(device.brief(), brief);
        }
    }

    #[test]
    fn the_width_of_vectors_changes_no_bit() {
        let device = |name: &str, driver: &str| DeviceInfo {
            name: name.into(),
            driver: driver.into(),
            backend: "gpu".into(),
            software: true,
        };
        let wide = device("llvmpipe (LLVM 15.0.6, 512 bits)", "Mesa 22.3.6");
        assert!(wide.rounds_like(&device("llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa 22.3.6")));
        assert!(!wide.rounds_like(&device("llvmpipe (LLVM 15.0.7, 512 bits)", "Mesa 22.3.6")));
        assert!(!wide.rounds_like(&device("llvmpipe (LLVM 15.0.6, 512 bits)", "Mesa 22.3.7")));
    }
}
