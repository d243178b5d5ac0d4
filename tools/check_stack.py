#!/usr/bin/env python3
"""Bounds the stack of an image from its machine code and fails if RAM cannot hold it.

Walks every path of the disassembly from the reset vector and from each interrupt vector, and follows the stack pointer
through PUSH, POP, CALL, RCALL, the frames that avr-gcc opens and closes (through Y, as its prologues do) and jumps into
other functions. Hand-written assembler is walked in the same way. avr-gcc's own figures (-fstack-usage, the .su files)
are compared: where the compiler claims more for a function than the walk has found, the claim counts.

The bound is the deepest path of the main program, plus one frame of every interrupt that lets others in (it executes
SEI before it returns; such an interrupt must mask its own source first), plus the deepest of the interrupts that do
not. What an ICALL may reach is listed in tools/indirect_calls.txt: `caller: pattern ...`, function names with * and ?.

Errors (exit code 1): the bound exceeds the RAM that is left; recursion; an unlisted ICALL; a stack pointer that is
written in a way this program does not know.
"""
import argparse
import fnmatch
import pathlib
import re
import subprocess
import sys

RAM_START, RAM_END = 0x100, 0x8FF
VECTORS, VECTOR_BYTES = 26, 4
RETURN_ADDRESS_BYTES = 2
SYMBOL_LINE = re.compile(r"^([0-9a-f]{8}) <(.+)>:$")
LOCAL_LABEL = re.compile(r"\.L|L\d+[^\w.]")  # -mrelax keeps the assembler's own
CODE_LINE = re.compile(r"^ *([0-9a-f]+):\t([a-z]+)\t?([^;]*)(?:;(.*))?$")
TARGET = re.compile(r"0x([0-9a-f]+)")
BRANCHES = ("br",)
SKIPS = ("sbrc", "sbrs", "sbic", "sbis", "cpse")
SP_LOW = "0x3d"
Y_REGISTERS = ("r28", "r29")
# Instructions whose first operand, a register, is not written.
READ_ONLY = ("push", "cp", "cpc", "cpi", "cpse", "tst", "sbrc", "sbrs", "bst", "mul", "muls", "mulsu", "fmul")


class Unbounded(Exception):
    """The code does something that cannot be bounded."""


class Image:
    """The instructions and symbols of an ELF file."""

    def __init__(self, objdump, nm, elf):
        self.code = {}  # address -> (mnemonic, operands, target or None)
        self.symbols = []  # (address, name) in order
        text = run([objdump, "-d", "-z", "--no-show-raw-insn", elf])
        for line in text.splitlines():
            if match := CODE_LINE.match(line):
                mnemonic, operands = match[2], [o.strip() for o in match[3].split(",") if o.strip()]
                target = None
                if mnemonic in ("call", "jmp"):
                    target = int(operands[0], 0)
                elif mnemonic in ("rcall", "rjmp") or mnemonic.startswith(BRANCHES):
                    found = TARGET.search(match[4] or "")
                    target = int(found[1], 16) if found else None
                self.code[int(match[1], 16)] = (mnemonic, operands, target)
            elif (match := SYMBOL_LINE.match(line)) and not LOCAL_LABEL.match(match[2]):
                self.symbols.append((int(match[1], 16), match[2]))
        addresses = sorted(self.code)
        self.next = dict(zip(addresses, addresses[1:]))
        self.data = {}
        for line in run([nm, elf]).splitlines():
            fields = line.split()
            if len(fields) == 3:
                self.data[fields[2]] = int(fields[0], 16)

    def name(self, address):
        """Returns the name of the function that holds an address."""
        found = "?"
        for start, name in self.symbols:
            if start > address:
                break
            found = name
        return found

    def span(self, address):
        """Returns the addresses of the function that holds an address."""
        start = max((s for s, _ in self.symbols if s <= address), default=0)
        end = min((s for s, _ in self.symbols if s > address), default=max(self.code) + 1)
        return [a for a in self.code if start <= a < end]

    def address(self, name):
        """Returns the address of a function."""
        return next(a for a, n in self.symbols if n == name)


def run(command):
    """Returns what a command prints."""
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def constant(operand):
    """Returns the value of an immediate operand."""
    return int(operand, 0)


class Walker:
    """Finds the deepest stack below an entry point; results are kept per entry."""

    def __init__(self, image, indirect, claimed):
        self.image, self.indirect, self.claimed = image, indirect, claimed
        self.bounds = {}  # entry -> (bytes, path of names)
        self.active = []
        self.lets_interrupts_in = set()

    def bound(self, entry):
        """Returns (bytes below the caller's stack pointer, return address included; [names of the deepest path])."""
        if entry in self.bounds:
            return self.bounds[entry]
        name = self.image.name(entry)
        if entry in self.active:
            raise Unbounded("recursion: " + " > ".join(self.image.name(a) for a in self.active + [entry]))
        self.active.append(entry)
        deepest, path = self.walk(entry)
        self.active.pop()
        claim = self.claimed.get(name, 0)
        if claim > deepest:
            deepest, path = claim, [f"{name} (compiler's figure)"]
        self.bounds[entry] = deepest, path
        return self.bounds[entry]

    def callees(self, address, target):
        """Returns the entry points that a call instruction may reach."""
        if target is not None:
            return [target]
        caller = self.image.name(address)
        # The compiler names its own copies of a function name.constprop.1, name.part.2 and so on.
        patterns = self.indirect.get(caller) or self.indirect.get(caller.split(".")[0])
        if not patterns:
            raise Unbounded(f"{caller} calls through a pointer at {address:#x}: list what it reaches")
        names = {n for _, n in self.image.symbols if any(fnmatch.fnmatchcase(n, p) for p in patterns)}
        if not names:
            raise Unbounded(f"{caller}: no function matches {' '.join(patterns)}")
        return [self.image.address(n) for n in sorted(names)]

    def shared_prologue(self, address, target):
        """Returns the bytes that -mcall-prologues' common prologue takes: its pushes, and the frame in r27:r26."""
        pushes = sum(1 for a in self.image.span(target) if a >= target and self.image.code[a][0] == "push")
        frame = {}
        for before in [a for a in self.image.span(address) if a < address][-8:]:
            mnemonic, operands, _ = self.image.code[before]
            if mnemonic == "ldi":
                frame[operands[0]] = constant(operands[1])
        return pushes + frame["r26"] + 256 * frame["r27"]

    def walk(self, entry):
        """Follows all paths from an entry point. State: depth, and the depth that Y stands for (or None)."""
        code, following = self.image.code, self.image.next
        name = self.image.name(entry)
        deepest, path = 0, [name]
        seen = {}  # address -> depths walked with
        todo = [(entry, RETURN_ADDRESS_BYTES if entry else 0, None, None)]
        while todo:
            address, depth, y_depth, pending = todo.pop()
            while True:
                known = seen.get(address)
                if known is not None and known >= depth:
                    break
                if known is not None and depth - known > 0 and depth > RAM_END:
                    raise Unbounded(f"{name}: the stack grows in a loop at {address:#x}")
                seen[address] = depth
                if address not in code:
                    raise Unbounded(f"{name} runs into {address:#x}, where there is no code")
                mnemonic, operands, target = code[address]
                after = following.get(address)
                if mnemonic == "push":
                    depth += 1
                elif mnemonic == "pop":
                    depth -= 1
                    if operands[0] in Y_REGISTERS:
                        y_depth = None
                elif mnemonic in ("ret", "reti"):
                    break
                elif mnemonic == "rcall" and target == after:
                    depth += RETURN_ADDRESS_BYTES  # avr-gcc's way to open two bytes
                elif mnemonic in ("call", "rcall", "icall"):
                    for callee in self.callees(address, target):
                        below, names = self.bound(callee)
                        if depth + below > deepest:
                            deepest, path = depth + below, [name] + names
                elif mnemonic == "in" and operands[1] == SP_LOW and operands[0] == "r28":
                    y_depth = depth
                elif mnemonic in ("sbiw", "adiw") and operands[0] == "r28" and y_depth is not None:
                    y_depth += constant(operands[1]) * (1 if mnemonic == "sbiw" else -1)
                elif mnemonic == "subi" and operands[0] == "r28" and y_depth is not None:
                    pending = constant(operands[1])
                elif mnemonic in ("sbci", "sbc") and operands[0] == "r29" and pending is not None:
                    if mnemonic == "sbc" and operands[1] != "r1":  # r1 is 0
                        raise Unbounded(f"{name}: Y changes in an unknown way at {address:#x}")
                    change = pending + (256 * constant(operands[1]) if mnemonic == "sbci" else 0)
                    y_depth += change - 65536 if change >= 32768 else change
                    pending = None
                elif mnemonic == "out" and operands[0] == SP_LOW:
                    if self.image.name(address) in ("__init", "__ctors_end", "__vectors", "__trampolines_end", "start"):
                        depth = 0  # start-up: the stack pointer is set to the end of RAM
                    elif operands[1] == "r28" and y_depth is not None:
                        depth = y_depth
                    else:
                        raise Unbounded(f"{self.image.name(address)} writes the stack pointer at {address:#x}")
                elif operands and operands[0] in Y_REGISTERS and mnemonic not in READ_ONLY and mnemonic != "in":
                    y_depth = None  # Y is no frame pointer here
                elif mnemonic == "sei":
                    self.lets_interrupts_in.add(entry)
                elif mnemonic in ("jmp", "rjmp"):
                    if self.image.name(target) == "__prologue_saves__":
                        depth += self.shared_prologue(address, target)
                        y_depth = depth
                        target = after  # where it comes back to
                    elif self.image.name(target) == "__epilogue_restores__":
                        break
                    if self.image.name(target).startswith("__tablejump"):
                        # A switch's table: every case of this function that nothing else leads to.
                        for case in sorted(set(self.image.span(address)) - set(seen)):
                            todo.append((case, depth, y_depth, None))
                        break
                    after = target
                elif mnemonic == "ijmp":
                    for callee in self.callees(address, None):
                        below, names = self.bound(callee)
                        if depth - RETURN_ADDRESS_BYTES + below > deepest:
                            deepest, path = depth - RETURN_ADDRESS_BYTES + below, [name] + names
                    break
                elif mnemonic.startswith(BRANCHES) and target is not None:
                    todo.append((target, depth, y_depth, pending))
                elif mnemonic in SKIPS:
                    todo.append((following[after], depth, y_depth, pending))
                if depth > deepest:
                    deepest, path = depth, [name]
                if after is None or after == address:
                    break
                address = after
        return deepest, path


def claimed_by_compiler(folder):
    """Returns {function: bytes} of all .su files; of functions with the same name the larger figure."""
    claimed = {}
    for path in folder.rglob("*.su"):
        for line in path.read_text(encoding="utf-8").splitlines():
            where, size, kind = line.rsplit("\t", 2)
            name = where.rsplit(":", 1)[1]
            if kind.startswith("dynamic") and "bounded" not in kind:
                raise Unbounded(f"{where}: variable-sized frame")
            claimed[name] = max(claimed.get(name, 0), int(size))
    return claimed


def read_indirect(path):
    """Returns {caller: [patterns]} of tools/indirect_calls.txt."""
    indirect = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        line = line.split("#")[0].strip()
        if line:
            caller, _, patterns = line.partition(":")
            indirect.setdefault(caller.strip(), []).extend(patterns.split())
    return indirect


def main():
    """Prints the bound and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("elf")
    parser.add_argument("--su", type=pathlib.Path, required=True, help="folder with the .su files")
    parser.add_argument("--prefix", default="avr-", help="of the binutils")
    parser.add_argument("--indirect", type=pathlib.Path, default=pathlib.Path("tools/indirect_calls.txt"))
    parser.add_argument("--verbose", action="store_true", help="the deepest path of every vector")
    arguments = parser.parse_args()

    try:
        image = Image(arguments.prefix + "objdump", arguments.prefix + "nm", arguments.elf)
        walker = Walker(image, read_indirect(arguments.indirect), claimed_by_compiler(arguments.su))
        main_bytes, main_path = walker.bound(0)
        let_in, closed = [], [(0, ["none"])]
        for vector in range(1, VECTORS):
            entry = image.code.get(vector * VECTOR_BYTES, (None, None, None))[2]
            if entry is None or not image.name(entry).startswith("__vector_"):
                continue  # not used
            below, path = walker.bound(entry)
            (let_in if entry in walker.lets_interrupts_in else closed).append((below, path))
    except Unbounded as problem:
        print(f"error: stack: {problem}", file=sys.stderr)
        return 1

    interrupts = sum(below for below, _ in let_in) + max(closed)[0]
    bound = main_bytes + interrupts
    taken = max(image.data.get(n, 0) & 0xFFFF for n in ("_end", "__bss_end", "__data_end", "__noinit_end"))
    left = RAM_END + 1 - taken
    print(f"stack {bound:5} of {left} bytes left (main {main_bytes}, interrupts {interrupts}): {' > '.join(main_path)}")
    if arguments.verbose:
        for below, path in sorted(let_in + closed[1:], reverse=True):
            print(f"      {below:5} {' > '.join(path)}")
    if bound > left:
        print(f"error: the stack may need {bound - left} bytes more than RAM has left", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
