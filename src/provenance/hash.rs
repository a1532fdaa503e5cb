//! The scene hash: two files with the same hash have the same expected picture.
//!
//! It covers the meaning of the scene and the settings that change what the picture converges to. Values
//! are hashed as they are read, so two descriptions of one surface (such as a plane, given by another of its points) have
//! different hashes. Scenes that differ never have the same hash. Order in the file counts only among surfaces of one kind
//! that coincide, since there it decides which one a ray meets.

use crate::scene::{Bsdf, Camera, Canonical, Light, Parameter, Primitive, Scene, Shape};
use crate::settings::{Integrator, LightParts, Settings};
use glam::DVec3;
use sha2::{Digest, Sha256};

/// Directions are rounded to this fraction of a unit. The length of a normal in the file leaves a trace in the last bits of the unit
/// vector, and must not count. No pixel is as narrow as this step.
const DIRECTION_STEP: f64 = 1.0 / (1u64 << 44) as f64;

/// SHA-256, in hexadecimal, of what the picture of `scene` under `settings` converges to.
///
/// Not covered: comments, layout, title, names, unused materials, order where it has no effect, and settings that change only
/// the noise (seed, strata, shadow rays).
pub fn scene_hash(scene: &Scene, settings: &Settings) -> String {
    hash_of(&Canonical::new(scene), settings)
}

/// The same as [`scene_hash`], of a scene in canonical order.
pub fn hash_of(scene: &Canonical, settings: &Settings) -> String {
    let mut h = Hasher(Sha256::new_with_prefix("etendue scene 2\0"));
    let scene = scene.scene();
    h.settings(settings);
    h.camera(&scene.camera);
    h.count(scene.primitives.len());
    for primitive in &scene.primitives {
        h.primitive(primitive, &scene.materials[primitive.material].bsdf);
    }
    h.count(scene.lights.len());
    for light in &scene.lights {
        h.light(light);
    }
    h.0.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

struct Hasher(Sha256);

impl Hasher {
    fn word(&mut self, word: &str) {
        self.count(word.len());
        self.0.update(word);
    }

    fn count(&mut self, n: usize) {
        self.0.update((n as u64).to_le_bytes());
    }

    fn number(&mut self, x: f64) {
        // -0 + 0 = +0: the two zeros are one.
        self.0.update((x + 0.0).to_bits().to_le_bytes());
    }

    fn vector(&mut self, v: DVec3) {
        for x in v.to_array() {
            self.number(x);
        }
    }

    /// A unit vector.
    fn direction(&mut self, v: DVec3) {
        for x in v.to_array() {
            self.number((x / DIRECTION_STEP).round());
        }
    }

    fn settings(&mut self, settings: &Settings) {
        // Every field is named, so that a new one cannot be forgotten here.
        let Settings {
            size,
            max_depth,
            max_depth_is_default: _,
            strata: _,
            seed: _,
            shadow_rays: _,
            light,
            integrator,
            // It decides how light is found, and not which.
            light_paths: _,
        } = settings;
        for n in [size[0], size[1], *max_depth] {
            self.0.update(n.to_le_bytes());
        }
        let LightParts {
            emitted,
            direct,
            indirect,
        } = *light;
        self.0.update([emitted, direct, indirect].map(u8::from));
        self.word(match integrator {
            Integrator::Path => "path",
            Integrator::Whitted => "whitted",
        });
    }

    fn camera(&mut self, camera: &Camera) {
        let Camera {
            eye,
            look_at,
            up,
            vfov,
            resolution: _, // settings.size stands in its place
        } = *camera;
        self.vector(eye);
        self.number(vfov);
        let forward = (look_at - eye).normalize();
        self.direction(forward);
        // Only the part of `up` across the view means anything.
        self.direction(forward.cross(up.normalize()).normalize());
    }

    fn primitive(&mut self, primitive: &Primitive, bsdf: &Bsdf) {
        self.word(primitive.shape.kind());
        match primitive.shape {
            Shape::Sphere { center, radius } => {
                self.vector(center);
                self.number(radius);
            }
            Shape::Plane { point, normal } => {
                self.vector(point);
                self.direction(normal);
            }
            Shape::Disk {
                center,
                normal,
                radius,
            } => {
                self.vector(center);
                self.direction(normal);
                self.number(radius);
            }
            Shape::Cylinder { base, top, radius } => {
                self.vector(base);
                self.vector(top);
                self.number(radius);
            }
            Shape::Implicit(ref implicit) => {
                let words = implicit.words();
                self.count(words.len());
                for word in words {
                    self.0.update(word.to_le_bytes());
                }
            }
        }
        self.bsdf(bsdf);
    }

    fn bsdf(&mut self, bsdf: &Bsdf) {
        self.word(bsdf.kind().name());
        for parameter in bsdf.parameters() {
            match parameter {
                Parameter::Color(_, color) => self.vector(color),
                Parameter::Number(_, x) => self.number(x),
            }
        }
    }

    fn light(&mut self, light: &Light) {
        let Light {
            center,
            normal,
            radius,
            radiance,
            line: _,
            column: _,
        } = *light;
        self.vector(center);
        self.direction(normal);
        self.number(radius);
        self.vector(radiance);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Place, RenderHints};
    use crate::settings::Overrides;

    fn scene() -> Scene {
        let diffuse = |r: f64| Bsdf::Diffuse {
            reflectance: DVec3::splat(r),
        };
        Scene {
            path: "a.toml".into(),
            row_files: Vec::new(),
            title: Some("one".into()),
            camera: Camera {
                eye: DVec3::new(0.0, 1.0, 4.0),
                look_at: DVec3::new(0.3, 1.0, 0.0),
                up: DVec3::Y,
                vfov: 40.0,
                resolution: [8, 6],
            },
            render: RenderHints::default(),
            materials: vec![
                Material {
                    name: "grey".into(),
                    bsdf: diffuse(0.5),
                    place: Place::default(),
                },
                Material {
                    name: "white".into(),
                    bsdf: diffuse(0.75),
                    place: Place::default(),
                },
            ],
            primitives: vec![
                Primitive {
                    shape: Shape::Sphere {
                        center: DVec3::ZERO,
                        radius: 0.5,
                    },
                    material: 1,
                    line: 3,
                    column: 0,
                },
                Primitive {
                    shape: Shape::Plane {
                        point: DVec3::ZERO,
                        normal: DVec3::new(1.0, 2.0, 3.0).normalize(),
                    },
                    material: 1,
                    line: 7,
                    column: 0,
                },
            ],
            lights: vec![Light {
                center: DVec3::new(0.0, 2.0, 0.0),
                normal: DVec3::NEG_Y,
                radius: 0.4,
                radiance: DVec3::splat(12.0),
                line: 9,
                column: 0,
            }],
        }
    }

    fn hash(scene: &Scene, flags: &Overrides) -> String {
        scene_hash(scene, &Settings::resolve(scene, flags))
    }

    type Edit = (&'static str, fn(&mut Scene, &mut Overrides));

    #[test]
    fn changes_without_effect_keep_the_hash() {
        let same: [Edit; 10] = [
            ("title", |s, _| s.title = None),
            ("path and lines", |s, _| {
                s.path = "b.toml".into();
                s.primitives[0].line = 77;
                s.lights[0].line = 78;
            }),
            ("unused material gone", |s, _| {
                s.materials.remove(0);
                s.primitives.iter_mut().for_each(|p| p.material = 0);
            }),
            ("order", |s, _| s.primitives.reverse()),
            ("names", |s, _| s.materials[1].name = "snow".into()),
            ("seed, strata, shadow rays", |_, f| {
                (f.seed, f.strata, f.shadow_rays) = (Some(5), Some(4), Some(3));
            }),
            ("the other zero", |s, _| {
                let Shape::Sphere { center, .. } = &mut s.primitives[0].shape else {
                    unreachable!()
                };
                *center = DVec3::new(-0.0, 0.0, -0.0);
            }),
            ("length of a normal", |s, _| {
                let Shape::Plane { normal, .. } = &mut s.primitives[1].shape else {
                    unreachable!()
                };
                *normal = DVec3::new(0.7, 1.4, 2.1).normalize();
            }),
            ("distance looked at, length and tilt of up", |s, _| {
                let c = &mut s.camera;
                c.up = DVec3::new(0.3, 5.0, -4.0);
                c.look_at = c.eye + (c.look_at - c.eye) * 3.0;
            }),
            ("the default max_depth, given explicitly", |_, f| {
                f.max_depth = Some(64);
            }),
        ];
        let expected = hash(&scene(), &Overrides::default());
        assert_eq!(expected.len(), 64);
        for (what, edit) in same {
            let (mut s, mut f) = (scene(), Overrides::default());
            edit(&mut s, &mut f);
            assert_eq!(hash(&s, &f), expected, "{what}");
        }
    }

    #[test]
    fn changes_of_the_expected_picture_change_the_hash() {
        let other: [Edit; 12] = [
            ("size", |_, f| f.size = Some([6, 8])),
            ("max_depth", |_, f| f.max_depth = Some(63)),
            ("light", |_, f| {
                f.light = Some(LightParts {
                    direct: false,
                    ..LightParts::ALL
                });
            }),
            ("integrator", |_, f| {
                f.integrator = Some(Integrator::Whitted);
            }),
            ("eye", |s, _| s.camera.eye.x = 1e-9),
            ("vfov", |s, _| s.camera.vfov = 40.000001),
            ("up", |s, _| s.camera.up.x = 1e-6),
            ("material", |s, _| s.primitives[0].material = 0),
            ("radius", |s, _| s.lights[0].radius = 0.4000001),
            ("radiance", |s, _| s.lights[0].radiance.y = 13.0),
            ("side of a light", |s, _| s.lights[0].normal = DVec3::Y),
            ("one light twice", |s, _| s.lights.push(s.lights[0])),
        ];
        let mut seen = vec![hash(&scene(), &Overrides::default())];
        for (what, edit) in other {
            let (mut s, mut f) = (scene(), Overrides::default());
            edit(&mut s, &mut f);
            let h = hash(&s, &f);
            assert!(!seen.contains(&h), "{what}");
            seen.push(h);
        }
    }
}
