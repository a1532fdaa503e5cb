//! Materials: what they are, the keys of their tables, and their parameters.
//!
//! Everything about a material that the scene's side needs is here: reading, the schema, text, order and hash use
//! [`Bsdf::parameters`]. How it scatters stands in `reference/path.rs` and in `shaders/bsdf/NAME.wgsl`.

use super::format::Table;
use super::value::{Exponent, Ior, Share};
use glam::DVec3;

/// Scattering models; colours are linear RGB, 0..=1 per channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bsdf {
    /// Lambertian, f = reflectance / π.
    Diffuse {
        /// Hemispherical albedo.
        reflectance: DVec3,
    },
    /// Perfect mirror.
    Mirror {
        /// Factor on the incoming radiance.
        reflectance: DVec3,
    },
    /// Smooth boundary of a solid.
    Dielectric {
        /// Index inside divided by the index just outside, > 0.
        ior: f64,
        /// Tint, once per refraction.
        transmittance: DVec3,
    },
    /// f = diffuse/π + specular (n+2)/(2π) cosⁿα (Lafortune & Willems 1994).
    Phong {
        /// kd.
        diffuse: DVec3,
        /// ks; kd + ks <= 1 per channel.
        specular: DVec3,
        /// n >= 0.
        exponent: f64,
    },
}

/// A parameter of a material: its key in the scene file, and its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Parameter {
    /// Linear RGB.
    Color(&'static str, DVec3),
    Number(&'static str, f64),
}

impl Bsdf {
    /// The type of the material.
    pub(crate) fn kind(&self) -> MaterialKind {
        match self {
            Self::Diffuse { .. } => MaterialKind::Diffuse,
            Self::Mirror { .. } => MaterialKind::Mirror,
            Self::Dielectric { .. } => MaterialKind::Dielectric,
            Self::Phong { .. } => MaterialKind::Phong,
        }
    }

    /// Every parameter, in a fixed order. The scene hash covers them in this order, so it must not change.
    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        use Parameter::{Color, Number};
        match *self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => {
                vec![Color("reflectance", reflectance)]
            }
            Self::Dielectric { ior, transmittance } => {
                vec![Number("ior", ior), Color("transmittance", transmittance)]
            }
            Self::Phong {
                diffuse,
                specular,
                exponent,
            } => vec![
                Color("diffuse", diffuse),
                Color("specular", specular),
                Number("exponent", exponent),
            ],
        }
    }

    /// Its parameters that are colours, in their order.
    pub(crate) fn colors(&self) -> Vec<DVec3> {
        let color = |p| match p {
            Parameter::Color(_, c) => Some(c),
            Parameter::Number(..) => None,
        };
        self.parameters().into_iter().filter_map(color).collect()
    }

    /// Its parameters that are numbers, in their order.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let number = |p| match p {
            Parameter::Number(_, x) => Some(x),
            Parameter::Color(..) => None,
        };
        self.parameters().into_iter().filter_map(number).collect()
    }

    /// Whether it bounds a solid that light enters.
    pub(crate) fn is_dielectric(&self) -> bool {
        matches!(self, Self::Dielectric { .. })
    }
}

macro_rules! material_kinds {
    ($($kind:ident = $name:literal,)*) => {
        /// The `type` of a material. Shaders know it by its number.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub(crate) enum MaterialKind {
            $($kind,)*
        }

        impl MaterialKind {
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// Its name in scene files, and in the shaders' functions: `sample_NAME`, `evaluate_NAME`, `is_NAME`.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }
        }
    };
}

// The order is that of their numbers. A new one comes last.
material_kinds! {
    Diffuse = "diffuse",
    Mirror = "mirror",
    Dielectric = "dielectric",
    Phong = "phong",
}

impl MaterialKind {
    /// Whether it scatters into a few directions only, so that there is nothing to evaluate.
    pub fn is_specular(self) -> bool {
        match self {
            Self::Mirror | Self::Dielectric => true,
            Self::Diffuse | Self::Phong => false,
        }
    }

    /// Whether it has a lobe: light from some directions counts far more than from others.
    pub fn is_glossy(self) -> bool {
        match self {
            Self::Phong => true,
            Self::Diffuse | Self::Mirror | Self::Dielectric => false,
        }
    }

    /// Whether light sampling covers all its directions about as well as sampling by the cosine does. Then light sampling alone counts,
    /// and `Scattered.pdf` is 0. Either answer is right; the wrong one is noisy.
    pub fn is_matt(self) -> bool {
        match self {
            Self::Diffuse => true,
            Self::Mirror | Self::Dielectric | Self::Phong => false,
        }
    }

    /// Its description in the schema.
    pub fn about(self) -> &'static str {
        match self {
            Self::Diffuse => "Lambertian reflection on both sides.",
            Self::Mirror => "Perfect mirror on both sides.",
            Self::Dielectric => "Smooth boundary of a solid such as glass. Not allowed on disks.",
            Self::Phong => {
                "Modified Phong (Lafortune & Willems 1994). diffuse + specular is at most 1 per channel."
            }
        }
    }

    /// Reads `[material.NAME]`, except for its `type`.
    pub(super) fn read(self, t: &mut impl Table) -> Option<Bsdf> {
        match self {
            Self::Diffuse => {
                let reflectance = t.required::<Share>("reflectance", "Hemispherical albedo.")?;
                Some(Bsdf::Diffuse {
                    reflectance: reflectance.0,
                })
            }
            Self::Mirror => {
                let about = "Factor on the reflected radiance.";
                let reflectance = t.defaulted("reflectance", Share(DVec3::ONE), about)?;
                Some(Bsdf::Mirror {
                    reflectance: reflectance.0,
                })
            }
            Self::Dielectric => {
                /// Crown glass, the report's.
                const GLASS: Ior = Ior(1.52);
                let about = "Index of refraction, inside divided by outside.";
                let ior = t.defaulted("ior", GLASS, about);
                let about = "Tint, applied once per refraction.";
                let transmittance = t.defaulted("transmittance", Share(DVec3::ONE), about);
                Some(Bsdf::Dielectric {
                    ior: ior?.0,
                    transmittance: transmittance?.0,
                })
            }
            Self::Phong => phong(t),
        }
    }
}

fn phong(t: &mut impl Table) -> Option<Bsdf> {
    /// Decimal fractions such as 0.9 + 0.1 may come out above 1 by a rounding.
    const ROUNDING: f64 = 1e-9;

    let diffuse = t.required::<Share>("diffuse", "kd: albedo of the diffuse part.");
    let specular = t.required::<Share>("specular", "ks: albedo of the specular lobe.");
    let exponent = t.required::<Exponent>(
        "exponent",
        "n: the lobe is proportional to the cosine to the power n.",
    );
    let (diffuse, specular) = (diffuse?.0, specular?.0);
    let sum = diffuse + specular;
    if let Some(i) = (0..3).find(|&i| sum[i] > 1.0 + ROUNDING) {
        let message = format!(
            "diffuse[{i}] + specular[{i}] is {} + {} = {}, but must be at most 1",
            diffuse[i], specular[i], sum[i]
        );
        t.refuse("specular", message);
        return None;
    }
    Some(Bsdf::Phong {
        diffuse,
        specular,
        exponent: exponent?.0,
    })
}
