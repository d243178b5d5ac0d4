#!/usr/bin/env python3
"""Checks that the README's pin table says what firmware/board.h says.

The table stands between the lines <!-- pins --> and <!-- /pins -->; --write puts a new one there. Exit code 1 if they
differ.
"""
import argparse
import pathlib
import re
import sys

POST = re.compile(r'POST\((\w+), ([BCD]), ([0-7]), "(\w+)", (IN|OUT), "([^"]*)"\)')
TABLE = re.compile(r"<!-- pins -->\n(.*?)<!-- /pins -->", re.DOTALL)
# Posts whose name on the board is not a C identifier.
NAMES = {
    "HW_RX": "H/W Rx", "HW_TX": "H/W Tx", "ESTOP": "Estop", "SYNC": "sync", "SW_RX": "S/W Rx", "SW_TX": "S/W Tx",
    "XCLK": "xclk", "TX_EN": "Tx En", "CLK": "clk", "DIR": "dir", "OUT_1MHZ": "1 MHz", "EN_A": "EnA", "EN_B": "EnB",
    "ENABLE": "(enable)",
}


def table(board_h):
    """Returns the Markdown table of the posts of board.h."""
    posts = POST.findall(board_h)
    if not posts:
        raise ValueError("no POST rows found")
    rows = ["| Nano | AVR | Post | | |\n", "|---|---|---|---|---|\n"]
    for name, port, bit, nano, direction, remark in posts:
        rows.append(f"| {nano} | P{port}{bit} | {NAMES.get(name, name)} | {direction.lower()} | {remark} |\n")
    return "".join(rows)


def main():
    """Compares or writes, and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--board", type=pathlib.Path, default=pathlib.Path("firmware/board.h"))
    parser.add_argument("--readme", type=pathlib.Path, default=pathlib.Path("README.md"))
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()

    wanted = table(arguments.board.read_text(encoding="utf-8"))
    readme = arguments.readme.read_text(encoding="utf-8")
    found = TABLE.search(readme)
    if not found:
        print(f"error: no <!-- pins --> in {arguments.readme}", file=sys.stderr)
        return 1
    if arguments.write:
        arguments.readme.write_text(readme[: found.start(1)] + wanted + readme[found.end(1) :], encoding="utf-8")
    elif found[1] != wanted:
        print(f"error: {arguments.readme} differs from {arguments.board}: tools/check_pins.py --write", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
