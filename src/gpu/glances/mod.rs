//! Glances, and the pixels that get them.
//!
//! A *glance* is an extra camera ray that gathers nothing but the light that it sees directly, or by way of mirrors and glass. The
//! edge of a light, and of its image in a mirror, is by far the noisiest thing in most pictures, and a camera ray costs a tenth
//! of a path. So the kernel sends several glances for each sample of a pixel that may show a light. The path of that sample then
//! leaves out the light that its glances have already seen. The kernel's side is in `shaders/glance/`.
//!
//! The host decides which pixels get glances, and tells the kernel with one [`Mark`] a pixel. Any choice of marks gives the same
//! expected picture. A missing mark costs noise, and a needless one costs time. A pixel is marked
//!
//! - if it may show a light directly ([`lights`]);
//! - if it may show the edge of a light's image in a mirror or in glass, or any part of an image where chance decides
//!   between reflection and refraction ([`chains`]);
//! - if it may show the image of a light that is reflected once by the glass ball around it, however small.

mod chains;
mod lights;
#[cfg(test)]
mod tests;

use crate::film::coverage::Rect;
use crate::kernel::{BRANCH_SHIFT, MANY_SHIFT};
use crate::settings::{LightParts, Settings};
use crate::world::{World, WorldCamera};
use chains::Chains;
use glam::DVec3;
use lights::DirectLights;
use std::collections::HashMap;

/// What the kernel is told about the glances of one pixel. Vertices are numbered from 1, the first surface that a glance meets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Mark {
    /// The last vertex at which a glance may find a light; 0: the pixel gets no glances.
    last_vertex: u8,
    /// The vertex of glass at which half of the glances are reflected and the other half refracted; 0: chance decides everywhere.
    branch_vertex: u8,
    /// Whether the pixel gets more glances: it may show a light directly, or a very small image of one.
    many: bool,
}

impl Mark {
    /// The kernel's form: `last_vertex` in bits 0 to 7, `branch_vertex` in the 8 bits from [`BRANCH_SHIFT`] on, and `many` at
    /// bit [`MANY_SHIFT`].
    fn pack(self) -> u32 {
        let Self {
            last_vertex,
            branch_vertex,
            many,
        } = self;
        u32::from(last_vertex)
            | u32::from(branch_vertex) << BRANCH_SHIFT
            | u32::from(many) << MANY_SHIFT
    }

    /// The same mark, with a light that may be seen directly.
    fn with_direct(self) -> Self {
        Self {
            last_vertex: self.last_vertex.max(1),
            many: true,
            ..self
        }
    }
}

/// The marks of a picture's pixels.
pub(super) struct GlanceMarks {
    lights: DirectLights,
    /// `None` where glances look for lights at their first vertex alone.
    chains: Option<Chains>,
    /// The light that the picture keeps.
    light: LightParts,
    /// Packed marks of tiles that may come back, in rows.
    kept: HashMap<Rect, Vec<u32>>,
    /// How many pixels may be in `kept`: as many as the picture has.
    max_kept: u64,
}

impl GlanceMarks {
    /// Marks for `world` rendered with `settings`, where glances look for lights up to vertex `last_vertex`.
    pub fn new(world: &World, settings: &Settings, last_vertex: u32) -> Self {
        Self {
            lights: DirectLights::new(world, settings.size),
            chains: (last_vertex > 1).then(|| Chains::new(world, settings.size, last_vertex)),
            light: settings.light,
            kept: HashMap::new(),
            max_kept: Rect::whole(settings.size).area(),
        }
    }

    /// The packed mark of every pixel of a tile, in rows. A mark does not depend on the tile that the pixel is in. It depends on
    /// the light that the picture keeps only where none of the light that glances may find is kept: there it is 0.
    pub fn marks(&mut self, rect: Rect) -> &[u32] {
        if !self.kept.contains_key(&rect) {
            let kept: u64 = self.kept.keys().map(Rect::area).sum();
            if kept + rect.area() > self.max_kept {
                self.kept.clear();
            }
            let marks = self.mark(rect).into_iter().map(Mark::pack).collect();
            self.kept.insert(rect, marks);
        }
        &self.kept[&rect]
    }

    fn mark(&self, rect: Rect) -> Vec<Mark> {
        let mut marks = vec![Mark::default(); rect.width() as usize * rect.height() as usize];
        if let Some(chains) = &self.chains {
            chains.mark(rect, &mut marks);
        }
        self.lights.mark(rect, &mut marks);
        for mark in &mut marks {
            let mut scatterings = 0..u32::from(mark.last_vertex);
            if !scatterings.any(|times| self.light.keeps(times)) {
                *mark = Mark::default();
            }
        }
        marks
    }
}

/// A part of the film, in pixels.
#[derive(Debug, Clone, Copy)]
struct FilmBox {
    min_x: f64,
    max_x: f64,
    min_y: f64,
    max_y: f64,
}

impl FilmBox {
    /// All of a picture of this size, and a little more on each side.
    fn whole([width, height]: [u32; 2]) -> Self {
        Self {
            min_x: -2.0,
            max_x: f64::from(width) + 2.0,
            min_y: -2.0,
            max_y: f64::from(height) + 2.0,
        }
    }

    /// The place where a ray from the eye in direction `d` meets the film; `None` for one that leads backwards.
    fn of_direction(camera: &WorldCamera, [width, height]: [u32; 2], d: DVec3) -> Option<Self> {
        let pixel2 = camera.dx.length_squared();
        let depth = camera.forward.dot(d);
        let x = camera.dx.dot(d) / (pixel2 * depth) + f64::from(width) / 2.0;
        let y = camera.dy.dot(d) / (pixel2 * depth) + f64::from(height) / 2.0;
        (depth > 0.0).then_some(Self {
            min_x: x,
            max_x: x,
            min_y: y,
            max_y: y,
        })
    }

    /// The smallest box around both.
    fn union(self, other: Self) -> Self {
        Self {
            min_x: self.min_x.min(other.min_x),
            max_x: self.max_x.max(other.max_x),
            min_y: self.min_y.min(other.min_y),
            max_y: self.max_y.max(other.max_y),
        }
    }

    /// In pixels.
    fn area(&self) -> f64 {
        (self.max_x - self.min_x) * (self.max_y - self.min_y)
    }

    /// The box with this share of its size added on each side.
    fn widened(self, share: f64) -> Self {
        let (x, y) = (
            share * (self.max_x - self.min_x),
            share * (self.max_y - self.min_y),
        );
        Self {
            min_x: self.min_x - x,
            max_x: self.max_x + x,
            min_y: self.min_y - y,
            max_y: self.max_y + y,
        }
    }

    /// The pixels that a ball may touch; `None` for a ball behind the eye.
    fn of_ball(camera: &WorldCamera, size: [u32; 2], center: DVec3, radius: f64) -> Option<Self> {
        let to = center - camera.eye;
        let pixel = camera.dx.length();
        let depth = camera.forward.dot(to);
        if depth <= -radius {
            return None;
        }
        if depth <= radius {
            // A ball in the plane of the eye may be anywhere on the film.
            return Some(Self::whole(size));
        }
        let x = camera.dx.dot(to) / (pixel * pixel * depth);
        let y = camera.dy.dot(to) / (pixel * pixel * depth);
        // A ball far from the middle of the film looks longer.
        let stretch = (1.0 + (x.hypot(y) * pixel).powi(2)).sqrt();
        let reach = radius / ((depth - radius) * pixel) * stretch + 1.0;
        let [width, height] = size.map(f64::from);
        let (x, y) = (x + width / 2.0, y + height / 2.0);
        Some(Self {
            min_x: x - reach,
            max_x: x + reach,
            min_y: y - reach,
            max_y: y + reach,
        })
    }
}
