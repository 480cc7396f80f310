# SPDX-License-Identifier: MIT
"""Points of other programs: arrays and files."""
from __future__ import annotations

import os
from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _core as library
from ._errors import place, usage_error
from ._values import path_text

Array = npt.NDArray[np.float64]
MaybeArray = Optional[npt.ArrayLike]

# What follows the number of points in the shape of each column; columns of numbers may be one number for all.
_ROWS: dict[str, tuple[int, ...]] = {
    "position": (3,), "velocity": (3,), "volume": (), "mass": (), "radius": (), "density": (), "Jp": (), "F": (3, 3),
}


def columns(where: str, given: dict[str, MaybeArray]) -> dict[str, Array]:
    """The columns that are given, as float64. Errors: UsageError at `where` for other shapes and types."""
    position = _column(where, "position", given["position"], None)
    found = {"position": position}
    for name, values in given.items():
        if name != "position" and values is not None:
            found[name] = _column(where, name, values, len(position))
    return found


def _column(where: str, name: str, values: MaybeArray, count: int | None) -> Array:
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise usage_error(where, f"'{name}' is of the type {array.dtype}, expected numbers")
    row = _ROWS[name]
    shape = f"({', '.join(['N' if count is None else str(count), *map(str, row)])}{'' if row else ','})"
    if not row and array.size == 1 and array.ndim <= 1:
        return np.ascontiguousarray(array, np.float64).reshape(1)
    if array.ndim != 1 + len(row) or array.shape[1:] != row or array.shape[0] != (array.shape[0] if count is None else count):
        turned = array.ndim == 2 and array.shape[0] == 3 and row == (3,)
        hint = ": give its transpose, a row a point" if turned else "" if row else " or one number"
        raise usage_error(where, f"'{name}' has the shape {array.shape}, expected {shape}{hint}")
    return np.ascontiguousarray(array, np.float64)


def read_points(path: str | os.PathLike[str]) -> dict[str, Array]:
    """The points of a file (.npz, .npy, .ply, a particle file of firn), as arrays of float64 by their names: those of
    Scene.add_points(), which takes them as add_points(**read_points(path)).

    Errors: FileError that names the file, and the point, counted from 0, or the array.
    """
    return library.read_points(path_text(path))


def write_points(
    path: str | os.PathLike[str],
    position: npt.ArrayLike,
    velocity: MaybeArray = None,
    volume: MaybeArray = None,
    mass: MaybeArray = None,
    radius: MaybeArray = None,
    density: MaybeArray = None,
    Jp: MaybeArray = None,
    F: MaybeArray = None,
) -> None:
    """Writes points as a NumPy archive (.npz), which scenes take as the `file` of shape = "particles"; the columns are
    those of Scene.add_points(). Errors: UsageError, FileError.
    """
    where = place()
    given = {"position": position, "velocity": velocity, "volume": volume, "mass": mass, "radius": radius,
             "density": density, "Jp": Jp, "F": F}
    library.write_points(columns(where, given), path_text(path))
