"""A program of the simulator in a terminal, for its tests."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time

PATIENCE_S = 20  # for what takes milliseconds on an idle machine


class Reader:
    """Collects what comes from a file descriptor, and waits for a pattern in it."""

    def __init__(self, descriptor):
        self.descriptor = descriptor
        self.seen = b""
        self.position = 0

    def pump(self, seconds):
        """Reads for so long, or until something has come. False at the end of the file."""
        if select.select([self.descriptor], [], [], seconds)[0]:
            try:
                data = os.read(self.descriptor, 65536)
            except OSError:
                return False
            self.seen += data
            return bool(data)
        return True

    def expect(self, pattern):
        """Waits for the pattern behind what was expected before; returns the match."""
        limit = time.monotonic() + PATIENCE_S
        while True:
            match = re.compile(pattern, re.DOTALL).search(self.seen, self.position)
            if match:
                self.position = match.end()
                return match
            if time.monotonic() > limit or not self.pump(0.2):
                raise AssertionError(f"no {pattern!r}; the last that came: {self.seen[self.position:][-400:]!r}")

    def send(self, data):
        os.write(self.descriptor, data)


class Terminal(Reader):
    """A program as a user runs it: a terminal is its input, its output and what its signals come from."""

    def __init__(self, command, rows=24, columns=100, term="xterm"):
        master, slave = pty.openpty()
        super().__init__(master)
        self.slave = slave
        self.resize(rows, columns, tell=False)
        self.before = termios.tcgetattr(slave)
        self.child = subprocess.Popen(
            command,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env={**os.environ, "TERM": term},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )

    def resize(self, rows, columns, tell=True):
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        if tell:
            self.child.send_signal(signal.SIGWINCH)

    def end(self):
        """Waits for the end; returns the exit code and the terminal's settings as they are then."""
        limit = time.monotonic() + PATIENCE_S
        while self.child.poll() is None and time.monotonic() < limit:
            self.pump(0.05)
        self.pump(0)
        return self.child.wait(timeout=1), termios.tcgetattr(self.slave)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.child.poll() is None:
            self.child.kill()
            self.child.wait()
        os.close(self.slave)
        os.close(self.descriptor)
