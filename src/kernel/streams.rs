//! The streams of random numbers, as `shaders/sampler.wgsl` declares them: what is mixed into keys so that two uses of one pixel and
//! sample share no number.

/// The seed of the pilots of a picture with this seed: samples that are in no picture.
pub(crate) fn pilot_seed(seed: u32) -> u32 {
    seed ^ stream("PILOT_STREAM")
}

/// The value of a constant of `shaders/sampler.wgsl`.
///
/// # Panics
/// If there is no such constant: the text is ours, and a test reads it.
fn stream(name: &str) -> u32 {
    let head = format!("const {name}: u32 = ");
    let text = super::modules::SAMPLER.text;
    let value = text
        .split_once(&head)
        .and_then(|(_, rest)| rest.split_once("u;"));
    let (value, _) = value.unwrap_or_else(|| panic!("sampler.wgsl declares no {name}"));
    let parsed = match value.strip_prefix("0x") {
        Some(hexadecimal) => u32::from_str_radix(hexadecimal, 16),
        None => value.parse(),
    };
    parsed.unwrap_or_else(|_| panic!("{name} is no number: {value}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::glances::MAX_GLANCES;
    use std::collections::HashMap;

    /// Seeds that two pictures of one scene may well have.
    const SEEDS: u32 = 64;

    #[test]
    fn no_two_streams_meet() {
        // What draws with `pcg4d`, by the seed of its key; depth and sample are the same for all.
        let mut drawn: HashMap<u32, String> = HashMap::new();
        // What hashes a pixel and a sample number; a round's or a replicate's number is a small sample number.
        let mut hashed: HashMap<u32, String> = HashMap::new();
        fn add(to: &mut HashMap<u32, String>, seed: u32, what: String) {
            if let Some(other) = to.insert(seed, what.clone()) {
                panic!("{what} and {other} have the seed {seed:#x}");
            }
        }
        for seed in 0..SEEDS {
            for (run, seed) in [("", seed), ("the pilot of ", pilot_seed(seed))] {
                let name = |what: &str| format!("{what} of {run}{seed}");
                for glance in 0..=MAX_GLANCES {
                    let own = seed ^ glance.wrapping_mul(stream("GLANCE_STREAM"));
                    add(&mut drawn, own, name(&format!("glance {glance}")));
                    add(
                        &mut hashed,
                        own ^ stream("SHIFT_STREAM"),
                        name(&format!("shift of glance {glance}")),
                    );
                    add(
                        &mut drawn,
                        own ^ stream("TOGETHER_STREAM"),
                        name(&format!("place and point together of glance {glance}")),
                    );
                }
                add(
                    &mut drawn,
                    seed ^ stream("LIGHT_STREAM"),
                    name("light path"),
                );
                add(&mut hashed, seed, name("place"));
                add(&mut hashed, seed ^ stream("COIN_STREAM"), name("coin"));
                add(&mut hashed, seed ^ stream("ORDER_STREAM"), name("order"));
            }
        }
    }

    #[test]
    fn numbers_of_shadow_rays_and_glances_do_not_touch_what_they_are_added_to() {
        assert!(crate::scene::DEFAULT_MAX_DEPTH < 1 << stream("SHADOW_RAY_SHIFT"));
        // The place of a glance is hashed with its number in the upper bits of the sample's.
        assert!(u64::from(MAX_GLANCES) < 1 << (32 - stream("GLANCE_SHIFT")));
    }
}
