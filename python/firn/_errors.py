# SPDX-License-Identifier: MIT
"""What firn raises, and the places in people's programs that it names."""
from __future__ import annotations

import os
import sys

_PACKAGE = __name__.partition(".")[0]


class Error(Exception):
    """Whatever firn raises on purpose; its text is one line: where, what is wrong, what was expected.

    code    "failed" (firn's own fault), "usage", "unstable", "io" or "interrupted"
    where   "script.py:12", "scene.toml:3:1", a path, the name of an option, or ""

    Memory that is not to be had raises MemoryError, as everywhere.
    """

    code: str = "failed"
    where: str = ""

    def __reduce__(self) -> tuple[object, ...]:
        return (_restored, (type(self), str(self), self.code, self.where))


class UsageError(Error, ValueError):
    """What was asked for: a scene, a value, an argument; its code is "usage"."""

    code = "usage"


class UnstableError(Error, ArithmeticError):
    """The simulation blew up; its code is "unstable"."""

    code = "unstable"


class FileError(Error, OSError):
    """A file that cannot be read or written, or holds something else; its code is "io"."""

    code = "io"


_CLASSES: dict[str, type[Error]] = {"usage": UsageError, "unstable": UnstableError, "io": FileError}


def _restored(kind: type[Error], text: str, code: str, where: str) -> Error:
    error = kind(text)
    error.code, error.where = code, where
    return error


def error_of(code: str, where: str, text: str) -> Error:
    """The exception for an error of the library; `text` begins with `where` already."""
    return _restored(_CLASSES.get(code, Error), text, code, where)


def usage_error(where: str, what: str) -> Error:
    """A UsageError of the package itself."""
    return error_of("usage", where, f"{where}: {what}" if where else what)


def place() -> str:
    """Where the program calls the package from: "script.py:12", or "cell:3" in a notebook."""
    frame = sys._getframe(1)
    while frame.f_back and str(frame.f_globals.get("__name__", "")).partition(".")[0] == _PACKAGE:
        frame = frame.f_back
    name = frame.f_code.co_filename
    is_cell = "ipykernel_" in name or name.startswith("<ipython-input")
    return f"{'cell' if is_cell else os.path.basename(name)}:{frame.f_lineno}"
