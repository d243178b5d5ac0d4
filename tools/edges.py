#!/usr/bin/env python3
"""Reads the compact edge files of sacsim (--edges FILE): statistics of every pin, or the edges as CSV.

    tools/edges.py run.edges                 statistics
    tools/edges.py run.edges --csv           all edges on standard output
    tools/edges.py run.edges --csv out.csv   ... into a file

The CSV is the same as that of `sacsim --edges FILE.csv`: cycle,time_s,pin,level. The format of the compact file is
described in tools/sacsim/trace.h. Python's standard library is all it needs; as a module it offers read().
"""

import argparse
import signal
import struct
import sys

MAGIC = b"SACEDGE"
VERSION = 1


class FormatError(Exception):
    """Not a compact edge file, or one of another version."""


class Recording:
    """One file: the header, and the edges as (cycle, pin name, level) in the order of time."""

    def __init__(self, hz, start_cycle, end_cycle, first_levels, edges):
        self.hz = hz
        self.start_cycle = start_cycle
        self.end_cycle = end_cycle  # None: the file was cut short
        self.first_levels = first_levels  # {pin: level at start_cycle}, in the order of the file
        self.edges = edges


def varints(data, position):
    """The varints of data from there on; an unfinished one at the end is dropped."""
    value = shift = 0
    for byte in memoryview(data)[position:]:
        value |= (byte & 0x7F) << shift
        if byte & 0x80:
            shift += 7
        else:
            yield value
            value = shift = 0


def read(path):
    """Reads a compact edge file into a Recording; raises FormatError or OSError."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        if data[:7] != MAGIC:
            raise FormatError("not an edge file of sacsim")
        if data[7] != VERSION:
            raise FormatError(f"version {data[7]}, known is {VERSION}")
        hz, start_cycle, pin_count, index_bits = struct.unpack_from("<IQBB", data, 8)
        position = 8 + 14
        first_levels = {}
        for _ in range(pin_count):
            level, length = data[position : position + 2]
            name = data[position + 2 : position + 2 + length].decode("ascii")
            first_levels[name] = level
            position += 2 + length
        if len(first_levels) != pin_count:
            raise FormatError("the header is damaged")
    except (IndexError, ValueError, struct.error):
        raise FormatError("the header is damaged") from None

    pins = list(first_levels)
    edges = []
    cycle = start_cycle
    end_cycle = None
    index_mask = (1 << index_bits) - 1
    for record in varints(data, position):
        cycle += record >> (index_bits + 1)
        index = record >> 1 & index_mask
        if index == pin_count:
            end_cycle = cycle
            break
        if index > pin_count:
            raise FormatError(f"edge {len(edges) + 1} is of an unknown pin")
        edges.append((cycle, pins[index], record & 1))
    return Recording(hz, start_cycle, end_cycle, first_levels, edges)


def write_csv(recording, out):
    """cycle,time_s,pin,level: seconds with ten decimals, which for 62.5 ns is exact."""
    out.write("cycle,time_s,pin,level\n")
    hz = recording.hz
    for cycle, pin, level in recording.edges:
        out.write(f"{cycle},{cycle // hz}.{cycle % hz * 10**10 // hz:010d},{pin},{level}\n")


def statistics(recording, pin):
    """A dictionary of what happened on one pin: counts, and shortest and longest times in cycles (None: no such)."""
    rises = [cycle for cycle, name, level in recording.edges if name == pin and level]
    level = recording.first_levels[pin]
    since = recording.start_cycle
    edges = 0
    times = {0: [], 1: []}  # shortest and longest between two edges
    total_high = 0
    for cycle, name, new in recording.edges:
        if name != pin:
            continue
        if level:
            total_high += cycle - since
        if edges > 0:
            lasted = cycle - since
            low, high = times[level] or (lasted, lasted)
            times[level] = [min(low, lasted), max(high, lasted)]
        edges += 1
        level, since = new, cycle
    last = recording.edges[-1][0] if recording.edges else recording.start_cycle
    end = recording.end_cycle if recording.end_cycle is not None else last
    if level:
        total_high += end - since
    periods = [b - a for a, b in zip(rises, rises[1:])]
    return {
        "edges": edges,
        "rises": len(rises),
        "first_rise": rises[0] if rises else None,
        "last_rise": rises[-1] if rises else None,
        "period_min": min(periods, default=None),
        "period_max": max(periods, default=None),
        "high_min": times[1][0] if times[1] else None,
        "high_max": times[1][1] if times[1] else None,
        "low_min": times[0][0] if times[0] else None,
        "low_max": times[0][1] if times[0] else None,
        "high_total": total_high,
        "last_level": level,
    }


def print_statistics(recording, out):
    hz = recording.hz

    def us(cycles):
        return "-" if cycles is None else f"{cycles * 1e6 / hz:.4f}".rstrip("0").rstrip(".")

    def span(low, high):
        return us(low) if low == high else f"{us(low)} to {us(high)}"

    end = recording.end_cycle
    out.write(f"from {recording.start_cycle / hz:.7f} s to ")
    out.write("?  (the recording was cut short)\n" if end is None else f"{end / hz:.7f} s\n")
    for pin in recording.first_levels:
        s = statistics(recording, pin)
        out.write(f"{pin}: {s['edges']} edges, {s['rises']} rising, now {s['last_level']}\n")
        if s["rises"] == 0:
            continue
        out.write(f"    rising from {s['first_rise'] / hz:.7f} s to {s['last_rise'] / hz:.7f} s\n")
        if s["period_min"] is not None:
            fastest, slowest = hz / s["period_min"], hz / s["period_max"]
            out.write(f"    rise to rise {span(s['period_min'], s['period_max'])} us")
            out.write(f" ({fastest:.6g} Hz)\n" if fastest == slowest else f" ({slowest:.6g} to {fastest:.6g} Hz)\n")
        for level in ("high", "low"):
            if s[f"{level}_min"] is not None:
                out.write(f"    {level} for {span(s[f'{level}_min'], s[f'{level}_max'])} us\n")
        out.write(f"    in all {s['high_total'] / hz:.7f} s high\n")


def main():
    parser = argparse.ArgumentParser(description="Statistics or CSV of a compact edge file of sacsim.")
    parser.add_argument("file", help="what sacsim --edges has written")
    parser.add_argument("--csv", nargs="?", const="-", metavar="FILE", help="write the edges as CSV (default: stdout)")
    arguments = parser.parse_args()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `| head` is no error
    try:
        recording = read(arguments.file)
        if arguments.csv is None:
            print_statistics(recording, sys.stdout)
        elif arguments.csv == "-":
            write_csv(recording, sys.stdout)
        else:
            with open(arguments.csv, "w", encoding="ascii", newline="\n") as out:
                write_csv(recording, out)
    except (FormatError, OSError) as error:
        sys.exit(f"edges.py: {arguments.file}: {error.strerror if isinstance(error, OSError) else error}")


if __name__ == "__main__":
    main()
