#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What firn writes, read by programs of others: tests/readers/test_files.py, with packages from PyPI in a virtual
environment of its own (build-readers/venv), and with tools of the system where they are installed. What cannot be
installed or is not there is skipped with a word.

usage: python3 tests/readers/run.py [FIRN [TEST...]]      FIRN is build/firn if not said"""
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "build-readers/venv"
# The name on PyPI, and the module that says whether it is there already.
PACKAGES = {
    "numpy": "numpy",  # all comparisons
    "pillow": "PIL",  # PNG, PPM, grey PFM, animated WebP
    "pypng": "png",  # PNG, in plain Python
    "opencv-python-headless": "cv2",  # PNG, PPM, PFM, MP4
    "OpenEXR": "OpenEXR",
    "xxhash": "xxhash",  # the hashes in run.json and in particle files
    "imageio-ffmpeg": "imageio_ffmpeg",  # an ffmpeg program where the system has none, for movie.mp4
    "av": "av",  # MP4, by the libraries of FFmpeg
    "tomlkit": "tomlkit",
}


def make_environment():
    """The interpreter of an environment that has what can be had."""
    python = ENVIRONMENT / "bin/python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    for package, module in PACKAGES.items():
        probe = [python, "-c", f"import importlib.util as modules, sys; sys.exit(modules.find_spec('{module}') is None)"]
        if subprocess.run(probe).returncode == 0:
            continue
        words = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:", package]
        if subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode != 0:
            print(f"{package} cannot be installed: what needs it is skipped")
    return python


if __name__ == "__main__":
    firn, *names = sys.argv[1:] or [ROOT / "build/firn"]
    if not Path(firn).exists():
        sys.exit(f"there is no {firn}: ./dev build makes it")
    tests = Path(__file__).with_name("test_files.py")
    sys.exit(subprocess.run([make_environment(), tests, Path(firn).resolve(), *names]).returncode)
