//! Scenes built in code. They are written as a scene file and read like one: every rule of the format holds for them too.

use super::parse::parse_with_volumes;
use super::source::quoted;
use super::{Bsdf, Camera, Diagnostic, Light, Parameter, Place, Scene, Shape};
use super::{implicit, isosurface};
use crate::implicit::{Implicit, Volume};
use glam::DVec3;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::sync::Arc;

/// How far the length of a unit vector may be from 1: a few roundings of f64.
pub(super) const UNIT: f64 = 1e-14;

/// A scene under construction, begun by [`Scene::builder`]. Vectors are `[f64; 3]` or [`DVec3`].
///
/// Nothing is checked before [`build`](Self::build), which has every rule of the scene format: lengths, colours from 0 to 1,
/// materials that exist, at least one light and one surface.
///
/// ```
/// let scene = etendue::Scene::builder()
///     .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [64, 48])
///     .diffuse("white", [0.8; 3])
///     .plane([0.0; 3], [0.0, 1.0, 0.0], "white")
///     .sphere([0.0, 0.5, 0.0], 0.5, "white")
///     .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
///     .build()?;
/// assert_eq!(scene.primitives.len(), 2);
///
/// let wrong = etendue::Scene::builder().sphere([0.0; 3], -1.0, "glas").build();
/// let messages = wrong.unwrap_err().to_string();
/// assert!(messages.contains("sphere 1: radius is -1.0; radius must be a number from 1e-15"));
/// # Ok::<(), etendue::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct SceneBuilder {
    title: Option<String>,
    up: Option<DVec3>,
    /// Each table: what messages call it, and its text.
    tables: Vec<(String, String)>,
    /// The volumes that tables name.
    volumes: Vec<(String, Arc<Volume>)>,
    /// Tables of each kind so far.
    counts: Vec<(&'static str, usize)>,
}

impl SceneBuilder {
    /// The picture's title.
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// The pinhole camera: its place, a point in the middle of the picture, the vertical field of view in degrees, and width
    /// and height in pixels.
    pub fn camera(
        mut self,
        eye: impl Into<DVec3>,
        look_at: impl Into<DVec3>,
        vfov: f64,
        resolution: [u32; 2],
    ) -> Self {
        let [width, height] = resolution;
        let mut text = keys(&[("eye", eye.into()), ("look_at", look_at.into())]);
        text += &key("vfov", vfov);
        let _ = writeln!(text, "resolution = [{width}, {height}]");
        self.tables
            .push(("camera".into(), format!("[camera]\n{text}")));
        self
    }

    /// What points to the picture's top; +y unless it is given.
    pub fn up(mut self, up: impl Into<DVec3>) -> Self {
        self.up = Some(up.into());
        self
    }

    /// A material of any kind under a name of its own.
    pub fn material(mut self, name: &str, bsdf: Bsdf) -> Self {
        let mut text = format!("type = {}\n", string(bsdf.kind().name()));
        for parameter in bsdf.parameters() {
            text += &match parameter {
                Parameter::Color(name, color) => keys(&[(name, color)]),
                Parameter::Number(name, x) => key(name, x),
            };
        }
        let table = format!("[material.{}]\n{text}", string(name));
        self.tables
            .push((format!("material {}", quoted(name)), table));
        self
    }

    /// A Lambertian material; `reflectance` is linear RGB, 0 to 1.
    pub fn diffuse(self, name: &str, reflectance: impl Into<DVec3>) -> Self {
        let reflectance = reflectance.into();
        self.material(name, Bsdf::Diffuse { reflectance })
    }

    /// A perfect mirror; `reflectance` is linear RGB, 0 to 1.
    pub fn mirror(self, name: &str, reflectance: impl Into<DVec3>) -> Self {
        let reflectance = reflectance.into();
        self.material(name, Bsdf::Mirror { reflectance })
    }

    /// Clear glass, or another smooth solid; `ior` is the index of refraction inside divided by that outside.
    pub fn dielectric(self, name: &str, ior: f64) -> Self {
        let transmittance = DVec3::ONE;
        self.material(name, Bsdf::Dielectric { ior, transmittance })
    }

    /// Modified Phong; `diffuse` + `specular` is at most 1 in each channel.
    pub fn phong(
        self,
        name: &str,
        diffuse: impl Into<DVec3>,
        specular: impl Into<DVec3>,
        exponent: f64,
    ) -> Self {
        let (diffuse, specular) = (diffuse.into(), specular.into());
        self.material(
            name,
            Bsdf::Phong {
                diffuse,
                specular,
                exponent,
            },
        )
    }

    /// A sphere of the material with this name.
    pub fn sphere(self, center: impl Into<DVec3>, radius: f64, material: &str) -> Self {
        let center = center.into();
        self.shape(&Shape::Sphere { center, radius }, material)
    }

    /// An infinite plane; `normal` has any length. If it is dielectric, the solid is on the side that the normal points away
    /// from.
    pub fn plane(self, point: impl Into<DVec3>, normal: impl Into<DVec3>, material: &str) -> Self {
        let (point, normal) = (point.into(), normal.into());
        self.shape(&Shape::Plane { point, normal }, material)
    }

    /// A flat disk with two sides, not of a dielectric material; `normal` has any length.
    pub fn disk(
        self,
        center: impl Into<DVec3>,
        normal: impl Into<DVec3>,
        radius: f64,
        material: &str,
    ) -> Self {
        let (center, normal) = (center.into(), normal.into());
        let disk = Shape::Disk {
            center,
            normal,
            radius,
        };
        self.shape(&disk, material)
    }

    /// A solid cylinder between the centres of its two caps.
    pub fn cylinder(
        self,
        base: impl Into<DVec3>,
        top: impl Into<DVec3>,
        radius: f64,
        material: &str,
    ) -> Self {
        let (base, top) = (base.into(), top.into());
        self.shape(&Shape::Cylinder { base, top, radius }, material)
    }

    /// Where a formula has a certain value, or the solid that it bounds.
    ///
    /// ```
    /// # use etendue::{Clip, Implicit};
    /// let mut torus = Implicit::new("(x^2 + y^2 + z^2 + 1 - r^2)^2 - 4 (x^2 + y^2)", &[("r", 0.3)]).unwrap();
    /// torus.clip = Clip::Box { min: [-1.4, -1.4, -0.4].into(), max: [1.4, 1.4, 0.4].into() };
    /// torus.center.y = 0.5;
    /// let scene = etendue::Scene::builder().implicit(&torus, "jade");
    /// ```
    pub fn implicit(self, implicit: &Implicit, material: &str) -> Self {
        self.shape(&Shape::Implicit(Arc::new(implicit.clone())), material)
    }

    /// Where a volume has a certain value, or the solid that it bounds.
    ///
    /// ```
    /// # use etendue::{Grid, Implicit, Numbers, Volume};
    /// let squares = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|k| (k - 1) * (k - 1)).iter().sum::<i32>() as u8);
    /// let volume = Volume::new([3; 3], Numbers::U8(squares.collect()))?;
    /// let grid = Grid { above: false, ..Grid::new(volume, [0.5; 3]) };
    /// let scene = etendue::Scene::builder().isosurface(&Implicit::of_volume(grid, 0.9), "jade");
    /// # Ok::<(), String>(())
    /// ```
    pub fn isosurface(self, isosurface: &Implicit, material: &str) -> Self {
        self.implicit(isosurface, material)
    }

    /// A disk that emits `radiance`, linear RGB, on the side that `normal` points to; `normal` has any length.
    pub fn light(
        self,
        center: impl Into<DVec3>,
        normal: impl Into<DVec3>,
        radius: f64,
        radiance: impl Into<DVec3>,
    ) -> Self {
        let text = keys(&[
            ("center", center.into()),
            ("normal", normal.into()),
            ("radiance", radiance.into()),
        ]);
        self.table("light", text + &key("radius", radius))
    }

    /// The scene as the text of a scene file, unchecked.
    pub fn to_toml(&self) -> String {
        self.text().0
    }

    /// What an existing scene was built from.
    fn of(scene: &Scene) -> Result<Self, Vec<Diagnostic>> {
        let Camera {
            eye,
            look_at,
            up,
            vfov,
            resolution,
        } = scene.camera;
        let mut b = Self {
            title: scene.title.clone(),
            ..Self::default()
        };
        b = b.camera(eye, look_at, vfov, resolution).up(up);
        let hints = &scene.render;
        let all = [
            ("max_depth", hints.max_depth),
            ("strata", hints.strata),
            ("seed", hints.seed),
        ];
        let given = all.iter().filter_map(|(k, v)| Some((k, (*v)?)));
        let text: String = given.map(|(k, v)| format!("{k} = {v}\n")).collect();
        b.tables
            .push(("render".into(), format!("[render]\n{text}")));
        for m in &scene.materials {
            b = b.material(&m.name, m.bsdf);
        }
        for (i, p) in scene.primitives.iter().enumerate() {
            let Some(material) = scene.materials.get(p.material) else {
                let n = scene.materials.len();
                let message = format!("material is {}; there are {n}, numbered from 0", p.material);
                return Err(vec![about(format!("primitives[{i}]"), message)]);
            };
            b = b.shape(&p.shape, &material.name);
        }
        for l in &scene.lights {
            let Light {
                center,
                normal,
                radius,
                radiance,
                ..
            } = *l;
            b = b.light(center, normal, radius, radiance);
        }
        Ok(b)
    }

    fn shape(mut self, shape: &Shape, material: &str) -> Self {
        let text = match *shape {
            Shape::Sphere { center, radius } => {
                keys(&[("center", center)]) + &key("radius", radius)
            }
            Shape::Plane { point, normal } => keys(&[("point", point), ("normal", normal)]),
            Shape::Disk {
                center,
                normal,
                radius,
            } => keys(&[("center", center), ("normal", normal)]) + &key("radius", radius),
            Shape::Cylinder { base, top, radius } => {
                keys(&[("base", base), ("top", top)]) + &key("radius", radius)
            }
            Shape::Implicit(ref implicit) => match implicit.grid() {
                Some(grid) => {
                    let mut grid = grid.clone();
                    // Another volume may have the same name.
                    let taken = |name: &str| {
                        let known = self.volumes.iter().find(|v| v.0 == name);
                        known.is_some_and(|v| v.1 != grid.volume)
                    };
                    let numbered = (2..).map(|n| format!("{} {n}", grid.file));
                    let mut names = std::iter::once(grid.file.clone()).chain(numbered);
                    if let Some(free) = names.find(|name| !taken(name)) {
                        grid.file = free;
                    }
                    self.volumes.push((grid.file.clone(), grid.volume.clone()));
                    isosurface::text(implicit, &grid, string)
                }
                None => implicit::text(implicit, string),
            },
        };
        let text = format!("{text}material = {}\n", string(material));
        self.table(shape.kind(), text)
    }

    fn table(mut self, kind: &'static str, text: String) -> Self {
        let at = match self.counts.iter().position(|(k, _)| *k == kind) {
            Some(at) => at,
            None => {
                self.counts.push((kind, 0));
                self.counts.len() - 1
            }
        };
        self.counts[at].1 += 1;
        let label = format!("{kind} {}", self.counts[at].1);
        self.tables.push((label, format!("[[{kind}]]\n{text}")));
        self
    }

    /// What is there twice and may not be. The parser would speak of lines of a text that nobody has seen.
    fn twice(&self) -> Vec<Diagnostic> {
        let mut known = HashSet::new();
        let mut is_known = |text: &str| {
            let header = text.lines().next().unwrap_or_default();
            !header.starts_with("[[") && !known.insert(header.to_owned())
        };
        let twice = self.tables.iter().filter(|(_, text)| is_known(text));
        let wrong = twice.map(|(what, _)| {
            let rule = match what.as_str() {
                "camera" => "a scene has one camera",
                _ => "every material has a name of its own",
            };
            about(what.clone(), format!("duplicate; {rule}"))
        });
        wrong.collect()
    }

    /// The text, and the line at which each table begins.
    fn text(&self) -> (String, Vec<usize>) {
        let mut text = String::new();
        if let Some(title) = &self.title {
            let _ = writeln!(text, "title = {}", string(title));
        }
        let mut line = 1 + text.matches('\n').count();
        let mut lines = Vec::with_capacity(self.tables.len());
        for (what, table) in &self.tables {
            lines.push(line);
            text += table;
            line += table.matches('\n').count();
            if let (Some(up), "camera") = (self.up, what.as_str()) {
                text += &keys(&[("up", up)]);
                line += 1;
            }
        }
        (text, lines)
    }

    /// The scene, if it keeps every rule; else one message for each thing that does not.
    pub(crate) fn checked(&self) -> Result<Scene, Vec<Diagnostic>> {
        let twice = self.twice();
        if !twice.is_empty() {
            return Err(twice);
        }
        let (text, lines) = self.text();
        let mut scene = parse_with_volumes(&text, &self.volumes).map_err(|all| {
            let named = all.into_iter().map(|d| {
                let table = lines.partition_point(|&first| first <= d.line);
                let what = match table.checked_sub(1) {
                    Some(i) => self.tables[i].0.clone(),
                    None => "the scene".into(),
                };
                about(what, d.message)
            });
            named.collect::<Vec<_>>()
        })?;
        for m in &mut scene.materials {
            m.place = Place::default();
        }
        for p in &mut scene.primitives {
            (p.line, p.column) = (0, 0);
        }
        for l in &mut scene.lights {
            (l.line, l.column) = (0, 0);
        }
        Ok(scene)
    }
}

/// `scene` and the text of a scene file that says the same. Its fields are public: all rules are checked again, and normals
/// that have lost their unit length have it in what is returned.
pub(crate) fn checked(scene: &Scene) -> Result<(Scene, String), Vec<Diagnostic>> {
    let builder = SceneBuilder::of(scene)?;
    let read = builder.checked()?;
    let unit = |n: DVec3| (n.length() - 1.0).abs() <= UNIT;
    let normals = scene.primitives.iter().all(|p| match p.shape {
        Shape::Plane { normal, .. } | Shape::Disk { normal, .. } => unit(normal),
        Shape::Sphere { .. } | Shape::Cylinder { .. } => true,
        Shape::Implicit(ref surface) => implicit::is_orthonormal(surface.rotation),
    });
    let same = normals && scene.lights.iter().all(|l| unit(l.normal)) && unit(scene.camera.up);
    // Normalising twice may move a last bit, and with it samples.
    let scene = if same { scene.clone() } else { read };
    Ok((scene, builder.to_toml()))
}

fn about(what: String, message: String) -> Diagnostic {
    Diagnostic {
        path: what.into(),
        line: 0,
        column: 0,
        message,
        unreadable: false,
    }
}

/// A float that reads back to the same bits.
fn float(x: f64) -> String {
    if x.is_nan() {
        "nan".into()
    } else {
        format!("{x:?}")
    }
}

fn key(name: &str, x: f64) -> String {
    format!("{name} = {}\n", float(x))
}

fn keys(all: &[(&str, DVec3)]) -> String {
    let line = |(name, v): &(&str, DVec3)| {
        let [x, y, z] = v.to_array().map(float);
        format!("{name} = [{x}, {y}, {z}]\n")
    };
    all.iter().map(line).collect()
}

/// A TOML string: JSON's, but that TOML wants DEL escaped.
fn string(text: &str) -> String {
    serde_json::Value::from(text)
        .to_string()
        .replace('\u{7f}', "\\u007F")
}

#[cfg(test)]
mod tests;
