//! The film's own arithmetic.

use super::*;

#[test]
fn samples_before_counts_every_sample_once() {
    for round in [1, 4, 9] {
        for s in 0..100u64 {
            let expected: [u64; REPLICATES] = std::array::from_fn(|r| {
                (0..s)
                    .filter(|k| (k / round) % REPLICATES as u64 == r as u64)
                    .count() as u64
            });
            assert_eq!(
                std::array::from_fn(|r| samples_before(s, r as u64, round)),
                expected,
                "round {round}, s {s}"
            );
        }
    }
}

#[test]
fn stated_error_of_four_replicates_is_the_textbook_one() {
    let sums = [
        [1.0, 2.0, 3.0, 0.0],
        [2.0, 2.0, 3.0, 0.0],
        [3.0, 2.0, 3.0, 0.0],
        [4.0, 2.0, 3.0, 0.0],
    ];
    let e = estimate(&sums, &[1; 4]);
    assert_eq!(e.mean, [2.5, 2.0, 3.0]);
    // Sample variance 5/3 of four values, over four.
    assert!((e.error[0] - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
    assert_eq!(e.error[1], 0.0);
    assert_eq!(e.replicates, 4);
}

#[test]
fn with_one_replicate_the_error_is_the_second_moment() {
    let sums = [[1.0, 1.0, 1.0, 1.0], [0.0; 4], [0.0; 4], [0.0; 4]];
    let e = estimate(&sums, &[1, 0, 0, 0]);
    assert_eq!(e.replicates, 1);
    assert!((e.error[3] - 1.0).abs() < 1e-12 && (e.error[0] - 1.0).abs() < 1e-12);
}

#[test]
fn samples_left_out_are_in_no_count() {
    let rect = Rect::whole([2, 1]);
    let light = [
        [2.0, 2.0, 2.0, 4.0],
        [4.0, 4.0, 4.0, 16.0],
        [0.0; 4],
        [6.0, 6.0, 6.0, 36.0],
    ];
    let mut film = Film::new([2, 1], rect, 1);
    film.put_samples(rect, 0..4, vec![light; 2]);
    film.leave_out(1, 0, [0, 0, 1, 0]);
    let counts = [1; REPLICATES];
    let [whole, three] = [0, 1].map(|x| film.estimate(x, 0, &counts));
    assert_eq!(
        (whole.mean[0], whole.samples, whole.replicates),
        (3.0, 4, 4)
    );
    assert_eq!(
        (three.mean[0], three.samples, three.replicates),
        (4.0, 3, 3)
    );
    // Textbook: three values 2, 4, 6 of variance 4.
    assert!((three.error[3] - (4.0f64 / 3.0).sqrt()).abs() < 1e-12);
    assert_eq!(film.replicates(), (3, 4));
    // A pixel with nothing left has no light, and no error that anyone could know.
    film.leave_out(0, 0, [1; 4]);
    assert_eq!(film.estimate(0, 0, &counts), Estimate::default());
    assert_eq!(film.relative_error(), error::RelativeError::default());
}

#[test]
fn an_unfinished_block_survives_another() {
    let rect = Rect {
        x0: 0,
        y0: 0,
        x1: 1,
        y1: 1,
    };
    let mut film = Film::new([1, 1], rect, 2);
    film.put_block(rect, 0..10, |_, _| [[1.0f32; 4]; REPLICATES]);
    film.put_block(rect, BLOCK..2 * BLOCK, |_, _| [[2.0f32; 4]; REPLICATES]);
    assert_eq!(film.total(0, 0), [[3.0; 4]; REPLICATES]);
}

#[test]
fn a_cut_block_equals_a_whole_one() {
    let rect = Rect {
        x0: 0,
        y0: 0,
        x1: 2,
        y1: 1,
    };
    let mut whole = Film::new([2, 1], rect, 2);
    let mut cut = whole.clone();
    let done = [[0.3f32; 4]; REPLICATES];
    whole.put_block(rect, 0..BLOCK, |_, _| done);
    cut.put_block(rect, 0..10, |_, _| [[0.1f32; 4]; REPLICATES]);
    assert_eq!(cut.partial_at(1, 0), [[0.1f32; 4]; REPLICATES]);
    cut.put_block(rect, 10..BLOCK, |_, _| done);
    assert_eq!(whole.sums(), cut.sums());
    assert_eq!(whole.coverage, cut.coverage);
}
