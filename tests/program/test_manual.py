#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What is installed beside the program for people and their shells: man pages that tell every option and key, and
completions that complete, in bash, and in zsh and fish where these are installed.

usage: test_manual.py FIRN FOLDER    (FOLDER: where the build has put the pages and the completions)"""
import os
import pty
import re
import select
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

FIRN = str(Path(sys.argv[1]).resolve())
FOLDER = Path(sys.argv[2]).resolve()
SCENE = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")
PATIENCE = float(os.environ.get("FIRN_TEST_PATIENCE", "1"))


def output(*words, **options):
    return subprocess.run(words, check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL, **options).stdout


def commands():
    return re.findall(r"^  ([a-z]+) ", output(FIRN, "--help").split("Subcommands:")[1], re.M)


def options_of(*command):
    """Long and short, as help shows them."""
    return sorted({option for line in output(FIRN, *command, "--help").split("Options:")[1].splitlines()
                   for option in re.findall(r"(?:^  |,)(--?[\w-]+)", line.split("   ")[0] or line)})


def keys():
    return re.findall(r"^([\w.]+)$", output(FIRN, "params"), re.M)


class Pages(unittest.TestCase):
    def section(self, command):
        text = (FOLDER / "firn.1").read_text(encoding="utf-8").replace("\\-", "-")
        return re.search(rf"^\.SS \\fBfirn {command}\\fR.*?(?=^\.S)", text, re.M | re.S)[0]

    def test_every_option_of_every_command_is_in_its_section(self):
        self.assertGreaterEqual(len(commands()), 7)
        for command in commands():
            told = re.findall(r"\\fB(--?[\w-]+)\\fR", self.section(command))
            self.assertEqual(sorted(told), options_of(command), command)
        for option in options_of():
            self.assertIn("\\fB" + option.replace("-", "\\-") + "\\fR", (FOLDER / "firn.1").read_text(encoding="utf-8"))

    def test_every_key_of_a_scene_is_in_its_page(self):
        told = re.findall(r"^\.TP\n\\fB(\w+)\\fR$", (FOLDER / "firn-scene.5").read_text(encoding="utf-8"), re.M)
        self.assertEqual(told, [key.split(".")[-1] for key in keys()])

    def test_man_has_nothing_to_warn_of(self):
        if not shutil.which("man") or not shutil.which("groff"):
            self.skipTest("man or groff is not installed")
        for page in ("firn.1", "firn-scene.5"):
            done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", FOLDER / page], capture_output=True, text=True,
                                  env=os.environ | {"LC_ALL": "C.UTF-8", "MANWIDTH": "80", "MANROFFSEQ": "", "MAN_KEEP_STDERR": "1"})
            if "minimized" in done.stdout:
                self.skipTest("man is a stub here")
            self.assertEqual((done.returncode, done.stderr), (0, ""), page)
            self.assertIn("SEE ALSO", re.sub(".\x08", "", done.stdout))


class Completions(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="firn-manual-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.here = Path(cls.folder.name)
        for name in ("tiny.toml", "two words.toml", "other.txt", "deep/down/scene.toml"):
            (cls.here / name).parent.mkdir(parents=True, exist_ok=True)
            (cls.here / name).write_text(SCENE)
        for run in ("out/a_run", "out/b_run", "elsewhere/set/c"):
            (cls.here / run / "frames").mkdir(parents=True)
            (cls.here / run / "run.json").write_text("{}")
        (cls.here / "out/a_folder").mkdir()

    def check_all_options(self, offered):
        """offered(*words): what is offered after them and '-'."""
        for command in commands():
            self.assertEqual({o for o in offered(command) if o.startswith("--")}, {o for o in options_of(command) if o.startswith("--")})
        self.assertEqual({o for o in offered() if o.startswith("--")}, {o for o in options_of() if o.startswith("--")})

    def typed(self, *shell, setup, line):
        """The words that a shell hands to the program after a person typed `line`, a tab and the return key."""
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(self.here)
            environment = {k: v for k, v in os.environ.items() if k in ("PATH", "LANG", "LC_ALL")}
            os.execvpe(shell[0], shell, environment | {"TERM": "dumb", "HOME": str(self.here), "PS1": "$ "})
        try:
            os.write(terminal, (setup + "; firn() { printf '{%s}' \"$@\"; printf '{}\\n'; }; printf 're''ady\\n'\n").encode())
            self.read(terminal, r"ready\r?\n")
            os.write(terminal, (line + "\t").encode())
            time.sleep(0.5 * PATIENCE)  # until it has drawn what it found
            os.write(terminal, b"\n")
            said = self.read(terminal, r"(?:\{[^{}]+\})+\{\}\r?\n")
        finally:
            os.close(terminal)
            os.waitpid(child, 0)
        return re.findall(r"\{([^{}]+)\}", said[said.rindex("\n", 0, said.rindex("{}")):])

    def read(self, terminal, pattern):
        said, end = "", time.monotonic() + 20 * PATIENCE
        while not re.search(pattern, said):
            if not select.select([terminal], [], [], max(0, end - time.monotonic()))[0]:
                self.fail(f"nothing like {pattern} came: {said!r}")
            said += os.read(terminal, 4096).decode(errors="replace")
        return said


class Bash(Completions):
    def offered(self, *words):
        """What the function offers for the last of the words, cut at '=' as bash does."""
        parts = [part for word in words for part in (re.findall("=|[^=]+", word) or [""])]
        script = (f"source {shlex.quote(str(FOLDER / 'firn'))}; COMP_WORDS=(firn {' '.join(map(shlex.quote, parts))}); "
                  "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _firn; ((${#COMPREPLY[@]} == 0)) || printf '%s\\n' \"${COMPREPLY[@]}\"")
        return output("bash", "--norc", "-uc", script, cwd=self.here).splitlines()

    def test_commands(self):
        self.assertEqual(sorted(self.offered("")), sorted([*commands(), "help"]))
        self.assertEqual(self.offered("resu"), ["resume"])
        self.assertEqual(self.offered("help", "che"), ["check"])
        self.assertEqual(self.offered("xyzzy", ""), [])

    def test_all_options(self):
        self.check_all_options(lambda *words: self.offered(*words, "-"))
        self.assertEqual(self.offered("run", "tiny.toml", "--no-o"), ["--no-overlap"])

    def test_values_of_options(self):
        names = ["auto", "base", "x86-64-v3", "x86-64-v4"]
        self.assertEqual(self.offered("run", "--isa", ""), names)
        self.assertEqual(self.offered("run", "--isa="), names)
        self.assertEqual(self.offered("run", "--isa=b"), ["base"])
        self.assertEqual(self.offered("run", "tiny.toml", "--isa", "b"), ["base"])
        self.assertEqual(sorted(self.offered("run", "--out", "")), ["deep", "elsewhere", "out"])
        self.assertEqual(self.offered("run", "--out=de"), ["deep"])
        self.assertEqual(self.offered("run", "--seed", ""), [])

    def test_scenes_and_runs(self):
        for command in ("run", "simulate", "check"):
            self.assertEqual(sorted(self.offered(command, "")), ["deep", "elsewhere", "out", "tiny.toml", "two words.toml"])
            self.assertEqual(self.offered(command, "--quick", "--isa", "base", "ti"), ["tiny.toml"])
            self.assertEqual(self.offered(command, "--set", "image.width=3", "ti"), ["tiny.toml"])
            self.assertEqual(self.offered(command, "tiny.toml", ""), [])
        self.assertEqual(self.offered("run", "two\\ w"), ["two words.toml"])
        for command in ("resume", "info"):
            self.assertEqual(sorted(self.offered(command, "")), ["elsewhere", "out"])
            self.assertEqual(sorted(self.offered(command, "out/")), ["out/a_run", "out/b_run"])
        self.assertEqual(sorted(self.offered("render", "")), ["elsewhere", "out", "tiny.toml", "two words.toml"])

    def test_keys_and_their_values(self):
        self.assertEqual(self.offered("run", "--set", ""), [key + "=" for key in keys()])
        self.assertEqual(self.offered("params", ""), keys())
        self.assertEqual(self.offered("run", "--set", "image.wi"), ["image.width="])
        self.assertEqual(self.offered("run", "--set=image.wi"), ["image.width="])
        self.assertIn("ball", self.offered("run", "--set", "snow.shape="))
        self.assertEqual(self.offered("run", "--set", "snow.shape=bal"), ["ball"])
        self.assertEqual(self.offered("run", "--set=snow.shape=bal"), ["ball"])
        self.assertEqual(self.offered("run", "--set", "image.width="), [])

    def test_typed_into_a_terminal(self):
        for line, words in (("firn res", ["resume"]), ("firn run tw", ["run", "two words.toml"]), ("firn run --isa=b", ["run", "--isa=base"]),
                            ("firn run --set snow.shape=bal", ["run", "--set", "snow.shape=ball"]), ("firn check --qui", ["check", "--quick"]),
                            ("firn run --set image.wi", ["run", "--set", "image.width="]), ("firn info out/a", ["info", "out/a_run/"])):
            setup = f"source {shlex.quote(str(FOLDER / 'firn'))}"
            self.assertEqual(self.typed("bash", "--norc", "--noprofile", "-i", setup=setup, line=line), words, line)


class Zsh(Completions):
    def setUp(self):
        if not shutil.which("zsh"):
            self.skipTest("zsh is not installed")

    def test_every_option_is_told(self):
        text = (FOLDER / "_firn").read_text(encoding="utf-8")
        for command in commands():
            case = re.search(rf"^      \({command}\)\n(.*?);;", text, re.M | re.S)[1]
            self.assertEqual(sorted(re.findall(r"'\*?(--?[\w-]+)=?\[", case)), options_of(command), command)

    def test_typed_into_a_terminal(self):
        setup = f"fpath=({shlex.quote(str(FOLDER))} $fpath); autoload -Uz compinit; compinit -u -D; unsetopt zle_bracketed_paste prompt_sp"
        for line, words in (("firn res", ["resume"]), ("firn run tw", ["run", "two words.toml"]), ("firn run --isa=b", ["run", "--isa=base"]),
                            ("firn run --isa b", ["run", "--isa", "base"]), ("firn check --qui", ["check", "--quick"]),
                            ("firn run --set snow.shape=bal", ["run", "--set", "snow.shape=ball"]),
                            ("firn run --set image.wi", ["run", "--set", "image.width="]), ("firn params image.wi", ["params", "image.width"]),
                            ("firn resume els", ["resume", "elsewhere"]), ("firn info out/a", ["info", "out/a_run"]),
                            ("firn run --quick ti", ["run", "--quick", "tiny.toml"])):
            self.assertEqual(self.typed("zsh", "-f", "-i", setup=setup, line=line), words, line)


class Fish(Completions):
    def setUp(self):
        if not shutil.which("fish"):
            self.skipTest("fish is not installed")

    def offered(self, *words):
        line = " ".join(["firn", *words])
        environment = os.environ | {"HOME": str(self.here), "XDG_CONFIG_HOME": str(self.here / "config")}
        script = f"source {shlex.quote(str(FOLDER / 'firn.fish'))}; complete -C {shlex.quote(line)}"
        return [said.split("\t")[0] for said in output("fish", "--no-config", "-c", script, cwd=self.here, env=environment).splitlines()]

    def test_commands_and_all_options(self):
        self.assertEqual(sorted(self.offered("")), sorted([*commands(), "help"]))
        self.check_all_options(lambda *words: self.offered(*words, "--"))

    def test_values(self):
        self.assertEqual(self.offered("run", "--isa", "b"), ["base"])
        self.assertEqual(self.offered("run", "ti"), ["tiny.toml"])
        self.assertEqual(self.offered("resume", "out/"), ["out/a_run/", "out/b_run/"])
        self.assertEqual(self.offered("run", "--set", "image.wi"), ["image.width="])
        self.assertEqual(self.offered("run", "--set", "snow.shape=bal"), ["snow.shape=ball"])
        self.assertEqual(self.offered("params", "image.wi"), ["image.width"])


if __name__ == "__main__":
    program = unittest.main(argv=sys.argv[:1], verbosity=2, exit=False)
    failed = len(program.result.failures) + len(program.result.errors)
    for test, reason in program.result.skipped:
        print(f"skipped: {test.id()}: {reason}")
    print(f"{program.result.testsRun - failed - len(program.result.skipped)} passed, {failed} failed")
    sys.exit(1 if failed else 0)
