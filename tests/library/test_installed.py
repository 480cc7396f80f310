#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What an installation of firn gives to programs of others: headers that stand alone, libraries that link, the examples
built with what pkg-config says, and the same bits as the command line.

usage: test_installed.py BUILD_FOLDER COMPILER..."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(sys.argv[1]).resolve()
COMPILER = sys.argv[2:]
STRICT = ["-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
# What the shared library may show of itself, after its parameters are taken away.
PUBLIC = re.compile(r"^(vtable for |typeinfo for |typeinfo name for )?firn::(Error|Observer|Renderer|Scene|Session|Simulation|Snapshot|Value|check_scene|read_points|revision|tone_mapped|version|write_picture|write_points)\b")


def sanitized():
    options = json.loads(subprocess.run(["meson", "introspect", "--buildoptions", BUILD], capture_output=True, check=True).stdout)
    return next(o["value"] for o in options if o["name"] == "b_sanitize") != "none"


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="firn-installed-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.here = Path(cls.folder.name)
        cls.root = cls.here / "root"
        done = subprocess.run(["meson", "install", "-C", BUILD, "--no-rebuild", "--destdir", cls.root], capture_output=True, text=True)
        if done.returncode != 0:
            raise AssertionError(done.stdout + done.stderr)
        cls.library = next(cls.root.rglob("libfirn.so")).parent
        cls.program = next(cls.root.rglob("bin/firn"))
        cls.environment = {**os.environ, "LD_LIBRARY_PATH": str(cls.library), "PKG_CONFIG_SYSROOT_DIR": str(cls.root),
                           "PKG_CONFIG_PATH": str(cls.library / "pkgconfig")}

    def words(self, *words):
        done = subprocess.run([str(word) for word in words], cwd=self.here, env=self.environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{words}\n{done.stdout}{done.stderr}")
        return done.stdout

    def flags(self, *asked):
        """What pkg-config says; the system's own folders need no saying."""
        said = self.words("pkg-config", *asked).split()
        return [word for word in said if word[:2] not in ("-I", "-L") or Path(word[2:]).exists()]

    def example(self, name, static=False):
        program = self.here / f"{name}{'-static' if static else ''}"
        libraries = self.flags("--libs", "firn")
        if static:  # the linker takes a shared library where both are
            libraries = [str(self.library / "libfirn.a") if word == "-lfirn" else word for word in self.flags("--static", "--libs", "firn-static")]
        self.words(*COMPILER, *STRICT, *self.flags("--cflags", "firn"), ROOT / "examples" / f"{name}.cpp", "-o", program, *libraries, "-pthread")
        return program

    def hashes(self, run):
        frames = json.loads(self.words(self.program, "info", run, "--json"))["frames"]
        return [(f["frame"], f["particles_hash"], f["picture_hash"]) for f in frames]

    def test_each_header_stands_alone_and_brings_nothing_of_other_libraries(self):
        headers = sorted((self.root / "usr/local/include/firn").glob("*.h"))
        self.assertEqual([h.name for h in headers], sorted(h.name for h in (ROOT / "include/firn").glob("*.h")))
        for header in headers:
            source = self.here / "one.cpp"
            source.write_text(f"#include <firn/{header.name}>\n")
            used = self.words(*COMPILER, *STRICT, *self.flags("--cflags", "firn"), "-M", source)
            self.words(*COMPILER, *STRICT, *self.flags("--cflags", "firn"), "-fsyntax-only", source)
            self.assertNotRegex(used, "Eigen|tbb|kernels/|src/|toml|json")

    def test_the_shared_library_shows_what_the_headers_declare_and_no_more(self):
        shown = self.words("nm", "-D", "-C", "--defined-only", self.library / "libfirn.so")
        strong = [line.split(" ", 2)[2] for line in shown.splitlines() if line.split(" ", 2)[1] in "TDBR"]
        self.assertTrue(any(name.startswith("firn::Scene::read") for name in strong))
        self.assertEqual([name for name in strong if not PUBLIC.match(name)], [])
        self.assertRegex(self.words("readelf", "-d", self.library / "libfirn.so"), r"SONAME.*\[libfirn\.so\.\d+\.\d+\]")

    def test_a_program_needs_no_other_library_to_be_compiled_and_linked(self):
        self.assertEqual({word[:2] for word in self.flags("--cflags", "firn")}, {"-I"})
        self.assertEqual([word for word in self.flags("--libs", "firn") if word.startswith("-l")], ["-lfirn"])

    def test_scenes_are_installed_with_all_that_they_name(self):
        scenes = sorted((self.root / "usr/local/share/firn/scenes").glob("*.toml"))
        self.assertEqual([scene.name for scene in scenes], sorted(scene.name for scene in (ROOT / "scenes").glob("*.toml")))
        for scene in scenes:
            self.words(self.program, "check", scene, "--quick")
        self.words(self.program, "run", scenes[0].with_name("two_snowballs.toml"), "--quick", "--frames", "0-1", "--out", "installed")
        self.assertEqual(len(self.hashes("installed")), 2)

    def test_documents_are_installed_with_what_they_name(self):
        pages = self.root / "usr/local/share/doc/firn"
        self.assertEqual({path.suffix for path in pages.rglob("*") if path.is_file()}, {"", ".cff", ".cpp", ".ipynb", ".jpg", ".md", ".py", ".svg"})
        for page in pages.rglob("*.md"):
            for link in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                self.assertTrue((page.parent / link).exists(), f"{page.relative_to(pages)}: {link}")

    def test_pages_and_completions_lie_where_they_are_looked_for(self):
        share = self.root / "usr/local/share"
        for name in ("man/man1/firn.1", "man/man5/firn-scene.5", "bash-completion/completions/firn", "zsh/site-functions/_firn",
                     "fish/vendor_completions.d/firn.fish"):
            self.assertTrue((share / name).is_file(), name)

    def test_every_example_is_short(self):
        for example in sorted((ROOT / "examples").glob("*.cpp")):
            self.assertLessEqual(len(example.read_text().splitlines()), 60, example.name)

    def test_a_session_of_the_library_makes_the_bits_of_the_command_line(self):
        scene = self.here / "scene.toml"
        scene.write_text((ROOT / "tests/program/tiny.toml").read_text() + "[quick.time]\nframes = 5\n")
        self.words(self.program, "run", scene, "--quick", "--out", "command")
        for static in (False, True):
            said = self.words(self.example("session", static), scene, f"session{static}", "2")
            self.assertRegex(said, r"stopped: \d frames are kept, \d are left")
            self.assertIn("resuming", said)
            self.assertTrue(said.endswith("complete\n"), said)
            self.assertEqual(self.hashes(f"session{static}"), self.hashes("command"))

    def test_a_scene_made_in_code_is_the_one_that_its_own_text_makes(self):
        self.assertEqual(self.words(self.example("scene"), "made"), "5 frames in made\n")
        self.words(self.program, "run", "made/scene.resolved.toml", "--out", "read")
        self.assertEqual(self.hashes("made"), self.hashes("read"))
        self.assertEqual(len(self.hashes("made")), 5)

    def test_examples_of_simulations_say_what_snow_does(self):
        ball = [line.split() for line in self.words(self.example("falling_ball")).splitlines()[1:]]
        heights = [float(row[1]) for row in ball]
        self.assertEqual(len(ball), 13)
        self.assertLess(heights[-1], 0.2)
        self.assertRegex(self.words(self.example("particles")), r"densest \d{3}\.\d kg/m\^3, mean pressure \d+\.\d Pa")
        blade = [[float(word) for word in line.split()] for line in self.words(self.example("driven_blade", True)).splitlines()[1:]]
        self.assertEqual(len(blade), 10)
        self.assertLess(sum(row[3] for row in blade) / len(blade), -50)  # snow holds it back
        self.assertLess(blade[-1][2], 400 / 20 * 0.3)
        self.assertRegex(self.words(self.example("points"), "heart.png"), r"^\d{5} points, 240 x 240 pixels, brightest [01]\.\d+\n$")
        self.assertEqual((self.here / "heart.png").read_bytes()[:4], b"\x89PNG")
        self.assertRegex(self.words(self.example("snow_comes_and_goes")), r"^(\S+ s: \d+ particles, \d+ taken out, \S+ kg\n){4}$")

    def cmake(self, folder, root, asked, target="firn::firn"):
        """A project of CMake with the example `session`, made with an installation at `root`."""
        project = self.here / folder
        project.mkdir()
        (project / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.19)
project(uses_firn CXX)
find_package(firn {asked})
if(NOT firn_FOUND)
  message(FATAL_ERROR "not found: ${{firn_CONSIDERED_VERSIONS}} ${{firn_NOT_FOUND_MESSAGE}}")
endif()
find_package(firn {asked})
add_executable(session {ROOT / "examples/session.cpp"})
target_link_libraries(session PRIVATE {target})
""")
        environment = {name: value for name, value in self.environment.items() if not name.startswith("PKG_CONFIG")}
        for words in (["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={root}", f"-DCMAKE_CXX_COMPILER={COMPILER[-1]}"],
                      ["cmake", "--build", project / "build"]):
            done = subprocess.run(words, cwd=self.here, env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                break
        return done

    def test_cmake_finds_it_wherever_it_is(self):
        if not shutil.which("cmake"):
            self.skipTest("cmake is not installed")
        version = self.words("pkg-config", "--modversion", "firn").strip()
        minor, patch = version.rsplit(".", 1)
        moved = self.here / "moved"
        shutil.copytree(self.root / "usr/local", moved, symlinks=True)
        # As on systems where /lib is a link to /usr/lib.
        linked = self.here / "linked"
        linked.mkdir()
        (linked / "lib").symlink_to(moved / "lib")
        for name, root, asked in (("a", self.root / "usr/local", "REQUIRED"), ("b", moved, f"{minor} REQUIRED"), ("c", linked, f"{version} EXACT")):
            done = self.cmake(name, root, asked)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.starts(self.here / name / "build/session")
        for name, asked in (("d", f"{minor}.{int(patch) + 1}"), ("e", "0.1"), ("f", "1"), ("g", f"{version} COMPONENTS no_such")):
            self.assertIn("not found: ", self.cmake(name, moved, asked).stderr, asked)
        self.assertNotIn(str(self.root), "".join(path.read_text() for path in self.root.rglob("firnConfig*.cmake")))

    def test_cmake_finds_the_static_library_and_what_it_needs(self):
        if not shutil.which("cmake"):
            self.skipTest("cmake is not installed")
        done = self.cmake("static", self.root / "usr/local", "REQUIRED COMPONENTS static", "firn::firn-static")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        program = self.here / "static/build/session"
        self.assertNotIn("libfirn", self.words("readelf", "-d", program))
        self.starts(program)

    def starts(self, program):
        done = subprocess.run([program], cwd=self.here, env=self.environment, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr[:14]), (2, "usage: session"))

    def test_mistakes_are_errors_of_the_library(self):
        done = subprocess.run([self.example("session"), "no.toml", "a"], cwd=self.here, env=self.environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no.toml", done.stderr)


if __name__ == "__main__":
    if sanitized():
        print("skipped: programs of others are not built with sanitizers")
        sys.exit(77)
    program = unittest.main(argv=sys.argv[:1], verbosity=2, exit=False)
    failed = len(program.result.failures) + len(program.result.errors)
    print(f"{max(program.result.testsRun - failed, 0)} passed, {failed} failed")
    sys.exit(1 if failed else 0)
