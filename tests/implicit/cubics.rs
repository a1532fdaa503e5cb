//! Roots of cubics in Bernstein's form, as the kernels find them in a cell, against f64: the first, and that after a root at the start.

use super::rays::{GPU, settings_of};
use super::volumes::{distances, scene_of};
use etendue::gpu::probe::{Probe, Uniform, Values};
use etendue::kernel::{Access, scene_probe_source};
use etendue::world::World;

const FIRST: &str = "y[0] = first_root(vec4f(x[0], x[1], x[2], x[3]));";
const AFTER_START: &str = "y[0] = root_after_start(vec4f(x[0], x[1], x[2], x[3]), x[4]);";

/// The answers of a kernel with this body, its text changed by `edit` before.
fn answers(body: &str, inputs: &[Values], edit: impl FnOnce(String) -> String) -> Vec<Values> {
    let world = World::new(&scene_of(&distances(4, 0.5), "white"), [8, 8]);
    let access = Access::Baked;
    let source = edit(scene_probe_source(
        &world,
        &settings_of(&world),
        access,
        body,
    ));
    let probe = Probe::compile_for(&GPU, &source, Some(access), Some(&world))
        .unwrap_or_else(|e| panic!("{e}\n{source}"));
    let answers = probe.run(&GPU, Some(&world), inputs);
    answers.unwrap_or_else(|e| panic!("{e}"))
}

/// a + b u + c u² + d u³ in Bernstein's form.
fn bernstein([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d]
}

/// A cubic of some kind: any; with a root that is nearly double, and another anywhere; the same with all three near; a parabola; what is
/// nearly straight.
fn cubic(kind: usize, r: &mut Uniform) -> [f64; 4] {
    let any = |r: &mut Uniform| r.between(-1.0, 1.0);
    let tiny = |r: &mut Uniform, least: f64| 10f64.powf(r.between(least, -1.0));
    match kind {
        0 => [(); 4].map(|()| any(r)),
        1..=3 => {
            let root = r.between(-0.1, 1.1);
            let other = match kind {
                1 => r.between(-2.0, 3.0),
                2 => root + any(r) * 10.0 * tiny(r, -7.0),
                _ => 1e6,
            };
            // (u - root)² (other - u), scaled, and lifted by a little or by nothing.
            let square = root * root;
            let all = [
                square * other,
                -2.0 * root * other - square,
                other + 2.0 * root,
                -1.0,
            ];
            let most = all.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            let sign = any(r).signum();
            let mut all = all.map(|c| sign * c / most);
            if r.next() > 0.2 {
                all[0] += any(r) * tiny(r, -8.0);
            }
            bernstein(all)
        }
        _ => {
            let (start, end, bend) = (r.next(), -r.next(), tiny(r, -8.0));
            let along = |k: f64| start + (end - start) * k / 3.0;
            [
                start,
                along(1.0) + bend * any(r),
                along(2.0) + bend * any(r),
                end,
            ]
        }
    }
}

fn value(b: &[f64; 4], u: f64) -> f64 {
    let v = 1.0 - u;
    v * v * v * b[0] + 3.0 * v * u * (v * b[1] + u * b[2]) + u * u * u * b[3]
}

/// How deep below 0 the cubic is between 0 and `end`, at most: where it is level, or at the end.
fn deepest(b: &[f64; 4], end: f64) -> f64 {
    let [x, y, z] = [b[1] - b[0], b[2] - b[1], b[3] - b[2]];
    // x (1 - u)² + 2 y u (1 - u) + z u².
    let (k, h) = (x - 2.0 * y + z, y - x);
    let s = h + h.signum() * (h * h - k * x).max(0.0).sqrt();
    let level = [-s / k, -x / s];
    let inside = level.into_iter().filter(|u| *u > 0.0 && *u < end);
    inside
        .chain([end])
        .map(|u| -value(b, u))
        .fold(0.0, f64::max)
}

/// The largest of what was wrong, over the largest coefficient: how far from 0 the cubic is where the kernel has a root, and how deep it
/// is before. With how many roots there were.
fn worst(kind: usize, count: usize, edit: impl FnOnce(String) -> String) -> ([f64; 2], usize) {
    let mut r = Uniform(5 + kind as u64);
    let mut inputs: Vec<Values> = Vec::with_capacity(count);
    while inputs.len() < count {
        let b = cubic(kind, &mut r);
        let sign = if b[0] < 0.0 { -1.0 } else { 1.0 };
        let mut x = Values::default();
        for k in 0..4 {
            x[k] = (sign * b[k]) as f32;
        }
        if x[0] > 0.0 {
            inputs.push(x);
        }
    }
    let (mut off, mut deep, mut roots) = (0.0f64, 0.0f64, 0);
    for (x, y) in inputs.iter().zip(answers(FIRST, &inputs, edit)) {
        let b = [0, 1, 2, 3].map(|k| f64::from(x[k]));
        let most = b.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        let u = f64::from(y[0]);
        assert!((0.0..=1.0).contains(&u) || u == 2.0, "{b:?}: {u}");
        if u <= 1.0 {
            roots += 1;
            off = off.max(value(&b, u).abs() / most);
            // Just before it: what the root itself is off counts once.
            deep = deep.max(deepest(&b, u - 1e-3) / most);
        } else {
            deep = deep.max(deepest(&b, 1.0) / most);
        }
    }
    ([off, deep], roots)
}

/// Some roundings of the largest coefficient.
const ROUNDING: f64 = 3e-6;

#[test]
fn the_first_root_is_met_however_flat_the_cubic_is_there() {
    for kind in 0..5 {
        let ([off, deep], roots) = worst(kind, 300_000, |source| source);
        println!("{kind}: {roots} roots, {off:.2e} off, {deep:.2e} deep");
        assert!(roots > 100_000, "{kind}: {roots}");
        assert!(off < ROUNDING && deep < ROUNDING, "{kind}: {off} {deep}");
    }
}

/// A step of Newton's method, a chord where a triple root may be, and a root passed over.
#[test]
fn faults_are_seen() {
    for (kind, old, new) in [
        (1, "- 4.0 * bend * value", ""),
        (2, "select(chord, near, twist < 0.0)", "chord"),
        (
            3,
            "let in_second = !in_first && v.y <= 0.0",
            "let in_second = false",
        ),
    ] {
        let ([off, deep], _) = worst(kind, 100_000, |source| {
            assert_eq!(source.matches(old).count(), 1, "{old}");
            source.replace(old, new)
        });
        println!("{old}: {off:.2e} off, {deep:.2e} deep");
        assert!(off.max(deep) > 3.0 * ROUNDING, "{old}: {off} {deep}");
    }
}

/// Cubics that are 0 at the start: how deep they dip below 0 before the root that the kernel finds, over what it takes for noise.
fn deepest_after_start(count: usize, edit: impl FnOnce(String) -> String) -> f64 {
    let mut r = Uniform(31);
    let inputs: Vec<Values> = (0..count)
        .map(|k| {
            let b = cubic(k % 4, &mut r);
            let sign = if r.next() < 0.5 { -1.0 } else { 1.0 };
            let mut x = Values::default();
            for k in 1..4 {
                x[k] = (sign * (b[k] - b[0])) as f32;
            }
            x[4] = 10f64.powf(r.between(-5.0, -1.0)) as f32;
            x
        })
        .collect();
    let mut worst = 0.0f64;
    let mut roots = 0;
    for (x, y) in inputs.iter().zip(answers(AFTER_START, &inputs, edit)) {
        let b = [0, 1, 2, 3].map(|k| f64::from(x[k]));
        let (noise, u) = (f64::from(x[4]), f64::from(y[0]));
        assert!((0.0..=1.0).contains(&u) || u == 2.0, "{b:?}: {u}");
        roots += usize::from(u <= 1.0);
        worst = worst.max(deepest(&b, u.min(1.0)) / noise);
    }
    assert!(roots > count / 10, "{roots} roots");
    worst
}

#[test]
fn no_dip_after_the_start_is_passed_over() {
    // A dip is measured in its middle and at its end. Elsewhere it is hardly deeper.
    let deep = deepest_after_start(300_000, |source| source);
    println!("{deep:.2} times the noise deep");
    assert!(deep < 1.5, "{deep}");
    // A ray that fell to the end of the cell, and was only looked at halfway.
    let deep = deepest_after_start(100_000, |source| {
        let old = "max(within, at_end)";
        assert_eq!(source.matches(old).count(), 1, "{old}");
        source.replace(old, "within")
    });
    assert!(deep > 10.0, "{deep}");
}
