//! Implicit surfaces, of formulas and of volumes: what the kernels meet against the f64 reference, which finds roots in another way, and against surfaces that
//! have a form of their own.

#[path = "../common/mod.rs"]
mod common;
mod cubics;
mod judge;
mod pictures;
mod rays;
mod rounded;
mod smooth;
mod volumes;

/// Formulas with the text of their bounds, each for another reason: a quadric, one with a cusp, a quartic, a surface with cusps, one with many double points, a
/// periodic sheet, sums of exponentials, a body with edges, quotients and roots.
const SURFACES: &[(&str, &str, &str)] = &[
    (
        "sphere",
        "x^2 + y^2 + z^2 - 1",
        "{ min = [-1.1, -1.1, -1.1], max = [1.1, 1.1, 0.7] }",
    ),
    ("cusp", "x^2 + y^2 - 0.5 z^3", "{ radius = 1.2 }"),
    (
        "torus",
        "(x^2 + y^2 + z^2 + 0.91)^2 - 4 (x^2 + y^2)",
        "{ min = [-1.4, -1.4, -0.4], max = [1.4, 1.4, 0.4] }",
    ),
    (
        "goursat",
        "x^4 + y^4 + z^4 - 1.8 (x^2 + y^2 + z^2) + 1.2",
        "{ radius = 1.9 }",
    ),
    (
        "barth",
        "4.23606797749979 (x^2 + y^2 + z^2 - 1)^2 \
         - 4 (2.618033988749895 x^2 - y^2) (2.618033988749895 y^2 - z^2) (2.618033988749895 z^2 - x^2)",
        "{ radius = 1.7 }",
    ),
    (
        "gyroid",
        "abs(sin(5 x) cos(5 y) + sin(5 y) cos(5 z) + sin(5 z) cos(5 x)) - 0.2",
        "{ min = [-1, -1, -1], max = [1, 1, 1] }",
    ),
    (
        "metaballs",
        "0.7 - exp(-4 ((x - 0.5)^2 + y^2 + z^2)) - exp(-4 ((x + 0.5)^2 + y^2 + z^2)) - exp(-6 (x^2 + (y - 0.6)^2 + z^2))",
        "{ min = [-1.5, -1, -1], max = [1.5, 1.5, 1] }",
    ),
    (
        "shell",
        "abs(sqrt(x^2 + y^2 + z^2) - 1) - 0.0005",
        "{ min = [-1.2, -1.2, -1.2], max = [1.2, 1.2, 0.8] }",
    ),
    (
        "bolt",
        "max(min(abs(x) + abs(y), 2 sqrt(x^2 + y^2)) - 0.9, abs(z) - 0.7 + 0.1 cos(6 x))",
        "{ radius = 1.5 }",
    ),
    (
        "quotient",
        "x^2 + y^2 - 0.3 / (1 + 4 z^2) - 0.05 log(2 + z)",
        "{ min = [-1, -1, -1.5], max = [1, 1, 1.5] }",
    ),
];

/// A scene of one such surface, `keys` of it, and the eye far outside or well inside.
fn scene_of(formula: &str, bounds: &str, keys: &str, eye: &str) -> String {
    format!(
        "[camera]\neye = {eye}\nlook_at = [0.01, 0.02, 0.03]\nvfov = 40\nresolution = [8, 8]\n\
         [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
         [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
         [[light]]\ncenter = [0, 90, 0]\nnormal = [0, -1, 0]\nradius = 1\nradiance = [1, 1, 1]\n\
         [[implicit]]\nf = '{formula}'\nbounds = {bounds}\n{keys}\n"
    )
}
