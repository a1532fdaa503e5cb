//! Which surfaces of a large scene lie in trees, and the WGSL that walks those trees.
//!
//! All surfaces that one function of the shaders meets share a tree, so that a walk calls just that function. Surfaces without bounds,
//! and groups with few members, are met one by one, as in small scenes.

use super::access::BAKED_LIMIT;
use super::emit::surfaces::{Function, Target, Variant, for_shadows, targets};
use super::layout::ShapeKind;
use super::modules::{Module, WALK_BOXES, WALK_DISKS, WALK_SPHERES};
use super::preprocess::fill;
use crate::world::{Bounds, Tree, World};
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
    /// Number of the tree's first record, a multiple of four. Four records are the header; the nodes follow.
    pub header: usize,
}

impl Group {
    /// Number of the record after their tree.
    pub fn end(&self) -> usize {
        self.header + 4 * (1 + self.nodes())
    }

    /// The number of nodes, node 0 included.
    pub fn nodes(&self) -> usize {
        let all = Tree::numbers(self.numbers.len());
        if self.spheres() {
            (all / 2).max(2)
        } else {
            all
        }
    }

    /// Whether nodes hold the surfaces themselves.
    pub fn spheres(&self) -> bool {
        self.function.shape == ShapeKind::Sphere
    }

    /// Whether they are disks, whose leaves hold them.
    pub fn disks(&self) -> bool {
        self.function.shape == ShapeKind::Disk
    }

    /// Whether they are spheres that bound solids.
    pub fn solids(&self) -> bool {
        self.spheres() && self.function.variant == Variant::Boundary
    }
}

/// A scene's surfaces, divided into trees and the rest.
pub(crate) struct Parted {
    /// Those in trees.
    pub groups: Vec<Group>,
    /// Those that are met one by one.
    pub(super) apart: Vec<Target>,
}

impl Parted {
    /// Depends only on the functions and how many surfaces each meets. In small scenes, which need no trees, every surface that can
    /// goes into one, so that tests reach every part.
    pub fn new(world: &World) -> Self {
        let all = targets(world);
        let bounded = |t: &Target| bounds(world, t.number).is_some();
        let mut kinds: Vec<(Function, usize)> = Vec::new();
        for s in all.iter().filter(|s| bounded(s)) {
            match kinds.iter_mut().find(|k| k.0 == s.function) {
                Some(kind) => kind.1 += 1,
                None => kinds.push((s.function, 1)),
            }
        }
        let left =
            |least: usize| -> usize { kinds.iter().map(|k| k.1).filter(|n| *n < least).sum() };
        let least = if all.len() <= BAKED_LIMIT {
            1
        } else {
            LEAST_IN_TREE
                .into_iter()
                .find(|l| left(*l) <= BAKED_LIMIT)
                .unwrap_or(1)
        };
        let mut header = 0;
        let mut groups = Vec::new();
        for (function, count) in kinds {
            if count < least {
                continue;
            }
            let of_kind = all.iter().filter(|s| s.function == function);
            let group = Group {
                function,
                numbers: of_kind.map(|s| s.number).collect(),
                header,
            };
            header = group.end();
            groups.push(group);
        }
        let in_tree = |s: &Target| groups.iter().any(|g| g.function == s.function);
        let apart = all.into_iter().filter(|s| !in_tree(s)).collect();
        Self { groups, apart }
    }

    /// Number of the record after the trees.
    pub fn end(&self) -> usize {
        self.groups.last().map_or(0, Group::end)
    }
}

/// The box around surface number `number`, if it has bounds.
fn bounds(world: &World, number: usize) -> Option<Bounds> {
    match world.primitive(number) {
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
        s.push_str(&walk(&format!("nearest_{k}"), group, group.function, false));
        if shadows {
            let function = shadow_function(world, group);
            s.push_str(&walk(&format!("any_{k}"), group, function, true));
        }
    }
    s
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

/// Loads the record of a node that names the solids its spheres bound, and those around them. Trees of opaque spheres leave it out.
const LOAD_SOLIDS: &str = "let solids = textureLoad(records, place + vec2u(3u, 0u));";

/// One walk, which calls `function` at the leaves: for the nearest hit, or for `any` hit.
fn walk(name: &str, group: &Group, function: Function, any: bool) -> String {
    let template: Module = match group.function.shape {
        ShapeKind::Sphere => WALK_SPHERES,
        ShapeKind::Disk => WALK_DISKS,
        _ => WALK_BOXES,
    };
    let boxes = !group.spheres() && !group.disks();
    let hit = match (any, boxes) {
        (false, _) => "Hit(FAR, NONE)",
        (true, false) => "*hit",
        (true, true) => "hit",
    };
    // Leaves of spheres and disks hold these fields elsewhere, or they follow from the surface's number.
    let leaf = |field: &str, child: usize| match (field, group.disks()) {
        ("faces.x", true) => "c.y".to_owned(),
        ("faces.x", false) => "4u * i + 1u".to_owned(),
        ("solid", _) => format!("solids.{}", ["x", "z"][child]),
        ("parent", _) => format!("solids.{}", ["y", "w"][child]),
        _ => unreachable!("leaves have no {field}"),
    };
    let sphere = |child: usize| function.call_with(hit, "sphere", |f| leaf(f, child), "4u * i");
    let call = match (group.spheres(), group.disks()) {
        (true, _) => String::new(),
        (_, true) => function.call_with(hit, "disk", |f| leaf(f, 0), "4u * i"),
        _ => function.call(hit, |f| format!("s.{f}"), "i * 4u"),
    };
    let calls = if group.spheres() {
        [0, 1].map(sphere)
    } else {
        Default::default()
    };
    fill(
        template.text,
        &[
            ("walk", name),
            ("header", &format!("{}u", group.header)),
            ("nodes", &format!("{}u", group.header / 4 + 1)),
            ("goes_on", if any { "hit.key == NONE &&" } else { "" }),
            ("keep", if any { "keep_blocker" } else { "keep_nearest" }),
            ("load_solids", if group.solids() { LOAD_SOLIDS } else { "" }),
            ("call_0", &calls[0]),
            ("call_1", &calls[1]),
            ("call", &call),
        ],
    ) + "\n"
}
