#!/usr/bin/env python3
"""Checks that the firmware's includes go in one direction.

A folder may include itself and lower ones, never a sibling or a higher one:

    base  <  motion, eeprom, net  <  queue  <  cli  <  main.c
    base  <  motion  <  ninja

ninja/ is an image of its own: nothing else includes it. ninja/hal/ is to it what hal/ is to all.
hal/ implements headers that its users own (motion/step_port.h and its like), so it may include any folder's headers,
and nobody but main.c includes hal/. settings.h stands above motion/command.h, boot.h above base; board.h, the pin map,
drivers.h and version.h include nothing; all five may be read by everyone but base. Only hal/ and the files in HARDWARE may include <avr/...> and <util/...>:
everything else must build on the host.

Exit code 1 if a rule is broken; each breach is printed as file:line.
"""
import argparse
import pathlib
import re
import sys

LEVEL = {"base": 0, "motion": 1, "eeprom": 1, "net": 1, "queue": 2, "cli": 3, "main": 4}
# Files outside hal/ that may include the AVR's headers, and why.
HARDWARE = {
    "main.c": "boot: reset cause and start-up order",
    "base/flash.h": "the one place that knows how constants in flash are read; plain memory on the host",
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^">]+)[">]')


def room(path):
    """Returns the folder a file below firmware/ belongs to; files at the top are main, settings or board."""
    parts = pathlib.PurePosixPath(path).parts
    if len(parts) > 1:
        return "hal" if parts[:2] == ("ninja", "hal") else parts[0]
    return {"settings.h": "settings", "settings.c": "settings", "settings.def": "settings", "board.h": "board", "version.h": "version",
            "boot.h": "boot", "drivers.h": "drivers"}.get(parts[0], "main")


def resolve(root, includer, name):
    """Returns the path below root of an include in quotes, or None."""
    for base in (includer.parent, root):
        candidate = (base / name).resolve()
        if candidate.is_file() and candidate.is_relative_to(root.resolve()):
            return candidate.relative_to(root.resolve()).as_posix()
    return None


def breach(user, used, used_path):
    """Returns what is wrong with a file of room `user` including a file of room `used`, or None."""
    if user == used or user in ("hal", "main"):
        return None
    if user == "ninja":
        return None if used in ("base", "motion") else f"ninja may not include {used_path}"
    if used in ("board", "version", "boot", "drivers", "settings"):
        return f"base knows no {used}" if user == "base" else None
    if user == "settings":
        return None if used in ("base", "motion") else f"settings may not include {used_path}"
    if user == "boot":
        return None if used == "base" else "boot.h includes nothing above base"
    if user in ("board", "drivers", "version"):
        return "board.h, drivers.h and version.h include nothing"
    if used == "hal":
        return "hal/ is bound at link time: include the port header that hal/ implements"
    if user not in LEVEL or used not in LEVEL:
        return f"folder {user if user not in LEVEL else used} has no level in tools/check_includes.py"
    if LEVEL[used] >= LEVEL[user]:
        return f"{user} may not include {used}"
    return None


def check(root):
    """Returns the breaches and the number of files read."""
    breaches, count = [], 0
    for path in sorted(p for p in root.rglob("*") if p.suffix in (".c", ".h", ".S", ".def")):
        count += 1
        relative = path.relative_to(root).as_posix()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            where, name = f"{path}:{number}", match[2]
            if match[1] == "<":
                if name.startswith(("avr/", "util/")) and room(relative) != "hal" and relative not in HARDWARE:
                    breaches.append(f"{where}: <{name}> belongs into hal/")
                continue
            used = resolve(root, path, name)
            if used is None:
                breaches.append(f'{where}: "{name}" is not below {root}')
            elif problem := breach(room(relative), room(used), used):
                breaches.append(f"{where}: {problem}")
    return breaches, count


def main():
    """Checks and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", type=pathlib.Path, default=pathlib.Path("firmware"))
    breaches, count = check(parser.parse_args().root)
    print("\n".join(breaches + [f"{count} files, {len(breaches)} breaches of the include rule"]))
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
