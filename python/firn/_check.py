# SPDX-License-Identifier: MIT
"""What a scene will take and show, found before it is run."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from . import _core as library
from ._metrics import TimeStep, Vector
from ._scene import Scene


@dataclass(frozen=True, eq=False)
class CheckedSnow:
    """A [[snow]] as it was placed.

    name             its name
    particles        their number
    mass             kg
    volume           m^3
    particle_mass    kg, of each particle
    bounds_min, bounds_max   m, float64, (3,): of particle centres
    pixel_fraction   of frame 0: where the camera sees it
    """

    name: str
    particles: int
    mass: float
    volume: float
    particle_mass: float
    bounds_min: Vector
    bounds_max: Vector
    pixel_fraction: float


@dataclass(frozen=True)
class CheckedObject:
    """The ground, a collider or an [[object]]: its `name`, and its `pixel_fraction` of frame 0."""

    name: str
    pixel_fraction: float


@dataclass(frozen=True)
class SceneWarning:
    """What looks like a mistake in a scene.

    kind    "unseen", "floating", "sparse_points", "odd_points" or "buried"
    snow    index of the [[snow]]
    place   where the scene says it: "scene.toml:12:1", or the line of the program
    text    a line for people
    """

    kind: str
    snow: int
    place: str
    text: str


@dataclass(frozen=True)
class MemoryEstimate:
    """What the process holds at once, in bytes; what it held before the check counts too.

    at_start              while frame 0 is made
    peak_low, peak_high   the most lies between the two
    simulation            the particles and their grid
    bytes_per_particle    of these, by particle
    """

    at_start: int
    peak_low: int
    peak_high: int
    simulation: int
    bytes_per_particle: float


@dataclass(frozen=True, eq=False)
class CheckReport:
    """All that was found.

    scene, file             its name; where it was read from ("scene": it was made in a program)
    snow                    a CheckedSnow a [[snow]]
    particles, mass         of all snow; kg
    dx, grid_blocks         m; blocks of 4x4x4 nodes at the start
    step                    the first TimeStep; its cause is what limits it where the scene fixes no dt
    fixed_dt, shortest_dt   whether the scene fixes it; s, where snow is packed most
    frames, frame_seconds   their number; s of the simulation from one to the next
    steps_per_frame, steps  (fewest, most): as long as at the start, as short as where snow is packed most; `steps` in all
    width, height, samples, max_bounces   of a picture: pixels, a pixel, of a path
    warnings                a SceneWarning each; those of one kind in the scene's order
    blow_up                 what the first steps blew up with, or None; nothing is known then of what follows
    memory                  MemoryEstimate
    objects                 a CheckedObject each
    background_fraction     of frame 0's pixels: sky and lamps
    """

    scene: str
    file: str
    snow: tuple[CheckedSnow, ...]
    particles: int
    mass: float
    dx: float
    grid_blocks: int
    step: TimeStep
    fixed_dt: bool
    shortest_dt: float
    frames: int
    frame_seconds: float
    steps_per_frame: tuple[int, int]
    steps: tuple[int, int]
    width: int
    height: int
    samples: int
    max_bounces: int
    warnings: tuple[SceneWarning, ...]
    blow_up: Optional[str]
    memory: MemoryEstimate
    objects: tuple[CheckedObject, ...]
    background_fraction: float


def check_scene(scene: Scene, threads: int = 0, isa: str = "auto", force: bool = False) -> CheckReport:
    """What `firn check` prints, as values: the snow is placed, and the first frame and the first steps are made in part.

    The arguments are those of Simulation. Everything but `memory` is the same for any number of threads.

    Errors: those with which a run of the scene would be refused: UsageError, FileError.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"what is checked is a firn.Scene, not {type(scene).__name__}")
    found = library.check_scene(scene._core, threads, isa, force)
    found["snow"] = tuple(CheckedSnow(*one) for one in found["snow"])
    found["objects"] = tuple(CheckedObject(*one) for one in found["objects"])
    found["warnings"] = tuple(SceneWarning(*one) for one in found["warnings"])
    found["step"] = TimeStep(*found["step"])
    found["memory"] = MemoryEstimate(*found["memory"])
    return CheckReport(**found)
