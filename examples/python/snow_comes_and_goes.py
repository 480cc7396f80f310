# SPDX-License-Identifier: MIT
"""Snow that is added while a simulation is under way, and snow that is taken out of it.

usage: snow_comes_and_goes.py"""
import numpy as np

import firn

scene = firn.Scene("snow_comes_and_goes").set("simulation.dx", 0.02).set("ground.friction", 0.5)
scene.add("snow", shape="box", size=(0.4, 0.08, 0.4), center=(0, 0.04, 0))
simulation = firn.Simulation(scene)

for ball in range(4):
    # As one more [[snow]] of the scene would be at its start. What would start in other snow is refused.
    simulation.add_snow(shape="ball", radius=0.05, center=(0.1 * ball - 0.15, 0.3, 0), velocity=(0, -4, 0))
    simulation.advance_to(simulation.time + 0.1)

    # Whatever has left the bed on its sides.
    snow = simulation.snapshot()
    gone = np.abs(snow.world_positions()[:, ::2]).max(axis=1) > 0.21
    removed = simulation.remove_snow(snow.id[gone])
    print(f"{simulation.time:.2f} s: {len(simulation)} particles, {removed} taken out, {simulation.metrics().mass:.3f} kg")
