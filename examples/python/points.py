# SPDX-License-Identifier: MIT
"""Points of another program, here the arrays of a snowy heart, rendered with the optics of snow: a picture as an array,
and as a file.

usage: points.py [PICTURE.png]"""
import sys

import numpy as np

import firn

spacing = 0.02  # m
axis = np.arange(-0.7, 0.7, spacing)
x, y, z = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
# Within the heart surface of Taubin (1994), about 1 m high.
a, b, c = 2 * x, 2 * y, 2 * z
inside = (a**2 + 2.25 * c**2 + b**2 - 1) ** 3 - a**2 * b**3 - 0.1125 * c**2 * b**3 < 0
points = np.stack([x, y + 0.6, z], axis=1)[inside]

scene = firn.Scene("heart").set("ground.friction", 0.5)
scene.add_points(points, volume=spacing**3, preset="fresh")
scene.set("camera.position", (0.8, 1.0, 2.6)).set("camera.target", (0, 0.55, 0))
scene.set("image.width", 240).set("image.height", 240).set("image.samples", 16)

snow = firn.Simulation(scene).snapshot()  # or any later moment
picture = firn.Renderer(scene).render(snow)
print(f"{len(snow)} points, {picture.rgb.shape} {picture.rgb.dtype}, brightest {picture.rgb.max():.3f}")
picture.write(sys.argv[1] if len(sys.argv) > 1 else "heart.png")
