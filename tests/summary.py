# SPDX-License-Identifier: MIT
"""Reads meson's log of a test run and ends with one line: N passed, N failed. Catch2 test cases are counted one by one
from each program's own summary, other tests by their summary line if they print one, else as one each. A program that
crashed or ran out of time counts as a failure on top of what it had reported. What each test took, and what meson built
before them, goes into the record of stages (tests/stages.py).

usage: summary.py BUILD_FOLDER LOG_NAME BEGAN    (BEGAN: when 'meson test' was called, in seconds since 1970)"""
import json
import re
import sys
import time
from pathlib import Path

import stages

CATCH_ALL = re.compile(r"All tests passed \([\d,]+ assertions? in (\d+) test cases?\)")
CATCH_SOME = re.compile(r"^test cases:\s*(.*)$", re.M)
OWN = re.compile(r"^(\d+) passed, (\d+) failed$", re.M)


def count(result, output):
    """(passed, failed) of one meson test."""
    good = result in ("OK", "EXPECTEDFAIL")
    if match := CATCH_ALL.search(output):
        return int(match.group(1)), 0 if good else 1
    if match := CATCH_SOME.search(output):
        numbers = {word: int(number) for number, word in re.findall(r"(\d+) (passed|failed)", match.group(1))}
        return numbers.get("passed", 0), max(numbers.get("failed", 0), 0 if good else 1)
    if matches := OWN.findall(output):
        passed, failed = map(int, matches[-1])
        return passed, max(failed, 0 if good else 1)
    return (1, 0) if good else (0, 1)


def name_of(test):
    """Without its suites, which meson puts in front."""
    return test["name"].split(" / ")[-1]


def build_records(folder, began, seconds):
    """meson builds what the asked tests need, so a build may be of everything, or of nothing, which is no build."""
    objects = [path.stat().st_mtime >= began for path in Path(folder).rglob("*.o")]
    if not any(objects):
        return {}
    return {"build": {"seconds": seconds, "passed": 0, "failed": 0, "note": f"{sum(objects)} of {len(objects)} objects"}}


def main(folder, name, began):
    log = Path(folder, "meson-logs", f"{name}.json")
    elapsed = time.time() - began
    if not log.exists():
        failed_build = {"seconds": elapsed, "passed": 0, "failed": 1, "note": "no test was run"}
        stages.add(folder, {"build": failed_build})
        print("0 passed, 1 failed")
        return 1
    passed = failed = 0
    tests = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    records = build_records(folder, began, max(0, elapsed - sum(test["duration"] for test in tests)))
    for test in tests:
        if test["result"] == "SKIP":
            print(f"skipped: {test['name']}: {test.get('stdout', '').strip()}", file=sys.stderr)
            records[name_of(test)] = {"seconds": test["duration"], "passed": 0, "failed": 0, "note": "skipped"}
            continue
        good, bad = count(test["result"], test.get("stdout", ""))
        passed += good
        failed += bad
        records[name_of(test)] = {"seconds": test["duration"], "passed": good, "failed": bad}
        if bad:
            print(f"failed: {test['name']} ({test['result']})", file=sys.stderr)
    stages.add(folder, records)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], float(sys.argv[3])))
