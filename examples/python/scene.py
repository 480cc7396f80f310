# SPDX-License-Identifier: MIT
"""A scene made in Python: two snowballs of different snow fall on a slope, and a run makes a movie of it.

usage: scene.py RUN_FOLDER"""
import sys

import numpy as np

import firn

if len(sys.argv) != 2:
    sys.exit(__doc__)

# The keys are those of scene files: `firn params` lists them.
scene = firn.Scene("slope")
scene.set("time.frames", 5).set("time.fps", 25).set("simulation.dx", 0.02)
scene.set("image.width", 160).set("image.height", 120).set("image.samples", 2)
scene.set("camera.position", (-0.5, 0.7, 1.6)).set("camera.target", (0.1, 0.2, 0))
for x, young_modulus in zip(np.linspace(-0.2, 0.1, 2), (5e4, 2e5)):
    name = "powder" if x < 0 else "packed"
    scene.add("snow", name=name, shape="ball", radius=0.1, center=(x, 0.45, 0), velocity=(0, -2, 0), young_modulus=young_modulus)
scene.add("collider", name="slope", shape="plane", point=(0, 0, 0), normal=(0.3, 1, 0), friction=0.4)

session = firn.Session.start(scene, out=sys.argv[1], overwrite=True)
session.run()
print(scene.frames, "frames in", session.folder)
