//! Which pixels may see a light directly: where lights are many, the host looks once instead of the kernel again and again.

use crate::film::coverage::Rect;
use crate::world::World;

/// For every light that faces the eye, the pixels that its ball may touch: least and greatest x and y.
pub(super) struct SeenLights(Vec<[f64; 4]>);

impl SeenLights {
    /// Of a world seen in a picture of `size` pixels. Any answer makes the same expected picture; this one holds but at the
    /// very edge of wide pictures.
    pub fn new(world: &World, size: [u32; 2]) -> Self {
        let c = &world.camera;
        let pixel = c.dx.length();
        let project = |l: &crate::world::WorldLight| {
            let to = l.center - c.eye;
            if l.normal.dot(c.eye) <= l.offset {
                return None;
            }
            let depth = c.forward.dot(to);
            if depth <= -l.radius {
                return None;
            }
            // About the plane of the eye a ball may be anywhere.
            if depth <= l.radius {
                return Some([0.0, f64::from(size[0]), 0.0, f64::from(size[1])]);
            }
            let x = c.dx.dot(to) / (pixel * pixel * depth);
            let y = c.dy.dot(to) / (pixel * pixel * depth);
            // Seen aslant a ball looks longer.
            let stretch = |t: f64| (1.0 + (t * pixel).powi(2)).sqrt();
            let reach = l.radius / ((depth - l.radius) * pixel) * stretch(x.hypot(y)) + 1.0;
            let (x, y) = (x + f64::from(size[0]) / 2.0, y + f64::from(size[1]) / 2.0);
            Some([x - reach, x + reach, y - reach, y + reach])
        };
        Self(world.lights.iter().filter_map(project).collect())
    }

    /// For every pixel of a tile, in rows, 1 if it may see one.
    pub fn mark(&self, rect: Rect) -> Vec<u32> {
        let width = rect.width() as usize;
        let mut seen = vec![0; width * rect.height() as usize];
        // `as` keeps what lies outside within.
        let within = |x: f64, first: u32, end: u32| (x as u32).clamp(first, end) - first;
        for &[x0, x1, y0, y1] in &self.0 {
            let columns = within(x0.floor(), rect.x0, rect.x1)..within(x1.ceil(), rect.x0, rect.x1);
            for y in within(y0.floor(), rect.y0, rect.y1)..within(y1.ceil(), rect.y0, rect.y1) {
                let row = &mut seen[y as usize * width..][..width];
                row[columns.start as usize..columns.end as usize].fill(1);
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
        let columns: Vec<usize> = (0..20).filter(|x| marked[4 * 20 + x] == 1).collect();
        assert_eq!((columns[0], columns.len()), (0, 7));
        assert_eq!(marked.iter().sum::<u32>() as usize, 7 * 10 - 7);
    }
}
