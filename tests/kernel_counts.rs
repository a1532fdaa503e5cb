//! Compares the contents of the kernels of `scenes/` with a table. This detects unintended changes without timing anything.
//!
//! Counted is the loop of the entry point, with every function that it calls in the place of the call, as the drivers'
//! compilers have it: what a path pays for at every vertex. The table is `tests/kernel_counts.txt`. A change that is
//! meant is written into it by
//!
//!     ETENDUE_UPDATE_COUNTS=1 cargo test --release --test kernel_counts

mod common;

use common::{read, scene_files};
use etendue::kernel::{Access, compose};
use etendue::settings::{Overrides, Settings};
use etendue::world::World;
use naga::{AddressSpace, Block, Expression, Function, Handle, Module, Statement, TypeInner};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// How far a count may be from the table's, as a share of it...
const SLACK: f64 = 0.03;
/// ...or as a number, for small ones.
const SMALL: u64 = 3;

/// What is counted, in the table's order; the first four exactly, the others with slack.
const KINDS: [&str; 10] = [
    "loops",
    "buffer-loads",
    "texture-loads",
    "stores-to-buffers",
    "calls",
    "branches",
    "arithmetic",
    "math",
    "selects",
    "local-loads",
];
/// How many of them have no slack: each is dear.
const EXACT: usize = 4;

type Counts = BTreeMap<&'static str, u64>;

fn table() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/kernel_counts.txt")
}

/// Counts of a function's statements, calls replaced by what they call.
struct Counter<'a> {
    module: &'a Module,
    known: HashMap<Handle<Function>, Counts>,
}

impl Counter<'_> {
    fn function(&mut self, handle: Handle<Function>) -> Counts {
        if let Some(known) = self.known.get(&handle) {
            return known.clone();
        }
        let function = &self.module.functions[handle];
        let mut counts = Counts::new();
        self.block(function, &function.body, &mut counts);
        self.known.insert(handle, counts.clone());
        counts
    }

    fn block(&mut self, f: &Function, block: &Block, counts: &mut Counts) {
        let mut add = |kind: &'static str| *counts.entry(kind).or_default() += 1;
        for statement in block {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        if let Some(kind) = kind(self.module, f, handle) {
                            add(kind);
                        }
                    }
                }
                Statement::If { .. } | Statement::Switch { .. } => add("branches"),
                Statement::Loop { .. } => add("loops"),
                Statement::Store { pointer, .. } if in_buffer(self.module, f, *pointer) => {
                    add("stores-to-buffers");
                }
                Statement::ImageStore { .. } => add("stores-to-buffers"),
                Statement::Call { .. } => add("calls"),
                _ => {}
            }
        }
        for statement in block {
            match statement {
                Statement::Block(inner) => self.block(f, inner, counts),
                Statement::If { accept, reject, .. } => {
                    self.block(f, accept, counts);
                    self.block(f, reject, counts);
                }
                Statement::Switch { cases, .. } => {
                    for case in cases {
                        self.block(f, &case.body, counts);
                    }
                }
                Statement::Loop {
                    body, continuing, ..
                } => {
                    self.block(f, body, counts);
                    self.block(f, continuing, counts);
                }
                Statement::Call { function, .. } => {
                    for (kind, n) in self.function(*function) {
                        *counts.entry(kind).or_default() += n;
                    }
                }
                _ => {}
            }
        }
    }
}

/// The column that an expression counts in.
fn kind(module: &Module, f: &Function, handle: Handle<Expression>) -> Option<&'static str> {
    Some(match f.expressions[handle] {
        Expression::Binary { .. } | Expression::Unary { .. } => "arithmetic",
        Expression::Math { .. } | Expression::Derivative { .. } | Expression::Relational { .. } => {
            "math"
        }
        Expression::Select { .. } => "selects",
        Expression::ImageLoad { .. } | Expression::ImageSample { .. } => "texture-loads",
        Expression::Load { pointer } if in_buffer(module, f, pointer) => "buffer-loads",
        Expression::Load { .. } => "local-loads",
        _ => return None,
    })
}

/// Whether a pointer leads into a storage or uniform buffer.
fn in_buffer(module: &Module, f: &Function, mut pointer: Handle<Expression>) -> bool {
    loop {
        match f.expressions[pointer] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                pointer = base;
            }
            Expression::GlobalVariable(global) => {
                return matches!(
                    module.global_variables[global].space,
                    AddressSpace::Storage { .. } | AddressSpace::Uniform
                );
            }
            Expression::FunctionArgument(i) => {
                let ty = f.arguments[i as usize].ty;
                return match module.types[ty].inner {
                    TypeInner::Pointer { space, .. } | TypeInner::ValuePointer { space, .. } => {
                        matches!(space, AddressSpace::Storage { .. } | AddressSpace::Uniform)
                    }
                    _ => false,
                };
            }
            _ => return false,
        }
    }
}

/// Counts of the outermost loop of the entry point with this name, itself included.
fn count(wgsl: &str, entry_point: &str) -> Counts {
    let module =
        naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|e| panic!("{}", e.emit_to_string(wgsl)));
    let entry = module
        .entry_points
        .iter()
        .find(|e| e.name == entry_point)
        .expect("the kernel's entry point");
    let mut counter = Counter {
        module: &module,
        known: HashMap::new(),
    };
    let mut counts = Counts::new();
    let mut loops = 0;
    for statement in &entry.function.body {
        if let Statement::Loop {
            body, continuing, ..
        } = statement
        {
            loops += 1;
            *counts.entry("loops").or_default() += 1;
            counter.block(&entry.function, body, &mut counts);
            counter.block(&entry.function, continuing, &mut counts);
        }
    }
    assert!(
        loops > 0,
        "{entry_point} has no loop at its outermost level"
    );
    counts
}

/// What the kernels contain now, by scene and access.
fn now() -> BTreeMap<String, Counts> {
    let mut all = BTreeMap::new();
    for path in scene_files() {
        let scene = read(&path);
        let settings = Settings::resolve(&scene, &Overrides::default());
        let world = World::new(&scene, settings.size);
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        for access in [Access::Baked, Access::Buffers] {
            let kernel = compose(&world, &settings, Some(access));
            let name = format!("{name}/{}", access.name());
            if let Some(light) = &kernel.light {
                let counts = count(&light.wgsl, "trace");
                all.insert(format!("{name}/light"), counts);
            }
            all.insert(name, count(&kernel.wgsl, "render"));
        }
    }
    all
}

fn write(all: &BTreeMap<String, Counts>) -> String {
    let width = KINDS.map(|k| k.len().max(6));
    let mut text = String::from(
        "# What the loop of each scene's kernel contains, calls replaced by what they call: see kernel_counts.rs.\n",
    );
    text += &format!("{:31}", "kernel");
    for (kind, w) in KINDS.iter().zip(width) {
        text += &format!("  {kind:>w$}");
    }
    text.push('\n');
    for (name, counts) in all {
        text += &format!("{name:31}");
        for (kind, w) in KINDS.iter().zip(width) {
            text += &format!("  {:>w$}", counts.get(kind).copied().unwrap_or(0));
        }
        text.push('\n');
    }
    text
}

fn parse(text: &str) -> BTreeMap<String, Counts> {
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let head: Vec<&str> = lines.next().expect("a head").split_whitespace().collect();
    assert_eq!(
        head[1..],
        KINDS,
        "the table has other columns; re-create it"
    );
    lines
        .map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let counts = KINDS
                .iter()
                .zip(&words[1..])
                .map(|(&kind, n)| (kind, n.parse().expect("a number")))
                .collect();
            (words[0].to_owned(), counts)
        })
        .collect()
}

/// What is beyond the slack, in words.
fn differences(table: &BTreeMap<String, Counts>, now: &BTreeMap<String, Counts>) -> Vec<String> {
    let mut found = Vec::new();
    for name in table.keys().filter(|n| !now.contains_key(*n)) {
        found.push(format!("{name}: in the table, but there is no such scene"));
    }
    for (name, counts) in now {
        let Some(before) = table.get(name) else {
            found.push(format!("{name}: not in the table"));
            continue;
        };
        for (i, kind) in KINDS.iter().enumerate() {
            let [a, b] = [before, counts].map(|c| c.get(kind).copied().unwrap_or(0));
            let slack = if i < EXACT {
                0
            } else {
                SMALL.max((SLACK * a as f64) as u64)
            };
            if a.abs_diff(b) > slack {
                let share = 100.0 * (b as f64 - a as f64) / (a as f64).max(1.0);
                found.push(format!("{name}: {kind} were {a}, are {b} ({share:+.0} %)"));
            }
        }
    }
    found
}

#[test]
fn kernels_contain_what_the_table_says() {
    let now = now();
    if std::env::var_os("ETENDUE_UPDATE_COUNTS").is_some() {
        std::fs::write(table(), write(&now)).expect("the table can be written");
        return;
    }
    let text = std::fs::read_to_string(table()).unwrap_or_default();
    assert!(!text.is_empty(), "no table; make it: {UPDATE}");
    let found = differences(&parse(&text), &now);
    assert!(
        found.is_empty(),
        "what the kernels contain has changed by more than {} %:\n  {}\n\
         More work at every vertex makes every picture slower; if the change is meant (measure it with `etendue bench`), \
         write it into the table:\n  {UPDATE}\nThe table now:\n{}",
        SLACK * 100.0,
        found.join("\n  "),
        write(&now)
    );
}

const UPDATE: &str = "ETENDUE_UPDATE_COUNTS=1 cargo test --release --test kernel_counts";

/// A kernel in small, in which everything can be counted by hand.
const SMALL_KERNEL: &str = "
@group(0) @binding(0) var<storage, read> inputs: array<f32>;
@group(0) @binding(1) var<storage, read_write> outputs: array<f32>;
fn twice(x: f32) -> f32 {
    return x + x;
}
@compute @workgroup_size(1)
fn render() {
    let outside = inputs[0] * 3.0;
    var i = 0u;
    while i < 4u {
        if outside > 1.0 {
            outputs[i] = twice(twice(inputs[i])) + sqrt(outside);
        }
        i = i + 1u;
    }
}
";

#[test]
fn a_small_kernel_is_counted_right() {
    let counts = count(SMALL_KERNEL, "render");
    let of = |kind: &str| counts.get(kind).copied().unwrap_or(0);
    assert_eq!(of("loops"), 1);
    assert_eq!(
        of("buffer-loads"),
        1,
        "the one before the loop is not in it"
    );
    assert_eq!(of("stores-to-buffers"), 1);
    assert_eq!(of("calls"), 2);
    assert_eq!(of("math"), 1);
    // Two additions in two calls, one after them, i + 1, outside > 1.0, and i < 4.
    assert_eq!(of("arithmetic"), 6);
    // While's own, and ours.
    assert_eq!(of("branches"), 2);
}

#[test]
fn differences_are_reported_with_numbers() {
    let counts = |loads: u64, arithmetic: u64| {
        let counts = Counts::from([("buffer-loads", loads), ("arithmetic", arithmetic)]);
        BTreeMap::from([("box/baked".to_owned(), counts)])
    };
    let before = counts(0, 1000);
    assert!(differences(&before, &counts(0, 1030)).is_empty());
    assert_eq!(
        differences(&before, &counts(1, 1100)),
        [
            "box/baked: buffer-loads were 0, are 1 (+100 %)",
            "box/baked: arithmetic were 1000, are 1100 (+10 %)"
        ]
    );
    assert_eq!(differences(&before, &BTreeMap::new()).len(), 1);
    assert_eq!(
        differences(&BTreeMap::new(), &before),
        ["box/baked: not in the table"]
    );
    assert_eq!(parse(&write(&before))["box/baked"]["arithmetic"], 1000);
}
