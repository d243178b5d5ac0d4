#!/usr/bin/env python3
"""Packs the firmware's texts: two characters that often stand beside each other become one.

pack_texts.py OUT writes copies of the tables with texts (TABLES) below OUT, for the compiler to find before the ones in
firmware/. In their string literals each pair of firmware/cli/pairs.def is replaced by its character, 0x80 and up in the
order of the rows; cli/text.c puts the pairs back. Ranges (SETTING_KIND) stay as they are: limits are read from them.
--choose writes pairs.def anew, from the texts as they are now: that is worth it when many of them have changed.
"""
import argparse
import ast
import collections
import pathlib
import re
import sys

TABLES = ("cli/commands.def", "cli/display.def", "base/status.def", "settings.def")
# What stands between literals and has quotes: comments, ranges, directives, and what to do about an error; a literal.
TOKEN = re.compile(r'/\*.*?\*/|^SETTING_KIND.*?$|^#.*?$|(?<=", )"[^"]*"\)$|"(?:\\.|[^"\\])*"', re.DOTALL | re.MULTILINE)
PAIR = re.compile(r"^PAIR\((.*?), (.*?)\)", re.MULTILINE)
FIRST = 0x80
PAIRS = 64
LONGEST = 4  # TEXT_LONGEST of cli/text.h
HEAD = """/* The pairs of characters that texts are packed with (tools/pack_texts.py, which has chosen them), 0x80 and up.
 * PAIR(first, second): the second may be a pair itself. */
"""


def literals(text):
    """Returns the strings of a table that are packed, each a list of character codes."""
    return [codes(match) for match in TOKEN.findall(text) if is_literal(match)]


def is_literal(token):
    return token.startswith('"') and token.endswith('"')


def codes(literal):
    return [ord(character) for character in ast.literal_eval(literal)]


def packed(string, pairs):
    """Returns the string with each pair replaced, in their order."""
    for code, pair in enumerate(pairs, FIRST):
        string = replaced(string, pair, code)
    return string


def replaced(string, pair, code):
    """Returns the string with the code wherever the pair stood."""
    out = []
    for value in string:
        if out and (out[-1], value) == pair:
            out[-1] = code
        else:
            out.append(value)
    return out


def unpacked(string, pairs):
    """Returns what cli/text.c makes of it."""
    out = []
    for code in string:
        while code >= FIRST:
            first, code = pairs[code - FIRST]
            out.append(first)
        out.append(code)
    return out


def quoted(string):
    """Returns a C literal; escapes of three digits, whatever follows them."""
    return '"' + "".join(chr(c) if 32 <= c < 127 and chr(c) not in '"\\' else f"\\{c:03o}" for c in string) + '"'


def packed_table(text, pairs):
    def replace(match):
        token = match.group(0)
        return quoted(packed(codes(token), pairs)) if is_literal(token) else token

    return TOKEN.sub(replace, text)


def character(code):
    return f"0x{code:02X}" if code >= FIRST else repr(chr(code))


def read_pairs(text):
    def code(written):
        return int(written, 16) if written.startswith("0x") else ord(ast.literal_eval(written))

    return [(code(first), code(second)) for first, second in PAIR.findall(text)]


def choose(strings):
    """Returns the pairs that shorten the strings most, one after the other; the first of each is a character."""
    pairs = []
    while len(pairs) < PAIRS:
        counts = collections.Counter()
        for string in strings:
            last = None
            for pair in zip(string, string[1:]):
                last = None if pair == last else pair
                if last and pair[0] < FIRST and 0 not in pair and len(unpacked(pair, pairs)) <= LONGEST:
                    counts[pair] += 1
        pair, count = min(counts.items(), key=lambda item: (-item[1], item[0]))
        if count < 3:
            break
        pairs.append(pair)
        strings = [replaced(string, pair, FIRST + len(pairs) - 1) for string in strings]
    return pairs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", nargs="?", type=pathlib.Path)
    parser.add_argument("--choose", action="store_true", help="write pairs.def anew")
    parser.add_argument("--firmware", type=pathlib.Path, default=pathlib.Path("firmware"))
    arguments = parser.parse_args()
    tables = {name: (arguments.firmware / name).read_text(encoding="utf-8") for name in TABLES}
    pairs_def = arguments.firmware / "cli/pairs.def"
    if arguments.choose:
        pairs = choose([string for text in tables.values() for string in literals(text)])
        rows = (f"PAIR({character(a)}, {character(b)}) /* {FIRST + i:02X}: {quoted(unpacked([FIRST + i], pairs))} */\n"
                for i, (a, b) in enumerate(pairs))
        pairs_def.write_text(HEAD + "".join(rows), encoding="utf-8")
    if arguments.out:
        pairs = read_pairs(pairs_def.read_text(encoding="utf-8"))
        for name, text in tables.items():
            path = arguments.out / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(packed_table(text, pairs), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
