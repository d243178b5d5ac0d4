"""A simulator program under test, the small image that it runs there, and the files that its tests make."""

import os
import subprocess
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
AVR = os.environ.get("AVR", "avr-")


def built(variable, name):
    """What the environment's variable says, or build/name."""
    return os.path.abspath(os.environ.get(variable, os.path.join(TOP, "build", name)))


class Simulator:
    """Between set_up() and tear_down(): `probe`, the image made from `source`, in `folder`."""

    def __init__(self, name, source):
        self.name = name
        self.path = built(name.upper(), name)
        self.source = os.path.join(HERE, source)
        self.folder = self.probe = None

    def set_up(self):
        self.folder = tempfile.TemporaryDirectory(prefix=self.name + "-test-")
        self.probe = self.path_of("probe.elf")
        subprocess.run(
            [AVR + "gcc", "-mmcu=atmega328p", "-Os", "-Wall", "-Wextra", "-Werror", "-o", self.probe, self.source], check=True
        )

    def tear_down(self):
        self.folder.cleanup()

    def path_of(self, name):
        return os.path.join(self.folder.name, name)

    def run(self, *arguments, image=None, given=b"", fast=True):
        """Runs it to its end, `given` piped into it; returns the completed process, output as bytes."""
        command = [self.path] + (["--fast"] if fast else []) + list(arguments) + [image or self.probe]
        return subprocess.run(command, input=given, capture_output=True, timeout=60)


class Complaining(unittest.TestCase):
    """Wrong options and files: a message that names the trouble, and the exit code."""

    sim = None

    def complains(self, code, words, *arguments, image=None):
        done = self.sim.run(*arguments, image=image)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(words, done.stderr)
        self.assertEqual(done.stdout, b"")
