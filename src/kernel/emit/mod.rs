//! WGSL that is generated for a scene: functions that intersect its surfaces, choose its lights, fetch its values, and dispatch over its
//! materials.

pub(super) mod fetch;
pub(super) mod grid;
pub(super) mod implicit;
pub(super) mod lights;
pub(super) mod materials;
pub(super) mod surfaces;
