# SPDX-License-Identifier: MIT
"""Runs the tests of this folder against a built program.

usage: run.py FIRN [fast | slow | CLASS | CLASS.TEST ...]"""
import sys
import unittest

from program import ProgramTest
from checks import Checks, Estimates
from damage import Damage, MadeAgain
from interruptions import FirstFrame, Interruptions, Movies
from points import Points
from runs import Refusals, Runs
from same_bits import SameBits
from words import Words
from writers import Sharing, Writers

FAST = [Checks, Damage, Movies, Points, Refusals, Runs, SameBits, Words, Writers]
SLOW = [Estimates, FirstFrame, Interruptions, MadeAgain, Sharing]


def main(words):
    kinds = {"fast": [kind.__name__ for kind in FAST], "slow": [kind.__name__ for kind in SLOW]}
    names = [name for word in words for name in kinds.get(word, [word])] or kinds["fast"] + kinds["slow"]
    program = unittest.main(argv=[sys.argv[0], *names], exit=False, verbosity=2)
    failed = len(program.result.failures) + len(program.result.errors)
    print(f"{program.result.testsRun - failed} passed, {failed} failed")
    return 1 if failed or not program.result.testsRun else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[2:]))
