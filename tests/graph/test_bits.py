# SPDX-License-Identifier: MIT
"""One expected pair of hashes for each scene, of its snow and of its pictures, whatever compiler, instruction set or
number of threads made them. bits.json beside this file has them: for x86-64-v3 and v4, which promise the same bits, and
for `base`, which promises its own. Every scene of scenes/ is run at its --quick size with a small picture; variants of a
few scenes ask for each integrator, kind of snow and film.

usage: test_bits.py FIRN             the best instruction set of this CPU
       test_bits.py FIRN --slow      every one, and long runs of those that promise the same bits
       test_bits.py FIRN --all       long runs of every one
       test_bits.py FIRN --record    writes bits.json anew: for a change that means to change bits"""
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCENES = HERE.parents[1] / "scenes"
EXPECTED = HERE / "bits.json"
SMALL = ["image.width=64", "image.height=48", "image.samples=4", "time.frames=3"]
VARIANTS = {
    "two_snowballs": {
        "path": ["image.integrator='path'", "image.max_bounces=8"],
        "light": ["image.integrator='light'"],
        "bidirectional": ["image.integrator='bidirectional'"],
        "preview": ["image.integrator='preview'"],
        "spheres": ["image.snow='spheres'"],
        "light inside": ["image.snow_light='inside'"],
        "light inside spheres": ["image.snow='spheres'", "image.snow_light='inside'"],
        "noise": ["image.noise=0.1", "image.samples=32"],
        "independent": ["image.sampler='independent'", "image.filter='gaussian'"],
        "blur": ["camera.shutter=0.5", "camera.aperture=0.01"],
        "denoised": ["output.denoise=true", "image.filter='blackman_harris'"],
    },
    "cornell_box": {
        "path": ["image.integrator='path'"],
        "light": ["image.integrator='light'"],
        "reference": ["image.reference=true"],
    },
    "powder_in_sun": {"bidirectional": ["image.integrator='bidirectional'"]},
    "snow_cave": {"bidirectional": ["image.integrator='bidirectional'"]},
}
# Long enough for impacts, flow and rest.
LONG = {"two_snowballs": 24, "avalanche": 24, "snowball_drop": 24, "column_collapse": 12, "slab_release": 24,
        "snowfall": 24}


def cases(long_too):
    """(name, scene, assignments), the name being the key in bits.json."""
    for path in sorted(SCENES.glob("*.toml")):
        yield path.stem, path, SMALL
        for name, changes in VARIANTS.get(path.stem, {}).items():
            yield f"{path.stem}, {name}", path, [*SMALL, "time.frames=2", *changes]
        if long_too and path.stem in LONG:
            yield f"{path.stem}, long", path, [*SMALL, "image.samples=1", f"time.frames={LONG[path.stem]}"]


def hashes(firn, scene, assignments, isa, threads):
    """{"snow": ..., "picture": ...} of the last frame of a run."""
    with tempfile.TemporaryDirectory(prefix="firn-bits-") as folder:
        out = Path(folder, "run")
        words = [firn, "run", scene, "--quick", "--quiet", "--isa", isa, "--threads", threads, "--out", out]
        for assignment in assignments:
            words += ["--set", assignment]
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        if done.returncode != 0:
            return {"failed": done.stderr.strip() or f"exit code {done.returncode}"}
        last = json.loads((out / "frames.jsonl").read_text().splitlines()[-1])
        return {"snow": last["particles_hash"], "picture": last["picture_hash"]}


def offered(firn):
    described = subprocess.run([firn, "info"], capture_output=True, text=True, check=True).stdout
    return re.search(r"instruction sets\s+(.*?) \(", described).group(1).split(", ")


def column(isa):
    return "base" if isa == "base" else "v3 and v4"


def record(firn):
    expected = {name: {column(isa): hashes(firn, scene, assignments, isa, 2) for isa in offered(firn)}
                for name, scene, assignments in cases(long_too=True)}
    if failures := [name for name, columns in expected.items() if any("failed" in c for c in columns.values())]:
        sys.exit(f"nothing is recorded: these runs failed: {', '.join(failures)}")
    EXPECTED.write_text(json.dumps(expected, indent=1) + "\n")


def main(firn, which):
    expected = json.loads(EXPECTED.read_text())
    sets = offered(firn) if which else offered(firn)[-1:]
    asked = [(*case, isa, 1 + (turn + len(case[0])) % 3) for case in cases(long_too=bool(which))
             for turn, isa in enumerate(sets) if which == "--all" or isa != "base" or not case[0].endswith(", long")]

    def ask(case):
        """Whether the bits are those expected; says so."""
        name, scene, assignments, isa, threads = case
        begin = time.monotonic()
        found, wanted = hashes(firn, scene, assignments, isa, threads), expected.get(name, {}).get(column(isa))
        print(f"{'ok' if found == wanted else 'WRONG'} {time.monotonic() - begin:6.2f} s  {name}, {isa}, {threads} threads"
              + ("" if found == wanted else f": {found}, expected {wanted}"), flush=True)
        return found == wanted

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:  # small runs leave cores idle
        good = list(pool.map(ask, asked))
    passed, failed = sum(good), len(good) - sum(good)
    for name in expected.keys() - {name for name, _, _ in cases(long_too=True)}:
        failed += 1
        print(f"WRONG bits.json has '{name}', which is no case")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    program = os.path.abspath(sys.argv[1])
    asked_for = sys.argv[2] if len(sys.argv) > 2 else None
    if asked_for == "--record":
        record(program)
    elif asked_for in (None, "--slow", "--all"):
        sys.exit(main(program, asked_for))
    else:
        sys.exit(__doc__.partition("usage: ")[2])
