// Flat disks, two-sided. A ray does not meet the face that it stands on, and a shadow ray does not meet the face that it aims at.
// Coincident faces share an identity, so neither meets anything else in that plane.

struct Disk {
    center: vec3f,
    radius: f32,
    normal: vec3f,
    offset: f32,
}

fn disk_hit(hit: Hit, ray: Ray, disk: Disk, face: u32, key: u32) -> Hit {
    let cos = dot(disk.normal, ray.d);
    let t = (disk.offset - dot(disk.normal, ray.o)) * safe_inverse(cos);
    let v = ray.o + t * ray.d - disk.center;
    let met = cos != 0.0 && t > 0.0 && dot(v, v) <= disk.radius * disk.radius;
    return nearer(hit, met && ray.face != face && ray.target_face != face, t, key);
}
