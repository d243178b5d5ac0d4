#!/usr/bin/env python3
"""Runs test binaries and checks side by side and sums them up.

Each test program, Unity's or Python's unittest, counts with the totals it prints; each check (a command that succeeds or fails) counts as one
test. A program that is missing, crashes, runs out of time or runs no test counts as one failure more. What a program or
a check printed is kept in <results>/<name>.txt. The last line is `N passed, N failed`; the exit code is 0 if nothing failed.
"""
import argparse
import concurrent.futures
import pathlib
import re
import shlex
import subprocess
import sys
import time

UNITY_TOTALS = re.compile(r"^(\d+) Tests (\d+) Failures (\d+) Ignored", re.MULTILINE)
PYTHON_TOTAL = re.compile(r"^Ran (\d+) tests? in .*\n\n(?:OK|FAILED)(?: \((.*)\))?$", re.MULTILINE)
FAILED_LINE = re.compile(r"^.*:FAIL.*$", re.MULTILINE)
TAIL_LINES = 25


class Outcome:
    """What one program or check came to."""

    def __init__(self, name, passed, failed, ignored, seconds, note, output):
        self.name, self.passed, self.failed, self.ignored = name, passed, failed, ignored
        self.seconds, self.note, self.output = seconds, note, output

    def line(self):
        """Returns the summary that is printed."""
        ignored = f", {self.ignored} ignored" if self.ignored else ""
        note = f"  ({self.note})" if self.note else ""
        verdict = "FAILED" if self.failed else "ok"
        return f"{verdict:6} {self.name:34} {self.passed:4} passed, {self.failed} failed{ignored}  {self.seconds:.1f} s{note}"


def read_totals(output):
    """Returns (tests, failures, ignored) as a test program has printed them, all of it summed."""
    totals = [tuple(map(int, found)) for found in UNITY_TOTALS.findall(output)]
    for ran, details in PYTHON_TOTAL.findall(output):
        counts = dict(part.split("=") for part in details.split(", ")) if details else {}
        failures = sum(int(counts.get(kind, 0)) for kind in ("failures", "errors", "unexpected successes"))
        totals.append((int(ran), failures, int(counts.get("skipped", 0))))
    return tuple(sum(column) for column in zip(*totals)) if totals else (0, 0, 0)


def run(name, command, counts, results, timeout_s):
    """Runs one command, a test program that counts or a check, and returns its Outcome."""
    start = time.monotonic()
    note = ""
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout_s
        )
        code, output = done.returncode, done.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired as expired:
        code, output = None, (expired.stdout or b"").decode(errors="replace")
        note = f"stopped after {timeout_s} s"
    except OSError as error:
        code, output = None, f"{error}\n"
        note = "was not built"
    seconds = time.monotonic() - start
    (results / f"{name}.txt").write_text(output, encoding="utf-8")

    if not counts:
        good = code == 0
        skipped = re.search(r"^\w+: skipped\b.*$", output, re.MULTILINE)
        if good and skipped:
            return Outcome(name, 0, 0, 1, seconds, skipped[0], output)
        return Outcome(name, int(good), int(not good), 0, seconds, note, output)

    tests, failures, ignored = read_totals(output)
    failed = failures
    if tests == 0 and not note:
        note = "ran no test"
    elif code != 0 and failures == 0 and not note:
        note = f"ended with code {code}"
    if note:
        failed += 1
    return Outcome(name, tests - failures - ignored, failed, ignored, seconds, note, output)


def report(outcome):
    """Prints an outcome, and of a failed one what it said."""
    print(outcome.line(), flush=True)
    if outcome.failed:
        lines = FAILED_LINE.findall(outcome.output)
        if not lines or outcome.note:
            lines += outcome.output.splitlines()[-TAIL_LINES:]
        for line in lines:
            print(f"       {line}", flush=True)


def main():
    """Runs everything and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=pathlib.Path, default=pathlib.Path("build/test-results"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--timeout", type=int, default=1500, help="seconds for one program")
    parser.add_argument("--tests", action="append", default=[], metavar="COMMAND", help="a test program")
    parser.add_argument("--check", action="append", default=[], metavar="NAME=COMMAND")
    parser.add_argument("--last", action="append", default=[], metavar="NAME=COMMAND", help="a check after all others")
    arguments = parser.parse_args()

    arguments.results.mkdir(parents=True, exist_ok=True)
    for old in arguments.results.glob("*.txt"):
        old.unlink()

    def start(pool, text, counts):
        if counts:
            command = shlex.split(text)
            name = "-".join(pathlib.Path(command[-1]).with_suffix("").parts[-2:])
        else:
            name, _, line = text.partition("=")
            command = shlex.split(line)
        return pool.submit(run, name, command, counts, arguments.results, arguments.timeout)

    outcomes = []
    for programs, checks in ((arguments.tests, arguments.check), ([], arguments.last)):
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            running = [start(pool, text, True) for text in programs] + [start(pool, text, False) for text in checks]
            for finished in concurrent.futures.as_completed(running):
                outcomes.append(finished.result())
                report(outcomes[-1])

    passed, failed = sum(o.passed for o in outcomes), sum(o.failed for o in outcomes)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
