# SPDX-License-Identifier: MIT
"""What a simulation measures of its snow as a whole."""
from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]


class _Compared:
    """Equal where all fields are, arrays by their values."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True)
class TimeStep:
    """What limits the time step: `dt` (s) and its `cause` in words, "elastic wave (packed snow, 145 m/s)"."""

    dt: float
    cause: str


@dataclass(frozen=True, eq=False)
class ContactForce(_Compared):
    """What a collider does to the snow; the snow does it to the collider with the other sign.

    It is the mean over the last advance_to() or step(), an advance_to() that was stopped and the one that goes on with it
    being one; 0 before the first. Snow that sleeps counts with the force that carries it.

    collider   its name; that of the ground is "ground"
    force      float64, (3,): N
    torque     float64, (3,): N m, about where the collider's pivot is now
    """

    collider: str
    force: Vector
    torque: Vector


@dataclass(frozen=True, eq=False)
class Metrics(_Compared):
    """What a simulation measures of its snow as a whole. Vectors are constant arrays of float64, (3,), world axes.

    time               s
    steps              since the start
    particle_steps     likewise, without those of particles asleep
    particles          still inside
    particles_left     gone through the domain's boundary
    particles_asleep   at rest and left out of the next step
    mass               kg
    momentum           kg m/s
    angular_momentum   kg m^2/s, about the world's origin, with the affine part
    kinetic_energy     J
    elastic_energy     J
    potential_energy   J, -m g.x
    plastic_work       J since the start: what yielding took from the elastic energy
    volume             m^3, the sum of volume0 * J
    density_p05, density_p50, density_p95
                       kg/m^3, the density below which lie 5, 50 and 95 % of the mass
    front              m, along the way that the snow runs, below which lie 99 % of the mass
    max_speed          m/s
    bounds_min, bounds_max
                       m, of the particles' centres; min > max: there are none
    step               TimeStep, the last one
    contacts           tuple of ContactForce, one a collider, in the scene's order, the ground first
    """

    time: float
    steps: int
    particle_steps: int
    particles: int
    particles_left: int
    particles_asleep: int
    mass: float
    momentum: Vector
    angular_momentum: Vector
    kinetic_energy: float
    elastic_energy: float
    potential_energy: float
    plastic_work: float
    volume: float
    density_p05: float
    density_p50: float
    density_p95: float
    front: float
    max_speed: float
    bounds_min: Vector
    bounds_max: Vector
    step: TimeStep
    contacts: tuple[ContactForce, ...]


def metrics_of(all_fields: dict[str, Any]) -> Metrics:
    """Of what the library tells."""
    step, contacts = all_fields.pop("step"), all_fields.pop("contacts")
    return Metrics(step=TimeStep(*step), contacts=tuple(ContactForce(*contact) for contact in contacts), **all_fields)
