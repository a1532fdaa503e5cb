//! Sides and media: which side of what rays can be on, which dielectric solid lies in which, and which one
//! a light shines in.

use super::geometry::DiskSide;
use super::{AIR, COINCIDENT, Geometry, Side, WorldLight, WorldPrimitive};
use crate::scene::Bsdf;
use glam::DVec3;

/// Times the format's largest radiance this still fits f32. An index of thirty million between eye and light would exceed it.
const LARGEST_SCALE: f64 = 1e15;

fn is_dielectric(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Dielectric { .. })
}

/// Opaque planes turn to the eye, opaque solids learn whether the eye is inside.
pub(super) fn settle_sides(primitives: &mut [WorldPrimitive], materials: &[Bsdf], eye: DVec3) {
    for p in primitives {
        if is_dielectric(&materials[p.material]) || matches!(p.geometry, Geometry::Disk { .. }) {
            continue;
        }
        let eye_inside = p.geometry.holds(eye);
        p.side = if eye_inside {
            Side::Inside
        } else {
            Side::Outside
        };
        if let Geometry::Plane { normal, offset } = &mut p.geometry {
            p.side = Side::Outside;
            if eye_inside {
                (*normal, *offset) = (-*normal, -*offset);
            }
        }
    }
}

/// Whether solid `outer` holds solid `inner`; of two equal ones the `first` in the file is the outer.
fn encloses(outer: &Geometry, inner: &Geometry, first: bool) -> bool {
    if let (
        Geometry::Plane { normal, offset },
        Geometry::Plane {
            normal: n,
            offset: o,
        },
    ) = (outer, inner)
    {
        // Half-spaces that are not parallel cross, and neither holds the other.
        let parallel = normal.cross(*n).length() <= COINCIDENT && normal.dot(*n) > 0.0;
        return parallel && (offset > o || (offset == o && first));
    }
    let (core, volume) = inner.core();
    let larger = outer.core().1;
    outer.holds(core) && (larger > volume || (larger == volume && first))
}

/// The dielectric solids of a scene, by their numbers from 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Media {
    solids: Vec<Solid>,
}

#[derive(Debug, Clone, PartialEq)]
struct Solid {
    geometry: Geometry,
    /// How many solids deep it lies; those in air have 1.
    depth: usize,
    /// Index of refraction inside, relative to air.
    index: f64,
}

impl Media {
    /// Numbers the dielectric solids, and finds the one just outside each.
    pub(super) fn new(primitives: &mut [WorldPrimitive], materials: &[Bsdf]) -> Self {
        let solids: Vec<usize> = (0..primitives.len())
            .filter(|&i| is_dielectric(&materials[primitives[i].material]))
            .collect();
        let around: Vec<Vec<usize>> = (0..solids.len())
            .map(|k| {
                let inner = &primitives[solids[k]].geometry;
                (0..solids.len())
                    .filter(|&m| m != k && encloses(&primitives[solids[m]].geometry, inner, m < k))
                    .collect()
            })
            .collect();
        for (k, &i) in solids.iter().enumerate() {
            // Those around it lie in each other like the skins of an onion: the innermost has the most around it.
            let innermost = around[k].iter().max_by_key(|&&m| around[m].len());
            primitives[i].solid = k as u32 + 1;
            primitives[i].parent = innermost.map_or(AIR, |&m| m as u32 + 1);
        }
        let ior = |k: usize| match materials[primitives[solids[k]].material] {
            Bsdf::Dielectric { ior, .. } => ior,
            _ => 1.0,
        };
        let solid = |k: usize| {
            let mut s = Solid {
                geometry: primitives[solids[k]].geometry,
                depth: 0,
                index: 1.0,
            };
            let mut at = Some(k);
            while let Some(m) = at {
                s.depth += 1;
                s.index *= ior(m);
                at = (primitives[solids[m]].parent as usize).checked_sub(1);
            }
            s
        };
        Self {
            solids: (0..solids.len()).map(solid).collect(),
        }
    }

    /// The innermost solid that `holds`.
    fn innermost(&self, holds: impl Fn(&Geometry) -> bool) -> u32 {
        let around = self.solids.iter().enumerate();
        around
            .filter(|(_, s)| holds(&s.geometry))
            .max_by_key(|(_, s)| s.depth)
            .map_or(AIR, |(k, _)| k as u32 + 1)
    }

    /// The innermost solid around a point.
    pub(super) fn at(&self, p: DVec3) -> u32 {
        self.innermost(|g| g.holds(p))
    }

    /// Index of refraction of every medium, relative to air: air's, then those of the solids.
    pub(super) fn indices(&self) -> Vec<f64> {
        let solids = self.solids.iter().map(|s| s.index);
        std::iter::once(1.0).chain(solids).collect()
    }

    /// (n at the eye / n in the medium)² for every medium, air first; at most [`LARGEST_SCALE`].
    pub(super) fn light_scales(&self, eye: u32) -> Vec<f64> {
        let indices = self.indices();
        let n = indices[eye as usize];
        let scale = |m: &f64| (n / m).powi(2).min(LARGEST_SCALE);
        indices.iter().map(scale).collect()
    }

    /// The medium that a light shines in; `None` if a surface cuts it, or seems to.
    pub(super) fn of_light(&self, l: &WorldLight) -> Option<u32> {
        let side = |g: &Geometry| g.side_of_disk(l.center, l.normal, l.radius);
        if self
            .solids
            .iter()
            .any(|s| side(&s.geometry) == DiskSide::Cut)
        {
            return None;
        }
        Some(self.innermost(|g| side(g) == DiskSide::Inside))
    }

    /// Whether any part of a light may lie inside a solid.
    pub(super) fn may_hold(&self, solid: u32, lights: &[WorldLight]) -> bool {
        solid != AIR
            && lights.iter().any(|l| {
                let g = &self.solids[solid as usize - 1].geometry;
                g.side_of_disk(l.center, l.normal, l.radius) != DiskSide::Outside
            })
    }
}
