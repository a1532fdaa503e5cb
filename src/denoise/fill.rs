//! Fills holes in a picture from around them.

use crate::stats::denoised::Rgb;
use std::collections::VecDeque;

/// Gives the pixels in `holes` values from outside inwards: each is the mean of those neighbours that had one before. A picture that is
/// nothing but holes stays as it is.
pub fn fill(picture: &mut Rgb, holes: &[bool], width: usize) {
    let height = picture.len() / width;
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(1)..width.min(x + 2);
        let rows = y.saturating_sub(1)..height.min(y + 2);
        rows.flat_map(move |v| columns.clone().map(move |u| v * width + u))
    };
    // How far a pixel is from what is known, in pixels.
    let mut distance: Vec<u32> = holes
        .iter()
        .map(|h| if *h { u32::MAX } else { 0 })
        .collect();
    let mut open: VecDeque<usize> = (0..holes.len())
        .filter(|&i| !holes[i] && around(i).any(|k| holes[k]))
        .collect();
    while let Some(i) = open.pop_front() {
        if distance[i] > 0 {
            let near = around(i).filter(|&k| distance[k] < distance[i]);
            let (mut sum, mut n) = ([0.0f32; 3], 0.0f32);
            for k in near {
                (0..3).for_each(|c| sum[c] += picture[k][c]);
                n += 1.0;
            }
            picture[i] = sum.map(|s| s / n);
        }
        for k in around(i) {
            if distance[k] == u32::MAX {
                distance[k] = distance[i] + 1;
                open.push_back(k);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_become_what_is_around_them() {
        let (width, height) = (9, 7);
        let mut picture: Rgb = (0..width * height).map(|_| [1.0, 2.0, 3.0]).collect();
        let hole = |i: usize| (2..7).contains(&(i % width)) && (1..6).contains(&(i / width));
        let holes: Vec<bool> = (0..picture.len()).map(hole).collect();
        (0..picture.len())
            .filter(|i| holes[*i])
            .for_each(|i| picture[i] = [1e9; 3]);
        let left: Vec<usize> = (0..picture.len()).filter(|i| i % width == 0).collect();
        left.iter().for_each(|i| picture[*i] = [0.0; 3]);
        fill(&mut picture, &holes, width);
        for (i, p) in picture.iter().enumerate() {
            assert!(left.contains(&i) || *p == [1.0, 2.0, 3.0], "{i}: {p:?}");
        }
        let all = picture.clone();
        fill(&mut picture, &vec![true; all.len()], width);
        assert_eq!(picture, all);
    }
}
