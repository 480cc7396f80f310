# SPDX-License-Identifier: MIT
"""A scene stepped by the program: a snowball falls; its height and energy, frame by frame.

usage: falling_ball.py"""
import firn

scene = firn.Scene("drop").set("simulation.dx", 0.02).set("ground.friction", 0.4)
scene.add("snow", shape="ball", radius=0.1, center=(0, 0.5, 0), velocity=(0, -1, 0))

simulation = firn.Simulation(scene)
print(f"{'time s':>8} {'height m':>10} {'kinetic J':>14} {'steps':>10}")
for frame in range(13):
    simulation.advance_to(frame / 24)
    m = simulation.metrics()
    height = 0.5 * (m.bounds_min[1] + m.bounds_max[1])  # of the middle
    print(f"{m.time:8.4f} {height:10.4f} {m.kinetic_energy:14.6f} {m.steps:10}")
