//! Summarises measurements: means over seeds with their spread, efficiency, and the slope of the error.

use super::engines::EngineKind;
use super::measure::Measurement;
use serde::Serialize;

/// A mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// The standard deviation of a single seed's value; `None` with fewer than two seeds.
    pub sd: Option<f64>,
}

impl Spread {
    /// Of these values; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().collect();
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Some(Self {
            mean,
            sd: (n > 1.0).then(|| (squares / (n - 1.0)).sqrt()),
        })
    }

    /// The spread over the mean.
    pub fn relative(&self) -> Option<f64> {
        Some(self.sd? / self.mean.abs()).filter(|r| r.is_finite())
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            mean: f(self.mean),
            sd: self.sd.map(f),
        }
    }
}

/// One engine at one sample count.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Who.
    pub engine: EngineKind,
    /// Samples per pixel.
    pub samples: u64,
    /// How many seeds were measured.
    pub seeds: usize,
    /// Seconds of one picture in the engine, reading back included.
    pub seconds: Spread,
    /// Seconds of those that went into reading back.
    pub read_back: Spread,
    /// Camera paths over seconds.
    pub paths_per_second: Spread,
    /// Rays, shadow rays included, over seconds.
    pub rays_per_second: Spread,
    /// Rays, shadow rays included, over camera paths.
    pub rays_per_path: Spread,
    /// See [`Errors::mse`](super::Errors::mse).
    pub mse: Spread,
    /// What the pictures state of it; `None` while they state nothing.
    pub claimed_mse: Option<Spread>,
    /// See [`Errors::relative_mse`](super::Errors::relative_mse).
    pub relative_mse: Spread,
    /// See [`Errors::trimmed_relative_mse`](super::Errors::trimmed_relative_mse).
    pub trimmed_relative_mse: Spread,
    /// See [`Errors::flip`](super::Errors::flip).
    pub flip: Spread,
    /// √ of the relative MSE; `None` where it is not positive for some seed.
    pub true_relative_error: Option<Spread>,
    /// The relative error that the pictures state.
    pub claimed_relative_error: Option<Spread>,
    /// Its standard error, as the pictures state it.
    pub claimed_uncertainty: Option<Spread>,
    /// 1 / (mean MSE × mean seconds), with the spread of single seeds; `None` where the MSE is not positive.
    pub efficiency: Option<Spread>,
    /// Efficiency over that of the first engine, at the same samples or at the most it had; the spreads of both in
    /// quadrature.
    pub ratio: Option<Spread>,
}

/// Groups measurements into points, engines in the order of `engines`, samples rising.
pub fn points(engines: &[EngineKind], measurements: &[Measurement]) -> Vec<Point> {
    let mut all = Vec::new();
    for &engine in engines {
        let mine = || measurements.iter().filter(move |m| m.engine == engine);
        let mut counts: Vec<u64> = mine().map(|m| m.samples).collect();
        counts.sort_unstable();
        counts.dedup();
        for samples in counts {
            let group: Vec<&Measurement> = mine().filter(|m| m.samples == samples).collect();
            all.extend(point(&group));
        }
    }
    let first: Vec<(u64, Option<Spread>)> = all
        .iter()
        .filter(|p| Some(&p.engine) == engines.first())
        .map(|p| (p.samples, p.efficiency))
        .collect();
    for p in &mut all {
        let same = first.iter().find(|f| f.0 == p.samples);
        p.ratio = match same.or(first.last()) {
            _ if Some(&p.engine) == engines.first() => p.efficiency.map(|_| Spread {
                mean: 1.0,
                sd: None,
            }),
            Some((_, base)) => p.efficiency.zip(*base).map(|(a, b)| quotient(a, b)),
            None => None,
        };
    }
    all
}

fn quotient(a: Spread, b: Spread) -> Spread {
    let mean = a.mean / b.mean;
    Spread {
        mean,
        sd: a
            .relative()
            .zip(b.relative())
            .map(|(a, b)| mean * a.hypot(b)),
    }
}

fn point(group: &[&Measurement]) -> Option<Point> {
    let first = group.first()?;
    let spread = |f: &dyn Fn(&Measurement) -> f64| Spread::of(group.iter().map(|m| f(m)));
    let positive = |f: &dyn Fn(&Measurement) -> Option<f64>| {
        let values: Option<Vec<f64>> = group.iter().map(|m| f(m)).collect();
        Spread::of(values?)
    };
    let mse = spread(&|m| m.errors.mse)?;
    let seconds = spread(&|m| m.seconds)?;
    let single = positive(&|m| above_0(m.errors.mse).map(|mse| 1.0 / (mse * m.seconds)));
    Some(Point {
        engine: first.engine,
        samples: first.samples,
        seeds: group.len(),
        seconds,
        read_back: spread(&|m| m.read_back_seconds)?,
        paths_per_second: spread(&|m| m.counters.paths as f64 / m.seconds)?,
        rays_per_second: spread(&|m| m.counters.rays as f64 / m.seconds)?,
        rays_per_path: spread(&|m| m.counters.rays as f64 / m.counters.paths as f64)?,
        mse,
        claimed_mse: positive(&|m| m.errors.claimed_mse),
        relative_mse: spread(&|m| m.errors.relative_mse)?,
        trimmed_relative_mse: spread(&|m| m.errors.trimmed_relative_mse)?,
        flip: spread(&|m| m.errors.flip)?,
        true_relative_error: positive(&|m| above_0(m.errors.relative_mse).map(f64::sqrt)),
        claimed_relative_error: positive(&|m| m.errors.claimed_relative_error),
        claimed_uncertainty: positive(&|m| m.errors.claimed_uncertainty),
        efficiency: above_0(mse.mean * seconds.mean).map(|product| Spread {
            mean: 1.0 / product,
            sd: single.and_then(|s| s.sd),
        }),
        ratio: None,
    })
}

fn above_0(x: f64) -> Option<f64> {
    (x > 0.0 && x.is_finite()).then_some(x)
}

/// The slope of log √MSE against log seconds, by least squares for each seed. Plain Monte Carlo has -1/2. A better sampler
/// makes it steeper; a fixed cost per picture makes it flatter. `None` with fewer than three sample counts.
pub fn slope(engine: EngineKind, measurements: &[Measurement]) -> Option<Spread> {
    let mine = || measurements.iter().filter(move |m| m.engine == engine);
    let mut seeds: Vec<u32> = mine().map(|m| m.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let of_seed = |seed: u32| {
        let points: Vec<[f64; 2]> = mine()
            .filter(|m| m.seed == seed && m.errors.mse > 0.0 && m.seconds > 0.0)
            .map(|m| [m.seconds.ln(), 0.5 * m.errors.mse.ln()])
            .collect();
        (points.len() >= 3).then(|| least_squares(&points))?
    };
    Spread::of(seeds.into_iter().filter_map(of_seed))
}

/// The slope of the line through points x, y; `None` where all x are the same.
fn least_squares(points: &[[f64; 2]]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let (mut across, mut along) = (0.0, 0.0);
    for p in points {
        across += (p[0] - mean[0]).powi(2);
        along += (p[0] - mean[0]) * (p[1] - mean[1]);
    }
    above_0(across).map(|across| along / across)
}

/// Millions, for rates that people read.
pub fn millions(spread: Spread) -> Spread {
    spread.map(|x| x * 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Errors;
    use crate::engine::Counters;

    /// A picture whose MSE falls with the `power` of its seconds.
    fn one(engine: EngineKind, samples: u64, seed: u32, seconds: f64, power: f64) -> Measurement {
        let mse = f64::from(seed) * seconds.powf(power);
        Measurement {
            engine,
            samples,
            seed,
            seconds,
            read_back_seconds: 0.1 * seconds,
            counters: Counters {
                paths: 1000 * samples,
                rays: 5000 * samples,
                ..Counters::default()
            },
            errors: Errors {
                mse,
                relative_mse: 4.0 * mse,
                trimmed_relative_mse: mse,
                flip: 0.1,
                claimed_mse: None,
                claimed_relative_error: (samples > 4).then_some(0.5),
                claimed_uncertainty: (samples > 4).then_some(0.1),
            },
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    #[test]
    fn slope_of_a_synthetic_series() {
        let series = |power: f64| -> Vec<Measurement> {
            (0..6)
                .flat_map(|k| {
                    let samples = 1 << k;
                    (1..=3).map(move |seed| {
                        one(EngineKind::Cpu, samples, seed, 0.01 * samples as f64, power)
                    })
                })
                .collect()
        };
        for power in [-1.0, -1.5, 0.0] {
            let s = slope(EngineKind::Cpu, &series(power)).unwrap();
            assert!((s.mean - power / 2.0).abs() < 1e-12, "{power}: {s:?}");
            assert!(s.sd.unwrap() < 1e-12);
        }
        assert_eq!(slope(EngineKind::GpuBaked, &series(-1.0)), None);
        assert_eq!(
            slope(EngineKind::Cpu, &series(-1.0)[..6]),
            None,
            "two counts"
        );
    }

    #[test]
    fn points_have_means_spreads_and_ratios() {
        use EngineKind::{Cpu, GpuBaked};
        let mut all = Vec::new();
        for samples in [1, 2, 4, 8] {
            for seed in [1, 3] {
                all.push(one(GpuBaked, samples, seed, 0.01 * samples as f64, -1.0));
                if samples <= 2 {
                    all.push(one(Cpu, samples, seed, 0.04 * samples as f64, -1.0));
                }
            }
        }
        // Twice the error in the same time.
        for m in all.iter_mut().filter(|m| m.engine == Cpu) {
            m.errors.mse *= 2.0;
        }
        let points = points(&[GpuBaked, Cpu], &all);
        assert_eq!(points.len(), 6);
        let p = &points[3];
        assert_eq!((p.engine, p.samples, p.seeds), (GpuBaked, 8, 2));
        assert!(close(p.seconds.mean, 0.08) && close(p.read_back.mean, 0.008));
        assert!(close(p.paths_per_second.mean, 1e5) && close(p.rays_per_path.mean, 5.0));
        // MSE 12.5 and 37.5.
        assert!(close(p.mse.mean, 25.0) && close(p.mse.sd.unwrap(), 312.5f64.sqrt()));
        assert!(close(p.efficiency.unwrap().mean, 0.5));
        assert_eq!(p.claimed_relative_error.unwrap().mean, 0.5);
        assert_eq!(
            points[2].claimed_relative_error, None,
            "4 samples claim nothing"
        );
        assert_eq!(
            p.ratio,
            Some(Spread {
                mean: 1.0,
                sd: None
            })
        );
        assert!(close(points[5].ratio.unwrap().mean, 0.5));
        assert!(points[5].ratio.unwrap().sd.unwrap() > 0.0);
    }

    #[test]
    fn no_efficiency_for_pictures_no_better_than_the_reference() {
        let mut m = one(EngineKind::Cpu, 8, 1, 0.1, -1.0);
        (m.errors.mse, m.errors.relative_mse) = (-1e-9, -1e-9);
        let p = &points(&[EngineKind::Cpu], &[m])[0];
        assert_eq!(
            (p.efficiency, p.ratio, p.true_relative_error),
            (None, None, None)
        );
        assert_eq!(p.mse.sd, None);
    }
}
