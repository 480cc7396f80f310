# SPDX-License-Identifier: MIT
"""What a session tells while it is at work."""
from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import ref


class Observer:
    """What a session tells while it is at work; override what is of interest.

    The methods are called from the threads of the session, one at a time since Python has one lock; the stage waits for
    them, so they are best brief. What they raise ends the session, and comes out of run() as it is. A session is not to
    be used in them.
    """

    def message(self, line: str) -> None:
        """A line for people; the log of the run has it too."""

    def made_folders(self, folders: list[str]) -> None:
        """Folders that the session made, the innermost last, empty as long as it has not begun; then an empty list."""

    def frames_begin(self, count: int, seconds: float) -> None:
        """So many frames are to be made, each of `seconds` as a first guess."""

    def frames_end(self) -> None:
        """No more frames are made, for whatever reason."""

    def stage_begins(self, stage: str, frame: int) -> None:
        """A stage of a frame begins: "simulate", "trace" or "write"."""

    def stage_ends(self, stage: str, frame: int) -> None:
        """It has ended."""


class Forward:
    """Hands on what the library tells to the observers of a session, which it does not keep alive: an observer may hold
    its session without a cycle that Python cannot see."""

    def __init__(self, owner: Any) -> None:
        self._owner = ref(owner)

    def __getattr__(self, method: str) -> Callable[..., None]:
        owner = self._owner()
        observers: list[Observer] = owner._observers if owner is not None else []

        def tell(*arguments: object) -> None:
            for observer in observers:
                getattr(observer, method)(*arguments)

        return tell
