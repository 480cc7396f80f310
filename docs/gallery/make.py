# SPDX-License-Identifier: MIT
"""The stills of docs/gallery: simulates what a picture needs (kept in build/gallery, made once), renders it, writes a JPEG.

usage: make.py [NAME...]     all of them without names"""
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WORK = ROOT / "build/gallery"
BACKLIT = ["light[0].azimuth=163", "light[0].elevation=15", "snow.ball.density=150", "snow.ball.grain_radius=1e-3",
           "output.exposure=-0.2"]


def size(width, height, samples):
    return [f"image.width={width}", f"image.height={height}", f"image.samples={samples}"]


# name: scene, frame, what is set for the simulation, what is set for each picture of those side by side.
STILLS = {
    "powder_in_sun": ("powder_in_sun", 0, [], [[]]),
    "snow_cave": ("snow_cave", 0, [], [[]]),
    "ball_lit_from_behind": ("snowball_on_drift", 0, [], [BACKLIT + size(720, 480, 64)]),
    "avalanche": ("avalanche", 84, ["simulation.dx=0.065"], [size(960, 540, 48) + [
        "camera.position=[4.2,1.5,12.5]", "camera.target=[0.7,1.75,0]", "output.denoise=true"]]),
    "snowfall": ("snowfall_at_fence", 0, [], [[]]),
    "boot_print": ("boot_print", 48, ["simulation.dx=0.0085"], [size(960, 540, 32) + [
        "collider.visible=false", "camera.position=[0.05,0.5,0.27]", "camera.target=[0.01,0.1,0.005]", "camera.fov=28",
        "light[0].azimuth=-82", "light[0].elevation=20", "light[0].angular_radius=0.27", "snow.sparkle=4e6",
        "output.exposure=-0.25", "output.denoise=true"]]),
    "spheres_and_smooth": ("snowball_in_sun", 0, [], [
        size(480, 480, 32) + ["image.snow_light=surface", "simulation.particles_across=50", "light[0].azimuth=60",
                              "camera.fov=22", "output.denoise=false", f"image.snow={snow}"]
        for snow in ("spheres", "smooth")]),
    "without_and_with_tint": ("snow_cave", 0, [], [
        size(320, 240, 6) + ["output.exposure=-2.5", f"snow.tint={tint}"] for tint in (0, 1)]),
    "snowball_on_drift": ("snowball_on_drift", 0, [], [[]]),
}


def firn(command, target, folder, settings, *words):
    sets = [word for setting in settings for word in ("--set", setting)]
    subprocess.run([ROOT / "build/firn", command, target, "--out", folder, "--overwrite", "--quiet", *words, *sets],
                   check=True, stdout=subprocess.DEVNULL)


def snow_of(name, scene, frame, settings):
    """A scene file, or the folder of a run that has the frame's particles."""
    file = ROOT / f"scenes/{scene}.toml"
    if frame == 0:
        return file, settings
    run = WORK / f"{name}_snow"
    if not any((run / "particles").glob(f"{frame:04d}*")):
        firn("simulate", file, run, settings, "--frames", f"{frame}-{frame}")
    return run, []


def read_ppm(path):
    """Width, height and the pixels of a binary PPM of 8 bits a channel, as firn writes it."""
    data = path.read_bytes()
    head = data.split(maxsplit=4)[:4]
    width, height = int(head[1]), int(head[2])
    return width, height, data[-3 * width * height:]


def side_by_side(paths):
    """One PPM of pictures of one height, from left to right."""
    pictures = [read_ppm(path) for path in paths]
    height = pictures[0][1]
    lines = [pixels[3 * width * y:3 * width * (y + 1)] for y in range(height) for width, _, pixels in pictures]
    return b"P6\n%d %d\n255\n" % (sum(width for width, _, _ in pictures), height) + b"".join(lines)


def core_seconds():
    """What finished children have used: independent of what else the machine does."""
    used = os.times()
    return used.children_user + used.children_system


def make(name):
    scene, frame, for_snow, pictures = STILLS[name]
    begun = core_seconds()
    source, settings = snow_of(name, scene, frame, for_snow)
    parts = []
    for k, picture in enumerate(pictures):
        folder = WORK / f"{name}_{k}"
        firn("render", source, folder, settings + picture + ['output.formats=["ppm"]'], "--frames", f"{frame}-{frame}")
        parts.append(folder / f"frames/{frame:04d}.ppm")
    joined = WORK / f"{name}.ppm"
    joined.write_bytes(side_by_side(parts))
    with open(HERE / f"{name}.jpg", "wb") as out:
        subprocess.run(["cjpeg", "-quality", "90", "-optimize", joined], check=True, stdout=out)
    print(f"{name}: {core_seconds() - begun:.0f} core seconds", flush=True)


if __name__ == "__main__":
    WORK.mkdir(parents=True, exist_ok=True)
    unknown = [name for name in sys.argv[1:] if name not in STILLS]
    if unknown:
        sys.exit(f"no still is called {unknown[0]}; there are {', '.join(STILLS)}")
    for still in sys.argv[1:] or STILLS:
        make(still)
