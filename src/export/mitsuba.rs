//! Mitsuba 3's XML.

use super::planes::{Rectangle, extent};
use super::text::Text;
use super::{Exported, Mix, frame, not_one, numbers, origin};
use crate::scene::{Bsdf, Scene, Shape};
use crate::settings::Settings;
use glam::DVec3;
use std::ops::{Deref, DerefMut};

/// The scene as Mitsuba reads it, for its RGB variants.
pub(super) fn export(scene: &Scene, settings: &Settings, samples: u64) -> Exported {
    let mut out = Xml(Text::new(scene, &[]));
    // A comment has no two dashes in a row. The first time leaves pairs where there were three.
    let comment = escape(&origin(scene))
        .replace("--", "- -")
        .replace("--", "- -");
    out.line(&format!(
        "<!-- {comment}. Render it with an RGB variant: -->"
    ));
    out.line("<!--     mitsuba -m scalar_rgb -D spp=256 FILE -->");
    out.open("scene version=\"3.0.0\"");
    out.line(&format!("<default name=\"spp\" value=\"{samples}\"/>"));
    out.line("<default name=\"seed\" value=\"0\"/>");
    out.gap();
    out.open("integrator type=\"path\"");
    out.value(
        "integer",
        "max_depth",
        &settings.max_depth.min(i32::MAX as u32).to_string(),
    );
    out.close("integrator");
    out.gap();
    camera(&mut out, scene, settings);
    for material in &scene.materials {
        out.gap();
        bsdf(&mut out, &material.name, material.bsdf);
    }
    for light in &scene.lights {
        out.gap();
        out.open("shape type=\"disk\"");
        out.disk(light.center, light.normal, light.radius);
        // Its back is black, and its front reflects nothing.
        out.open("bsdf type=\"diffuse\"");
        out.value("rgb", "reflectance", "0 0 0");
        out.close("bsdf");
        out.open("emitter type=\"area\"");
        out.value("rgb", "radiance", &numbers(light.radiance));
        out.close("emitter");
        out.close("shape");
    }
    for (k, primitive) in scene.primitives.iter().enumerate() {
        out.gap();
        let material = &scene.materials[primitive.material].name;
        shape(&mut out, scene, k, &primitive.shape, material);
    }
    out.close("scene");
    out.0.end()
}

fn camera(out: &mut Xml, scene: &Scene, settings: &Settings) {
    let camera = &scene.camera;
    let [width, height] = settings.size;
    out.open("sensor type=\"perspective\"");
    out.value("string", "fov_axis", "y");
    out.value("float", "fov", &camera.vfov.to_string());
    // Nothing nearer or farther is seen. By default that is 0.01 and 10 000, whatever the unit of the scene.
    let size = extent(scene).1;
    out.value("float", "near_clip", &(1e-4 * size).to_string());
    out.value("float", "far_clip", &(1e4 * size).to_string());
    out.open("transform name=\"to_world\"");
    out.line(&format!(
        "<lookat origin=\"{}\" target=\"{}\" up=\"{}\"/>",
        numbers(camera.eye),
        numbers(camera.look_at),
        numbers(camera.up)
    ));
    out.close("transform");
    out.open("sampler type=\"independent\"");
    out.value("integer", "sample_count", "$spp");
    out.value("integer", "seed", "$seed");
    out.close("sampler");
    out.open("film type=\"hdrfilm\"");
    out.value("integer", "width", &width.to_string());
    out.value("integer", "height", &height.to_string());
    out.value("string", "pixel_format", "rgb");
    out.value("string", "component_format", "float32");
    out.line("<rfilter type=\"box\"/>");
    out.close("film");
    out.close("sensor");
}

fn bsdf(out: &mut Xml, name: &str, bsdf: Bsdf) {
    let id = escape(name);
    match bsdf {
        Bsdf::Diffuse { reflectance } => {
            out.open(&format!("bsdf type=\"twosided\" id=\"{id}\""));
            diffuse(out, reflectance);
            out.close("bsdf");
        }
        Bsdf::Mirror { reflectance } => {
            out.open(&format!("bsdf type=\"twosided\" id=\"{id}\""));
            out.open("bsdf type=\"conductor\"");
            // "none" reflects all light, at every angle.
            out.value("string", "material", "none");
            out.value("rgb", "specular_reflectance", &numbers(reflectance));
            out.close("bsdf");
            out.close("bsdf");
        }
        Bsdf::Dielectric { ior, transmittance } => {
            out.open(&format!("bsdf type=\"dielectric\" id=\"{id}\""));
            out.value("float", "int_ior", &not_one(ior).to_string());
            out.value("float", "ext_ior", "1");
            if transmittance != DVec3::ONE {
                out.value("rgb", "specular_transmittance", &numbers(transmittance));
            }
            out.close("bsdf");
        }
        Bsdf::Phong {
            diffuse: kd,
            specular,
            exponent,
        } => {
            let mix = Mix::of(kd, specular, exponent);
            out.open(&format!("bsdf type=\"twosided\" id=\"{id}\""));
            out.open("bsdf type=\"blendbsdf\"");
            out.value("float", "weight", &mix.share.to_string());
            diffuse(out, mix.diffuse);
            out.open("bsdf type=\"roughconductor\"");
            out.value("string", "material", "none");
            out.value("string", "distribution", "beckmann");
            out.value("float", "alpha", &mix.roughness.to_string());
            out.value("rgb", "specular_reflectance", &numbers(mix.mirror));
            out.close("bsdf");
            out.close("bsdf");
            out.close("bsdf");
        }
    }
}

fn diffuse(out: &mut Xml, reflectance: DVec3) {
    out.open("bsdf type=\"diffuse\"");
    out.value("rgb", "reflectance", &numbers(reflectance));
    out.close("bsdf");
}

fn shape(out: &mut Xml, scene: &Scene, index: usize, shape: &Shape, material: &str) {
    let reference = format!("<ref id=\"{}\"/>", escape(material));
    match *shape {
        Shape::Implicit(_) => unreachable!("export refuses it"),
        Shape::Sphere { center, radius } => {
            out.open("shape type=\"sphere\"");
            out.line(&format!(
                "<point name=\"center\" x=\"{}\" y=\"{}\" z=\"{}\"/>",
                center.x, center.y, center.z
            ));
            out.value("float", "radius", &radius.to_string());
            out.line(&reference);
            out.close("shape");
        }
        Shape::Disk {
            center,
            normal,
            radius,
        } => {
            out.open("shape type=\"disk\"");
            out.disk(center, normal, radius);
            out.line(&reference);
            out.close("shape");
        }
        Shape::Plane { point, normal } => {
            let Some(rectangle) = out.seen(scene, index, [point, normal], material) else {
                return out.line("<!-- A plane that is behind others. -->");
            };
            out.open("shape type=\"rectangle\"");
            out.rectangle(&rectangle);
            out.line(&reference);
            out.close("shape");
        }
        Shape::Cylinder { base, top, radius } => {
            out.open("shape type=\"cylinder\"");
            for (name, p) in [("p0", base), ("p1", top)] {
                out.line(&format!(
                    "<point name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>",
                    p.x, p.y, p.z
                ));
            }
            out.value("float", "radius", &radius.to_string());
            out.line(&reference);
            out.close("shape");
            // Mitsuba's has no caps.
            let axis = (top - base).normalize();
            for (center, normal) in [(base, -axis), (top, axis)] {
                out.open("shape type=\"disk\"");
                out.disk(center, normal, radius);
                out.line(&reference);
                out.close("shape");
            }
        }
    }
}

/// Text for XML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .chars()
        .filter(|c| !c.is_control())
        .collect()
}

/// XML.
struct Xml(Text);

impl Deref for Xml {
    type Target = Text;
    fn deref(&self) -> &Text {
        &self.0
    }
}

impl DerefMut for Xml {
    fn deref_mut(&mut self) -> &mut Text {
        &mut self.0
    }
}

impl Xml {
    fn open(&mut self, tag: &str) {
        self.line(&format!("<{tag}>"));
        self.depth += 1;
    }

    fn close(&mut self, tag: &str) {
        self.depth -= 1;
        self.line(&format!("</{tag}>"));
    }

    fn value(&mut self, kind: &str, name: &str, value: &str) {
        self.line(&format!("<{kind} name=\"{name}\" value=\"{value}\"/>"));
    }

    /// The transform of Mitsuba's disk: of radius 1, facing z.
    fn disk(&mut self, center: DVec3, normal: DVec3, radius: f64) {
        let axes = frame::around(normal);
        self.open("transform name=\"to_world\"");
        self.line(&format!("<scale value=\"{radius}\"/>"));
        self.look(center, normal, axes.y_axis);
        self.close("transform");
    }

    /// The transform of its rectangle: from -1 to 1, facing z.
    fn rectangle(&mut self, r: &Rectangle) {
        let [x, y] = r.half;
        self.open("transform name=\"to_world\"");
        self.line(&format!("<scale x=\"{x}\" y=\"{y}\"/>"));
        self.look(r.center, r.axes.z_axis, r.axes.y_axis);
        self.close("transform");
    }

    fn look(&mut self, from: DVec3, normal: DVec3, up: DVec3) {
        self.line(&format!(
            "<lookat origin=\"{}\" target=\"{}\" up=\"{}\"/>",
            numbers(from),
            numbers(from + normal),
            numbers(up)
        ));
    }
}
