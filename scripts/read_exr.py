"""Compares what OpenImageIO, Blender and three.js read from EXR files with what was written: see scripts/other-readers."""

import functools
import importlib.util
import json
import pathlib
import subprocess
import sys
import tomllib

import numpy as np

HALF = 2.0**-11  # relative rounding of a half
# What our files hold: tolerance, and whether there are layers.
FILES = {"all": (0, True), "layers": (0, True), "rgb": (0, False), "rgb-half": (HALF, False)}
# --layers, with what each channel ends in.
LAYERS = {"albedo": "RGBA", "normal": "XYZ", "position": "XYZ", "depth": "Z", "id": "I", "material": "I"}


def truth(folder, name):
    """The picture's RGB (h, w, 3) from the film, and all its channels by name. Those of --layers are not in a film: OpenEXR itself reads
    them, and the scene says what they are."""
    with np.load(folder / f"{name}.npz") as film:
        head = json.loads(film["provenance"].item())
        (width, height), part = head["size"], head["bounds"]

        def whole(array):
            out = np.zeros((height, width, *array.shape[2:]))
            out[part["y0"] : part["y1"], part["x0"] : part["x1"]] = array
            return out

        mean, error, counts = (whole(film[key]) for key in ["mean", "error", "counts"])
    channels = dict(zip("RGB", np.moveaxis(mean, 2, 0))) | {"A": (counts > 0) * 1.0, "samples": counts}
    channels |= dict(zip(["error.R", "error.G", "error.B", "error.Y"], np.moveaxis(error, 2, 0)))
    if name == "layers":
        channels |= written(folder / f"{name}.exr")
    return mean, channels


@functools.cache
def written(path):
    """The channels of LAYERS, after a look at whether they are the scene's."""
    import OpenEXR

    file = OpenEXR.File(str(path), separate_channels=True)
    channels = {f"{layer}.{c}": file.channels()[f"{layer}.{c}"].pixels for layer, all in LAYERS.items() for c in all}
    names = json.loads(file.header()["material_names"])
    scene = tomllib.loads(pathlib.Path("scenes/three_materials.toml").read_text())
    if sorted(names) != sorted(["", "light", *scene["material"]]):
        sys.exit(f"{path}: the names of its materials are {names}, not the scene's")
    rows = slice(0, 30)  # what has samples
    for name, of in scene["material"].items():
        here = channels["material.I"][rows] == names.index(name)
        if here.any() and "reflectance" in of:
            found = np.median(np.stack([channels[f"albedo.{c}"][rows][here] for c in "RGB"]), axis=1)
            hold(f"{path.name}, albedo of {name}", found, np.array(of["reflectance"]), 1e-6)
    # Depth is along the view axis.
    eye, look_at = np.array(scene["camera"]["eye"]), np.array(scene["camera"]["look_at"])
    axis = (look_at - eye) / np.linalg.norm(look_at - eye)
    position = np.stack([channels[f"position.{c}"] for c in "XYZ"], axis=-1)
    seen = channels["albedo.A"] > 0
    hold(f"{path.name}, depth", channels["depth.Z"][seen], ((position - eye) @ axis)[seen], 1e-5)
    return channels


def hold(what, got, expected, tolerance):
    """Fails unless two arrays are equal, to a relative tolerance."""
    worst = np.abs(got - expected).max()
    if not (np.abs(got - expected) <= tolerance * np.abs(expected) + 1e-7 * (tolerance > 0)).all():
        sys.exit(f"{what}: differs from the film by up to {worst}")
    print(f"{what}: equal")


def openimageio(folder, name):
    import OpenImageIO

    file = OpenImageIO.ImageInput.open(str(folder / f"{name}.exr"))
    names = file.spec().channelnames
    pixels = file.read_image(format="float")
    tolerance, layers = FILES[name]
    _, channels = truth(folder, name)
    if sorted(names) != sorted(channels if layers else "RGB"):
        sys.exit(f"OpenImageIO: {name}.exr has the channels {names}")
    for i, channel in enumerate(names):
        hold(f"OpenImageIO, {name}.exr, {channel}", pixels[..., i], channels[channel], tolerance)
    for key in ["seed", "scene_hash", "samples"] + ["material_names"] * (name == "layers"):
        if file.spec().getattribute(key) is None:
            sys.exit(f"OpenImageIO: {name}.exr lacks the attribute {key}")
    if name == "layers":
        print("OpenImageIO, layers.exr, material_names:", json.loads(file.spec().getattribute("material_names")))


def blender(folder, name):
    """Layers are what its compositor's image node shows of a file; a file without them is an image."""
    import bpy

    tolerance, layers = FILES[name]
    rgb, channels = truth(folder, name)
    height, width, _ = rgb.shape

    def pixels(image):
        return np.array(image.pixels[:]).reshape(height, width, 4)[::-1]

    image = bpy.data.images.load(str(folder / f"{name}.exr"))
    if not layers:
        hold(f"Blender, {name}.exr", pixels(image)[..., :3], rgb, tolerance)
        return
    scene = bpy.context.scene
    scene.use_nodes = True
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.view_settings.view_transform = "Raw"
    nodes, links = scene.node_tree.nodes, scene.node_tree.links
    nodes.clear()
    node = nodes.new("CompositorNodeImage")
    node.image = image
    end = nodes.new("CompositorNodeComposite")
    shown = {out.name: out for out in node.outputs if out.enabled}
    expected = {"Combined": rgb, "samples": channels["samples"][..., None]}
    if name == "layers":
        expected |= {layer: np.stack([channels[f"{layer}.{c}"] for c in all[:3]], axis=-1) for layer, all in LAYERS.items()}
    for layer, expected in expected.items():
        if layer not in shown:
            sys.exit(f"Blender: {name}.exr has the layers {list(shown)}")
        links.clear()
        links.new(shown[layer], end.inputs["Image"])
        scene.render.filepath = str(folder / "blender.exr")
        bpy.ops.render.render(write_still=True)
        got = pixels(bpy.data.images.load(scene.render.filepath, check_existing=False))
        hold(f"Blender, {name}.exr, {layer}", got[..., :3], expected, tolerance)


THREE = """
import { EXRLoader } from 'three/examples/jsm/loaders/EXRLoader.js'
import { FloatType } from 'three'
import { readFileSync } from 'fs'
const loader = new EXRLoader().setDataType(FloatType)
const { width, height, data } = loader.parse(Uint8Array.from(readFileSync(process.argv[2])).buffer)
console.log(JSON.stringify({ width, height, data: Array.from(data) }))
"""


def three(readers, folder, name):
    script = readers / "read.mjs"
    script.write_text(THREE)
    done = subprocess.run(["node", script, folder / f"{name}.exr"], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"three.js: {name}.exr: {done.stderr}")
    told = json.loads(done.stdout)
    got = np.array(told["data"]).reshape(told["height"], told["width"], 4)[::-1]
    hold(f"three.js, {name}.exr", got[..., :3], truth(folder, name)[0], FILES[name][0])


def main(readers, folder):
    for name in FILES:
        if importlib.util.find_spec("OpenImageIO"):
            openimageio(folder, name)
        if importlib.util.find_spec("bpy"):
            blender(folder, name)
        if (readers / "node_modules/three").is_dir():
            three(readers, folder, name)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
