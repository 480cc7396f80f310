# SPDX-License-Identifier: MIT
"""Runs the benchmark over sizes, threads and instruction sets and keeps the figures in bench/results/MACHINE.json, one
entry a run with its command. Named runs replace only themselves. Meant for a quiet machine: `./dev bench record`.

usage: record.py FIRN_BENCH [RUN...]"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def steps_for(particles):
    """An impact takes as long as the ball is wide: so many steps of a ball of another size reach the same stage of it as
    400 of a million particles do."""
    return round(400 * (particles / 1e6) ** (1 / 3))


def size(particles):
    return ["--particles", str(particles), "--steps", str(steps_for(particles)), "--no-naive"]


# Run -> arguments of firn-bench. 100 steps of a scene in which every step is like the last are enough.
RUNS = {
    "impact": ["sim"],
    "impact, two threads": ["sim", "--threads", "2", "--no-naive"],
    "impact, x86-64-v3": ["sim", "--isa", "x86-64-v3", "--no-naive"],
    "impact, 100k": ["sim", *size(100_000)],
    "impact, 8M": ["sim", *size(8_000_000)],
    "impact, baseline of a converged SVD": ["sim", "--naive-svd", "converged"],
    "falling": ["sim", "--scene", "falling", "--steps", "100"],
    "settled": ["sim", "--scene", "settled", "--steps", "100"],
    "kernels": ["kernels"],
    "kernels, x86-64-v3": ["kernels", "--isa", "x86-64-v3"],
    "resting": ["resting"],
    "trace, ball": ["trace"],
    "trace, ball of wide balls": ["trace", "--radius", "1.0"],
    "trace, slab": ["trace", "--shape", "slab"],
    "trace, 5M": ["trace", "--particles", "5000000"],
    "preview, ball": ["preview"],
    "preview, slab": ["preview", "--shape", "slab"],
    "rule, ball": ["rule"],
    "rule, slab": ["rule", "--shape", "slab"],
    "mesh": ["mesh"],
    "mesh, x86-64-v3": ["mesh", "--isa", "x86-64-v3"],
    "mesh, 1M": ["mesh", "--triangles", "1000000"],
}


def rounded(value):
    """Six significant digits: no benchmark repeats better."""
    if isinstance(value, dict):
        return {key: rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [rounded(inner) for inner in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def commit():
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty=+"]
    described = subprocess.run(words, capture_output=True, text=True)
    return described.stdout.strip() or "unknown"


def known_commands(program):
    usage = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    return {line.split()[2] for line in usage.splitlines() if line.startswith("usage: firn-bench")}


def run(program, arguments):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "figures.json")
        subprocess.run([program, *arguments, "--json", str(path)], check=True)
        return json.loads(path.read_text())


def main(program, names):
    if unknown := [name for name in names if name not in RUNS]:
        sys.exit(f"no such run: {', '.join(unknown)}; there are: {', '.join(RUNS)}")
    commands, revision = known_commands(program), commit()
    for name in names or RUNS:
        arguments = RUNS[name]
        if arguments[0] not in commands:
            print(f"firn-bench has no '{arguments[0]}': '{name}' is left out", file=sys.stderr)
            continue
        print(f"\n== {name}: firn-bench {' '.join(arguments)}", file=sys.stderr, flush=True)
        figures = rounded(run(program, arguments))
        machine, compiler = figures.pop("machine"), figures.pop("compiler")
        path = ROOT / "bench" / "results" / (machine["slug"] + ".json")
        runs = json.loads(path.read_text())["runs"] if path.exists() else {}
        command = "build/bench/firn-bench " + " ".join(arguments)
        runs[name] = {"command": command, "commit": revision, "compiler": compiler, **figures}
        kept = {"machine": machine, "runs": {name: runs[name] for name in RUNS if name in runs}}
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
