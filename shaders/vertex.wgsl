// Where a path meets a surface.

fn interaction(ray: Ray, hit: Hit, way: u32) -> Interaction {
    let surface = surface_at(hit.key);
    let material = material_at(surface.material);
    let v = vertex_at(ray, hit, surface);
    // Glass knows the side, where a grazing cosine may round to either sign.
    let outside = select(dot(v.n, ray.d) < 0.0, ray.medium != surface.solid, is_dielectric(material));
    let n = select(-v.n, v.n, outside);
    let cos_o = abs(dot(v.n, ray.d));
    let face = face_at(hit.key, surface);
    return Interaction(
        v.p, n, -ray.d, cos_o, outside, face, hit.key >> 2u, material, ray.medium, surface.solid, surface.parent, way
    );
}
