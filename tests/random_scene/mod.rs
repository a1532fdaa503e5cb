//! Random scenes of every size that the format allows.

use etendue::scene::{Bsdf, Camera, Light, Material, Place, Primitive, RenderHints, Scene, Shape};
use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;

/// Coordinates of every magnitude that is allowed.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        1 => Just(0.0),
        1 => (-1.0..1.0f64, -20..=15i32).prop_map(|(m, e)| m * 10f64.powi(e)),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![
        0.01..10.0,
        (1.0..10.0f64, -15..=14i32).prop_map(|(m, e)| m * 10f64.powi(e))
    ]
}

fn unit() -> impl Strategy<Value = DVec3> {
    point()
        .prop_filter("not null", |v| v.length() > 1e-3)
        .prop_map(DVec3::normalize)
}

fn share() -> impl Strategy<Value = DVec3> {
    [0.0..=1.0, 0.0..=1.0, 0.0..=1.0].prop_map(DVec3::from_array)
}

fn bsdf() -> impl Strategy<Value = Bsdf> {
    prop_oneof![
        share().prop_map(|reflectance| Bsdf::Diffuse { reflectance }),
        share().prop_map(|reflectance| Bsdf::Mirror { reflectance }),
        (1e-6..1e6, share())
            .prop_map(|(ior, transmittance)| Bsdf::Dielectric { ior, transmittance }),
        (share(), share(), 0.0..1e6).prop_map(|(diffuse, x, exponent)| Bsdf::Phong {
            diffuse,
            specular: x * (1.0 - diffuse),
            exponent,
        }),
    ]
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        (point(), radius()).prop_map(|(center, radius)| Shape::Sphere { center, radius }),
        (point(), unit()).prop_map(|(point, normal)| Shape::Plane { point, normal }),
        (point(), unit(), radius()).prop_map(|(center, normal, radius)| Shape::Disk {
            center,
            normal,
            radius
        }),
        (point(), point(), radius())
            .prop_filter("some length", |(base, top, _)| base.distance(*top) >= 1e-15)
            .prop_map(|(base, top, radius)| Shape::Cylinder { base, top, radius }),
    ]
}

fn light() -> impl Strategy<Value = Light> {
    (point(), unit(), radius(), share(), 0.0..1e15).prop_map(
        |(center, normal, radius, color, power)| Light {
            center,
            normal,
            radius,
            radiance: color * power,
            line: 0,
            column: 0,
        },
    )
}

fn camera() -> impl Strategy<Value = Camera> {
    let view = (point(), point(), unit());
    (view, 0.1..179.9, [1..=65536u32, 1..=65536u32])
        .prop_filter("a view not along up", |((eye, look_at, up), _, _)| {
            let view = *look_at - *eye;
            view.length() > 1e-6 && view.normalize().cross(*up).length() > 1e-6
        })
        .prop_map(|((eye, look_at, up), vfov, resolution)| Camera {
            eye,
            look_at,
            up,
            vfov,
            resolution,
        })
}

/// Valid scenes; the names of materials are such that TOML must quote some.
pub fn scenes() -> impl Strategy<Value = Scene> {
    let materials = vec(("[a-z .\"\\\\é-]{0,4}", bsdf()), 1..5);
    let primitives = vec((shape(), any::<prop::sample::Index>()), 1..12);
    let hint = || prop::option::of(1..1000u32);
    let rest = (prop::option::of(".*"), hint(), hint(), hint());
    (camera(), materials, primitives, vec(light(), 1..4), rest).prop_map(
        |(camera, materials, primitives, lights, (title, max_depth, strata, seed))| {
            let materials: std::collections::BTreeMap<String, Bsdf> =
                materials.into_iter().collect();
            let materials: Vec<Material> = materials
                .into_iter()
                .map(|(name, bsdf)| Material {
                    name,
                    bsdf,
                    place: Place::default(),
                })
                .collect();
            let primitives = primitives.into_iter().filter_map(|(shape, index)| {
                let material = index.index(materials.len());
                let is_glass = matches!(materials[material].bsdf, Bsdf::Dielectric { .. });
                let refused = is_glass && matches!(shape, Shape::Disk { .. });
                (!refused).then_some(Primitive {
                    shape,
                    material,
                    line: 0,
                    column: 0,
                })
            });
            let mut primitives: Vec<Primitive> = primitives.collect();
            if primitives.is_empty() {
                primitives.push(Primitive {
                    shape: Shape::Sphere {
                        center: DVec3::ZERO,
                        radius: 1.0,
                    },
                    material: 0,
                    line: 0,
                    column: 0,
                });
            }
            primitives.sort_by_key(|p| {
                ["sphere", "plane", "disk", "cylinder"]
                    .iter()
                    .position(|&kind| kind == p.shape.kind())
            });
            Scene {
                path: "random.toml".into(),
                row_files: Vec::new(),
                title,
                camera,
                render: RenderHints {
                    max_depth,
                    strata,
                    seed,
                },
                materials,
                primitives,
                lights,
            }
        },
    )
}
