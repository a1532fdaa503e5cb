// The BSDF where some surface has smooth normals: nothing is scattered to the wrong side of the surface.

fn evaluate_bsdf(x: ptr<function, Interaction>, wi: vec3f) -> BsdfValue {
    var value = evaluate_material(x, wi);
    value.f_cos = select(vec3f(0.0), value.f_cos, dot(x.geometric, wi) > 0.0);
    return value;
}
