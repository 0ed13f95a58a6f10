"""Pictures by radwalk and by Mitsuba 3 of the same rooms: how far both are from many samples a pixel, and what time both take.

    pictures.py RADWALK FOLDER PAGE NAME=SCENE... [--samples N]

Writes PAGE, and beside it a detail of each room of configs/. FOLDER keeps what is measured: rooms that are there are told as they are.
"""

import argparse
import json
import resource
import shutil
import subprocess
from pathlib import Path

import numpy as np

BLOCK = 5
SAMPLES_OF_TRIAL = 8
SAMPLES_AT_ONCE = 16
DARK = 0.01
WINDOW = (400, 250)

HEAD = """# Pictures against a path tracer

`scripts/pictures.sh` writes this page ({version}, Mitsuba 3 on Embree and LLVM with {vectors}, Intel Open Image Denoise). Both draw what is in `summary.json`'s
`picture`: the same surfaces, materials and camera. Rooms from archives are fetched by whoever measures, and none is part of this project.

Relative squared errors are of means over 5 × 5 pixels, of those without a lamp or a black surface in them: products of the differences from two independent halves of
the reference, whose noise so adds nothing on average. They are those of the {window[0]} × {window[1]} pixels in the middle of a picture of 800 × 500, all else of the whole. Each is divided by the square of the denoised reference, or of 1 % of the mean where that is less; a divisor with noise
of its own would weigh blocks the more the darker chance made them. Seconds are of processors, on a machine that others used at the same
time; radwalk's are those of the whole run, with its picture. *Equal time* is the path tracer with as many samples as it takes in that time; since its error falls
as 1/time, the ratio of errors is that of the times to equal error. *Denoised* is that picture after the denoiser with reflectances and normals, whose time is not counted.

| room | seconds | of these `radwalk report` | error | path tracer at equal time | denoised | times faster | reference |
|---|---|---|---|---|---|---|---|
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("radwalk")
    parser.add_argument("folder", type=Path)
    parser.add_argument("page", type=Path)
    parser.add_argument("rooms", nargs="+", metavar="NAME=SCENE")
    parser.add_argument("--samples", type=int, default=1024)
    args = parser.parse_args()
    version = subprocess.run([args.radwalk, "--version"], capture_output=True, text=True).stdout.split("+")[0].strip()
    rows, details = "", ""
    for name, scene in (room.split("=") for room in args.rooms):
        folder = args.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        kept = folder / "figures.json"
        if not kept.exists():
            kept.write_text(json.dumps(compare(args, scene, folder), indent=1))
        found = json.loads(kept.read_text())
        print(name, found, flush=True)
        rows += row(name, found)
        if "configs/" in scene:
            shutil.copy(folder / "detail.png", args.page.parent / f"pictures-{name}.png")
        if (args.page.parent / f"pictures-{name}.png").exists():
            samples = found["equal_samples"]
            details += f"\n## {name}\n\n![The same detail three times](pictures-{name}.png)\n\nradwalk; the path tracer at equal time ({samples} samples a pixel); the same, denoised.\n"
    vectors = "AVX-512" if "avx512f" in Path("/proc/cpuinfo").read_text() else "AVX2"
    args.page.write_text(HEAD.format(version=version, vectors=vectors, window=WINDOW) + rows + details + pages(args.folder / "pages" / "pages.json") + by_hand(args.page))


BY_HAND = "\n## Light that filters took\n"

PAGES = """
## Pages

`report.html` of scenes made by rule in headless Chromium, with its script, on a machine that others used at the same time. *Open* is from the address to where the
scene can be turned, once by the page's clock and once in seconds of all of the browser's processors; memory is that of the process that shows the page. A click in the middle of
each told value and interval of a patch.

| patches | size | open | processors | memory |
|---|---|---|---|---|
"""


def pages(path):
    """The section on pages."""
    found = json.loads(path.read_text()).values() if path.exists() else []
    of = "| {patches:,} | {megabytes:.1f} MB | {seconds:.1f} s | {processor:.1f} s | {memory:.0f} MB |\n"
    rows = [of.format(megabytes=page["bytes"] / 1e6, **page) for page in found if page["ready"] == "yes" and "…" in page["told"]]
    return PAGES + "".join(rows) if rows else ""


def by_hand(page):
    """The last section of the page as it is, which is written by hand."""
    before, mark, section = page.read_text().partition(BY_HAND) if page.exists() else ("", "", "")
    return mark + section


def row(name, found):
    return (
        f"| {name} | {found['seconds']:.1f} | {found['drawing']:.1f} | {found['error']:.5f} | {found['equal_error']:.4f}, {found['equal_samples']} samples | "
        f"{found['denoised_error']:.5f} | {found['equal_error'] / found['error']:.1f} | {found['samples']} samples, noise {found['noise']:.4f} |\n"
    )


def compare(args, scene, folder):
    """The figures of one room."""
    import mitsuba as mi
    from path_tracer import PathTracer

    out, geometry = folder / "out", folder / "geometry"
    before = children_seconds()
    radwalk(args, "run", scene, "--out", out, "--force", "--set", 'output.files=["summary", "picture", "exr"]')
    run = children_seconds() - before
    radwalk(args, "report", out)
    drawing = children_seconds() - before - run
    radwalk(args, "run", scene, "--out", geometry, "--force", "--paths", 1, "--set", "scene.patches=given", "--set", 'output.files=["vtu"]')
    camera = json.loads((out / "summary.json").read_text())["picture"]
    window = [min(side, part) for side, part in zip(camera["size"], WINDOW)]
    tracer = PathTracer(geometry / "patches.vtu", camera, window, folder)
    lamps = tracer.draw(16, 1, depth=1)[0].max(axis=2) > 0.0
    part = window[0] * window[1] / (camera["size"][0] * camera["size"][1])
    a_sample = tracer.draw(SAMPLES_OF_TRIAL, 99)[1] / SAMPLES_OF_TRIAL / part
    reference, samples = reference_of(tracer, args.samples, folder / "reference.npz")
    judge = Judge(reference, denoised(tracer, reference.mean(axis=0).astype(np.float32)), lamps)
    ours = middle(np.array(mi.Bitmap(str(out / "radiosity.exr")).convert(mi.Bitmap.PixelFormat.RGB)), window)
    equal_samples = max(1, round(run / a_sample))
    equal, _ = tracer.draw(equal_samples, 98)
    clean = denoised(tracer, equal)
    show([ours, equal, clean], camera["exposure"], folder / "detail.png")
    np.savez(folder / "judged.npz", ours=ours, lamps=lamps)
    return {
        "seconds": run, "drawing": drawing, "error": judge.error(ours), "equal_samples": equal_samples,
        "equal_error": judge.error(equal), "denoised_error": judge.error(clean), "samples": samples, "noise": judge.noise,
    }


def radwalk(args, *words):
    done = subprocess.run([args.radwalk, *map(str, words), "--quiet"])
    if done.returncode > 1:
        raise SystemExit(done.returncode)


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def reference_of(tracer, samples, path):
    """Two halves of many samples, kept pass by pass so that another run goes on from there, and how many samples there are."""
    sums, done = np.zeros(()), 0
    if path.exists():
        kept = np.load(path)
        sums, done = kept["sums"], int(kept["passes"])
    while done < 2 or done * SAMPLES_AT_ONCE < samples:
        halves = [tracer.draw(SAMPLES_AT_ONCE, 1000 + number)[0].astype(float) for number in (done, done + 1)]
        sums, done = sums + np.array(halves), done + 2
        np.savez(path, sums=sums, passes=done)
    return (2 * sums / done).astype(np.float32), done * SAMPLES_AT_ONCE


class Judge:
    """Tells how far a picture is from a reference of two halves, given what that is without its noise."""

    def __init__(self, reference, clean, lamps):
        self.halves = [blocks(half) for half in reference]
        self.counted = (blocks(lamps[:, :, None]) == 0.0) & (blocks(reference.max(axis=(0, 3))[:, :, None] == 0.0) == 0.0)
        scale = blocks(clean)
        self.scale = np.maximum(scale, DARK * scale[self.counted].mean())
        a, b = self.halves
        self.noise = self.mean(((a - b) / 2) ** 2)

    def mean(self, squares):
        return float((squares / self.scale**2)[self.counted].mean())

    def error(self, image):
        a, b = (blocks(image) - half for half in self.halves)
        return self.mean(a * b)


def blocks(image):
    """Means of all channels over blocks of pixels."""
    height, width = (side // BLOCK * BLOCK for side in image.shape[:2])
    grey = image[:height, :width].astype(float).mean(axis=2)
    return grey.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).mean(axis=(1, 3))


def denoised(tracer, image):
    import pyoidn

    albedo, normal = tracer.guides()
    return pyoidn.denoise(np.ascontiguousarray(image), albedo=albedo, normal=normal, hdr=True)


def middle(image, window):
    top, left = ((side - part) // 2 for side, part in zip(image.shape, window[::-1]))
    return image[top : top + window[1], left : left + window[0]]


def show(images, exposure, path):
    """Some pictures, side by side, with the exposure of radwalk's."""
    from PIL import Image

    light = np.concatenate(images, axis=1) * np.pi * np.array(exposure)
    above = np.maximum(light - 0.5, 0.0)
    light = np.minimum(light, 0.5) + 0.5 * above / (above + 0.5)
    shades = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
    image = Image.fromarray((np.clip(shades, 0.0, 1.0) * 255 + 0.5).astype(np.uint8))
    image.quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main()
