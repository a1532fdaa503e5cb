//! Lints: warnings about valid scenes that are probably not what their author meant.

mod coincide;
mod cross;
mod eye;
mod far;
mod geometry;
mod implicit;
mod lights;
mod open;

use super::source::quoted;
use super::{Bsdf, Diagnostic, Place, Primitive, Scene};
use glam::DVec3;

/// Scenes with more primitives and lights than this are not searched for problems between two things, because the search takes time in
/// proportion to the square of their number.
pub const MAX_PAIRWISE: usize = 2000;

/// How many warnings of one kind are written out. The rest are counted.
pub const MAX_ALIKE: usize = 10;

/// Warnings of one kind.
#[derive(Default)]
struct Warnings {
    /// The first [`MAX_ALIKE`] warnings: the place in the scene file, or the default for the whole file, and the message.
    first: Vec<(Place, String)>,
    /// The number of further warnings.
    more: usize,
}

impl Warnings {
    fn add(&mut self, place: Place, message: impl FnOnce() -> String) {
        if self.first.len() < MAX_ALIKE {
            self.first.push((place, message()));
        } else {
            self.more += 1;
        }
    }
}

/// Warnings about what is valid but suspect. Most scenes have none.
///
/// There are none for a closed room of opaque walls, with things that stand on its floor and lamps flush on its ceiling.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lints {
    /// What makes the picture differ from what the scene seems to say.
    pub picture: Vec<Diagnostic>,
    /// Remarks about a picture that is as the scene says.
    pub remarks: Vec<Diagnostic>,
}

/// All warnings about a picture of the scene's own resolution, those that concern the picture first.
pub fn lint(scene: &Scene) -> Vec<Diagnostic> {
    let Lints { picture, remarks } = lints(scene, Some(scene.camera.resolution));
    picture.into_iter().chain(remarks).collect()
}

/// The warnings about a picture of this size from a GPU; or from the reference, which has f64, without a size.
pub fn lints(scene: &Scene, on_gpu: Option<[u32; 2]>) -> Lints {
    let mut picture = vec![
        no_rows(scene),
        eye::warnings(scene),
        implicit::warnings(scene),
    ];
    picture.extend(on_gpu.map(|size| far::warnings(scene, size)));
    let mut remarks = vec![
        materials(scene),
        open::warnings(scene),
        implicit::cut(scene),
        implicit::idle(scene),
        eye::narrow(scene),
    ];
    // One light that is off may be meant.
    let off = if scene.lights.iter().all(|l| l.radiance == DVec3::ZERO) {
        &mut picture
    } else {
        &mut remarks
    };
    off.push(lights::black(scene));
    let things = scene.primitives.len() + scene.lights.len();
    if things <= MAX_PAIRWISE {
        picture.push(coincide::warnings(scene));
        picture.push(cross::warnings(scene));
        let covered = lights::covered(scene);
        let shut_in = lights::shut_in(scene, &covered);
        picture.push(covered);
        picture.push(shut_in);
        picture.push(lights::unseen(scene));
        picture.push(lights::turned_away(scene));
    } else {
        let mut skipped = Warnings::default();
        skipped.add(Place::default(), || {
            format!(
                "the scene has {things} primitives and lights; with more than {MAX_PAIRWISE} they are not \
                 searched for surfaces that coincide or cross, or hide a light"
            )
        });
        remarks.push(skipped);
    }
    Lints {
        picture: diagnostics(scene, picture),
        remarks: diagnostics(scene, remarks),
    }
}

fn diagnostics(scene: &Scene, kinds: Vec<Warnings>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for Warnings { first, more } in kinds {
        let counted = format!("{more} more warnings of this kind");
        let counted = (more > 0).then(|| (Place::default(), counted));
        let all = first.into_iter().chain(counted);
        diagnostics.extend(all.map(|(place, message)| Diagnostic {
            path: scene.path.clone(),
            line: place.line,
            column: place.column,
            message,
            unreadable: false,
        }));
    }
    diagnostics
}

/// Files of rows that have none.
fn no_rows(scene: &Scene) -> Warnings {
    let mut warnings = Warnings::default();
    for file in scene.row_files.iter().filter(|f| f.rows == 0) {
        warnings.add(file.place, || {
            format!("{} has no rows", file.path.display())
        });
    }
    warnings
}

/// Materials that do nothing.
fn materials(scene: &Scene) -> Warnings {
    let mut used = vec![false; scene.materials.len()];
    for p in &scene.primitives {
        used[p.material] = true;
    }
    let mut warnings = Warnings::default();
    for (material, used) in scene.materials.iter().zip(used) {
        let (name, place) = (quoted(&material.name), material.place);
        match material.bsdf {
            _ if !used => warnings.add(place, || format!("material {name} is not used")),
            Bsdf::Dielectric {
                ior: 1.0,
                transmittance,
            } => {
                let effect = if transmittance == DVec3::ONE {
                    "is invisible"
                } else {
                    "only tints"
                };
                warnings.add(place, || {
                    format!("material {name} has ior 1: it does not bend light and {effect}")
                });
            }
            _ => {}
        }
    }
    warnings
}

fn is_dielectric(scene: &Scene, p: &Primitive) -> bool {
    scene.materials[p.material].bsdf.is_dielectric()
}

/// "the sphere at line 12", or "the sphere" for a scene made in memory.
fn called(kind: &str, line: usize) -> String {
    if line > 0 {
        format!("the {kind} at line {line}")
    } else {
        format!("the {kind}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;
    use std::path::Path;

    /// A camera, a light and three materials, to which each test adds what it is about.
    const STAGE: &str = "\
[camera]
eye = [0, 1, 4]
look_at = [0, 1, 0]
vfov = 40
resolution = [64, 48]
[material.white]
type = 'diffuse'
reflectance = [0.7, 0.7, 0.7]
[material.red]
type = 'diffuse'
reflectance = [0.7, 0.1, 0.1]
[material.glass]
type = 'dielectric'
[[light]]
center = [0, 4, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [9, 9, 9]
";

    pub(super) fn with(text: &str) -> String {
        format!("{STAGE}{text}")
    }

    pub(super) fn scene(text: &str) -> Scene {
        match parse_str(Path::new("test.toml"), &with(text)) {
            Ok(scene) => scene,
            Err(errors) => panic!("{}", errors[0]),
        }
    }

    /// Whether any warning about the stage with `text` has `phrase` in it.
    pub(super) fn warned(text: &str, phrase: &str) -> bool {
        let warnings = lint(&scene(text));
        warnings.iter().any(|w| w.to_string().contains(phrase))
    }

    fn room() -> String {
        let walls = [
            ("[0,0,0]", "[0,1,0]"),
            ("[0,4,0]", "[0,-1,0]"),
            ("[-3,0,0]", "[1,0,0]"),
            ("[3,0,0]", "[1,0,0]"),
            ("[0,0,-3]", "[0,0,1]"),
            ("[0,0,9]", "[0,0,1]"),
        ];
        let plane = |(point, normal): &(&str, &str)| {
            format!("[[plane]]\npoint = {point}\nnormal = {normal}\nmaterial = 'white'\n")
        };
        walls.iter().map(plane).collect()
    }

    #[test]
    fn an_ordinary_room_has_no_warnings() {
        let text = room()
            + "[[sphere]]\ncenter = [1,0.5,0]\nradius = 0.5\nmaterial = 'glass'\n\
               [[cylinder]]\nbase = [-1,0,0]\ntop = [-1,1,0]\nradius = 0.3\nmaterial = 'glass'\n\
               [[disk]]\ncenter = [0,1,-3]\nnormal = [0,0,1]\nradius = 0.5\nmaterial = 'red'\n";
        assert_eq!(lint(&scene(&text)), []);
    }

    #[test]
    fn files_without_rows() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("test.toml");
        std::fs::write(
            dir.path().join("lamps.csv"),
            "x,y,z,nx,ny,nz,radius,r,g,b\n",
        )
        .unwrap();
        std::fs::write(dir.path().join("parts.csv"), "x,y,z\n\n").unwrap();
        std::fs::write(dir.path().join("none.xyz"), "0\n\n").unwrap();
        let all = "[[lights]]\nfile = 'lamps.csv'\n\
            [[spheres]]\nfile = 'parts.csv'\nradius = 1\nmaterial = 'white'\n\
            [[spheres]]\nfile = 'none.xyz'\nradius = 1\nmaterial = 'white'\n";
        let read = |text: &str| parse_str(&path, text);
        let Lints { picture, .. } = lints(&read(&with(&(room() + all))).unwrap(), None);
        let said: Vec<String> = picture.iter().map(Diagnostic::to_string).collect();
        assert_eq!(said.len(), 3, "{said:?}");
        for (k, name) in ["parts.csv", "none.xyz", "lamps.csv"].iter().enumerate() {
            let expected = format!("{} has no rows", dir.path().join(name).display());
            assert!(said[k].ends_with(&expected) && said[k].contains("test.toml:"));
        }
        // Where there is nothing else, that is why.
        let (dark, _) = STAGE.split_once("[[light]]").unwrap();
        let wrong = read(&format!("{dark}{all}")).unwrap_err();
        let [primitive, light] = &wrong[..] else {
            panic!("{wrong:?}");
        };
        let parts = format!("; {} has no rows", dir.path().join("parts.csv").display());
        let lamps = format!("; {} has no rows", dir.path().join("lamps.csv").display());
        assert!(primitive.message.contains(&parts), "{primitive}");
        assert!(light.message.contains(&lamps), "{light}");
    }

    #[test]
    fn what_changes_the_picture_is_told_from_remarks() {
        let ball = "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'red'\n";
        let Lints { picture, remarks } = lints(&scene(&ball.repeat(2)), None);
        let said = |list: &[Diagnostic]| -> Vec<String> {
            list.iter().map(|w| w.message.clone()).collect()
        };
        let [picture, remarks] = [said(&picture), said(&remarks)];
        assert!(
            matches!(&picture[..], [one] if one.contains("coincides with")),
            "{picture:?}"
        );
        // Two materials are not used, and there are no walls.
        assert_eq!(remarks.len(), 3, "{remarks:?}");
    }

    #[test]
    fn idle_materials() {
        let idle = "test.toml:12:1: material \"glass\" is not used";
        assert!(warned(&room(), idle));
        assert!(!warned(&room(), "material \"white\""));
        let ball = "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'ghost'\n";
        let ghost = |keys: &str| format!("{ball}[material.ghost]\ntype = 'dielectric'\n{keys}\n");
        assert!(warned(
            &ghost("ior = 1"),
            "has ior 1: it does not bend light and is invisible"
        ));
        assert!(warned(
            &ghost("ior = 1.0\ntransmittance = [1,0.9,1]"),
            "and only tints"
        ));
        assert!(!warned(&ghost("ior = 1.0001"), "ior 1"));
    }

    #[test]
    fn many_warnings_of_a_kind_are_counted() {
        let ball = "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'red'\n";
        // Six spheres in one place are fifteen pairs.
        let text = ball.repeat(6);
        assert!(warned(&text, "5 more warnings of this kind"));
        assert!(!warned(&ball.repeat(5), "more warnings"));
    }

    #[test]
    fn large_scenes_are_not_searched_for_pairs() {
        let ball = "[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'red'\n";
        let skipped = "the scene has 2001 primitives and lights; with more than 2000";
        let large = ball.repeat(MAX_PAIRWISE);
        assert!(warned(&large, skipped) && !warned(&large, "coincides with"));
        let largest_searched = ball.repeat(MAX_PAIRWISE - 1);
        assert!(!warned(&largest_searched, "are not searched"));
    }

    #[test]
    fn scenes_made_in_memory_have_no_lines() {
        let mut scene =
            scene(&"[[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = 'red'\n".repeat(2));
        for p in &mut scene.primitives {
            (p.line, p.column) = (0, 0);
        }
        let messages: Vec<String> = lint(&scene).iter().map(|w| w.message.clone()).collect();
        let expected =
            "the sphere coincides with the sphere, which rays meet first from both sides";
        assert!(messages.iter().any(|m| m == expected), "{messages:?}");
    }
}
