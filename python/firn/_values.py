# SPDX-License-Identifier: MIT
"""Values that people give, as Python's own types, which the library takes."""
from __future__ import annotations

import numbers
import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._errors import usage_error

# What a key of a scene may have: true or false, a number, a text, a path, or a sequence or array of these, or a table
# (a dict). NumPy's scalars and arrays count as what they hold. mypy knows no recursive union with Sequence[str] in it.
Value = Union[bool, int, float, str, "os.PathLike[str]", np.generic, npt.NDArray[Any], Sequence[Any], Mapping[str, Any]]
Plain = Any  # bool, int, float, str, list or dict of these

_DEEPEST = 32
_LARGEST = 2**63


def plain(value: object, key: str, where: str, depth: int = 0) -> Plain:
    """`value` as bool, int, float, str, list or dict. Errors: UsageError at `where` for what no key can have."""
    if depth > _DEEPEST:
        raise usage_error(where, f"'{key}' is nested more than {_DEEPEST} deep")
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, numbers.Integral):
        return _whole(operator.index(value), key, where)
    if isinstance(value, numbers.Real):
        return float(value)
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return _text(str(value), key, where)
    if isinstance(value, Mapping):
        return table(value, where, key, depth + 1)
    if isinstance(value, np.ndarray):
        return plain(value.tolist(), key, where, depth + 1)
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray, memoryview)):
        return [plain(item, key, where, depth + 1) for item in value]
    raise usage_error(where, f"'{key}' is {_named(value)}: a scene takes true or false, numbers, texts, and sequences and "
                             "dicts of these")


def table(keys: Mapping[Any, object], where: str, name: str = "", depth: int = 0) -> dict[str, Plain]:
    """Keys with their values, likewise."""
    for key in keys:
        if not isinstance(key, str):
            raise usage_error(where, f"{key!r} is no name of a key{f' of {name!r}' if name else ''}: names are texts")
    return {_text(str(key), "a key", where): plain(value, str(key), where, depth) for key, value in keys.items()}


def merged(keys: Mapping[str, object] | None, more: Mapping[str, object], where: str) -> dict[str, Plain]:
    """Keys that were given as a dict and as arguments."""
    if keys is not None and not isinstance(keys, Mapping):
        raise usage_error(where, f"keys are a dict, or arguments with names, not {_named(keys)}")
    for key in more:
        if keys is not None and key in keys:
            raise usage_error(where, f"the key '{key}' is given twice")
    return table({**(keys or {}), **more}, where)


def path_text(path: str | os.PathLike[str]) -> str:
    """A path as the library takes it. Errors: TypeError for what is none."""
    text = os.fspath(path)
    if not isinstance(text, str):
        raise TypeError(f"a path is a text, not {_named(text)}")
    if "\0" in text:
        raise ValueError(f"a path has no NUL in it: {text!r}")
    return text


def small(name: str, value: object) -> int:
    """A whole number of 32 bits. Errors: TypeError, UsageError."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} is a whole number, not {value!r}")
    number = operator.index(value)
    if not -(2**31) <= number < 2**31:
        raise usage_error(name, f"{number} is out of range")
    return number


def overrides_text(overrides: Mapping[str, object] | None, where: str) -> list[tuple[str, str]]:
    """Paths with their values as TOML."""
    if overrides is None:
        return []
    return [(path, _toml(value)) for path, value in merged(overrides, {}, where).items()]


def vector(value: object, what: str) -> tuple[float, float, float]:
    """Three numbers. Errors: UsageError."""
    try:
        x, y, z = (float(item) for item in value) if isinstance(value, Iterable) else ()
    except (TypeError, ValueError):
        raise usage_error("", f"{what} is three numbers, not {value!r}") from None
    return x, y, z


def _whole(value: int, key: str, where: str) -> int:
    if not -_LARGEST <= value < _LARGEST:
        raise usage_error(where, f"'{key}' is {value}: a whole number of a scene is below 2^63 = {_LARGEST}")
    return value


def _text(value: str, key: str, where: str) -> str:
    if "\0" in value:
        raise usage_error(where, f"'{key}' is {value!r}: a text of a scene has no NUL in it")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise usage_error(where, f"'{key}' is {value!r}, which is no text in UTF-8") from None
    return value


def _named(value: object) -> str:
    return "None" if value is None else f"of the type {type(value).__name__}"


def _toml(value: Plain) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)  # inf and nan are TOML's words too
    if isinstance(value, str):
        return '"' + "".join(_escaped(character) for character in value) + '"'
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    return "[" + ", ".join(_toml(item) for item in value) + "]"


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    return f"\\u{ord(character):04x}" if ord(character) < 32 or ord(character) == 127 else character
