//! An engine that makes hashes instead of light.

use super::*;
use crate::engine::DeviceInfo;
use crate::film::Sums;
use crate::film::splats::SplatSetup;

/// An engine whose pixels are noise that depends on pixel and sample number alone; notes its calls.
pub struct Fake {
    pub device: DeviceInfo,
    pub calls: Vec<Vec<Part>>,
    pub nap: Duration,
    /// How much longer the first call takes.
    pub slow_start: Duration,
    pub fail_at: Option<usize>,
    pub seed: u32,
    /// Whether it ignores `reseed` and keeps its seed.
    pub deaf: bool,
    /// Whether it traces light paths.
    pub light: bool,
    pub value: fn(u64) -> f64,
}

impl Fake {
    pub fn new() -> Self {
        Self {
            device: DeviceInfo {
                name: "fake".into(),
                driver: String::new(),
                backend: "cpu".into(),
                software: true,
            },
            calls: Vec::new(),
            nap: Duration::ZERO,
            slow_start: Duration::ZERO,
            fail_at: None,
            seed: 0,
            deaf: false,
            light: false,
            value: |h| (h >> 40) as f64 / (1u64 << 24) as f64,
        }
    }

    /// Adds samples to a film.
    fn add(&self, film: &mut Film, rect: Rect, samples: Range<u64>) {
        let round = u64::from(film.strata * film.strata);
        film.put_block(rect, samples.clone(), |_, _| [[0.0; 4]; REPLICATES]);
        let pixels = (rect.y0..rect.y1)
            .flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)))
            .map(|(x, y)| {
                let mut sums: [Sums<f64>; REPLICATES] = film.sums()[film.index(x, y)];
                for s in samples.clone() {
                    let v = (self.value)(noise(self.seed, x, y, s));
                    let r = &mut sums[(s / round) as usize % REPLICATES];
                    *r = [r[0] + v, r[1] + v, r[2] + v, r[3] + v * v];
                }
                sums
            });
        let (pixels, coverage) = (pixels.collect::<Vec<_>>(), film.coverage.clone());
        film.coverage = Coverage::default();
        film.put_samples(rect, samples, pixels);
        film.coverage = coverage;
    }

    /// Paths of all calls.
    pub fn paths(&self) -> u64 {
        self.calls.iter().flatten().map(Part::paths).sum()
    }
}

/// Bits from a seed, a pixel and a sample.
fn noise(seed: u32, x: u32, y: u32, s: u64) -> u64 {
    let h = (u64::from(x) << 40 ^ u64::from(y) << 20 ^ s).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let h = (h ^ (h >> 29)).wrapping_add(u64::from(seed).wrapping_mul(0x94d0_49bb_1331_11eb));
    let h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb)
}

impl Engine for Fake {
    fn render_parts(
        &mut self,
        film: &mut Film,
        tile: Rect,
        parts: &[Part],
        stop: &AtomicBool,
    ) -> Result<Counters, EngineError> {
        assert!(tile.area() <= MAX_TILE_PIXELS && !parts.is_empty());
        let rects: Vec<Rect> = parts.iter().map(|p| p.rect).collect();
        let area: u64 = rects.iter().map(Rect::area).sum();
        let apart: u64 = Rect::disjoint(&rects).iter().map(Rect::area).sum();
        assert_eq!(area, apart, "parts overlap");
        for Part { rect, samples } in parts {
            assert_eq!(rect.intersection(&tile), Some(*rect));
            assert_eq!(samples.start / BLOCK, (samples.end - 1) / BLOCK);
            assert!(film.coverage.overlap(*rect, samples).is_none());
        }
        if stop.load(Ordering::Relaxed) {
            return Err(EngineError::Stopped);
        }
        if self.fail_at == Some(self.calls.len()) {
            return Err(EngineError::Device("lost".into()));
        }
        std::thread::sleep(self.nap);
        if self.calls.is_empty() {
            std::thread::sleep(self.slow_start);
        }
        for part in parts {
            self.add(film, part.rect, part.samples.clone());
        }
        self.calls.push(parts.to_vec());
        Ok(Counters {
            paths: parts.iter().map(Part::paths).sum(),
            ..Counters::default()
        })
    }

    fn light_paths(&self) -> Option<SplatSetup> {
        self.light.then_some(SplatSetup {
            paths: 64,
            scale: 1.0,
        })
    }

    fn trace_light(
        &mut self,
        passes: Range<u64>,
        stop: &AtomicBool,
    ) -> Result<(Vec<Splat>, Counters), EngineError> {
        if stop.load(Ordering::Relaxed) {
            return Err(EngineError::Stopped);
        }
        // Wider than the films of these tests.
        let splat = |pass: u64, k: u32| {
            let value = noise(self.seed, k, 0, pass) as f32 * (-64f32).exp2();
            Splat::new(
                [k % 7, k % 5],
                7,
                (pass / 4) as usize % REPLICATES,
                [value; 3],
            )
        };
        let splats = passes.flat_map(|pass| (0..9).map(move |k| splat(pass, k)));
        Ok((splats.collect(), Counters::default()))
    }

    fn reseed(&mut self, seed: u32) {
        if !self.deaf {
            self.seed = seed;
        }
    }

    fn device(&self) -> &DeviceInfo {
        &self.device
    }
}
