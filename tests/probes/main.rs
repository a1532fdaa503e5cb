//! Functions of the shader modules, run on the adapter, against their f64 twins and closed forms.

#[path = "../common/mod.rs"]
mod common;
mod lights;

use etendue::gpu::probe::{UNWRITTEN, Uniform, Values, run};
use etendue::gpu::{Choice, Gpu};
use etendue::kernel::ProbeFeatures;
use etendue::world::trace::dielectric;
use glam::DVec3;
use std::sync::LazyLock;

static GPU: LazyLock<Gpu> = LazyLock::new(|| {
    let gpu = Gpu::open(&Choice::default()).unwrap_or_else(|e| panic!("{e}"));
    println!("adapter: {:?}", gpu.info());
    gpu
});

fn probe(body: &str, inputs: &[Values]) -> Vec<Values> {
    probe_with(&ProbeFeatures::default(), body, inputs)
}

fn probe_with(features: &ProbeFeatures, body: &str, inputs: &[Values]) -> Vec<Values> {
    let out = run(&GPU, features, body, inputs).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(out.len(), inputs.len());
    assert!(
        out.iter().all(|y| y[0] != UNWRITTEN),
        "an invocation wrote nothing"
    );
    out
}

/// Deterministic uniform numbers for inputs.
struct Numbers(Uniform);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0.next() as f32
    }

    fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.next()
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(
                self.between(-1.0, 1.0).into(),
                self.between(-1.0, 1.0).into(),
                self.between(-1.0, 1.0).into(),
            );
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize().as_vec3().as_dvec3().normalize();
            }
        }
    }
}

fn vector(y: &Values, at: usize) -> DVec3 {
    DVec3::new(y[at].into(), y[at + 1].into(), y[at + 2].into())
}

const RAY: &str =
    "let ray = Ray(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]), NO_FACE, 0u, NO_FACE);\n";

fn ray_inputs(n: usize, seed: u64) -> Vec<Values> {
    let mut r = Numbers(Uniform(seed));
    (0..n)
        .map(|_| {
            let mut x = [0.0; 16];
            let d = r.direction();
            for k in 0..3 {
                x[k] = r.between(-3.0, 3.0);
                x[3 + k] = d[k] as f32;
            }
            x
        })
        .collect()
}

#[test]
fn spheres_are_met_where_f64_meets_them() {
    let inputs = ray_inputs(200_000, 1);
    let body = format!(
        "{RAY} let s = Sphere(vec3f(0.3, -0.2, 0.1), 0.7); let a = sphere_outside(Hit(FAR, NONE), ray, s, 9u, 1u);\n
         y[0] = select(a.t, -1.0, a.key == NONE);
         let b = sphere_shadow(Hit(1.5, NONE), ray, s, 9u, 1u); y[1] = select(0.0, 1.0, b.key != NONE);
         let c = sphere_inside(Hit(FAR, NONE), ray, s, 9u, 1u); y[2] = c.t;"
    );
    let (mut hits, mut inside) = (0, 0);
    for (x, y) in inputs.iter().zip(probe(&body, &inputs)) {
        let (o, d) = (vector(x, 0), vector(x, 3));
        let center = DVec3::new(0.3f32.into(), (-0.2f32).into(), 0.1f32.into());
        let r = f64::from(0.7f32);
        let f = o - center;
        let b = -f.dot(d);
        let disc = r * r - (f + d * b).length_squared();
        if f.length() < r {
            inside += 1;
            let t = b + disc.sqrt();
            assert!(
                (f64::from(y[2]) - t).abs() < 2e-6,
                "leaving: {x:?} {y:?} {t}"
            );
        } else if disc.abs() > 1e-5 {
            let t = b - disc.max(0.0).sqrt();
            let met = disc > 0.0 && b > 0.0;
            assert_eq!(y[0] >= 0.0, met, "{x:?} {y:?}");
            if met {
                hits += 1;
                // Near the edge the square root magnifies the rounding of the discriminant.
                let tolerance = 2e-6 + 1e-6 / disc.sqrt();
                assert!(
                    (f64::from(y[0]) - t).abs() < tolerance,
                    "{x:?}: {} instead of {t}",
                    y[0]
                );
                if (t - 1.5).abs() > 1e-4 {
                    assert_eq!(y[1] == 1.0, t < 1.5, "shadow: {x:?} {t}");
                }
            }
        }
    }
    assert!(
        hits > 4_000 && inside > 1_000,
        "{hits} hits, {inside} inside"
    );
}

#[test]
fn cylinders_are_met_where_f64_meets_them() {
    let inputs = ray_inputs(200_000, 2);
    let body = format!(
        "{RAY} let c = Cylinder(vec3f(0.0, -0.5, 0.0), 0.6, vec3f(0.0, 1.0, 0.0), vec2f(-0.5, 0.75));
         let a = cylinder_outside(Hit(FAR, NONE), ray, c, 4u, 5u, 6u, 4u);
         y[0] = select(a.t, -1.0, a.key == NONE); y[1] = f32(a.key & 3u);
         let b = cylinder_inside(Hit(FAR, NONE), ray, c, 4u, 5u, 6u, 4u); y[2] = b.t; y[3] = f32(b.key & 3u);"
    );
    let mut seen = [0; 6];
    for (x, y) in inputs.iter().zip(probe(&body, &inputs)) {
        let (o, d) = (vector(x, 0), vector(x, 3));
        // Textbook: all crossings with side and caps, in f64.
        let r = f64::from(0.6f32);
        let mut crossings: Vec<(f64, usize)> = Vec::new();
        let (a, b) = (d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z);
        let disc = b * b - a * (o.x * o.x + o.z * o.z - r * r);
        if disc > 0.0 {
            for s in [-1.0, 1.0] {
                let t = (-b + s * disc.sqrt()) / a;
                let h = o.y + t * d.y;
                if h > -0.5 && h < 0.75 {
                    crossings.push((t, 0));
                }
            }
        }
        for (h, part) in [(-0.5, 1), (0.75, 2)] {
            let t = (h - o.y) / d.y;
            let p = o + d * t;
            if p.x * p.x + p.z * p.z < r * r {
                crossings.push((t, part));
            }
        }
        let inside = o.y > -0.5 && o.y < 0.75 && o.x.hypot(o.z) < r;
        crossings.retain(|c| c.0 > 0.0);
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Rims and tangents, where a hair decides, are for the hard cases.
        let delicate = crossings.iter().any(|c| {
            let p = o + d * c.0;
            (p.x.hypot(p.z) - r).abs() + (p.y + 0.5).abs().min((p.y - 0.75).abs()) < 1e-4
        }) || disc.abs() < 1e-5;
        if delicate {
            continue;
        }
        if inside {
            let (t, part) = crossings[0];
            seen[3 + part] += 1;
            assert!(
                (f64::from(y[2]) - t).abs() < 1e-5 && y[3] as usize == part,
                "{x:?} {y:?} {t} {part}"
            );
        } else if let Some(&(t, part)) = crossings.first() {
            seen[part] += 1;
            assert!(
                (f64::from(y[0]) - t).abs() < 1e-5 && y[1] as usize == part,
                "{x:?} {y:?} {t} {part}"
            );
        } else {
            assert!(y[0] < 0.0, "{x:?} {y:?}");
        }
    }
    assert!(
        seen.iter().all(|n| *n > 150),
        "side, base, top from outside and inside: {seen:?}"
    );
}

#[test]
fn fresnel_is_that_of_f64() {
    let mut r = Numbers(Uniform(3));
    let inputs: Vec<Values> = (0..50_000)
        .map(|i| {
            let mut x = [0.0; 16];
            // Every tenth close to grazing.
            x[0] = if i % 10 == 0 {
                10f32.powf(r.between(-6.0, -1.0))
            } else {
                r.between(1e-3, 1.0)
            };
            x[1] = [1.52, 1.0 / 1.52, 1.33, 2.4][i % 4];
            x
        })
        .collect();
    let body = "let f = refraction(x[0], x[1]); y[0] = f.transmitted; y[1] = f.cos_t;";
    for (x, y) in inputs.iter().zip(probe(body, &inputs)) {
        let expected = dielectric::fresnel(x[0].into(), x[1].into()).transmittance;
        // At the critical angle transmission rises like a square root: compare in its square there.
        let (a, b) = (f64::from(y[0]), expected);
        assert!((0.0..=1.000_001).contains(&a), "{x:?} {y:?}");
        assert!(
            (a - b).abs() <= 2e-5 * b + 1e-7 || (a * a - b * b).abs() < 2e-6,
            "{x:?}: {a} instead of {b}"
        );
    }
}

#[test]
fn phong_power_keeps_its_digits() {
    let mut r = Numbers(Uniform(4));
    for exponent in [0.0f32, 1.0, 10.0, 1e3, 1e5] {
        let inputs: Vec<Values> = (0..20_000)
            .map(|_| {
                let mut x = [0.0; 16];
                // Angles at which the power is between 1 and 10⁻⁹.
                let u = f64::from(r.next()).max(1e-9);
                let cos = u.powf(1.0 / (f64::from(exponent) + 1.0));
                let axis = r.direction();
                let side = axis.any_orthonormal_vector();
                let w = axis * cos + side * (1.0 - cos * cos).sqrt();
                for k in 0..3 {
                    x[k] = w[k] as f32;
                    x[3 + k] = axis[k] as f32;
                }
                x[6] = exponent;
                x
            })
            .collect();
        let body = "y[0] = phong_power(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]), x[6]);";
        for (x, y) in inputs.iter().zip(probe(body, &inputs)) {
            // The inputs are rounded to f32: the f64 twin starts from the same.
            let half = (vector(x, 0) - vector(x, 3)).length_squared() / 2.0;
            let expected = (f64::from(exponent) * (-half).ln_1p()).exp();
            // One part in 10⁷ of the squared difference, carried through log and power.
            let tolerance = 1e-5 + 3e-7 * f64::from(exponent) * half / (1.0 - half);
            assert!(
                (f64::from(y[0]) / expected - 1.0).abs() < tolerance,
                "n {exponent}: {} instead of {expected}",
                y[0]
            );
        }
    }
}

/// Pearson's χ² of counts that should be even, as a z-score (the normal limit for many bins).
fn chi_square_z(counts: &[u32]) -> f64 {
    let n: f64 = counts.iter().map(|c| f64::from(*c)).sum();
    let expected = n / counts.len() as f64;
    assert!(expected > 50.0);
    let chi2: f64 = counts
        .iter()
        .map(|c| (f64::from(*c) - expected).powi(2) / expected)
        .sum();
    let dof = counts.len() as f64 - 1.0;
    (chi2 - dof) / (2.0 * dof).sqrt()
}

/// A χ² z-score beyond this has probability below 10⁻⁶.
const LIMIT: f64 = 5.5;

#[test]
fn random_numbers_are_even_in_pairs() {
    let n = 1 << 20;
    let inputs: Vec<Values> = (0..n)
        .map(|i: u32| {
            let mut x = [0.0; 16];
            // Pixel, sample, dimension: what neighbouring draws differ in.
            (x[0], x[1], x[2]) = ((i % 64) as f32, (i / 64 % 256) as f32, (i / 16384) as f32);
            x
        })
        .collect();
    let body = "let d = draw(vec4u(u32(x[0]), u32(x[1]), u32(x[2]), 7u));
        y[0] = d.light_point.x; y[1] = d.light_point.y; y[2] = d.direction.x; y[3] = d.direction.y;
        y[4] = d.light; y[5] = d.lobe; y[6] = d.roulette; y[7] = d.spare;";
    let out = probe(body, &inputs);
    for a in 0..8 {
        for b in 0..a {
            let mut counts = vec![0u32; 32 * 32];
            for y in &out {
                assert!(y[a] < 1.0 && y[a] >= 0.0);
                counts[(y[a] * 32.0) as usize * 32 + (y[b] * 32.0) as usize] += 1;
            }
            let z = chi_square_z(&counts);
            assert!(z.abs() < LIMIT, "numbers {a} and {b}: z = {z}");
        }
    }
}

#[test]
fn directions_follow_their_densities() {
    let mut r = Numbers(Uniform(6));
    let n = 1 << 19;
    let inputs: Vec<Values> = (0..n)
        .map(|_| {
            let mut x = [0.0; 16];
            (x[0], x[1]) = (r.next(), r.next());
            x
        })
        .collect();
    let frame = "let n = normalize(vec3f(0.3, -0.5, 0.7)); let a = normalize(cross(n, vec3f(1.0, 0.0, 0.0))); let b = cross(n, a);\n";
    for exponent in [None, Some(0.0), Some(1.0), Some(60.0), Some(1e5)] {
        let sample = match exponent {
            None => "let d = sample_cosine(n, vec2f(x[0], x[1]));".to_string(),
            Some(e) => format!(
                "let l = sample_lobe(n, {e:?}, vec2f(x[0], x[1])); let d = l.d; y[5] = l.power;"
            ),
        };
        let body = format!(
            "{frame}{sample} y[0] = dot(d, a); y[1] = dot(d, b); y[2] = dot(d, n); y[3] = length(d); y[4] = dot(d - n, d - n);"
        );
        let mut counts = vec![0u32; 16 * 32];
        for y in probe(&body, &inputs) {
            assert!((y[3] - 1.0).abs() < 2e-6, "length {}", y[3]);
            // By the angle itself, for a cosine near 1 has no digits left.
            let half = f64::from(y[4]) / 2.0;
            let e = exponent.unwrap_or(1.0) + 1.0;
            // The distribution function of cos^n(alpha) cones; cosine sampling is its case n = 1.
            let u = 1.0 - (e * (-half.min(1.0 - 1e-12)).ln_1p()).exp();
            let phi = f64::from(y[1]).atan2(y[0].into()) / std::f64::consts::TAU + 0.5;
            counts[(u * 16.0).clamp(0.0, 15.0) as usize * 32
                + (phi * 32.0).clamp(0.0, 31.0) as usize] += 1;
        }
        let z = chi_square_z(&counts);
        assert!(z.abs() < LIMIT, "exponent {exponent:?}: z = {z}");
    }
}

#[test]
fn strata_are_permuted() {
    for count in [4u32, 9, 16, 25] {
        let inputs: Vec<Values> = (0..count * 200)
            .map(|i| {
                let mut x = [0.0; 16];
                (x[0], x[1]) = ((i % count) as f32, (i / count) as f32);
                x
            })
            .collect();
        let order = "hash_pixel(12345u, u32(x[1]), 7u).x";
        let body = format!("y[0] = f32(shuffled_cell(u32(x[0]), {count}u, {order}));");
        let features = ProbeFeatures {
            strata: count.isqrt(),
            ..ProbeFeatures::default()
        };
        let out = probe_with(&features, &body, &inputs);
        let mut first = vec![0; count as usize];
        for round in out.chunks(count as usize) {
            let mut seen = vec![false; count as usize];
            for y in round {
                seen[y[0] as usize] = true;
            }
            assert!(seen.iter().all(|s| *s), "{count}: {round:?}");
            first[round[0][0] as usize] += 1;
        }
        assert!(
            first
                .iter()
                .all(|n| (200 / count / 2..=400 / count).contains(n)),
            "every stratum comes first at times: {first:?}"
        );
    }
}

/// The number of points in each of 2^bits[0] x 2^bits[1] x ... boxes of the unit cube.
fn box_counts(points: &[[f32; 4]], bits: [u32; 4]) -> Vec<u32> {
    let mut counts = vec![0; 1 << bits.iter().sum::<u32>()];
    for p in points {
        let place = (0..4).fold(0, |k, d| {
            (k << bits[d]) | (p[d] * (1u32 << bits[d]) as f32) as usize
        });
        counts[place] += 1;
    }
    counts
}

#[test]
fn places_and_points_are_even_together() {
    const SAMPLES: usize = 256;
    let pixels = 240;
    let inputs: Vec<Values> = (0..pixels * SAMPLES)
        .map(|i| {
            let mut x = [0.0; 16];
            (x[0], x[1]) = ((i / SAMPLES) as f32, (i % SAMPLES) as f32);
            x
        })
        .collect();
    let body = "
        let pixel = u32(x[0]) * 65537u;
        let s = u32(x[1]);
        let d = draw_together(pixel, s, 7u);
        y[0] = d.x; y[1] = d.y; y[2] = d.z; y[3] = d.w;
        let inside = in_stratum(pixel, s, 7u, vec2f(0.25, 0.75), false);
        y[4] = inside.x; y[5] = inside.y;
        let own = in_stratum(pixel, s, 7u, vec2f(0.25, 0.75), true);
        y[6] = own.x; y[7] = own.y;
        let point = first_light_point(pixel, s, 7u, vec2f(2.0));
        y[8] = point.x; y[9] = point.y;
        y[10] = f32(reverseBits(direction_order(pixel, 1u, s, 7u)) & 0xffffu);";
    for strata in [1u32, 2, 4] {
        let features = ProbeFeatures {
            strata,
            draws_together: true,
            ..ProbeFeatures::default()
        };
        let out = probe_with(&features, body, &inputs);
        let round = (strata * strata) as usize;
        let mut all = Vec::new();
        for y in out.chunks(SAMPLES) {
            let mut replicates = vec![Vec::new(); 4];
            for (s, y) in y.iter().enumerate() {
                assert_eq!([y[6], y[7], y[8], y[9]], [y[0], y[1], y[2], y[3]]);
                // What is put in the cell of a sample.
                let cell = |x: f32| (x * strata as f32).floor();
                assert_eq!([cell(y[4]), cell(y[5])], [cell(y[0]), cell(y[1])]);
                let offset = [0, 1].map(|k| y[4 + k] * strata as f32 - cell(y[k]));
                assert!((offset[0] - 0.25).abs() + (offset[1] - 0.75).abs() < 1e-5);
                replicates[s / round % 4].push([y[0], y[1], y[2], y[3]]);
            }
            for points in &replicates {
                // One sample of each round in each cell, and one of 2^k in each of 2^k boxes of any shape.
                for k in [0, 2, 4, 6] {
                    for some in points.chunks(1 << k) {
                        for a in 0..=k {
                            assert!(box_counts(some, [a, k - a, 0, 0]).iter().all(|n| *n == 1));
                        }
                        for bits in [[0, 0, k, 0], [0, 0, 0, k]] {
                            assert!(box_counts(some, bits).iter().all(|n| *n == 1));
                        }
                    }
                }
                // In four dimensions too they are far more even than random points, of which some box of sixteen would have ten.
                assert!(
                    box_counts(points, [1; 4])
                        .iter()
                        .all(|n| (2..=6).contains(n)),
                    "{:?}",
                    box_counts(points, [1; 4])
                );
            }
            // Replicates share nothing.
            let first: Vec<[f32; 4]> = replicates.iter().map(|r| r[0]).collect();
            assert!((0..4).all(|k| (0..k).all(|j| first[j] != first[k])));
            all.extend(replicates.iter().map(|r| r[1]));
            // Directions come in another order, which keeps blocks of 2^k samples together.
            let order: Vec<usize> = y.iter().map(|y| y[10] as usize).collect();
            for k in [1, 2, 4, 16, 64, 256] {
                for block in order.chunks(k) {
                    let mut seen: Vec<usize> = block.iter().map(|n| n % k).collect();
                    seen.sort_unstable();
                    assert!(seen.into_iter().eq(0..k));
                    assert!(block.iter().all(|n| n / k == block[0] / k));
                }
            }
        }
        // Each sample by itself is anywhere.
        for bits in [[2, 2, 0, 0], [0, 0, 2, 2], [1, 1, 1, 1]] {
            let z = chi_square_z(&box_counts(&all, bits));
            assert!(z.abs() < LIMIT, "strata {strata}, {bits:?}: z = {z}");
        }
    }
}
