//! Which surfaces of a large scene lie in trees, and the WGSL that walks those trees.
//!
//! All surfaces that one function of the shaders meets share a tree, so that a walk calls just that function; a few that lie far away
//! have another. Surfaces without bounds,
//! and groups with few members, are met one by one, as in small scenes.

use super::access::BAKED_LIMIT;
use super::emit::surfaces::{Function, Target, Variant, for_shadows, targets};
use super::layout::ShapeKind;
use super::modules::{DESCENT, LEAF_CYLINDER, LEAF_DISK, LEAF_SPHERE, Module, QUEUE, VISIT};
use super::preprocess::fill;
use crate::world::tree::beam::GROUPS;
use crate::world::{Bounds, Geometry, Tree, World, WorldPrimitive};
use glam::DVec3;
use std::fmt::Write as _;

/// The least members of a group that gets a tree: the first of these numbers that leaves at most [`BAKED_LIMIT`] bounded surfaces to be
/// met one by one. A walk takes as long as testing about ninety spheres or thirty cylinders, and surfaces that are met one by
/// one take longer to compile.
const LEAST_IN_TREE: [usize; 4] = [48, 24, 12, 1];

/// Surfaces that one function meets, and where their tree lies.
pub(crate) struct Group {
    /// The function.
    pub function: Function,
    /// Their numbers, lights first.
    pub numbers: Vec<usize>,
    /// The unit of the header of their first tree. Units have [`UNIT`] records.
    pub header: usize,
}

/// The records of a unit: a node, a leaf, or a header.
pub(crate) const UNIT: usize = 4;

/// The most units, those before the trees included: a walk has 25 bits for the number of one that it puts off.
pub(crate) const MAX_UNITS: usize = 1 << 25;

/// A scene's surfaces, divided into trees and the rest.
pub(crate) struct Parted {
    /// Those in trees.
    pub groups: Vec<Group>,
    /// Those that are met one by one.
    pub(super) apart: Vec<Target>,
}

impl Parted {
    /// In small scenes, which need no trees, every surface that can goes into one, so that tests reach every part.
    pub fn new(world: &World) -> Self {
        let all = targets(world);
        let mut kinds: Vec<(Function, Vec<usize>)> = Vec::new();
        for s in all.iter().filter(|s| bounds(world, s.number).is_some()) {
            match kinds.iter_mut().find(|k| k.0 == s.function) {
                Some(kind) => kind.1.push(s.number),
                None => kinds.push((s.function, vec![s.number])),
            }
        }
        put_glass_with_opaque(&mut kinds);
        let kinds: Vec<(Function, Vec<usize>)> = kinds
            .into_iter()
            .flat_map(|(f, numbers)| by_distance(world, numbers).map(move |n| (f, n)))
            .collect();
        let sizes = || kinds.iter().map(|k| k.1.len());
        let left = |least: usize| sizes().filter(|n| *n < least).sum::<usize>();
        let least = if all.len() <= BAKED_LIMIT {
            1
        } else {
            LEAST_IN_TREE
                .into_iter()
                .find(|l| left(*l) <= BAKED_LIMIT)
                .unwrap_or(1)
        };
        let in_trees = kinds.into_iter().filter(|k| k.1.len() >= least);
        let groups: Vec<Group> = in_trees
            .enumerate()
            .map(|(k, (function, numbers))| Group {
                function,
                numbers,
                // Unit 0 is where a walk ends.
                header: 1 + k,
            })
            .collect();
        let mut apart = vec![true; all.len()];
        for &number in groups.iter().flat_map(|g| &g.numbers) {
            apart[number] = false;
        }
        let apart = all.into_iter().filter(|t| apart[t.number]).collect();
        Self { groups, apart }
    }

    /// Number of the record after the headers. The trees themselves stand at the end of the texture, because their sizes are not known
    /// before they are built.
    pub fn end(&self) -> usize {
        UNIT * (1 + self.groups.len())
    }
}

/// Opaque things share a tree with glass ones of the same shape, if there are many of both: one walk is shorter than two. The function of
/// glass serves all, for the leaves of opaque things say so.
fn put_glass_with_opaque(kinds: &mut Vec<(Function, Vec<usize>)>) {
    for shape in [ShapeKind::Sphere, ShapeKind::Cylinder] {
        let many = |variant| {
            let function = Function { shape, variant };
            (kinds.iter()).position(|k| k.0 == function && k.1.len() >= LEAST_IN_TREE[0])
        };
        if let (Some(opaque), Some(glass)) = (many(Variant::Outside), many(Variant::Boundary)) {
            let numbers = std::mem::take(&mut kinds[opaque].1);
            kinds[glass].1.extend(numbers);
            kinds[glass].1.sort_unstable();
            kinds.remove(opaque);
        }
    }
}

/// Divides surfaces with bounds: those that lie farther from the middle than a few hundred times as far as half of them are apart from
/// the others, and so on with these.
///
/// A ray is known only to 2⁻²⁴ of its distance from the world's origin. One that starts on a thing far away would meet all boxes of the
/// crowd in the middle, unless the crowd has a tree of its own, to which the ray can be moved first: see `approach` of
/// `shaders/tree/walk.wgsl`.
fn by_distance(world: &World, numbers: Vec<usize>) -> impl Iterator<Item = Vec<usize>> {
    // Half as far as `approach` leaves rays as they are.
    const FAR: f64 = 500.0;
    // So few boxes may all be met.
    const FEW: usize = 64;

    let mut parts = Vec::new();
    let mut rest = numbers;
    while rest.len() > FEW {
        let boxes: Vec<Bounds> = rest.iter().filter_map(|&n| bounds(world, n)).collect();
        let median = |of: &dyn Fn(&Bounds) -> f64| {
            let mut values: Vec<f64> = boxes.iter().map(of).collect();
            let half = values.len() / 2;
            *values.select_nth_unstable_by(half, f64::total_cmp).1
        };
        let middle = DVec3::from_array([0, 1, 2].map(|k| median(&|b| 0.5 * (b.min[k] + b.max[k]))));
        // To the farthest corner: a large thing in the middle is as bad as one far away.
        let reach = |b: &Bounds| (b.max - middle).abs().max((b.min - middle).abs()).length();
        let limit = FAR * median(&reach);
        let far = boxes.iter().map(|b| reach(b) > limit);
        let (far, near): (Vec<_>, Vec<_>) = far.zip(&rest).partition(|f| f.0);
        let numbers = |part: Vec<(bool, &usize)>| part.into_iter().map(|f| *f.1).collect();
        let (near, far) = (numbers(near), numbers(far));
        parts.push(near);
        rest = far;
    }
    parts.push(rest);
    parts.into_iter().filter(|p| !p.is_empty())
}

/// The box around surface number `number`, if it has bounds.
fn bounds(world: &World, number: usize) -> Option<Bounds> {
    match world.primitive(number) {
        // Each has a function of its own, so no walk leads to it.
        Some(WorldPrimitive {
            geometry: Geometry::Implicit(_),
            ..
        }) => None,
        Some(p) => p.geometry.bounds(),
        None => {
            let l = &world.lights[number];
            Some(Bounds::disk(l.center, l.normal, l.radius))
        }
    }
}

/// The boxes of a group's surfaces.
pub(crate) fn boxes(world: &World, group: &Group) -> Vec<Bounds> {
    let of = |&number: &usize| bounds(world, number).expect("groups are of bounded things");
    group.numbers.iter().map(of).collect()
}

/// `hit = nearest_K(ray, hit)` and the like for every tree, in the functions that meet everything.
pub(super) fn calls(s: &mut String, parted: &Parted, walk: &str) {
    for k in 0..parted.groups.len() {
        let _ = writeln!(s, "    hit = {walk}_{k}(ray, hit);");
    }
}

/// The walks: `nearest_K`, and with `shadows` `any_K`.
pub(super) fn walks(world: &World, parted: &Parted, shadows: bool) -> String {
    let mut s = String::new();
    for (k, group) in parted.groups.iter().enumerate() {
        let name = format!("nearest_{k}");
        s.push_str(&walk(&name, group, group.function, Purpose::Nearest));
        if shadows {
            let function = shadow_function(world, group);
            s.push_str(&walk(&format!("any_{k}"), group, function, Purpose::Any));
        }
    }
    s
}

/// `trace`, which takes a queue of rays through the only tree.
pub(super) fn queue(parted: &Parted) -> String {
    let walk = |group: &Group| walk("queue", group, group.function, Purpose::Queue);
    parted.groups.iter().map(walk).collect()
}

/// What a walk finds.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    /// The nearest hit of a ray.
    Nearest,
    /// Any hit of a shadow ray.
    Any,
    /// Those of a queue of rays.
    Queue,
}

/// The function for shadow rays. If some solids of a group hold lights and others do not, the function of the former serves all.
fn shadow_function(world: &World, group: &Group) -> Function {
    let target = |&number: &usize| Target {
        number,
        function: group.function,
    };
    let mut functions = group.numbers.iter().map(|n| for_shadows(world, &target(n)));
    let first = functions.next().unwrap_or(group.function);
    if functions.all(|f| f == first) {
        first
    } else {
        group.function
    }
}

/// One walk, which calls `function` at the leaves.
fn walk(name: &str, group: &Group, function: Function, purpose: Purpose) -> String {
    let (leaf, shape): (Module, &str) = match group.function.shape {
        ShapeKind::Sphere => (LEAF_SPHERE, "sphere"),
        ShapeKind::Disk => (LEAF_DISK, "disk"),
        ShapeKind::Cylinder => (LEAF_CYLINDER, "cylinder"),
        ShapeKind::Plane | ShapeKind::HugeSphere | ShapeKind::Implicit => {
            unreachable!("none is in a tree")
        }
    };
    let hit = match purpose {
        Purpose::Any => "hit",
        _ => "Hit(FAR, NONE)",
    };
    // What leaves hold of each kind.
    let field = |field: &str| match (field, group.function.shape) {
        ("faces.x", ShapeKind::Sphere) => "4u * i + 1u",
        ("solid", ShapeKind::Sphere) => "b.y",
        ("parent", ShapeKind::Sphere) => "parent_of(b.z, ray)",
        ("faces.x", ShapeKind::Disk) => "c.y",
        ("faces.x", ShapeKind::Cylinder) => "c.x",
        ("faces.y", ShapeKind::Cylinder) => "c.y",
        ("faces.z", ShapeKind::Cylinder) => "c.z",
        ("solid", ShapeKind::Cylinder) => "d.y",
        ("parent", ShapeKind::Cylinder) => "parent_of(d.z, ray)",
        _ => unreachable!("leaves have no {field}"),
    };
    let call = function.call_with(hit, shape, |f| field(f).to_owned(), "4u * i");
    // A walk through a tree of one thing puts nothing off, but has a place for it.
    let words = match purpose {
        Purpose::Queue => Tree::levels(group.numbers.len()).max(GROUPS as u32),
        _ => Tree::levels(group.numbers.len()).max(1),
    };
    let declared: String = (0..words)
        .map(|k| format!("put_off_{k}: u32,\n    "))
        .collect();
    // What lies beyond a 0 is never read.
    let start = |k: u32, of: &str| match ["y", "z", "w"].get(k as usize) {
        Some(component) => format!("{of}.{component}"),
        None => "0u".to_owned(),
    };
    let first_words = || 0..words.min(GROUPS as u32 + 1);
    let begin: String = first_words()
        .map(|k| format!("walk.put_off_{k} = {};\n        ", start(k, "start")))
        .collect();
    let again: String = first_words()
        .map(|k| {
            let word = start(k, "again");
            format!("walk.put_off_{k} = select(walk.put_off_{k}, {word}, begins);\n            ")
        })
        .collect();
    let (header, shift) = (format!("{}u", group.header), shift(words));
    let (goes_on, keep, walk) = match purpose {
        Purpose::Nearest => ("", format!("keep_nearest(hit, {call}, item)"), DESCENT),
        Purpose::Any => {
            let keep = format!("keep_blocker(hit, {call}, item)");
            ("hit.key == NONE &&", keep, DESCENT)
        }
        Purpose::Queue => ("", format!("keep_queued(hit, {call}, item, ray)"), QUEUE),
    };
    let values = [
        ("walk", name),
        ("header", &header),
        ("goes_on", goes_on),
        ("keep", &keep),
        ("words", declared.trim_end()),
        ("shift", shift.trim_end()),
        ("begin", begin.trim_end()),
        ("again", again.trim_end()),
    ];
    [leaf, VISIT, walk]
        .map(|template| fill(template.text, &values) + "\n")
        .concat()
}

/// Puts a word before those of a place, takes the first one away, or changes it.
fn shift(words: u32) -> String {
    let mut s = String::new();
    for k in 0..words {
        let _ = writeln!(s, "    let old_{k} = walk.put_off_{k};");
    }
    for k in 0..words {
        let before = match k {
            0 => "more".to_owned(),
            _ => format!("old_{}", k - 1),
        };
        let after = if k + 1 < words {
            format!("old_{}", k + 1)
        } else {
            "0u".to_owned()
        };
        let stays = match k {
            0 => "select(old_0, rest, !down)".to_owned(),
            _ => format!("old_{k}"),
        };
        let _ = writeln!(
            s,
            "    walk.put_off_{k} = select(select({stays}, {before}, push), {after}, pop);"
        );
    }
    s
}
