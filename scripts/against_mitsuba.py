"""Holds our pictures against Mitsuba's; scripts/against-mitsuba installs what it needs.

    against_mitsuba.py PROGRAM FOLDER                     every scene of scenes/ without Phong and formulas, exported, rendered, compared
    against_mitsuba.py PROGRAM FOLDER --false-alarms N    N pairs of Mitsuba's own pictures of three scenes: how often they differ
    against_mitsuba.py PROGRAM FOLDER --z-test N          N pictures of darker walls: what the test passes that Mitsuba's own renders are
                                                          held against their references with, and what `etendue compare` passes
    ... --moments                                         the same with one render of a side, which states its variance

Without --moments every side has independent renders, whose spread is its noise. Exit status 1 if a scene differs.
"""

import argparse
import json
import math
import pathlib
import re
import subprocess
import sys

import mitsuba as mi
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = "64x48"
ALPHA = 0.001
# Renders of each side, and samples per pixel of each.
RENDERS, SAMPLES = 8, 64
# Of each side of a pair.
PAIR_RENDERS, PAIR_SAMPLES = 4, 16
# Samples per pixel with --moments.
MOMENT_SAMPLES = 64
# Samples of a picture in Mitsuba's own test, and per pixel of the reference, of which it has 32 000.
Z_BUDGET, Z_REFERENCE = 2_000_000, 4096
PAIR_SCENES = ["diffuse", "three_materials", "caustic"]


def export(program, scene, folder):
    """The scene in Mitsuba's format."""
    xml = folder / f"{scene.stem}.xml"
    subprocess.run([program, "export", scene, "--to", "mitsuba", "--size", SIZE, "-q", "-o", xml], check=True)
    return xml


def render(xml, seed, samples, out):
    """One picture of Mitsuba's."""
    mi.Bitmap(mi.render(mi.load_file(str(xml), spp=samples), seed=seed)).write(str(out))
    return out


def render_moments(xml, seed, samples, out):
    """One picture of its integrator `moment` around the scene's own."""
    scene = xml.read_text().replace('<integrator type="path">', '<integrator type="moment"><integrator type="path" name="path">')
    scene = mi.load_string(scene.replace("</integrator>", "</integrator></integrator>"), spp=samples)
    mi.render(scene, seed=seed)
    scene.sensors()[0].film().bitmap().write(str(out))
    return out


def compare(program, a, b, *flags):
    """The report of `etendue compare` as a dict."""
    command = [program, "compare", "--a", *a, "--b", *b, "--alpha", str(ALPHA), "--report", "-", *flags]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def against_ours(program, folder, moments):
    """Compares every scene without Phong and formulas."""
    differ = 0
    for scene in sorted((ROOT / "scenes").glob("*.toml")):
        text = scene.read_text()
        if '"phong"' in text or "[[implicit]]" in text or "[[isosurface]]" in text:
            print(f"{scene.stem}: left out, for Mitsuba has no Phong lobes and no formulas")
            continue
        film = folder / f"{scene.stem}.npz"
        film.unlink(missing_ok=True)
        picture = folder / f"{scene.stem}.png"
        # Mitsuba finds caustics by chance alone. Where ours finds them in the same way, both have noise of one kind.
        flags = ["--size", SIZE, "--spp", "1024", "--light-paths", "off"]
        command = [program, "render", scene, *flags, "--film", film, "-o", picture, "-q"]
        subprocess.run(command, check=True)
        xml = export(program, scene, folder)
        if moments:
            samples = RENDERS * SAMPLES
            theirs = [render_moments(xml, 0, samples, folder / f"{scene.stem}.moments.exr")]
            report = compare(program, [film], theirs, "--spp-b", str(samples))
        else:
            theirs = [render(xml, seed, SAMPLES, folder / f"{scene.stem}.{seed}.exr") for seed in range(RENDERS)]
            report = compare(program, [film], theirs)
        print(f"{scene.stem}: {report['sentence']}\n{report['table']}", end="", flush=True)
        differ += not report["same"]
    return 1 if differ else 0


def false_alarms(program, folder, pairs, moments):
    """Compares pictures of one scene by one program."""
    for name in PAIR_SCENES:
        xml = export(program, ROOT / f"scenes/{name}.toml", folder)
        p = []
        for pair in range(pairs):
            if moments:
                files = [render_moments(xml, 2 * pair + k, MOMENT_SAMPLES, folder / f"moments.{k}.exr") for k in range(2)]
                flags = [f"--spp-{side}={MOMENT_SAMPLES}" for side in "ab"]
                p.append(compare(program, files[:1], files[1:], *flags)["verdict"]["p"])
                continue
            first = 2 * PAIR_RENDERS * pair
            files = [
                render(xml, first + k, PAIR_SAMPLES, folder / f"pair.{k}.exr") for k in range(2 * PAIR_RENDERS)
            ]
            p.append(compare(program, files[:PAIR_RENDERS], files[PAIR_RENDERS:])["verdict"]["p"])
        counts = ", ".join(f"{sum(q < alpha for q in p)} below {alpha}" for alpha in (0.001, 0.01, 0.05, 0.1))
        print(f"{name}: of {pairs} probabilities {counts}; the least is {min(p):.2g}", flush=True)
    return 0


def channels(path, layer):
    """X, Y and Z of a layer of an EXR file."""
    picture = mi.Bitmap(str(path))
    names = [field.name for field in picture.struct_()]
    return np.array(picture).astype(float)[..., [names.index(f"{layer}.{c}") for c in "XYZ"]]


def passes_z_test(picture, samples, reference):
    """The verdict of Mitsuba's own regression test (src/render/tests/test_renders.py): each channel of each pixel by a z-test that takes
    the reference for noiseless, with the reference's variance of a sample; 99.75 % of them must pass at 0.01, corrected for their number.
    """
    mean, known = (channels(path, "path") for path in (picture, reference))
    variance = np.maximum(channels(reference, "m2_path") - known**2, 1e-4)
    z = np.abs(mean - known) * np.sqrt(samples / variance)
    alpha = 1 - (1 - 0.01) ** (1 / mean[..., 0].size)
    p = np.vectorize(math.erfc)(z / math.sqrt(2))
    return np.count_nonzero(p > alpha) / 3 >= 0.9975 * mean[..., 0].size


def z_test(program, folder, count):
    """What two tests pass of Mitsuba's pictures of `diffuse` with its walls darker, and with pixels blackened."""
    xml = export(program, ROOT / "scenes/diffuse.toml", folder)
    samples = Z_BUDGET // (64 * 48)

    def shot(name, seed, samples, share=1.0):
        scene = folder / "changed.xml"
        darker = lambda m: m[1] + " ".join(str(float(v) * share) for v in m[2].split()) + '"'
        scene.write_text(re.sub(r'(name="reflectance" value=")([^"]*)"', darker, xml.read_text()))
        return render_moments(scene, seed, samples, folder / name)

    def verdicts(picture, reference, of_reference):
        theirs = passes_z_test(picture, samples, reference)
        flags = [f"--spp-a={of_reference}", f"--spp-b={samples}"]
        return np.array([theirs, compare(program, [reference], [picture], *flags)["same"]], int)

    def tell(what, passed, of):
        print(f"{what}: of {of} the z-test passes {passed[0]}, etendue compare {passed[1]}", flush=True)

    reference = shot("reference.exr", 1, Z_REFERENCE)
    for share in [1.0, 0.99, 0.98, 0.97]:
        pictures = (shot("changed.exr", 100 + k, samples, share) for k in range(count))
        tell(f"reflectances x {share}", sum(verdicts(p, reference, Z_REFERENCE) for p in pictures), count)
    pairs = ((shot("changed.exr", 100 + k, samples), shot("short.exr", 500 + k, samples)) for k in range(count))
    tell("unchanged, reference of as many samples", sum(verdicts(p, r, samples) for p, r in pairs), count)
    picture = mi.Bitmap(str(shot("changed.exr", 100, samples)))
    for black in [4, 7, 8]:
        array = np.array(picture, copy=True)
        array[5, 20 : 20 + black] = 0
        names = [field.name for field in picture.struct_()]
        mi.Bitmap(array, mi.Bitmap.PixelFormat.MultiChannel, names).write(str(folder / "black.exr"))
        tell(f"{black} black pixels", verdicts(folder / "black.exr", reference, Z_REFERENCE), 1)
    return 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--false-alarms", type=int, metavar="N")
    parser.add_argument("--z-test", type=int, metavar="N")
    parser.add_argument("--moments", action="store_true")
    args = parser.parse_args()
    # It needs no LLVM.
    mi.set_variant("scalar_rgb")
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.false_alarms:
        return false_alarms(args.program, args.folder, args.false_alarms, args.moments)
    if args.z_test:
        return z_test(args.program, args.folder, args.z_test)
    return against_ours(args.program, args.folder, args.moments)


if __name__ == "__main__":
    sys.exit(main())
