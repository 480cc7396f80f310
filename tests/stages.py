# SPDX-License-Identifier: MIT
"""What each stage of the tests took: a build, or one test of meson. tests/summary.py leaves a record in the build folder
(stages.json) with the commit, the date and the machine; this program prints the records beside the minutes that each part
of .ci/run may take, as './dev budget' does. It only reports.

usage: stages.py
       stages.py FOLDER STAGE SECONDS FAILED     leaves a record of a stage that is no test of meson"""
import datetime
import json
import os
import platform
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SANITIZED = ["build-asan", "build-tsan"]
# The parts of .ci/run on two cores, with their minutes and the meson suites that count for them.
ROWS = [
    ("build", 6, []),
    ("unit suites and lint", 4, ["kernels", "trace", "graph", "io", "scene", "fuzz", "lint"]),
    ("light", 6, ["light"]),
    ("physics", 6, ["physics"]),
    ("scenes", 3, ["scenes"]),
    ("runs and program", 4, ["program", "bits", "runs"]),
    ("Python and examples", 2, ["library", "python"]),
    ("sanitizers", 6, []),
    ("terrain", 2, ["terrain"]),
    ("view", 2, ["view"]),
    ("figures", 2, ["figures"]),
    ("ranks", 2, ["ranks"]),
]


def output_of(*words):
    try:
        return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def cpu():
    try:
        names = re.findall(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    except OSError:
        names = []
    return names[0] if names else platform.machine()


def circumstances():
    """Where and of which commit something was measured, as every record has it."""
    return {
        "commit": output_of("git", "rev-parse", "HEAD"),
        "dirty": bool(output_of("git", "status", "--porcelain")),
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "cpu": cpu(),
        "cores": len(os.sched_getaffinity(0)),
    }


def read(folder):
    """{stage: record} of a build folder."""
    path = Path(folder, "stages.json")
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def add(folder, records):
    """Puts the records of stages in place of older ones of the same stages."""
    stages = read(folder)
    around = circumstances()
    stages.update({name: record | around for name, record in records.items()})
    Path(folder, "stages.json").write_text(json.dumps(stages, indent=1) + "\n", encoding="utf-8")


def suites_of_tests(folder):
    """{test: its suites}, of all that the build folder knows."""
    path = Path(folder, "meson-info/intro-tests.json")
    tests = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    return {test["name"]: [suite.split(":")[-1] for suite in test["suite"]] for test in tests}


def stages_of(suites):
    """{stage: record or None} of one row."""
    records, known = read(ROOT / "build"), suites_of_tests(ROOT / "build")
    ours = {name: records.get(name) for name, of in known.items() if set(of) & set(suites)}
    return ours | (read(ROOT / "build-python") if "python" in suites else {})


def sanitized_stages():
    return {f"{folder.removeprefix('build-')} {name}": record
            for folder in SANITIZED for name, record in (read(ROOT / folder) or {"all": None}).items()}


def describe(name, record, head):
    notes = [record["note"]] if record.get("note") else []
    notes += ["failed"] if record["failed"] else []
    notes += ["another commit"] if record["commit"] != head else ["uncommitted changes"] if record["dirty"] else []
    return f"{name} {record['seconds']:.0f} s{' (' + ', '.join(notes) + ')' if notes else ''}"


def row_text(title, minutes, stages, head):
    ran = sorted(((name, record) for name, record in stages.items() if record), key=lambda item: -item[1]["seconds"])
    took = sum(record["seconds"] for _, record in ran) / 60
    told = [item for item in ran if item[1]["seconds"] >= 1 or item[1]["failed"] or item[1].get("note")]
    said = [describe(name, record, head) for name, record in told]
    if len(told) < len(ran):
        said.append(f"{len(ran) - len(told)} below a second")
    if missing := [name for name, record in stages.items() if not record]:
        said.append("not run: " + ", ".join(missing))
    mark = "OVER" if took > minutes else ""
    return f"{title:22}{f'{took:.1f}' if ran else '-':>6}{minutes:>5}  {mark:6}{', '.join(said) or 'nothing yet'}", took


def main(words):
    if words:
        folder, stage, seconds, failed = words
        return add(folder, {stage: {"seconds": float(seconds), "failed": int(failed)}})
    head = output_of("git", "rev-parse", "HEAD")
    total, allowed = 0, sum(minutes for _, minutes, _ in ROWS)
    print(f"{'':22}{'took':>6}{'of':>5}  minutes; the last run of each stage")
    for title, minutes, suites in ROWS:
        if title == "build":
            stages = {"build": read(ROOT / "build").get("build")}
        elif title == "sanitizers":
            stages = sanitized_stages()
        else:
            stages = stages_of(suites)
        text, took = row_text(title, minutes, stages, head)
        total += took
        print(text)
    print(f"{'all':22}{total:>6.1f}{allowed:>5}  {'OVER' if total > allowed else ''}".rstrip())
    records = [record for folder in ["build", *SANITIZED] for record in read(ROOT / folder).values()]
    for machine in sorted({f"{record['cpu']}, {record['cores']} cores" for record in records}):
        print(f"measured on {machine}")
    if records:
        print(f"between {min(r['date'] for r in records)} and {max(r['date'] for r in records)}; HEAD is {head[:9]}")


if __name__ == "__main__":
    main(sys.argv[1:])
