//! The text of an export as it grows, and what it can't say.

use super::planes::{Cut, Rectangle, cut};
use super::{Exported, NOT_ONE, PHONG, about, is_nothing, is_phong};
use crate::scene::{Bsdf, Scene};
use glam::DVec3;
use std::fmt::Write as _;

/// Which materials differ, and how.
type Difference = (fn(&Bsdf) -> bool, &'static str);

/// Indented lines, and warnings.
#[derive(Default)]
pub(super) struct Text {
    text: String,
    /// How deep the next line stands.
    pub(super) depth: usize,
    warnings: Vec<String>,
}

impl Text {
    /// No line yet, and a warning for all materials that `differ`, each with what differs, and of those that no other renderer has.
    pub(super) fn new(scene: &Scene, differ: &[Difference]) -> Self {
        let always: [Difference; 2] = [(is_phong, PHONG), (is_nothing, NOT_ONE)];
        let all = differ.iter().chain(&always);
        Self {
            warnings: all
                .filter_map(|(of, what)| about(scene, of, what))
                .collect(),
            ..Self::default()
        }
    }

    pub(super) fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{:1$}{line}", "", 4 * self.depth);
    }

    pub(super) fn gap(&mut self) {
        self.text.push('\n');
    }

    /// What is seen of a plane, the scene's surface `index`; `None` if it is behind others. Warns if it has no end.
    pub(super) fn seen(
        &mut self,
        scene: &Scene,
        index: usize,
        [point, normal]: [DVec3; 2],
        material: &str,
    ) -> Option<Rectangle> {
        match cut(scene, index, point, normal) {
            Cut::Hidden => None,
            Cut::Rectangle(rectangle) => Some(rectangle),
            Cut::Horizon(rectangle) => {
                let [a, b] = rectangle.half.map(|h| 2.0 * h);
                self.warnings.push(format!(
                    "a plane of {material} has no end; the export has a rectangle of {a:.6} x {b:.6} of it"
                ));
                Some(rectangle)
            }
        }
    }

    pub(super) fn end(self) -> Exported {
        Exported {
            text: self.text,
            warnings: self.warnings,
        }
    }
}
