//! An implicit surface in a scene: a function, where it is looked at, and where that part of it stands.

use super::arithmetic::{Arithmetic as _, Sloped};
use super::interval::Interval;
use super::parse::{self, WrongFormula};
use super::{Formula, Grid};
use glam::{DMat3, DVec3};

/// The part of its own space in which a surface is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clip {
    /// An axis-aligned box; every extent is above 0.
    Box {
        /// Smallest coordinates.
        min: DVec3,
        /// Largest coordinates.
        max: DVec3,
    },
    /// A ball around the origin.
    Ball {
        /// Its radius, above 0.
        radius: f64,
    },
}

impl Clip {
    /// Middle of the box or ball, and half its extent along each axis.
    pub fn extent(&self) -> (DVec3, DVec3) {
        match *self {
            Self::Box { min, max } => (0.5 * (min + max), 0.5 * (max - min)),
            Self::Ball { radius } => (DVec3::ZERO, DVec3::splat(radius)),
        }
    }

    /// The radius of the ball around its middle that holds it.
    pub fn radius(&self) -> f64 {
        match *self {
            Self::Box { .. } => self.extent().1.length(),
            Self::Ball { radius } => radius,
        }
    }

    /// Whether `q` is in it, or on its surface.
    pub fn holds(&self, q: DVec3) -> bool {
        match *self {
            Self::Box { min, max } => q.cmpge(min).all() && q.cmple(max).all(),
            Self::Ball { radius } => q.length_squared() <= radius * radius,
        }
    }

    /// How far `q` is from its surface, if it is in it.
    pub fn depth(&self, q: DVec3) -> f64 {
        match *self {
            Self::Box { min, max } => (q - min).min(max - q).min_element(),
            Self::Ball { radius } => radius - q.length(),
        }
    }

    /// Where the line q + t w is in it.
    pub fn span(&self, q: DVec3, w: DVec3) -> Option<[f64; 2]> {
        match *self {
            Self::Box { min, max } => {
                let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
                for k in 0..3 {
                    if w[k] == 0.0 {
                        if q[k] < min[k] || q[k] > max[k] {
                            return None;
                        }
                        continue;
                    }
                    let (a, b) = ((min[k] - q[k]) / w[k], (max[k] - q[k]) / w[k]);
                    enter = enter.max(a.min(b));
                    leave = leave.min(a.max(b));
                }
                (enter <= leave).then_some([enter, leave])
            }
            Self::Ball { radius } => {
                let a = w.length_squared();
                let b = -q.dot(w) / a;
                let across = (q + b * w).length_squared();
                let rest = radius * radius - across;
                (rest >= 0.0).then(|| {
                    let half = (rest / a).sqrt();
                    [b - half, b + half]
                })
            }
        }
    }

    /// `q` moved onto its surface, and the outward unit normal there.
    pub fn project(&self, q: DVec3) -> (DVec3, DVec3) {
        match *self {
            Self::Box { .. } => {
                let (middle, half) = self.extent();
                let v = q - middle;
                let share = (v / half).abs();
                let k = if share.x >= share.y && share.x >= share.z {
                    0
                } else if share.y >= share.z {
                    1
                } else {
                    2
                };
                let normal = DVec3::AXES[k] * v[k].signum();
                let mut on = q;
                on[k] = middle[k] + half[k] * v[k].signum();
                (on, normal)
            }
            Self::Ball { radius } => {
                let normal = q.normalize_or(DVec3::X);
                (normal * radius, normal)
            }
        }
    }
}

/// Where a disk lies, relative to a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DiskPlace {
    Inside,
    Outside,
    Cut,
}

/// What has a certain value on a surface.
#[derive(Debug, Clone, PartialEq)]
enum Function {
    /// A formula, as it was written, with its parameters.
    Formula {
        text: String,
        parameters: Vec<(String, f64)>,
        formula: Formula,
    },
    /// The trilinear function between the numbers of a volume.
    Grid(Grid),
}

/// The points at which a function has a certain value, within a box or ball: the border of the points at which it has less, or, of a
/// volume, more.
#[derive(Debug, Clone, PartialEq)]
pub struct Implicit {
    function: Function,
    /// The value.
    pub level: f64,
    /// Where the origin of the function's space lies.
    pub center: DVec3,
    /// The length of its unit, above 0.
    pub scale: f64,
    /// The directions of its axes, as columns: a rotation.
    pub rotation: DMat3,
    /// The part of its space that is looked at.
    pub clip: Clip,
    /// Whether it bounds a solid, whose surface is closed where `clip` cuts it.
    pub closed: bool,
}

impl Implicit {
    /// The surface f = 0 of the solid f < 0 within a ball of radius 1 around the origin; `parameters` are the names that the formula
    /// may use besides x, y and z, and their values.
    ///
    /// # Errors
    /// What is wrong with the formula, and where.
    pub fn new(text: &str, parameters: &[(&str, f64)]) -> Result<Self, WrongFormula> {
        let owned = parameters.iter().map(|p| (p.0.to_owned(), p.1)).collect();
        Self::of(text.to_owned(), owned)
    }

    pub(crate) fn of(text: String, parameters: Vec<(String, f64)>) -> Result<Self, WrongFormula> {
        let formula = parse::parse(&text, &parameters)?;
        Ok(Self {
            function: Function::Formula {
                text,
                parameters,
                formula,
            },
            level: 0.0,
            center: DVec3::ZERO,
            scale: 1.0,
            rotation: DMat3::IDENTITY,
            clip: Clip::Ball { radius: 1.0 },
            closed: true,
        })
    }

    /// The surface on which the trilinear function between the numbers of a volume has the value `level`.
    pub fn of_volume(grid: Grid, level: f64) -> Self {
        Self {
            level,
            center: DVec3::ZERO,
            scale: 1.0,
            rotation: DMat3::IDENTITY,
            clip: Clip::Box {
                min: DVec3::ZERO,
                max: grid.extent(),
            },
            closed: true,
            function: Function::Grid(grid),
        }
    }

    /// Whether a parameter may have this name.
    pub fn may_name(name: &str) -> bool {
        parse::may_name(name)
    }

    /// The formula as it was written; nothing if it is a volume's surface.
    pub fn text(&self) -> &str {
        match &self.function {
            Function::Formula { text, .. } => text,
            Function::Grid(_) => "",
        }
    }

    /// The formula's parameters.
    pub fn parameters(&self) -> &[(String, f64)] {
        match &self.function {
            Function::Formula { parameters, .. } => parameters,
            Function::Grid(_) => &[],
        }
    }

    /// The parameters that the formula does not use: it means the same without them.
    pub(crate) fn idle_parameters(&self) -> impl Iterator<Item = &str> {
        let all = self.parameters();
        let is_idle = move |name: &&str| {
            let others = all.iter().filter(|p| p.0 != **name);
            let others: Vec<(String, f64)> = others.cloned().collect();
            parse::parse(self.text(), &others).is_ok()
        };
        all.iter().map(|p| p.0.as_str()).filter(is_idle)
    }

    /// The formula, if it is one's surface.
    pub fn formula(&self) -> Option<&Formula> {
        match &self.function {
            Function::Formula { formula, .. } => Some(formula),
            Function::Grid(_) => None,
        }
    }

    /// The volume, if it is one's surface.
    pub fn grid(&self) -> Option<&Grid> {
        match &self.function {
            Function::Formula { .. } => None,
            Function::Grid(grid) => Some(grid),
        }
    }

    /// Numbers that say all of it but how it was written.
    pub(crate) fn words(&self) -> Vec<u64> {
        let mut words = vec![u64::from(self.closed)];
        let mut numbers = vec![self.level, self.scale];
        match &self.function {
            Function::Formula { formula, .. } => {
                words.push(u64::from(formula.result()));
                for node in formula.nodes() {
                    let (kind, a, b) = node.key();
                    words.extend([u64::from(kind), a, b]);
                }
            }
            Function::Grid(grid) => {
                words.push(u64::from(grid.above) | u64::from(grid.smooth) << 1);
                let digest = grid.volume.digest();
                let (eights, _) = digest.as_chunks();
                words.extend(eights.iter().map(|b| u64::from_le_bytes(*b)));
                numbers.extend(grid.spacing.to_array());
            }
        }
        numbers.extend(self.center.to_array());
        numbers.extend(self.rotation.to_cols_array());
        match self.clip {
            Clip::Box { min, max } => {
                numbers.extend(min.to_array().into_iter().chain(max.to_array()));
            }
            Clip::Ball { radius } => numbers.push(radius),
        }
        // The two zeros are one.
        words.extend(numbers.into_iter().map(|x| (x + 0.0).to_bits()));
        words
    }

    /// `p` in the function's space.
    pub fn to_local(&self, p: DVec3) -> DVec3 {
        self.turned_back(p - self.center)
    }

    /// A direction or a difference in the function's space.
    pub fn turned_back(&self, v: DVec3) -> DVec3 {
        self.rotation.transpose() * v / self.scale
    }

    /// A point of the function's space.
    pub fn to_world(&self, q: DVec3) -> DVec3 {
        self.center + self.rotation * (q * self.scale)
    }

    /// The function minus the level at a point of its space. Of a volume it has the sign that a solid wants, and is at most 1.
    pub fn height(&self, q: DVec3) -> f64 {
        match &self.function {
            Function::Formula { formula, .. } => formula.evaluate(q.to_array()) - self.level,
            Function::Grid(grid) => grid.sloped(q, self.level).0,
        }
    }

    /// The same with its gradient there.
    pub fn sloped(&self, q: DVec3) -> (f64, DVec3) {
        match &self.function {
            Function::Formula { formula, .. } => {
                let Sloped { value, gradient } = formula.evaluate(Sloped::coordinates(q));
                (value - self.level, gradient)
            }
            Function::Grid(grid) => grid.sloped(q, self.level),
        }
    }

    /// The unit normal about which light is scattered at `p` in the scene, where the surface's own normal is `normal`. It is on the
    /// same side. Caps, formulas and the cells of volumes have no other normal.
    pub fn shading_normal(&self, p: DVec3, normal: DVec3, cap: bool) -> DVec3 {
        let Some(grid) = self.grid().filter(|g| g.smooth && !cap) else {
            return normal;
        };
        let gradient = grid.smooth_gradient(self.to_local(p), self.level);
        let smooth = (self.rotation * gradient).normalize_or(normal);
        // Where the volume is coarser than what it shows, differences may point anywhere.
        if smooth.dot(normal) > 0.0 {
            smooth
        } else {
            normal
        }
    }

    /// What [`height`](Self::height) may be within `reach` of `q`, axis by axis.
    pub fn heights(&self, q: DVec3, reach: DVec3) -> Interval {
        let at = |k: usize| {
            let low = (q[k] - reach[k]).next_down();
            Interval::new(low, (q[k] + reach[k]).next_up())
        };
        match &self.function {
            Function::Formula { formula, .. } => {
                let value = formula.evaluate([at(0), at(1), at(2)]);
                value.subtract(Interval::number(self.level))
            }
            Function::Grid(grid) => grid.heights(q, reach, self.level),
        }
    }

    /// Whether `p` is in the solid.
    pub fn holds(&self, p: DVec3) -> bool {
        let q = self.to_local(p);
        self.closed && self.clip.holds(q) && self.height(q) < 0.0
    }

    /// Centre and radius of a ball in the scene that holds it.
    pub fn ball(&self) -> (DVec3, f64) {
        let (middle, _) = self.clip.extent();
        (self.to_world(middle), self.clip.radius() * self.scale)
    }

    /// A point in the scene that is well inside the solid, and the solid's volume, from a grid of points.
    pub(crate) fn core(&self) -> (DVec3, f64) {
        const SIDE: usize = 24;
        let (middle, half) = self.clip.extent();
        let along = |k: usize| (2.0 * (k as f64 + 0.5) / SIDE as f64) - 1.0;
        let mut deepest = (middle, 0.0);
        let mut inside = 0usize;
        for k in 0..SIDE.pow(3) {
            let at = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE].map(along);
            let q = middle + half * DVec3::from_array(at);
            if !self.clip.holds(q) {
                continue;
            }
            let (height, gradient) = self.sloped(q);
            if height < 0.0 {
                inside += 1;
                let depth = (-height / gradient.length().max(1e-30)).min(self.clip.depth(q));
                if depth > deepest.1 {
                    deepest = (q, depth);
                }
            }
        }
        let cell = (2.0 * half / SIDE as f64 * self.scale).element_product();
        (self.to_world(deepest.0), inside as f64 * cell)
    }

    /// Where the disk of this centre, unit normal and radius lies. What no interval tells counts as cut.
    pub(crate) fn place_of_disk(&self, center: DVec3, normal: DVec3, radius: f64) -> DiskPlace {
        let x = normal.any_orthonormal_vector();
        let patch = Patch {
            center: self.to_local(center),
            x: self.turned_back(x * radius),
            y: self.turned_back(normal.cross(x) * radius),
        };
        const DEPTH: u32 = 6;
        self.place_of_patch(&patch, [0.0, 0.0], 1.0, DEPTH)
    }

    fn place_of_patch(&self, disk: &Patch, at: [f64; 2], half: f64, depth: u32) -> DiskPlace {
        let q = disk.center + disk.x * at[0] + disk.y * at[1];
        let reach = (disk.x.abs() + disk.y.abs()) * half;
        let (middle, clip) = self.clip.extent();
        let beyond = match self.clip {
            Clip::Box { .. } => ((q - middle).abs() - reach).cmpgt(clip).any(),
            Clip::Ball { radius } => q.length() - reach.length() > radius,
        };
        let heights = self.heights(q, reach);
        if beyond || heights.low > 0.0 {
            return DiskPlace::Outside;
        }
        let within = match self.clip {
            Clip::Box { .. } => ((q - middle).abs() + reach).cmplt(clip).all(),
            Clip::Ball { radius } => q.length() + reach.length() < radius,
        };
        if within && heights.high < 0.0 {
            return DiskPlace::Inside;
        }
        if depth == 0 {
            return DiskPlace::Cut;
        }
        let mut place = None;
        for k in 0..4 {
            let [dx, dy] = [k & 1, k >> 1].map(|s| (f64::from(s) - 0.5) * half);
            let at = [at[0] + dx, at[1] + dy];
            // The corner nearest the middle of the disk is outside the disk.
            let near = at.map(|a| (a.abs() - 0.5 * half).max(0.0));
            if near[0].hypot(near[1]) > 1.0 {
                continue;
            }
            let part = self.place_of_patch(disk, at, 0.5 * half, depth - 1);
            if part == DiskPlace::Cut || *place.get_or_insert(part) != part {
                return DiskPlace::Cut;
            }
        }
        place.unwrap_or(DiskPlace::Outside)
    }
}

/// A disk in a function's space: its centre, and two radii.
struct Patch {
    center: DVec3,
    x: DVec3,
    y: DVec3,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball() -> Implicit {
        let mut ball = Implicit::new("x^2 + y^2 + z^2", &[]).expect("a formula");
        (ball.level, ball.scale, ball.center) = (0.25, 2.0, DVec3::new(1.0, 2.0, 3.0));
        ball
    }

    #[test]
    fn a_solid_holds_what_is_inside() {
        let ball = ball();
        assert!(ball.holds(DVec3::new(1.9, 2.0, 3.0)) && !ball.holds(DVec3::new(2.1, 2.0, 3.0)));
        let (core, volume) = ball.core();
        assert!(core.distance(ball.center) < 0.2, "{core}");
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((volume / exact - 1.0).abs() < 0.05, "{volume}");
    }

    #[test]
    fn disks_lie_inside_outside_or_are_cut() {
        let ball = ball();
        let place = |x: f64, radius| {
            ball.place_of_disk(
                ball.center + DVec3::X * x,
                DVec3::new(0.6, 0.0, 0.8),
                radius,
            )
        };
        assert_eq!(place(0.0, 0.9), DiskPlace::Inside);
        assert_eq!(place(0.0, 1.1), DiskPlace::Cut);
        assert_eq!(place(1.5, 0.4), DiskPlace::Outside);
        assert_eq!(place(9.0, 5.0), DiskPlace::Outside);
    }

    #[test]
    fn lines_cross_boxes_and_balls() {
        let cube = Clip::Box {
            min: DVec3::new(-1.0, -2.0, 0.0),
            max: DVec3::new(1.0, 2.0, 3.0),
        };
        let ball = Clip::Ball { radius: 2.0 };
        assert_eq!(
            cube.span(DVec3::new(-3.0, 0.0, 1.0), DVec3::X * 2.0),
            Some([1.0, 2.0])
        );
        assert_eq!(cube.span(DVec3::new(-3.0, 2.5, 1.0), DVec3::X), None);
        assert_eq!(
            ball.span(DVec3::new(-4.0, 0.0, 0.0), DVec3::X * 2.0),
            Some([1.0, 3.0])
        );
        assert_eq!(
            cube.project(DVec3::new(0.1, 1.9, 1.0)),
            (DVec3::new(0.1, 2.0, 1.0), DVec3::Y)
        );
    }
}
