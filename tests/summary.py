# SPDX-License-Identifier: MIT
"""Reads meson's log of a test run and ends with one line: N passed, N failed. Catch2 test cases are counted one by one
from each program's own summary, other tests by their summary line if they print one, else as one each. A program that
crashed or ran out of time counts as a failure on top of what it had reported.

usage: summary.py TESTLOG.json"""
import json
import re
import sys
from pathlib import Path

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


def main(log):
    passed = failed = 0
    if not Path(log).exists():
        print("0 passed, 1 failed")
        return 1
    for line in Path(log).read_text(encoding="utf-8").splitlines():
        test = json.loads(line)
        if test["result"] == "SKIP":
            print(f"skipped: {test['name']}: {test.get('stdout', '').strip()}", file=sys.stderr)
            continue
        good, bad = count(test["result"], test.get("stdout", ""))
        passed += good
        failed += bad
        if bad:
            print(f"failed: {test['name']} ({test['result']})", file=sys.stderr)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
