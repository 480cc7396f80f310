# SPDX-License-Identifier: MIT
"""A scene run as the program `firn` runs it, with its progress, stopped in the middle and gone on with. Ctrl-C would do the
same as the stop here.

usage: session.py SCENE RUN_FOLDER [THREADS]"""
import sys
import threading

import firn


class HalfWay(firn.Observer):
    """Says what is traced, and asks for a stop when half of the frames are written."""

    def __init__(self, frames: int) -> None:
        self.left = frames // 2
        self.reached = threading.Event()

    def message(self, line: str) -> None:
        print(line)

    def stage_ends(self, stage: str, frame: int) -> None:
        if stage == "trace":
            print("traced frame", frame)
        self.left -= stage == "write"
        if self.left == 0:
            self.reached.set()


if not 3 <= len(sys.argv) <= 4:
    sys.exit(__doc__)
threads = int(sys.argv[3]) if len(sys.argv) == 4 else 0
try:
    scene = firn.Scene.read(sys.argv[1], quick=True)
    observer = HalfWay(scene.frames)
    session = firn.Session.start(scene, out=sys.argv[2], threads=threads, overwrite=True, observer=observer)
    result = session.run(observer.reached)
    if result.interrupted:
        print(f"stopped: {result.kept} frames are kept, {len(result.left)} are left")
        result = firn.Session.resume(sys.argv[2], threads=threads, observer=observer).run()
    print("interrupted" if result.interrupted else "complete")
except firn.Error as error:
    sys.exit(str(error))
