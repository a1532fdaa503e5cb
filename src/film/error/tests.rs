//! The stated error of simulated films, whose true error is known.

use super::*;
use crate::film::Sums;
use crate::film::coverage::Rect;
use crate::film::splats::{Passes, SplatSetup};

/// SplitMix64: uniform numbers from 0 to below 1.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }
}

const SIZE: [u32; 2] = [48, 36];
const PIXELS: f64 = (SIZE[0] * SIZE[1]) as f64;
const SAMPLES: u64 = 64;

/// Light of a pixel: `base` in every sample, and `flash` more with probability `chance`.
#[derive(Clone, Copy)]
struct Source {
    base: f64,
    flash: f64,
    chance: f64,
}

impl Source {
    fn mean(&self) -> f64 {
        self.base + self.flash * self.chance
    }

    fn variance(&self) -> f64 {
        self.flash.powi(2) * self.chance * (1.0 - self.chance)
    }
}

fn simulated(source: impl Fn(u32, u32) -> Source, seed: u64) -> Film {
    let mut rng = Uniform(seed << 32);
    let whole = Rect::whole(SIZE);
    let mut film = Film::new(SIZE, whole, 1);
    let mut pixels = Vec::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let s = source(x, y);
            let mut sums: [Sums<f64>; REPLICATES] = Default::default();
            for k in 0..SAMPLES as usize {
                let light = s.base + if rng.next() < s.chance { s.flash } else { 0.0 };
                let added = [light, light, light, light * light];
                let sum = &mut sums[k % REPLICATES];
                sum.iter_mut().zip(added).for_each(|(s, a)| *s += a);
            }
            pixels.push(sums);
        }
    }
    film.put_samples(whole, 0..SAMPLES, pixels);
    film
}

/// The true relative error of such films.
fn truth(source: impl Fn(u32, u32) -> Source) -> f64 {
    let all = || (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let mean = all().map(|(x, y)| source(x, y).mean()).sum::<f64>() / PIXELS;
    let floor = (0.1 * mean).powi(2);
    let term = |(x, y)| {
        let s = source(x, y);
        s.variance() / SAMPLES as f64 / (s.mean().powi(2) + floor)
    };
    (all().map(term).sum::<f64>() / PIXELS).sqrt()
}

/// Of many films that have found light: root mean square of the stated error over the true one, the spread of the stated errors,
/// their mean stated uncertainty (both relative to the true one), and the share that is in doubt.
fn stated(source: impl Fn(u32, u32) -> Source) -> [f64; 4] {
    let truth = truth(&source);
    let films = (0..60).map(|seed| {
        let mut film = simulated(&source, seed);
        let met = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        met.filter(|&(x, y)| source(x, y).mean() > 0.0)
            .for_each(|(x, y)| film.reach(x, y, Reach::Further));
        film.relative_error()
    });
    let errors: Vec<RelativeError> = films.filter(|e| e.value.is_some()).collect();
    let n = errors.len() as f64;
    let values: Vec<f64> = errors.iter().filter_map(|e| e.value).collect();
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| v * v).sum::<f64>() / n;
    let uncertainty = errors.iter().filter_map(|e| e.uncertainty).sum::<f64>() / n;
    let doubted = errors.iter().filter(|e| e.doubt.is_some()).count() as f64 / n;
    [
        square.sqrt() / truth,
        (square - mean * mean).max(0.0).sqrt() / truth,
        uncertainty / truth,
        doubted,
    ]
}

/// From a picture in which one sample has found light to one in which all have.
#[test]
fn evenly_lit_pictures_state_their_error_however_rare_the_light_is() {
    for found in [1.5, 4.0, 16.0, 64.0, 256.0, 1e3, 4e3, 16e3, 64e3] {
        let even = |_, _| Source {
            base: 0.0,
            flash: 1.0,
            chance: found / (PIXELS * SAMPLES as f64),
        };
        let [ratio, spread, uncertainty, doubted] = stated(even);
        println!(
            "{found}: {ratio:.3}, spread {spread:.3}, stated {uncertainty:.3}, doubted {doubted}"
        );
        // With few samples the square of the error is 1 / found on average, which is above 1 / the mean of found, and cannot be
        // less than 1.
        let bounds = if found < 10.0 { 0.7..1.35 } else { 0.9..1.15 };
        assert!(bounds.contains(&ratio), "{found}: {ratio}");
        // If what terms and pools cancel of each other were not counted, it would be 1.8 to 3.4 up to 256 samples.
        let most = if found < 300.0 { 1.7 } else { 2.0 };
        assert!(
            (0.85..most).contains(&(uncertainty / spread)),
            "{found}: {uncertainty}, {spread}"
        );
        // Some 200 samples are at the limit: half of √((0.5 + 2.5 x 4 - 4) / 200) is about 0.09.
        let expected = match found {
            ..100.0 => Some(1.0),
            1000.0.. => Some(0.0),
            _ => None,
        };
        assert!(expected.is_none_or(|e| e == doubted), "{found}: {doubted}");
    }
}

/// Rare flashes on light that every sample finds: before, a pixel with a flash divided the flash's error by the flash.
#[test]
fn flashes_on_a_steady_light_are_not_divided_by_themselves() {
    let source = |x: u32, _| Source {
        base: 1.0 + f64::from(x) / 16.0,
        flash: 300.0,
        chance: 3e-4,
    };
    let [ratio, spread, uncertainty, doubted] = stated(source);
    println!("{ratio:.3}, spread {spread:.3}, stated {uncertainty:.3}, doubted {doubted}");
    assert!((0.85..1.15).contains(&ratio), "{ratio}");
    assert!(
        (0.85..1.3).contains(&(uncertainty / spread)),
        "{uncertainty}, {spread}"
    );
}

/// A lamp in the picture, and a wall around it that only rare light reaches.
#[test]
fn a_lamp_does_not_hide_the_noise_of_the_wall_beside_it() {
    let source = |x: u32, y: u32| {
        if (20..28).contains(&x) && (14..22).contains(&y) {
            Source {
                base: 5.0,
                flash: 0.0,
                chance: 0.0,
            }
        } else {
            Source {
                base: 0.0,
                flash: 40.0,
                chance: 2e-3,
            }
        }
    };
    let [ratio, spread, uncertainty, _] = stated(source);
    println!("{ratio:.3}, spread {spread:.3}, stated {uncertainty:.3}");
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
}

/// Beside a background without light, edges keep their own brightness.
#[test]
fn a_black_background_does_not_exaggerate_the_noise_of_an_edge() {
    let source = |x: u32, y: u32| {
        let inside = (x / 3 + y / 3).is_multiple_of(2);
        Source {
            base: 0.0,
            flash: if inside { 2.0 } else { 0.0 },
            chance: 0.2,
        }
    };
    let [ratio, _, _, doubted] = stated(source);
    println!("{ratio:.3}, doubted {doubted}");
    assert!((0.85..1.15).contains(&ratio) && doubted == 0.0, "{ratio}");
}

/// Rare light that is sixty times as frequent on one side of the picture as on the other.
#[test]
fn dark_parts_are_not_taken_for_as_bright_as_the_parts_beside_them() {
    let source = |x: u32, _| Source {
        base: 0.0,
        flash: 1.0,
        chance: 5e-4 * 2f64.powf(f64::from(x) / 8.0),
    };
    let [ratio, spread, uncertainty, _] = stated(source);
    println!("{ratio:.3}, spread {spread:.3}, stated {uncertainty:.3}");
    // 0.86 with pools of 16 samples alone.
    assert!((0.92..1.05).contains(&ratio), "{ratio}");
}

/// Pixels side by side of which all to 1/256 is covered by something bright, as at the edges of many small things.
#[test]
fn pixels_that_little_of_a_thing_covers_are_not_taken_for_the_thing() {
    let source = |x: u32, y: u32| Source {
        base: 0.0,
        flash: 1.0,
        chance: 0.25f64.powi(((7 * x + 5 * y) % 5) as i32),
    };
    let [ratio, spread, uncertainty, _] = stated(source);
    println!("{ratio:.3}, spread {spread:.3}, stated {uncertainty:.3}");
    // 1.24 with pools of 16 samples alone.
    assert!((0.9..1.21).contains(&ratio), "{ratio}");
}

#[test]
fn a_picture_without_light_states_no_error() {
    let black = |_, _| Source {
        base: 0.0,
        flash: 0.0,
        chance: 0.0,
    };
    let error = simulated(black, 1).relative_error();
    let expected = RelativeError {
        doubt: Some(Doubt::NoLight),
        ..RelativeError::default()
    };
    assert_eq!(error, expected);
    assert_eq!(error.upper(), None);
    assert_eq!(error.of_black(false), expected);
    assert_eq!(error.of_black(true), RelativeError::ZERO);
}

/// One corner of the picture shines. Elsewhere paths have met surfaces, or nothing.
#[test]
fn surfaces_that_no_light_was_found_on_are_told_from_a_background() {
    let source = |x: u32, y: u32| Source {
        base: if x < 12 && y < 12 { 1.0 } else { 0.0 },
        flash: 0.0,
        chance: 0.0,
    };
    let mut film = simulated(source, 1);
    assert_eq!(film.relative_error(), RelativeError::ZERO);
    for y in 0..SIZE[1] {
        for x in 0..24 {
            film.reach(x, y, Reach::Further);
        }
    }
    // 24 columns but for the corner and what is within a sixteenth of 48 pixels of it.
    let share = (24.0 * 36.0 - 15.0 * 15.0) / PIXELS;
    let error = film.relative_error();
    assert_eq!(error.doubt, Some(Doubt::Unlit(share)));
    assert_eq!(error.upper(), None);
}

/// A third of the picture shines. Elsewhere no sample has found light: if three of them might have found some that is as bright as the
/// brightest, it would change the error, or not.
#[test]
fn surfaces_without_light_are_in_no_doubt_once_it_would_not_matter() {
    let doubt = |lamp: f64| {
        let source = |x: u32, y: u32| Source {
            base: if (x, y) == (0, 0) { lamp } else { 0.0 },
            flash: if x < 16 { 2.0 } else { 0.0 },
            chance: 0.5,
        };
        let mut film = simulated(source, 1);
        for k in 0..SIZE[0] * SIZE[1] {
            film.reach(k % SIZE[0], k / SIZE[0], Reach::Further);
        }
        film.relative_error().doubt
    };
    // E² is 1/3 / 64 = 0.0052. The mean is 1/3, so the missing part is 3 x 2² / 1728 / 64² / (1/30)² = 0.0015, and 0.14 with a lamp of 20.
    assert_eq!(doubt(0.0), None);
    let share = 29.0 / 48.0;
    assert_eq!(doubt(20.0), Some(Doubt::Unlit(share)));
}

/// Mirrors and glass show surfaces in a corner of the picture. Light that comes there by way of mirrors and glass may be as bright as the
/// lamp, and no light path brings it.
#[test]
fn light_that_mirrors_show_is_in_doubt_until_it_was_found() {
    let even = |_, _| Source {
        base: 0.9,
        flash: 0.2,
        chance: 0.5,
    };
    let doubt = |brightest: f64, hidden: u32, found: u32| {
        let mut film = simulated(even, 1);
        film.begin_splats(SplatSetup {
            paths: 64,
            scale: brightest,
        });
        film.put_passes(
            Rect::whole(SIZE),
            &Passes::new(0..SAMPLES, SIZE[0], Vec::new()),
        );
        for k in 0..SIZE[0] * SIZE[1] {
            let how = if k < found {
                Reach::Found
            } else if k < hidden {
                Reach::Hidden
            } else {
                Reach::Further
            };
            film.reach(k % SIZE[0], k / SIZE[0], how);
        }
        film.relative_error().doubt
    };
    // E is 0.1 / 8. No sample of 100 x 64 has found light of 1/4 of 128, but 3 may. Their part in the error is √(3 / 6400 x 32² / 64 x
    // 100 / 1728), which is 1 / 48. With a lamp of 64 it is half of that, and less than E.
    assert_eq!(doubt(128.0, 100, 0), Some(Doubt::Hidden(100.0 / PIXELS)));
    assert_eq!(doubt(64.0, 100, 0), None);
    assert_eq!(doubt(128.0, 0, 0), None, "nothing is hidden");
    assert_eq!(doubt(128.0, 100, 40), None, "enough was found");
    assert_eq!(doubt(1e6, 6, 0), Some(Doubt::Hidden(6.0 / PIXELS)));
    assert_eq!(doubt(1e6, 5, 0), None, "in hardly any of the picture");
}

#[test]
fn a_picture_of_one_sample_states_no_error_and_one_of_two_states_a_limit() {
    let rect = Rect::whole([1, 1]);
    let mut film = Film::new([1, 1], rect, 2);
    let one =
        |sum: f64, squares: f64| vec![[[sum, sum, sum, squares], [0.0; 4], [0.0; 4], [0.0; 4]]];
    film.put_samples(rect, 0..1, one(2.0, 4.0));
    assert_eq!(film.relative_error(), RelativeError::default());
    // Another one of 4: mean 3, squares 4 + 16, one replicate. Two samples do not make a pool of 16, but there are no others.
    film.put_samples(rect, 1..2, one(6.0, 20.0));
    let expected = 20f64.sqrt() / 2.0 / (9.0 + 0.09f64).sqrt();
    let error = film.relative_error();
    assert!((error.value.unwrap() - expected).abs() < 1e-12, "{error}");
    assert_eq!(error.uncertainty, error.value);
    assert_eq!(error.doubt, Some(Doubt::Uncertain));
}

/// A picture of one pixel, whose error is the textbook standard error: √(5/3 / 4) of 102.5.
#[test]
fn small_errors_are_those_of_the_textbook() {
    let rect = Rect::whole([1, 1]);
    let mut film = Film::new([1, 1], rect, 1);
    let light = [101.0, 102.0, 103.0, 104.0];
    film.put_samples(rect, 0..4, vec![light.map(|y| [y, y, y, y * y])]);
    let expected = (5.0f64 / 3.0 / 4.0).sqrt() / (102.5 * 1.01f64.sqrt());
    let error = film.relative_error().value.unwrap();
    assert!((error / expected - 1.0).abs() < 1e-12, "{error}");
}

/// On the left light is rare, on the right there is nothing to meet.
#[test]
fn pixels_without_light_are_wrong_by_the_light_that_others_found() {
    let source = |x: u32, _| Source {
        base: 0.0,
        flash: 3.0,
        chance: if x < 24 { 1e-3 } else { 0.0 },
    };
    let mut film = simulated(source, 1);
    assert_eq!(film.errors_of_unlit(), None, "nothing is known of surfaces");
    for y in 0..SIZE[1] {
        for x in 0..24 {
            film.reach(x, y, Reach::Further);
        }
    }
    let unlit = film.errors_of_unlit().unwrap();
    let truth = source(0, 0).mean();
    let counts = [SAMPLES / 4; REPLICATES];
    let (mut least, mut most, mut squares, mut far) = (f64::INFINITY, 0.0f64, 0.0, 0);
    for (i, error) in unlit.iter().enumerate() {
        let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
        let own = film.estimate(x, y, &counts);
        assert_eq!(error.is_some(), x < 24 && own.mean[0] == 0.0, "pixel {i}");
        // All four numbers are the same: the light is grey.
        if let Some([r, g, b, y]) = *error {
            assert!(r == g && g == b && (y / r - 1.0).abs() < 1e-6);
            least = least.min(f64::from(y) / truth);
            most = most.max(f64::from(y) / truth);
        }
        if x < 24 {
            let error = error.map_or(own.error[3], |e| f64::from(e[3]));
            squares += error * error;
            far += usize::from((own.mean[0] - truth).abs() > 3.0 * error);
        }
    }
    let half = PIXELS / 2.0;
    let whole = (squares / half / (source(0, 0).variance() / SAMPLES as f64)).sqrt();
    println!(
        "{least} to {most} of the missing light; all errors {whole}; {far} of {half} pixels too far off"
    );
    assert!(least > 0.5 && most < 1.6 && (0.9..1.15).contains(&whole) && far == 0);
}

/// A rare flash on a steady light stays with the pixel that has found it.
#[test]
fn pixels_with_light_keep_their_own_errors() {
    let source = |_, _| Source {
        base: 1.0,
        flash: 300.0,
        chance: 3e-4,
    };
    let mut film = simulated(source, 1);
    for y in 0..SIZE[1] {
        (0..SIZE[0]).for_each(|x| film.reach(x, y, Reach::Further));
    }
    assert_eq!(film.errors_of_unlit(), None);
}
