//! Interval arithmetic in f64 with outward rounding: what is true of every number of an interval.

use super::arithmetic::{Arithmetic, LARGEST_EXPONENT, SMALLEST};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The numbers from `low` to `high`.
#[expect(missing_docs, reason = "its text says what they are")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// All numbers.
    pub const ALL: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// The numbers from `low` to `high`, which are exact.
    pub fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// The numbers from `low` to `high`, which have been rounded once.
    fn rounded(low: f64, high: f64) -> Self {
        // Infinities less infinities are anything.
        Self {
            low: if low.is_nan() {
                f64::NEG_INFINITY
            } else {
                low.next_down()
            },
            high: if high.is_nan() {
                f64::INFINITY
            } else {
                high.next_up()
            },
        }
    }

    /// The same where a library's function, which may be off by a few roundings, has made them.
    fn loose(low: f64, high: f64) -> Self {
        const ROUNDINGS: f64 = 4.0 * f64::EPSILON;
        Self::rounded(low - low.abs() * ROUNDINGS, high + high.abs() * ROUNDINGS)
    }

    /// Whether `x` is one of them.
    pub fn holds(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// All numbers of both, and those between.
    fn hull(self, b: Self) -> Self {
        Self::new(self.low.min(b.low), self.high.max(b.high))
    }
}

/// The sine of an interval that starts at `low` and ends at `high`.
fn sine(low: f64, high: f64) -> Interval {
    if !(high - low < TAU && low.abs() < 1e8) {
        return Interval::new(-1.0, 1.0);
    }
    // Whether a maximum, at π/2 + 2πk, or a minimum, at -π/2 + 2πk, may lie in it.
    let near = |extreme: f64| {
        const SLACK: f64 = 1e-6;
        let next = ((low - SLACK - extreme) / TAU).ceil() * TAU + extreme;
        next <= high + SLACK
    };
    let (a, b) = (low.sin(), high.sin());
    let r = Interval::loose(a.min(b), a.max(b));
    Interval::new(
        if near(-FRAC_PI_2) { -1.0 } else { r.low },
        if near(FRAC_PI_2) { 1.0 } else { r.high },
    )
}

impl Arithmetic for Interval {
    fn number(n: f64) -> Self {
        Self::new(n, n)
    }

    fn add(self, b: Self) -> Self {
        Self::rounded(self.low + b.low, self.high + b.high)
    }

    fn negate(self) -> Self {
        Self::new(-self.high, -self.low)
    }

    fn multiply(self, b: Self) -> Self {
        // 0 times infinity is 0 here: the infinity stands for large numbers.
        let product = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
        let p = [
            product(self.low, b.low),
            product(self.low, b.high),
            product(self.high, b.low),
            product(self.high, b.high),
        ];
        Self::rounded(
            p.into_iter().fold(f64::INFINITY, f64::min),
            p.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    fn inverse(self) -> Self {
        const LARGEST: f64 = 1.0 / SMALLEST;
        if self.low > 0.0 {
            Self::rounded(1.0 / self.high.max(SMALLEST), 1.0 / self.low.max(SMALLEST))
        } else if self.high < 0.0 {
            Self::rounded(
                1.0 / self.high.min(-SMALLEST),
                1.0 / self.low.min(-SMALLEST),
            )
        } else {
            Self::rounded(-LARGEST, LARGEST)
        }
    }

    fn square(self) -> Self {
        let Self { low, high } = self.abs();
        Self::new((low * low).next_down().max(0.0), (high * high).next_up())
    }

    fn sqrt(self) -> Self {
        let [low, high] = [self.low, self.high].map(Arithmetic::sqrt);
        Self::new(low.next_down().max(0.0), high.next_up())
    }

    fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            self.negate()
        } else {
            Self::new(0.0, self.high.max(-self.low))
        }
    }

    fn min(self, b: Self) -> Self {
        Self::new(self.low.min(b.low), self.high.min(b.high))
    }

    fn sin(self) -> Self {
        sine(self.low, self.high)
    }

    fn cos(self) -> Self {
        let shifted = self.add(Self::rounded(FRAC_PI_2, FRAC_PI_2));
        sine(shifted.low, shifted.high)
    }

    fn exp(self) -> Self {
        let [low, high] = [self.low, self.high].map(|x| x.min(LARGEST_EXPONENT).exp());
        Self::loose(low, high)
    }

    fn log(self) -> Self {
        let [low, high] = [self.low, self.high].map(|x| x.max(SMALLEST).ln());
        Self::loose(low, high)
    }
}

/// The values of a function on an interval, and those of its derivative.
#[expect(missing_docs, reason = "its text says what they are")]
#[derive(Debug, Clone, Copy)]
pub struct Varying {
    pub value: Interval,
    pub slope: Interval,
}

impl Varying {
    fn chain(self, value: Interval, derivative: Interval) -> Self {
        let slope = self.slope.multiply(derivative);
        Self { value, slope }
    }
}

impl Arithmetic for Varying {
    fn number(n: f64) -> Self {
        Self {
            value: Interval::number(n),
            slope: Interval::number(0.0),
        }
    }

    fn add(self, b: Self) -> Self {
        Self {
            value: self.value.add(b.value),
            slope: self.slope.add(b.slope),
        }
    }

    fn negate(self) -> Self {
        Self {
            value: self.value.negate(),
            slope: self.slope.negate(),
        }
    }

    fn multiply(self, b: Self) -> Self {
        Self {
            value: self.value.multiply(b.value),
            slope: self
                .slope
                .multiply(b.value)
                .add(b.slope.multiply(self.value)),
        }
    }

    fn inverse(self) -> Self {
        let value = self.value.inverse();
        let derivative = if self.value.holds(0.0) {
            Interval::ALL
        } else {
            value.square().negate()
        };
        self.chain(value, derivative)
    }

    fn square(self) -> Self {
        self.chain(
            self.value.square(),
            self.value.multiply(Interval::number(2.0)),
        )
    }

    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let derivative = if self.value.low > 0.0 {
            value.multiply(Interval::number(2.0)).inverse()
        } else {
            Interval::new(0.0, f64::INFINITY)
        };
        self.chain(value, derivative)
    }

    fn abs(self) -> Self {
        let sign = Interval::new(
            if self.value.low > 0.0 { 1.0 } else { -1.0 },
            if self.value.high < 0.0 { -1.0 } else { 1.0 },
        );
        self.chain(self.value.abs(), sign)
    }

    fn min(self, b: Self) -> Self {
        let slope = if self.value.high < b.value.low {
            self.slope
        } else if b.value.high < self.value.low {
            b.slope
        } else {
            self.slope.hull(b.slope)
        };
        Self {
            value: self.value.min(b.value),
            slope,
        }
    }

    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    fn cos(self) -> Self {
        self.chain(self.value.cos(), self.value.sin().negate())
    }

    fn exp(self) -> Self {
        let value = self.value.exp();
        let kinked = self.value.high > LARGEST_EXPONENT;
        let zero = Interval::number(0.0);
        self.chain(value, if kinked { value.hull(zero) } else { value })
    }

    fn log(self) -> Self {
        let derivative = if self.value.low > SMALLEST {
            self.value.inverse()
        } else {
            Interval::new(0.0, f64::INFINITY)
        };
        self.chain(self.value.log(), derivative)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_of_intervals_hold_all_sines() {
        for k in 0..2000 {
            let low = f64::from(k) * 0.37 - 300.0;
            let wide = f64::from(k % 40) * 0.17;
            let (s, c) = (
                Interval::new(low, low + wide).sin(),
                Interval::new(low, low + wide).cos(),
            );
            let (mut least, mut greatest) = (2.0f64, -2.0f64);
            for j in 0..=400 {
                let x = low + wide * f64::from(j) / 400.0;
                assert!(s.holds(x.sin()) && c.holds(x.cos()), "{low} {wide}");
                (least, greatest) = (least.min(x.sin()), greatest.max(x.sin()));
            }
            // And few others.
            assert!(
                s.low > least - 1e-3 && s.high < greatest + 1e-3,
                "{low} {wide}: {s:?}"
            );
        }
        assert!((Interval::new(0.0, 2.0 * FRAC_PI_2).sin().low).abs() < 1e-12);
    }
}
