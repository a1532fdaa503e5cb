//! Which pixels may see a light: for these the kernel sends extra camera rays, *glances*.
//!
//! Any answer makes the same expected picture. What is marked are the pixels about a light's disk, and those that show the
//! edge of its image in a mirror or in glass, or any part of it where chance decides between reflection and
//! refraction.

use super::shown::Shown;
use crate::film::coverage::Rect;
use crate::kernel::DIRECT_SHIFT;
use crate::settings::{LightParts, Settings};
use crate::world::{World, WorldCamera, WorldLight};
use glam::DVec3;
use std::collections::HashMap;

/// Least and greatest x and y of the pixels that a ball may touch, if any.
pub(super) fn around(
    camera: &WorldCamera,
    size: [u32; 2],
    center: DVec3,
    radius: f64,
) -> Option<[f64; 4]> {
    let to = center - camera.eye;
    let pixel = camera.dx.length();
    let [width, height] = size.map(f64::from);
    let depth = camera.forward.dot(to);
    if depth <= -radius {
        return None;
    }
    if depth <= radius {
        // About the plane of the eye a ball may be anywhere.
        return Some([-2.0, width + 2.0, -2.0, height + 2.0]);
    }
    let x = camera.dx.dot(to) / (pixel * pixel * depth);
    let y = camera.dy.dot(to) / (pixel * pixel * depth);
    // Seen aslant a ball looks longer.
    let stretch = (1.0 + (x.hypot(y) * pixel).powi(2)).sqrt();
    let reach = radius / ((depth - radius) * pixel) * stretch + 1.0;
    let (x, y) = (x + width / 2.0, y + height / 2.0);
    Some([x - reach, x + reach, y - reach, y + reach])
}

/// A light that faces the eye.
struct SeenLight {
    /// Least and greatest x and y of the pixels that its ball may touch.
    around: [f64; 4],
    /// From the eye to its centre.
    to: DVec3,
    normal: DVec3,
    radius: f64,
}

impl SeenLight {
    /// Whether its disk comes near the pixel that is seen along `w`, of length `far`, to first order.
    fn touches(&self, w: DVec3, far: f64, half_diagonal: f64) -> bool {
        // A ball around it, first, which is all there is to say where its plane is seen from the edge.
        let along = self.to.dot(w) / far;
        let off = self.to - w * (along / far);
        if along <= 0.0 || off.length() > self.radius + half_diagonal * self.to.length() {
            return false;
        }
        let fall = self.normal.dot(w);
        if fall > -3.0 * half_diagonal {
            return true;
        }
        let t = self.normal.dot(self.to) / fall;
        let spread = 1.5 * t * half_diagonal * (1.0 - far / fall);
        (w * t - self.to).length() <= self.radius + spread
    }
}

/// The lights that a picture may show.
pub(super) struct SeenLights {
    lights: Vec<SeenLight>,
    /// Along the middle of the pixel at the corner, and a step right and down.
    corner: DVec3,
    dx: DVec3,
    dy: DVec3,
    shown: Option<Shown>,
    /// The light that is kept.
    light: LightParts,
    /// Marks of tiles, which come back several times; of so many pixels at most.
    known: HashMap<Rect, Vec<u32>>,
    most: u64,
}

impl SeenLights {
    /// Of a world that is rendered with `settings`, by glances that go on to vertex `sight`.
    pub fn new(world: &World, settings: &Settings, sight: u32) -> Self {
        let c = &world.camera;
        let [width, height] = settings.size.map(f64::from);
        let faces_eye = |l: &&WorldLight| l.normal.dot(c.eye) > l.offset;
        let project = |l: &WorldLight| {
            Some(SeenLight {
                around: around(c, settings.size, l.center, l.radius)?,
                to: l.center - c.eye,
                normal: l.normal,
                radius: l.radius,
            })
        };
        let facing = world.lights.iter().filter(faces_eye);
        Self {
            lights: facing.filter_map(project).collect(),
            corner: c.forward + (0.5 - width / 2.0) * c.dx + (0.5 - height / 2.0) * c.dy,
            dx: c.dx,
            dy: c.dy,
            shown: (sight > 1).then(|| Shown::new(world, settings, sight)),
            light: settings.light,
            known: HashMap::new(),
            most: Rect::whole(settings.size).area(),
        }
    }

    /// The mark of every pixel of a tile, in rows: the last vertex at which a light may be seen, 0 for nowhere; and, from bit
    /// [`BRANCH_SHIFT`] on, at which vertex of glass half of the glances are to be reflected, 0 for none; and, from bit
    /// [`DIRECT_SHIFT`] on, 1 where a light may be seen directly. It depends on the pixel alone, not on the tile; nor on the light
    /// that is kept, but that it is 0 where nothing that might be seen is.
    pub fn marks(&mut self, rect: Rect) -> &[u32] {
        if !self.known.contains_key(&rect) {
            let held: u64 = self.known.keys().map(Rect::area).sum();
            if held + rect.area() > self.most {
                self.known.clear();
            }
            let marks = self.mark(rect);
            self.known.insert(rect, marks);
        }
        &self.known[&rect]
    }

    fn mark(&self, rect: Rect) -> Vec<u32> {
        let width = rect.width() as usize;
        let mut seen = vec![0; width * rect.height() as usize];
        if let Some(shown) = &self.shown {
            shown.mark(rect, &mut seen);
        }
        // `as` keeps what lies outside within.
        let within = |x: f64, first: u32, end: u32| (x as u32).clamp(first, end);
        let half_diagonal = 0.75 * self.dx.length();
        for light in &self.lights {
            let [x0, x1, y0, y1] = light.around;
            let columns = within(x0.floor(), rect.x0, rect.x1)..within(x1.ceil(), rect.x0, rect.x1);
            for y in within(y0.floor(), rect.y0, rect.y1)..within(y1.ceil(), rect.y0, rect.y1) {
                let left = self.corner + f64::from(y) * self.dy;
                let row = &mut seen[(y - rect.y0) as usize * width..][..width];
                for x in columns.clone() {
                    let pixel = &mut row[(x - rect.x0) as usize];
                    let w = left + f64::from(x) * self.dx;
                    if *pixel >> DIRECT_SHIFT == 0 && light.touches(w, w.length(), half_diagonal) {
                        *pixel = (*pixel).max(1) | 1 << DIRECT_SHIFT;
                    }
                }
            }
        }
        for mark in &mut seen {
            let sight = *mark & 0xff;
            if !(0..sight).any(|scatterings| self.light.keeps(scatterings)) {
                *mark = 0;
            }
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::BRANCH_SHIFT;
    use crate::scene::parse::parse_str;
    use crate::settings::Overrides;

    #[test]
    fn a_light_in_the_middle_marks_the_middle() {
        let text = "[camera]\neye = [0, 0, 4]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [64, 48]\n\
            [material.white]\ntype = 'diffuse'\nreflectance = [1, 1, 1]\n\
            [[plane]]\npoint = [0, -9, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
            [[light]]\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
            [[light]]\ncenter = [1, 0, 0]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
            [[light]]\ncenter = [0, 0, 9]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n";
        let scene = parse_str("x.toml".as_ref(), text).expect("a scene");
        let settings = Settings::resolve(&scene, &Overrides::default());
        let seen = SeenLights::new(&World::new(&scene, [64, 48]), &settings, 1);
        // A pixel is 2 x 4 tan 20 / 48 = 0.0607 wide there: the light reaches 3.3 pixels from the middle.
        let part = Rect {
            x0: 30,
            y0: 20,
            x1: 50,
            y1: 30,
        };
        let marked = seen.mark(part);
        let mut counts = [0, 0];
        for (i, seen) in marked.iter().enumerate() {
            let [x, y] = [30 + i % 20, 20 + i / 20].map(|k| k as f64);
            let away = (x + 0.5 - 32.0).hypot(y + 0.5 - 24.0);
            // A pixel reaches 0.71 from its middle.
            if away < 3.3 + 0.7 {
                assert_eq!(*seen, DIRECT, "({x}, {y})");
            } else if away > 3.3 + 1.5 {
                assert_eq!(*seen, 0, "({x}, {y})");
            }
            counts[usize::from(*seen > 0)] += 1;
        }
        assert!(counts[0] > 100 && counts[1] > 20, "{counts:?}");
    }

    const LOOKING: &str = "[camera]\neye = [0, 0, 4]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [512, 384]\n\
        [material.silver]\ntype = 'mirror'\nreflectance = [1, 1, 1]\n\
        [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
        [[light]]\ncenter = [0, 0, 9]\nnormal = [0, 0, -1]\nradius = 1.5\nradiance = [1, 1, 1]\n";

    /// A scene looked at along the z axis, with a large lamp behind the eye.
    fn looking(things: &str, light: LightParts) -> SeenLights {
        let scene = parse_str("x.toml".as_ref(), &format!("{LOOKING}{things}")).expect("a scene");
        let flags = Overrides {
            light: Some(light),
            ..Overrides::default()
        };
        let settings = Settings::resolve(&scene, &flags);
        SeenLights::new(&World::new(&scene, settings.size), &settings, 6)
    }

    /// The distance from the middle of the picture, in pixels, at which a ball of radius 1 there shows the lamp's edge.
    fn edge_in_the_ball() -> f64 {
        // Where the ray that meets the ball at this angle from its pole comes to the lamp's plane.
        let away = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let d = DVec3::new(sin, 0.0, cos - 4.0).normalize();
            let n = DVec3::new(sin, 0.0, cos);
            let onward = d - 2.0 * d.dot(n) * n;
            sin + onward.x / onward.z * (9.0 - cos)
        };
        let (mut inside, mut outside) = (0.0, 0.7);
        for _ in 0..60 {
            let middle = (inside + outside) / 2.0;
            if away(middle) < 1.5 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        let tangent = f64::sin(inside) / (4.0 - f64::cos(inside));
        tangent * 192.0 / 20f64.to_radians().tan()
    }

    /// The mark where nothing but a light is seen.
    const DIRECT: u32 = 1 | 1 << DIRECT_SHIFT;

    const WHOLE: Rect = Rect {
        x0: 0,
        y0: 0,
        x1: 512,
        y1: 384,
    };

    #[test]
    fn a_lamp_in_a_mirror_ball_marks_the_ring_where_its_edge_is() {
        let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'silver'\n";
        let edge = edge_in_the_ball();
        assert!((10.0..60.0).contains(&edge), "{edge}");
        for (k, mark) in looking(ball, LightParts::ALL)
            .mark(WHOLE)
            .iter()
            .enumerate()
        {
            let [x, y] = [k % 512, k / 512].map(|k| k as f64 + 0.5);
            let off = ((x - 256.0).hypot(y - 192.0) - edge).abs();
            if off < 0.7 {
                assert_eq!(*mark, 2, "({x}, {y})");
            } else if off > 3.0 {
                assert_eq!(*mark, 0, "({x}, {y})");
            }
        }
        let indirect = LightParts {
            emitted: false,
            direct: false,
            ..LightParts::ALL
        };
        let marks = looking(ball, indirect).mark(WHOLE);
        assert!(marks.iter().all(|m| *m == 0), "nothing is kept of it");
    }

    #[test]
    fn a_lamp_in_glass_is_marked_all_over_and_half_of_the_glances_are_reflected() {
        let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'glass'\n";
        let edge = edge_in_the_ball();
        let ball_edge = f64::tan(f64::asin(0.25)) * 192.0 / 20f64.to_radians().tan();
        let all = looking(ball, LightParts::ALL).mark(WHOLE);
        for (k, mark) in all.iter().enumerate() {
            let [x, y] = [k % 512, k / 512].map(|k| k as f64 + 0.5);
            let off = (x - 256.0).hypot(y - 192.0);
            if off < edge + 0.7 {
                assert!(
                    mark & 0xff >= 2 && (mark >> BRANCH_SHIFT) & 0xff == 1,
                    "({x}, {y}): {mark}"
                );
            } else if off > ball_edge + 3.0 {
                assert_eq!(*mark, 0, "({x}, {y})");
            }
        }
        let direct = LightParts {
            emitted: false,
            direct: true,
            indirect: false,
        };
        let part = looking(ball, direct).mark(WHOLE);
        assert_eq!(part, all, "parts add up to the whole");
    }

    #[test]
    fn marks_of_a_part_are_those_of_the_whole() {
        let text = include_str!("../../scenes/three_materials.toml");
        let scene = parse_str("x.toml".as_ref(), text).expect("a scene");
        for size in [[90, 70], [400, 300]] {
            let flags = Overrides {
                size: Some(size),
                ..Overrides::default()
            };
            let settings = Settings::resolve(&scene, &flags);
            let world = World::new(&scene, size);
            let mut seen = SeenLights::new(&world, &settings, 6);
            let whole = seen.mark(Rect::whole(size));
            assert!(whole.contains(&DIRECT) && whole.iter().any(|m| m & 0xff > 1));
            for [x0, y0, x1, y1] in [
                [0, 0, 90, 70],
                [31, 17, 64, 45],
                [50, 33, 51, 34],
                [0, 40, 89, 70],
            ] {
                let part = Rect { x0, y0, x1, y1 };
                let rows = (y0..y1)
                    .map(|y| &whole[(y * size[0] + x0) as usize..][..part.width() as usize]);
                let expected: Vec<u32> = rows.flatten().copied().collect();
                assert_eq!(seen.marks(part), expected, "{part:?} of {size:?}");
                assert_eq!(seen.marks(part), expected, "kept: {part:?} of {size:?}");
            }
        }
    }
}
