# SPDX-License-Identifier: MIT
"""clang-tidy, as .clang-tidy asks, over the C++ that changed since it last passed over all of it (the part 'tidy' of
.ci/full, recorded in .ci/passed.json), uncommitted changes too. Where headers changed, the files that include them are
read. What does not fit into a lint check is left out, aloud.

usage: check_tidy.py BUILD_FOLDER [--all]    (any compiler's; --all: every file, as .ci/full has it)"""
import concurrent.futures
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import tree

MOST_FILES, MOST_SECONDS = 12, 60
ROOMS = ["include", "src", "kernels", "bench", "tests"]
FINDING = re.compile(r"^(\S+?)(:\d+:\d+: (?:warning|error): .*)$", re.M)


def find_tidy():
    """clang-tidy 14, whose findings are the agreed ones: other versions have others."""
    for name in ("clang-tidy-14", "clang-tidy"):
        program = shutil.which(name)
        if program and "version 14." in subprocess.run([program, "--version"], capture_output=True, text=True).stdout:
            return program
    return None


def git(*words):
    done = subprocess.run(["git", *words], cwd=tree.ROOT, capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else None


def plain_command(entry):
    """A compiler's command as clang understands it: no compiler cache, no precompiled headers, which are another's."""
    words = shlex.split(entry["command"])
    while words and words[0].endswith("ccache"):
        del words[0]
    kept, skip = ["clang++"], 0
    for word in words[1:]:
        if skip:
            skip -= 1
        elif word in ("-include", "-include-pch", "-MQ", "-MF", "-MT", "-o"):
            skip = 1
        elif word not in ("-fpch-preprocess", "-fpch-instantiate-templates", "-Winvalid-pch", "-MD", "-Werror"):
            kept.append(word)
    return kept


def single_files(entries):
    """Entries of meson's unity files, which only include some sources, become one for each source."""
    for entry in entries:
        unity = Path(entry["directory"], entry["file"])
        if not re.search(r"-unity\d+\.cpp$", unity.name):
            yield entry
        elif unity.exists():
            for source in re.findall(r"#include\s*[<\"]([^>\"]+)[>\"]", unity.read_text(encoding="utf-8")):
                yield entry | {"file": source, "command": entry["command"].replace(entry["file"], source)}


def commands(folder):
    """{file: entry}, one for each file: kernels as AVX2 has them."""
    chosen = {}
    for entry in single_files(json.loads((folder / "compile_commands.json").read_text(encoding="utf-8"))):
        path = Path(os.path.normpath(Path(entry["directory"], entry["file"])))
        if not path.is_relative_to(tree.ROOT) or path.relative_to(tree.ROOT).parts[0] not in ROOMS:
            continue
        path = path.relative_to(tree.ROOT)
        words = plain_command(entry)
        if path not in chosen or "-DFIRN_ISA=isa_v3" in words:
            chosen[path] = {"directory": entry["directory"], "file": entry["file"], "arguments": words}
    return chosen


def base_commit():
    """The commit over which clang-tidy last passed, or the reason why there is none."""
    record = tree.ROOT / ".ci/passed.json"
    commit = json.loads(record.read_text(encoding="utf-8")).get("tidy", {}).get("commit") if record.exists() else None
    if not commit:
        return None, "no run of '.ci/full tidy' is recorded"
    if git("cat-file", "-e", commit + "^{commit}") is None:
        return None, f"commit {commit[:7]}, at which '.ci/full tidy' last passed, is not in this clone"
    return commit, None


def changed_files(base):
    """Paths that differ from a commit, in the work tree as it is."""
    names = (git("diff", "--name-only", base) or []) + (git("ls-files", "--others", "--exclude-standard") or [])
    return sorted({Path(name) for name in names if (tree.ROOT / name).exists()})


def files_to_read(changed, known):
    """Changed .cpp files first, then those that show a changed header: its own, and the ones that include it."""
    first = [path for path in changed if path in known]
    headers = [path for path in changed if path.suffix == ".h" and path.parts[0] in ROOMS]
    own = [path.with_suffix(".cpp") for path in headers if path.with_suffix(".cpp") in known]
    named = [f'#include "{path.as_posix()}"' for path in headers]
    showing = [path for path in known if any(line in tree.read(path) for line in named)] if named else []
    return list(dict.fromkeys([*first, *own, *showing]))


def from_root(place, folder):
    """A path as clang-tidy prints it: absolute, or from the build folder, or from the root by way of the build folder."""
    for start in (folder, tree.ROOT):
        path = Path(start, place).resolve()
        if path.exists():
            return os.path.relpath(path, tree.ROOT)
    return place


def findings_of(program, database, path, folder):
    words = [program, "-p", str(database), "--quiet",
             "--extra-arg=-Wno-unknown-warning-option", "--extra-arg=-Qunused-arguments", str(tree.ROOT / path)]
    done = subprocess.run(words, cwd=tree.ROOT, capture_output=True, text=True)
    found = [from_root(place, folder) + rest for place, rest in FINDING.findall(done.stdout + done.stderr)]
    if done.returncode and not found:
        found = [f"{path}: clang-tidy ended with {done.returncode}: {done.stderr.strip()[-500:]}"]
    return found


def read_files(program, known, paths, seconds):
    """(findings without repetition, files read, files left out for want of time)."""
    wrong, left, begin = {}, [], time.monotonic()
    with tempfile.TemporaryDirectory() as database:
        Path(database, "compile_commands.json").write_text(json.dumps([known[path] for path in paths]), encoding="utf-8")

        def look(path):
            if seconds and time.monotonic() - begin > seconds:
                return None
            return findings_of(program, database, path, known[path]["directory"])

        with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            for path, found in zip(paths, pool.map(look, paths)):
                if found is None:
                    left.append(path)
                else:
                    wrong.update(dict.fromkeys(found))
    return list(wrong), len(paths) - len(left), left


def skip(reason):
    print(f"SKIPPED: {reason}")
    sys.exit(77)


def check_changed(program, known):
    base, reason = base_commit()
    if reason:
        base = "HEAD^" if git("rev-parse", "--verify", "HEAD^") else "HEAD"
        print(f"only what differs from {base}: {reason}")
    paths = files_to_read(changed_files(base), known)
    wrong, checked, left = read_files(program, known, paths[:MOST_FILES], MOST_SECONDS)
    left += paths[MOST_FILES:]
    if left:
        print(f"left to '.ci/full tidy': {', '.join(map(str, left))}")
    if not paths:
        print(f"no C++ changed since {base[:7]}")
        sys.exit(0)
    tree.finish(wrong, checked)


if __name__ == "__main__":
    tidy = find_tidy()
    if not tidy:
        skip("clang-tidy 14 is not installed")
    entries = commands(Path(sys.argv[1]).resolve())
    if "--all" in sys.argv[2:]:
        complaints, number, _ = read_files(tidy, entries, sorted(entries), None)
        tree.finish(complaints, number)
    check_changed(tidy, entries)
