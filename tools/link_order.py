#!/usr/bin/env python3
"""Finds the order of the functions in flash with the most short calls, and writes it for the linker.

A call or a jump over less than 4 KB takes two bytes (RCALL, RJMP), any other one four: which ones are short is decided by
the order alone. This program takes the functions and their calls from an image and its map, moves some of them about,
again and again (simulated annealing), and writes one line a function to firmware/link_order.ld, which firmware/image.ld
includes. Functions are written by their names in the source, without what the compiler appends to those of its own
copies; all of one name stay together. What is not in the file is linked behind the others, and names that are no more
are passed over: the file need not be right, only good. `make link-order` renews it.
"""
import argparse
import math
import pathlib
import random
import re
import subprocess

REACH = 4096 - 16  # bytes, less what an order may shift by
SOFT = 1 / 40000  # of a long call for each byte: where it could become a short one
HEAT_FIRST, HEAT_LAST = 3.0, 0.05
START_UP = ".init"  # these sections follow each other
COPY = re.compile(r"\.(constprop|lto_priv|part|isra)\.\d+")
MAP_LINE = re.compile(r"^ (\.(?:text|init)[\w.]+)\s+0x([0-9a-f]+)\s+0x([0-9a-f]+) ")
CALL = re.compile(r"^ *([0-9a-f]+):\t(?:call|jmp|rcall|rjmp)\t[^;]*; 0x([0-9a-f]+)")


def name_of(section):
    """Returns the name that a section goes by."""
    return START_UP if section.startswith(START_UP) else COPY.sub("", section)


def pattern(name):
    """Returns the linker's line for a name."""
    if name == START_UP:
        return f"KEEP(*(SORT({START_UP}*)))"
    own = name.count(".") == 2 and not name.startswith(".text.libgcc")
    return f"*({name} {name}.*)" if own else f"*({name})"


def sections_of(map_file, pinned):
    """Returns [(address, bytes, name)] of the sections with code that may be moved, ascending."""
    text = pathlib.Path(map_file).read_text(encoding="utf-8")
    text = text[text.index("\n.text") :].replace("\n                0x", " 0x")
    found = []
    for match in filter(None, map(MAP_LINE.match, text.splitlines())):
        if int(match[3], 16) and match[1] not in pinned:
            found.append((int(match[2], 16), int(match[3], 16), name_of(match[1])))
    return sorted(found)


def calls_of(objdump, elf):
    """Returns [(from, to)]: the addresses of all calls and jumps."""
    text = subprocess.run([objdump, "-d", "--no-show-raw-insn", elf], check=True, stdout=subprocess.PIPE, text=True)
    return [(int(m[1], 16), int(m[2], 16)) for m in map(CALL.match, text.stdout.splitlines()) if m]


class Layout:
    """Units, each all functions of a name, in an order; and the calls between them."""

    def __init__(self, sections, calls):
        self.names = list(dict.fromkeys(name for _, _, name in sections))
        index = {name: i for i, name in enumerate(self.names)}
        self.size = [0] * len(self.names)
        place = []  # of each section: its address, its end, its unit, and what an address lies above the unit's beginning
        for start, size, name in sections:
            unit = index[name]
            place.append((start, start + size, unit, self.size[unit] - start))
            self.size[unit] += size

        def locate(address):
            return next(((unit, address + shift) for start, end, unit, shift in place if start <= address < end), None)

        self.calls = []
        for source, target in calls:
            a, b = locate(source), locate(target)
            if a and b and a[0] != b[0]:
                self.calls.append((a[0], b[0], b[1] - a[1]))
        self.order = list(range(len(self.names)))

    def distances(self, order):
        """Returns how far each call goes."""
        start = [0] * len(order)
        at = 0
        for unit in order:
            start[unit] = at
            at += self.size[unit]
        return [abs(start[b] + d - start[a]) for a, b, d in self.calls]

    def long_calls(self):
        """Returns how many are long."""
        return sum(1 for far in self.distances(self.order) if far >= REACH)

    def cost(self, order):
        """Returns what is to become least."""
        return sum([1 + far * SOFT for far in self.distances(order) if far >= REACH])

    def anneal(self, rounds, seed):
        """Moves runs of units to other places, at first also where that costs more."""
        rng = random.Random(seed)
        order, cost = self.order, self.cost(self.order)
        best, least = order, cost
        for i in range(rounds):
            heat = HEAT_FIRST * (1 - i / rounds) ** 2 + HEAT_LAST
            begin = rng.randrange(len(order))
            end = begin + (1 if rng.random() < 0.6 else rng.randrange(1, 12))
            run, rest = order[begin:end], order[:begin] + order[end:]
            at = rng.randrange(len(rest) + 1)
            trial = rest[:at] + run + rest[at:]
            new = self.cost(trial)
            if new <= cost or rng.random() < math.exp((cost - new) / heat):
                order, cost = trial, new
                if cost < least:
                    best, least = order, cost
        self.order = best


def main():
    """Writes the order."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("elf")
    parser.add_argument("--map", required=True)
    parser.add_argument("--objdump", default="avr-objdump")
    parser.add_argument("--pinned", nargs="*", default=[], help="sections that image.ld places itself")
    parser.add_argument("--rounds", type=int, default=600000)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--write", type=pathlib.Path, default=pathlib.Path("firmware/link_order.ld"))
    arguments = parser.parse_args()

    layout = Layout(sections_of(arguments.map, arguments.pinned), calls_of(arguments.objdump, arguments.elf))
    before = layout.long_calls()
    layout.anneal(arguments.rounds, arguments.seed)
    lines = [pattern(layout.names[unit]) for unit in layout.order]
    arguments.write.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{arguments.write}: {layout.long_calls()} long calls, {before} before")


if __name__ == "__main__":
    main()
