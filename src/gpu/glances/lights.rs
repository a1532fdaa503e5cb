//! Pixels that may show a light directly: those that a light's disk touches, or comes near.

use super::{FilmBox, Mark};
use crate::film::coverage::Rect;
use crate::world::{World, WorldLight};
use glam::DVec3;

/// A light whose front the eye may see.
struct DirectLight {
    /// Pixels that a ball around the light may touch.
    pixels: FilmBox,
    /// From the eye to the light's centre.
    to: DVec3,
    normal: DVec3,
    radius: f64,
}

impl DirectLight {
    /// Whether the light's disk comes near a pixel, to first order. The eye sees the middle of the pixel along `w`, which
    /// has length `length`. `half_diagonal` is that of the pixel, at distance 1 from the eye.
    fn touches(&self, w: DVec3, length: f64, half_diagonal: f64) -> bool {
        // First a ball around the light. Nothing better can be said where the eye sees the light from its edge.
        let along = self.to.dot(w) / length;
        let off = self.to - w * (along / length);
        if along <= 0.0 || off.length() > self.radius + half_diagonal * self.to.length() {
            return false;
        }
        let fall = self.normal.dot(w);
        if fall > -3.0 * half_diagonal {
            return true;
        }
        let t = self.normal.dot(self.to) / fall;
        let spread = 1.5 * t * half_diagonal * (1.0 - length / fall);
        (w * t - self.to).length() <= self.radius + spread
    }
}

/// The lights that a picture may show directly.
pub(super) struct DirectLights {
    lights: Vec<DirectLight>,
    /// From the eye through the middle of the pixel in the top left corner.
    corner: DVec3,
    /// A step of one pixel to the right.
    dx: DVec3,
    /// A step of one pixel down.
    dy: DVec3,
}

impl DirectLights {
    pub fn new(world: &World, size: [u32; 2]) -> Self {
        let c = &world.camera;
        let [width, height] = size.map(f64::from);
        let faces_eye = |l: &&WorldLight| l.normal.dot(c.eye) > l.offset;
        let project = |l: &WorldLight| {
            Some(DirectLight {
                pixels: FilmBox::of_ball(c, size, l.center, l.radius)?,
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
        }
    }

    /// Adds to the marks of the pixels of `rect` where a light may be seen directly.
    pub fn mark(&self, rect: Rect, marks: &mut [Mark]) {
        let width = rect.width() as usize;
        // `as` brings numbers beyond the range of u32 to its ends.
        let within = |x: f64, first: u32, end: u32| (x as u32).clamp(first, end);
        let half_diagonal = 0.75 * self.dx.length();
        for light in &self.lights {
            let p = light.pixels;
            let columns =
                within(p.min_x.floor(), rect.x0, rect.x1)..within(p.max_x.ceil(), rect.x0, rect.x1);
            let rows =
                within(p.min_y.floor(), rect.y0, rect.y1)..within(p.max_y.ceil(), rect.y0, rect.y1);
            for y in rows {
                let left = self.corner + f64::from(y) * self.dy;
                let row = &mut marks[(y - rect.y0) as usize * width..][..width];
                for x in columns.clone() {
                    let mark = &mut row[(x - rect.x0) as usize];
                    let w = left + f64::from(x) * self.dx;
                    if !mark.many && light.touches(w, w.length(), half_diagonal) {
                        *mark = mark.with_direct();
                    }
                }
            }
        }
    }
}
