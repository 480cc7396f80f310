# SPDX-License-Identifier: MIT
"""The shapes of the still scenes: height fields scenes/drifts.pgm (wind-blown powder) and scenes/vault.pgm (the roof of a
passage, upside down), the lugs under the boot, scenes/boot_tread.obj, a boulder, scenes/rock.obj, and a snowball,
scenes/snowball.obj. Run it again only to change them.

usage: shapes.py"""
import math
from array import array
from pathlib import Path

SCENES = Path(__file__).resolve().parents[2] / "scenes"
MOST = 65535


def lattice(x, y, seed):
    """A number in [0, 1) that belongs to a lattice point."""
    bits = (x * 0x9E3779B1 ^ y * 0x85EBCA77 ^ seed * 0xC2B2AE3D) & 0xFFFFFFFF
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        bits = (bits ^ bits >> shift) * factor & 0xFFFFFFFF
    return (bits ^ bits >> 16) / 2**32


def noise(x, y, seed):
    """Smooth noise in [0, 1], a lattice point a unit."""
    i, j = math.floor(x), math.floor(y)
    s, t = (w * w * w * (w * (6 * w - 15) + 10) for w in (x - i, y - j))
    low = lattice(i, j, seed) * (1 - s) + lattice(i + 1, j, seed) * s
    high = lattice(i, j + 1, seed) * (1 - s) + lattice(i + 1, j + 1, seed) * s
    return low * (1 - t) + high * t


def octaves(x, y, seed, count):
    """Noise whose detail is half as high at half the size."""
    parts = [(0.5**k, noise(x * 2**k, y * 2**k, seed + k)) for k in range(count)]
    return sum(weight * value for weight, value in parts) / sum(weight for weight, _ in parts)


def drifts(x, z):
    """Sastrugi: ridges across the wind, steep in its lee, and clods. x, z in metres."""
    wander = 0.25 * octaves(3 * x, 3 * z, 11, 2)
    phase = (0.85 * x + 0.35 * z + wander) / 0.21
    along = phase - math.floor(phase)
    ridge = along / 0.7 if along < 0.7 else (1 - along) / 0.3
    ridge = ridge * ridge * (3 - 2 * ridge) * (0.35 + 0.65 * octaves(4 * x, 4 * z, 5, 2))
    swell = octaves(2.2 * x, 2.2 * z, 1, 2)
    clods = max(0.0, octaves(22 * x, 22 * z, 31, 3) - 0.55) / 0.45
    return 0.5 * swell + 0.3 * ridge + 0.12 * octaves(14 * x, 14 * z, 21, 3) + 0.1 * clods


def scallops(x, z):
    """What wind melts out of such walls: hollows side by side with ridges between them."""
    i, j = math.floor(8 * x), math.floor(8 * z)
    nearest = min((8 * x - a - lattice(a, b, 8)) ** 2 + (8 * z - b - lattice(a, b, 9)) ** 2
                  for a in range(i - 2, i + 3) for b in range(j - 2, j + 3))
    return 0.16 * min(nearest, 1) + 0.08 * octaves(9 * x, 9 * z, 7, 3)


def vault(x, z):
    """Thickness of a roof over a winding passage along z, a part of its full height; x, z in metres."""
    u = x - 0.09 * math.sin(4.5 * z) + 0.08 * (noise(4 * x, 4 * z, 3) - 0.5)
    wide = 0.33 + 0.12 * (noise(0.5, 3 * z, 4) - 0.5) - 0.12 * z  # narrower towards +z
    arch = 1 - (u / wide) ** 2
    hollow = 0.80 * math.sqrt(arch) if arch > 0 else 0
    return 1 - max(0.0, hollow - scallops(x, z))


def lugs():
    """Corners of the lugs of a boot's sole, eight each: chevrons in two halves, on either side of a groove. Metres."""
    for front in (-0.083, -0.048, -0.001, 0.034, 0.069):  # the gap is the arch
        for side in (-1, 1):
            yield [(front + along - 0.014 * across, y, side * (0.004 + 0.042 * across))
                   for y in (0.142, 0.158) for across in (0, 1) for along in (-0.018, 0)]


def write_lugs(name):
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # out of a lug with side = 1
    lines = ["# The lugs of a boot's sole, made by docs/gallery/shapes.py"]
    for k, corners in enumerate(lugs()):
        lines += ["v %.4f %.4f %.4f" % corner for corner in corners]
        lines += ["f " + " ".join(str(8 * k + 1 + i) for i in (quad if k % 2 else quad[::-1])) for quad in quads]
    (SCENES / name).write_text("\n".join(lines) + "\n")


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def sphere(rounds):
    """Corners and triangles of an octahedron whose triangles were cut in four `rounds` times; counter-clockwise from outside."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    triangles = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(rounds):
        middles = {}

        def middle(a, b):
            if (b, a) in middles:
                return middles[b, a]
            if (a, b) not in middles:
                middles[a, b] = len(corners)
                corners.append(unit([x + y for x, y in zip(corners[a], corners[b])]))
            return middles[a, b]

        finer = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = finer
    return corners, triangles


def rock_radius(direction):
    """A boulder: a ball from which planes have split off pieces, worn a little."""
    radius = 1.12
    for k in range(16):
        normal = unit([lattice(k, axis, 77) - 0.5 for axis in range(3)])
        facing = sum(n * d for n, d in zip(normal, direction))
        if facing > 0:
            radius = min(radius, (0.7 + 0.26 * lattice(k, 3, 77)) / facing)
    x, y, z = direction
    worn = octaves(3 * x + 9 + 2 * z, 3 * y + 7 - 2 * z, 41, 4) + octaves(3 * z + 5 - 2 * x, 3 * y + 3 + 2 * x, 47, 4)
    return radius * (0.9 + 0.1 * worn)


def snowball_radius(direction):
    """A ball pressed by hands: dented where palms and fingers lay, lumpy in between."""
    x, y, z = direction
    radius = 1.0
    for k in range(9):
        normal = unit([lattice(k, axis, 61) - 0.5 for axis in range(3)])
        facing = sum(n * d for n, d in zip(normal, direction))
        dent = max(0.0, facing - 0.8) / 0.2
        radius -= 0.05 * lattice(k, 3, 61) * dent * dent * (3 - 2 * dent)
    lumps = octaves(2.5 * x + 9 + 1.5 * z, 2.5 * y + 7 - 1.5 * z, 67, 4) + octaves(2.5 * z + 5, 2.5 * y + 3 + 1.5 * x, 71, 4) - 1
    return radius + 0.06 * lumps


def write_ball(name, what, radius):
    """A closed mesh whose corners lie radius(direction) from its middle."""
    corners, triangles = sphere(4)
    lines = [f"# {what}, made by docs/gallery/shapes.py"]
    lines += ["v %.4f %.4f %.4f" % tuple(radius(corner) * x for x in corner) for corner in corners]
    lines += ["f %d %d %d" % tuple(i + 1 for i in triangle) for triangle in triangles]
    (SCENES / name).write_text("\n".join(lines) + "\n")


def write(name, columns, rows, width, depth, height):
    """height(x, z) in [0, 1] over a rectangle of metres, centred; the first row is at -z."""
    grey = array("H", (round(MOST * min(1, max(0, height((i / (columns - 1) - 0.5) * width, (j / (rows - 1) - 0.5) * depth))))
                       for j in range(rows) for i in range(columns)))
    grey.byteswap()  # PGM is big-endian
    (SCENES / name).write_bytes(b"P5\n%d %d\n%d\n" % (columns, rows, MOST) + grey.tobytes())


if __name__ == "__main__":
    write("drifts.pgm", 256, 192, 1.6, 1.2, drifts)
    write("vault.pgm", 128, 128, 1.2, 1.2, vault)
    write_lugs("boot_tread.obj")
    write_ball("rock.obj", "A boulder of about 2 m", rock_radius)
    write_ball("snowball.obj", "A snowball of about 2 m", snowball_radius)
