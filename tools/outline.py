#!/usr/bin/env python3
"""An assembler that makes the image smaller first: instructions that stand in several places are kept once, and called.

avr-gcc runs it in the place of its own (-B, see the Makefile) on the one file that holds the whole program after link
time optimisation; other files pass through. Two changes are made, neither of which the program can notice but by its
time (7 cycles a call, 2 a jump) and two bytes of stack:

  - A sequence without jumps that does not touch the stack becomes a subroutine, RCALL does not change SREG. Where one of
    its places ends with the function, that place is the subroutine.
  - What several functions end with is kept in one of them, the others jump there.

Left alone: sections with interrupts off (CLI until SREG is written), what makes a function's frame, skipped
instructions. In functions given with --timed only long sequences are looked at: there a call is a small part of the time.

A short call reaches 4 KB. Addresses are estimated from the order in which the linker puts the functions (--order), and a
subroutine stands behind the function from which it reaches most of its places: further ones get another one or none.
The largest saving is made first, until there is none.
"""
import argparse
import collections
import dataclasses
import heapq
import itertools
import pathlib
import re
import subprocess
import sys
import tempfile

REACH = 4300  # bytes of a short call or jump, and what the program between shrinks by
SHORT, LONG = 2, 4  # bytes of a call or a jump
RETURN = 2
TIMED_LEAST = 12  # bytes of a sequence, where time counts
LONGEST = 60  # instructions of a sequence
TWO_WORDS = ("lds", "sts", "call", "jmp")
SKIPS = ("sbrc", "sbrs", "sbic", "sbis", "cpse")
STACK = ("push", "pop")
CALLS = ("call", "jmp")
ENDS = ("ret", "jmp", "rjmp")
NEVER = ("cli", "sei", "reti", "ijmp", "icall", "sleep", "wdr", "spm")
LABEL = re.compile(r"^([.\w$]+):")
NUMBERED_LABEL = re.compile(r"^\s*\d+:\s*")
# The compiler's labels for the debugger: nothing jumps there.
DEBUG_LABEL = re.compile(r"^\.L(?:M\d|FBB|scope|text|etext|BBB|BBE|BE\d|FB|FE)\w*:")
PROLOGUE_END = "/* prologue"
NEAR_JUMP = re.compile(r"\.[+-]|\b\d+[bf]\b")
COPY = re.compile(r"\.(?:constprop|lto_priv|part|isra)\.\d+")
ORDER_LINE = re.compile(r"^\*\(\.text\.([\w.]+)")


@dataclasses.dataclass
class Instruction:
    """A line of the file that takes part; fixed ones stay where they are."""

    line: int
    function: str
    text: str = ""
    bytes: int = 0
    fixed: bool = True  # a label or an instruction that is never moved
    stack: bool = False  # moved only together with the end of its function
    end: bool = False
    skip: bool = False
    call: bool = False
    timed: bool = False  # time counts: only long sequences
    address: int = 0


def is_fixed(text, mnemonic):
    """Tells whether an instruction must stay where it is, whatever the others are."""
    return (
        mnemonic in NEVER
        or mnemonic.startswith("br")
        or "__SP_" in text
        or "__SREG__" in text
        or NEAR_JUMP.search(text) is not None
    )


def read(lines, timed):
    """Returns the instructions and labels of an assembler file, in order."""
    found, function, off = [], "", False
    prologue = False  # its parts belong together
    for number, line in enumerate(lines):
        line = line.split(";")[0]
        prologue = prologue and not line.startswith(PROLOGUE_END)
        if DEBUG_LABEL.match(line):
            continue
        label = NUMBERED_LABEL.match(line) or LABEL.match(line)
        if label:
            if label.re is LABEL and not line.startswith(".L"):
                function, off, prologue = label[1], False, True
            found.append(Instruction(number, function))
            line = line[label.end() :]
        text = " ".join(line.split())
        if text.startswith(".section") or text == ".text":
            found.append(Instruction(number, ""))
        if not text or text[0] in "./#" or "=" in text:
            continue
        mnemonic = text.split()[0]
        off = off or mnemonic == "cli"
        found.append(
            Instruction(
                number,
                function,
                text,
                4 if mnemonic in TWO_WORDS else 2,
                fixed=bool(label) or off or prologue or is_fixed(text, mnemonic),
                timed=COPY.sub("", function) in timed,
                stack=mnemonic in STACK,
                end=mnemonic in ENDS,
                call=mnemonic in CALLS,
                skip=mnemonic in SKIPS,
            )
        )
        if mnemonic == "sei" or (mnemonic == "out" and "__SREG__" in text):
            off = False
    return found


class Program:
    """The instructions of a file, and what has become of them."""

    def __init__(self, lines, timed, order):
        self.lines = lines
        self.code = read(lines, timed)
        self.used = [False] * len(self.code)
        self.estimate_addresses(order)
        for instruction in self.code:
            if instruction.call and self.is_near(instruction, instruction.text.split()[1]):
                instruction.bytes = SHORT
        self.estimate_addresses(order)
        self.until = [0, *itertools.accumulate(instruction.bytes for instruction in self.code)]
        self.places = self.sequences()
        self.kept = collections.defaultdict(list)  # sequence -> [(address, (lines, number))]: it begins there already
        self.labels = {}  # (lines, number) -> label to be put before it; lines: "", the file's, or a subroutine's label
        self.calls = {}  # line -> instruction in its place
        self.gone = set()  # lines
        self.behind = collections.defaultdict(list)  # function -> subroutines that follow it: their lines

    def estimate_addresses(self, order):
        """Puts the functions one behind the other, in the linker's order."""
        self.size = collections.Counter()  # of each function
        for instruction in self.code:
            instruction.address = self.size[instruction.function]
            self.size[instruction.function] += instruction.bytes
        self.start = {}
        address = 0
        for name in sorted(self.size, key=lambda name: order.get(COPY.sub("", name), len(order))):
            self.start[name] = address
            address += self.size[name]
        for instruction in self.code:
            instruction.address += self.start[instruction.function]

    def is_near(self, instruction, name):
        """Tells whether a short call reaches a function or a label of the same one; of others nothing is known."""
        start = self.start.get(name, instruction.address)
        return abs(start - instruction.address) < REACH

    def sequences(self):
        """Returns {sequence: [index of its first instruction]}; a sequence is a tuple of texts."""
        places = collections.defaultdict(list)
        for first, instruction in enumerate(self.code):
            if instruction.fixed or (first and self.code[first - 1].skip):
                continue
            texts, stack = [], False
            for at in range(first, min(first + LONGEST, len(self.code))):
                instruction = self.code[at]
                if instruction.fixed:
                    break
                texts.append(instruction.text)
                stack = stack or instruction.stack
                if instruction.end:
                    if not self.code[at - 1].skip and len(texts) > 1:
                        places[tuple(texts)].append(first)
                    break
                if not stack and not instruction.skip and (len(texts) > 1 or instruction.bytes > SHORT):
                    places[tuple(texts)].append(first)
        return {texts: where for texts, where in places.items() if len(where) > 1}

    def width(self, first, texts):
        """Returns the bytes of a sequence."""
        return self.until[first + len(texts)] - self.until[first]

    def best(self, texts):
        """Returns (bytes saved, indices, subroutine) of the best use of a sequence now; subroutine: ("kept", where it begins),
        ("place", the index that becomes it) or ("behind", the index whose function it follows)."""
        length = len(texts)
        free, end = [], 0
        for first in self.places[texts]:
            if first >= end and not any(self.used[first : first + length]):
                free.append(first)
                end = first + length
        if not free:
            return 0, [], None
        width = max(self.width(first, texts) for first in free)
        best = (0, [], None)
        options = [(address, 0, ("kept", where)) for address, where in self.kept[texts]]
        for first in free if len(free) > 1 else []:
            behind = first + length
            ends = self.code[behind - 1].end
            if ends or (self.code[behind].text == "ret" and not self.code[behind].fixed and not self.used[behind]):
                options.append((self.code[first].address, 0, ("place", first)))
            else:
                function = self.code[first].function
                options.append((self.start[function] + self.size[function], width + RETURN, ("behind", first)))
        for address, cost, subroutine in options:
            saved, chosen = -cost, []
            for first in free:
                if subroutine == ("place", first):
                    continue
                call = SHORT if abs(self.code[first].address - address) < REACH else LONG
                width_here = self.width(first, texts)
                if width_here > call and (width_here >= TIMED_LEAST or not self.code[first].timed):
                    saved += width_here - call
                    chosen.append(first)
            if saved > best[0]:
                best = (saved, chosen, subroutine)
        return best

    def keep_once(self, texts, chosen, subroutine):
        """Carries out what best() has found. Returns the sequences that may be called from now on: this one and its ends."""
        length = len(texts)
        ends = texts[-1].split()[0] in ENDS
        kind, which = subroutine
        offered = []
        if kind == "place":
            instructions = self.code[which : which + length]
            for at in range(which, which + length + (not ends)):
                self.used[at] = True
            offered = [(instruction.address, ("", instruction.line)) for instruction in instructions]
            which = offered[0][1]
        elif kind == "behind":
            function = self.code[which].function
            address = self.start[function] + self.size[function]
            name = f"{function}.{len(self.behind[function])}"
            self.behind[function].append((name, [*texts, "ret"]))
            offered = [(address, (name, number)) for number in range(length)]
            which = offered[0][1]
        label = self.labels.setdefault(which, f".Loutlined_{len(self.labels)}")
        for first in chosen:
            for at in range(first, first + length):
                self.used[at] = True
                self.gone.add(self.code[at].line)
            self.calls[self.code[first].line] = f"\t{'jmp' if ends else 'call'} {label}"
        for start, offer in enumerate(offered):
            self.kept[texts[start:]].append(offer)
        return [texts[start:] for start in range(len(offered)) if texts[start:] in self.places] or [texts]

    def shrink(self):
        """Keeps once whatever is worth it."""
        heap = []

        def add(texts):
            saved = self.best(texts)[0]
            if saved > 0:
                heapq.heappush(heap, (-saved, -len(texts), texts))

        for texts in self.places:
            add(texts)
        while heap:
            claimed, _, texts = heapq.heappop(heap)
            saved, chosen, subroutine = self.best(texts)
            if saved != -claimed:  # places are gone since
                add(texts)
                continue
            for kept in self.keep_once(texts, chosen, subroutine):
                add(kept)

    def text(self):
        """Returns the lines of the file as they are now."""
        last = {instruction.line: instruction.function for instruction in self.code if instruction.text}
        ends = {function: line for line, function in last.items()}
        result = []
        for number, line in enumerate(self.lines):
            if ("", number) in self.labels:
                result.append(f"{self.labels['', number]}:")
            if number in self.calls:
                result.append(self.calls[number])
            if number not in self.gone:
                result.append(line)
            function = last.get(number)
            if function and ends[function] == number:
                for name, body in self.behind[function]:
                    for at, text in enumerate(body):
                        if (name, at) in self.labels:
                            result.append(f"{self.labels[name, at]}:")
                        result.append(f"\t{text}")
        return "\n".join(result)


def order_of(path):
    """Returns {function: place} from the linker's order."""
    names = filter(None, map(ORDER_LINE.match, pathlib.Path(path).read_text(encoding="utf-8").splitlines()))
    return {match[1]: place for place, match in enumerate(names)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--as", dest="assembler", required=True, help="the assembler itself")
    parser.add_argument("--order", required=True, help="the linker's order of the functions")
    parser.add_argument("--timed", default="", help="functions whose time counts")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help="of the assembler; the file is the last one")
    options = parser.parse_args()
    arguments = options.arguments[1:]
    path = pathlib.Path(arguments[-1])
    text = path.read_text(encoding="utf-8")
    if "\n__tmp_reg__ = " in text and "\t.section\t.gnu.lto_" not in text:  # the compiler's, and machine code at last
        program = Program(text.split("\n"), set(options.timed.split()), order_of(options.order))
        program.shrink()
        with tempfile.NamedTemporaryFile("w", suffix=".s", encoding="utf-8") as outlined:
            outlined.write(program.text())
            outlined.flush()
            return subprocess.run([options.assembler, *arguments[:-1], outlined.name], check=False).returncode
    return subprocess.run([options.assembler, *arguments], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
