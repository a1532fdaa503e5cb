// Where a path meets a surface.

fn interaction(ray: Ray, hit: Hit, way: u32) -> Interaction {
    let surface = surface_at(hit.key);
    let material = material_at(surface.material);
    let v = vertex_at(ray, hit, surface);
    // Glass knows the side, where a grazing cosine may round to either sign.
    let outside = select(dot(v.n, ray.d) < 0.0, ray.medium != surface.solid, is_dielectric(material));
    let face = face_at(hit.key, surface);
#if SMOOTH
    let geometric = select(-v.n, v.n, outside);
    let outward = implicit_shading(hit.key, v.p, v.n);
    let shading = select(-outward, outward, outside);
    let n = select(shading, -shading, is_specular(material) & (dot(shading, ray.d) > 0.0));
    let cos_o = fmax(-dot(n, ray.d), 0.0);
    return Interaction(
        v.p, n, geometric, -ray.d, cos_o, outside, face, hit.key >> 2u, material, ray.medium, surface.solid, surface.parent, way
    );
#else
    let n = select(-v.n, v.n, outside);
    let cos_o = abs(dot(v.n, ray.d));
    return Interaction(
        v.p, n, -ray.d, cos_o, outside, face, hit.key >> 2u, material, ray.medium, surface.solid, surface.parent, way
    );
#endif
}
