#!/usr/bin/env python3
"""Checks the manual against the firmware: its tables, the pins in its pictures; and that its links lead somewhere.

A table stands between the lines <!-- table: NAME --> and <!-- /table -->. Its first columns are made from the
firmware's tables (commands.def, motion_parameters.def, settings.def, status.def, board.h); the columns behind them are
written by hand, stay with their row, and may not be empty. --write brings the tables up to date. Exit code 1 if
something is wrong.
"""
import argparse
import pathlib
import re
import sys

from check_pins import NAMES, POST

TABLE = re.compile(r"<!-- table: (\w+) -->\n(.*?)<!-- /table -->", re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^COMMAND\((\w+), '(.)', [^,]+, (ANY|EXACT), \w+, \w+, HELP\(\"(.*?)\", \"(.*)\"\)\)$", re.MULTILINE)
PARAMETER = re.compile(r"^PARAMETER\(\w+, '(.)', (\w+)\)", re.MULTILINE)
SETTING = re.compile(r"^SETTING\('(.)', \w+, \w+, (\w+), (\w+), \"(.*?)\"\)", re.MULTILINE)
KIND = re.compile(r"^SETTING_KIND\((\w+), \"(.*?)\"\)", re.MULTILINE)
DEFINE = re.compile(r"^#define (SETTINGS_\w+) (.*)$", re.MULTILINE)
STATUS = re.compile(r"^STATUS\(\w+, (\d+), \"(.*?)\", \"(.*?)\"\)", re.MULTILINE)

NUMBERS = {
    "SIGNED": "whole number, may have a `-`",
    "FLOOR": "whole number (a fraction is dropped)",
    "WHOLE": "whole number",
    "RAMP": "0.01 to 99.99, or 100 to 999",
    "FLAG": "0 or 1",
    "BYTE": "0 to 255",
    "NONE": "none",
}


class WrongManual(Exception):
    """Says what is wrong, and where."""


def rows_of(pattern, text, what):
    """Returns all matches, one at least."""
    found = pattern.findall(text)
    if not found:
        raise WrongManual(f"no rows found for the table of {what}")
    return found


def cell(text):
    """Returns text as it may stand in a table."""
    return text.replace("|", "\\|").replace("<", "&lt;")


def code(text):
    return "`" + text.replace("|", "\\|") + "`"


def commands(read):
    for _, _, case, form, words in rows_of(COMMAND, read("cli/commands.def"), "commands"):
        shown = " ".join(code(part) for part in form.split(" "))
        yield shown, {"ANY": "either", "EXACT": "as written"}[case], cell(words)


def parameters(read):
    for letter, number in rows_of(PARAMETER, read("cli/motion_parameters.def"), "parameters"):
        yield code({"c": "vc"}.get(letter, letter)), NUMBERS[number]


def shown_factory(kind, factory, defines):
    """Returns a factory value as the configure screen shows it."""
    value = defines.get(factory, factory)
    if kind == "RAMP":
        return f"{int(value) / 100:.2f}"
    if kind == "DIRECTION":
        return ("CW", "CCW")[int(value)]
    if kind == "MAP":
        return "".join(re.findall(r"\d", value))
    return "100100" if kind == "OPS" and value == "36" else value


def configuration(read):
    text = read("settings.def")
    kinds = dict(rows_of(KIND, text, "ranges"))
    defines = dict(DEFINE.findall(text))
    hidden = re.compile("[^A-Na-n]")  # those that are not on the screen stand last
    rows = sorted(rows_of(SETTING, text, "configuration"), key=lambda row: "~" if hidden.match(row[0]) else row[0])
    for letter, kind, factory, name in rows:
        yield code(letter), name or "-", kinds[kind], shown_factory(kind, factory, defines)


def errors(read):
    for number, words, advice in rows_of(STATUS, read("base/status.def"), "errors"):
        yield code(f"?{number}"), cell(words), cell(advice)


def pins(read):
    for name, port, bit, nano, direction, _ in rows_of(POST, read("board.h"), "pins"):
        yield f"**{NAMES.get(name, name)}**", nano, f"P{port}{bit}", {"IN": "in", "OUT": "out"}[direction]


# Name: (its rows, the heads of the made columns, those of the columns written by hand).
TABLES = {
    "commands": (commands, ("You type", "Case", "What it does"), ("Described in",)),
    "parameters": (parameters, ("Letter", "Number"), ("Without a number", "Meaning")),
    "configuration": (configuration, ("Letter", "Name", "Range", "Factory"), ("Unit", "Meaning")),
    "errors": (errors, ("Answer", "Words", "What to do"), ("More",)),
    "pins": (pins, ("Post", "Nano", "AVR", "I/O"), ("Wire it to",)),
}


def table(name, old, read):
    """Returns the table as it should be; the columns written by hand are those of the old one."""
    make, heads, hand_heads = TABLES[name]
    by_hand = {}
    for line in old.splitlines():
        cells = [part.strip() for part in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == len(heads) + len(hand_heads):
            by_hand[cells[0]] = cells[len(heads) :]
    lines = [heads + hand_heads, ("---",) * (len(heads) + len(hand_heads))]
    for row in make(read):
        lines.append(row + tuple(by_hand.get(row[0], ("",) * len(hand_heads))))
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def anchors(text):
    """Returns the anchors that GitHub gives to the headings."""
    heads = re.findall(r"^#+ (.*)$", FENCED.sub("", text), re.MULTILINE)
    plain = (re.sub(r"\[(.*?)\]\(.*?\)", r"\1", head).replace("`", "").lower() for head in heads)
    return {re.sub(r"[^\w\- ]", "", head).replace(" ", "-") for head in plain}


def check_links(path, text):
    """Returns what is wrong with the links of a chapter."""
    wrong = []
    for link in LINK.findall(FENCED.sub("", text)):
        target, _, anchor = link.partition("#")
        if "://" in target:
            continue
        file = path.parent / target if target else path
        if not file.exists():
            wrong.append(f"{path}: no file {target}")
        elif anchor and anchor not in anchors(file.read_text(encoding="utf-8")):
            wrong.append(f"{path}: no heading for {link}")
    return wrong


def check_pictures(folder, board_h):
    """Returns what is wrong with the pins in the pictures: texts like `D10 clk`."""
    posts = {nano: NAMES.get(name, name) for name, _, _, nano, _, _ in rows_of(POST, board_h, "pins")}
    wrong = []
    for path in sorted(folder.glob("*.svg")):
        for nano, name in re.findall(r">([AD]\d+) ([^<]+)</text>", path.read_text(encoding="utf-8")):
            if posts.get(nano) != name:
                wrong.append(f"{path}: {nano} is not {name} but {posts.get(nano)}")
    return wrong


def main():
    """Checks or writes, and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--firmware", type=pathlib.Path, default=pathlib.Path("firmware"))
    parser.add_argument("--manual", type=pathlib.Path, default=pathlib.Path("docs/manual"))
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()

    def read(name):
        return (arguments.firmware / name).read_text(encoding="utf-8")

    wrong = []
    seen = []
    for path in sorted(arguments.manual.glob("*.md")):
        text = path.read_text(encoding="utf-8")

        def fresh(found):
            name = found[1]
            if name not in TABLES:
                raise WrongManual(f"{path}: there is no table {name}")
            seen.append(name)
            return f"<!-- table: {name} -->\n{table(name, found[2], read)}<!-- /table -->"

        try:
            wanted = TABLE.sub(fresh, text)
        except WrongManual as error:
            wrong.append(str(error))
            continue
        for found in TABLE.finditer(wanted):
            for line in found[2].splitlines():
                if "|  |" in line:
                    wrong.append(f"{path}: to be filled in by hand: {line}")
        if arguments.write:
            path.write_text(wanted, encoding="utf-8")
        elif wanted != text:
            wrong.append(f"{path}: a table differs from the firmware's: make manual")
        wrong += check_links(path, wanted)
    wrong += check_pictures(arguments.manual / "pictures", read("board.h"))
    wrong += [f"the manual has no table {name}" for name in TABLES if name not in seen]
    for line in wrong:
        print(f"error: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
