//! An eye so far away, or a field of view so narrow, that f32 rays cannot tell the pixels' edges.

use super::Warnings;
use crate::scene::{Place, Scene};

/// The width of a pixel, in shares of its distance, below which pictures of a GPU are wrong by more than their noise.
///
/// Its rays have directions in f32, which are 6·10⁻⁸ apart. Against the f64 reference, pictures of 64 x 48 pixels and 256 samples
/// are equal at 2·10⁻⁶, and off by some percent in blocks of 4 x 4 pixels at 6·10⁻⁷, whether the eye is far or the view narrow.
const NARROWEST: f64 = 1e-6;

/// Warns of a picture of this size whose pixels are too narrow for a GPU.
pub(super) fn warnings(scene: &Scene, size: [u32; 2]) -> Warnings {
    let vfov = scene.camera.vfov;
    let pixel = 2.0 * (vfov.to_radians() / 2.0).tan() / f64::from(size[1]);
    let mut warnings = Warnings::default();
    if pixel < NARROWEST {
        warnings.add(Place::default(), || {
            format!(
                "a pixel is only {pixel:.1e} of its distance wide (vfov {vfov:.3e} degrees, {} rows); below {NARROWEST:e} a GPU's \
                 rays are too coarse, and edges are at wrong places: --backend cpu is exact",
                size[1]
            )
        });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::super::tests::with;
    use super::super::{lint, lints};
    use crate::scene::Scene;
    use crate::scene::parse::parse_str;
    use std::path::Path;

    fn seen(vfov: &str) -> Scene {
        let text = with("").replace("vfov = 40", &format!("vfov = {vfov}"));
        parse_str(
            Path::new("test.toml"),
            &(text + "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'red'\n"),
        )
        .expect("legal")
    }

    /// 48 rows of 10⁻⁶ are 0.00275 degrees.
    #[test]
    fn narrow_pixels() {
        let told = |scene: &Scene, size| {
            let lints = lints(scene, size);
            let mut picture = lints.picture.iter();
            picture.any(|w| w.message.contains("of its distance wide"))
        };
        let [narrow, wide] = ["0.0027", "0.0028"].map(seen);
        assert!(told(&narrow, Some([64, 48])) && !told(&wide, Some([64, 48])));
        assert!(told(&wide, Some([128, 96])), "more rows are narrower");
        assert!(!told(&narrow, None), "the reference has f64");
        let message = &lint(&narrow)[0].message;
        assert!(message.contains("9.8e-7 of its distance"), "{message}");
        assert!(
            message.contains("vfov 2.700e-3 degrees, 48 rows"),
            "{message}"
        );
    }
}
