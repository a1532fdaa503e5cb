//! Which pixels may see a light directly: where lights are many, the host looks once instead of the kernel again and again.

use crate::film::coverage::Rect;
use crate::world::World;
use glam::DVec3;

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
}

impl SeenLights {
    /// Of a world seen in a picture of `size` pixels. Any answer makes the same expected picture; this one holds but at the
    /// very edge of wide pictures.
    pub fn new(world: &World, size: [u32; 2]) -> Self {
        let c = &world.camera;
        let pixel = c.dx.length();
        let [width, height] = size.map(f64::from);
        let project = |l: &crate::world::WorldLight| {
            let to = l.center - c.eye;
            if l.normal.dot(c.eye) <= l.offset {
                return None;
            }
            let depth = c.forward.dot(to);
            if depth <= -l.radius {
                return None;
            }
            let around = if depth <= l.radius {
                // About the plane of the eye a ball may be anywhere.
                [0.0, width, 0.0, height]
            } else {
                let x = c.dx.dot(to) / (pixel * pixel * depth);
                let y = c.dy.dot(to) / (pixel * pixel * depth);
                // Seen aslant a ball looks longer.
                let stretch = |t: f64| (1.0 + (t * pixel).powi(2)).sqrt();
                let reach = l.radius / ((depth - l.radius) * pixel) * stretch(x.hypot(y)) + 1.0;
                let (x, y) = (x + width / 2.0, y + height / 2.0);
                [x - reach, x + reach, y - reach, y + reach]
            };
            Some(SeenLight {
                around,
                to,
                normal: l.normal,
                radius: l.radius,
            })
        };
        Self {
            lights: world.lights.iter().filter_map(project).collect(),
            corner: c.forward + (0.5 - width / 2.0) * c.dx + (0.5 - height / 2.0) * c.dy,
            dx: c.dx,
            dy: c.dy,
        }
    }

    /// For every pixel of a tile, in rows, 1 if it may see one.
    pub fn mark(&self, rect: Rect) -> Vec<u32> {
        let width = rect.width() as usize;
        let mut seen = vec![0; width * rect.height() as usize];
        // `as` keeps what lies outside within.
        let within = |x: f64, first: u32, end: u32| (x as u32).clamp(first, end) - first;
        let half_diagonal = 0.75 * self.dx.length();
        for light in &self.lights {
            let [x0, x1, y0, y1] = light.around;
            let columns = within(x0.floor(), rect.x0, rect.x1)..within(x1.ceil(), rect.x0, rect.x1);
            for y in within(y0.floor(), rect.y0, rect.y1)..within(y1.ceil(), rect.y0, rect.y1) {
                let left =
                    self.corner + f64::from(rect.x0) * self.dx + f64::from(rect.y0 + y) * self.dy;
                let row = &mut seen[y as usize * width..][..width];
                for x in columns.clone() {
                    let pixel = &mut row[x as usize];
                    if *pixel == 0 {
                        let w = left + f64::from(x) * self.dx;
                        *pixel = u32::from(light.touches(w, w.length(), half_diagonal));
                    }
                }
            }
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;

    #[test]
    fn a_light_in_the_middle_marks_the_middle() {
        let text = "[camera]\neye = [0, 0, 4]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [64, 48]\n\
            [material.white]\ntype = 'diffuse'\nreflectance = [1, 1, 1]\n\
            [[plane]]\npoint = [0, -9, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
            [[light]]\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
            [[light]]\ncenter = [1, 0, 0]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
            [[light]]\ncenter = [0, 0, 9]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n";
        let scene = parse_str("x.toml".as_ref(), text).expect("a scene");
        let seen = SeenLights::new(&World::new(&scene, [64, 48]), [64, 48]);
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
                assert_eq!(*seen, 1, "({x}, {y})");
            } else if away > 3.3 + 1.5 {
                assert_eq!(*seen, 0, "({x}, {y})");
            }
            counts[*seen as usize] += 1;
        }
        assert!(counts[0] > 100 && counts[1] > 20, "{counts:?}");
    }
}
