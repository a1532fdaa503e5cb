//! WGSL that is generated for a scene: what meets its surfaces, chooses its lights, fetches its values, and dispatches over its
//! materials.

pub(super) mod fetch;
pub(super) mod lights;
pub(super) mod materials;
pub(super) mod surfaces;
