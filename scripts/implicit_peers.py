"""Holds scenes with formulas against Mitsuba and POV-Ray; scripts/implicit-peers installs what it needs.

    implicit_peers.py PROGRAM FOLDER [SCENE...]

Prints two tables as Markdown. Mitsuba (llvm_ad_rgb, a new enough LLVM is needed) renders the same scene with the surface as a mesh of
marching cubes, or as a grid of signed distances. An efficiency is 1 / (relative error² x CPU seconds). The errors are those of one picture,
from the spread of eight. POV-Ray renders it with a floor, a wall and a small lamp: one eye ray and one shadow ray for each pixel, as ours with
`--light emitted,direct`. It asks for the largest gradient; how much of the surface it shows is counted with its default, and with enough.
"""

import math
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tomllib

import mitsuba as mi
import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = [256, 192]
# Pictures of each program, and samples per pixel of each.
PICTURES, SAMPLES = 8, 64
MESHES, GRIDS = [64, 128, 256], [128, 256]
LUMINANCE = [0.2126, 0.7152, 0.0722]
POV_SIZE = [1024, 768]
# The default, and more than the largest gradient of the two scenes.
POV_GRADIENTS = [1.1, 30]


def cpu():
    """Seconds that this process and those it has ended have used, of all cores."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def timed(work):
    begun = cpu()
    result = work()
    return result, cpu() - begun


def matt(text):
    """The scene with diffuse materials for Phong ones."""
    text = re.sub(r'^type( *)= "phong"', r'type\1= "diffuse"', text, flags=re.M)
    text = re.sub(r"^diffuse ", "reflectance ", text, flags=re.M)
    return re.sub(r"^(specular|exponent) .*\n", "", text, flags=re.M)


def formula(shape):
    """f - level of arrays of x, y and z."""
    names = {k: getattr(np, k) for k in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs")} | shape.get("parameters", {})
    text = re.sub(r"(?<=[\w)]) +(?=[\w(])", " * ", shape["f"].replace("^", "**"))
    return lambda x, y, z: eval(text, {}, names | {"x": x, "y": y, "z": z}) - shape.get("level", 0.0)


def placement(shape):
    """The 4 x 4 matrix from the formula's space to the scene's."""
    m = np.eye(4)
    if "rotation" in shape:
        x, y, z = np.array(shape["rotation"]["axis"], float) / np.linalg.norm(shape["rotation"]["axis"])
        t = math.radians(shape["rotation"]["angle"])
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        m[:3, :3] += math.sin(t) * k + (1 - math.cos(t)) * k @ k
    m[:3, :3] *= shape.get("scale", 1.0)
    m[:3, 3] = shape.get("center", [0, 0, 0])
    return m


def sampled(shape, n):
    """Values on n³ points around the bounds, above 0 outside of them; the first and the last point."""
    a, b = (np.array(shape["bounds"][k], float) for k in ("min", "max"))
    margin = 1.5 * (b - a).max() / (n - 4)
    low, high = a - margin, b + margin
    x, y, z = np.meshgrid(*(np.linspace(low[i], high[i], n) for i in range(3)), indexing="ij", sparse=True)
    outside = [np.maximum(a[i] - c, c - b[i]) for i, c in enumerate((x, y, z))]
    return np.maximum(formula(shape)(x, y, z), np.maximum.reduce(np.broadcast_arrays(*outside))), low, high


def as_mesh(shape, n, path, material):
    """The surface as triangles, in a PLY file; Mitsuba's element."""
    values, low, high = sampled(shape, n)
    vertices, triangles, _, _ = marching_cubes(values, 0.0, spacing=(high - low) / (n - 1))
    m = placement(shape)
    vertices = (vertices + low) @ m[:3, :3].T + m[:3, 3]
    rows = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    path.write_bytes("\n".join(head).encode() + vertices.astype("<f4").tobytes() + rows.tobytes())
    return f'<shape type="ply"><string name="filename" value="{path}"/><boolean name="face_normals" value="true"/>{material}</shape>'


def as_grid(shape, n, path, material):
    """The surface as signed distances; Mitsuba's elements. A grid can't be turned, but an instance of it can."""
    values, low, high = sampled(shape, n)
    step = (high - low) / (n - 1)
    # Near the surface, the value over its slope is the distance.
    slope = np.sqrt(sum(d * d for d in np.gradient(values, *step)))
    far = distance_transform_edt(values > 0, sampling=step) - distance_transform_edt(values <= 0, sampling=step)
    distance = np.where(np.abs(far) > 3 * step.max(), far, values / np.maximum(slope, 1e-6)).astype("<f4")
    mi.VolumeGrid(np.ascontiguousarray(distance.transpose(2, 1, 0))[..., None]).write(str(path))
    cube = np.diag([*(high - low), 1.0])
    cube[:3, 3] = low
    own, placed = (
        f'<transform name="to_world"><matrix value="{" ".join(map(str, m.flatten()))}"/></transform>' for m in (cube, placement(shape))
    )
    name = path.stem
    return (
        f'<shape type="shapegroup" id="{name}"><shape type="sdfgrid"><string name="filename" value="{path}"/>'
        f'<string name="normals" value="smooth"/>{own}{material}</shape></shape>'
        f'<shape type="instance"><ref id="{name}"/>{placed}</shape>'
    )


def relative_error(pictures):
    """That of one picture, the mean light of all, and its standard error."""
    y = np.array(pictures) @ LUMINANCE
    mean, variance = y.mean(0), y.var(0, ddof=1)
    error = math.sqrt((variance / (mean**2 + (0.1 * mean.mean()) ** 2)).mean())
    return error, y.mean(), y.mean((1, 2)).std(ddof=1) / math.sqrt(len(y))


def beside_mitsuba(program, name, folder):
    text = matt((ROOT / f"scenes/{name}.toml").read_text())
    shapes = tomllib.loads(text)["implicit"]
    scene, stand_in, xml = (folder / f"{name}{end}" for end in (".toml", ".balls.toml", ".xml"))
    scene.write_text(text)
    # What `export` refuses is a ball for it, whose radius is known again.
    shape = iter(enumerate(shapes))

    def ball(_):
        i, s = next(shape)
        return f'[[sphere]]\ncenter = {s["center"]}\nradius = 0.0{i + 1}125\nmaterial = "{s["material"]}"\n'

    stand_in.write_text(re.sub(r"\[\[implicit\]\].*?(?=\n\[|\Z)", ball, text, flags=re.S))
    size = "x".join(map(str, SIZE))
    subprocess.run([program, "export", stand_in, "--to", "mitsuba", "--size", size, "-q", "-o", xml], check=True)

    def ours(seed):
        picture = folder / "ours.exr"
        command = [program, "render", scene, "--size", size, "--spp", str(SAMPLES), "--seed", str(seed)]
        subprocess.run([*command, "--exr", "rgb", "-o", picture, "-q"], check=True)
        return np.array(mi.Bitmap(str(picture)).convert(mi.Bitmap.PixelFormat.RGB))

    pictures, seconds = zip(*(timed(lambda: ours(seed)) for seed in range(PICTURES)))
    own, light, of_light = relative_error(pictures)
    cost = own**2 * np.median(seconds)
    print(f"| {name} | etendue | {100 * own:.2f} % | {np.median(seconds):.2f} | 1 | |", flush=True)
    for kind, make, sizes in (("mesh", as_mesh, MESHES), ("distances", as_grid, GRIDS)):
        for n in sizes:
            given = xml.read_text()
            for i, s in enumerate(shapes):
                path = folder / f"{name}.{i}.{kind}.{n}{'.ply' if kind == 'mesh' else '.vol'}"
                element = make(s, n, path, f'<ref id="{s["material"]}"/>')
                place = rf'<shape type="sphere">\s*<point name="center"[^>]*/>\s*<float name="radius" value="0.0{i + 1}125"/>.*?</shape>'
                given, found = re.subn(place, lambda _: element, given, flags=re.S)
                assert found == 1, found
            world = mi.load_string(given, spp=SAMPLES)
            render = lambda seed: np.array(mi.render(world, seed=seed, spp=SAMPLES))
            # The first compiles.
            render(PICTURES)
            pictures, seconds = zip(*(timed(lambda: render(seed)) for seed in range(PICTURES)))
            error, theirs, of_theirs = relative_error(pictures)
            gain = error**2 * np.median(seconds) / cost
            change, doubt = 100 * (theirs / light - 1), 100 * math.hypot(of_light, of_theirs) / light
            print(
                f"| {name} | Mitsuba, {kind} {n}³ | {100 * error:.2f} % | {np.median(seconds):.2f} | {gain:.1f} "
                f"| {change:+.2f} ± {doubt:.2f} % |",
                flush=True,
            )


def beside_pov(program, name, folder):
    text = matt((ROOT / f"scenes/{name}.toml").read_text())
    full = tomllib.loads(text)
    camera, shape, light = full["camera"], full["implicit"][0], full["light"][0]
    width, height = POV_SIZE
    across = 2 * math.degrees(math.atan(math.tan(math.radians(camera["vfov"]) / 2) * width / height))
    vector = lambda v: "<" + ",".join(map(str, v)) + ">"
    f = re.sub(r"(?<=[\w)]) +(?=[\w(])", " * ", shape["f"])
    f = re.sub(r"\(([^()]*(?:\([^()]*\)[^()]*)*)\)\^2|(\w+)\^2", lambda m: f"pow({m[1] or m[2]},2)", f)
    f = re.sub(r"(\w+)\^2", r"pow(\1,2)", f)
    turn = ""
    if "rotation" in shape:
        m = placement(shape)[:3, :3]
        turn = "matrix <" + ",".join(map(str, [*m.T.flatten(), 0, 0, 0])) + ">"
    declared = " ".join(f"#declare {k}={v};" for k, v in shape.get("parameters", {}).items())
    head = (
        f"#version 3.7; global_settings {{ assumed_gamma 1 }} {declared} camera {{ location {vector(camera['eye'])} "
        f"right -x*{width / height} up y angle {across} look_at {vector(camera['look_at'])} }}\n"
    )

    def render(gradient, lit):
        finish = "finish { ambient 0 diffuse 0.8 }" if lit else "finish { ambient 1 diffuse 0 }"
        scene = head + (
            f"isosurface {{ function {{ {f} }} contained_by {{ box {{ {vector(shape['bounds']['min'])}, {vector(shape['bounds']['max'])} }} }} "
            f"accuracy 0.0001 max_gradient {gradient} pigment {{ color rgb 1 }} {finish} {turn} translate {vector(shape['center'])} }}\n"
        )
        if lit:
            scene += f"light_source {{ {vector(light['center'])} color rgb 1 }} "
            scene += f"plane {{ y,0 pigment {{ color rgb 0.7 }} {finish} }} plane {{ z,-3 pigment {{ color rgb 0.7 }} {finish} }}\n"
        file, picture = folder / "scene.pov", folder / f"{name}.{gradient}.png"
        file.write_text(scene)
        command = ["povray", f"+I{file}", f"+O{picture}", f"+W{width}", f"+H{height}", "-D", "-A"]
        _, seconds = timed(lambda: subprocess.run(command, check=True, capture_output=True))
        return (np.array(Image.open(picture).convert("L")) > 127).sum(), seconds

    surface = [render(gradient, False)[0] for gradient in POV_GRADIENTS]
    _, seconds = render(POV_GRADIENTS[-1], True)
    # The same floor, wall and surface for us; the difference of 9 samples and 1 has no compiling in it.
    ours = folder / f"{name}.pov.toml"
    kept = [b for b in re.split(r"\n(?=\[)", text) if re.match(r"title|\[camera|\[material|\[\[implicit|\[\[light", b)]
    planes = [([0, 0, 0], [0, 1, 0]), ([0, 0, -3], [0, 0, 1])]
    first = next(iter(full["material"]))
    kept += [f'[[plane]]\npoint = {p}\nnormal = {n}\nmaterial = "{first}"\n' for p, n in planes]
    ours.write_text("\n".join(kept))
    of = {}
    for samples in (1, 9):
        command = [program, "render", ours, "--size", f"{width}x{height}", "--light", "emitted,direct", "--spp", str(samples)]
        _, of[samples] = timed(lambda: subprocess.run([*command, "-o", folder / "ours.png", "-q"], check=True))
    own = (of[9] - of[1]) / 8
    print(f"| {name} | {100 * surface[0] / surface[-1]:.0f} % | {seconds:.1f} | {own:.2f} | {seconds / own:.0f} |", flush=True)


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    names = sys.argv[3:] or ["gyroid", "torus"]
    mi.set_variant("llvm_ad_rgb")
    print("| scene | program | relative error | CPU s | our efficiency over it | its light beside ours |\n|---|---|--:|--:|--:|--:|")
    for name in names:
        beside_mitsuba(program, name, folder)
    if not shutil.which("povray"):
        print("== POV-Ray: skipped, not available here")
        return
    print("\n| scene | surface that POV-Ray shows by default | CPU s, largest gradient given | etendue, CPU s | ratio |\n|---|--:|--:|--:|--:|")
    for name in names:
        beside_pov(program, name, folder)


main()
