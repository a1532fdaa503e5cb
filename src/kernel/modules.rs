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
    STRATA_APART = "strata/apart",
    STRATA_TOGETHER = "strata/together",
    SURFACE = "shape/surface",
    DISK = "shape/disk",
    CYLINDER = "shape/cylinder",
    PLANE = "shape/plane",
    SPHERE = "shape/sphere",
    HUGE_SPHERE = "shape/huge_sphere",
    IMPLICIT_AFFINE = "implicit/affine",
    IMPLICIT_BOUNDS = "implicit/bounds",
    IMPLICIT_CELLS = "implicit/cells",
    IMPLICIT_GRID = "implicit/grid",
    IMPLICIT_SMOOTH = "implicit/smooth",
    IMPLICIT_SURFACE = "implicit/surface",
    BUFFERS = "fetch/buffers",
    RECORDS = "fetch/records",
    WALK = "tree/walk",
    QUEUED_WALKS = "tree/queued",
    VISIT = "tree/visit",
    DESCENT = "tree/descent",
    QUEUE = "tree/queue",
    LEAF_SPHERE = "tree/sphere",
    LEAF_DISK = "tree/disk",
    LEAF_CYLINDER = "tree/cylinder",
    INTERACTION = "interaction",
    ADJOINT = "bsdf/adjoint",
    COSINE = "bsdf/cosine",
    DIFFUSE = "bsdf/diffuse",
    MIRROR = "bsdf/mirror",
    DIELECTRIC = "bsdf/dielectric",
    PHONG = "bsdf/phong",
    SMOOTH = "bsdf/smooth",
    SMOOTH_EVALUATED = "bsdf/smooth_evaluated",
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
    PATH = "path",
    FILM = "film",
    SCATTER = "scatter",
    RAYS_ONE_BY_ONE = "rays/one_by_one",
    RAYS_LIT = "rays/lit",
    RAYS_QUEUED = "rays/queued",
    EMISSION = "light/emission",
    DIRECT_NONE = "direct/none",
    DIRECT_SAMPLED = "direct/sampled",
    DIRECT_ONE = "direct/one_sample",
    DIRECT_SEVERAL = "direct/several_samples",
    GLANCE_NONE = "glance/none",
    GLANCE_SENT = "glance/sent",
    TRIPS_UNLIMITED = "trips/unlimited",
    TRIPS_COUNTED = "trips/counted",
    TRIPS_LEFT = "trips/left",
    CONTROL_STRAIGHT = "control/straight",
    CONTROL_BRANCHING = "control/branching",
    VERTEX = "vertex",
    STORE_FINISHED = "store/finished",
    STORE_UNFINISHED = "store/unfinished",
    BULB_NONE = "bulb/none",
    BULB_WAYS = "bulb/ways",
    BULB_RAY = "bulb/ray",
    BULB_SAMPLED = "bulb/sampled",
    LIGHT_PATH_NONE = "light_path/none",
    LIGHT_PATH_WEIGHED = "light_path/weighed",
    LIGHT_PATH_AIMS = "light_path/aims",
    LIGHT_PATH_AIMS_IN_BUFFER = "light_path/aims_in_buffer",
    LIGHT_PATH_MATT = "light_path/matt",
    LIGHT_PATH_GLOSSY = "light_path/glossy",
    LIGHT_PATH_TRACE = "light_path/trace",
    LIGHT_PATH_IN_BULB = "light_path/in_bulb",
    LIGHT_PATH_IN_NO_BULB = "light_path/in_no_bulb",
    LIGHT_PATH_STRAIGHT = "light_path/straight",
    LIGHT_PATH_BRANCHING = "light_path/branching",
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
        if f.queued {
            RAYS_QUEUED
        } else {
            RAYS_ONE_BY_ONE
        },
        EMISSION,
        FILM,
        if f.sight > 0 {
            GLANCE_SENT
        } else {
            GLANCE_NONE
        },
        VERTEX,
    ];
    match &f.light_paths {
        None => modules.push(LIGHT_PATH_NONE),
        Some(paths) => {
            modules.extend([LIGHT_PATH_WEIGHED, LIGHT_PATH_AIMS, scattering(f)]);
            if !paths.in_text {
                modules.push(LIGHT_PATH_AIMS_IN_BUFFER);
            }
        }
    }
    modules.extend(if f.bulbs.is_empty() {
        vec![BULB_NONE]
    } else {
        vec![BULB_WAYS, BULB_RAY, BULB_SAMPLED]
    });
    modules.extend((f.direct && !f.queued).then_some(RAYS_LIT));
    modules.extend(match (f.direct, f.shadow_rays) {
        (false, _) => vec![DIRECT_NONE],
        (true, 1) => vec![DIRECT_SAMPLED, DIRECT_ONE],
        (true, _) => vec![DIRECT_SAMPLED, DIRECT_SEVERAL],
    });
    modules.extend(match f.access {
        _ if f.counts_trips() => [TRIPS_COUNTED, STORE_UNFINISHED, CONTROL_BRANCHING],
        Access::Baked => [TRIPS_UNLIMITED, STORE_FINISHED, CONTROL_STRAIGHT],
        _ => [TRIPS_UNLIMITED, STORE_FINISHED, CONTROL_BRANCHING],
    });
    modules
}

/// The loop of light paths, and what belongs to it alone.
pub(super) fn of_light_paths(f: &Features) -> Vec<Module> {
    let mut modules = vec![
        LIGHT_PATH_TRACE,
        LIGHT_PATH_AIMS,
        LIGHT_PATH_AIMS_IN_BUFFER,
        scattering(f),
        VERTEX,
    ];
    modules.extend(f.has_smooth_normals.then_some(ADJOINT));
    modules.extend(if f.bulbs.is_empty() {
        vec![LIGHT_PATH_IN_NO_BULB]
    } else {
        vec![BULB_WAYS, LIGHT_PATH_IN_BULB]
    });
    modules.extend(match f.access {
        _ if f.counts_trips() => [TRIPS_COUNTED, LIGHT_PATH_BRANCHING],
        Access::Baked => [TRIPS_UNLIMITED, LIGHT_PATH_STRAIGHT],
        _ => [TRIPS_UNLIMITED, LIGHT_PATH_BRANCHING],
    });
    modules
}

/// The densities of scattering that light paths are weighed by.
fn scattering(f: &Features) -> Module {
    if f.materials().any(|m| m.is_glossy()) {
        LIGHT_PATH_GLOSSY
    } else {
        LIGHT_PATH_MATT
    }
}

/// All that the path loop calls, and probes call without one. Templates of walks are not among it.
pub(super) fn of_scene(f: &Features) -> Vec<Module> {
    let strata = match f.strata {
        _ if f.draws_together => vec![STRATA_TOGETHER],
        1 => vec![STRATA_ONE, STRATA_APART],
        n if n.is_power_of_two() => vec![STRATA_POWER_OF_TWO, STRATA_APART],
        _ => vec![STRATA_ANY, STRATA_APART],
    };
    let glossy = f.glossy();
    let mut modules = vec![RAY, FRAME, SAMPLER];
    modules.extend(strata);
    modules.extend([CAMERA, INTERACTION, SURFACE, DISK]);
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
    if f.has_implicit() {
        modules.extend(f.has_formulas.then_some(IMPLICIT_AFFINE));
        modules.push(IMPLICIT_BOUNDS);
        modules.extend(f.has_volumes.then_some(IMPLICIT_CELLS));
        if f.access != Access::Tree {
            modules.push(TRIPS_LEFT);
        }
    }
    if f.scatters() {
        modules.push(COSINE);
    }
    modules.extend(f.materials().map(of_material));
    modules.extend(f.has_smooth_normals.then_some(SMOOTH));
    modules.extend((f.has_smooth_normals && f.evaluates).then_some(SMOOTH_EVALUATED));
    modules.push(DISK_LIGHT);
    modules.push(if glossy {
        RECEIVER_GLOSSY
    } else {
        RECEIVER_MATT
    });
    if f.direct {
        modules.push(CHOSEN);
        modules.extend(match f.choice {
            LightChoice::Only => vec![PROBABILITY_ONE],
            LightChoice::Unrolled => vec![LIGHT_WEIGHT, PROBABILITY_BY_WEIGHT],
            LightChoice::Loop => vec![LIGHT_WEIGHT, PROBABILITY_BY_WEIGHT, CHOOSE_FROM_BUFFER],
            LightChoice::Tree => vec![LIGHT_WEIGHT, CHOOSE_BY_TREE],
        });
        if f.hidden_lights {
            modules.push(HIDDEN);
        }
    }
    match f.access {
        Access::Baked => {}
        Access::Buffers => modules.push(BUFFERS),
        Access::Tree => {
            modules.extend([RECORDS, WALK]);
            modules.extend(f.queued.then_some(QUEUED_WALKS));
        }
    }
    modules
}
