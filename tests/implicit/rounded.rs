//! How far the rounding of f32 may take a formula from its value: what the kernel cannot know better.

use etendue::implicit::{Arithmetic, Implicit};
use glam::DVec3;

/// The greatest relative error of one rounding of f32.
const UNIT: f64 = f32::EPSILON as f64 / 2.0;

/// A value, and the most by which f32 may miss it, to first order.
#[derive(Debug, Clone, Copy)]
struct Rounded {
    value: f64,
    error: f64,
}

/// With one rounding more.
fn rounded(value: f64, error: f64) -> Rounded {
    Rounded {
        value,
        error: error + UNIT * value.abs(),
    }
}

impl Arithmetic for Rounded {
    fn number(n: f64) -> Self {
        rounded(n, 0.0)
    }

    fn add(self, b: Self) -> Self {
        rounded(self.value + b.value, self.error + b.error)
    }

    fn negate(self) -> Self {
        Self {
            value: -self.value,
            ..self
        }
    }

    fn multiply(self, b: Self) -> Self {
        let error = self.value.abs() * b.error + b.value.abs() * self.error;
        rounded(self.value * b.value, error)
    }

    fn inverse(self) -> Self {
        let value = self.value.inverse();
        rounded(value, value * value * self.error)
    }

    fn square(self) -> Self {
        self.multiply(self)
    }

    fn sqrt(self) -> Self {
        let value = Arithmetic::sqrt(self.value);
        rounded(value, (0.5 * self.error / value).min(self.error.sqrt()))
    }

    fn abs(self) -> Self {
        Self {
            value: self.value.abs(),
            ..self
        }
    }

    fn min(self, b: Self) -> Self {
        if self.value < b.value { self } else { b }
    }

    // The kernel's sine and cosine are good to 5e-7, and its exponential and logarithm to a few roundings.
    fn sin(self) -> Self {
        rounded(
            self.value.sin(),
            self.error + 5e-7 + 4.0 * UNIT * self.value.abs(),
        )
    }

    fn cos(self) -> Self {
        rounded(
            self.value.cos(),
            self.error + 5e-7 + 4.0 * UNIT * self.value.abs(),
        )
    }

    fn exp(self) -> Self {
        let value = Arithmetic::exp(self.value);
        let relative = self.error + UNIT * (6.0 + 4.0 * self.value.abs());
        rounded(value, value * relative)
    }

    fn log(self) -> Self {
        let value = Arithmetic::log(self.value);
        rounded(value, self.error / self.value.abs() + 5e-7)
    }
}

/// The most by which f32 may miss the height of a surface at q, a point of its own space; 0 for volumes.
pub fn of_height(implicit: &Implicit, q: DVec3) -> f64 {
    let Some(formula) = implicit.formula() else {
        return 0.0;
    };
    // Coordinates are rounded on the scale of the bounds.
    let coordinate = |value: f64| Rounded {
        value,
        error: 2.0 * UNIT * implicit.clip.radius(),
    };
    formula.evaluate(q.to_array().map(coordinate)).error
}
