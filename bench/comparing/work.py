# SPDX-License-Identifier: MIT
"""What both sides are to do: the words that run it, and what can be read when it has ended. Everything that a run writes
goes into a folder of its own, which the caller deletes."""
import hashlib
import json
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import record
from comparing.figures import flat
from comparing.sides import ROOT, Refusal

KINDS = """WHAT is one of
  sim, trace, kernels, ... [ARGS]    a command of firn-bench with its arguments
  frame SCENE [--frame N] [ARGS]     the picture of one frame (0 unless said); its snow is simulated once, outside the clock
  movie SCENE [ARGS]                 a whole run, from the scene to the movie (--quick for its small size)
  run WORD...                        any command; {firn}, {firn-bench} and {tree} in it are each side's, {out} is an empty
                                     folder, {json} a file in which firn-bench leaves its figures"""
RENDER_VALUES, RENDER_FLAGS = {"--threads", "--isa"}, {"--no-overlap"}


@dataclass
class Reading:
    """What a run tells of itself: its leaves, and a hash of its snow and pictures ("" where there is none)."""
    leaves: dict = field(default_factory=dict)
    pictures: str = ""


def read_json(path):
    return json.loads(path.read_text()) if path.exists() else {}


def journal_of(path):
    """The records of the frames, in their order; commits before version 0.2 keep them in run.json."""
    records = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return sorted(records, key=lambda record: record["frame"])


def total(frames, key):
    """The sum over the frames, or None if this version does not tell it."""
    values = [frame.get(key) for frame in frames]
    return None if None in values else sum(values)


def read_run(folder):
    """Seconds by stage and hashes of a run folder."""
    run = read_json(folder / "run.json")
    frames = run.get("frames") or journal_of(folder / "frames.jsonl")
    sums = {key: total(frames, key) for key in ("simulate_s", "trace_s", "choice_s", "write_s", "rays", "particle_steps")}
    for rate, amount, seconds in (("rays_per_second", "rays", "trace_s"),
                                  ("particle_steps_per_second", "particle_steps", "simulate_s")):
        sums[rate] = sums[amount] / sums[seconds] if sums[amount] and sums[seconds] else None
    told = {key: run.get(key) for key in ("bytes_per_particle", "threads", "isa")}
    leaves = {key: value for key, value in {**sums, **told, "frames": len(frames)}.items() if value is not None}
    hashes = [hash for frame in frames
              for hash in (frame.get("particles_hash", ""), frame.get("picture_hash", frame.get("film_hash", "")))]
    return Reading(leaves, hashlib.sha256(" ".join(hashes).encode()).hexdigest()[:16] if any(hashes) else "")


def refuse_own(args, *names):
    for name in names:
        if name in args:
            raise Refusal(f"{name} is for the comparison itself: leave it out")


class Bench:
    """A command of firn-bench."""
    programs = ["firn-bench"]

    def __init__(self, command, args):
        refuse_own(args, "--json")
        self.kind, self.args = command, args

    def prepare(self, sides, folder):
        for side in sides:
            known = record.known_commands(side.program("firn-bench"))
            if self.kind not in known:
                raise Refusal(f"firn-bench of {side.name} has no '{self.kind}'. Beside frame, movie and run there are: "
                              + ", ".join(sorted(known)))

    def words(self, side, out):
        return [side.program("firn-bench"), self.kind, *self.args, "--json", str(out / "figures.json")]

    def other_way(self, side):
        return None

    def read(self, side, out):
        return Reading(flat(read_json(out / "figures.json")))


class OfScene:
    """What a firn command does with a scene: both sides read this tree's file, but a commit that refuses it, as one from
    before some key does, reads its own file of that name."""
    programs = ["firn"]

    def __init__(self, args):
        refuse_own(args, "--out", "--overwrite", "--quiet", "--json")
        if not args or args[0].startswith("-"):
            raise Refusal(f"{self.kind} needs a scene file first")
        self.scene, self.options = Path(args[0]).resolve(), args[1:]
        if not self.scene.is_file():
            raise Refusal(f"{args[0]}: there is no such scene file")
        self.own_scene = {}

    def scene_of(self, side):
        return str(self.own_scene.get(side.name, self.scene))

    def take_own_scene(self, side):
        """What to tell of it, or None if the side has no other file of that name."""
        if side.name in self.own_scene or not self.scene.is_relative_to(ROOT):
            return None
        own = side.tree / self.scene.relative_to(ROOT)
        if own == self.scene or not own.is_file():
            return None
        self.own_scene[side.name] = own
        return f"{side.name} refuses this tree's scene file and runs its own of that name"

    def read(self, side, out):
        return read_run(out / "run")


class Movie(OfScene):
    kind = "movie"

    def prepare(self, sides, folder):
        pass

    def words(self, side, out):
        return [side.program("firn"), "run", self.scene_of(side), *self.options, "--quiet", "--out", str(out / "run")]

    def other_way(self, side):
        return self.take_own_scene(side)


class Frame(OfScene):
    """Renders the kept particles of one frame. Both sides render what this tree simulated; one that cannot read it
    renders what it simulated itself."""
    kind = "frame"

    def __init__(self, args):
        super().__init__(args)
        refuse_own(args, "--frames")
        self.frame = self.take_value("--frame", "0")
        if not self.frame.isdigit():
            raise Refusal(f"--frame: '{self.frame}' is not the number of a frame")
        self.kept = {}

    def take_value(self, name, value):
        if name in self.options:
            at = self.options.index(name)
            value = "".join(self.options[at + 1:at + 2])
            del self.options[at:at + 2]
        return value

    def render_options(self):
        """Those of the simulation that a rendering of its particles takes too; the others are in the kept scene."""
        for at, word in enumerate(self.options):
            if word in RENDER_VALUES:
                yield from self.options[at:at + 2]
            elif word in RENDER_FLAGS or word.split("=")[0] in RENDER_VALUES:
                yield word

    def simulate(self, side):
        kept = self.folder / f"snow of {side.name}"
        shutil.rmtree(kept, ignore_errors=True)
        words = [side.program("firn"), "simulate", self.scene_of(side), *self.options, "--frames", f"{self.frame}-{self.frame}",
                 "--quiet", "--out", str(kept)]
        done = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode == 0:
            self.kept[side.name] = kept
        return "" if done.returncode == 0 else done.stderr.strip() or f"it ended with {done.returncode}"

    def prepare(self, sides, folder):
        self.folder = folder
        if why := self.simulate(sides[0]):
            raise Refusal(f"The snow of frame {self.frame} cannot be simulated: {why}", code=1)
        self.kept[sides[1].name] = self.kept[sides[0].name]

    def other_way(self, side):
        if self.kept[side.name].name.endswith(side.name):
            return None
        notes = [f"{side.name} cannot render this tree's particles and renders those that it simulated itself"]
        if self.simulate(side):
            notes.append(self.take_own_scene(side))
            if not notes[-1] or self.simulate(side):
                return None
        return "; ".join(notes)

    def words(self, side, out):
        return [side.program("firn"), "render", str(self.kept[side.name]), "--frames", self.frame, *self.render_options(),
                "--quiet", "--out", str(out / "run")]


class AnyCommand:
    kind = "run"

    def __init__(self, words):
        if not words:
            raise Refusal("run needs a command, in which {firn}, {firn-bench} or {tree} stand for each side's")
        self.command = words
        text = " ".join(words)
        self.programs = [name for name in ("firn", "firn-bench") if f"{{{name}}}" in text]
        if not self.programs and "{tree}" not in text:
            raise Refusal("nothing in this command differs between the sides: write {firn}, {firn-bench} or {tree} in it")

    def prepare(self, sides, folder):
        pass

    def words(self, side, out):
        places = {"{firn}": side.program("firn"), "{firn-bench}": side.program("firn-bench"), "{tree}": str(side.tree),
                  "{out}": str(out / "run"), "{json}": str(out / "figures.json")}
        return [self.filled(word, places) for word in self.command]

    @staticmethod
    def filled(word, places):
        for place, value in places.items():
            word = word.replace(place, value)
        return word

    def other_way(self, side):
        return None

    def read(self, side, out):
        reading = read_run(out / "run") if (out / "run" / "run.json").exists() else Reading()
        return Reading({**reading.leaves, **flat(read_json(out / "figures.json"))}, reading.pictures)


def work_of(words):
    """What the words after "--" ask for. Any word that is none of ours is a command of firn-bench, which knows its own."""
    if not words or words[0].startswith("-"):
        raise Refusal("say what to compare after '--', for example: -- sim --no-naive")
    command, args = words[0], words[1:]
    if command == "run":
        return AnyCommand(args)
    if command in ("frame", "movie"):
        return Frame(args) if command == "frame" else Movie(args)
    return Bench(command, args)
