# SPDX-License-Identifier: MIT
"""Progress bars: of tqdm where it is installed, else a plain one."""
from __future__ import annotations

import shutil
import sys
import time
from typing import Any, Callable, Protocol

from ._observer import Observer

_REDRAW = 0.1  # s


class Bar(Protocol):
    """A bar as this package uses it."""

    def show(self, done: float) -> None:
        """So much of the whole is done."""

    def close(self) -> None:
        """It has ended."""


def _in_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


def wanted(progress: bool | str | None) -> bool:
    """Whether a bar is to be drawn: "auto" in a terminal and in a notebook alone. Errors: TypeError."""
    if progress == "auto":
        return _in_notebook() or (sys.stderr is not None and sys.stderr.isatty())
    if progress is None or isinstance(progress, bool):
        return bool(progress)
    raise TypeError(f"progress is True, False or 'auto', not {progress!r}")


def bar(title: str, whole: float, unit: str) -> Bar:
    """A bar on the error stream, from 0 to `whole` units."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import]
    except ImportError:
        return PlainBar(title, whole, unit)
    return TqdmBar(tqdm, title, whole, unit)


class TqdmBar:
    """A bar of tqdm."""

    def __init__(self, tqdm: Callable[..., Any], title: str, whole: float, unit: str) -> None:
        form = "{desc}: {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"
        self._bar = tqdm(total=whole, desc=title, unit=unit, leave=True, bar_format=form)

    def show(self, done: float) -> None:
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        self._bar.close()


class PlainBar:
    """A line that is drawn again and again: "drop:  40 % of 24 frames, 0:12 gone, 0:18 left"."""

    def __init__(self, title: str, whole: float, unit: str) -> None:
        self._title, self._whole, self._unit = title, whole, unit
        self._began = time.monotonic()
        self._drawn = 0.0
        self._width = 0

    def show(self, done: float) -> None:
        now = time.monotonic()
        if now - self._drawn < _REDRAW and done < self._whole:
            return
        self._drawn = now
        self._write(self._line(done, now - self._began))

    def close(self) -> None:
        if self._width:
            print(file=sys.stderr, flush=True)

    def _line(self, done: float, gone: float) -> str:
        part = min(max(done / self._whole, 0.0), 1.0) if self._whole > 0 else 1.0
        line = f"{self._title}: {100 * part:3.0f} % of {self._whole:.4g} {self._unit}, {_clock(gone)} gone"
        return line + (f", {_clock(gone * (1 - part) / part)} left" if 0 < part < 1 else "")

    def _write(self, line: str) -> None:
        line = line[: shutil.get_terminal_size().columns - 1]
        print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
        self._width = len(line)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}" if minutes >= 60 else f"{minutes}:{rest:02}"


class SessionProgress(Observer):
    """The bar of a session: its frames that are written."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._bar: Bar | None = None
        self._written = 0

    def frames_begin(self, count: int, seconds: float) -> None:
        self._written = 0
        self._bar = bar(self._title, count, "frames")
        self._bar.show(0)

    def stage_ends(self, stage: str, frame: int) -> None:
        if stage == "write" and self._bar is not None:
            self._written += 1
            self._bar.show(self._written)

    def frames_end(self) -> None:
        if self._bar is not None:
            self._bar.close()
        self._bar = None
