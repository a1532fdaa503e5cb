//! A measured quantity, its expected value, and the tolerance.

use statrs::function::erf::{erfc, erfc_inv};
use std::fmt;

/// Allowed deviation of a mean, in standard errors.
const SIGMAS: f64 = 4.0;

/// Largest relative standard error for [`Tolerance::Sigmas`]: with a larger one the run would test nothing.
pub const PRECISION: f64 = 1e-3;

/// Added to a standard error, relative to the expected value: rounding of f32 sums and of a few hundred f32 factors.
const ROUNDING: f64 = 1e-5;

/// A mean of random samples and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

/// How far a quantity may be from what is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Not at all.
    Exact,
    /// By this much.
    Absolute(f64),
    /// By this fraction of the expected value; a standard error must be at most half of it.
    Relative(f64),
    /// By four standard errors, or more for several `comparisons`, so that the false-alarm rate is the same. A standard
    /// error must be at most 10⁻³ of the expected value.
    Sigmas {
        /// How many quantities are looked at together.
        comparisons: usize,
    },
    /// It may be anything below what is expected.
    Below,
    /// It may be anything above what is expected.
    Above,
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// What was measured.
    pub quantity: String,
    /// The value found.
    pub measured: f64,
    /// Its standard error, if it is a mean of random samples.
    pub error: Option<f64>,
    /// The value due.
    pub expected: f64,
    /// How far one may be from the other.
    pub tolerance: Tolerance,
}

impl Measure {
    /// A quantity without noise.
    pub fn new(
        quantity: impl Into<String>,
        measured: f64,
        expected: f64,
        tolerance: Tolerance,
    ) -> Self {
        Self {
            quantity: quantity.into(),
            measured,
            error: None,
            expected,
            tolerance,
        }
    }

    /// A mean of random samples.
    pub fn sampled(
        quantity: impl Into<String>,
        mean: Mean,
        expected: f64,
        tolerance: Tolerance,
    ) -> Self {
        Self {
            error: Some(mean.error),
            ..Self::new(quantity, mean.mean, expected, tolerance)
        }
    }

    /// A number of errors, which must be 0.
    pub fn none(quantity: impl Into<String>, mistakes: usize) -> Self {
        Self::new(quantity, mistakes as f64, 0.0, Tolerance::Exact)
    }

    /// Two means that should be equal.
    pub fn same(quantity: impl Into<String>, a: Mean, b: Mean) -> Self {
        let difference = Mean {
            mean: a.mean,
            error: a.error.hypot(b.error),
        };
        Self::sampled(
            quantity,
            difference,
            b.mean,
            Tolerance::Sigmas { comparisons: 1 },
        )
    }

    /// The largest of |mean - expected| in standard errors, over several means at once.
    pub fn farthest(quantity: &str, pairs: &[(Mean, f64)]) -> Self {
        let distance = |(m, expected): &(Mean, f64)| {
            (m.mean - expected).abs() / m.error.hypot(ROUNDING / SIGMAS * expected)
        };
        // A comparison with NaN is false, so NaN would be lost in a maximum.
        let worst =
            pairs.iter().map(distance).fold(
                0.0,
                |a: f64, b| {
                    if b.is_nan() { f64::INFINITY } else { a.max(b) }
                },
            );
        Self::new(
            format!("{quantity}: largest deviation of {}, in σ", pairs.len()),
            worst,
            sigmas(pairs.len()),
            Tolerance::Below,
        )
    }

    /// Whether the quantity is within the tolerance. NaN never is.
    pub fn passed(&self) -> bool {
        let off = (self.measured - self.expected).abs();
        let error = self.error.unwrap_or(0.0);
        let size = self.expected.abs();
        match self.tolerance {
            Tolerance::Exact => self.measured == self.expected,
            Tolerance::Absolute(t) => off <= t && error <= t / 2.0,
            Tolerance::Relative(t) => off <= t * size && error <= t * size / 2.0,
            Tolerance::Sigmas { comparisons } => {
                off <= sigmas(comparisons) * error + ROUNDING * size && error <= PRECISION * size
            }
            Tolerance::Below => self.measured < self.expected,
            Tolerance::Above => self.measured > self.expected,
        }
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quantity = &self.quantity;
        let [measured, expected, tolerance] = self.texts();
        write!(
            f,
            "{quantity}: {measured}, expected {expected} ({tolerance})"
        )
    }
}

impl Measure {
    /// Measured, expected and tolerance as they stand in a table.
    pub fn texts(&self) -> [String; 3] {
        let measured = match self.error {
            Some(e) => format!("{} ± {e:.1e}", digits(self.measured)),
            None => digits(self.measured),
        };
        let tolerance = match self.tolerance {
            Tolerance::Exact => "exact".to_owned(),
            Tolerance::Absolute(t) if t >= 1.0 => format!("± {t}"),
            Tolerance::Absolute(t) => format!("± {t:e}"),
            Tolerance::Relative(t) => format!("± {t:e} of it"),
            Tolerance::Sigmas { .. } => "4 σ".to_owned(),
            Tolerance::Below => "below".to_owned(),
            Tolerance::Above => "above".to_owned(),
        };
        [measured, digits(self.expected), tolerance]
    }
}

/// Six significant digits, and no more zeros than needed.
fn digits(x: f64) -> String {
    let size = x.abs();
    if x == x.round() && size < 1e9 {
        format!("{x:.0}")
    } else if (1e-3..1e6).contains(&size) {
        let places = (5.0 - size.log10().floor()) as usize;
        let text = format!("{x:.places$}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{x:.4e}")
    }
}

/// The number of standard errors that the largest of `comparisons` normal deviates exceeds as rarely as a single one
/// exceeds [`SIGMAS`] (Bonferroni).
fn sigmas(comparisons: usize) -> f64 {
    let rare = erfc(SIGMAS / std::f64::consts::SQRT_2);
    erfc_inv(rare / comparisons as f64) * std::f64::consts::SQRT_2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passes(measured: f64, expected: f64, tolerance: Tolerance) -> bool {
        Measure::new("", measured, expected, tolerance).passed()
    }

    #[test]
    fn tolerances_end_where_they_say() {
        use Tolerance::*;
        assert!(passes(0.0, 0.0, Exact) && !passes(1e-300, 0.0, Exact));
        assert!(passes(1.5, 1.0, Absolute(0.5)) && !passes(1.51, 1.0, Absolute(0.5)));
        assert!(passes(2.02, 2.0, Relative(0.0101)) && !passes(2.03, 2.0, Relative(0.0101)));
        assert!(passes(0.9, 1.0, Below) && !passes(1.0, 1.0, Below));
        assert!(passes(1.1, 1.0, Above) && !passes(1.0, 1.0, Above));
        for tolerance in [
            Exact,
            Absolute(1e9),
            Relative(1e9),
            Sigmas { comparisons: 1 },
            Below,
            Above,
        ] {
            assert!(!passes(f64::NAN, 1.0, tolerance), "{tolerance:?}");
        }
    }

    #[test]
    fn numbers_read_well() {
        for (x, text) in [
            (0.0, "0"),
            (-7.0, "-7"),
            (0.918_318_04, "0.918318"),
            (0.25, "0.25"),
            (2.310_4, "2.3104"),
            (99_999.5, "99999.5"),
            (5.784e-6, "5.7840e-6"),
            (0.999_999_99, "1"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(digits(x), text);
        }
        let mean = Mean {
            mean: 0.5,
            error: 1.23e-4,
        };
        let measure = Measure::sampled("T", mean, 0.5, Tolerance::Relative(1e-3));
        assert_eq!(
            measure.to_string(),
            "T: 0.5 ± 1.2e-4, expected 0.5 (± 1e-3 of it)"
        );
    }

    #[test]
    fn four_standard_errors_pass_and_noise_does_not() {
        let four = Tolerance::Sigmas { comparisons: 1 };
        let of = |mean, error| Measure::sampled("", Mean { mean, error }, 1.0, four).passed();
        assert!(of(1.0039, 1e-3) && !of(1.0042, 1e-3));
        assert!(!of(1.0, 1.1e-3), "too noisy to tell");
        let relative = Measure::sampled(
            "",
            Mean {
                mean: 1.0,
                error: 6e-4,
            },
            1.0,
            Tolerance::Relative(1e-3),
        );
        assert!(!relative.passed(), "too noisy to tell");
    }

    #[test]
    fn many_comparisons_allow_larger_deviations() {
        assert!((sigmas(1) - 4.0).abs() < 1e-9);
        // By Python's statistics.NormalDist: 6.334e-5 / 1000, two-sided, is 5.4091 standard deviations.
        assert!((sigmas(1000) - 5.4091).abs() < 1e-4, "{}", sigmas(1000));
    }

    #[test]
    fn the_largest_deviation_counts_and_nan_fails() {
        let mean = |mean| Mean { mean, error: 1e-3 };
        let far = Measure::farthest("", &[(mean(1.0), 1.0), (mean(1.005), 1.0)]);
        assert!(
            (far.measured - 5.0).abs() < 1e-3 && !far.passed(),
            "{far:?}"
        );
        assert!(Measure::farthest("", &[(mean(1.004), 1.0); 9]).passed());
        assert!(!Measure::farthest("", &[(mean(f64::NAN), 1.0), (mean(1.0), 1.0)]).passed());
    }
}
