# SPDX-License-Identifier: MIT
"""The same scene gives the same bits however it is run."""
import re

from program import ProgramTest


class SameBits(ProgramTest):
    def test_threads_instruction_sets_and_overlap_do_not_change_a_bit(self):
        offered = re.search(r"instruction sets\s+(.*?) \(", self.firn("info").stdout).group(1).split(", ")
        reference = None
        for isa in [name for name in offered if name != "base"] or ["base"]:
            for threads in ("1", "2", "4"):
                for overlap in ([], ["--no-overlap"]):
                    run = "-".join([isa, threads, *overlap])
                    self.firn("run", self.scene, "--out", run, "--isa", isa, "--threads", threads, *overlap)
                    self.assertEqual(self.manifest(run)["isa"], isa)
                    reference = reference or self.hashes(run)
                    self.assertEqual(self.hashes(run), reference, run)

    def test_base_repeats_its_own_bits_and_a_seed_changes_them(self):
        self.firn("run", self.scene, "--out", "a", "--isa", "base")
        self.firn("run", self.scene, "--out", "b", "--isa", "base", "--threads", "1")
        self.firn("run", self.scene, "--out", "c", "--isa", "base", "--seed", "4")
        self.assertEqual(self.hashes("a"), self.hashes("b"))
        self.assertNotEqual(self.hashes("a")[0], self.hashes("c")[0])
