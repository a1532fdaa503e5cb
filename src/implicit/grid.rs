//! A volume where it stands in a surface's own space, and what of it is the inside of a solid.

use super::arithmetic::Arithmetic as _;
use super::interval::{Interval, Varying};
use super::volume::{AxisOrder, Trilinear, Volume};
use glam::DVec3;
use std::sync::Arc;

/// A volume whose first point is the origin, and whose axes are those of its space.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Its numbers.
    pub volume: Arc<Volume>,
    /// The file that they come from, for messages and scene files.
    pub file: String,
    /// Which index of the array in that file is which axis.
    pub order: AxisOrder,
    /// The lengths of a cell, above 0.
    pub spacing: DVec3,
    /// Whether the solid is where the volume has more than the level, and not less.
    pub above: bool,
    /// Whether light is scattered about [smooth normals](Self::smooth_gradient), and not about those of the cells.
    pub smooth: bool,
}

impl Grid {
    /// Cells of this size between the numbers of a volume, of which the solid has those above the level.
    pub fn new(volume: impl Into<Arc<Volume>>, spacing: impl Into<DVec3>) -> Self {
        Self {
            volume: volume.into(),
            file: "volume".into(),
            order: AxisOrder::Zyx,
            spacing: spacing.into(),
            above: true,
            smooth: false,
        }
    }

    /// The largest coordinates.
    pub fn extent(&self) -> DVec3 {
        self.spacing * DVec3::from_array(self.volume.cells().map(|n| n as f64))
    }

    /// What is multiplied by a number less the level: it is below 0 in the solid then, and at most 1. A power of two, or its negative.
    pub fn gain(&self, level: f64) -> f64 {
        let [low, high] = self.volume.range();
        // Halves, whose difference is finite.
        let most = (0.5 * low - 0.5 * level)
            .abs()
            .max((0.5 * high - 0.5 * level).abs());
        let exponent = (most.to_bits() >> 52) as i64 - 1023;
        let unit = match most {
            0.0 => 1.0,
            _ => f64::powi(2.0, -(exponent.clamp(-1000, 1000) as i32) - 2),
        };
        if self.above { -unit } else { unit }
    }

    /// A point of the surface's space, in cells from the first point.
    pub fn in_cells(&self, q: DVec3) -> DVec3 {
        q / self.spacing
    }

    /// The function less the level at a point of the surface's space, times [`gain`](Self::gain), with its gradient.
    pub fn sloped(&self, q: DVec3, level: f64) -> (f64, DVec3) {
        let g = self.in_cells(q);
        let at = self.volume.cell_at(g);
        let cell = self.heights_of(at, level);
        let f = g - corner(at);
        (cell.value(f), cell.gradient(f) / self.spacing)
    }

    /// The gradient of the function times [`gain`](Self::gain) at a point of the surface's space, by differences of its values a cell
    /// before and a cell behind it along each axis; less than a cell where the volume ends. It is continuous, other than that of the cells.
    pub fn smooth_gradient(&self, q: DVec3, level: f64) -> DVec3 {
        let g = self.in_cells(q);
        let most = DVec3::from_array(self.volume.cells().map(|n| n as f64));
        let value = |g: DVec3| {
            let at = self.volume.cell_at(g);
            self.heights_of(at, level).value(g - corner(at))
        };
        let along = |k: usize| {
            let step = DVec3::AXES[k];
            let (low, high) = (
                (g - step).clamp(DVec3::ZERO, most),
                (g + step).clamp(DVec3::ZERO, most),
            );
            (value(high) - value(low)) / (high[k] - low[k])
        };
        DVec3::new(along(0), along(1), along(2)) / self.spacing
    }

    /// The values at the corners of a cell less the level, times the gain.
    pub fn heights_of(&self, at: [usize; 3], level: f64) -> Trilinear {
        let gain = self.gain(level);
        // Each is scaled before: their difference may be more than f64 holds.
        Trilinear(self.volume.cell(at).0.map(|v| v * gain - level * gain))
    }

    /// What the function less the level, times the gain, may be within `reach` of `q`, axis by axis.
    pub fn heights(&self, q: DVec3, reach: DVec3, level: f64) -> Interval {
        let values = self
            .volume
            .between(self.in_cells(q - reach), self.in_cells(q + reach));
        let gain = self.gain(level);
        let [a, b] = [values.low, values.high].map(|v| v * gain - level * gain);
        Interval::new(a.min(b), a.max(b))
    }
}

/// The first corner of a cell, in cells.
pub(super) fn corner(at: [usize; 3]) -> DVec3 {
    DVec3::from_array(at.map(|n| n as f64))
}

/// The function along a ray that passes a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    /// In the powers of the cell's coordinates.
    monomials: [Varying; 8],
    /// The ray: where it is at 0, relative to the cell's first corner, and what it moves by.
    pub start: DVec3,
    pub step: DVec3,
}

impl Along {
    pub fn new(cell: &Trilinear, start: DVec3, step: DVec3) -> Self {
        let monomials = cell.monomials().map(Varying::number);
        Self {
            monomials,
            start,
            step,
        }
    }

    /// The function and its derivative between two places of the ray.
    pub fn over(&self, t: Varying) -> Varying {
        let at = |k: usize| {
            let slope = Varying::number(self.step[k]);
            t.multiply(slope).add(Varying::number(self.start[k]))
        };
        let (x, y, z) = (at(0), at(1), at(2));
        let c = &self.monomials;
        let face = |k: usize| {
            let along = c[k].add(c[k + 1].multiply(x));
            along.add(c[k + 2].add(c[k + 3].multiply(x)).multiply(y))
        };
        face(0).add(face(4).multiply(z))
    }
}
