# SPDX-License-Identifier: MIT
"""The files of the repository as the lint checks see them, and how a check ends."""
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ["include", "kernels", "src", "examples", "tests", "bench", "docs", "scenes", "packages", "python"]
SKIPPED = {"__pycache__"}


def files(*suffixes, under=None):
    """Sorted paths relative to ROOT, of all rooms or of the given ones."""
    found = []
    for room in under or ROOMS:
        for folder, inner, names in os.walk(ROOT / room):
            inner[:] = [name for name in inner if name not in SKIPPED]
            found += [Path(folder, name).relative_to(ROOT) for name in names if name.endswith(suffixes)]
    return sorted(found)


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def finish(complaints, checked):
    """Prints every complaint and ends the program: 1 if there was one, or if nothing was checked at all."""
    for complaint in complaints:
        print(complaint)
    if not checked:
        print("nothing was checked: the check looks in the wrong place")
    print(f"{checked} checked, {len(complaints)} wrong")
    sys.exit(1 if complaints or not checked else 0)
