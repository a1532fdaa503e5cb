//! Tests whether a picture's estimated error is reliable.

use super::{Film, REPLICATES, replicate_counts};
use crate::stats::luminance;
use crate::stats::tail::{Tail, tail};

impl Film {
    /// The tail of the picture's relative second moments: of each replicate of each pixel the mean square of its samples'
    /// luminance, over Y² + (0.1 Ȳ)² as in [`Film::relative_error`], where Y is the mean of the other replicates. The stated
    /// error is computed from means of such numbers, so it is reliable only if these means are.
    ///
    /// Y excludes the replicate itself, whose own mean would hide its outliers. `None` while some pixel has fewer than two
    /// replicates, if there are too few pixels, and for a black picture.
    ///
    /// Measured on 60 pictures (four scenes, three seeds, 16 to 4096 samples): in 28 the true error was at least 20 % above the
    /// stated one, and the test called all of them unsafe. In 21 it was less than 10 % above, and the test called 4 of them
    /// unsafe. It can't detect paths so rare that few replicates have one. While the stated error falls more slowly than the
    /// square root of the samples, it can be too small by up to 20 % and still be called safe.
    pub fn heavy_tail(&self) -> Option<Tail> {
        let floor = (0.1 * self.mean_luminance()).powi(2);
        if !(floor > 0.0 && floor.is_finite()) {
            return None;
        }
        let mut moments = Vec::new();
        for (rect, ranges) in self.coverage.cells() {
            let given = replicate_counts(ranges, self.strata);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    let sums = self.total(x, y);
                    let counts = self.left_out.remaining(x, y, &given);
                    if counts.iter().filter(|&&n| n > 0).count() < 2 {
                        return None;
                    }
                    for r in (0..REPLICATES).filter(|&r| counts[r] > 0) {
                        let others = (0..REPLICATES).filter(|&o| o != r);
                        let samples: u64 = others.clone().map(|o| counts[o]).sum();
                        let sum: f64 = others
                            .map(|o| luminance([sums[o][0], sums[o][1], sums[o][2]]))
                            .sum();
                        let mean = sum / samples as f64;
                        let square = sums[r][3] / counts[r] as f64;
                        moments.push(square / (mean * mean + floor));
                    }
                }
            }
        }
        tail(&mut moments)
    }
}
