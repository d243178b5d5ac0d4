#!/usr/bin/env python3
"""Tests of the Ninja's simulator, run as a user would: in a terminal and through a pipe.

    python3 test/sim/test_ninjasim.py -v [Class.test_name ...]

Environment (defaults in brackets): NINJASIM the program [build/ninjasim], NINJA_ELF the firmware [build/ninja.elf], AVR
the prefix of the cross compiler [avr-]. What the simulator does with an image is tested with a small one, ninja_probe.c;
class Firmware runs the firmware itself.
"""

import os
import re
import signal
import subprocess
import sys
import time
import unittest

import terminal  # (test/sim/terminal.py)
from simulator import Complaining, Simulator, built  # (test/sim/simulator.py)
from terminal import PATIENCE_S

SIM = Simulator("ninjasim", "ninja_probe.c")
setUpModule, tearDownModule, path_of, run = SIM.set_up, SIM.tear_down, SIM.path_of, SIM.run
NINJASIM = SIM.path
FIRMWARE = built("NINJA_ELF", "ninja.elf")
MENU = b"\x1d"  # Ctrl-]


def state_of(done):
    """The values of the line that tells how the head stands."""
    line = done.stdout.decode().splitlines()[-1]
    return {name: float(value) for name, value in (word.split("=") for word in line.split())}


class Screen(terminal.Terminal):
    """A DEC VT52, which has few commands, and what it shows."""

    ROWS, COLUMNS = 24, 100

    def __init__(self, *arguments, image=None, rows=ROWS, columns=COLUMNS):
        super().__init__([NINJASIM, *arguments, image or SIM.probe], rows=rows, columns=columns, term="vt52")
        self.shown = [[" "] * columns for _ in range(rows)]
        self.row = self.column = self.done = 0

    def text(self):
        self.done += self.draw(self.seen[self.done :].decode("latin-1"))
        return "\n".join("".join(row).rstrip() for row in self.shown)

    def clear(self, row, column):
        self.shown[row][column:] = [" "] * (len(self.shown[row]) - column)

    def draw(self, text):
        """Takes all but a command that has not come whole; returns how much."""
        i = 0
        while i < len(text):
            if text[i] == "\x1b":
                length = {"Y": 4}.get(text[i + 1 : i + 2], 2)
                if i + length > len(text):
                    break
                self.command(text[i + 1], text[i + 2 : i + length])
                i += length
                continue
            self.character(text[i])
            i += 1
        return i

    def command(self, letter, operands):
        if letter == "Y":
            self.row, self.column = (ord(operand) - 32 for operand in operands)
        elif letter in "ABCD":
            self.row += {"A": -1, "B": 1}.get(letter, 0)
            self.column += {"C": 1, "D": -1}.get(letter, 0)
        elif letter == "H":
            self.row = self.column = 0
        elif letter in "JK":
            self.clear(self.row, self.column)
            for row in range(self.row + 1, len(self.shown) if letter == "J" else 0):
                self.clear(row, 0)

    def character(self, character):
        if character == "\r":
            self.column = 0
        elif character == "\n":
            self.row += 1
        elif character == "\b":
            self.column -= 1
        elif character == "\t":
            self.column += 8 - self.column % 8
        elif character >= " " and self.row < len(self.shown) and self.column < len(self.shown[0]):
            self.shown[self.row][self.column] = character
            self.column += 1

    def await_text(self, pattern):
        """Waits until the screen shows the pattern; returns what it shows."""
        limit = time.monotonic() + PATIENCE_S
        while not re.search(pattern, self.text()):
            if time.monotonic() > limit or not self.pump(0.2):
                raise AssertionError(f"no {pattern!r} on the screen:\n{self.text()}")
        return self.text()


class Script(unittest.TestCase):
    """Input from a pipe or a file: nothing is drawn, one line at the end."""

    def test_head_starts_where_it_is_told_to(self):
        # 5 steps down at power-up, through no slack
        state = state_of(run("--start=100,-100"))
        self.assertEqual((state["x"], state["y"], state["x_steps"], state["y_steps"]), (100, -105, 0, 5))
        state = state_of(run())
        self.assertEqual((state["x"], state["y"]), (300, -205))

    def test_bytes_move_the_head_and_backlash_is_taken_up(self):
        state = state_of(run("--start", "0,0", given=b"x"))
        self.assertEqual((state["x"], state["x_steps"]), (-50, 50))
        state = state_of(run("--start", "0,0", given=b"X"))
        self.assertEqual((state["x"], state["x_steps"]), (38, 50))
        state = state_of(run("--start", "0,0", "--backlash", "3,0", given=b"XY"))
        self.assertEqual((state["x"], state["y"]), (47, 45))

    def test_input_waits_for_power_up_to_end_and_the_end_for_the_motion(self):
        done = run("--start", "0,0", "--linger", "500", given=b"y")
        state = state_of(done)
        self.assertEqual(state["y"], -55)
        self.assertAlmostEqual(state["seconds"], 0.06 + 0.5 + 0.51 + 0.5, delta=0.03)

    def test_nothing_but_the_state_is_printed(self):
        done = run(given=b"x")
        self.assertEqual(done.stdout.count(b"\n"), 1)
        self.assertEqual(done.stderr, b"")
        self.assertEqual(done.returncode, 0)

    def test_lost_steps_and_wrong_patterns_are_told(self):
        state = state_of(run("--start", "0,0", given=b"fw"))
        self.assertGreater(state["x_lost"], 0)
        self.assertEqual(state["x_lost"] % 4, 0)
        self.assertEqual((state["x_wrong"], state["y_lost"], state["y_wrong"]), (1, 0, 0))

    def test_bytes_that_the_board_sends_are_told(self):
        self.assertEqual(state_of(run(given=b"x"))["sent"], 0)
        self.assertEqual(state_of(run(given=b"t"))["sent"], 1)

    def test_sensor_leads_to_the_centre_and_may_be_stuck(self):
        self.assertEqual(state_of(run("--start", "32,0", given=b"s"))["x"], -1)
        self.assertEqual(state_of(run("--start", "32,0", "--stuck", "x=high", given=b"s"))["x"], 32)
        self.assertEqual(state_of(run("--start", "32,0", "--stuck", "x=low", given=b"s"))["x"], -168)
        self.assertEqual(state_of(run("--start", "32,0", "--stuck", "y=low", given=b"s"))["x"], -1)

    def test_coils_that_stay_on_are_no_rest(self):
        state = state_of(run("--for", "2", given=b"h"))
        self.assertEqual(state["x_coils"], 3)
        self.assertAlmostEqual(state["seconds"], 2, delta=0.001)

    def test_script_is_a_file(self):
        with open(path_of("moves"), "wb") as file:
            file.write(b"xx")
        state = state_of(run("--start", "0,0", "--script", path_of("moves"), given=b"yyy"))
        self.assertEqual((state["x"], state["y"]), (-100, -5))

    def test_line_by_line_nothing_is_lost(self):
        given = b"x\nx\nx\nx\nx\nx\n"
        self.assertEqual(state_of(run("--start", "0,0", "--wait", given=given))["x"], -300)
        self.assertGreater(state_of(run("--start", "0,0", given=given))["x"], -300)

    def test_real_time_is_real_and_speed_is_a_factor(self):
        for arguments, seconds in (([], 0.8), (["--speed", "4"], 0.2)):
            start = time.monotonic()
            state = state_of(run("--for", "0.8", *arguments, given=b"x", fast=False))
            self.assertGreaterEqual(time.monotonic() - start, seconds * 0.97)
            self.assertAlmostEqual(state["seconds"], 0.8, delta=0.001)


class Complaints(Complaining):
    sim = SIM

    def test_command_line(self):
        done = subprocess.run([NINJASIM], capture_output=True, stdin=subprocess.DEVNULL, timeout=10)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"which image?", done.stderr)
        self.complains(2, b"one too many", SIM.probe)
        self.complains(2, b"--start: '5' is not X,Y", "--start", "5")
        self.complains(2, b"--start: '1801' is not a number from -1800 to 1800", "--start", "1801,0")
        self.complains(2, b"--backlash: '1.5' is not a whole number", "--backlash", "0,1.5")
        self.complains(2, b"--stuck: 'z' is no axis", "--stuck", "z=high")
        self.complains(2, b"--stuck: 'up' is no level", "--stuck", "x=up")
        self.complains(2, b"--speed: '0' is not a number from 0.01", "--speed", "0")

    def test_files(self):
        self.complains(1, b"cannot read /nowhere.elf: No such file", image="/nowhere.elf")
        self.complains(1, b"cannot read /nowhere: No such file", "--script", "/nowhere")

    def test_crash_of_the_image(self):
        done = run(given=b"!")
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"the firmware crashed at 0.", done.stderr)

    def test_help_and_version(self):
        self.assertIn(b"--start=X,Y", run("--help").stdout)
        self.assertRegex(run("--version").stdout, rb"^ninjasim \d")

    def test_terminal_that_cannot_be_drawn_on(self):
        with terminal.Terminal([NINJASIM, SIM.probe], term="no-such-terminal") as t:
            t.expect(rb"this terminal cannot be drawn on")
            self.assertEqual(t.end(), (1, t.before))


class AtTheTerminal(unittest.TestCase):
    """What is drawn, keys, and the terminal's way back."""

    def test_screen_shows_where_the_head_stands(self):
        with Screen("--start", "900,-600") as s:
            shown = s.await_text(r"Y +-605 steps +-60.5 deg").splitlines()
            self.assertRegex(shown[0], r"Ninja on a simulated Nano +\d")
            rows = "\n".join(shown)
            self.assertRegex(rows, r"X +900 steps +90.0 deg +coils ---- +sensor low ")
            self.assertRegex(rows, r"Y .* sensor high")
            # azimuth: 90 degrees is to the right of the middle, column 18 of row 8
            self.assertRegex(shown[8][18:31], r"^o *#+ *#+")
            # altitude: 60 degrees down is half as far right as down
            self.assertEqual(shown[8][50], "o")
            self.assertEqual(shown[12][54:56], "##")
            self.assertRegex(rows, r"X +-1800 -+\|-+#-+ 1800")
            self.assertRegex(rows, r"Y +-1200 -+#-+\|-+ 550")
            self.assertNotIn("lost", rows)

    def test_typed_bytes_move_it_and_are_shown(self):
        with Screen("--start", "0,0", "--speed", "0.2") as s:  # slow enough to be seen on a busy machine
            s.await_text(r"Y +-5 steps")
            s.send(b"x")
            s.await_text(r"X +-\d+ steps .* coils (AB--|-BC-|--CD|A--D) .* -(99|100)\.\d steps/s")
            s.await_text(r"X +-50 steps +-5.0 deg +coils ---- .* 0.0 steps/s +50 made")
            s.await_text(r"typed: x\n")

    def test_backspace_key_is_a_halt_whatever_the_terminal_sends(self):
        for key in (b"\x7f", b"\x08"):
            with Screen("--start", "0,0") as s:
                s.await_text(r"Y +-5 steps")
                s.send(key)
                s.await_text(r"Y +-25 steps")
                s.await_text(r"typed: \^H\n")

    def test_ctrl_r_goes_to_the_board_and_keys_of_several_bytes_do_not(self):
        with Screen("--start", "0,0") as s:
            s.await_text(r"Y +-5 steps")
            s.send(b"\x12")
            s.await_text(r"Y +-35 steps")
            s.send(b"\x1bA\x1bBx")  # cursor up, cursor down
            s.await_text(r"X +-50 steps")
            s.await_text(r"typed: \^Rx\n")

    def test_lost_steps_and_wrong_patterns_are_a_warning(self):
        with Screen("--start", "0,0") as s:
            s.await_text(r"Y +-5 steps")
            s.send(b"fw")
            s.await_text(r"X: \d+ steps lost, 1 wrong patterns")

    def test_board_that_speaks_is_noticed(self):
        with Screen() as s:
            s.await_text(r"Y +-205 steps")
            s.send(b"t")
            s.await_text(r"the Nano has sent 1 bytes")

    def test_small_terminal_has_no_drawings(self):
        with Screen("--start", "0,0", rows=12, columns=80) as s:
            shown = s.await_text(r"Y +-5 steps")
            self.assertNotIn("azimuth", shown)
            self.assertIn("Ctrl-C", shown)

    def test_own_keys(self):
        with Screen("--start", "0,0") as s:
            s.await_text(r"Y +-5 steps")
            s.send(MENU + b"r")
            s.await_text(r"Y +-9 steps")  # its pattern starts anew, the rotor is drawn to it
            s.send(MENU + b"x")
            s.await_text(r"X .* sensor high")
            s.await_text(r"azimuth sensor: stuck high")
            s.send(MENU + b"?")
            s.await_text(r"p  power off and on")
            s.send(MENU + b"?")
            s.await_text(r"azimuth, from above")

    def test_keys_that_quit_restore_the_terminal_and_the_state_is_printed(self):
        for keys in (b"\x03", MENU + b"q"):
            with Screen("--start", "0,0") as s:
                s.await_text(r"Y +-5 steps")
                s.send(keys)
                self.assertEqual(s.end(), (0, s.before))
                self.assertIn(b"x=0 y=-5 ", s.seen)

    def test_signals_restore_the_terminal(self):
        for number in (signal.SIGTERM, signal.SIGHUP):
            with Screen() as s:
                s.await_text(r"Ninja on")
                s.child.send_signal(number)
                self.assertEqual(s.end(), (-number, s.before))


@unittest.skipUnless(os.path.exists(FIRMWARE), "build/ninja.elf is not there")
class Firmware(unittest.TestCase):
    """The firmware itself."""

    def moves(self, given, *arguments):
        done = run(*arguments, image=FIRMWARE, given=given)
        self.assertEqual(done.returncode, 0, done.stderr)
        state = state_of(done)
        for name in ("x_lost", "y_lost", "x_wrong", "y_wrong", "x_coils", "y_coils", "sent"):
            self.assertEqual(state[name], 0, (name, state))
        return state["x"], state["y"]

    def test_power_up_centres_from_either_side(self):
        for start in ("300,-200", "-300,200", "0,0", "-1,-1", "1800,550", "-1800,-1200"):
            with self.subTest(start):
                self.assertEqual(self.moves(b"", "--start=" + start), (0, 0))

    def test_moves_end_where_they_are_sent(self):
        self.assertEqual(self.moves(b"X100Y50S"), (100, 50))
        self.assertEqual(self.moves(b"X-900Y-70V40M\nX5000Y5000S\nX-300Y-40I\n", "--wait"), (1500, 510))

    def test_macro_runs(self):
        self.assertEqual(self.moves(b"(X40Y-40S\nX0Y0S\nX-7S)R", "--wait"), (-7, 0))

    def test_another_backlash_than_expected_is_seen(self):
        self.assertNotEqual(self.moves(b"X100S\nX0S\n", "--wait", "--backlash", "40,6"), (0, 0))

    def test_stuck_sensor_ends_in_bounded_time(self):
        done = run("--stuck", "x=high", "--stuck", "y=low", image=FIRMWARE)
        state = state_of(done)
        self.assertEqual((state["x_coils"], state["y_coils"]), (0, 0))
        self.assertLess(state["seconds"], 60)

    def test_at_the_terminal(self):
        with Screen("--start", "20,-20", image=FIRMWARE) as s:
            s.await_text(r"X +0 steps(.|\n)*Y +0 steps")
            s.send(b"X-200Y100S")
            s.await_text(r"X +-200 steps +-20.0 deg +coils ----(.|\n)*Y +100 steps +10.0 deg +coils ----")

    def test_halt_at_the_terminal_and_resume(self):
        with Screen("--start", "0,0", image=FIRMWARE) as s:
            s.await_text(r"X +0 steps .* coils ---- .* [1-9]\d* made(.|\n)*Y +0 steps .* coils ---- .* [1-9]\d* made")
            s.send(b"X600M")
            s.await_text(r"X +[1-5]\d\d steps")
            s.send(b"\x7f")
            s.await_text(r"X +[1-5]\d\d steps .* coils ----")
            s.send(b"S")
            self.assertNotIn("lost", s.await_text(r"X +600 steps .* coils ----"))


if __name__ == "__main__":
    sys.exit(unittest.main())
