# SPDX-License-Identifier: MIT
"""The programs of docs/figures still draw: all figures from the curves that the tests of this build folder have left, at
the tests' own sizes, and those of stored measurements to the bytes that the documents show. Measures nothing itself.

usage: check_figures.py [--whole] CURVES OUT [physics|light]
CURVES: what FIRN_CURVES or FIRN_FIGURES was for the tests; --whole: it is a fault if a figure has no curve"""
import sys
import xml.etree.ElementTree
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs/figures"))
import light  # noqa: E402
import validation  # noqa: E402

PROGRAMS = {"physics": validation, "light": light}
STORED = [f"time_{scene}.svg" for scene in light.TIMED]
LARGER_ONLY = {"finer"}  # its curves are of sizes that only './dev figures' takes


def faults_of(path, document):
    """What is wrong with a figure, or None; document: the folder of those that are shown."""
    try:
        drawn = xml.etree.ElementTree.parse(path).getroot()
    except xml.etree.ElementTree.ParseError as error:
        return f"is no XML: {error}"
    shown = document / path.name
    if not shown.exists():
        return f"{document.relative_to(ROOT)} has no such figure"
    if path.name in STORED and path.read_bytes() != shown.read_bytes():
        return f"differs from {shown.relative_to(ROOT)}: run './dev figures light'"
    # Axes, and at least one mark that is not of the frame.
    return None if len(drawn.findall("{*}g/*")) else "shows nothing"


def main(curves, out, parts, whole):
    passed, wrong, left = 0, [], []
    for program in (PROGRAMS[part] for part in parts):
        folder = out / program.OUT.name
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("*.svg"):
            old.unlink()
        left += [name for name in program.main(curves, folder) if whole or name not in LARGER_ONLY]
        for path in sorted(folder.glob("*.svg")):
            fault = faults_of(path, program.OUT)
            passed += not fault
            wrong += [f"{path.name}: {fault}"] if fault else []
    if whole:
        wrong += [f"{name}: no curve" for name in left]
    for line in wrong:
        print(line)
    if left and not whole:
        print(f"no curves of {', '.join(left)}: './dev test physics light' makes them")
    print(f"{passed} passed, {len(wrong)} failed")
    return 1 if wrong or not passed else 0


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "--whole"]
    sys.exit(main(Path(given[0]), Path(given[1]).resolve(), given[2:] or list(PROGRAMS), "--whole" in sys.argv))
