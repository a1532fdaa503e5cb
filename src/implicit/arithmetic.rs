//! What a formula is evaluated in: numbers, numbers with their gradient, and in [`interval`](super::interval) sets of them.

use glam::DVec3;

/// Smaller numbers have no logarithm and no inverse of their own.
pub(crate) const SMALLEST: f64 = 1e-30;

/// The largest number that the exponential function takes: its value fits f32.
pub(crate) const LARGEST_EXPONENT: f64 = 80.0;

/// Numbers of some kind, with the operations of formulas. Each has a value everywhere: see [`Formula`](super::Formula).
#[expect(missing_docs, reason = "they are what they are called")]
pub trait Arithmetic: Copy {
    fn number(n: f64) -> Self;
    fn add(self, b: Self) -> Self;
    fn negate(self) -> Self;
    fn multiply(self, b: Self) -> Self;
    fn inverse(self) -> Self;
    fn square(self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn min(self, b: Self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn exp(self) -> Self;
    fn log(self) -> Self;

    fn subtract(self, b: Self) -> Self {
        self.add(b.negate())
    }

    fn max(self, b: Self) -> Self {
        self.negate().min(b.negate()).negate()
    }
}

impl Arithmetic for f64 {
    fn number(n: f64) -> Self {
        n
    }

    fn add(self, b: Self) -> Self {
        self + b
    }

    fn negate(self) -> Self {
        -self
    }

    fn multiply(self, b: Self) -> Self {
        self * b
    }

    fn inverse(self) -> Self {
        1.0 / if self.abs() < SMALLEST {
            SMALLEST.copysign(self)
        } else {
            self
        }
    }

    fn square(self) -> Self {
        self * self
    }

    fn sqrt(self) -> Self {
        f64::sqrt(f64::max(self, 0.0))
    }

    fn abs(self) -> Self {
        f64::abs(self)
    }

    fn min(self, b: Self) -> Self {
        f64::min(self, b)
    }

    fn sin(self) -> Self {
        f64::sin(self)
    }

    fn cos(self) -> Self {
        f64::cos(self)
    }

    fn exp(self) -> Self {
        f64::exp(f64::min(self, LARGEST_EXPONENT))
    }

    fn log(self) -> Self {
        f64::ln(f64::max(self, SMALLEST))
    }
}

/// A value, or NaN where the formula has none of its own.
#[derive(Debug, Clone, Copy)]
pub struct Strict(pub f64);

impl Arithmetic for Strict {
    fn number(n: f64) -> Self {
        Self(n)
    }

    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0)
    }

    fn negate(self) -> Self {
        Self(-self.0)
    }

    fn multiply(self, b: Self) -> Self {
        Self(self.0 * b.0)
    }

    fn inverse(self) -> Self {
        if self.0.abs() < SMALLEST {
            return Self(f64::NAN);
        }
        Self(1.0 / self.0)
    }

    fn square(self) -> Self {
        Self(self.0 * self.0)
    }

    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    // The minimum of f64 would hide what is not a number.
    fn min(self, b: Self) -> Self {
        if self.0.is_nan() || self.0 < b.0 {
            self
        } else {
            b
        }
    }

    fn sin(self) -> Self {
        Self(self.0.sin())
    }

    fn cos(self) -> Self {
        Self(self.0.cos())
    }

    fn exp(self) -> Self {
        if self.0 > LARGEST_EXPONENT {
            return Self(f64::NAN);
        }
        Self(self.0.exp())
    }

    fn log(self) -> Self {
        if self.0 < SMALLEST {
            return Self(f64::NAN);
        }
        Self(self.0.ln())
    }
}

/// A value and its gradient.
#[expect(missing_docs, reason = "its text says what they are")]
#[derive(Debug, Clone, Copy)]
pub struct Sloped {
    pub value: f64,
    pub gradient: DVec3,
}

impl Sloped {
    /// x, y and z at a point.
    pub fn coordinates(p: DVec3) -> [Self; 3] {
        [(p.x, DVec3::X), (p.y, DVec3::Y), (p.z, DVec3::Z)]
            .map(|(value, gradient)| Self { value, gradient })
    }

    /// A function of it, whose value and derivative are these.
    fn chain(self, value: f64, derivative: f64) -> Self {
        let gradient = self.gradient * derivative;
        Self { value, gradient }
    }
}

impl Arithmetic for Sloped {
    fn number(value: f64) -> Self {
        let gradient = DVec3::ZERO;
        Self { value, gradient }
    }

    fn add(self, b: Self) -> Self {
        Self {
            value: self.value + b.value,
            gradient: self.gradient + b.gradient,
        }
    }

    fn negate(self) -> Self {
        self.chain(-self.value, -1.0)
    }

    fn multiply(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            gradient: self.gradient * b.value + b.gradient * self.value,
        }
    }

    fn inverse(self) -> Self {
        let value = self.value.inverse();
        self.chain(value, -value * value)
    }

    fn square(self) -> Self {
        self.chain(self.value * self.value, 2.0 * self.value)
    }

    fn sqrt(self) -> Self {
        let value = Arithmetic::sqrt(self.value);
        self.chain(value, if value > 0.0 { 0.5 / value } else { 0.0 })
    }

    fn abs(self) -> Self {
        if self.value < 0.0 {
            self.negate()
        } else {
            self
        }
    }

    fn min(self, b: Self) -> Self {
        if self.value < b.value { self } else { b }
    }

    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }

    fn exp(self) -> Self {
        let value = Arithmetic::exp(self.value);
        self.chain(
            value,
            if self.value < LARGEST_EXPONENT {
                value
            } else {
                0.0
            },
        )
    }

    fn log(self) -> Self {
        let value = Arithmetic::log(self.value);
        self.chain(
            value,
            if self.value > SMALLEST {
                1.0 / self.value
            } else {
                0.0
            },
        )
    }
}
