"""Holds our pictures against Mitsuba's; scripts/against-mitsuba installs what it needs.

    against_mitsuba.py PROGRAM FOLDER                     every scene of scenes/ without Phong, exported, rendered, compared
    against_mitsuba.py PROGRAM FOLDER --false-alarms N    N pairs of Mitsuba's own pictures of three scenes: how often they differ
    ... --moments                                         the same with one render of a side, which states its variance

Without --moments every side has independent renders, whose spread is its noise. Exit status 1 if a scene differs.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import mitsuba as mi

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = "64x48"
ALPHA = 0.001
# Renders of each side, and samples per pixel of each.
RENDERS, SAMPLES = 8, 64
# Of each side of a pair.
PAIR_RENDERS, PAIR_SAMPLES = 4, 16
# Samples per pixel with --moments.
MOMENT_SAMPLES = 64
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
    """Compares every scene without Phong."""
    differ = 0
    for scene in sorted((ROOT / "scenes").glob("*.toml")):
        if '"phong"' in scene.read_text():
            print(f"{scene.stem}: left out, for Mitsuba has no Phong")
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


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--false-alarms", type=int, metavar="N")
    parser.add_argument("--moments", action="store_true")
    args = parser.parse_args()
    # It needs no LLVM.
    mi.set_variant("scalar_rgb")
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.false_alarms:
        return false_alarms(args.program, args.folder, args.false_alarms, args.moments)
    return against_ours(args.program, args.folder, args.moments)


if __name__ == "__main__":
    sys.exit(main())
