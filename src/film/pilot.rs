//! Distributes the samples of an adaptive picture over its tiles, based on pilots.
//!
//! The number of samples in a tile must not depend on the values of those samples, or the mean is biased: a tile whose
//! first samples happen to be dark appears to have little noise, gets no more samples, and stays dark. The same bias appears
//! if two halves of the samples decide each other's number and are then added in proportion to it. So the noise of each tile
//! is measured only with a *pilot*: samples with another seed that are in no sum of the film. Given the pilot, every count is
//! a fixed number. The mean of every pixel is then unbiased, and the spread of its replicates gives its error, as in other
//! films. Long runs take more pilots: their samples double while the picture's grow sixteenfold, and later counts use all of
//! them.
//!
//! The relative error is √ mean v/n over pixels, where v is a pixel's relative variance for one sample. For a given mean
//! of n it is smallest if n is proportional to √v, here with the mean v of a tile. A pilot measures v only roughly, and may
//! miss rare bright samples. So v is smoothed over neighbouring tiles, and a fraction [`DEFENCE`] of all samples is
//! distributed evenly.

use super::Film;
use super::coverage::Rect;
use crate::stats::luminance;
use serde::{Deserialize, Serialize};

/// Pixels per side of a tile, at least; a power of two.
const SIDE: u32 = 16;

/// Tiles of a picture, about, at most: those of large pictures are larger.
const TILES: u64 = 2048;

/// Fraction of the samples that is distributed evenly.
const DEFENCE: f64 = 0.25;

/// Pixels per side of a cell. Relative variances are divided by the mean luminance of the cell instead of the pixel. This
/// also damps outliers, since a bright sample raises its cell's mean too.
const CELL: u32 = 4;

/// The noise measured for an adaptive film.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pilot {
    /// Pixels per side of a tile.
    side: u32,
    /// The pixels that it is for, disjoint.
    regions: Vec<Rect>,
    /// Pilots made so far, one after the other.
    stages: Vec<Stage>,
}

/// One pilot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Samples per pixel.
    samples: u64,
    /// Mean relative variance for one sample over the pixels of each square of the grid, row by row.
    variance: Vec<f64>,
}

/// The grid that the tiles are cut by: squares that hold a picture part.
struct Grid {
    side: u32,
    x0: u32,
    y0: u32,
    columns: u32,
    rows: u32,
}

impl Grid {
    fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    fn index(&self, x: u32, y: u32) -> usize {
        let (column, row) = (x / self.side - self.x0, y / self.side - self.y0);
        row as usize * self.columns as usize + column as usize
    }
}

impl Pilot {
    /// For the pixels of `regions` (at least one), with no pilot yet.
    pub fn new(regions: &[Rect]) -> Self {
        let regions = Rect::disjoint(regions);
        let area: u64 = regions.iter().map(Rect::area).sum();
        let mut side = SIDE;
        while area / (u64::from(side) * u64::from(side)) > TILES {
            side *= 2;
        }
        Self {
            side,
            regions,
            stages: Vec::new(),
        }
    }

    /// The pixels that it is for, disjoint.
    pub fn regions(&self) -> &[Rect] {
        &self.regions
    }

    /// Whether it is for the same pixels.
    pub fn is_for(&self, regions: &[Rect]) -> bool {
        self.regions == Rect::disjoint(regions)
    }

    /// How many pilots there are.
    pub fn stages(&self) -> usize {
        self.stages.len()
    }

    /// The tiles: disjoint rectangles that hold the pixels of the regions.
    pub fn tiles(&self) -> Vec<Rect> {
        let mut tiles = Vec::new();
        for r in &self.regions {
            for y in r.y0 / self.side..=(r.y1 - 1) / self.side {
                for x in r.x0 / self.side..=(r.x1 - 1) / self.side {
                    let square = Rect {
                        x0: x * self.side,
                        y0: y * self.side,
                        x1: x.saturating_add(1).saturating_mul(self.side),
                        y1: y.saturating_add(1).saturating_mul(self.side),
                    };
                    tiles.extend(r.intersection(&square));
                }
            }
        }
        tiles
    }

    /// Checks values read from a file. The error names the invalid one.
    pub fn check(&self, bounds: Rect) -> Result<(), String> {
        let inside = |r: &Rect| r.area() > 0 && r.intersection(&bounds) == Some(*r);
        let area: u64 = self.regions.iter().map(Rect::area).sum();
        let disjoint: u64 = Rect::disjoint(&self.regions).iter().map(Rect::area).sum();
        if self.regions.is_empty() || !self.regions.iter().all(inside) || area != disjoint {
            return Err("its pilot's regions do not lie in the film".into());
        }
        if !self.side.is_power_of_two() || self.side < SIDE || self.side > 1 << 16 {
            return Err(format!("its pilot has tiles of {} pixels", self.side));
        }
        let squares = self.grid(self.side).len();
        let sound = |s: &Stage| {
            s.samples >= 2
                && s.variance.len() == squares
                && s.variance.iter().all(|v| v.is_finite() && *v >= 0.0)
        };
        if !self.stages.iter().all(sound) {
            return Err("its pilot's variances are damaged".into());
        }
        Ok(())
    }

    fn grid(&self, side: u32) -> Grid {
        let all = self.regions[1..]
            .iter()
            .fold(self.regions[0], |a, b| a.union(b));
        let (x0, y0) = (all.x0 / side, all.y0 / side);
        Grid {
            side,
            x0,
            y0,
            columns: (all.x1 - 1) / side - x0 + 1,
            rows: (all.y1 - 1) / side - y0 + 1,
        }
    }

    /// Readies the measurement of a pilot.
    pub fn measurement(&self) -> Measurement {
        let grid = self.grid(CELL);
        Measurement {
            cells: vec![[0.0; 4]; grid.len()],
            grid,
        }
    }

    /// Takes a pilot of `samples` samples of every pixel of the regions.
    pub fn add(&mut self, measured: &Measurement, samples: u64) {
        let grid = self.grid(self.side);
        let total = measured
            .cells
            .iter()
            .fold([0.0; 2], |t, c| [t[0] + c[1], t[1] + c[2]]);
        let floor = 0.1 * total[0] / total[1].max(1.0);
        let mut squares = vec![[0.0; 2]; grid.len()];
        let mut light_of = vec![0.0; grid.len()];
        let mut reached = vec![false; grid.len()];
        for (i, [variance, light, pixels, met]) in measured.cells.iter().enumerate() {
            let [x, y] = measured.grid.corner(i);
            light_of[grid.index(x, y)] += light;
            reached[grid.index(x, y)] |= *met > 0.0;
            let mean = light / pixels;
            let scale = mean * mean + floor * floor;
            // No pixels, or a black picture.
            if !(scale > 0.0 && scale.is_finite()) {
                continue;
            }
            let square = &mut squares[grid.index(x, y)];
            square[0] += variance / scale;
            square[1] += pixels;
        }
        let mean = |[sum, pixels]: [f64; 2]| {
            let v = sum / pixels;
            if v.is_finite() { v.max(0.0) } else { 0.0 }
        };
        let mut variance: Vec<f64> = squares.into_iter().map(mean).collect();
        // What a pilot has met but found no light on is as noisy as the rest, for all that is known.
        let unknown: Vec<bool> = (0..grid.len())
            .map(|i| reached[i] && light_of[i] == 0.0)
            .collect();
        let known = variance.iter().zip(&unknown).filter(|(_, u)| !**u);
        let (sum, count) = known.fold((0.0, 0.0), |t, (v, _)| (t.0 + v, t.1 + 1.0));
        for (v, _) in variance.iter_mut().zip(unknown).filter(|(_, u)| *u) {
            *v = sum / f64::max(count, 1.0);
        }
        self.stages.push(Stage { samples, variance });
    }

    /// How many samples each of [`tiles`](Self::tiles) should have, up to a factor, by the first `stages` pilots.
    fn weights(&self, tiles: &[Rect], stages: usize) -> Vec<f64> {
        let grid = self.grid(self.side);
        let stages = &self.stages[..stages.min(self.stages.len())];
        let samples: u64 = stages.iter().map(|s| s.samples).sum();
        let of_square = |i: usize| {
            let sum: f64 = stages
                .iter()
                .map(|s| s.variance[i] * s.samples as f64)
                .sum();
            sum / samples.max(1) as f64
        };
        let raw: Vec<f64> = (0..grid.len()).map(of_square).collect();
        let mut there = vec![false; grid.len()];
        for t in tiles {
            there[grid.index(t.x0, t.y0)] = true;
        }
        let smooth = |t: &Rect| {
            let (column, row) = (t.x0 / grid.side - grid.x0, t.y0 / grid.side - grid.y0);
            let (mut sum, mut all) = (0.0, 0.0);
            for y in row.saturating_sub(1)..=(row + 1).min(grid.rows - 1) {
                for x in column.saturating_sub(1)..=(column + 1).min(grid.columns - 1) {
                    let i = y as usize * grid.columns as usize + x as usize;
                    if there[i] {
                        let share = |a: u32, b: u32| if a == b { 2.0 } else { 1.0 };
                        let w = share(x, column) * share(y, row);
                        sum += w * raw[i];
                        all += w;
                    }
                }
            }
            sum / all
        };
        let deviation: Vec<f64> = tiles.iter().map(|t| smooth(t).sqrt()).collect();
        let pixels: f64 = tiles.iter().map(|t| t.area() as f64).sum();
        let weighted = deviation
            .iter()
            .zip(tiles)
            .map(|(d, t)| d * t.area() as f64);
        let mean = weighted.sum::<f64>() / pixels;
        let weight = |d: &f64| {
            if mean > 0.0 {
                DEFENCE + (1.0 - DEFENCE) * d / mean
            } else {
                1.0
            }
        };
        deviation.iter().map(weight).collect()
    }

    /// Adds samples to `have`, those of each tile, until their mean over all pixels is `mean`: where by the first `stages`
    /// pilots they do most. All are multiples of `step`, if those of `have` are.
    pub fn fill(
        &self,
        tiles: &[Rect],
        have: &[u64],
        mean: u64,
        stages: usize,
        step: u64,
    ) -> Vec<u64> {
        let weights = self.weights(tiles, stages);
        let areas: Vec<f64> = tiles.iter().map(|t| t.area() as f64).collect();
        let wanted = mean as f64 * areas.iter().sum::<f64>();
        let at = |level: f64, i: usize| (level * weights[i]).max(have[i] as f64);
        let total = |level: f64| -> f64 { (0..tiles.len()).map(|i| areas[i] * at(level, i)).sum() };
        // The level by bisection, between none and one at which all have enough.
        let (mut low, mut high) = (0.0, mean as f64 / DEFENCE);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if total(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        // Carry the rounding error over to the next tile.
        let mut owed = 0.0;
        let steps = step as f64;
        (0..tiles.len())
            .map(|i| {
                let exact = at(low, i);
                let rounded = ((exact + owed / areas[i]) / steps).round() * steps;
                let n = (rounded.max(0.0) as u64).max(have[i]).min(u32::MAX.into());
                owed += (exact - n as f64) * areas[i];
                n
            })
            .collect()
    }
}

impl Grid {
    /// The upper left pixel of a square.
    fn corner(&self, i: usize) -> [u32; 2] {
        let (row, column) = (i / self.columns as usize, i % self.columns as usize);
        [
            (self.x0 + column as u32) * self.side,
            (self.y0 + row as u32) * self.side,
        ]
    }
}

/// What a pilot finds.
pub struct Measurement {
    grid: Grid,
    /// Of every cell: sums of its pixels' variances and luminances, how many pixels, and in how many paths have met surfaces.
    cells: Vec<[f64; 4]>,
}

impl Measurement {
    /// Takes a part of the pilot: a film with `samples` >= 2 samples of every pixel.
    pub fn take(&mut self, film: &Film, samples: u64) {
        let n = samples as f64;
        for y in film.bounds.y0..film.bounds.y1 {
            for x in film.bounds.x0..film.bounds.x1 {
                let total = film.total(x, y);
                let of = |c: usize| -> f64 { total.iter().map(|s| s[c]).sum() };
                let light = luminance([of(0), of(1), of(2)]);
                let variance = (of(3) - light * light / n) / (n - 1.0);
                let cell = &mut self.cells[self.grid.index(x, y)];
                cell[0] += variance.max(0.0);
                cell[1] += light / n;
                cell[2] += 1.0;
                cell[3] += f64::from(film.has_reached(x, y));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{REPLICATES, Reach, Sums};

    /// A pilot of a picture of 64 x 32 pixels whose tiles from column 32 on have a hundred times the variance.
    fn pilot() -> Pilot {
        let whole = Rect::whole([64, 32]);
        let mut pilot = Pilot::new(&[whole]);
        let mut film = Film::new([64, 32], whole, 1);
        let pixel = |k: u32| -> [Sums<f64>; REPLICATES] {
            let spread = if k % 64 < 32 { 0.01 } else { 0.1 };
            let y = [1.0 - spread, 1.0 + spread, 1.0 - spread, 1.0 + spread];
            y.map(|y| [y, y, y, y * y])
        };
        film.put_samples(whole, 0..4, (0..64 * 32).map(pixel).collect());
        let mut measured = pilot.measurement();
        measured.take(&film, 4);
        pilot.add(&measured, 4);
        pilot
    }

    #[test]
    fn noisy_tiles_get_more_samples_and_the_mean_is_as_requested() {
        let pilot = pilot();
        let tiles = pilot.tiles();
        assert_eq!(tiles.len(), 8);
        let counts = pilot.fill(&tiles, &[32; 8], 160, 1, 16);
        assert!(counts.iter().all(|n| n % 16 == 0 && *n >= 32), "{counts:?}");
        assert_eq!(counts.iter().sum::<u64>(), 160 * 8);
        // By hand: variances as 1, 1, 100, 100, smoothed 1, 25.75, 75.25, 100, whose roots have the mean 6.2: weights of
        // 0.37, 0.86, 1.30, 1.46.
        assert!(counts[0] <= 80 && counts[3] >= 224, "{counts:?}");
        // The tiles of both rows are alike but for rounding.
        assert!(counts[0].abs_diff(counts[4]) <= 16, "{counts:?}");
        // What is there already stays.
        let more = pilot.fill(&tiles, &counts, 176, 1, 16);
        assert!(more.iter().zip(&counts).all(|(m, c)| m >= c), "{more:?}");
        assert_eq!(more.iter().sum::<u64>(), 176 * 8);
    }

    /// The right half meets surfaces, and has found no light; or nothing is there.
    #[test]
    fn tiles_without_light_do_not_starve_if_they_may_have_some() {
        let whole = Rect::whole([64, 32]);
        let pixel = |k: u32| -> [Sums<f64>; REPLICATES] {
            let y = if k % 64 < 32 {
                [0.9, 1.1, 0.9, 1.1]
            } else {
                [0.0; 4]
            };
            y.map(|y| [y, y, y, y * y])
        };
        for met in [true, false] {
            let mut pilot = Pilot::new(&[whole]);
            let mut film = Film::new([64, 32], whole, 1);
            film.put_samples(whole, 0..4, (0..64 * 32).map(pixel).collect());
            for y in 0..32 {
                (0..if met { 64 } else { 32 }).for_each(|x| film.reach(x, y, Reach::Further));
            }
            let mut measured = pilot.measurement();
            measured.take(&film, 4);
            pilot.add(&measured, 4);
            let counts = pilot.fill(&pilot.tiles(), &[32; 8], 160, 1, 16);
            assert_eq!(counts[3] >= 150, met, "{counts:?}");
        }
    }

    #[test]
    fn a_black_picture_is_sampled_evenly() {
        let whole = Rect::whole([40, 20]);
        let mut pilot = Pilot::new(&[whole]);
        let mut measured = pilot.measurement();
        measured.take(&Film::new([40, 20], whole, 2), 4);
        pilot.add(&measured, 4);
        let tiles = pilot.tiles();
        assert_eq!(tiles.iter().map(Rect::area).sum::<u64>(), 800);
        let counts = pilot.fill(&tiles, &vec![32; tiles.len()], 64, 1, 16);
        assert_eq!(counts, vec![64; tiles.len()]);
    }

    #[test]
    fn tiles_of_large_pictures_are_larger_and_regions_are_kept() {
        let tiles = Pilot::new(&[Rect::whole([3840, 2160])]).tiles();
        assert!((512..=2100).contains(&tiles.len()), "{}", tiles.len());
        let regions = [
            Rect {
                x0: 5,
                y0: 7,
                x1: 50,
                y1: 30,
            },
            Rect {
                x0: 40,
                y0: 20,
                x1: 70,
                y1: 33,
            },
        ];
        let pilot = Pilot::new(&regions);
        let tiles = pilot.tiles();
        for y in 0..40 {
            for x in 0..80 {
                let wanted = usize::from(regions.iter().any(|r| r.contains(x, y)));
                let found = tiles.iter().filter(|t| t.contains(x, y)).count();
                assert_eq!(found, wanted, "pixel {x}, {y}");
            }
        }
        assert!(pilot.is_for(&regions) && !pilot.is_for(&regions[..1]));
    }

    #[test]
    fn invalid_pilots_are_refused() {
        let good = pilot();
        let bounds = Rect::whole([64, 32]);
        assert_eq!(good.check(bounds), Ok(()));
        assert!(good.check(Rect::whole([63, 32])).is_err());
        let edits: [fn(&mut Pilot); 6] = [
            |p| p.side = 0,
            |p| p.side = 17,
            |p| p.regions.clear(),
            |p| p.regions.push(p.regions[0]),
            |p| p.stages[0].variance[3] = f64::NAN,
            |p| p.stages[0].variance.truncate(3),
        ];
        for (i, edit) in edits.into_iter().enumerate() {
            let mut bad = good.clone();
            edit(&mut bad);
            assert!(bad.check(bounds).is_err(), "edit {i}");
        }
    }
}
