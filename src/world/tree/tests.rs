use super::*;
use glam::DVec3;

fn boxes(count: usize, place: impl Fn(usize) -> DVec3, size: f64) -> Vec<Bounds> {
    (0..count)
        .map(|i| Bounds::about(place(i), DVec3::splat(size)))
        .collect()
}

/// Points spread over a cube, the same every time.
fn scattered(i: usize) -> DVec3 {
    let part = |k: f64| (i as f64 * k).fract() * 10.0;
    DVec3::new(part(0.618_034), part(0.414_214), part(0.732_051))
}

/// The inner nodes on the longest way from node `k` to a leaf. Every node on the way is seen to hold its children.
fn depth(tree: &Tree, k: usize) -> u32 {
    let Node { bounds, below } = &tree.nodes[k];
    let Below::Nodes { first, count } = *below else {
        return 0;
    };
    assert!((2..=WIDTH as u32).contains(&count));
    let children = first as usize..(first + count) as usize;
    for child in &tree.nodes[children.clone()] {
        let child = &child.bounds;
        assert!((0..3).all(|k| child.min[k] >= bounds.min[k] && child.max[k] <= bounds.max[k]));
    }
    1 + children.map(|c| depth(tree, c)).max().unwrap_or(0)
}

/// Every box is in the tree once, within its ancestors, and no deeper than is allowed.
fn check(tree: &Tree, boxes: usize) {
    let item = |n: &Node| match n.below {
        Below::Item(item) => Some(item),
        Below::Nodes { .. } => None,
    };
    let mut items: Vec<u32> = tree.nodes.iter().filter_map(item).collect();
    items.sort_unstable();
    assert!(items.into_iter().eq(0..boxes as u32));
    assert!(depth(tree, 0) <= Tree::levels(boxes));
    // Every node but the root is the child of one.
    let children = |n: &Node| match n.below {
        Below::Item(_) => 0,
        Below::Nodes { count, .. } => count as usize,
    };
    assert_eq!(
        1 + tree.nodes.iter().map(children).sum::<usize>(),
        tree.nodes.len()
    );
}

#[test]
fn every_box_is_in_the_tree_once_and_within_its_ancestors() {
    let same = |_: usize| DVec3::new(3.0, 0.0, -1.0);
    let flat = |i: usize| DVec3::new(i as f64 % 7.0, 0.0, i as f64 / 7.0);
    let places: [&dyn Fn(usize) -> DVec3; 3] = [&scattered, &same, &flat];
    for place in places {
        // The last is built in several threads.
        for (count, size) in [
            (1, 1.0),
            (2, 0.0),
            (5, 0.0),
            (777, 0.1),
            (500, 0.0),
            (100_000, 0.01),
        ] {
            let tree = Tree::new(&boxes(count, place, size));
            check(&tree, count);
        }
    }
}

#[test]
fn a_giant_and_dust_at_all_scales_have_room() {
    // Each box is a tenth as far away as the last. The heuristic would like to split them off one by one.
    let places = |i: usize| DVec3::splat(10f64.powi(10 - (i % 40) as i32));
    for count in [2, 3, 4, 5, 16, 17, 40, 63, 64, 65, 1000, 4096, 4097] {
        check(&Tree::new(&boxes(count, places, 1e-4)), count);
    }
}

#[test]
fn what_touches_a_box_is_found() {
    let boxes = boxes(1000, scattered, 0.8);
    let tree = Tree::new(&boxes);
    for probe in boxes.iter().step_by(97) {
        let touches = |b: &Bounds| b.min.cmple(probe.max).all() && b.max.cmpge(probe.min).all();
        let expected: Vec<usize> = (0..1000).filter(|&i| touches(&boxes[i])).collect();
        let mut found = Vec::new();
        tree.touching(probe, |i| found.push(i));
        found.sort_unstable();
        assert!(expected.len() > 1 && expected == found);
    }
    Tree::new(&[]).touching(&boxes[0], |_| panic!("nothing is there"));
}

#[test]
fn equal_boxes_take_no_quadratic_time() {
    let start = std::time::Instant::now();
    Tree::new(&boxes(30_000, |_| DVec3::ONE, 0.5));
    // A builder that is quadratic in them takes more than a minute.
    assert!(
        start.elapsed().as_secs_f64() < 20.0,
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn a_crowd_far_from_others_gets_a_tree_of_its_own() {
    let items = |t: &Tree| {
        let mut items = t.items();
        items.sort_unstable();
        items
    };
    // Things near each other stay together, whatever their sizes.
    for size in [1e-6, 0.01, 3.0] {
        assert_eq!(Tree::forest(&boxes(5000, scattered, size)).len(), 1);
    }
    assert!(Tree::forest(&[]).is_empty());
    // Two crowds, of which one holds a third, and a few things far away.
    let place = |i: usize| match i {
        0..3 => DVec3::new(1e8, i as f64, 0.0),
        3..1000 => scattered(i),
        1000..1100 => DVec3::splat(4.0) + 1e-4 * scattered(i),
        _ => DVec3::new(0.0, 0.0, 1e6) + scattered(i),
    };
    let mut all = boxes(1300, place, 1e-5);
    let forest = Tree::forest(&all);
    let mut found: Vec<Vec<u32>> = forest.iter().map(items).collect();
    found.sort_unstable();
    let of = |range: std::ops::Range<u32>| range.collect::<Vec<u32>>();
    assert_eq!(
        found,
        [of(0..3), of(3..1000), of(1000..1100), of(1100..1300)]
    );
    for tree in &forest {
        assert!(depth(tree, 0) <= Tree::levels(items(tree).len()));
    }
    // There are never many trees.
    all = boxes(
        20_000,
        |i| DVec3::splat(1e6 * (i / 100) as f64) + scattered(i),
        0.1,
    );
    let forest = Tree::forest(&all);
    assert!((2..=8).contains(&forest.len()), "{}", forest.len());
    let mut every: Vec<u32> = forest.iter().flat_map(items).collect();
    every.sort_unstable();
    assert_eq!(every, of(0..20_000));
}

#[test]
fn boxes_in_f32_hold_what_they_bound_in_all_sizes_and_places() {
    // The rounding errors of what a box bounds: the corners', and those of a test in f32, which are a few units in the last place of
    // the corners.
    const ERRORS: f64 = 8.0 / (1 << 24) as f64;
    for (size, offset) in (-6..=6).flat_map(|s| (-7..=6).map(move |o| (s, o))) {
        let far = if offset < -6 { 0.0 } else { 10f64.powi(offset) };
        let size = 10f64.powi(size);
        for i in 0..40 {
            let middle = far * (scattered(i) - 5.0);
            // Cubes, flat boxes and points.
            let half = match i % 4 {
                0 => DVec3::splat(size),
                1 => size * scattered(i + 40),
                2 => size * DVec3::new(1.0, 0.0, 0.3),
                _ => DVec3::ZERO,
            };
            let exact = Bounds::about(middle, half);
            let b = Box32::outwards(&exact);
            let reach = exact.min.abs().max(exact.max.abs()).element_sum();
            for k in 0..3 {
                let (min, max) = (f64::from(b.min[k]), f64::from(b.max[k]));
                let corner = exact.min[k].abs().max(exact.max[k].abs());
                assert!(min < exact.min[k] - ERRORS * corner, "{exact:?} {b:?}");
                assert!(max > exact.max[k] + ERRORS * corner, "{exact:?} {b:?}");
                let room = 2e-6 * reach + 1e-40;
                assert!(min > exact.min[k] - room && max < exact.max[k] + room);
            }
        }
    }
}
