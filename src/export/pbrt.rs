//! pbrt-v4's format.

use super::text::Text;
use super::{Exported, Mix, frame, not_one, numbers, origin};
use crate::scene::{Bsdf, Scene, Shape};
use crate::settings::Settings;
use glam::{DMat3, DVec3};
use std::ops::{Deref, DerefMut};

/// The scene as pbrt reads it. `picture` is the file that it renders to.
pub(super) fn export(scene: &Scene, settings: &Settings, samples: u64, picture: &str) -> Exported {
    let tint = "pbrt's glass has no tint, and transmittance is left out";
    let grazing = "pbrt has no mirror that reflects alike at every angle, and its conductor reflects more at grazing angles";
    let mut out = Writer(Text::new(scene, &[(is_mirror, grazing), (is_tinted, tint)]));
    let comment = origin(scene).replace(|c: char| c.is_control(), " ");
    out.line(&format!("# {comment}"));
    out.line("#     pbrt FILE");
    out.gap();
    head(&mut out, scene, settings, samples, picture);
    out.gap();
    out.line("WorldBegin");
    for material in &scene.materials {
        out.gap();
        bsdf(&mut out, &material.name, material.bsdf);
    }
    for light in &scene.lights {
        out.gap();
        out.open();
        out.line(&format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [{}] \"bool twosided\" false",
            numbers(light.radiance)
        ));
        // Its back is black, and its front reflects nothing.
        out.line("Material \"diffuse\" \"rgb reflectance\" [0 0 0]");
        out.disk(light.center, light.normal, light.radius);
        out.close();
    }
    for (k, primitive) in scene.primitives.iter().enumerate() {
        out.gap();
        let material = &scene.materials[primitive.material].name;
        shape(&mut out, scene, k, &primitive.shape, material);
    }
    out.0.end()
}

fn is_mirror(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Mirror { .. })
}

fn is_tinted(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Dielectric { transmittance, .. } if *transmittance != DVec3::ONE)
}

fn head(out: &mut Writer, scene: &Scene, settings: &Settings, samples: u64, picture: &str) {
    let camera = &scene.camera;
    let [width, height] = settings.size;
    // pbrt's angle is that of the shorter side.
    let half = 0.5 * camera.vfov.to_radians();
    let fov = if width < height {
        let narrow = half.tan() * f64::from(width) / f64::from(height);
        2.0 * narrow.atan().to_degrees()
    } else {
        camera.vfov
    };
    // pbrt's axes are left-handed, and the scene's are not.
    out.line("Scale -1 1 1");
    out.line(&format!(
        "LookAt {}  {}  {}",
        numbers(camera.eye),
        numbers(camera.look_at),
        numbers(camera.up)
    ));
    out.line(&format!("Camera \"perspective\" \"float fov\" {fov}"));
    out.line(&format!(
        "Film \"rgb\" \"string filename\" \"{}\" \"integer xresolution\" {width} \"integer yresolution\" {height}",
        quoted(picture)
    ));
    out.line("PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5");
    out.line(&format!(
        "Sampler \"independent\" \"integer pixelsamples\" {samples}"
    ));
    // pbrt counts scatterings, and not the vertex on the light.
    let depth = settings.max_depth.min(i32::MAX as u32) - 1;
    out.line(&format!("Integrator \"path\" \"integer maxdepth\" {depth}"));
}

fn bsdf(out: &mut Writer, name: &str, bsdf: Bsdf) {
    match bsdf {
        Bsdf::Diffuse { reflectance } => out.material(
            name,
            &format!("\"diffuse\" \"rgb reflectance\" [{}]", numbers(reflectance)),
        ),
        Bsdf::Mirror { reflectance } => out.material(
            name,
            &format!(
                "\"conductor\" \"rgb reflectance\" [{}] \"float roughness\" 0",
                numbers(reflectance)
            ),
        ),
        Bsdf::Dielectric { ior, .. } => out.material(
            name,
            &format!("\"dielectric\" \"float eta\" {}", not_one(ior)),
        ),
        Bsdf::Phong {
            diffuse,
            specular,
            exponent,
        } => {
            let mix = Mix::of(diffuse, specular, exponent);
            // A dot makes names that no scene file has without quotes.
            let [matt, lobe] = [format!("{name}.diffuse"), format!("{name}.lobe")];
            out.material(
                &matt,
                &format!("\"diffuse\" \"rgb reflectance\" [{}]", numbers(mix.diffuse)),
            );
            out.material(
                &lobe,
                &format!(
                    "\"conductor\" \"rgb reflectance\" [{}] \"float roughness\" {} \"bool remaproughness\" false",
                    numbers(mix.mirror),
                    mix.roughness
                ),
            );
            out.material(
                name,
                &format!(
                    "\"mix\" \"string materials\" [\"{}\" \"{}\"] \"float amount\" {}",
                    quoted(&matt),
                    quoted(&lobe),
                    mix.share
                ),
            );
        }
    }
}

fn shape(out: &mut Writer, scene: &Scene, index: usize, shape: &Shape, material: &str) {
    let named = format!("NamedMaterial \"{}\"", quoted(material));
    match *shape {
        Shape::Implicit(_) => unreachable!("export refuses it"),
        Shape::Sphere { center, radius } => {
            out.open();
            out.line(&named);
            out.line(&format!("Translate {}", numbers(center)));
            out.line(&format!("Shape \"sphere\" \"float radius\" {radius}"));
            out.close();
        }
        Shape::Disk {
            center,
            normal,
            radius,
        } => {
            out.open();
            out.line(&named);
            out.disk(center, normal, radius);
            out.close();
        }
        Shape::Plane { point, normal } => {
            let Some(r) = out.seen(scene, index, [point, normal], material) else {
                return out.line("# A plane that is behind others.");
            };
            let [x, y] = [r.half[0] * r.axes.x_axis, r.half[1] * r.axes.y_axis];
            let corners = [-x - y, x - y, -x + y, x + y].map(|d| numbers(r.center + d));
            out.open();
            out.line(&named);
            out.line(&format!(
                "Shape \"bilinearmesh\" \"point3 P\" [{}]",
                corners.join("  ")
            ));
            out.close();
        }
        Shape::Cylinder { base, top, radius } => {
            let axis = (top - base).normalize();
            let height = base.distance(top);
            out.open();
            out.line(&named);
            out.open();
            out.transform(frame::around(axis), base);
            out.line(&format!(
                "Shape \"cylinder\" \"float radius\" {radius} \"float zmin\" 0 \"float zmax\" {height}"
            ));
            out.close();
            // pbrt's has no caps.
            for (center, normal) in [(base, -axis), (top, axis)] {
                out.open();
                out.disk(center, normal, radius);
                out.close();
            }
            out.close();
        }
    }
}

/// Text inside quotes.
fn quoted(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"");
    escaped.replace(|c: char| c.is_control(), " ")
}

/// pbrt's directives.
struct Writer(Text);

impl Deref for Writer {
    type Target = Text;
    fn deref(&self) -> &Text {
        &self.0
    }
}

impl DerefMut for Writer {
    fn deref_mut(&mut self) -> &mut Text {
        &mut self.0
    }
}

impl Writer {
    fn open(&mut self) {
        self.line("AttributeBegin");
        self.depth += 1;
    }

    fn close(&mut self) {
        self.depth -= 1;
        self.line("AttributeEnd");
    }

    fn material(&mut self, name: &str, rest: &str) {
        let name = quoted(name);
        self.line(&format!(
            "MakeNamedMaterial \"{name}\" \"string type\" {rest}"
        ));
    }

    /// A disk, which pbrt's is at the origin, facing z.
    fn disk(&mut self, center: DVec3, normal: DVec3, radius: f64) {
        self.transform(frame::around(normal), center);
        self.line(&format!("Shape \"disk\" \"float radius\" {radius}"));
    }

    /// Turns the axes, then moves the origin.
    fn transform(&mut self, axes: DMat3, origin: DVec3) {
        let column = |v: DVec3, w: u8| format!("{} {w}", numbers(v));
        let columns = [
            column(axes.x_axis, 0),
            column(axes.y_axis, 0),
            column(axes.z_axis, 0),
            column(origin, 1),
        ];
        self.line(&format!("ConcatTransform [{}]", columns.join("  ")));
    }
}
