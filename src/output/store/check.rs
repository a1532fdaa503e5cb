//! Checks what a film's file holds, whoever has written it.

use super::{
    BLOCK, Coverage, Header, LARGEST_STRATA, MAX_SIDE, REPLICATES, Rect, SplatHeader, Sums,
};
use std::ops::Range;

/// The picture position of the film's i-th pixel, for messages.
pub(super) fn pixel(bounds: Rect, i: usize) -> String {
    let (i, width) = (i as u64, u64::from(bounds.width()));
    let (x, y) = (i % width, i / width);
    format!(
        "({}, {})",
        u64::from(bounds.x0) + x,
        u64::from(bounds.y0) + y
    )
}

pub(super) fn check_pixel(
    array: &str,
    sums: &[Sums<f64>; REPLICATES],
    count: u64,
) -> Result<(), String> {
    let mut all = sums.iter().flatten();
    if let Some(x) = all.clone().find(|x| !x.is_finite()) {
        return Err(format!("\"{array}\" holds {x}, which is not finite"));
    }
    if let Some(s) = sums.iter().find(|s| s[3] < 0.0) {
        return Err(format!(
            "\"{array}\" holds {:?}, a negative sum of squares",
            s[3]
        ));
    }
    if count == 0 && all.any(|&x| x != 0.0) {
        return Err(format!("\"{array}\" holds light, but the count is 0"));
    }
    Ok(())
}

pub(super) fn check_header(header: &Header) -> Result<(), String> {
    let Header {
        size,
        bounds,
        strata,
        replicates,
        block,
        ref pilot,
        ref coverage,
        ref provenance,
        ref splats,
        ..
    } = *header;
    if size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
        let [w, h] = size;
        return Err(format!(
            "its size is {w}x{h}, but each side must have 1 to {MAX_SIDE} pixels"
        ));
    }
    if bounds.area() == 0 || bounds.intersection(&Rect::whole(size)) != Some(bounds) {
        return Err(format!(
            "its region {bounds} exceeds the picture of {}x{} pixels",
            size[0], size[1]
        ));
    }
    if (replicates, block) != (REPLICATES, BLOCK) {
        return Err(format!(
            "it has {replicates} replicates and blocks of {block} samples, not {REPLICATES} and {BLOCK}"
        ));
    }
    if (size, strata) != (provenance.settings.size, provenance.settings.strata)
        || !(1..=LARGEST_STRATA).contains(&strata)
    {
        return Err("its size and strata contradict its provenance".into());
    }
    if let Some(pilot) = pilot {
        pilot.check(bounds)?;
    }
    check_coverage(coverage, bounds)?;
    if let Some(SplatHeader { setup, coverage }) = splats {
        if setup.paths == 0 || !(setup.scale > 0.0 && setup.scale.is_finite()) {
            return Err(format!(
                "it has passes of {} light paths with a scale of {}, but both must be positive",
                setup.paths, setup.scale
            ));
        }
        check_coverage(coverage, bounds)?;
        // No pixel twice.
        counts(coverage, bounds)?;
    }
    Ok(())
}

pub(super) fn check_coverage(coverage: &Coverage, bounds: Rect) -> Result<(), String> {
    for (rect, ranges) in coverage.cells() {
        if rect.area() == 0 || rect.intersection(&bounds) != Some(rect) {
            return Err(format!(
                "its coverage {rect} exceeds the film's region {bounds}"
            ));
        }
        let ordered = ranges.windows(2).all(|r| r[0].end < r[1].start);
        let empty = ranges.iter().any(|r: &Range<u64>| r.start >= r.end);
        if ranges.is_empty() || empty || !ordered {
            return Err(format!(
                "its coverage of {rect} has the sample ranges {ranges:?}, which are not ascending and disjoint"
            ));
        }
    }
    Ok(())
}

/// Samples of every pixel of `bounds`, row by row. An error if a pixel is covered twice.
pub(super) fn counts(coverage: &Coverage, bounds: Rect) -> Result<Vec<u64>, String> {
    let width = bounds.width() as usize;
    let mut counts = vec![0; width * bounds.height() as usize];
    for (rect, ranges) in coverage.cells() {
        let samples: u64 = ranges.iter().map(|r| r.end - r.start).sum();
        for y in rect.y0..rect.y1 {
            let row = (y - bounds.y0) as usize * width;
            let columns =
                row + (rect.x0 - bounds.x0) as usize..row + (rect.x1 - bounds.x0) as usize;
            for count in &mut counts[columns] {
                if *count != 0 {
                    return Err(format!("its coverage {rect} overlaps another"));
                }
                *count = samples;
            }
        }
    }
    Ok(counts)
}

/// Takes the samples of `left_out`, rows of x, y, and samples of each replicate, out of `counts`. An error if they do not
/// lie in `bounds`, row by row, or are more than there are.
pub(super) fn subtract(
    counts: &mut [u64],
    bounds: Rect,
    left_out: &[[u64; 2 + REPLICATES]],
) -> Result<(), String> {
    let mut last = None;
    for &[x, y, ref samples @ ..] in left_out {
        let inside = u32::try_from(x)
            .ok()
            .zip(u32::try_from(y).ok())
            .filter(|&(x, y)| bounds.contains(x, y) && Some((y, x)) > last);
        let sum = samples.iter().try_fold(0u64, |sum, &n| sum.checked_add(n));
        let (Some((x, y)), Some(sum)) = (inside, sum) else {
            return Err(format!(
                "\"left_out\" lists pixel ({x}, {y}) out of order, or with too many samples"
            ));
        };
        last = Some((y, x));
        let width = bounds.width() as usize;
        let i = (y - bounds.y0) as usize * width + (x - bounds.x0) as usize;
        counts[i] = counts[i].checked_sub(sum).ok_or(format!(
            "pixel ({x}, {y}) leaves out more samples than it has"
        ))?;
    }
    Ok(())
}
