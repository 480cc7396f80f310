# SPDX-License-Identifier: MIT
"""A collider whose motion the program decides in each step from the force on it: a blade of 20 kg is pushed into a bank of
snow with 400 N, and slows down as the snow piles up before it.

usage: driven_blade.py"""
import firn

MASS, PUSH = 20, 400  # kg, N

scene = firn.Scene("blade").set("simulation.dx", 0.03).set("ground.friction", 0.5)
scene.add("snow", shape="box", size=(0.6, 0.2, 0.3), center=(0.5, 0.1, 0))
scene.add("collider", name="blade", shape="box", size=(0.1, 0.4, 0.5), center=(0.05, 0.25, 0), contact="separating")
simulation = firn.Simulation(scene)

speed = 0.0  # m/s
told: list[firn.DrivenCollider] = []


def blade(now: firn.DrivenCollider) -> tuple[float, float, float]:
    """Called before each step; `dt` and `force` are those of the step that has just ended."""
    global speed
    told.append(now)
    speed += now.dt * (PUSH + now.force[0]) / MASS
    return speed, 0, 0


simulation.drive("blade", blade)
print(f"{'time s':>8} {'blade m':>10} {'m/s':>10} {'snow N':>12} {'torque z N m':>14}")
for frame in range(1, 11):
    simulation.advance_to(frame * 0.03)
    now = told[-1]  # as it was told before the last step
    print(f"{now.time:8.4f} {now.position[0]:10.4f} {now.velocity[0]:10.4f} {now.force[0]:12.2f} {now.torque[2]:14.3f}")
