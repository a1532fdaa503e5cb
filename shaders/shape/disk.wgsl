// Flat disks, two-sided. Neither the face that a ray stands on nor the one that a shadow ray aims at is met,
// nor anything else in that plane.

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
