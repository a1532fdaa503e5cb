//! The modules of `shaders/`, and which of them a kernel is made of. A variant is another module with the same functions.

use super::access::Access;
use super::features::{Features, LightChoice};
use super::layout::ShapeKind;
use crate::scene::MaterialKind;

/// A file of `shaders/`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Module {
    /// Its path there, without the ending.
    pub name: &'static str,
    /// What is in it.
    pub text: &'static str,
}

macro_rules! modules {
    ($($constant:ident = $name:literal,)*) => {
        $(pub(super) const $constant: Module = Module {
            name: $name,
            text: include_str!(concat!("../../shaders/", $name, ".wgsl")),
        };)*
        /// Every one.
        #[cfg(test)]
        pub(crate) const ALL: &[Module] = &[$($constant),*];
    };
}

modules! {
    RAY = "ray",
    FRAME = "frame",
    SAMPLER = "sampler",
    CAMERA = "camera",
    STRATA_ONE = "strata/one",
    STRATA_POWER_OF_TWO = "strata/power_of_two",
    STRATA_ANY = "strata/any",
    SURFACE = "shape/surface",
    DISK = "shape/disk",
    CYLINDER = "shape/cylinder",
    PLANE = "shape/plane",
    SPHERE = "shape/sphere",
    HUGE_SPHERE = "shape/huge_sphere",
    BUFFERS = "fetch/buffers",
    RECORDS = "fetch/records",
    WALK = "tree/walk",
    WALK_SPHERES = "tree/spheres",
    WALK_DISKS = "tree/disks",
    WALK_BOXES = "tree/boxes",
    INTERACTION = "interaction",
    COSINE = "bsdf/cosine",
    DIFFUSE = "bsdf/diffuse",
    MIRROR = "bsdf/mirror",
    DIELECTRIC = "bsdf/dielectric",
    PHONG = "bsdf/phong",
    DISK_LIGHT = "light/disk",
    LIGHT_WEIGHT = "light/weight",
    RECEIVER_MATT = "light/receiver_matt",
    RECEIVER_GLOSSY = "light/receiver_glossy",
    CHOSEN = "light/chosen",
    CHOOSE_FROM_BUFFER = "light/choose_from_buffer",
    CHOOSE_BY_TREE = "light/choose_by_tree",
    PROBABILITY_ONE = "light/probability_one",
    PROBABILITY_BY_WEIGHT = "light/probability_by_weight",
    HIDDEN = "light/hidden",
    MIRROR_BALL = "image/mirror_ball",
    PATH = "path",
    FILM = "film",
    SCATTER = "scatter",
    EMISSION = "light/emission",
    DIRECT_NONE = "direct/none",
    DIRECT_SAMPLED = "direct/sampled",
    DIRECT_ONE = "direct/one_sample",
    DIRECT_SEVERAL = "direct/several_samples",
    GLANCE_NONE = "glance/none",
    GLANCE_SENT = "glance/sent",
    TRIPS_UNLIMITED = "trips/unlimited",
    TRIPS_COUNTED = "trips/counted",
    CONTROL_STRAIGHT = "control/straight",
    CONTROL_BRANCHING = "control/branching",
    IMAGES_NONE = "image/none",
    IMAGES_SOUGHT = "image/sought",
}

/// How a material scatters.
fn of_material(kind: MaterialKind) -> Module {
    match kind {
        MaterialKind::Diffuse => DIFFUSE,
        MaterialKind::Mirror => MIRROR,
        MaterialKind::Dielectric => DIELECTRIC,
        MaterialKind::Phong => PHONG,
    }
}

/// The path loop, and what belongs to it alone.
pub(super) fn of_path(f: &Features) -> Vec<Module> {
    let mut modules = vec![
        PATH,
        SCATTER,
        EMISSION,
        FILM,
        if f.sight > 0 {
            GLANCE_SENT
        } else {
            GLANCE_NONE
        },
        if f.images { IMAGES_SOUGHT } else { IMAGES_NONE },
    ];
    modules.extend(match (f.light_sampling, f.shadow_rays) {
        (false, _) => vec![DIRECT_NONE],
        (true, 1) => vec![DIRECT_SAMPLED, DIRECT_ONE],
        (true, _) => vec![DIRECT_SAMPLED, DIRECT_SEVERAL],
    });
    modules.extend(match f.access {
        Access::Baked => [TRIPS_UNLIMITED, CONTROL_STRAIGHT],
        Access::Buffers => [TRIPS_UNLIMITED, CONTROL_BRANCHING],
        Access::Tree => [TRIPS_COUNTED, CONTROL_BRANCHING],
    });
    modules
}

/// All that the path loop calls, and probes call without one. Templates of walks are not among it.
pub(super) fn of_scene(f: &Features) -> Vec<Module> {
    let strata = match f.strata {
        1 => STRATA_ONE,
        n if n.is_power_of_two() => STRATA_POWER_OF_TWO,
        _ => STRATA_ANY,
    };
    let glossy = f.glossy();
    let mut modules = vec![
        RAY,
        FRAME,
        SAMPLER,
        strata,
        CAMERA,
        INTERACTION,
        SURFACE,
        DISK,
    ];
    let shapes = [
        (ShapeKind::Cylinder, CYLINDER),
        (ShapeKind::Plane, PLANE),
        (ShapeKind::Sphere, SPHERE),
        (ShapeKind::HugeSphere, HUGE_SPHERE),
    ];
    modules.extend(
        shapes
            .iter()
            .filter(|(kind, _)| f.has_shape(*kind))
            .map(|s| s.1),
    );
    if f.scatters() {
        modules.push(COSINE);
    }
    modules.extend(f.materials().map(of_material));
    modules.push(DISK_LIGHT);
    modules.push(if glossy {
        RECEIVER_GLOSSY
    } else {
        RECEIVER_MATT
    });
    if f.light_sampling {
        modules.push(CHOSEN);
        modules.extend(match f.choice {
            LightChoice::Only if f.images => vec![LIGHT_WEIGHT, PROBABILITY_ONE],
            LightChoice::Only => vec![PROBABILITY_ONE],
            LightChoice::Unrolled => vec![LIGHT_WEIGHT, PROBABILITY_BY_WEIGHT],
            LightChoice::Loop => vec![LIGHT_WEIGHT, PROBABILITY_BY_WEIGHT, CHOOSE_FROM_BUFFER],
            LightChoice::Tree => vec![LIGHT_WEIGHT, CHOOSE_BY_TREE],
        });
        if f.hidden_lights {
            modules.push(HIDDEN);
        }
    }
    if f.images {
        modules.push(MIRROR_BALL);
    }
    match f.access {
        Access::Baked => {}
        Access::Buffers => modules.push(BUFFERS),
        Access::Tree => modules.extend([RECORDS, WALK]),
    }
    modules
}
