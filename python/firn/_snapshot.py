# SPDX-License-Identifier: MIT
"""How snapshots are pickled."""
from __future__ import annotations

from typing import Any

from ._core import Snapshot

_COLUMNS = ("position", "velocity", "density", "volume0", "rotation", "id", "object")
_STATE = ("F", "Jp", "J", "stress")
_PLAIN = ("frame", "time", "dx", "driven")


def reduced(snapshot: Snapshot) -> tuple[object, ...]:
    """For Snapshot.__reduce__: copies of all that it holds."""
    state = [name for name in _STATE if getattr(snapshot, name) is not None]
    columns = {name: getattr(snapshot, name).copy() for name in (*_COLUMNS, *state)}
    plain = {name: getattr(snapshot, name) for name in _PLAIN}
    return restored, (snapshot.size, state, plain, snapshot.origin.tolist(), columns)


def restored(size: int, state: list[str], plain: dict[str, Any], origin: list[float], columns: dict[str, Any]) -> Snapshot:
    """What reduced() took apart."""
    snapshot = Snapshot(size, **{name: True for name in state})
    for name, value in plain.items():
        setattr(snapshot, name, value)
    setattr(snapshot, "origin", origin)  # an array when it is read, three numbers of any kind when it is written
    for name, column in columns.items():
        getattr(snapshot, name)[...] = column
    return snapshot
