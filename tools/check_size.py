#!/usr/bin/env python3
"""Prints how much flash and RAM an image takes and fails if a budget is exceeded.

Flash is what is programmed: code, constants and the initial values of .data. RAM is what is taken before the first
call: .segments, .data, .bss and .noinit; the stack has a check of its own (tools/check_stack.py). Sizes are in bytes.
"""
import argparse
import subprocess
import sys

FLASH_BYTES, RAM_BYTES = 32768, 2048
FLASH_SECTIONS = (".text", ".data")
RAM_SECTIONS = (".segments", ".data", ".bss", ".noinit")


def section_sizes(size_program, elf):
    """Returns {section: bytes} as the size program prints them."""
    text = subprocess.run([size_program, "-A", elf], check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = (line.split() for line in text.splitlines())
    return {row[0]: int(row[1]) for row in rows if len(row) == 3 and row[0].startswith(".")}


def main():
    """Prints the figures and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("elf")
    parser.add_argument("--size", default="avr-size", help="the binutils' size program")
    parser.add_argument("--flash-budget", type=int, required=True)
    parser.add_argument("--ram-budget", type=int, required=True)
    arguments = parser.parse_args()

    sizes = section_sizes(arguments.size, arguments.elf)
    good = True
    for what, sections, budget, whole in (
        ("flash", FLASH_SECTIONS, arguments.flash_budget, FLASH_BYTES),
        ("RAM", RAM_SECTIONS, arguments.ram_budget, RAM_BYTES),
    ):
        used = sum(sizes.get(section, 0) for section in sections)
        parts = ", ".join(f"{section} {sizes[section]}" for section in sections if sizes.get(section))
        print(f"{what:5} {used:5} of {budget} bytes budgeted, {whole} on the chip ({parts})")
        if used > budget:
            print(f"error: {what} exceeds its budget by {used - budget} bytes", file=sys.stderr)
            good = False
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
