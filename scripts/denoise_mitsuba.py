"""Our denoised pictures beside Mitsuba's, denoised by Open Image Denoise with Mitsuba's own albedo and normals, in equal CPU time.

    denoise_mitsuba.py PROGRAM FOLDER [SCENE...]

Needs the packages mitsuba, numpy and pyoidn. Times are user and system seconds of rendering and denoising; what either program needs to
start and to compile is in neither. References are kept in FOLDER. Prints rows of a table; each error is that of the whole picture, and
that without lamps that are seen directly and their edges.
"""

import pathlib
import resource
import subprocess
import sys

import mitsuba as mi
import numpy as np
import pyoidn

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE, REFERENCE = "192x144", 8192
SAMPLES = [16, 64, 256]  # ours
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
AOV = '<integrator type="aov"><string name="aovs" value="albedo:albedo,normal:sh_normal"/><integrator type="path" name="path">'


def seconds(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def ours(*command):
    """Runs our program; the seconds that it took."""
    begun = seconds(resource.RUSAGE_CHILDREN)
    subprocess.run(list(map(str, command)), check=True, stderr=subprocess.DEVNULL)
    return seconds(resource.RUSAGE_CHILDREN) - begun


def channel(path, name):
    picture = mi.Bitmap(str(path))
    names = [field.name for field in picture.struct_()]
    return np.array(picture).astype(float)[..., names.index(name)]


def luminance(path, layer=""):
    """A layer's luminance."""
    return sum(k * channel(path, layer + c) for k, c in zip(LUMINANCE, "RGB"))


def near(mask):
    """The pixels of a mask, and their neighbours."""
    wide = np.pad(mask, 1)
    height, width = mask.shape
    return np.any([wide[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)


class Theirs:
    """Mitsuba's picture of a scene."""

    def __init__(self, program, scene, folder):
        xml = folder / f"{scene.stem}.xml"
        subprocess.run([program, "export", scene, "--to", "mitsuba", "--size", SIZE, "-q", "-o", xml], check=True)
        text = xml.read_text().replace('<integrator type="path">', AOV).replace("</integrator>", "</integrator></integrator>", 1)
        self.scene = mi.load_string(text)
        self.render(16)  # compiles
        few, many = self.render(16)[1], self.render(272)[1]
        self.slope = (many - few) / 256

    def render(self, samples, seed=1):
        """All channels, and the seconds that they took."""
        begun = seconds(resource.RUSAGE_SELF)
        pixels = np.array(mi.render(self.scene, spp=samples, seed=seed))
        return pixels, seconds(resource.RUSAGE_SELF) - begun

    def denoised(self, samples):
        """The luminance of the picture and of the denoised one, and the seconds of denoising."""
        pixels = np.ascontiguousarray(self.render(samples)[0], dtype=np.float32)
        color, albedo, normal = (np.ascontiguousarray(pixels[..., k : k + 3]) for k in (0, 3, 6))
        begun = seconds(resource.RUSAGE_SELF)
        clean = pyoidn.denoise(color, albedo=np.clip(albedo, 0, 1), normal=np.clip(normal, -1, 1), hdr=True)
        taken = seconds(resource.RUSAGE_SELF) - begun
        return color @ LUMINANCE, np.asarray(clean) @ LUMINANCE, taken


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    scenes = sys.argv[3:] or ["diffuse", "three_materials", "caustic", "several_lights"]
    folder.mkdir(parents=True, exist_ok=True)
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    for name in scenes:
        scene = ROOT / "scenes" / f"{name}.toml"
        theirs = Theirs(program, scene, folder)
        reference, film, picture = (folder / f"{name}.{end}" for end in ["reference.exr", "npz", "exr"])
        common = [program, "render", scene, "--size", SIZE, "-q"]
        if not reference.exists():
            ours(*common, "--spp", REFERENCE, "--seed", 77, "-o", reference)
        truth, doubt = luminance(reference), channel(reference, "error.Y") ** 2

        def wrong(picture):
            square = (picture - truth) ** 2 - doubt
            shares = [100 * np.sqrt(max(part.mean(), 0)) / truth.mean() for part in (square, square[~lamps])]
            return " / ".join(f"{share:.1f}" for share in shares)

        def film_of(samples):
            film.unlink(missing_ok=True)
            return ours(*common, "--spp", samples, "--film", film)

        film_of(16)  # compiles
        few, many = film_of(16), film_of(272)
        # Lamps are the last of the materials.
        ours(program, "develop", film, "-q", "-o", picture, "--layers", "material")
        material = channel(picture, "material.I")
        lamps = near(material == material.max())
        for samples in SAMPLES:
            film_of(samples)
            plain = ours(program, "develop", film, "-q", "-o", picture)
            denoising = ours(program, "develop", film, "-q", "-o", picture, "--denoise") - plain
            time = samples * (many - few) / 256 + denoising
            _, _, once = theirs.denoised(16)
            spp = max(round((time - once) / theirs.slope), 1)
            noisy, clean, _ = theirs.denoised(spp)
            shown = [luminance(picture), luminance(picture, "denoised."), noisy, clean]
            row = [name, f"{time:.1f}", samples, *map(wrong, shown[:2]), spp, *map(wrong, shown[2:])]
            print("| " + " | ".join(map(str, row)) + " |", flush=True)


if __name__ == "__main__":
    main()
