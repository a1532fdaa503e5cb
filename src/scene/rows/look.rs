//! What rows look like: one material for all, a name or a colour in each, a colour by species, or a number on a colour map.

use super::super::source::{quoted, suggestion};
use super::super::value::Finite;
use super::sheet::{Fault, Row};
use colorous::Gradient;
use glam::DVec3;
use std::collections::HashMap;

/// The colours of rows, each of which is a diffuse material.
pub(in crate::scene) struct Palette {
    /// Materials that there are without them.
    first: usize,
    pub(in crate::scene) colors: Vec<DVec3>,
    index: HashMap<[u64; 3], usize>,
}

impl Palette {
    pub(in crate::scene) fn new(first: usize) -> Self {
        Self {
            first,
            colors: Vec::new(),
            index: HashMap::new(),
        }
    }

    /// The number of the material of this reflectance.
    pub(super) fn material(&mut self, color: DVec3) -> usize {
        // Adding 0 turns -0 into 0.
        let key = color.to_array().map(|x| (x + 0.0).to_bits());
        *self.index.entry(key).or_insert_with(|| {
            self.colors.push(color);
            self.first + self.colors.len() - 1
        })
    }
}

/// What a species of atoms is drawn as.
#[derive(Debug, Clone)]
pub(in crate::scene) struct Species {
    pub(in crate::scene) radius: Option<f64>,
    pub(in crate::scene) look: Option<SpeciesLook>,
}

/// What the surface of a species is.
#[derive(Debug, Clone)]
pub(in crate::scene) enum SpeciesLook {
    Reflectance(DVec3),
    /// The name of a material.
    Material(String),
}

/// Species by name, with the materials that they have been given.
pub(super) struct Kinds<'s> {
    by_name: HashMap<&'s str, (Option<f64>, Option<usize>)>,
    names: Vec<&'s str>,
}

impl<'s> Kinds<'s> {
    /// `material` finds a material by name.
    pub(super) fn new(
        species: &'s [(String, Species)],
        material: impl Fn(&str) -> Result<usize, String>,
        palette: &mut Palette,
    ) -> Result<Self, String> {
        let mut by_name = HashMap::new();
        for (name, s) in species {
            let look = match &s.look {
                Some(SpeciesLook::Reflectance(color)) => Some(palette.material(*color)),
                Some(SpeciesLook::Material(named)) => Some(material(named)?),
                None => None,
            };
            by_name.insert(name.as_str(), (s.radius, look));
        }
        let names = species.iter().map(|(name, _)| name.as_str()).collect();
        Ok(Self { by_name, names })
    }

    /// Radius and material of the species that field `k` names.
    pub(super) fn of(&self, row: &Row, k: usize) -> Result<(Option<f64>, Option<usize>), Fault> {
        let name = row.field(k);
        let found = self.by_name.get(name).copied();
        found.ok_or_else(|| {
            let known = self.names.join(", ");
            let meant = suggestion(name, self.names.iter().copied());
            let name = quoted(name);
            (k, format!("species is {name}, which the table species does not have; it has {known}{meant}"))
        })
    }
}

/// A named colour map over the numbers of a column.
#[derive(Debug, Clone)]
pub(in crate::scene) struct ColorMap {
    pub(in crate::scene) column: String,
    pub(in crate::scene) map: Map,
    /// What has the first colour and what has the last; the least and greatest of the column if not given.
    pub(in crate::scene) low: Option<f64>,
    pub(in crate::scene) high: Option<f64>,
}

/// The names of maps, and their colours.
pub(in crate::scene) const MAPS: [(&str, Gradient); 12] = [
    ("viridis", colorous::VIRIDIS),
    ("plasma", colorous::PLASMA),
    ("inferno", colorous::INFERNO),
    ("magma", colorous::MAGMA),
    ("cividis", colorous::CIVIDIS),
    ("turbo", colorous::TURBO),
    ("greys", colorous::GREYS),
    ("blues", colorous::BLUES),
    ("reds", colorous::REDS),
    ("red-blue", colorous::RED_BLUE),
    ("red-yellow-blue", colorous::RED_YELLOW_BLUE),
    ("spectral", colorous::SPECTRAL),
];

/// One of [`MAPS`].
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Map(pub(in crate::scene) usize);

/// The colours of a map: as many as one can tell apart, and no more materials than that.
const STEPS: usize = 256;

impl ColorMap {
    /// The material of each number.
    pub(super) fn materials(&self, values: &[f64], palette: &mut Palette) -> Vec<usize> {
        let low = self
            .low
            .unwrap_or_else(|| values.iter().copied().fold(f64::INFINITY, f64::min));
        let high = self
            .high
            .unwrap_or_else(|| values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        let mut known = [None; STEPS];
        let place = |value: f64| {
            // In halves, for the whole may be beyond f64.
            let t = (value / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0);
            if t.is_nan() { 0.5 } else { t.clamp(0.0, 1.0) }
        };
        let of = |value: &f64| {
            let step = (place(*value) * (STEPS - 1) as f64).round() as usize;
            *known[step].get_or_insert_with(|| palette.material(self.map.color(step)))
        };
        values.iter().map(of).collect()
    }
}

impl Map {
    /// The reflectance of a step: linear, as the map is sRGB.
    fn color(self, step: usize) -> DVec3 {
        let color = MAPS[self.0].1.eval_rational(step, STEPS);
        let linear = |level: u8| {
            let v = f64::from(level) / 255.0;
            if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            }
        };
        DVec3::new(linear(color.r), linear(color.g), linear(color.b))
    }
}

/// The number in field `k`, or the length of the vector in several.
pub(super) fn magnitude(row: &Row, fields: std::ops::Range<usize>) -> Result<f64, Fault> {
    if fields.len() == 1 {
        return Ok(row.number::<Finite>(fields.start)?.0);
    }
    let mut length = 0f64;
    for k in fields {
        length = length.hypot(row.number::<Finite>(k)?.0);
    }
    Ok(length.min(f64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_begin_and_end_as_published() {
        let ends = |name: &str| {
            let k = MAPS.iter().position(|m| m.0 == name).unwrap();
            [0, STEPS - 1].map(|step| Map(k).color(step))
        };
        // #440154 and #fde725, by sRGB's formula.
        let [first, last] = ends("viridis");
        assert!(
            (first - DVec3::new(0.0578, 0.0003, 0.0887)).length() < 1e-3,
            "{first}"
        );
        assert!(
            (last - DVec3::new(0.9823, 0.7991, 0.0185)).length() < 1e-3,
            "{last}"
        );
    }

    #[test]
    fn numbers_are_spread_over_the_map() {
        let mut map = ColorMap {
            column: "q".into(),
            map: Map(0),
            low: None,
            high: None,
        };
        let mut palette = Palette::new(3);
        let found = map.materials(&[2.0, 4.0, 3.0, 2.0], &mut palette);
        assert_eq!(found, [3, 4, 5, 3]);
        (map.low, map.high) = (Some(3.0), Some(3.5));
        assert_eq!(map.materials(&[1.0, 9.0], &mut palette), [3, 4]);
        // Nothing to spread, and too much.
        map.low = None;
        map.high = None;
        assert_eq!(map.materials(&[7.0, 7.0], &mut palette), [5, 5]);
        assert_eq!(map.materials(&[-f64::MAX, f64::MAX], &mut palette), [3, 4]);
        assert_eq!(map.materials(&[], &mut palette), [0; 0]);
    }
}
