//! Implicit surfaces: for each a function that meets it, and one that says where; and formulas as code.

use super::super::features::Features;
use super::super::literal::{float, vector};
use super::super::modules::IMPLICIT_SURFACE;
use super::super::preprocess::fill;
use super::grid;
use crate::implicit::formula::{Formula, Id, Node};
use crate::implicit::{Clip, Implicit};
use crate::world::{Geometry, Side, World, WorldPrimitive, key};
use glam::DVec3;
use std::fmt::Write as _;

/// The most parts of a ray that a kernel looks at.
pub(in crate::kernel) const MOST_TURNS: u32 = 400;

/// The least part of a ray, divided by the radius of the bounds: a few units in the last place.
const LEAST: f64 = 1.0 / (1 << 20) as f64;

/// The length at which a root is good enough, divided by the same: the hit is moved onto the surface afterwards.
const TOLERANCE: f64 = 1.0 / (1 << 18) as f64;

/// The longest part, divided by the same, that is left out at the start of a ray that stands on the surface.
const ZONE: f64 = 1e-3;

/// The first part of such a ray, divided by the same.
const FIRST_STEP: f64 = 0.01;

/// How far a hit is moved at most onto the surface, divided by the same.
const REACH: f64 = 1e-3;

/// The largest number in a kernel's text.
const LARGEST: f64 = 1e37;

/// The implicit surfaces of a world, with their numbers.
fn all(world: &World) -> impl Iterator<Item = (usize, &WorldPrimitive, &Implicit)> {
    let first = world.lights.len();
    world
        .primitives
        .iter()
        .enumerate()
        .filter_map(move |(i, p)| match &p.geometry {
            Geometry::Implicit(implicit) => Some((first + i, p, implicit.as_ref())),
            _ => None,
        })
}

/// Those of volumes.
pub(in crate::kernel) fn grids(
    world: &World,
) -> impl Iterator<Item = (usize, &WorldPrimitive, &Implicit)> {
    all(world).filter(|(.., implicit)| implicit.grid().is_some())
}

/// The name of the function that meets surface number `number`.
pub(super) fn name(number: usize) -> String {
    format!("implicit_{number}")
}

/// All functions of the implicit surfaces of a world; nothing if there are none.
pub(in crate::kernel) fn generate(world: &World, features: &Features) -> String {
    let mut s = String::new();
    if !features.has_implicit() {
        return s;
    }
    let mut written: Vec<(&Formula, f64)> = Vec::new();
    for (number, p, implicit) in all(world) {
        let Some(formula) = implicit.formula() else {
            continue;
        };
        let this = (formula, implicit.level);
        let k = match written.iter().position(|f| *f == this) {
            Some(k) => k,
            None => {
                written.push(this);
                let k = written.len() - 1;
                s.push_str(&text_of(k, formula, implicit.level));
                k
            }
        };
        s.push_str(&surface(number, p, implicit, k));
    }
    for (k, (number, p, implicit)) in grids(world).enumerate() {
        s.push_str(&grid::surface(k, number, p, implicit));
    }
    s.push_str(
        "fn implicit_vertex(key: u32, p: vec3f, d: vec3f) -> Vertex {\n    var v: Vertex;\n",
    );
    for (number, ..) in all(world) {
        let name = name(number);
        let _ = writeln!(
            s,
            "    if key >> 2u == {number}u {{\n        v = {name}_vertex((key & 3u) == 1u, p, d);\n    }}"
        );
    }
    s.push_str("    return v;\n}\n\n");
    if features.has_smooth_normals {
        s.push_str(&shading(world));
    }
    s
}

/// `implicit_shading`, which chooses among the surfaces with smooth normals.
fn shading(world: &World) -> String {
    let mut s = String::from(
        "// The normal about which light is scattered at p, where the surface's own is n: on the same side.
fn implicit_shading(key: u32, p: vec3f, n: vec3f) -> vec3f {
    var shading = n;
",
    );
    let smooth = grids(world).filter(|s| s.2.grid().is_some_and(|g| g.smooth));
    for (number, ..) in smooth {
        let _ = writeln!(
            s,
            "    if key == {}u {{\n        shading = {}_smooth(p, n);\n    }}",
            key(number, 0),
            name(number)
        );
    }
    s + "    return shading;\n}\n\n"
}

/// Formula number `k`, in both arithmetics.
fn text_of(k: usize, formula: &Formula, level: f64) -> String {
    let nodes = formula.nodes();
    let result = formula.result();
    let (is_zero, level) = (level == 0.0, number(-level));
    let mut s = format!("fn formula_{k}(q: vec3f, half: vec3f, slack: vec3f) -> vec3f {{\n");
    for (id, node) in nodes.iter().enumerate() {
        if let Some(value) = affine(nodes, node) {
            let _ = writeln!(s, "    let n{id} = {value};");
        }
    }
    let value = operand(nodes, result, |n| format!("affine_number({n})"));
    let _ = writeln!(
        s,
        "    return {};\n}}\n",
        if is_zero {
            value
        } else {
            format!("affine_shift({value}, {level})")
        }
    );
    let _ = writeln!(s, "fn sloped_{k}(q: vec3f) -> vec4f {{");
    for (id, node) in nodes.iter().enumerate() {
        if let Some(value) = sloped(nodes, node) {
            let _ = writeln!(s, "    let n{id} = {value};");
        }
    }
    let value = operand(nodes, result, sloped_number);
    let _ = writeln!(s, "    return {value} + {};\n}}\n", sloped_number(level));
    s
}

fn number(x: f64) -> String {
    float(x.clamp(-LARGEST, LARGEST))
}

fn sloped_number(n: String) -> String {
    format!("vec4f(0.0, 0.0, 0.0, {n})")
}

/// The text of a number; `None` for any other node.
fn constant(nodes: &[Node], id: Id) -> Option<String> {
    match nodes[id as usize] {
        Node::Number(n) => Some(number(n)),
        _ => None,
    }
}

/// The text of an operand, which is a number or has been computed.
fn operand(nodes: &[Node], id: Id, of_number: impl Fn(String) -> String) -> String {
    constant(nodes, id).map_or_else(|| format!("n{id}"), of_number)
}

/// The value of a node in affine arithmetic; `None` for numbers, which stand where they are used.
fn affine(nodes: &[Node], node: &Node) -> Option<String> {
    let at = |id: Id| operand(nodes, id, |n| format!("affine_number({n})"));
    let one = |f: &str, a: Id| format!("affine_{f}({})", at(a));
    let two = |f: &str, a: Id, b: Id| format!("affine_{f}({}, {})", at(a), at(b));
    let coordinate = |c: &str| format!("affine_coordinate(q.{c}, half.{c}, slack.{c})");
    Some(match *node {
        Node::Number(_) => return None,
        Node::X => coordinate("x"),
        Node::Y => coordinate("y"),
        Node::Z => coordinate("z"),
        Node::Add(a, b) => match constant(nodes, b) {
            Some(n) => format!("affine_shift({}, {n})", at(a)),
            None => two("add", a, b),
        },
        Node::Subtract(a, b) => match nodes[b as usize] {
            Node::Number(n) => format!("affine_shift({}, {})", at(a), number(-n)),
            _ => two("subtract", a, b),
        },
        Node::Multiply(a, b) => match constant(nodes, b) {
            Some(n) => format!("affine_scale({}, {n})", at(a)),
            None => two("multiply", a, b),
        },
        Node::Divide(a, b) => match nodes[a as usize] {
            Node::Number(1.0) => one("inverse", b),
            _ => format!("affine_multiply({}, {})", at(a), one("inverse", b)),
        },
        Node::Negate(a) => one("negate", a),
        Node::Square(a) => one("square", a),
        Node::Sqrt(a) => one("sqrt", a),
        Node::Abs(a) => one("abs", a),
        Node::Min(a, b) => two("min", a, b),
        Node::Max(a, b) => two("max", a, b),
        Node::Sin(a) => one("sin", a),
        Node::Cos(a) => one("cos", a),
        Node::Exp(a) => one("exp", a),
        Node::Log(a) => one("log", a),
    })
}

/// The value of a node with its gradient.
fn sloped(nodes: &[Node], node: &Node) -> Option<String> {
    let at = |id: Id| operand(nodes, id, sloped_number);
    let one = |f: &str, a: Id| format!("sloped_{f}({})", at(a));
    let two = |f: &str, a: Id, b: Id| format!("sloped_{f}({}, {})", at(a), at(b));
    Some(match *node {
        Node::Number(_) => return None,
        Node::X => "vec4f(1.0, 0.0, 0.0, q.x)".into(),
        Node::Y => "vec4f(0.0, 1.0, 0.0, q.y)".into(),
        Node::Z => "vec4f(0.0, 0.0, 1.0, q.z)".into(),
        Node::Add(a, b) => format!("{} + {}", at(a), at(b)),
        Node::Subtract(a, b) => format!("{} - {}", at(a), at(b)),
        Node::Multiply(a, b) => match constant(nodes, b) {
            Some(n) => format!("{} * {n}", at(a)),
            None => two("multiply", a, b),
        },
        Node::Divide(a, b) => format!("sloped_multiply({}, {})", at(a), one("inverse", b)),
        Node::Negate(a) => format!("-{}", at(a)),
        Node::Square(a) => one("square", a),
        Node::Sqrt(a) => one("sqrt", a),
        Node::Abs(a) => one("abs", a),
        Node::Min(a, b) => two("min", a, b),
        Node::Max(a, b) => two("max", a, b),
        Node::Sin(a) => one("sin", a),
        Node::Cos(a) => one("cos", a),
        Node::Exp(a) => one("exp", a),
        Node::Log(a) => one("log", a),
    })
}

/// What rays can meet a surface, and from where: what stands in the templates for it.
pub(super) struct Sides {
    pub solid: &'static str,
    pub inside: String,
    pub asked: String,
    pub sign: &'static str,
    pub result: String,
}

impl Sides {
    pub fn of(number: usize, p: &WorldPrimitive, implicit: &Implicit) -> Self {
        let (solid, inside, asked) = match (implicit.closed, p.side) {
            (false, _) => ("false", "false".into(), "true".into()),
            (true, Side::Outside) => ("true", "false".into(), "true".into()),
            (true, Side::Inside) => ("true", "true".into(), "true".into()),
            (true, Side::Both) => (
                "true",
                format!("ray.medium == {}u", p.solid),
                format!("(inside || ray.medium == {}u)", p.parent),
            ),
        };
        let sign = if implicit.closed {
            "select(1.0, -1.0, inside)"
        } else {
            "select(1.0, -1.0, known)"
        };
        // What is left of the way inside ends at the bounds.
        let result = if implicit.closed {
            format!(
                "nearer(surface, asked && inside && !met, finish, {}u)",
                key(number, 0) + 1
            )
        } else {
            "surface".into()
        };
        Self {
            solid,
            inside,
            asked,
            sign,
            result,
        }
    }
}

/// The rows that take a vector of the scene to the surface's own axes, along which it has these units, and the columns that take it back.
pub(super) fn axes(implicit: &Implicit, units: DVec3) -> [(&'static str, String); 6] {
    let axis = |k| implicit.rotation.col(k);
    let row = |k| vector(axis(k) / units[k]);
    let column = |k| vector(axis(k) * units[k]);
    [
        ("row_x", row(0)),
        ("row_y", row(1)),
        ("row_z", row(2)),
        ("column_x", column(0)),
        ("column_y", column(1)),
        ("column_z", column(2)),
    ]
}

/// The functions of one surface, whose formula has number `k`.
fn surface(number: usize, p: &WorldPrimitive, implicit: &Implicit, k: usize) -> String {
    let name = name(number);
    let axes = axes(implicit, DVec3::splat(implicit.scale));
    let (middle, half) = implicit.clip.extent();
    let (span, onto) = match implicit.clip {
        Clip::Box { min, max } => (
            format!("span_of_box(origin, w, {}, {})", vector(min), vector(max)),
            format!("onto_box(start, {}, {})", vector(middle), vector(half)),
        ),
        Clip::Ball { radius } => (
            format!("span_of_ball(origin, w, {})", float(radius)),
            format!("onto_ball(start, {})", float(radius)),
        ),
    };
    // Both ends of a part lie on the ray but for the rounding of its points.
    let slack = (middle.abs() + half) * f64::from(f32::EPSILON);
    let text = format!("formula_{k}");
    let sides = Sides::of(number, p, implicit);
    let own = key(number, 0);
    let size = implicit.ball().1;
    let [least, tolerance, zone, first_step] =
        [LEAST, TOLERANCE, ZONE, FIRST_STEP].map(|share| float(share * size));
    let reach = float(REACH * implicit.clip.radius());
    let (key, most, sloped) = (
        format!("{own}u"),
        format!("{MOST_TURNS}u"),
        format!("sloped_{k}"),
    );
    let center = vector(implicit.center);
    let values: &[(&str, &str)] = &[
        ("name", &name),
        ("formula", &text),
        ("sloped", &sloped),
        ("center", &center),
        ("span", &span),
        ("onto", &onto),
        ("inside", &sides.inside),
        ("asked", &sides.asked),
        ("solid", sides.solid),
        ("sign", sides.sign),
        ("key", &key),
        ("least", &least),
        ("tolerance", &tolerance),
        ("zone", &zone),
        ("first_step", &first_step),
        ("most_turns", &most),
        ("newton", "2u"),
        ("reach", &reach),
        ("result", &sides.result),
        ("slack", &vector(slack)),
    ];
    let axes = axes.each_ref().map(|(name, value)| (*name, value.as_str()));
    let values = [values, &axes].concat();
    fill(IMPLICIT_SURFACE.text, &values) + "\n"
}
