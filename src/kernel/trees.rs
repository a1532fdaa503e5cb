//! Which surfaces of a large scene lie in trees, and the generated WGSL that walks these.
//!
//! Every kind of surface, as one function of the shaders meets it, has a tree of its own, so that a walk contains just
//! that function. What has no bounds, and kinds with few members, are met one by one, as in small scenes.

use super::rays::{
    Surface, buffer_call, can_block, hull_faces, primitive, shadow_function, surfaces,
};
use super::select::BAKED_LIMIT;
use crate::world::{Bounds, World};
use std::fmt::Write as _;

/// A kind with fewer members is met one by one in a scene that needs trees: as fast up to here.
const LEAST_IN_TREE: usize = 24;

/// Nodes that a trip of a walk's loop visits: the trips that older drivers grant go farther, and it costs nothing.
const VISITS_A_TRIP: usize = 2;

/// Nodes in a row of the texture that holds them.
pub(crate) const NODES_A_ROW: u32 = 2048;

/// Surfaces that one function meets, and where their tree lies.
pub(crate) struct Group {
    /// The function.
    pub function: &'static str,
    /// Their numbers, lights first.
    pub numbers: Vec<usize>,
    /// Number of the node before their tree.
    pub header: usize,
}

impl Group {
    /// Number of the node after their tree.
    pub fn end(&self) -> usize {
        self.header + 2 * self.numbers.len()
    }

    /// Whether leaves hold the surfaces themselves.
    pub fn spheres(&self) -> bool {
        self.function.starts_with("sphere")
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
        let least = if all.len() <= BAKED_LIMIT {
            1
        } else {
            LEAST_IN_TREE
        };
        let mut functions: Vec<&'static str> = Vec::new();
        let bounded = |s: &Surface| s.light || primitive(world, s).geometry.bounds().is_some();
        for s in all.iter().filter(|s| bounded(s)) {
            if !functions.contains(&s.function) {
                functions.push(s.function);
            }
        }
        let mut header = 0;
        let mut groups = Vec::new();
        for function in functions {
            let of_kind = all.iter().filter(|s| s.function == function);
            let numbers: Vec<usize> = of_kind.map(|s| s.number).collect();
            if numbers.len() >= least {
                let group = Group {
                    function,
                    numbers,
                    header,
                };
                header = group.end() + 1;
                groups.push(group);
            }
        }
        let in_tree = |s: &Surface| groups.iter().any(|g| g.function == s.function);
        let apart = all.into_iter().filter(|s| !in_tree(s)).collect();
        Self { groups, apart }
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

/// The loop of a walk, which goes on while `going_on`: `leaf` for what to do at one.
fn walk(group: &Group, going_on: &str, leaf: &str) -> String {
    let (header, end) = (group.header, group.end());
    let start = format!(
        "    var hit = first;
    let slabs = slabs_of(ray, bitcast<f32>(node_low({}u).x));
    var node = {}u;
    while node < {end}u && {going_on}trips_left > 0u {{
        trips_left -= 1u;
",
        header,
        header + 1
    );
    let visit = "
            let a = node_low(node);
            let b = node_high(node);
            let leaf = b.w != 0u;
            let met = meets_box(slabs, bitcast<vec3f>(a.xyz), bitcast<vec3f>(b.xyz), hit.t);
";
    let mut s = start;
    if group.spheres() {
        // A sphere costs no more than a box: both at every visit, and leaves hold the sphere.
        for _ in 0..VISITS_A_TRIP {
            let _ = writeln!(
                s,
                "        {{{visit}            let item = b.w;
            if leaf {{
                let i = select(0u, (item >> 1u) - 1u, leaf);
{leaf}
            }}
            node = select(a.w, node + 1u, leaf || met);
        }}"
            );
        }
    } else {
        // On to the next leaf whose box is met; a masked-off branch would cost its time at every visit.
        let _ = writeln!(
            s,
            "        var item = 0u;
        while node < {end}u && item == 0u && trips_left > 0u {{
            trips_left -= 1u;{visit}            item = select(0u, b.w, met);
            node = select(a.w, node + 1u, met);
        }}
        if item != 0u {{
                let i = (item >> 1u) - 1u;
{leaf}
        }}"
        );
    }
    s + "    }\n    return hit;\n}\n\n"
}

/// A call of `function` for the surface at a leaf.
fn call(group: &Group, function: &str, hit: &str) -> String {
    if group.spheres() {
        let solid = if function.contains("_boundary") {
            ", b.y, b.z"
        } else {
            ""
        };
        format!(
            "{function}({hit}, ray, Sphere(bitcast<vec3f>(a.xyz), bitcast<f32>(b.x)), 4u * i + 1u, 4u * i{solid})"
        )
    } else {
        buffer_call(function).replacen("(hit,", &format!("({hit},"), 1)
    }
}

fn fetch(group: &Group) -> &'static str {
    if group.spheres() {
        ""
    } else {
        "                let s = surfaces[i];\n"
    }
}

fn nearest(k: usize, group: &Group) -> String {
    // Trees are walked in any order: among equals the lower key is the earlier.
    let leaf = format!(
        "{}                let found = {};
                let take = found.t < hit.t || (found.t == hit.t && found.key < hit.key);
                hit = Hit(select(hit.t, found.t, take), select(hit.key, found.key, take));",
        fetch(group),
        call(group, group.function, "Hit(FAR, NONE)")
    );
    format!(
        "fn nearest_{k}(ray: Ray, first: Hit) -> Hit {{\n{}",
        walk(group, "", &leaf)
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
    let leaf = format!(
        "{}                let found = {};
                hit.key = select(hit.key, found.key, (item & 1u) == 1u);",
        fetch(group),
        call(group, function, "hit")
    );
    format!(
        "fn any_{k}(ray: Ray, first: Hit) -> Hit {{\n{}",
        walk(group, "hit.key == NONE && ", &leaf)
    )
}
