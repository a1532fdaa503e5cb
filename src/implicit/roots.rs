//! Where a ray meets an implicit surface, in f64: by bisection, with intervals of the function and of its derivative along the ray.
//!
//! The kernels do it in another way, which `shaders/implicit/surface.wgsl` and `grid.wgsl` describe. A volume is met cell by cell here:
//! all that the ray passes, without any hierarchy.

use super::arithmetic::Arithmetic as _;
use super::interval::{Interval, Varying};
use super::{Implicit, grid};
use glam::DVec3;

/// The part of a closed surface that its formula makes.
pub const SURFACE: usize = 0;
/// The part where the bounds cut off the solid.
pub const CAP: usize = 1;

/// Parts of the ray that are smaller than this, relative to the size of the surface, are not divided any further.
const FINEST: f64 = 1.0 / (1u64 << 42) as f64;

/// A point that is nearer to the surface than this, relative to its size, is on it.
const ON_IT: f64 = 1e-10;

/// The most parts of a ray that are looked at. A ray beyond that ends where the search does.
const MOST_PARTS: usize = 1 << 16;

/// The same where a guess is good enough: some times what torus and gyroid need.
const FEW_PARTS: usize = 1 << 9;

/// What is known of the place where a ray starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Start {
    /// Whether that is inside the solid. Of no meaning for a surface that is not closed.
    pub inside: bool,
    /// The part of the surface that it stands on.
    pub on: Option<usize>,
}

/// The function along a ray in its own space.
struct Along<'a> {
    implicit: &'a Implicit,
    /// The cell of a volume in which the ray is.
    cell: Option<grid::Along>,
    q: DVec3,
    w: DVec3,
    /// 1 if the ray starts where the function is positive, or -1: it looks for a place where the sign changes.
    sign: f64,
    /// The length below which parts are not divided.
    finest: f64,
    /// The most parts of the ray that are looked at.
    most_parts: usize,
}

impl Along<'_> {
    /// The function and its derivative between two places, times the sign.
    fn over(&self, low: f64, high: f64) -> Varying {
        let t = Varying {
            value: Interval::new(low, high),
            slope: Interval::number(1.0),
        };
        let at = |k: usize| {
            let slope = Varying::number(self.w[k]);
            t.multiply(slope).add(Varying::number(self.q[k]))
        };
        let height = match (self.implicit.formula(), &self.cell) {
            (Some(formula), _) => {
                let value = formula.evaluate([at(0), at(1), at(2)]);
                value.subtract(Varying::number(self.implicit.level))
            }
            (None, Some(cell)) => cell.over(t),
            (None, None) => unreachable!("a volume is met cell by cell"),
        };
        if self.sign < 0.0 {
            height.negate()
        } else {
            height
        }
    }

    /// The function at a place, times the sign.
    fn at(&self, t: f64) -> f64 {
        match &self.cell {
            Some(_) => {
                let Interval { low, high } = self.over(t, t).value;
                0.5 * (low + high)
            }
            None => self.sign * self.implicit.height(self.q + self.w * t),
        }
    }

    /// Its derivative.
    fn slope(&self, t: f64) -> f64 {
        match &self.cell {
            Some(_) => {
                let Interval { low, high } = self.over(t, t).slope;
                0.5 * (low + high)
            }
            None => self.sign * self.implicit.sloped(self.q + self.w * t).1.dot(self.w),
        }
    }

    /// The root between `low`, where the function is positive, and `high`, where it is negative and has fallen all the way.
    fn bisect(&self, mut low: f64, mut high: f64) -> f64 {
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if self.at(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The first place from `low` to `high` at which the function is not positive any more. A ray that stands `on` a root at `low` does
    /// not meet that one.
    fn first(&mut self, low: f64, high: f64, mut on: bool) -> Option<f64> {
        let Some(grid) = self.implicit.grid() else {
            let low = if on {
                self.beyond_start(low, high)
            } else {
                low
            };
            return self.first_of_part(low, high);
        };
        // Every cell that the ray passes, one after the other.
        let (start, step) = (grid.in_cells(self.q), grid.in_cells(self.w));
        let mut at = grid.volume.cell_at(start + step * low);
        let mut from = low;
        loop {
            let leave = |k: usize| {
                let side = at[k] as f64 + if step[k] > 0.0 { 1.0 } else { 0.0 };
                let t = (side - start[k]) / step[k];
                if step[k] == 0.0 { f64::INFINITY } else { t }
            };
            let axis = if leave(0) <= leave(1) && leave(0) <= leave(2) {
                0
            } else if leave(1) <= leave(2) {
                1
            } else {
                2
            };
            let to = leave(axis).clamp(from, high);
            let heights = grid.heights_of(at, self.implicit.level);
            // The function lies between the values at the corners.
            if on || !heights.0.iter().all(|h| self.sign * h > 0.0) {
                self.cell = Some(grid::Along::new(&heights, start - grid::corner(at), step));
                if on {
                    from = self.beyond_start(from, to);
                    // The whole cell may be too short to leave the root behind.
                    on = from >= to && self.at(to) <= 0.0;
                }
                if !on && let Some(t) = self.first_of_part(from, to) {
                    return Some(t);
                }
            }
            let next = if step[axis] > 0.0 {
                at[axis] + 1
            } else {
                at[axis].wrapping_sub(1)
            };
            if to >= high || next >= grid.volume.cells()[axis] {
                return None;
            }
            (at[axis], from) = (next, to);
        }
    }

    /// The same within a part of the ray on which the function is smooth.
    fn first_of_part(&self, low: f64, high: f64) -> Option<f64> {
        self.isolate(low, high).unwrap_or_else(Some)
    }

    /// The same. The error is the place where the search was given up.
    fn isolate(&self, low: f64, high: f64) -> Result<Option<f64>, f64> {
        let mut parts = vec![(low, high)];
        let mut left = self.most_parts;
        while let Some((low, high)) = parts.pop() {
            let Varying { value, slope } = self.over(low, high);
            if value.low > 0.0 {
                continue;
            }
            if value.high < 0.0 {
                return Ok(Some(low));
            }
            if left == 0 {
                return Err(low);
            }
            left -= 1;
            if slope.low > 0.0 {
                if self.over(low, low).value.high < 0.0 {
                    return Ok(Some(low));
                }
                continue;
            }
            if slope.high < 0.0 {
                if self.at(high) < 0.0 {
                    return Ok(Some(self.bisect(low, high)));
                }
                continue;
            }
            let middle = 0.5 * (low + high);
            if high - low > self.finest {
                parts.push((middle, high));
                parts.push((low, middle));
            } else if self.slope(low) <= 0.0 {
                return Ok(Some(low));
            }
        }
        Ok(None)
    }

    /// How far from a root at `start` there is certainly no other, at most `end`.
    fn beyond_start(&self, start: f64, end: f64) -> f64 {
        let mut reach = end - start;
        while reach > self.finest {
            if self.over(start, start + reach).slope.low > 0.0 {
                // Not a rounding less than the end.
                return if reach == end - start {
                    end
                } else {
                    start + reach
                };
            }
            reach *= 0.5;
        }
        start + reach.max(0.0)
    }
}

impl Implicit {
    /// Where the ray o + t d first meets the surface, at t >= 0, and the part that it meets there.
    pub fn meet(&self, o: DVec3, d: DVec3, start: Start) -> Option<(f64, usize)> {
        self.search(o, d, start, MOST_PARTS)
    }

    /// The same with bounded work, for warnings: a formula that swings hundreds of times along the ray may be met too early.
    pub(crate) fn meet_roughly(&self, o: DVec3, d: DVec3, start: Start) -> Option<(f64, usize)> {
        self.search(o, d, start, FEW_PARTS)
    }

    /// Whether the formula swings so often that some of four lines through the middle of its bounds take more than [`FEW_PARTS`] parts,
    /// whether they begin inside or outside.
    pub fn is_wild(&self) -> bool {
        let (middle, half) = self.clip.extent();
        let reach = half.length();
        let lines = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE.normalize()];
        let given_up = |w: DVec3, sign: f64| {
            let along = Along {
                implicit: self,
                cell: None,
                q: middle,
                w,
                sign,
                finest: FINEST * reach,
                most_parts: FEW_PARTS,
            };
            along.isolate(-reach, reach).is_err()
        };
        let is_wild = |w: DVec3| given_up(w, 1.0) || given_up(w, -1.0);
        self.formula().is_some() && lines.into_iter().any(is_wild)
    }

    fn search(&self, o: DVec3, d: DVec3, start: Start, most_parts: usize) -> Option<(f64, usize)> {
        let (q, w) = (self.to_local(o), self.turned_back(d));
        let span = self.clip.span(q, w);
        // The first root of a ray that stands on one, or on none.
        let first = |sign: f64, from: f64, to: f64, on: bool| {
            let mut along = Along {
                implicit: self,
                cell: None,
                q,
                w,
                sign,
                finest: FINEST * self.ball().1,
                most_parts,
            };
            along.first(from, to, on)
        };
        let on_root = |from: f64| start.on == Some(SURFACE) && from == 0.0;
        if self.closed && start.inside {
            let leave = span.map_or(0.0, |s| s[1].max(0.0));
            let root = first(-1.0, 0.0, leave, on_root(0.0));
            return Some(root.map_or((leave, CAP), |t| (t, SURFACE)));
        }
        let [enter, leave] = span.filter(|s| s[1] > 0.0)?;
        let from = enter.max(0.0);
        if !self.closed {
            let (height, gradient) = self.sloped(q + w * from);
            let value = if on_root(from) {
                gradient.dot(w)
            } else {
                height
            };
            let sign = if value < 0.0 { -1.0 } else { 1.0 };
            let root = first(sign, from, leave, on_root(from));
            return root.map(|t| (t, SURFACE));
        }
        if start.on == Some(CAP) {
            return None;
        }
        if start.on.is_none() {
            let (height, gradient) = self.sloped(q + w * from);
            let depth = -height / gradient.length().max(1e-30);
            if enter > 0.0 && depth > 0.0 {
                return Some((enter, CAP));
            }
            if depth > 0.0 && depth > ON_IT * self.clip.radius() {
                // Rounding has put the ray inside: it meets what is nearest.
                let by_cap = self.clip.depth(q) < depth;
                return Some((0.0, if by_cap { CAP } else { SURFACE }));
            }
            if depth.abs() <= ON_IT * self.clip.radius() && from == 0.0 {
                if gradient.dot(w) < 0.0 {
                    return Some((0.0, SURFACE));
                }
                return first(1.0, 0.0, leave, true).map(|t| (t, SURFACE));
            }
        }
        first(1.0, from, leave, on_root(from)).map(|t| (t, SURFACE))
    }

    /// `p` moved onto part `part` of the surface, and the unit normal there: outward of the solid, or to where the function is greater.
    /// Where the gradient vanishes, the normal is `otherwise`.
    pub fn project(&self, part: usize, p: DVec3, otherwise: DVec3) -> (DVec3, DVec3) {
        let mut q = self.to_local(p);
        let normal = if part == CAP {
            let (on, normal) = self.clip.project(q);
            q = on;
            normal
        } else {
            // Newton's method along the gradient. Far from a root it would lead away.
            let reach = 1e-3 * self.clip.radius();
            for _ in 0..2 {
                let (height, gradient) = self.sloped(q);
                let step = gradient * (height / gradient.length_squared().max(1e-300));
                if step.length() < reach {
                    q -= step;
                }
            }
            self.sloped(q).1
        };
        let normal = (self.rotation * normal).normalize_or(otherwise);
        (self.to_world(q), normal)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Clip;
    use super::*;

    const FREE: Start = Start {
        inside: false,
        on: None,
    };

    fn of(text: &str, radius: f64) -> Implicit {
        let mut implicit = Implicit::new(text, &[]).expect("a formula");
        implicit.clip = Clip::Ball { radius };
        implicit
    }

    #[test]
    fn a_ball_is_met_where_it_is() {
        let mut ball = of("x^2 + y^2 + z^2 - 1", 2.0);
        (ball.center, ball.scale) = (DVec3::new(1.0, 2.0, 3.0), 0.5);
        for k in 0..500 {
            let miss = 0.55 * f64::from(k) / 500.0;
            let o = ball.center + DVec3::new(-3.0, miss, 0.0);
            let expected = (miss <= 0.5).then(|| 3.0 - (0.25 - miss * miss).sqrt());
            let found = ball.meet(o, DVec3::X, FREE).map(|h| h.0);
            match (found, expected) {
                (Some(a), Some(b)) => assert!((a - b).abs() < 1e-7, "{miss}: {a} {b}"),
                _ => assert_eq!(found, expected, "{miss}"),
            }
        }
    }

    #[test]
    fn glancing_chords_are_as_long_as_they_are() {
        let ball = of("x^2 + y^2 + z^2 - 1", 2.0);
        for k in 1..60 {
            let slope = 0.75f64.powi(k);
            let d = DVec3::new(-slope, 1.0, 0.0).normalize();
            let start = |inside| Start {
                inside,
                on: Some(SURFACE),
            };
            let (t, part) = ball.meet(DVec3::X, d, start(true)).expect("inside");
            assert!(
                (t + 2.0 * d.x).abs() < 1e-9 + 1e-15 / slope && part == SURFACE,
                "{slope}: {t}"
            );
            assert_eq!(
                ball.meet(DVec3::X, DVec3::new(slope, 1.0, 0.0), start(false)),
                None
            );
        }
    }

    #[test]
    fn thin_shells_and_double_roots_are_not_missed() {
        let shell = of("abs(sqrt(x^2 + y^2 + z^2) - 1) - 0.0005", 2.0);
        let sheet = of("(x^2 + y^2 + z^2 - 1)^2", 2.0);
        for k in 0..300 {
            let y = f64::from(k) / 301.0;
            let o = DVec3::new(-3.0, y, 0.0);
            let at = |radius: f64| 3.0 - (radius * radius - y * y).sqrt();
            let (t, _) = shell.meet(o, DVec3::X, FREE).expect("met");
            assert!((t - at(1.0005)).abs() < 1e-9, "{y}: {t}");
            let on = shell.project(SURFACE, o + DVec3::X * t, DVec3::X).0;
            let inside = Start {
                inside: true,
                on: Some(SURFACE),
            };
            let (through, _) = shell.meet(on, DVec3::X, inside).expect("met");
            assert!((t + through - at(0.9995)).abs() < 1e-9, "{y}: {through}");
            let (t, _) = sheet.meet(o, DVec3::X, FREE).expect("met");
            assert!((t - at(1.0)).abs() < 1e-6, "{y}: {t}");
        }
    }

    #[test]
    fn bounds_are_caps_of_solids_and_rims_of_others() {
        let mut tube = of("x^2 + y^2 - 1", 1.0);
        tube.clip = Clip::Box {
            min: DVec3::new(-2.0, -2.0, -1.0),
            max: DVec3::new(2.0, 2.0, 1.0),
        };
        let down = |x: f64, inside, on| {
            tube.meet(DVec3::new(x, 0.0, 3.0), -DVec3::Z, Start { inside, on })
        };
        assert_eq!(down(0.5, false, None), Some((2.0, CAP)));
        assert_eq!(down(1.5, false, None), None);
        let inside = Start {
            inside: true,
            on: None,
        };
        assert_eq!(tube.meet(DVec3::ZERO, DVec3::Z, inside), Some((1.0, CAP)));
        let (p, n) = tube.project(CAP, DVec3::new(0.5, 0.0, 1.0 + 1e-9), DVec3::X);
        assert_eq!((p.z, n), (1.0, DVec3::Z));
        tube.closed = false;
        let slant = DVec3::new(1.0, 0.0, -1.5).normalize();
        let (t, part) = tube
            .meet(DVec3::new(0.5, 0.0, 1.5), slant, FREE)
            .expect("from inside");
        assert!(part == SURFACE && (t * slant.x - 0.5).abs() < 1e-12);
        assert_eq!(
            tube.meet(DVec3::new(0.5, 0.0, 3.0), -DVec3::Z, FREE),
            None,
            "through"
        );
    }

    #[test]
    fn formulas_that_swing_without_end_are_wild() {
        assert!(!of("(x^2 + y^2 + z^2 + 0.91)^2 - 4 (x^2 + y^2)", 2.0).is_wild());
        let gyroid = "abs(sin(20 x) cos(20 y) + sin(20 y) cos(20 z) + sin(20 z) cos(20 x)) - 0.2";
        assert!(!of(gyroid, 2.0).is_wild());
        assert!(of("tan(x)", 1e12).is_wild());
        // It has no root, but no interval of some periods tells. Rays through it end nevertheless.
        let waves = of("sin(x) sin(x + 1) + 0.9", 1e6);
        assert!(waves.is_wild());
        assert!(waves.meet_roughly(DVec3::ZERO, DVec3::X, FREE).is_some());
    }
}
