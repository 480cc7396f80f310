# SPDX-License-Identifier: MIT
"""Points of another program, rendered as snow: here a ring that NumPy makes. The picture is read back as an array.

usage: points.py RUN_FOLDER"""
import sys
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

import firn


def ring(spacing: float, radius: float, thickness: float) -> npt.NDArray[np.float64]:
    """Points in a torus that lies flat: (N, 3), m."""
    wide = np.arange(-radius - thickness, radius + thickness, spacing)
    high = np.arange(-thickness, thickness, spacing)
    x, y, z = (axis.ravel() for axis in np.meshgrid(wide, high, wide, indexing="ij"))
    inside = (np.hypot(x, z) - radius) ** 2 + y**2 < thickness**2
    return np.array(np.stack([x, y, z], axis=1)[inside])


def read_pfm(path: Path) -> npt.NDArray[np.float32]:
    """A picture as (H, W, 3), linear light, the upper row first."""
    magic, size, scale, values = path.read_bytes().split(b"\n", 3)
    assert magic == b"PF" and float(scale) < 0  # colours, little-endian
    width, height = map(int, size.split())
    return np.frombuffer(values, "<f4").reshape(height, width, 3)[::-1]


if len(sys.argv) != 2:
    sys.exit(__doc__)
with tempfile.TemporaryDirectory() as folder:
    spacing = 0.01
    points = Path(folder, "points.npz")
    np.savez(points, position=ring(spacing, radius=0.2, thickness=0.06), volume=spacing**3)

    scene = firn.Scene("ring").set("time.frames", 1).set("ground.friction", 0.5)
    scene.add("snow", shape="particles", file=points, offset=(0, 0.07, 0), preset="packed")
    scene.set("image.width", 160).set("image.height", 120).set("image.samples", 4)
    scene.set("camera.position", (0, 0.5, 0.8)).set("camera.target", (0, 0.03, 0)).set("output.formats", ["png", "pfm"])
    session = firn.Session.start(scene, out=sys.argv[1], overwrite=True)
    session.run()

picture = read_pfm(Path(session.folder, "frames/0000.pfm"))
print("picture:", picture.shape, picture.dtype, "mean light", *(f"{light:.3f}" for light in picture.mean(axis=(0, 1))))
