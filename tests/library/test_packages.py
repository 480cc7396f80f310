#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Debian packages of what a build folder installs: each file in one of them, with the fields that dpkg and apt need, the
same bytes each time. The part 'packages' of .ci/full installs them in a bare system.

usage: test_packages.py BUILD_FOLDER"""
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(sys.argv[1]).resolve()


def output(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout


VERSION = json.loads(output("meson", "introspect", "--projectinfo", BUILD))["version"]
LIBRARY = "libfirn" + ".".join(VERSION.split(".")[:2])


def make(out):
    output("python3", ROOT / "packages/make.py", "--build", BUILD, "--out", out, "--quickly")
    return {path.name.split("_")[0]: path for path in out.glob("*.deb")}


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="firn-packages-")
        cls.addClassCleanup(folder.cleanup)
        cls.here = Path(folder.name)
        cls.packages = make(cls.here / "one")
        cls.whole = cls.here / "whole"
        for package in cls.packages.values():
            output("dpkg-deb", "-x", package, cls.whole)

    def field(self, package, name):
        return output("dpkg-deb", "-f", self.packages[package], name).strip()

    def names(self, package):
        """Files and links below the prefix."""
        listing = output("dpkg-deb", "-c", self.packages[package])
        return {line.split()[5].removeprefix("./usr/").removeprefix("local/") for line in listing.splitlines() if line[0] != "d"}

    def test_each_package_holds_its_own(self):
        python = {"python3-firn"} & self.packages.keys()  # where the build has it
        self.assertEqual(sorted(self.packages), sorted(["firn", "libfirn-dev", LIBRARY, *python]))
        program, library, development = (self.names(name) for name in ("firn", LIBRARY, "libfirn-dev"))
        self.assertEqual(program & library | library & development | development & program, set())
        self.assertLessEqual({"bin/firn", "share/man/man1/firn.1.gz", "share/man/man5/firn-scene.5.gz", "share/firn/scenes/rock.obj",
                              "share/bash-completion/completions/firn", "share/fish/vendor_completions.d/firn.fish",
                              "share/doc/firn/README.md", "share/doc/firn/copyright"}, program)
        self.assertEqual({name.split("/")[-1] for name in library},
                         {LIBRARY.replace("firn", "firn.so."), f"libfirn.so.{VERSION}", "copyright", "changelog.gz"})
        self.assertLessEqual({"firn.h", "libfirn.so", "libfirn.a", "firn.pc", "firnConfig.cmake"}, {name.split("/")[-1] for name in development})

    def test_fields(self):
        for package in self.packages:
            self.assertEqual(self.field(package, "Version"), VERSION)
            self.assertRegex(self.field(package, "Maintainer"), r"^\S.* <\S+@\S+>$|^The firn authors$")
            self.assertRegex(self.field(package, "Installed-Size"), r"^\d+$")
            self.assertLessEqual(len(self.field(package, "Description").splitlines()[0]), 80)
        for package in ("firn", LIBRARY):
            for needed in ("libc6", "libtbb", "libpng"):
                self.assertRegex(self.field(package, "Depends"), rf"\b{needed}\S* \(>= ")
        self.assertNotIn("libfirn", self.field("firn", "Depends"))
        self.assertEqual(self.field("libfirn-dev", "Depends"), f"{LIBRARY} (= {VERSION})")
        self.assertIn("libtbb-dev", self.field("libfirn-dev", "Recommends"))
        self.assertIn("ldconfig", output("dpkg-deb", "-I", self.packages[LIBRARY], "triggers"))

    def test_sums(self):
        for package in self.packages:
            sums = dict(reversed(line.split("  ", 1)) for line in output("dpkg-deb", "-I", self.packages[package], "md5sums").splitlines())
            self.assertTrue(sums)
            for name, digest in sums.items():
                self.assertEqual(hashlib.md5((self.whole / name).read_bytes()).hexdigest(), digest, name)

    def test_programs_are_stripped_and_start(self):
        program = next(self.whole.rglob("bin/firn"))
        self.assertNotIn(".symtab", output("readelf", "-SW", program))
        self.assertRegex(output(program, "--version"), r"^firn \d")

    def test_the_same_build_makes_the_same_bytes(self):
        again = make(self.here / "again")
        for name, package in self.packages.items():
            self.assertEqual(package.read_bytes(), again[name].read_bytes(), name)


if __name__ == "__main__":
    if missing := [tool for tool in ("dpkg-deb", "dpkg-shlibdeps", "strip", "pkg-config") if not shutil.which(tool)]:
        print(f"skipped: {', '.join(missing)} is not installed")
        sys.exit(77)
    if any(o["name"] == "b_sanitize" and o["value"] != "none" for o in json.loads(output("meson", "introspect", "--buildoptions", BUILD))):
        print("skipped: no packages are made with sanitizers")
        sys.exit(77)
    program = unittest.main(argv=sys.argv[:1], verbosity=2, exit=False)
    failed = len(program.result.failures) + len(program.result.errors)
    print(f"{max(program.result.testsRun - failed, 0)} passed, {failed} failed")
    sys.exit(1 if failed else 0)
