# SPDX-License-Identifier: MIT
"""Makes the reference of the library with Doxygen. Ends with 1 if a declaration has no comment, or a wrong one.

usage: make.py [FOLDER]    (default: build/docs/api, which is made anew)"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def version():
    text = (ROOT / "include/firn/version.h").read_text(encoding="utf-8")
    return ".".join(re.findall(r"#define FIRN_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", text))


def make(folder):
    """What Doxygen complains about, line by line."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    options = (ROOT / "docs/api/Doxyfile").read_text(encoding="utf-8")
    options += f'\nPROJECT_NUMBER = {version()}\nOUTPUT_DIRECTORY = "{folder.resolve()}"\n'
    done = subprocess.run(["doxygen", "-"], input=options, cwd=ROOT, capture_output=True, text=True)
    complaints = [line.replace(f"{ROOT}/", "") for line in done.stderr.splitlines() if line.strip()]
    return complaints or ([f"doxygen ended with {done.returncode}"] if done.returncode else [])


if __name__ == "__main__":
    wrong = make(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/docs/api")
    print("\n".join(wrong), end="\n" if wrong else "")
    sys.exit(1 if wrong else 0)
