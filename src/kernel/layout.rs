//! How geometry, material and light become the fields of the kernel's structs: once for the literals in a kernel's text, for storage
//! buffers, and for the records of trees.

use super::literal::float;
use crate::scene::Bsdf;
use crate::world::{Geometry, World, WorldLight, WorldPrimitive};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// A shape. The tag of `Surface.shape` is its number; flat ones come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum ShapeKind {
    Plane,
    Disk,
    Cylinder,
    Sphere,
    HugeSphere,
    Implicit,
}

impl ShapeKind {
    pub const ALL: [Self; 6] = [
        Self::Plane,
        Self::Disk,
        Self::Cylinder,
        Self::Sphere,
        Self::HugeSphere,
        Self::Implicit,
    ];

    /// Those that the modules of the shaders meet. The others are met by code that is made for one scene.
    pub const FIXED: [Self; 5] = [
        Self::Plane,
        Self::Disk,
        Self::Cylinder,
        Self::Sphere,
        Self::HugeSphere,
    ];

    pub fn of(geometry: &Geometry) -> Self {
        match geometry {
            Geometry::Plane { .. } => Self::Plane,
            Geometry::Disk { .. } => Self::Disk,
            Geometry::Cylinder { .. } => Self::Cylinder,
            Geometry::Sphere { .. } => Self::Sphere,
            Geometry::HugeSphere { .. } => Self::HugeSphere,
            Geometry::Implicit(_) => Self::Implicit,
        }
    }

    /// As it stands in the names of the shaders' constants and functions.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Disk => "disk",
            Self::Cylinder => "cylinder",
            Self::Sphere => "sphere",
            Self::HugeSphere => "huge_sphere",
            Self::Implicit => "implicit",
        }
    }

    /// A call of the constructor of its struct in the shaders, with the fields of [`Surface`] that `field` gives.
    pub fn constructor(self, field: impl Fn(&str) -> String) -> String {
        let (name, fields): (_, &[&str]) = match self {
            Self::Plane => ("Plane", &["axis", "offset"]),
            Self::Disk => ("Disk", &["point", "radius", "axis", "offset"]),
            Self::Cylinder => {
                let ends = format!("vec2f({}, {})", field("offset"), field("top"));
                let [base, radius, axis] = ["point", "radius", "axis"].map(field);
                return format!("Cylinder({base}, {radius}, {axis}, {ends})");
            }
            Self::Sphere => ("Sphere", &["point", "radius"]),
            // The offset is the curvature.
            Self::HugeSphere => ("HugeSphere", &["point", "offset", "axis"]),
            Self::Implicit => unreachable!("its values stand in its own functions"),
        };
        let fields: Vec<String> = fields.iter().map(|f| field(f)).collect();
        format!("{name}({})", fields.join(", "))
    }
}

/// The type of a field, as WGSL text.
trait Value {
    /// All of it.
    fn literal(&self) -> String;
    /// Its scalars, with what follows the field's name: `.x` and so on, or nothing.
    fn scalars(&self) -> Vec<(&'static str, String)>;
}

impl Value for f32 {
    fn literal(&self) -> String {
        float(f64::from(*self))
    }

    fn scalars(&self) -> Vec<(&'static str, String)> {
        vec![("", self.literal())]
    }
}

impl Value for u32 {
    fn literal(&self) -> String {
        format!("{self}u")
    }

    fn scalars(&self) -> Vec<(&'static str, String)> {
        vec![("", self.literal())]
    }
}

impl<T: Value> Value for [T; 3]
where
    [T; 3]: Vector,
{
    fn literal(&self) -> String {
        let [x, y, z] = self.each_ref().map(T::literal);
        format!("{}({x}, {y}, {z})", <[T; 3]>::TYPE)
    }

    fn scalars(&self) -> Vec<(&'static str, String)> {
        let axes = [".x", ".y", ".z"].into_iter();
        axes.zip(self.iter().map(T::literal)).collect()
    }
}

/// WGSL's name of a vector of three.
trait Vector {
    const TYPE: &'static str;
}

impl Vector for [f32; 3] {
    const TYPE: &'static str = "vec3f";
}

impl Vector for [u32; 3] {
    const TYPE: &'static str = "vec3u";
}

/// Host twins of the kernel's structs, field by field.
macro_rules! records {
    ($($(#[$about:meta])* $name:ident { $($field:ident: $kind:ty,)* })*) => {$(
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, Default)]
        #[repr(C)]
        pub struct $name { $(pub $field: $kind,)* }

        impl $name {
            /// The scalars of every field, as names after the dot and literals.
            #[allow(dead_code, reason = "not every struct has literals")]
            pub fn scalars(&self) -> Vec<(String, String)> {
                let mut all = Vec::new();
                $(for (part, value) in self.$field.scalars() {
                    all.push((format!("{}{part}", stringify!($field)), value));
                })*
                all
            }

            /// One field as a literal.
            ///
            /// # Panics
            /// If there is no such field.
            #[allow(dead_code, reason = "not every struct has literals")]
            pub fn literal(&self, field: &str) -> String {
                $(if field == stringify!($field) {
                    return self.$field.literal();
                })*
                panic!("{} has no field {field}", stringify!($name));
            }

            /// A constructor call with all fields.
            #[allow(dead_code, reason = "not every struct has literals")]
            pub fn constructor(&self) -> String {
                let fields = [$(self.$field.literal()),*];
                format!("{}({})", stringify!($name), fields.join(", "))
            }

            /// Name, size, and fields with their offsets.
            #[cfg(test)]
            fn layout() -> (&'static str, usize, Vec<(&'static str, usize)>) {
                let fields = vec![$((stringify!($field), std::mem::offset_of!($name, $field))),*];
                (stringify!($name), size_of::<$name>(), fields)
            }
        }
    )*

        #[cfg(test)]
        fn layouts() -> Vec<(&'static str, usize, Vec<(&'static str, usize)>)> {
            vec![$($name::layout()),*]
        }
    };
}

records! {
    /// `Surface` of shape/surface.wgsl, which says what the fields mean.
    Surface {
        point: [f32; 3],
        radius: f32,
        axis: [f32; 3],
        offset: f32,
        faces: [u32; 3],
        material: u32,
        top: f32,
        solid: u32,
        parent: u32,
        shape: u32,
    }
    /// `Material` of shape/surface.wgsl.
    Material {
        color: [f32; 3],
        kind: u32,
        specular: [f32; 3],
        exponent: f32,
    }
    /// `DiskLight` of light/disk.wgsl.
    DiskLight {
        center: [f32; 3],
        radius: f32,
        normal: [f32; 3],
        offset: f32,
        radiance: [f32; 3],
        face: u32,
    }
    /// `LightCluster` of light/choose_by_tree.wgsl.
    LightCluster {
        center: [f32; 3],
        radius: f32,
        power: [f32; 3],
        cos_cone: f32,
    }
    /// `Params` of film.wgsl, which says what the fields mean.
    Params {
        tile: [u32; 2],
        size: [u32; 2],
        pixels: u32,
        max_samples: u32,
        seed: u32,
        groups: u32,
        first_group: u32,
        stride: u32,
        trips: u32,
        opaque_two: u32,
    }
    /// `LightParams` of light_path/trace.wgsl, which says what the fields mean.
    LightParams {
        first_pass: u32,
        first_path: u32,
        paths: u32,
        each: u32,
        invocations: u32,
        room: u32,
        seed: u32,
        trips: u32,
        opaque_two: u32,
    }
}

impl Value for [u32; 2] {
    fn literal(&self) -> String {
        format!("vec2u({}u, {}u)", self[0], self[1])
    }

    fn scalars(&self) -> Vec<(&'static str, String)> {
        vec![(".x", self[0].literal()), (".y", self[1].literal())]
    }
}

/// Rounded to f32.
pub(crate) fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

impl Surface {
    /// Surface number `number` of a world: its lights come first.
    pub fn of(world: &World, number: usize) -> Self {
        match number.checked_sub(world.lights.len()) {
            None => Self::of_light(&world.lights[number]),
            Some(i) => Self::of_primitive(&world.primitives[i]),
        }
    }

    fn of_light(l: &WorldLight) -> Self {
        Self {
            point: single(l.center),
            radius: l.radius as f32,
            axis: single(l.normal),
            offset: l.offset as f32,
            faces: [l.face, 0, 0],
            shape: ShapeKind::Disk as u32,
            ..Self::default()
        }
    }

    fn of_primitive(p: &WorldPrimitive) -> Self {
        let s = Self {
            faces: p.faces,
            material: p.material as u32,
            solid: p.solid,
            parent: p.parent,
            shape: ShapeKind::of(&p.geometry) as u32,
            ..Self::default()
        };
        match p.geometry {
            Geometry::Disk {
                center,
                normal,
                offset,
                radius,
            } => Self {
                point: single(center),
                radius: radius as f32,
                axis: single(normal),
                offset: offset as f32,
                ..s
            },
            Geometry::Cylinder {
                base,
                axis,
                offsets: [low, top],
                radius,
            } => Self {
                point: single(base),
                radius: radius as f32,
                axis: single(axis),
                offset: low as f32,
                top: top as f32,
                ..s
            },
            Geometry::Plane { normal, offset } => Self {
                axis: single(normal),
                offset: offset as f32,
                ..s
            },
            Geometry::Sphere { center, radius } => Self {
                point: single(center),
                radius: radius as f32,
                ..s
            },
            Geometry::HugeSphere {
                pole,
                normal,
                radius,
            } => Self {
                point: single(pole),
                radius: radius as f32,
                axis: single(normal),
                offset: (1.0 / radius) as f32,
                ..s
            },
            Geometry::Implicit(_) => s,
        }
    }
}

impl Material {
    /// Colours go to `color` and `specular`, and the number to `exponent`, in the order of [`Bsdf::parameters`].
    pub fn of(bsdf: &Bsdf) -> Self {
        let (colors, numbers) = (bsdf.colors(), bsdf.numbers());
        assert!(
            colors.len() <= 2 && numbers.len() <= 1,
            "a material has more parameters than Material has fields"
        );
        let color = |i: usize| single(colors.get(i).copied().unwrap_or_default());
        Self {
            color: color(0),
            kind: bsdf.kind() as u32,
            specular: color(1),
            exponent: numbers.first().map_or(0.0, |&x| x as f32),
        }
    }
}

impl DiskLight {
    pub fn of(l: &WorldLight) -> Self {
        Self {
            center: single(l.center),
            radius: l.radius as f32,
            normal: single(l.normal),
            offset: l.offset as f32,
            radiance: single(l.radiance),
            face: l.face,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::modules;

    #[test]
    fn host_structs_lie_as_the_kernel_reads_them() {
        let host = layouts();
        // Struct declarations are all that is needed, wherever they stand.
        let mut text = String::new();
        for module in modules::ALL {
            for part in module.text.split("\nstruct ").skip(1) {
                let body = part.split_once('}').expect("closed").0;
                if host
                    .iter()
                    .any(|(name, ..)| body.starts_with(&format!("{name} {{")))
                {
                    text += &format!("struct {body}}}\n");
                }
            }
        }
        let module = naga::front::wgsl::parse_str(&text).expect("structs parse");
        let mut layouter = naga::proc::Layouter::default();
        layouter
            .update(module.to_ctx())
            .expect("structs have layouts");
        for (name, size, fields) in host {
            let (handle, ty) = module
                .types
                .iter()
                .find(|(_, t)| t.name.as_deref() == Some(name))
                .unwrap_or_else(|| panic!("no {name}"));
            let naga::TypeInner::Struct { members, .. } = &ty.inner else {
                panic!("{name} is a struct")
            };
            let shader: Vec<(&str, usize)> = members
                .iter()
                .map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize))
                .collect();
            assert_eq!(fields, shader, "{name}");
            assert_eq!(
                layouter[handle].to_stride() as usize,
                size,
                "stride of {name}"
            );
        }
    }
}
