//! Faults put into kernels on purpose, which must be seen.

use super::cases::{FIRST_BULB, case};
use super::{FALSE_ALARM, SAMPLES, by_chance, by_reference, kernel, p};

/// Puts other text in the place of one that is there once.
fn replace(text: &mut String, old: &str, new: &str) {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    *text = text.replace(old, new);
}

/// A case, a fault that it must show, and whether it is in the kernel of light paths, in the other one, or in both.
type Fault = (&'static str, usize, [bool; 2], &'static str, &'static str);

/// A fault in the densities of lobes is not among them: it moves weight between two ways that both find the light, by less than the noise
/// of these runs.
const FAULTS: [Fault; 12] = [
    (
        "light counted twice",
        0,
        [false, true],
        "return 1.0 / (1.0 + select(0.0, path.trail.ratio * density, weighs));",
        "return 1.0;",
    ),
    (
        "the cosine at the light is forgotten",
        0,
        [true, true],
        "fmax(2.0 * PI * cone.height * cos, TINY)",
        "fmax(2.0 * PI * cone.height, TINY)",
    ),
    (
        "a factor of n squared",
        7,
        [true, true],
        "return photons * select(in_cone",
        "return 2.25 * photons * select(in_cone",
    ),
    (
        "a density wrong by a tenth",
        1,
        [true, true],
        "return photons * select(in_cone",
        "return 1.1 * photons * select(in_cone",
    ),
    (
        "what is carried past a second surface is dropped",
        0,
        [false, true],
        "let later = path.trail.ratio * turned(x, scattered.wi, scattered.pdf);",
        "let later = 0.0;",
    ),
    (
        "sixteen passes for fifteen",
        0,
        [true, false],
        "(turns / fmax(ratio + cos, TINY))",
        "(16.0 / 15.0 * turns / fmax(ratio + cos, TINY))",
    ),
    (
        "a pixel's cosine is forgotten",
        0,
        [true, true],
        "return PIXEL_AREA * (cos * along) * along;",
        "return PIXEL_AREA * along * along;",
    ),
    (
        "light of bulbs counted twice",
        20,
        [false, true],
        "return select(share, weight, sampled);",
        "return share;",
    ),
    (
        "light that a bulb reflects counted twice",
        19,
        [false, true],
        "((trail.reflections == 0u) | once)",
        "(trail.reflections == 0u)",
    ),
    (
        "light paths counted beside what is sampled of a bulb",
        18,
        [true, false],
        "return straight | once;",
        "return false;",
    ),
    (
        "a bulb that reflects all light",
        21,
        [false, true],
        "again * again * (1.0 - outer)",
        "again * again",
    ),
    (
        "a bulb's own light lets light through",
        23,
        [false, true],
        "& keeps(last) & !hidden",
        "& keeps(last)",
    ),
];

#[test]
fn faults_are_seen() {
    let mut unseen = Vec::new();
    for (name, number, [in_light, in_path], old, new) in FAULTS {
        let faulty = kernel(&case(number).1, true, SAMPLES[0], |k| {
            let light = k.light.as_mut().expect("light paths");
            if in_light {
                replace(&mut light.wgsl, old, new);
            }
            if in_path {
                replace(&mut k.wgsl, old, new);
            }
        });
        let right = if number < FIRST_BULB {
            by_chance(number)
        } else {
            by_reference(number)
        };
        if p(name, &faulty, &right) > FALSE_ALARM {
            unseen.push(name);
        }
    }
    assert!(unseen.is_empty(), "{unseen:?}");
}
