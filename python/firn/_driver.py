# SPDX-License-Identifier: MIT
"""Colliders whose motion a program decides step by step."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Union
from weakref import ref

import numpy as np
import numpy.typing as npt

from ._metrics import Vector
from ._values import vector


@dataclass(frozen=True, eq=False)
class DrivenCollider:
    """A collider between two steps, as its driver is told. World axes; vectors are constant arrays of float64, (3,).

    name               its name
    time               s, now
    position           m, of the pivot: the place where its shape is put
    rotation           float64, (3, 3): from how the shape was put
    velocity           m/s, of the pivot during the last step
    angular_velocity   rad/s
    dt                 s, how long the last step was; 0: there was none
    force              N, of the snow on the collider (metrics tell that of the collider on the snow): the mean over the
                       last step
    torque             N m, about the pivot
    """

    name: str
    time: float
    position: Vector
    rotation: npt.NDArray[np.float64]
    velocity: Vector
    angular_velocity: Vector
    dt: float
    force: Vector
    torque: Vector


@dataclass(frozen=True)
class ColliderVelocity:
    """How a collider is to move during the next step: `linear` (m/s, of the pivot) and `angular` (rad/s), three numbers
    each."""

    linear: Union[Sequence[float], Vector] = (0.0, 0.0, 0.0)
    angular: Union[Sequence[float], Vector] = (0.0, 0.0, 0.0)


Driver = Callable[[DrivenCollider], Union[ColliderVelocity, Sequence[float], Vector]]


class Owner(Protocol):
    """Whatever has drivers."""

    _drivers: dict[str, Driver]


def _velocity(said: object, name: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    what = f"the velocity that the driver of '{name}' returns"
    if isinstance(said, ColliderVelocity):
        return vector(said.linear, what), vector(said.angular, f"the angular part of {what}")
    return vector(said, what), (0.0, 0.0, 0.0)


def asking(owner: Owner, collider: str, driver: object) -> Callable[..., tuple[object, object]]:
    """What the library calls to ask for a velocity. It refers to the owner weakly: strongly it would be a cycle that
    Python cannot see. Errors: TypeError for what is no function."""
    if not callable(driver):
        raise TypeError(f"a driver is a function, not of the type {type(driver).__name__}")
    weak = ref(owner)

    def ask(*state: Any) -> tuple[object, object]:
        alive = weak()
        assert alive is not None  # it is at work
        return _velocity(alive._drivers[collider](DrivenCollider(*state)), collider)

    return ask
