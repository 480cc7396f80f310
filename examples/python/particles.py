# SPDX-License-Identifier: MIT
"""The particles as NumPy arrays, and their state on request: where the snow is, how far it is packed and pressed.

usage: particles.py"""
import numpy as np

import firn

scene = firn.Scene("pressed").set("simulation.dx", 0.02).set("ground.friction", 0.4)
scene.add("snow", shape="box", size=(0.2, 0.2, 0.2), center=(0, 0.1, 0), velocity=(0, -3, 0))
simulation = firn.Simulation(scene)
simulation.advance_to(0.02)

# A copy of the state: the simulation may go on, and the copy stays. Its columns are views without a copy.
snow = simulation.snapshot(J=True, stress=True)
assert snow.J is not None and snow.stress is not None  # they were asked for
x, y, z = snow.position  # m, relative to snow.origin; each (N,)
print(f"{len(snow)} particles at {snow.time:.4f} s, lowest and highest: {y.min() + snow.origin[1]:g} {y.max() + snow.origin[1]:g} m")

pressure = -(snow.stress[0] + snow.stress[4] + snow.stress[8]) / 3  # Pa; the rows are those of a 3 x 3 matrix
print(f"densest {snow.density.max():.1f} kg/m^3, mean pressure {pressure.mean(dtype=float):.1f} Pa, "
      f"volumes changed by up to {100 * np.abs(1 - snow.J).max():.2f} %")

# By height, in ten layers.
layer = np.minimum((10 * (y - y.min()) / (y.max() - y.min())).astype(int), 9)
print("pressure by height, Pa:", *(f"{pressure[layer == k].mean():.0f}" for k in range(10)))
