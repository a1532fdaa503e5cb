//! The kinds of value in scene files. Each kind parses its values, states its rule, and describes itself as JSON Schema.

use super::rows::{MAPS, Map};
use glam::DVec3;
use serde_json::{Value as Json, json};
use std::ops::Range;
use toml::Spanned;
use toml::de::DeValue;

/// Largest magnitude of coordinates, and of radiance: its square is still finite in f32, which the
/// kernels use.
pub const LARGEST: f64 = 1e15;
/// Smallest radius and length: its square is still a normal number in f32.
pub const SMALLEST: f64 = 1e-15;
/// Indices of refraction lie between this and its inverse: their fourth power, which Fresnel's
/// equations come near, is a normal number in f32.
pub const LARGEST_IOR: f64 = 1e6;
/// Largest Phong exponent; n + 2 and its logarithm stay far inside f32.
pub const LARGEST_EXPONENT: f64 = 1e15;
/// Width and height of a picture in pixels.
pub const LARGEST_RESOLUTION: u32 = 65536;
/// Most strata per side: with 1024, one round is already a million samples per pixel.
pub const LARGEST_STRATA: u32 = 1024;

/// A place in the file that breaks a rule: its span, and the index in the array, if it is in one.
pub(super) struct Wrong {
    pub(super) span: Range<usize>,
    pub(super) index: Option<usize>,
}

/// A kind of value.
pub(super) trait Value: Sized {
    /// What is allowed, to follow "must be".
    fn rule() -> String;
    /// The value, or the part of it that breaks the rule.
    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong>;
    /// Its type and limits as JSON Schema.
    fn schema() -> Json;
    /// As it would stand in a file.
    fn to_json(&self) -> Json;
}

/// A kind of value that is one number; none if it breaks the rule.
pub(super) trait FromNumber: Value {
    fn from_number(x: f64) -> Option<Self>;
}

/// A kind of value that is three numbers; none if they break the rule.
pub(super) trait FromVector: Value {
    fn from_vector(v: DVec3) -> Option<Self>;
    /// What is allowed for each alone, to follow "must be".
    fn rule_of_one() -> String;
}

/// Numbers from `low` to `high`; both ends belong to it unless `open`.
struct Interval {
    low: f64,
    high: f64,
    open: bool,
    /// The reason for limits that the quantity itself does not have.
    why: &'static str,
}

const F32: &str = " (limits of f32 kernels)";

/// A rule without the reason for its limits, for what is no number at all.
pub(super) fn without_reason(rule: &str) -> String {
    rule.replace(F32, "")
}

const SHARE: Interval = Interval::closed(0.0, 1.0, "");
const COORDINATE: Interval = Interval::closed(-LARGEST, LARGEST, F32);
const LENGTH: Interval = Interval::closed(SMALLEST, LARGEST, F32);
const LIGHT: Interval = Interval::closed(0.0, LARGEST, F32);
const IOR: Interval = Interval::closed(1.0 / LARGEST_IOR, LARGEST_IOR, F32);
const EXPONENT: Interval = Interval::closed(0.0, LARGEST_EXPONENT, F32);
const LEVEL: Interval = Interval::closed(-LARGEST, LARGEST, F32);
const FINITE: Interval = Interval::closed(-f64::MAX, f64::MAX, "");
const ANGLE: Interval = Interval {
    low: 0.0,
    high: 180.0,
    open: true,
    why: "",
};

impl Interval {
    const fn closed(low: f64, high: f64, why: &'static str) -> Self {
        Self {
            low,
            high,
            open: false,
            why,
        }
    }

    /// NaN lies in no interval.
    fn holds(&self, x: f64) -> bool {
        if self.open {
            x > self.low && x < self.high
        } else {
            x >= self.low && x <= self.high
        }
    }

    fn rule(&self) -> String {
        let Self { low, high, why, .. } = self;
        if self.high == f64::MAX {
            "that is finite".into()
        } else if self.open {
            format!("above {low} and below {high}{why}")
        } else {
            format!("from {} to {}{why}", brief(*low), brief(*high))
        }
    }

    fn schema(&self) -> Json {
        if self.open {
            json!({"type": "number", "exclusiveMinimum": self.low, "exclusiveMaximum": self.high})
        } else if self.high == f64::MAX {
            json!({"type": "number"})
        } else {
            json!({"type": "number", "minimum": self.low, "maximum": self.high})
        }
    }

    fn number(&self, found: &Spanned<DeValue>) -> Option<f64> {
        number(found.get_ref()).filter(|&x| self.holds(x))
    }

    fn read(&self, found: &Spanned<DeValue>) -> Result<f64, Wrong> {
        self.number(found).ok_or_else(|| wrong(found))
    }

    fn read_three(&self, found: &Spanned<DeValue>) -> Result<DVec3, Wrong> {
        let [x, y, z] = array(found, |v| self.number(v))?;
        Ok(DVec3::new(x, y, z))
    }

    fn schema_three(&self) -> Json {
        json!({"type": "array", "items": self.schema(), "minItems": 3, "maxItems": 3})
    }
}

/// Large and small numbers as powers of ten: 1e15, not 1000000000000000.
fn brief(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) {
        format!("{x:e}")
    } else {
        x.to_string()
    }
}

pub(super) fn wrong(found: &Spanned<DeValue>) -> Wrong {
    Wrong {
        span: found.span(),
        index: None,
    }
}

/// Integers stand for floats; what overflows is infinite.
pub(super) fn number(found: &DeValue) -> Option<f64> {
    match found {
        DeValue::Float(x) => x.as_str().parse().ok(),
        DeValue::Integer(_) => match whole(found) {
            Some(i) => Some(i as f64),
            None => Some(f64::INFINITY),
        },
        _ => None,
    }
}

fn whole(found: &DeValue) -> Option<i128> {
    let DeValue::Integer(i) = found else {
        return None;
    };
    i128::from_str_radix(i.as_str(), i.radix()).ok()
}

fn count(found: &DeValue, low: u32, high: u32) -> Option<u32> {
    let n = u32::try_from(whole(found)?).ok()?;
    (low..=high).contains(&n).then_some(n)
}

/// An array of `N` values that `element` accepts.
pub(super) fn array<T, const N: usize>(
    found: &Spanned<DeValue>,
    element: impl Fn(&Spanned<DeValue>) -> Option<T>,
) -> Result<[T; N], Wrong> {
    let items = found.get_ref().as_array().ok_or_else(|| wrong(found))?;
    if items.len() != N {
        return Err(wrong(found));
    }
    let mut values = Vec::with_capacity(N);
    for (i, item) in items.iter().enumerate() {
        values.push(element(item).ok_or_else(|| Wrong {
            span: item.span(),
            index: Some(i),
        })?);
    }
    values.try_into().map_err(|_| wrong(found))
}

/// `v` with length 1, however long or short it is; none for the null vector.
pub(super) fn normalized(v: DVec3) -> Option<DVec3> {
    // Scaled first: squares of coordinates beyond 1e±154 overflow or vanish.
    let largest = v.abs().max_element();
    (largest > 0.0).then(|| (v / largest).normalize())
}

/// A kind of value that is one number or three of them in an interval.
macro_rules! numbers {
    ($($(#[$doc:meta])* $name:ident: one of $interval:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub(super) struct $name(pub(super) f64);
        impl Value for $name {
            fn rule() -> String {
                format!("a number {}", $interval.rule())
            }
            fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
                $interval.read(found).map(Self)
            }
            fn schema() -> Json {
                $interval.schema()
            }
            fn to_json(&self) -> Json {
                json!(self.0)
            }
        }
        impl FromNumber for $name {
            fn from_number(x: f64) -> Option<Self> {
                $interval.holds(x).then_some(Self(x))
            }
        }
    )*};
    ($($(#[$doc:meta])* $name:ident: three of $interval:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub(super) struct $name(pub(super) DVec3);
        impl Value for $name {
            fn rule() -> String {
                format!("three numbers {}", $interval.rule())
            }
            fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
                $interval.read_three(found).map(Self)
            }
            fn schema() -> Json {
                $interval.schema_three()
            }
            fn to_json(&self) -> Json {
                json!(self.0.to_array())
            }
        }
        impl FromVector for $name {
            fn from_vector(v: DVec3) -> Option<Self> {
                v.to_array().iter().all(|x| $interval.holds(*x)).then_some(Self(v))
            }
            fn rule_of_one() -> String {
                format!("a number {}", $interval.rule())
            }
        }
    )*};
}

numbers! {
    /// A radius.
    Radius: one of LENGTH;
    /// A field of view in degrees.
    Angle: one of ANGLE;
    /// An index of refraction, inside / outside.
    Ior: one of IOR;
    /// A Phong exponent.
    Exponent: one of EXPONENT;
    /// Any finite number.
    Finite: one of FINITE;
    /// A value of a formula.
    Level: one of LEVEL;
}

numbers! {
    /// A position.
    Point: three of COORDINATE;
    /// Lengths along three axes.
    Lengths: three of LENGTH;
    /// A share of the light, red, green and blue.
    Share: three of SHARE;
    /// An emitted radiance, red, green and blue.
    Radiance: three of LIGHT;
}

/// A direction; unit length, whatever length the file has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction(pub(super) DVec3);

impl Value for Direction {
    fn rule() -> String {
        "three finite numbers, not all 0".into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let v = FINITE.read_three(found)?;
        normalized(v).map(Self).ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        let mut schema = FINITE.schema_three();
        schema["contains"] = json!({"not": {"const": 0}});
        schema
    }

    fn to_json(&self) -> Json {
        json!(self.0.to_array())
    }
}

impl FromVector for Direction {
    fn from_vector(v: DVec3) -> Option<Self> {
        let finite = v.to_array().iter().all(|x| FINITE.holds(*x));
        normalized(v).filter(|_| finite).map(Self)
    }

    fn rule_of_one() -> String {
        "a finite number".into()
    }
}

/// Width and height in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution(pub(super) [u32; 2]);

impl Value for Resolution {
    fn rule() -> String {
        format!("[width, height], two whole numbers from 1 to {LARGEST_RESOLUTION}")
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        array(found, |v| count(v.get_ref(), 1, LARGEST_RESOLUTION)).map(Self)
    }

    fn schema() -> Json {
        let side = json!({"type": "integer", "minimum": 1, "maximum": LARGEST_RESOLUTION});
        json!({"type": "array", "items": side, "minItems": 2, "maxItems": 2})
    }

    fn to_json(&self) -> Json {
        json!(self.0)
    }
}

/// A whole number from `LOW` to `HIGH`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Count<const LOW: u32, const HIGH: u32>(pub(super) u32);

impl<const LOW: u32, const HIGH: u32> Value for Count<LOW, HIGH> {
    fn rule() -> String {
        format!("a whole number from {LOW} to {HIGH}")
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let n = count(found.get_ref(), LOW, HIGH);
        n.map(Self).ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        json!({"type": "integer", "minimum": LOW, "maximum": HIGH})
    }

    fn to_json(&self) -> Json {
        json!(self.0)
    }
}

impl Value for Map {
    fn rule() -> String {
        let names = MAPS.map(|m| m.0).join(", ");
        format!("the name of a colour map: {names}")
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let name = found.get_ref().as_str();
        let map = MAPS.iter().position(|m| Some(m.0) == name);
        map.map(Self).ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        json!({"enum": MAPS.map(|m| m.0)})
    }

    fn to_json(&self) -> Json {
        json!(MAPS[self.0].0)
    }
}

/// Whether something is so.
#[derive(Debug, Clone, Copy)]
pub(super) struct Truth(pub(super) bool);

impl Value for Truth {
    fn rule() -> String {
        "true or false".into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        found
            .get_ref()
            .as_bool()
            .map(Self)
            .ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        json!({"type": "boolean"})
    }

    fn to_json(&self) -> Json {
        json!(self.0)
    }
}

/// A string.
#[derive(Debug, Clone)]
pub(super) struct Text(pub(super) String);

impl Value for Text {
    fn rule() -> String {
        "a string".into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let text = found.get_ref().as_str().ok_or_else(|| wrong(found))?;
        Ok(Self(text.to_owned()))
    }

    fn schema() -> Json {
        json!({"type": "string"})
    }

    fn to_json(&self) -> Json {
        json!(self.0)
    }
}

#[cfg(test)]
mod tests;
