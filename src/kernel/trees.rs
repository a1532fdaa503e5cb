//! Which surfaces of a large scene lie in trees, and the generated WGSL that walks these.
//!
//! Every kind of surface, as one function of the shaders meets it, has a tree of its own, so that a walk contains just
//! that function. What has no bounds, and kinds with few members, are met one by one, as in small scenes.

use super::rays::{
    Surface, buffer_call, can_block, hull_faces, primitive, shadow_function, surfaces,
};
use super::select::BAKED_LIMIT;
use crate::world::{Bounds, Tree, World};
use std::fmt::Write as _;

/// Kinds with at least so many members have a tree, the first of these numbers by which no more than [`BAKED_LIMIT`] surfaces
/// with bounds are left to be met one by one. A walk takes as long as a test of about ninety spheres, or of thirty
/// cylinders, and what is met one by one is compiled for longer.
const LEAST_IN_TREE: [usize; 4] = [48, 24, 12, 1];

/// Nodes that a trip of a walk's loop visits: the trips that older drivers grant go farther, and it costs nothing.
const VISITS_A_TRIP: usize = 2;

/// Surfaces that one function meets, and where their tree lies.
pub(crate) struct Group {
    /// The function.
    pub function: &'static str,
    /// Their numbers, lights first.
    pub numbers: Vec<usize>,
    /// Number of the record, a multiple of four, four before those of their tree's nodes.
    pub header: usize,
}

impl Group {
    /// Number of the record after their tree.
    pub fn end(&self) -> usize {
        self.header + 4 * (1 + self.nodes())
    }

    /// How many nodes are there, number 0 among them.
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
        self.function.starts_with("sphere")
    }

    /// Whether they are disks, whose leaves hold them.
    pub fn disks(&self) -> bool {
        self.function == "disk_hit"
    }

    /// Whether they are spheres that bound solids.
    pub fn solids(&self) -> bool {
        self.function == "sphere_boundary"
    }
}

/// How a scene's surfaces are parted.
pub(crate) struct Parted {
    /// Those in trees.
    pub groups: Vec<Group>,
    /// Those that are met one by one.
    pub(super) apart: Vec<Surface>,
}

impl Parted {
    /// By kinds and their numbers alone. In a small scene, where nobody would want trees, all go into trees that can: so
    /// tests reach every part.
    pub fn new(world: &World) -> Self {
        let all = surfaces(world);
        let bounded = |s: &Surface| s.light || primitive(world, s).geometry.bounds().is_some();
        let mut kinds: Vec<(&'static str, usize)> = Vec::new();
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
        let in_tree = |s: &Surface| groups.iter().any(|g| g.function == s.function);
        let apart = all.into_iter().filter(|s| !in_tree(s)).collect();
        Self { groups, apart }
    }

    /// Number of the record after the trees.
    pub fn end(&self) -> usize {
        self.groups.last().map_or(0, Group::end)
    }
}

/// The boxes of a group's surfaces.
pub(crate) fn boxes(world: &World, group: &Group) -> Vec<Bounds> {
    let first = world.lights.len();
    let bounds = |&number: &usize| match world.lights.get(number) {
        Some(l) => Bounds::disk(l.center, l.normal, l.radius),
        None => world.primitives[number - first]
            .geometry
            .bounds()
            .expect("groups are of bounded things"),
    };
    group.numbers.iter().map(bounds).collect()
}

/// By number, whether a surface can lie between a point that a path reaches and a light.
pub(crate) fn blockers(world: &World) -> Vec<bool> {
    let hull = hull_faces(world);
    surfaces(world)
        .iter()
        .map(|s| can_block(world, s, &hull))
        .collect()
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
        s.push_str(&nearest(k, group));
        if shadows {
            s.push_str(&any(world, k, group));
        }
    }
    s
}

/// The loop of a walk, which goes on while `going_on`: `leaf` for what to do at surface `i`, whose code is `item`; of spheres
/// `low` and `radius` are the centre and radius.
fn walk(group: &Group, going_on: &str, leaf: impl Fn(&str) -> String) -> String {
    let header = group.header;
    let mut s = format!(
        "    var hit = first;
    let slabs = slabs_of(ray, bitcast<f32>(record({header}u).x));
    var at = Place(1u, 0u);
    while at.node != 0u && {going_on}trips_left > 0u {{
        trips_left -= 1u;
"
    );
    let mut visit = format!(
        "
            let place = four_records({}u + at.node);
            let a = textureLoad(records, place);
            let b = textureLoad(records, place + vec2u(1u, 0u));
            let c = textureLoad(records, place + vec2u(2u, 0u));
            let low_0 = bitcast<vec3f>(a.xyz);
            let high_0 = bitcast<vec3f>(vec3u(a.w, b.xy));
            let low_1 = bitcast<vec3f>(vec3u(b.zw, c.x));
            let high_1 = bitcast<vec3f>(c.yzw);
",
        header / 4 + 1
    );
    if group.spheres() {
        // A sphere costs no more than a box, and needs no visit of its own.
        if group.solids() {
            visit.push_str(
                "            let solids = textureLoad(records, place + vec2u(3u, 0u));\n",
            );
        }
        for (child, last) in [(0, "b.y"), (1, "c.w")] {
            let solid = ["solids.x, solids.y", "solids.z, solids.w"][child];
            let (radius, item) = [("a.w", "b.x"), ("c.y", "c.z")][child];
            let _ = write!(
                visit,
                "            let leaf_{child} = {last} == LEAF;
            if leaf_{child} {{
                let item = {item};
                let i = (item >> 1u) - 1u;
                let sphere = Sphere(low_{child}, bitcast<f32>({radius}));
{}
            }}
",
                leaf(solid)
            );
        }
        for _ in 0..VISITS_A_TRIP {
            let _ = writeln!(
                s,
                "        {{{visit}            let entry_0 = select(box_entry(slabs, low_0, high_0, hit.t), MISSED, leaf_0);
            let entry_1 = select(box_entry(slabs, low_1, high_1, hit.t), MISSED, leaf_1);
            at = onward(at, entry_0, entry_1);
        }}"
            );
        }
    } else if group.disks() {
        for _ in 0..VISITS_A_TRIP {
            let _ = writeln!(
                s,
                "        {{{visit}            let leaf = c.w == LEAF;
            if leaf {{
                let item = c.x;
                let i = (item >> 1u) - 1u;
                let disk = Disk(low_0, bitcast<f32>(a.w), bitcast<vec3f>(b.xyz), bitcast<f32>(b.w));
{}
            }}
            let entry_0 = select(box_entry(slabs, low_0, high_0, hit.t), MISSED, leaf);
            let entry_1 = select(box_entry(slabs, low_1, high_1, hit.t), MISSED, leaf);
            at = onward(at, entry_0, entry_1);
        }}",
                leaf("")
            );
        }
    } else {
        // On to the next leaf whose box is met; a masked-off branch would cost its time at every visit.
        let _ = writeln!(
            s,
            "        var item = 0u;
        while at.node != 0u && item == 0u && trips_left > 0u {{
            trips_left -= 1u;{visit}            let leaf = c.w == LEAF;
            item = select(0u, a.x, leaf);
            let entry_0 = select(box_entry(slabs, low_0, high_0, hit.t), MISSED, leaf);
            let entry_1 = select(box_entry(slabs, low_1, high_1, hit.t), MISSED, leaf);
            at = onward(at, entry_0, entry_1);
        }}
        if item != 0u {{
            let i = (item >> 1u) - 1u;
            let s = surface_at(i << 2u);
{}
        }}",
            leaf("")
        );
    }
    s + "    }\n    return hit;\n}\n\n"
}

/// A call of `function` for the surface at a leaf.
fn call(group: &Group, function: &str, hit: &str, solid: &str) -> String {
    if group.spheres() {
        let solid = if group.solids() {
            format!(", {solid}")
        } else {
            String::new()
        };
        format!("{function}({hit}, ray, sphere, 4u * i + 1u, 4u * i{solid})")
    } else if group.disks() {
        format!("{function}({hit}, ray, disk, c.y, 4u * i)")
    } else {
        buffer_call(function).replacen("(hit,", &format!("({hit},"), 1)
    }
}

fn nearest(k: usize, group: &Group) -> String {
    // Trees are walked in any order: among equals the lower key is the earlier.
    let leaf = |solid: &str| {
        format!(
            "                let found = {};
                let take = found.t < hit.t || (found.t == hit.t && found.key < hit.key);
                hit = Hit(select(hit.t, found.t, take), select(hit.key, found.key, take));",
            call(group, group.function, "Hit(FAR, NONE)", solid)
        )
    };
    format!(
        "fn nearest_{k}(ray: Ray, first: Hit) -> Hit {{\n{}",
        walk(group, "", leaf)
    )
}

fn any(world: &World, k: usize, group: &Group) -> String {
    let surface = |&number: &usize| Surface {
        number,
        light: number < world.lights.len(),
        function: group.function,
    };
    // Where some of a kind hold lights and others do not, what is right for those is right for all.
    let mut functions = group.numbers.iter().map(surface).map(|s| match s.light {
        true => s.function,
        false => shadow_function(world, &s),
    });
    let first = functions.next().unwrap_or(group.function);
    let function = if functions.all(|f| f == first) {
        first
    } else {
        group.function
    };
    let leaf = |solid: &str| {
        format!(
            "                let found = {};
                hit.key = select(hit.key, found.key, (item & 1u) == 1u);",
            call(group, function, "hit", solid)
        )
    };
    format!(
        "fn any_{k}(ray: Ray, first: Hit) -> Hit {{\n{}",
        walk(group, "hit.key == NONE && ", leaf)
    )
}
