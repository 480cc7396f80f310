# SPDX-License-Identifier: MIT
"""The two sides of a comparison: this tree as it is built in build/, and another commit, checked out and built in
build-compare/COMMIT/ with the compiler and the options of this tree's build. That folder is kept (git does not see it),
so that a second comparison with the same commit starts at once."""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RECORDS = "bench/compared"
TARGETS = {"firn": "firn", "firn-bench": "bench/firn-bench"}
# Options that change what the compiler makes of the code. Those of firn's own are taken over where the other commit
# has them too.
BUILD_OPTIONS = ["buildtype", "debug", "optimization", "b_lto", "b_ndebug", "b_pie", "b_sanitize", "cpp_args", "cpp_link_args"]
FLAG_VARIABLES = ["CXXFLAGS", "CPPFLAGS", "LDFLAGS"]  # they are in cpp_args and cpp_link_args already


class Refusal(Exception):
    """What a person should read instead of a traceback; ends the program with `code`."""

    def __init__(self, text, code=2):
        super().__init__(text)
        self.code = code


@dataclass
class Side:
    name: str  # how messages call it
    tree: Path
    build: Path
    commit: str
    dirty: bool
    compiler: str
    asked: str = ""  # how the other commit was named

    def program(self, name):
        return str(self.build / TARGETS[name])


def git(*words, tree=ROOT):
    """What git prints, or None if it fails."""
    done = subprocess.run(["git", "-C", str(tree), *words], capture_output=True, text=True)
    return done.stdout.rstrip("\n") if done.returncode == 0 else None


def is_dirty(tree):
    """Records of comparisons are no change of the program."""
    return bool(git("status", "--porcelain", "--", ".", f":!{RECORDS}", tree=tree))


def resolve(revision):
    """The full hash of a commit, by any name that git knows."""
    found = git("rev-parse", "--verify", "--quiet", "--end-of-options", revision + "^{commit}")
    if found:
        return found
    text = f"no such commit: '{revision}'."
    if recent := git("log", "--oneline", "-5"):
        text += " The last ones of this branch are\n" + "".join(f"  {line}\n" for line in recent.splitlines())
    if git("rev-parse", "--is-shallow-repository") == "true":
        text += "This clone is shallow; 'git fetch --unshallow' brings the older commits.\n"
    raise Refusal(text.rstrip("\n"))


def compiler_words(build):
    """How meson calls the C++ compiler in a build folder, a cache in front of it included."""
    targets = json.loads((build / "meson-info" / "intro-targets.json").read_text())
    sources = (source for target in targets for source in target["target_sources"])
    return next(source["compiler"] for source in sources if source.get("language") == "cpp")


def compiler_name(words):
    """As firn-bench names its compiler: "gcc 12.2.0"."""
    done = subprocess.run([*words, "-dM", "-E", "-x", "c++", os.devnull], capture_output=True, text=True)
    macros = dict(re.findall(r'^#define (__clang_version__|__VERSION__) "(.*)"$', done.stdout, re.M))
    if "__clang_version__" in macros:
        return "clang " + macros["__clang_version__"].strip()
    return "gcc " + macros.get("__VERSION__", "of an unknown version")


def option_words(build, other_options):
    """-D words that give another build the options of this one; `other_options` is the text of the other's option file."""
    listed = json.loads((build / "meson-info" / "intro-buildoptions.json").read_text())
    own = re.findall(r"option\(\s*'(\w+)'", other_options)
    values = {o["name"]: o["value"] for o in listed
              if o["name"] in BUILD_OPTIONS or (o["section"] == "user" and o["name"] in own)}
    values.update({name: value for name, value in [("tests", False), ("bench", True)] if name in own})
    return [f"-D{name}={option_text(value)}" for name, value in values.items()]


def option_text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, list) else str(value)


def this_side(programs):
    build = ROOT / "build"
    for name in programs:
        if not (build / TARGETS[name]).exists():
            raise Refusal(f"build/{TARGETS[name]} is missing: './dev build' makes it")
    commit = git("rev-parse", "HEAD") or "unknown"
    return Side("this tree", ROOT, build, commit, is_dirty(ROOT), compiler_name(compiler_words(build)))


def is_stale(side, programs):
    """True if the program is older than its sources: then it is not that of the commit that the record names. What ninja
    would do anyhow is to ask for the revision and to compile the file that names it."""
    words = ["ninja", "-n", "-C", str(side.build), *(TARGETS[name] for name in programs)]
    done = subprocess.run(words, capture_output=True, text=True)
    steps = re.findall(r"^\[\d+/\d+\] (Compiling .*|Regenerating .*)$", done.stdout, re.M)
    return done.returncode == 0 and any(not step.endswith("version.cpp.o") for step in steps)


def checked_out(folder, commit):
    """The commit's files in folder/tree."""
    tree = folder / "tree"
    if not (tree / ".git").exists() or git("rev-parse", "HEAD", tree=tree) != commit:
        shutil.rmtree(tree, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        git("worktree", "prune")
        done = subprocess.run(["git", "-C", str(ROOT), "worktree", "add", "--force", "--detach", str(tree), commit],
                              capture_output=True, text=True)
        if done.returncode:
            raise Refusal(f"git cannot check out {commit[:12]}:\n{done.stderr.strip()}", code=1)
    return tree


def step(words, log, env, what):
    """Runs one step of a build with its output in a log and, for people at a terminal, ninja's count of files."""
    shows = sys.stderr.isatty()
    process = subprocess.Popen(words, env=env, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        with log.open("a", buffering=1) as out:
            for line in process.stdout:
                out.write(line)
                if shows and (count := re.match(r"\[\d+/\d+\]", line)):
                    print("\r  " + count.group(), end="", file=sys.stderr, flush=True)
    except BaseException:
        process.terminate()
        process.wait()
        raise
    if shows:
        print("\r" + " " * 20 + "\r", end="", file=sys.stderr, flush=True)
    if process.wait():
        tail = "".join(f"  {line}\n" for line in log.read_text(errors="replace").splitlines()[-25:])
        raise Refusal(f"{what} failed. The log's end:\n{tail}The whole log is {log.relative_to(ROOT)}.", code=1)


def option_file(tree):
    for name in ("meson.options", "meson_options.txt"):
        if (tree / name).exists():
            return (tree / name).read_text()
    return ""


def other_side(asked, commit, programs, this, jobs):
    """The other commit, built. What was configured is noted, so that another compiler or option starts a fresh build."""
    folder = ROOT / "build-compare" / commit[:12]
    tree, build, log = checked_out(folder, commit), folder / "build", folder / "build.log"
    compiler = compiler_words(this.build)
    options = option_words(this.build, option_file(tree))
    wanted, noted = {"compiler": compiler, "version": this.compiler, "options": options}, folder / "configured.json"
    env = {name: value for name, value in os.environ.items() if name not in FLAG_VARIABLES}
    env["CXX"] = shlex.join(compiler)
    log.unlink(missing_ok=True)
    if not all((build / TARGETS[name]).exists() for name in programs):
        place = log.relative_to(ROOT)
        print(f"Building {commit[:12]}, which takes minutes this once; the compiler's output is in {place} …", file=sys.stderr, flush=True)
    if not noted.exists() or json.loads(noted.read_text()) != wanted:
        shutil.rmtree(build, ignore_errors=True)
        noted.unlink(missing_ok=True)
        step(["meson", "setup", str(build), str(tree), *options], log, env, f"Configuring {commit[:12]}")
        noted.write_text(json.dumps(wanted))
    known = (build / "build.ninja").read_text()
    for name in programs:
        if not re.search(rf"^build {re.escape(TARGETS[name])}:", known, re.M):
            raise Refusal(f"{commit[:12]} has no {name}")
    targets = [TARGETS[name] for name in programs]
    step(["ninja", "-C", str(build), "-j", str(jobs), *targets], log, env, f"Building {commit[:12]}")
    return Side("the other", tree, build, commit, is_dirty(tree), compiler_name(compiler_words(build)), asked)
