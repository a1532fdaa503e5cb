//! Generates scenes with many objects: spheres placed like the seeds of a sunflower, a cloud of spheres, a cluster of atoms, a
//! hall of lamps; and a volume.

mod volume;

pub use volume::{SIDES, volume};

use super::parse::parse_with_rows;
use super::{Diagnostic, Scene};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

/// Larger scenes keep their objects in a CSV file.
pub const MOST_IN_TABLES: usize = 200;

/// The angle between one seed of a sunflower and the next.
const GOLDEN: f64 = PI * (3.0 - 2.236_067_977_499_79);

/// The text of a scene, and that of its file of rows if it has one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Generated {
    /// TOML.
    pub scene: String,
    /// Rows of a CSV file, or of an extended XYZ file.
    pub rows: Option<String>,
    /// A NumPy file with a volume, if it has one.
    pub volume: Option<Vec<u8>>,
}

impl Generated {
    /// The scene itself; `path` names it in messages.
    pub fn parse(&self, path: &Path) -> Result<Scene, Vec<Diagnostic>> {
        parse_with_rows(path, &self.scene, self.rows.as_deref())
    }
}

/// What spheres are made of: TOML but for the header, by name.
const MATERIALS: [(&str, &str); 5] = [
    (
        "amber",
        "type        = \"diffuse\"\n\
         reflectance = [0.85, 0.5, 0.12]\n",
    ),
    (
        "rust",
        "type        = \"diffuse\"\n\
         reflectance = [0.6, 0.18, 0.09]\n",
    ),
    (
        "cream",
        "type        = \"diffuse\"\n\
         reflectance = [0.85, 0.8, 0.68]\n",
    ),
    (
        "slate",
        "type        = \"diffuse\"\n\
         reflectance = [0.14, 0.27, 0.36]\n",
    ),
    (
        "gloss",
        "type     = \"phong\"\n\
         diffuse  = [0.12, 0.12, 0.13]\n\
         specular = [0.6, 0.6, 0.62]\n\
         exponent = 80.0\n",
    ),
];

/// Uniform numbers in [0, 1), one for each of `count` things and purposes \[Steele2014\].
fn uniform(seed: u32, i: usize, purpose: u64) -> f64 {
    let mut z = (u64::from(seed) << 32 ^ i as u64)
        .wrapping_mul(8)
        .wrapping_add(purpose + 1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// `count` spheres on a floor, placed like the seeds of a sunflower, so that every number of them covers the same part of
/// the picture. `rows` names their CSV file.
pub fn spheres(count: usize, seed: u32, rows: &str) -> Generated {
    // One material for each arm of the spiral, with a different one here and there.
    let material = |i: usize| {
        if uniform(seed, i, 1) < 0.1 {
            "gloss"
        } else {
            MATERIALS[[0, 1, 0, 2, 3, 2, 1, 0][(i % 34) * 8 / 34]].0
        }
    };
    // A few spheres do not have all of them.
    let used: HashSet<&str> = (0..count).map(material).collect();
    let materials: String = MATERIALS
        .iter()
        .filter(|(name, _)| used.contains(name))
        .map(|(name, text)| format!("[material.{name}]\n{text}\n"))
        .collect();
    let mut scene = format!(
        "title = \"{count} spheres\"

[camera]
eye        = [0.0, 2.1, 3.4]
look_at    = [0.0, -0.1, 0.15]
vfov       = 36.0
resolution = [512, 384]

[material.floor]
type        = \"diffuse\"
reflectance = [0.55, 0.54, 0.52]

{materials}[[plane]]
point    = [0.0, 0.0, 0.0]
normal   = [0.0, 1.0, 0.0]
material = \"floor\"

[[light]]
center   = [-2.2, 3.6, 1.2]
normal   = [2.2, -3.6, -1.2]
radius   = 0.8
radiance = [17.0, 15.0, 12.0]

[[light]]
center   = [3.0, 2.6, -2.5]
normal   = [-3.0, -2.6, 2.5]
radius   = 0.9
radiance = [2.5, 3.5, 5.0]
"
    );
    let mut list = List::new(count, "x,y,z,radius,material");
    // Seeds have this much room from centre to edge.
    let room = 1.4 * (PI / count as f64).sqrt();
    for i in 0..count {
        let out = 1.4 * ((i as f64 + 0.5) / count as f64).sqrt();
        let angle = GOLDEN * i as f64;
        let radius = room * (0.27 + 0.2 * uniform(seed, i, 0));
        let at = [out * angle.cos(), radius, out * angle.sin()];
        let material = material(i);
        list.add(
            format_args!("{:.6},{:.6},{:.6},{radius:.6},{material}", at[0], at[1], at[2]),
            format_args!(
                "\n[[sphere]]\ncenter   = [{:.6}, {:.6}, {:.6}]\nradius   = {radius:.6}\nmaterial = \"{material}\"\n",
                at[0], at[1], at[2]
            ),
        );
    }
    list.finish(&mut scene, "spheres", rows)
}

/// A cloud of `count` equal spheres, at random in a box over a floor. Together they have the same cross-section for every
/// number, a sixth of a side of the box. `rows` names their CSV file.
pub fn cloud(count: usize, seed: u32, rows: &str) -> Generated {
    let mut scene = format!(
        "title = \"A cloud of {count} spheres\"

[camera]
eye        = [0.0, 1.2, 4.0]
look_at    = [0.0, 0.8, 0.0]
vfov       = 40.0
resolution = [512, 384]

[material.matt]
type        = \"diffuse\"
reflectance = [0.7, 0.7, 0.7]

[[plane]]
point    = [0.0, -0.2, 0.0]
normal   = [0.0, 1.0, 0.0]
material = \"matt\"

[[light]]
center   = [0.0, 4.0, 1.0]
normal   = [0.0, -1.0, 0.0]
radius   = 0.7
radiance = [9.0, 9.0, 9.0]
"
    );
    let mut list = List::new(count, "x,y,z,radius,material");
    let radius = 0.15 * (10.0 / count as f64).sqrt();
    // A few spheres are so large that they would lie in the floor; they are moved up.
    let lift = (radius - 0.2).max(0.0);
    for i in 0..count {
        let [x, y, z] = [0, 1, 2].map(|k| uniform(seed, i, k));
        let [x, y, z] = [2.4 * x - 1.2, 1.8 * y + lift, 2.4 * z - 1.2];
        list.add(
            format_args!("{x:.6},{y:.6},{z:.6},{radius:.7},matt"),
            format_args!(
                "\n[[sphere]]\ncenter   = [{x:.6}, {y:.6}, {z:.6}]\nradius   = {radius:.7}\nmaterial = \"matt\"\n"
            ),
        );
    }
    list.finish(&mut scene, "spheres", rows)
}

/// A ball of `count` atoms in the places of a face-centred cubic crystal, with a core of gold, and an eighth cut away. `rows` names
/// their extended XYZ file.
pub fn particles(count: usize, seed: u32, rows: &str) -> Generated {
    // Cells of four atoms along the radius of the ball, and some more.
    let cells = (3.0 * count as f64 / (14.0 * PI)).cbrt();
    let most = cells.ceil() as i32 + 2;
    // In halves of a cell, whose corners and faces have an even sum. None of them lies on the cuts.
    let mut places = Vec::new();
    for x in -2 * most..2 * most {
        for y in -2 * most..2 * most {
            for z in -2 * most..2 * most {
                let corner = [x, y, z].map(|k| f64::from(k) + 0.5);
                if (x + y + z) % 2 == 0 && corner.iter().any(|k| *k < 0.0) {
                    let square: f64 = corner.iter().map(|k| k * k).sum();
                    places.push((square, corner));
                }
            }
        }
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    places.truncate(count);
    let last = places.last().map_or(1.0, |p| p.0.sqrt());
    let half = 1.0 / (last + 0.7);
    // Neighbours are √2 halves apart, and nearly touch.
    let radius = 0.69 * half;
    let mut text = format!("{count}\nProperties=species:S:1:pos:R:3:velo:R:3 pbc=\"F F F\"\n");
    for (i, (square, corner)) in places.iter().enumerate() {
        let [x, y, z] = corner.map(|k| k * half);
        let is_core = square.sqrt() < 0.62 * last;
        let species = if is_core { "Au" } else { "Cu" };
        // It turns about the vertical, and is warm.
        let warmth = [0, 1, 2].map(|k| 0.3 * (uniform(seed, i, k) - 0.5));
        let [u, v, w] = [z + warmth[0], warmth[1], warmth[2] - x];
        let _ = writeln!(
            text,
            "{species} {x:.6} {:.6} {z:.6} {u:.4} {v:.4} {w:.4}",
            y + 1.0
        );
    }
    let scene = format!(
        "title = \"A ball of {count} atoms\"

[camera]
eye        = [2.2, 2.7, 2.9]
look_at    = [0.0, 0.9, 0.0]
vfov       = 36.0
resolution = [512, 384]

[material.floor]
type        = \"diffuse\"
reflectance = [0.6, 0.6, 0.6]

[[plane]]
point    = [0.0, -0.05, 0.0]
normal   = [0.0, 1.0, 0.0]
material = \"floor\"

[[light]]
center   = [2.5, 5.0, 1.0]
normal   = [-2.5, -4.0, -1.0]
radius   = 0.9
radiance = [30.0, 28.0, 26.0]

[[spheres]]
file       = {rows:?}
species.Au = {{ radius = {radius:.6}, reflectance = [0.8, 0.5, 0.12] }}
species.Cu = {{ radius = {radius:.6}, reflectance = [0.45, 0.6, 0.75] }}
# To colour them by speed, leave out both reflectances, and write:
# color = {{ column = \"velo\", map = \"viridis\" }}
"
    );
    Generated {
        scene,
        rows: Some(text),
        volume: None,
    }
}

/// A hall of columns under `count` lamps. `rows` names the file for them.
pub fn lights(count: usize, seed: u32, rows: &str) -> Generated {
    let mut scene = format!(
        "title = \"A hall of {count} lamps\"

[camera]
eye        = [0.0, 1.5, 7.6]
look_at    = [0.0, 1.75, 0.0]
vfov       = 52.0
resolution = [512, 384]

[material.stone]
type        = \"diffuse\"
reflectance = [0.72, 0.7, 0.66]

[material.column]
type        = \"diffuse\"
reflectance = [0.8, 0.78, 0.74]

[material.marble]
type     = \"phong\"
diffuse  = [0.25, 0.25, 0.27]
specular = [0.4, 0.4, 0.4]
exponent = 120.0
"
    );
    for (point, normal, material) in [
        ("[0.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "marble"),
        ("[0.0, 4.0, 0.0]", "[0.0, -1.0, 0.0]", "stone"),
        ("[-4.0, 0.0, 0.0]", "[1.0, 0.0, 0.0]", "stone"),
        ("[4.0, 0.0, 0.0]", "[-1.0, 0.0, 0.0]", "stone"),
        ("[0.0, 0.0, -12.0]", "[0.0, 0.0, 1.0]", "stone"),
        ("[0.0, 0.0, 8.0]", "[0.0, 0.0, -1.0]", "stone"),
    ] {
        let _ = write!(
            scene,
            "\n[[plane]]\npoint    = {point}\nnormal   = {normal}\nmaterial = \"{material}\"\n"
        );
    }
    for i in 0..9 {
        for x in [-2.6, 2.6] {
            let z = 5.5 - 2.0 * f64::from(i);
            let _ = write!(
                scene,
                "\n[[cylinder]]\nbase     = [{x:.1}, 0.0, {z:.1}]\ntop      = [{x:.1}, 4.0, {z:.1}]\nradius   = 0.22\nmaterial = \"column\"\n"
            );
        }
    }
    let mut list = List::new(count, "x,y,z,nx,ny,nz,radius,r,g,b");
    // The total light is the same for every number of lamps.
    let room = (7.4 * 19.0 / count as f64).sqrt();
    let radius = 0.12 * room.min(1.0);
    for i in 0..count {
        let u = [0, 1, 2, 3].map(|k| uniform(seed, i, k));
        // Evenly over the ceiling, by additive recurrence; hung in waves.
        let (a, b) = (
            (0.5 + 0.754_877_67 * i as f64).fract(),
            (0.5 + 0.569_840_29 * i as f64).fract(),
        );
        // Not where columns stand: 2.2 to 3 to either side.
        let across = (a - 0.5).abs() * 5.8;
        let x = (a - 0.5).signum() * (across + if across > 2.2 { 0.8 } else { 0.0 });
        let z = 7.5 - 19.0 * b;
        let y = 3.1 + 0.35 * (TAU * (x / 5.0 + z / 9.0)).sin() + 0.25 * u[0];
        let hue = (0.5 * b + 0.2 * a + 0.15 * u[1]).fract();
        let [r, g, b] = [0.0, 1.0 / 3.0, 2.0 / 3.0]
            .map(|turn| 0.08 + 0.92 * (0.5 + 0.5 * (TAU * (hue + turn)).cos()).powi(2))
            .map(|c| {
                180.0 * c * (0.6 + 0.8 * u[2]) * (0.0144 / (radius * radius) * room * room / 7.0)
            });
        let tilt = [u[2] - 0.5, u[3] - 0.5].map(|t| 0.5 * t);
        list.add(
            format_args!(
                "{x:.6},{y:.6},{z:.6},{:.4},-1,{:.4},{radius:.6},{r:.4},{g:.4},{b:.4}",
                tilt[0], tilt[1]
            ),
            format_args!(
                "\n[[light]]\ncenter   = [{x:.6}, {y:.6}, {z:.6}]\nnormal   = [{:.4}, -1.0, {:.4}]\nradius   = {radius:.6}\nradiance = [{r:.4}, {g:.4}, {b:.4}]\n",
                tilt[0], tilt[1]
            ),
        );
    }
    list.finish(&mut scene, "lights", rows)
}

/// Things as tables while they are few, else as rows.
struct List {
    text: String,
    rows: bool,
}

impl List {
    fn new(count: usize, columns: &str) -> Self {
        let rows = count > MOST_IN_TABLES;
        let text = if rows {
            format!("{columns}\n")
        } else {
            String::new()
        };
        Self { text, rows }
    }

    fn add(&mut self, row: std::fmt::Arguments, table: std::fmt::Arguments) {
        let _ = match self.rows {
            true => writeln!(self.text, "{row}"),
            false => self.text.write_fmt(table),
        };
    }

    fn finish(self, scene: &mut String, key: &str, name: &str) -> Generated {
        if self.rows {
            let _ = write!(scene, "\n[[{key}]]\nfile = {name:?}\n");
        } else {
            scene.push_str(&self.text);
        }
        Generated {
            scene: std::mem::take(scene),
            rows: self.rows.then_some(self.text),
            volume: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::hash::scene_hash;
    use crate::scene::Shape;
    use crate::scene::check::lint;
    use crate::scene::parse::parse_str;
    use crate::settings::{Overrides, Settings};

    #[test]
    fn generated_scenes_have_no_warnings_except_open() {
        for make in [spheres, cloud, lights] {
            for count in [1, 2, 10, 35, MOST_IN_TABLES] {
                let made = make(count, 0, "x.csv");
                let scene = parse_str("x.toml".as_ref(), &made.scene).expect("a scene");
                let warnings = lint(&scene).into_iter().map(|w| w.to_string());
                let other: Vec<String> =
                    warnings.filter(|w| !w.contains("scene is open")).collect();
                assert_eq!(other, [""; 0], "{count}");
            }
        }
    }

    #[test]
    fn a_ball_of_atoms_has_just_so_many_and_none_meets_another() {
        for count in [1, 2, 7, 100, 1000] {
            let made = particles(count, 5, "x.xyz");
            let scene = made.parse("x.toml".as_ref()).expect("a scene");
            assert_eq!(scene.primitives.len(), count + 1);
            let balls: Vec<_> = scene
                .primitives
                .iter()
                .filter_map(|p| match p.shape {
                    Shape::Sphere { center, radius } => Some((center, radius)),
                    _ => None,
                })
                .collect();
            for (i, (a, r)) in balls.iter().enumerate() {
                assert!(a.y - r > -0.05, "above the floor");
                assert!(balls[..i].iter().all(|(b, s)| a.distance(*b) > r + s));
            }
        }
    }

    #[test]
    fn few_objects_are_tables_and_many_are_rows_with_the_same_meaning() {
        for make in [spheres, cloud, lights] {
            let few = make(MOST_IN_TABLES, 3, "x.csv");
            assert_eq!(few.rows, None);
            let scene = parse_str("x.toml".as_ref(), &few.scene).expect("a scene");
            assert_eq!(
                scene.primitives.len().max(scene.lights.len()) / MOST_IN_TABLES,
                1
            );
            // The same by hand from a file of rows.
            let folder = tempfile::tempdir().expect("a folder");
            let many = make(MOST_IN_TABLES + 1, 3, "x.csv");
            std::fs::write(folder.path().join("x.csv"), many.rows.expect("rows")).expect("written");
            let from_rows = parse_str(&folder.path().join("x.toml"), &many.scene).expect("a scene");
            let hash = |s: &Scene| scene_hash(s, &Settings::resolve(s, &Overrides::default()));
            let in_memory = make(MOST_IN_TABLES + 1, 3, "x.csv")
                .parse("x.toml".as_ref())
                .expect("a scene");
            assert_eq!(hash(&from_rows), hash(&in_memory));
            assert_ne!(hash(&from_rows), hash(&scene));
        }
    }
}
