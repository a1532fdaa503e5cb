//! The hard cases: scenes, rays and functions with known answers, run on an adapter or on the CPU reference.
//!
//! Every expected value is a closed form or a published number; none is computed by the code under test. Rows 1 to 43
//! are those of the project's table of hard cases; L1 and L2 test rays that leave and touch surfaces, L3 light paths, I1 to I3
//! implicit surfaces.

mod backend;
pub mod build;
mod contact;
mod depth;
mod furnace;
mod glass;
mod implicit;
mod intersection;
mod invariance;
mod leaks;
mod leaving;
mod lights;
mod measure;
mod phong;
mod rays;
mod samplers;
mod shadows;
mod tubes;

pub use backend::{Backend, Trouble};
pub use measure::{Mean, Measure, Tolerance};

/// A hard case.
#[derive(Clone, Copy)]
pub struct Case {
    /// Its row in the table.
    pub row: &'static str,
    /// A short name for it, an identifier.
    pub name: &'static str,
    /// The set-up, and why it is hard.
    pub what: &'static str,
    run: fn(&Backend) -> Result<Vec<Measure>, Trouble>,
}

impl Case {
    /// Runs the case. A case without measures would always pass, so it is an error.
    ///
    /// # Errors
    /// When the backend refuses a scene, fails, or is stopped.
    pub fn run(&self, backend: &Backend) -> Result<Vec<Measure>, Trouble> {
        let measures = (self.run)(backend)?;
        if measures.is_empty() {
            return Err(Trouble::Unable("nothing was measured".into()));
        }
        Ok(measures)
    }

    /// Row and name: `08_glass_sphere_in_dome`.
    pub fn id(&self) -> String {
        format!("{:0>2}_{}", self.row, self.name)
    }
}

/// All cases, in the order of the table.
pub fn cases() -> Vec<Case> {
    let groups = [
        invariance::CASES,
        intersection::CASES,
        tubes::CASES,
        furnace::CASES,
        glass::CASES,
        lights::CASES,
        shadows::CASES,
        leaks::CASES,
        depth::CASES,
        phong::CASES,
        samplers::CASES,
        implicit::CASES,
    ];
    let mut all: Vec<Case> = groups.into_iter().flatten().copied().collect();
    all.sort_by_key(|c| (c.row.parse().unwrap_or(u32::MAX), c.row));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_the_table_is_there_once() {
        let rows: Vec<&str> = cases().iter().map(|c| c.row).collect();
        let mut expected: Vec<String> = (1..=43).map(|n| n.to_string()).collect();
        expected.extend(["I1", "I2", "I3", "L1", "L2", "L3"].map(str::to_owned));
        assert_eq!(rows, expected);
    }
}
