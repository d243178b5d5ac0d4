#!/usr/bin/env python3
"""Tests of the simulator program, run as a user would: in a terminal, through a pipe, through a serial port.

    python3 test/sim/test_sacsim.py -v [Class.test_name ...]

Environment (defaults in brackets): SACSIM the program [build/sacsim], SAC_ELF the firmware [build/sac.elf], AVR the
prefix of the cross compiler [avr-]. What the simulator does with an image is tested with a small one, probe.c; class
Firmware runs the firmware itself. Python's standard library is all that is needed; sigrok-cli is used where installed.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import termios
import time
import unittest

import terminal  # (test/sim/terminal.py)
from simulator import HERE, TOP, Complaining, Simulator, built  # (test/sim/simulator.py)
from terminal import PATIENCE_S, Reader

sys.path.insert(0, os.path.join(TOP, "tools"))
import edges  # noqa: E402  (tools/edges.py)

SIM = Simulator("sacsim", "probe.c")
setUpModule, tearDownModule, path_of, run = SIM.set_up, SIM.tear_down, SIM.path_of, SIM.run
SACSIM = SIM.path
FIRMWARE = built("SAC_ELF", "sac.elf")
MENU = b"\x1d"  # Ctrl-]


def run_slowly(keys, *arguments):
    """Types the keys one by one with pauses (the probe is deaf while it makes pulses); returns output and exit code."""
    with subprocess.Popen(
        [SACSIM, *arguments, SIM.probe], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as child:
        time.sleep(0.2)
        for key in keys:
            child.stdin.write(bytes([key]))
            child.stdin.flush()
            time.sleep(0.05)
        output, errors = child.communicate(timeout=PATIENCE_S)
    return output, errors, child.returncode


class Terminal(terminal.Terminal):
    """sacsim as a user runs it."""

    def __init__(self, *arguments, image=None, **screen):
        super().__init__([SACSIM, *arguments, image or SIM.probe], **screen)

    def expect_status(self, pattern, row=24):
        """Waits for a status line in that row that has the pattern."""
        return self.expect(rb"\x1b\[%d;1H\x1b\[0;7m[^\x1b]*?(?:%s)[^\x1b]*\x1b\[0m" % (row, pattern))


class Script(unittest.TestCase):
    """Input from a pipe."""

    def test_piped_bytes_are_typed_after_the_hello(self):
        done = run(given=b"abd")
        self.assertEqual(done.stdout, b"hello 1\r\nSAC>abd")
        self.assertEqual(done.stderr, b"")
        self.assertEqual(done.returncode, 0)

    def test_empty_input_ends_when_the_board_is_idle(self):
        done = run()
        self.assertEqual(done.stdout, b"hello 1\r\nSAC>")
        self.assertEqual(done.returncode, 0)

    def test_many_bytes_arrive_at_the_baud_rate_without_loss(self):
        given = bytes(range(0x30, 0x3A)) * 300
        self.assertEqual(run(given=given).stdout, b"hello 1\r\nSAC>" + given)

    def test_another_baud_rate_than_the_image_s_garbles(self):
        self.assertNotIn(b"SAC>", run("--baud", "57600").stdout)

    def test_end_waits_for_the_motor(self):
        path = path_of("motor.csv")
        run("--edges", path, given=b"p")
        with open(path, encoding="ascii") as file:
            self.assertEqual(sum(line.endswith(",clk,1\n") for line in file), 20)

    def test_end_does_not_come_while_the_state_says_cruise(self):
        done = run("--for", "3", "--edges", path_of("cruise.edges"), given=b"c")
        self.assertEqual(done.returncode, 0)
        # the instruction that is running then is carried to its end
        self.assertAlmostEqual(edges.read(path_of("cruise.edges")).end_cycle, 3 * 16_000_000, delta=4)

    def test_linger_is_simulated_time_without_output(self):
        short, long = path_of("short.edges"), path_of("long.edges")
        run("--linger", "100", "--edges", short)
        run("--linger", "2000", "--edges", long)
        spread = edges.read(long).end_cycle - edges.read(short).end_cycle
        self.assertAlmostEqual(spread / 16e6, 1.9, delta=0.03)

    def test_slow_writer_is_waited_for(self):
        output, _, code = run_slowly(b"ab", "--linger", "1")
        self.assertEqual(output, b"hello 1\r\nSAC>ab")
        self.assertEqual(code, 0)

    def test_real_time_is_real(self):
        start = time.monotonic()
        run("--for", "1.5", "--linger", "10000", fast=False)
        self.assertGreaterEqual(time.monotonic() - start, 1.45)

    def test_real_time_does_not_spin_while_the_board_sleeps_or_waits(self):
        before = os.times()
        run("--for", "1.5", "--linger", "10000", fast=False)
        after = os.times()
        self.assertLess(after.children_user + after.children_system - before.children_user - before.children_system, 1.2)

    def test_wire_joins_two_posts(self):
        self.assertIn(b"tn", run(given=b"t").stdout)
        self.assertIn(b"ty", run("--wire", "out_1mhz=xclk", given=b"t").stdout)


class Complaints(Complaining):
    sim = SIM

    def test_no_image(self):
        done = subprocess.run([SACSIM], capture_output=True, stdin=subprocess.DEVNULL, timeout=10)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"which image?", done.stderr)

    def test_two_images(self):
        self.complains(2, b"one too many", SIM.probe)

    def test_missing_image(self):
        self.complains(1, b"cannot read /nowhere.elf: No such file", image="/nowhere.elf")

    def test_image_that_is_none(self):
        self.complains(1, b"probe.c", image=os.path.join(HERE, "probe.c"))

    def test_unknown_option(self):
        self.complains(2, b"--nonsense", "--nonsense")

    def test_baud_out_of_range(self):
        self.complains(2, b"--baud: '3' is not a number from 300", "--baud", "3")

    def test_baud_not_a_number(self):
        self.complains(2, b"--baud: '9600x' is not a number", "--baud", "9600x")

    def test_unknown_post(self):
        self.complains(2, b"no post is called 'clock'", "--pins", "clk,clock")

    def test_wire_from_an_input(self):
        self.complains(2, b"--wire: 'xclk=sync' does not lead from an output", "--wire", "xclk=sync")

    def test_link_without_pty(self):
        self.complains(2, b"--link needs --pty", "--link", path_of("nothing"))

    def test_recording_that_cannot_be_written(self):
        self.complains(1, b"cannot write /nowhere/e.csv: No such file", "--edges", "/nowhere/e.csv")

    def test_recording_on_a_full_disk(self):
        done = run("--vcd", "/dev/full")
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"/dev/full is incomplete: No space left", done.stderr)

    def test_crash_of_the_image(self):
        done = run(given=b"X")
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"the firmware crashed at 0.", done.stderr)

    def test_help_version_and_list_of_posts(self):
        self.assertIn(b"--edges=FILE", run("--help").stdout)
        self.assertRegex(run("--version").stdout, rb"^sacsim \d")
        self.assertRegex(run("--pins", "list").stdout, rb"(?m)^clk +D10 +output ")


class Recordings(unittest.TestCase):
    """Compact, CSV and VCD hold the same edges."""

    @classmethod
    def setUpClass(cls):
        cls.compact, cls.csv, cls.vcd = path_of("r.edges"), path_of("r.csv"), path_of("r.vcd")
        run_slowly(b"pn", "--edges", cls.compact, "--vcd", cls.vcd)
        cls.recording = edges.read(cls.compact)

    def test_compact_file_has_every_edge(self):
        clk = edges.statistics(self.recording, "clk")
        self.assertEqual((clk["edges"], clk["rises"], clk["last_level"]), (50, 25, 0))
        dir_ = edges.statistics(self.recording, "dir")
        self.assertEqual((dir_["edges"], dir_["last_level"]), (1, 1))
        self.assertIsNotNone(self.recording.end_cycle)

    def test_compact_file_has_exact_cycles(self):
        clk = edges.statistics(self.recording, "clk")
        # 5 us of busy waiting, the cycles of CBI or of a load, a change and a store around it
        self.assertTrue(80 <= clk["high_min"] == clk["high_max"] <= 84, clk)

    def test_csv_file_says_the_same_as_edges_py(self):
        run("--edges", self.csv, given=b"p")
        run("--edges", path_of("s.edges"), given=b"p")
        converted = subprocess.run(
            [os.path.join(TOP, "tools", "edges.py"), path_of("s.edges"), "--csv"], capture_output=True, check=True
        )
        with open(self.csv, "rb") as file:
            written = file.read()
        self.assertRegex(written, rb"^cycle,time_s,pin,level\n\d+,0\.\d{10},clk,1\n")
        self.assertEqual(self.since_first_edge(written), self.since_first_edge(converted.stdout))

    def since_first_edge(self, text):
        """(cycles since the first edge, pin, level) of each line: two runs take their input at different moments."""
        header, *lines = [line.split(",") for line in text.decode().splitlines()]
        self.assertEqual(header, ["cycle", "time_s", "pin", "level"])
        for cycle, time_s, _, _ in lines:
            self.assertEqual(time_s, f"{int(cycle) / 16e6:.10f}")
        return [(int(cycle) - int(lines[0][0]), pin, level) for cycle, _, pin, level in lines]

    def test_statistics_of_edges_py(self):
        done = subprocess.run(
            [os.path.join(TOP, "tools", "edges.py"), self.compact], capture_output=True, check=True, text=True
        )
        self.assertIn("clk: 50 edges, 25 rising, now 0", done.stdout)
        self.assertIn("dir: 1 edges, 1 rising, now 1", done.stdout)

    def test_file_cut_short_is_read_up_to_there(self):
        with open(self.compact, "rb") as file:
            data = file.read()
        with open(path_of("cut.edges"), "wb") as file:
            file.write(data[: len(data) // 2])
        cut = edges.read(path_of("cut.edges"))
        self.assertIsNone(cut.end_cycle)
        self.assertEqual(cut.edges, self.recording.edges[: len(cut.edges)])
        self.assertGreater(len(cut.edges), 10)

    def test_other_file_is_refused_by_edges_py(self):
        with self.assertRaises(edges.FormatError):
            edges.read(self.vcd)

    def test_vcd_has_the_same_edges_625_units_a_cycle(self):
        with open(self.vcd, encoding="ascii") as file:
            head, body = file.read().split("$enddefinitions $end\n")
        self.assertIn("$timescale 100 ps $end", head)
        names = dict(re.findall(r"\$var wire 1 (\S) (\S+) \$end", head))
        self.assertEqual(set(names.values()), {"clk", "dir"})
        found, now = [], None
        for line in body.replace("$dumpvars\n0!\n0\"\n$end\n", "").splitlines():
            if line[0] == "#":
                self.assertEqual(int(line[1:]) % 625, 0)
                now = int(line[1:]) // 625
            else:
                found.append((now, names[line[1]], int(line[0])))
        self.assertEqual(found, self.recording.edges)
        self.assertEqual(now, self.recording.end_cycle)

    @unittest.skipUnless(shutil.which("sigrok-cli"), "sigrok-cli is not installed")
    def test_sigrok_counts_the_pulses(self):
        done = subprocess.run(
            ["sigrok-cli", "-I", "vcd:downsample=625", "-i", self.vcd, "-P", "counter:data=clk:data_edge=rising"],
            capture_output=True,
            check=True,
            timeout=60,
        )
        self.assertTrue(done.stdout.endswith(b"counter-1: 25\n"), done.stdout[-100:])

    def test_all_posts_can_be_recorded(self):
        run("--pins", "all", "--edges", path_of("all.edges"), given=b"p")
        recording = edges.read(path_of("all.edges"))
        self.assertGreaterEqual(len(recording.first_levels), 18)
        self.assertEqual(edges.statistics(recording, "clk")["rises"], 20)

    def test_signal_leaves_whole_files(self):
        path = path_of("killed.edges")
        with subprocess.Popen(
            [SACSIM, "--edges", path, SIM.probe], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as child:
            Reader(child.stdout.fileno()).expect(b"SAC>")
            child.terminate()
            self.assertEqual(child.wait(timeout=PATIENCE_S), -signal.SIGTERM)
        self.assertIsNotNone(edges.read(path).end_cycle)


class Eeprom(unittest.TestCase):
    """The EEPROM's file."""

    def setUp(self):
        self.path = path_of(self.id().rsplit(".", maxsplit=1)[-1])

    def content(self):
        with open(self.path, "rb") as file:
            return file.read()

    def test_missing_file_is_made_erased(self):
        run("--eeprom", self.path)
        self.assertEqual(self.content(), b"\xff" * 1024)

    def test_written_byte_is_kept_and_the_rest_left(self):
        before = bytes(i % 251 for i in range(1024))
        with open(self.path, "wb") as file:
            file.write(before)
        run("--eeprom", self.path, given=b"w")
        self.assertEqual(self.content(), before[:7] + b"\x5a" + before[8:])

    def test_file_of_another_size_is_refused_and_left(self):
        with open(self.path, "wb") as file:
            file.write(b"precious")
        done = run("--eeprom", self.path)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"must have 1024 bytes", done.stderr)
        self.assertEqual(self.content(), b"precious")

    def test_link_to_the_file_stays_a_link(self):
        os.symlink("real-" + os.path.basename(self.path), self.path)
        with open(self.path, "wb") as file:
            file.write(b"\xff" * 1024)
        run("--eeprom", self.path, given=b"w")
        self.assertTrue(os.path.islink(self.path))
        self.assertEqual(self.content()[7], 0x5A)

    def test_change_is_saved_while_running_and_no_other_file_stays(self):
        with subprocess.Popen(
            [SACSIM, "--eeprom", self.path, SIM.probe], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as child:
            Reader(child.stdout.fileno()).expect(b"SAC>")
            child.stdin.write(b"w")
            child.stdin.flush()
            limit = time.monotonic() + PATIENCE_S
            while self.content()[7] != 0x5A and time.monotonic() < limit:
                time.sleep(0.1)
            child.kill()
        self.assertEqual(self.content()[7], 0x5A)
        name = os.path.basename(self.path)
        self.assertEqual([f for f in os.listdir(SIM.folder.name) if f.startswith(name)], [name])


class AtTheTerminal(unittest.TestCase):
    """Keys, status line, and the terminal's way back."""

    def test_keys_reach_the_board_and_quit_restores_the_terminal(self):
        with Terminal() as t:
            t.expect(rb"Ctrl-\] q quits")
            t.expect(rb"SAC>")
            self.assertNotEqual(termios.tcgetattr(t.slave), t.before)
            t.send(b"zz")
            t.expect(rb"z.*z")
            t.send(MENU + b"q")
            self.assertEqual(t.end(), (0, t.before))
            self.assertIn(b"\x1b[r", t.seen[t.seen.rindex(b"\x1b[24;1H") :])  # no scroll region is left

    def test_ctrl_c_goes_to_the_board(self):
        with Terminal("--no-status") as t:
            t.expect(rb"SAC>")
            t.send(b"\x03")
            t.expect(rb"Ctrl-C went to the Nano; Ctrl-\] q quits")
            t.expect(rb"\x03")

    def test_ctrl_bracket_twice_sends_it(self):
        with Terminal("--no-status") as t:
            t.expect(rb"SAC>")
            t.send(MENU + MENU)
            t.expect(rb"\x1d")

    def test_signals_restore_the_terminal(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
            with self.subTest(number), Terminal() as t:
                t.expect(rb"SAC>")
                t.child.send_signal(number)
                self.assertEqual(t.end(), (-number, t.before))

    def test_abort_restores_the_terminal(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.child.send_signal(signal.SIGABRT)
            self.assertEqual(t.end(), (-signal.SIGABRT, t.before))

    def test_crash_of_the_image_restores_the_terminal(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.send(b"X")
            t.expect(rb"the firmware crashed")
            self.assertEqual(t.end(), (3, t.before))

    def test_stop_and_continue(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.child.send_signal(signal.SIGTSTP)
            limit = time.monotonic() + PATIENCE_S
            while termios.tcgetattr(t.slave) != t.before and time.monotonic() < limit:
                t.pump(0.05)
            self.assertEqual(termios.tcgetattr(t.slave), t.before)
            t.pump(0.2)
            t.position = len(t.seen)
            t.child.send_signal(signal.SIGCONT)
            t.expect_status(rb"STANDBY")
            self.assertNotEqual(termios.tcgetattr(t.slave), t.before)
            t.send(b"z")
            t.expect(rb"z")

    def test_status_line_shows_state_position_and_speed(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.expect_status(rb"STANDBY pos 0 ")
            t.send(b"p")
            t.expect_status(rb"STANDBY pos 20 .* 0\.0 steps/s +0\.00 RPM")
            t.send(b"n")
            t.expect_status(rb"STANDBY pos 15 ")
            t.expect_status(rb" \d+\.\d s [01]\.\d\dx")

    def test_status_line_leaves_the_output_alone(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.expect_status(rb"STANDBY")
            t.send(b"abd")
            t.expect_status(rb"STANDBY")
            t.expect_status(rb"STANDBY")
            plain = re.sub(rb"\x1b7.*?\x1b8", b"", t.seen, flags=re.DOTALL)
            self.assertTrue(plain.endswith(b"hello 1\r\nSAC>abd"), plain)

    def test_counter_clockwise_is_a_level_of_dir(self):
        with Terminal("--cw", "1") as t:
            t.expect(rb"SAC>")
            t.send(b"p")
            t.expect_status(rb"pos -20 ")

    def test_status_line_follows_the_size_of_the_window(self):
        with Terminal() as t:
            t.expect_status(rb"STANDBY")
            t.resize(40, 60)
            t.expect(rb"\x1b\[1;39r")
            t.expect_status(rb"STANDBY", row=40)
            t.resize(3, 60)  # too small for one
            t.expect(rb"\x1b\[r")
            t.resize(12, 60)
            t.expect(rb"\x1b\[1;11r")
            t.expect_status(rb"STANDBY", row=12)

    def test_status_line_never_exceeds_the_window(self):
        with Terminal(columns=30) as t:
            line = t.expect(rb"\x1b\[24;1H\x1b\[0;7m([^\x1b]*)\x1b\[0m").group(1)
            self.assertEqual(len(line), 30)

    def test_no_status(self):
        for options, term in ((("--no-status",), "xterm"), ((), "dumb")):
            with self.subTest(options=options, term=term), Terminal(*options, term=term) as t:
                t.expect(rb"SAC>")
                t.send(MENU + b"q")
                t.end()
                self.assertNotIn(b"\x1b", t.seen)

    def test_status_line_can_be_switched(self):
        with Terminal() as t:
            t.expect_status(rb"STANDBY")
            t.send(MENU + b"s")
            t.expect(rb"\x1b\[r")
            t.send(MENU + b"s")
            t.expect(rb"\x1b\[1;23r")
            t.expect_status(rb"STANDBY")

    def test_menu_lists_the_keys(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.send(MENU + b"?")
            t.expect(rb"q  quit.*reset button.*Estop.*sync.*this list")

    def test_unknown_menu_key_does_nothing(self):
        with Terminal("--no-status") as t:
            t.expect(rb"SAC>")
            t.send(MENU + b"z")
            t.expect(rb"Ctrl-\] \? lists the keys")
            t.send(b"a")
            t.expect(rb"a")
            self.assertNotIn(b"z", t.seen.split(b"SAC>")[1])

    def test_reset_and_power_keys(self):
        with Terminal() as t:
            t.expect(rb"hello 1")  # PORF
            t.send(MENU + b"r")
            t.expect(rb"hello 2")  # EXTRF
            t.send(MENU + b"p")
            t.expect(rb"hello 1")

    def test_estop_key_grounds_and_releases(self):
        with Terminal() as t:
            t.expect(rb"SAC>")
            t.send(b"l")
            t.expect(rb"l.*?1")
            t.send(MENU + b"e")
            t.expect_status(rb"Estop grounded")
            t.send(b"l")
            t.expect(rb"l.*?0")
            t.send(MENU + b"e")
            t.expect_status(rb"Estop released")
            t.send(b"l")
            t.expect(rb"l.*?1")

    def test_sync_key_gives_one_falling_edge(self):
        with Terminal("--no-status") as t:
            t.expect(rb"SAC>")
            t.send(b"y")
            t.expect(rb"y0")
            t.send(MENU + b"y")
            t.expect(rb"sync grounded")
            t.send(b"y")
            t.expect(rb"y1")
            t.send(b"y")
            t.expect(rb"y0")

    def test_hang_up_ends_the_program(self):
        t = Terminal()
        t.expect(rb"SAC>")
        os.close(t.slave)
        os.close(t.descriptor)
        self.assertEqual(t.child.wait(timeout=PATIENCE_S), -signal.SIGHUP)


class SerialPort(unittest.TestCase):
    """The board's terminal on a pseudo terminal."""

    def start(self, *arguments, image=None):
        child = subprocess.Popen(
            [SACSIM, "--pty", *arguments, image or SIM.probe],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self.addCleanup(child.wait)
        self.addCleanup(child.terminate)
        self.addCleanup(child.stdout.close)
        match = Reader(child.stdout.fileno()).expect(rb"sacsim: serial port (\S+)(?: = (\S+))?\n")
        return child, match.group(1).decode()

    @staticmethod
    def open(path):
        """As a serial program does: open, raw, forget what came before."""
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
        termios.tcflush(descriptor, termios.TCIOFLUSH)
        return Reader(descriptor)

    def test_opening_resets_and_the_prompt_comes(self):
        _, path = self.start()
        port = self.open(path)
        port.expect(rb"hello 2\r\nSAC>")
        port.send(b"a\r")
        port.expect(rb"a\r")
        os.close(port.descriptor)

    def test_port_can_be_opened_again_and_again(self):
        _, path = self.start()
        for _ in range(3):
            port = self.open(path)
            port.expect(rb"hello 2\r\nSAC>")
            os.close(port.descriptor)
            time.sleep(0.05)

    def test_port_without_reset(self):
        _, path = self.start("--no-reset")
        time.sleep(0.3)
        port = self.open(path)
        port.send(b"q")
        port.expect(rb"q")
        self.assertNotIn(b"hello", port.seen)
        os.close(port.descriptor)

    def test_link_is_made_replaced_and_removed(self):
        link = path_of("port")
        os.symlink("/nowhere", link)
        child, path = self.start("--link", link)
        self.assertEqual(os.readlink(link), path)
        port = self.open(link)
        port.expect(rb"SAC>")
        os.close(port.descriptor)
        child.terminate()
        child.wait(timeout=PATIENCE_S)
        self.assertFalse(os.path.lexists(link))

    def test_link_never_replaces_a_file(self):
        path = path_of("a-file")
        with open(path, "w", encoding="ascii") as file:
            file.write("precious")
        done = run("--pty", "--link", path)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"cannot make the link", done.stderr)
        self.assertTrue(os.path.isfile(path))

    def test_listener_that_does_not_read_loses_bytes_and_blocks_nothing(self):
        _, path = self.start()
        port = self.open(path)
        port.expect(rb"SAC>")
        for _ in range(40):
            port.send(b"x" * 100)  # the echo is not read
            time.sleep(0.02)
        os.close(port.descriptor)
        time.sleep(0.1)
        port = self.open(path)
        port.expect(rb"hello 2\r\nSAC>")
        os.close(port.descriptor)

    @unittest.skipUnless(os.path.exists(FIRMWARE), f"{FIRMWARE} is not built")
    def test_firmware_behind_a_port(self):
        _, path = self.start(image=FIRMWARE)
        port = self.open(path)
        port.expect(rb"SAC>")
        port.send(b"m20v300\r")
        port.expect(rb"m20v300\r\n.*SAC>")
        os.close(port.descriptor)

    def test_at_a_terminal_ctrl_c_ends_it(self):
        with Terminal("--pty") as t:
            t.expect(rb"serial port /dev/.*Ctrl-C quits")
            t.expect_status(rb"STANDBY")
            t.send(b"k")
            t.expect_status(rb"the Nano's terminal is at /dev/")
            t.send(b"\x03")
            self.assertEqual(t.end(), (-signal.SIGINT, t.before))


@unittest.skipUnless(os.path.exists(FIRMWARE), f"{FIRMWARE} is not built")
class Network(unittest.TestCase):
    """Several boards on one line."""

    def start(self, *arguments):
        child = subprocess.Popen(
            [SACSIM, "--nodes", "3", "--no-reset", *arguments, FIRMWARE],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
        )
        self.addCleanup(child.wait)
        self.addCleanup(child.terminate)
        self.addCleanup(child.stdout.close)
        ports = {}
        reader = Reader(child.stdout.fileno())
        for name in (b"node 10", b"node 11", b"node 12", b"bus"):
            path = reader.expect(rb"sacsim: " + name + rb" (\S+)[^\n]*\n").group(1).decode()
            port = SerialPort.open(path)
            self.addCleanup(os.close, port.descriptor)
            ports[name] = port
        return child, ports

    def test_each_node_answers_with_its_address_and_the_bus_disturbs_none(self):
        link, eeprom = path_of("net"), path_of("net.eeprom")
        for _ in range(2):  # the second time from the files
            child, ports = self.start("--link", link, "--eeprom", eeprom)
            time.sleep(1.5)  # boot
            ports[b"bus"].send(b"\x55noise for all\r\n" * 5)
            for address in (10, 11, 12):
                port = ports[b"node %d" % address]
                port.send(b"p\r")
                port.expect(rb"p\r\n.*SAC>")
                port.send(b"$C\r")
                port.expect(rb"M d_id\t\t%d\t" % address)
            self.assertTrue(os.path.islink(link + ".12") and os.path.islink(link + ".bus"))
            ports[b"bus"].pump(0.1)
            self.assertEqual(ports[b"bus"].seen, b"")  # not even its own echo
            child.terminate()
            self.assertEqual(child.wait(timeout=PATIENCE_S), -signal.SIGTERM)
            self.assertFalse(os.path.lexists(link + ".10"))
            self.assertEqual(os.path.getsize(eeprom + ".11"), 1024)

    def test_what_several_nodes_cannot_do_is_refused(self):
        done = run("--nodes", "3", "--edges", path_of("x.edges"), image=FIRMWARE)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"--nodes: neither --edges", done.stderr)


@unittest.skipUnless(os.path.exists(FIRMWARE), f"{FIRMWARE} is not built")
class Firmware(unittest.TestCase):
    """The firmware itself."""

    def test_move_from_a_pipe(self):
        path = path_of("move.edges")
        done = run("--edges", path, image=FIRMWARE, given=b"m200v150\r")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, rb"SAC>m200v150\r\n.*SAC>")
        clk = edges.statistics(edges.read(path), "clk")
        self.assertEqual((clk["rises"], clk["last_level"]), (200, 0))

    def test_move_at_the_terminal(self):
        with Terminal(image=FIRMWARE) as t:
            t.expect(rb"SAC>")
            t.send(b"m200v150\r")
            t.expect_status(rb"(?:ACCEL|CRUISE|DECEL) +pos \d+ ")
            t.expect_status(rb"STANDBY pos 200 +0\.0 steps/s")
            t.send(b"m-300\r")
            t.expect_status(rb"STANDBY pos -100 ")

    def test_uart_in_the_vcd_is_read_by_sigrok(self):
        if not shutil.which("sigrok-cli"):
            self.skipTest("sigrok-cli is not installed")
        path = path_of("uart.vcd")
        run("--vcd", path, "--pins", "hw_tx", image=FIRMWARE, given=b"?\r")
        done = subprocess.run(
            ["sigrok-cli", "-I", "vcd:downsample=625", "-i", path]
            + ["-P", "uart:rx=hw_tx:baudrate=38400:format=ascii", "-A", "uart=rx-data"],
            capture_output=True,
            check=True,
            timeout=60,
            text=True,
        )
        self.assertIn("SAC>?", done.stdout.replace("uart-1: ", "").replace("\n", ""))

    def test_reset_button_brings_the_prompt_again(self):
        with Terminal(image=FIRMWARE) as t:
            t.expect(rb"SAC>")
            t.send(MENU + b"r")
            t.expect(rb"SAC>")


if __name__ == "__main__":
    unittest.main()
