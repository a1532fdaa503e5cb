//! Scenes in the formats of other renderers: Mitsuba 3 and pbrt-v4.
//!
//! What the other renderer has no equal for becomes what comes nearest, with a warning that says what differs. Infinite planes
//! become rectangles of what can be seen of them.

mod frame;
mod mitsuba;
mod pbrt;
mod planes;
mod text;

use crate::scene::{Bsdf, Diagnostic, Primitive, Scene, Shape};
use crate::settings::{Overrides, Settings};
use glam::DVec3;

/// The renderer to write for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Mitsuba 3: XML.
    Mitsuba,
    /// pbrt-v4.
    Pbrt,
}

/// A scene in the format of another renderer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// What differs from the scene, in words.
    pub warnings: Vec<String>,
}

/// The scene for another renderer, of `size` if that is given, with `samples` per pixel. `picture` is the name of the picture for
/// formats that have one.
///
/// # Errors
/// About a surface that no other renderer has.
pub fn export(
    scene: &Scene,
    target: Target,
    size: Option<[u32; 2]>,
    samples: u64,
    picture: &str,
) -> Result<Exported, Diagnostic> {
    let no_equal = |p: &&Primitive| matches!(p.shape, Shape::Implicit(_));
    if let Some(p) = scene.primitives.iter().find(no_equal) {
        return Err(Diagnostic {
            path: scene.path.clone(),
            line: p.line,
            column: p.column,
            message:
                "an implicit surface has no equal in other renderers: the scene can't be exported"
                    .into(),
            unreadable: false,
        });
    }
    let overrides = Overrides {
        size,
        ..Overrides::default()
    };
    let settings = Settings::resolve(scene, &overrides);
    Ok(match target {
        Target::Mitsuba => mitsuba::export(scene, &settings, samples),
        Target::Pbrt => pbrt::export(scene, &settings, samples, picture),
    })
}

/// The first line of a file: where it comes from.
fn origin(scene: &Scene) -> String {
    let title = scene.title.as_deref().unwrap_or("A scene");
    format!("{title}, exported by etendue {}", env!("CARGO_PKG_VERSION"))
}

/// Three numbers with blanks between them.
fn numbers(v: DVec3) -> String {
    // Adding 0 turns -0 into 0.
    format!("{} {} {}", v.x + 0.0, v.y + 0.0, v.z + 0.0)
}

/// A Phong material as a mix of a diffuse one and a rough mirror, neither of which the other renderer can add to the other.
struct Mix {
    /// Reflectance of the diffuse part.
    diffuse: DVec3,
    /// Reflectance of the rough mirror.
    mirror: DVec3,
    /// Share of the rough mirror, 0 to 1.
    share: f64,
    /// Width of a Beckmann distribution whose lobe is about as wide as cosⁿ.
    roughness: f64,
}

impl Mix {
    fn of(diffuse: DVec3, specular: DVec3, exponent: f64) -> Self {
        let (d, s) = (diffuse.max_element(), specular.max_element());
        let share = if d + s > 0.0 { s / (d + s) } else { 0.0 };
        // Weights and colours multiply to kd and ks. Colours above 1 are none.
        let part = |color: DVec3, share: f64| {
            if share > 0.0 {
                (color / share).min(DVec3::ONE)
            } else {
                DVec3::ZERO
            }
        };
        Self {
            diffuse: part(diffuse, 1.0 - share),
            mirror: part(specular, share),
            share,
            roughness: (2.0 / (exponent + 2.0)).sqrt().max(1e-3),
        }
    }
}

/// What differs of Phong.
const PHONG: &str = "the other renderer has no Phong, and gets a mix of a diffuse surface and a rough mirror, whose lobe has another \
                     shape and reflects more at grazing angles";

/// A warning about all materials that `differs` holds of; none where there are no such.
fn about(scene: &Scene, differs: impl Fn(&Bsdf) -> bool, what: &str) -> Option<String> {
    let materials = scene.materials.iter().filter(|m| differs(&m.bsdf));
    let names: Vec<&str> = materials.map(|m| m.name.as_str()).collect();
    let s = if names.len() == 1 { "" } else { "s" };
    (!names.is_empty()).then(|| format!("material{s} {}: {what}", names.join(", ")))
}

/// An index of refraction that is not 1, which the other renderers refuse.
fn not_one(ior: f64) -> f64 {
    if ior == 1.0 { 1.000_001 } else { ior }
}

/// What differs of an index of refraction of 1.
const NOT_ONE: &str = "ior = 1 becomes 1.000001, since the other renderer wants a difference";

/// Whether a material is glass of index 1.
fn is_nothing(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Dielectric { ior: 1.0, .. })
}

/// Whether a material is Phong's.
fn is_phong(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Phong { .. })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mix_reflects_what_phong_does() {
        let (kd, ks) = (DVec3::new(0.3, 0.1, 0.0), DVec3::splat(0.4));
        let mix = Mix::of(kd, ks, 60.0);
        assert!((mix.diffuse * (1.0 - mix.share)).abs_diff_eq(kd, 1e-12));
        assert!((mix.mirror * mix.share).abs_diff_eq(ks, 1e-12));
        for (kd, ks) in [
            (DVec3::ZERO, DVec3::ZERO),
            (DVec3::X, DVec3::new(0.0, 1.0, 1.0)),
        ] {
            let mix = Mix::of(kd, ks, 0.0);
            assert!(mix.diffuse.max_element() <= 1.0 && mix.mirror.max_element() <= 1.0);
            assert!((0.0..=1.0).contains(&mix.share) && mix.roughness == 1.0);
        }
    }
}
