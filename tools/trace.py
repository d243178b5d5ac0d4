#!/usr/bin/env python3
"""Joins the requirements with the tests that show them.

Reads the rows of docs/requirements.md, the requirement IDs in the comments directly above the test functions below
test/, and the results of the last `make test` (Unity's lines in build/test-results/*.txt). A requirement is shown when
a test that names it has passed and none that names it has failed.

Fails (exit code 1) if a comment names an ID that does not exist, or if fewer requirements are shown than
docs/trace-count says. With --raise that number is raised to what is shown now.
"""
import argparse
import pathlib
import re
import sys

ROW = re.compile(r"^\| ([A-Z]{3}-\d{3}) \|")
AREA = re.compile(r"^## ([A-Z]{3}) — (.*)")
ID = r"[A-Z]{3}-\d{3}"
# HAR-004, or the range HAR-004..HAR-008
REFERENCE = re.compile(rf"({ID})(?:\.\.({ID}))?")
# A comment (block, or a run of // lines) with nothing but blanks between it and the test function.
COMMENTED_TEST = re.compile(
    r"(?P<comment>/\*(?:[^*]|\*(?!/))*\*/|(?:[ \t]*//[^\n]*\n)+)\s*(?:static\s+)?void\s+(?P<name>test_\w+)\s*\("
)
RESULT = re.compile(r"^(?P<file>[^:\s]+):\d+:(?P<name>test_\w+):(?P<result>PASS|FAIL|IGNORE)")


def read_requirements(path):
    """Returns {area: title} and the list of IDs, in the order of the document; the annexes do not count."""
    areas, ids = {}, []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("## Annex"):
            break
        if match := AREA.match(line):
            areas[match[1]] = match[2]
        elif match := ROW.match(line):
            ids.append(match[1])
    return areas, ids


def expand(comment, errors, where):
    """Returns the IDs that a comment names, ranges written out."""
    named = []
    for first, last in REFERENCE.findall(comment):
        if not last:
            named.append(first)
        elif first[:3] != last[:3] or first > last:
            errors.append(f"{where}: {first}..{last} is not a range")
        else:
            named += [f"{first[:3]}-{n:03}" for n in range(int(first[4:]), int(last[4:]) + 1)]
    return named


def read_tests(folder, known, errors):
    """Returns {(file, test function): [IDs]} of all test sources below folder."""
    tests = {}
    for path in sorted(folder.rglob("*.c")):
        text = path.read_text(encoding="utf-8")
        for match in COMMENTED_TEST.finditer(text):
            where = f"{path}:{text.count(chr(10), 0, match.start('name')) + 1}"
            named = expand(match["comment"], errors, where)
            errors += [f"{where}: there is no requirement {i}" for i in named if i not in known]
            if named:
                tests[str(path), match["name"]] = named
    return tests


def read_results(folder):
    """Returns {(file, test function): passed}; a test that ran several times must have passed each time."""
    results = {}
    for path in sorted(folder.glob("*.txt")):
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            if match := RESULT.match(line):
                key = match["file"], match["name"]
                results[key] = results.get(key, True) and match["result"] == "PASS"
    return results


def main():
    """Prints the join and returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--requirements", type=pathlib.Path, default=pathlib.Path("docs/requirements.md"))
    parser.add_argument("--tests", type=pathlib.Path, default=pathlib.Path("test"))
    parser.add_argument("--results", type=pathlib.Path, default=pathlib.Path("build/test-results"))
    parser.add_argument("--count", type=pathlib.Path, default=pathlib.Path("docs/trace-count"))
    parser.add_argument("--raise", dest="raise_count", action="store_true", help="keep the number if it has grown")
    parser.add_argument("--quiet", action="store_true", help="only the sum and the errors")
    arguments = parser.parse_args()

    errors = []
    areas, ids = read_requirements(arguments.requirements)
    tests = read_tests(arguments.tests, set(ids), errors)
    results = read_results(arguments.results)
    if not results:
        errors.append(f"no results in {arguments.results}: run `make test` first")

    passed, failed = {}, set()
    for key, named in tests.items():
        for requirement in named:
            if results.get(key) is False:
                failed.add(requirement)
            elif results.get(key):
                passed.setdefault(requirement, []).append(key[1])
    shown = [i for i in ids if i in passed and i not in failed]

    if not arguments.quiet:
        for area, title in areas.items():
            rows = [i for i in ids if i.startswith(area)]
            here = [i for i in rows if i in shown]
            print(f"{area}  {len(here):3} / {len(rows):3}  {title}")
            for row in here:
                print(f"    {row}  {', '.join(sorted(set(passed[row])))}")
            missing = [row + (" (its test failed)" if row in failed else "") for row in rows if row not in shown]
            if missing:
                print(f"    without a passing test: {', '.join(missing)}")

    kept = int(arguments.count.read_text(encoding="utf-8")) if arguments.count.exists() else 0
    print(f"{len(shown)} of {len(ids)} requirements shown by a passing test; at least {kept} must be")
    if len(shown) < kept:
        errors.append(f"{len(shown)} requirements are shown, {kept} were")
    elif arguments.raise_count and len(shown) > kept and not errors:
        arguments.count.write_text(f"{len(shown)}\n", encoding="utf-8")
        print(f"{arguments.count} raised to {len(shown)}")
    for error in errors:
        print(f"error: {error}", file=sys.stderr)
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
