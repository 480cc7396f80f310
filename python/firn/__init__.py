# SPDX-License-Identifier: MIT
"""firn: snow, simulated as a material and path traced as light, on CPUs.

Scene        read from a file, made in Python, or both
Simulation   the snow of a scene, stepped by the program: particles as NumPy arrays, colliders that a function drives
Renderer     pictures of snapshots, as NumPy arrays
Session      a scene run with its folder, from its beginning to its movie, after any interruption

docs/python.md has the shapes and units, examples/python whole programs.
"""
from __future__ import annotations

from ._check import CheckedObject, CheckedSnow, CheckReport, MemoryEstimate, SceneWarning, check_scene
from ._core import Snapshot, revision as _revision, version as _version
from ._driver import ColliderVelocity, DrivenCollider
from ._errors import Error, FileError, UnstableError, UsageError
from ._metrics import ContactForce, Metrics, TimeStep
from ._observer import Observer
from ._points import read_points, write_points
from ._renderer import Picture, Renderer
from ._scene import Scene
from ._session import Session, SessionResult, StageInterval
from ._simulation import Simulation

__version__: str = _version()
__revision__: str = _revision()

__all__ = [
    "CheckReport",
    "CheckedObject",
    "CheckedSnow",
    "ColliderVelocity",
    "ContactForce",
    "DrivenCollider",
    "Error",
    "FileError",
    "MemoryEstimate",
    "Metrics",
    "Observer",
    "Picture",
    "Renderer",
    "Scene",
    "SceneWarning",
    "Session",
    "SessionResult",
    "Simulation",
    "Snapshot",
    "StageInterval",
    "TimeStep",
    "UnstableError",
    "UsageError",
    "check_scene",
    "read_points",
    "write_points",
]

# People see the classes where they take them from.
for _name in __all__:
    globals()[_name].__module__ = __name__
del _name
