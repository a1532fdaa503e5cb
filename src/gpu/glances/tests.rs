use super::*;
use crate::scene::parse::parse_str;
use crate::settings::Overrides;

#[test]
fn a_packed_mark_is_what_the_kernel_takes_apart() {
    let mark = Mark {
        last_vertex: 6,
        branch_vertex: 3,
        many: true,
    };
    let packed = mark.pack();
    assert_eq!(packed & 0xff, 6);
    assert_eq!((packed >> BRANCH_SHIFT) & 0xff, 3);
    assert_eq!(packed >> MANY_SHIFT, 1);
    assert_eq!(Mark::default().pack(), 0);
}

#[test]
fn a_light_in_the_middle_marks_the_middle() {
    let text = "[camera]\neye = [0, 0, 4]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [64, 48]\n\
        [material.white]\ntype = 'diffuse'\nreflectance = [1, 1, 1]\n\
        [[plane]]\npoint = [0, -9, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
        [[light]]\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
        [[light]]\ncenter = [1, 0, 0]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n\
        [[light]]\ncenter = [0, 0, 9]\nnormal = [0, 0, -1]\nradius = 0.2\nradiance = [1, 1, 1]\n";
    let scene = parse_str("x.toml".as_ref(), text).expect("a scene");
    let settings = Settings::resolve(&scene, &Overrides::default());
    let marks = GlanceMarks::new(&World::new(&scene, [64, 48]), &settings, 1);
    // A pixel is 2 x 4 tan 20 / 48 = 0.0607 wide there: the light reaches 3.3 pixels from the middle.
    let part = Rect {
        x0: 30,
        y0: 20,
        x1: 50,
        y1: 30,
    };
    let marked = marks.mark(part);
    let mut counts = [0, 0];
    for (i, mark) in marked.iter().enumerate() {
        let [x, y] = [30 + i % 20, 20 + i / 20].map(|k| k as f64);
        let away = (x + 0.5 - 32.0).hypot(y + 0.5 - 24.0);
        // A pixel reaches 0.71 from its middle.
        if away < 3.3 + 0.7 {
            assert_eq!(*mark, DIRECT, "({x}, {y})");
        } else if away > 3.3 + 1.5 {
            assert_eq!(*mark, Mark::default(), "({x}, {y})");
        }
        counts[usize::from(mark.last_vertex > 0)] += 1;
    }
    assert!(counts[0] > 100 && counts[1] > 20, "{counts:?}");
}

const LOOKING: &str = "[camera]\neye = [0, 0, 4]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [512, 384]\n\
    [material.silver]\ntype = 'mirror'\nreflectance = [1, 1, 1]\n\
    [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
    [[light]]\ncenter = [0, 0, 9]\nnormal = [0, 0, -1]\nradius = 1.5\nradiance = [1, 1, 1]\n";

/// A scene looked at along the z axis, with a large lamp behind the eye.
fn looking(things: &str, light: LightParts) -> GlanceMarks {
    let scene = parse_str("x.toml".as_ref(), &format!("{LOOKING}{things}")).expect("a scene");
    let flags = Overrides {
        light: Some(light),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    GlanceMarks::new(&World::new(&scene, settings.size), &settings, 6)
}

/// The distance from the middle of the picture, in pixels, at which a ball of radius 1 there shows the lamp's edge.
fn edge_in_the_ball() -> f64 {
    // Where the ray that meets the ball at this angle from its pole comes to the lamp's plane.
    let away = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let d = DVec3::new(sin, 0.0, cos - 4.0).normalize();
        let n = DVec3::new(sin, 0.0, cos);
        let onward = d - 2.0 * d.dot(n) * n;
        sin + onward.x / onward.z * (9.0 - cos)
    };
    let (mut inside, mut outside) = (0.0, 0.7);
    for _ in 0..60 {
        let middle = (inside + outside) / 2.0;
        if away(middle) < 1.5 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    let tangent = f64::sin(inside) / (4.0 - f64::cos(inside));
    tangent * 192.0 / 20f64.to_radians().tan()
}

/// The mark of a pixel that may show a light directly and nothing else.
const DIRECT: Mark = Mark {
    last_vertex: 1,
    branch_vertex: 0,
    many: true,
};

/// The mark of a pixel that shows the edge of a light in a mirror.
const MIRRORED: Mark = Mark {
    last_vertex: 2,
    branch_vertex: 0,
    many: false,
};

const WHOLE: Rect = Rect {
    x0: 0,
    y0: 0,
    x1: 512,
    y1: 384,
};

#[test]
fn a_lamp_in_a_mirror_ball_marks_the_ring_where_its_edge_is() {
    let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'silver'\n";
    let edge = edge_in_the_ball();
    assert!((10.0..60.0).contains(&edge), "{edge}");
    for (k, mark) in looking(ball, LightParts::ALL)
        .mark(WHOLE)
        .iter()
        .enumerate()
    {
        let [x, y] = [k % 512, k / 512].map(|k| k as f64 + 0.5);
        let off = ((x - 256.0).hypot(y - 192.0) - edge).abs();
        if off < 0.7 {
            assert_eq!(*mark, MIRRORED, "({x}, {y})");
        } else if off > 3.0 {
            assert_eq!(*mark, Mark::default(), "({x}, {y})");
        }
    }
    let indirect = LightParts {
        emitted: false,
        direct: false,
        ..LightParts::ALL
    };
    let marks = looking(ball, indirect).mark(WHOLE);
    assert!(
        marks.iter().all(|m| *m == Mark::default()),
        "none of it is kept"
    );
}

#[test]
fn a_lamp_in_glass_is_marked_all_over_and_half_of_the_glances_are_reflected() {
    let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'glass'\n";
    let edge = edge_in_the_ball();
    let ball_edge = f64::tan(f64::asin(0.25)) * 192.0 / 20f64.to_radians().tan();
    let all = looking(ball, LightParts::ALL).mark(WHOLE);
    for (k, mark) in all.iter().enumerate() {
        let [x, y] = [k % 512, k / 512].map(|k| k as f64 + 0.5);
        let off = (x - 256.0).hypot(y - 192.0);
        if off < edge + 0.7 {
            assert!(
                mark.last_vertex >= 2 && mark.branch_vertex == 1,
                "({x}, {y}): {mark:?}"
            );
        } else if off > ball_edge + 3.0 {
            assert_eq!(*mark, Mark::default(), "({x}, {y})");
        }
    }
    let direct = LightParts {
        emitted: false,
        direct: true,
        indirect: false,
    };
    let part = looking(ball, direct).mark(WHOLE);
    assert_eq!(part, all, "parts of the light add up to the whole");
}

#[test]
fn marks_of_a_part_are_those_of_the_whole() {
    let text = include_str!("../../../scenes/three_materials.toml");
    let scene = parse_str("x.toml".as_ref(), text).expect("a scene");
    for size in [[90, 70], [400, 300]] {
        let flags = Overrides {
            size: Some(size),
            ..Overrides::default()
        };
        let settings = Settings::resolve(&scene, &flags);
        let world = World::new(&scene, size);
        let mut marks = GlanceMarks::new(&world, &settings, 6);
        let whole = marks.mark(Rect::whole(size));
        assert!(whole.contains(&DIRECT) && whole.iter().any(|m| m.last_vertex > 1));
        for [x0, y0, x1, y1] in [
            [0, 0, 90, 70],
            [31, 17, 64, 45],
            [50, 33, 51, 34],
            [0, 40, 89, 70],
        ] {
            let part = Rect { x0, y0, x1, y1 };
            let rows =
                (y0..y1).map(|y| &whole[(y * size[0] + x0) as usize..][..part.width() as usize]);
            let expected: Vec<u32> = rows.flatten().map(|m| m.pack()).collect();
            assert_eq!(marks.marks(part), expected, "{part:?} of {size:?}");
            assert_eq!(marks.marks(part), expected, "kept: {part:?} of {size:?}");
        }
    }
}
