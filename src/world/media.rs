//! Sides and media: on which side of a surface rays can be, how dielectric solids nest, and which medium a light shines in.

use super::geometry::DiskSide;
use super::{AIR, Bounds, Geometry, Side, Tree, WorldLight, WorldPrimitive};
use crate::coincidence::{COINCIDENT, MAY_COINCIDE, parallel};
use crate::scene::Bsdf;
use glam::DVec3;

/// Largest factor on a light's radiance. The format's largest radiance times this factor still fits f32. Only an index of refraction
/// beyond thirty million between eye and light would exceed it.
const LARGEST_SCALE: f64 = 1e15;

/// Turns opaque planes to the eye, and notes for opaque solids whether the eye is inside.
pub(super) fn settle_sides(primitives: &mut [WorldPrimitive], materials: &[Bsdf], eye: DVec3) {
    for p in primitives {
        if materials[p.material].is_dielectric() || p.geometry.is_sheet() {
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

/// Whether solid `outer` holds solid `inner`. Of two equal solids, the one that is `first` in the file is the outer.
fn encloses(outer: &Geometry, inner: &Geometry, first: bool) -> bool {
    if let (
        Geometry::Plane { normal, offset },
        Geometry::Plane {
            normal: n,
            offset: o,
        },
    ) = (outer, inner)
    {
        // Half-spaces that are not parallel cross. Neither holds the other.
        let same_way = parallel(*normal, *n, COINCIDENT) && normal.dot(*n) > 0.0;
        return same_way && (offset > o || (offset == o && first));
    }
    let (core, volume) = inner.core();
    let larger = outer.core().1;
    outer.holds(core) && (larger > volume || (larger == volume && first))
}

/// The dielectric solids of a scene, by their numbers from 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Media {
    solids: Vec<Solid>,
    index: Index,
}

/// An index of the places of solids. It finds the solids that may hold or cut something.
#[derive(Debug, Clone, PartialEq)]
struct Index {
    /// Over the boxes of the solids that have one.
    tree: Tree,
    /// The numbers of these solids, in the order of the boxes.
    bounded: Vec<usize>,
    /// The numbers of solids without a box.
    unbounded: Vec<usize>,
}

impl Index {
    fn new<'a>(solids: impl Iterator<Item = &'a Geometry>) -> Self {
        let (mut boxes, mut bounded, mut unbounded) = (Vec::new(), Vec::new(), Vec::new());
        for (k, geometry) in solids.enumerate() {
            match geometry.bounds() {
                // The box is a little larger, to find what lies flush on the solid as well.
                Some(b) => {
                    let slack = (b.max - b.min) * MAY_COINCIDE;
                    boxes.push(Bounds {
                        min: b.min - slack,
                        max: b.max + slack,
                    });
                    bounded.push(k);
                }
                None => unbounded.push(k),
            }
        }
        Self {
            tree: Tree::new(&boxes),
            bounded,
            unbounded,
        }
    }

    /// Calls `found` with the number of every solid that may touch the box, in no particular order.
    fn near(&self, bounds: &Bounds, mut found: impl FnMut(usize)) {
        self.unbounded.iter().copied().for_each(&mut found);
        self.tree.touching(bounds, |i| found(self.bounded[i]));
    }
}

/// A dielectric solid.
#[derive(Debug, Clone, PartialEq)]
struct Solid {
    geometry: Geometry,
    /// How many solids it lies in, counting itself: 1 for a solid in air.
    depth: usize,
    /// Index of refraction inside, relative to air.
    index: f64,
}

impl Media {
    /// Numbers the dielectric solids, and finds the parent of each.
    pub(super) fn new(primitives: &mut [WorldPrimitive], materials: &[Bsdf]) -> Self {
        let solids: Vec<usize> = (0..primitives.len())
            .filter(|&i| materials[primitives[i].material].is_dielectric())
            .collect();
        let index = Index::new(solids.iter().map(|&i| &primitives[i].geometry));
        let around: Vec<Vec<usize>> = (0..solids.len())
            .map(|k| {
                let inner = &primitives[solids[k]].geometry;
                let mut found = Vec::new();
                index.near(&Bounds::about(inner.core().0, DVec3::ZERO), |m| {
                    if m != k && encloses(&primitives[solids[m]].geometry, inner, m < k) {
                        found.push(m);
                    }
                });
                // In file order, which decides between equal solids.
                found.sort_unstable();
                found
            })
            .collect();
        for (k, &i) in solids.iter().enumerate() {
            // The solids around one lie in each other like the skins of an onion. The innermost of them has the most around it.
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
                geometry: primitives[solids[k]].geometry.clone(),
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
            index,
        }
    }

    /// The innermost of the solids for which `holds` is true, among those that may touch a box; [`AIR`] if there is none.
    fn innermost(&self, bounds: &Bounds, holds: impl Fn(&Geometry) -> bool) -> u32 {
        let mut found = Vec::new();
        self.index.near(bounds, |k| {
            if holds(&self.solids[k].geometry) {
                found.push(k);
            }
        });
        found
            .into_iter()
            .max_by_key(|&k| (self.solids[k].depth, k))
            .map_or(AIR, |k| k as u32 + 1)
    }

    /// The innermost solid around a point.
    pub(super) fn at(&self, p: DVec3) -> u32 {
        self.innermost(&Bounds::about(p, DVec3::ZERO), |g| g.holds(p))
    }

    /// Index of refraction of every medium, relative to air: first of air, then of the solids.
    pub(super) fn indices(&self) -> Vec<f64> {
        let solids = self.solids.iter().map(|s| s.index);
        std::iter::once(1.0).chain(solids).collect()
    }

    /// (n at the eye / n in the medium)² for every medium, air first, and at most [`LARGEST_SCALE`]. The eye is in medium `eye`.
    pub(super) fn light_scales(&self, eye: u32) -> Vec<f64> {
        let indices = self.indices();
        let n = indices[eye as usize];
        let scale = |m: &f64| (n / m).powi(2).min(LARGEST_SCALE);
        indices.iter().map(scale).collect()
    }

    /// The medium that a light shines in; `None` if the surface of a solid may cut the light.
    pub(super) fn of_light(&self, l: &WorldLight) -> Option<u32> {
        let side = |g: &Geometry| g.side_of_disk(l.center, l.normal, l.radius);
        let mut cut = false;
        self.index.near(&bounds_of(l), |k| {
            cut |= side(&self.solids[k].geometry) == DiskSide::Cut;
        });
        (!cut).then(|| self.innermost(&bounds_of(l), |g| side(g) == DiskSide::Inside))
    }

    /// Whether any part of a light may lie in a medium, for every medium. The first is air, for which the answer is false.
    pub(super) fn holding(&self, lights: &[WorldLight]) -> Vec<bool> {
        let mut holding = vec![false; self.solids.len() + 1];
        for l in lights {
            self.index.near(&bounds_of(l), |k| {
                let g = &self.solids[k].geometry;
                holding[k + 1] |= g.side_of_disk(l.center, l.normal, l.radius) != DiskSide::Outside;
            });
        }
        holding
    }
}

fn bounds_of(l: &WorldLight) -> Bounds {
    Bounds::disk(l.center, l.normal, l.radius)
}
