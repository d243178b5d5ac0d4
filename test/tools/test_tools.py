#!/usr/bin/env python3
"""Tests of the scripts in tools/: each must find the fault it is there for.

The environment's AVR is the compiler's prefix (avr-).
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
AVR = os.environ.get("AVR", "avr-")


class ToolTest(unittest.TestCase):
    """Runs scripts in an empty folder of their own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        """Writes a file below the folder."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    def tool(self, name, *arguments):
        """Runs tools/<name> in the folder; returns (exit code, what it said)."""
        done = subprocess.run(
            [sys.executable, TOP / "tools" / name, *arguments],
            cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        )
        return done.returncode, done.stdout


class Includes(ToolTest):
    """tools/check_includes.py"""

    def check(self, file, include):
        """Returns the exit code for a file with that include line."""
        for header in ("base/number.h", "motion/ramp.h", "queue/queue.h", "cli/line.h", "hal/ports.h", "settings.h"):
            self.write(f"firmware/{header}", "")
        self.write(f"firmware/{file}", f"#include {include}\n")
        return self.tool("check_includes.py")[0]

    def test_lower_folder_is_allowed(self):
        self.assertEqual(0, self.check("queue/queue.c", '"motion/ramp.h"'))

    def test_higher_folder_is_refused(self):
        self.assertEqual(1, self.check("motion/ramp.c", '"queue/queue.h"'))

    def test_sibling_is_refused(self):
        self.write("firmware/net/packet.h", "")
        self.assertEqual(1, self.check("motion/ramp.c", '"net/packet.h"'))

    def test_hal_is_refused_outside_main(self):
        self.assertEqual(1, self.check("cli/line.c", '"hal/ports.h"'))
        self.assertEqual(0, self.check("cli/line.c", '"cli/line.h"'))
        self.assertEqual(0, self.check("main.c", '"hal/ports.h"'))

    def test_avr_headers_are_refused_outside_hal(self):
        self.assertEqual(1, self.check("cli/line.c", "<avr/io.h>"))
        self.assertEqual(0, self.check("cli/line.c", "<stdint.h>"))
        self.assertEqual(0, self.check("hal/ports.c", "<avr/io.h>"))

    def test_base_knows_no_settings(self):
        self.assertEqual(1, self.check("base/number.c", '"settings.h"'))


class Pins(ToolTest):
    """tools/check_pins.py"""

    def test_table_follows_the_pin_map(self):
        board = self.write("board.h", 'POST(CLK, B, 2, "D10", OUT, "OC1B")\n')
        self.write("README.md", "before\n<!-- pins -->\n<!-- /pins -->\nafter\n")
        arguments = ("--board", board, "--readme", "README.md")
        self.assertEqual(1, self.tool("check_pins.py", *arguments)[0])
        self.assertEqual(0, self.tool("check_pins.py", *arguments, "--write")[0])
        self.assertEqual(0, self.tool("check_pins.py", *arguments)[0])
        self.write("board.h", 'POST(CLK, B, 1, "D9", OUT, "OC1A")\n')
        self.assertEqual(1, self.tool("check_pins.py", *arguments)[0])


class Manual(ToolTest):
    """tools/manual.py"""

    ERRORS = 'STATUS(SYNTAX, 2, "syntax", "look at the letters")\n'
    HEAD = "| Answer | Words | What to do | More |\n| --- | --- | --- | --- |\n"

    def setUp(self):
        super().setUp()
        self.write("firmware/base/status.def", self.ERRORS)
        self.write("firmware/cli/commands.def", 'COMMAND(QUEUE, \'q\', 0, ANY, NONE, DISPLAY, HELP("q", "the queue"))\n')
        self.write("firmware/cli/motion_parameters.def", "PARAMETER(CYCLE, 'c', WHOLE)\n")
        self.write("firmware/settings.def", """#define SETTINGS_ACCEL 150
SETTING('d', PAIR_0, accel, RAMP, SETTINGS_ACCEL, "acc") /* words */
SETTING_KIND(RAMP, "0.01..999")
""")
        self.write("firmware/board.h", 'POST(CLK, B, 2, "D10", OUT, "OC1B")\n')
        self.chapter("| `?2` | synta | old words | by hand |\n")

    def chapter(self, errors, more=""):
        """Writes a manual of one chapter."""
        tables = {
            "errors": errors, "commands": "| `q` | | | here |\n", "parameters": "| `vc` | | a | b |\n",
            "configuration": "| `d` | | | | unit | meaning |\n", "pins": "| **clk** | | | | STEP |\n",
        }
        text = "".join(f"<!-- table: {name} -->\n{rows}<!-- /table -->\n" for name, rows in tables.items())
        return self.write("docs/manual/one.md", "# One\n" + text + more)

    def manual(self, *arguments):
        """Returns the exit code and the chapter."""
        code = self.tool("manual.py", *arguments)[0]
        return code, (self.folder / "docs/manual/one.md").read_text(encoding="utf-8")

    def test_tables_follow_the_firmware_and_keep_what_is_written_by_hand(self):
        self.assertEqual(1, self.manual()[0])
        code, text = self.manual("--write")
        self.assertEqual(0, code)
        self.assertIn(self.HEAD + "| `?2` | syntax | look at the letters | by hand |\n", text)
        self.assertIn("| `q` | either | the queue | here |\n", text)
        self.assertIn("| `vc` | whole number | a | b |\n", text)
        self.assertIn("| `d` | acc | 0.01..999 | 1.50 | unit | meaning |\n", text)
        self.assertIn("| **clk** | D10 | PB2 | out | STEP |\n", text)
        self.assertEqual(0, self.manual()[0])

    def test_a_new_row_has_to_be_described(self):
        self.write("firmware/base/status.def", self.ERRORS + 'STATUS(RANGE, 3, "range", "look at the range")\n')
        code, text = self.manual("--write")
        self.assertEqual(1, code)
        self.assertIn("| `?3` | range | look at the range |  |\n", text)

    def test_links_have_to_lead_somewhere(self):
        self.manual("--write")
        text = self.manual()[1]
        for link, code in (("#one", 0), ("one.md#one", 0), ("#two", 1), ("two.md", 1), ("https://example.org", 0)):
            self.write("docs/manual/one.md", f"{text}\n[words]({link})\n")
            self.assertEqual(code, self.manual()[0], link)

    def test_pins_in_pictures_are_those_of_the_board(self):
        self.manual("--write")
        for words, code in (("D10 clk", 0), ("D9 clk", 1), ("D10 dir", 1), ("5V", 0)):
            self.write("docs/manual/pictures/one.svg", f"<text>{words}</text>")
            self.assertEqual(code, self.manual()[0], words)


class Texts(ToolTest):
    """tools/pack_texts.py"""

    ROW = '/* "busy" */\nSTATUS(BUSY, 1, "busy busy", "busy: wait")\n'

    def pack(self, *arguments):
        """Packs tables that say busy; returns the packed ones."""
        self.write("firmware/cli/commands.def", 'COMMAND(Q, \'q\', HELP("q", "is it \\"busy\\"? busy\\t1"))\n')
        self.write("firmware/cli/display.def", 'DISPLAY_TEXT(t, "busy\\n" STATE "\\0busy")\n')
        self.write("firmware/base/status.def", self.ROW)
        self.write("firmware/settings.def", 'SETTING(\'A\', "busy")\nSETTING_KIND(X, "busy")\n')
        self.write("firmware/cli/pairs.def", "PAIR('s', 'y') /* 80 */\nPAIR('u', 0x80) /* 81 */\n")
        code, said = self.tool("pack_texts.py", "out", *arguments)
        self.assertEqual((0, ""), (code, said))
        return {name: (self.folder / "out" / name).read_text(encoding="utf-8")
                for name in ("cli/commands.def", "cli/display.def", "base/status.def", "settings.def")}

    def test_pairs_are_replaced_in_the_texts_that_are_printed(self):
        packed = self.pack()
        self.assertIn('"is it \\042b\\201\\042? b\\201\\0111"', packed["cli/commands.def"])
        self.assertIn('"b\\201\\012" STATE "\\000b\\201"', packed["cli/display.def"])
        self.assertIn('SETTING(\'A\', "b\\201")', packed["settings.def"])

    def test_ranges_advice_and_comments_stay(self):
        packed = self.pack()
        self.assertIn('SETTING_KIND(X, "busy")', packed["settings.def"])
        self.assertEqual('/* "busy" */\nSTATUS(BUSY, 1, "b\\201 b\\201", "busy: wait")\n', packed["base/status.def"])

    def test_pairs_are_chosen_from_the_texts(self):
        packed = self.pack("--choose")
        chosen = (self.folder / "firmware/cli/pairs.def").read_text(encoding="utf-8")
        self.assertIn("PAIR('b', 'u') /* 80: \"bu\" */\nPAIR('s', 'y') /* 81: \"sy\" */\n", chosen)
        self.assertIn("SETTING('A', \"\\200\\201\")", packed["settings.def"])

    def test_the_firmwares_texts_come_back(self):
        sys.path.insert(0, str(TOP / "tools"))
        import pack_texts

        code, said = self.tool("pack_texts.py", "--firmware", TOP / "firmware", "out")
        self.assertEqual((0, ""), (code, said))
        pairs = pack_texts.read_pairs((TOP / "firmware/cli/pairs.def").read_text(encoding="utf-8"))
        self.assertLessEqual(len(pairs), pack_texts.PAIRS)
        for name in pack_texts.TABLES:
            plain = pack_texts.literals((TOP / "firmware" / name).read_text(encoding="utf-8"))
            packed = pack_texts.literals((self.folder / "out" / name).read_text(encoding="utf-8"))
            self.assertEqual(plain, [pack_texts.unpacked(string, pairs) for string in packed])
            self.assertLess(sum(map(len, packed)), sum(map(len, plain)))


class Image(ToolTest):
    """tools/check_size.py, tools/check_stack.py and tools/link_order.py"""

    def build(self, source, *link):
        """Compiles and links a program."""
        self.write("t.c", source)
        for step in (["-Os", "-fstack-usage", "-c", "t.c", "-o", "t.o"], ["t.o", "-o", "t.elf", *link]):
            subprocess.run([f"{AVR}gcc", "-mmcu=atmega328p", *step], cwd=self.folder, check=True)

    def size(self, flash, ram):
        """Returns check_size.py's exit code for these budgets."""
        return self.tool(
            "check_size.py", "t.elf", "--size", f"{AVR}size", "--flash-budget", str(flash), "--ram-budget", str(ram)
        )[0]

    def stack(self, indirect=""):
        """Returns check_stack.py's exit code and text."""
        self.write("indirect", indirect)
        return self.tool("check_stack.py", "t.elf", "--su", ".", "--prefix", AVR, "--indirect", "indirect")

    def test_budgets_are_kept(self):
        self.build("char a[100] = {1}; int main(void) { return a[3]; }")
        self.assertEqual(0, self.size(1000, 100))
        self.assertEqual(1, self.size(100, 100))
        self.assertEqual(1, self.size(1000, 99))

    def test_an_order_is_found_in_which_calls_are_short(self):
        far = '__attribute__((noinline, section(".text." #name))) void name(void) { __asm__(".rept 1500\\n nop\\n .endr"); '
        self.build(
            f"#define FAR(name, more) {far} more; }}\n"
            "FAR(one, ) FAR(two, ) FAR(three, one()) FAR(four, two()) int main(void) { three(); four(); return 0; }",
            "-mrelax", "-Wl,-Map=t.map",
        )
        code, text = self.tool(
            "link_order.py", "t.elf", "--map", "t.map", "--objdump", f"{AVR}objdump", "--rounds", "300", "--write", "order"
        )
        self.assertEqual((0, "order: 0 long calls, 4 before\n"), (code, text))
        self.assertIn("*(.text.one .text.one.*)", (self.folder / "order").read_text(encoding="utf-8"))

    def test_frames_add_up_along_the_deepest_path(self):
        self.build(
            "volatile char x; void g(volatile char *p) { volatile char b[30]; b[x] = *p; x = b[1]; }"
            "__attribute__((noinline)) char f(void) { volatile char b[50]; b[x] = 1; g(b); return b[2]; }"
            "int main(void) { return f() + f(); }"
        )
        code, text = self.stack()
        self.assertEqual(0, code, text)
        bound = int(text.split()[1])
        # 2 bytes of return address each; g may be inlined, its frame stays
        self.assertGreaterEqual(bound, 30 + 50 + 4)
        self.assertLessEqual(bound, 30 + 50 + 30)

    def test_interrupts_are_added(self):
        main = "#include <avr/interrupt.h>\nvolatile char x; int main(void) { sei(); for (;;) x++; }\n"
        bounds = []
        for more in (
            "",
            "ISR(TIMER1_OVF_vect) { x++; }",
            "ISR(TIMER1_OVF_vect) { x++; } ISR(TIMER0_OVF_vect) { x--; }",
            "ISR(TIMER1_OVF_vect) { x++; } ISR(TIMER0_OVF_vect, ISR_NOBLOCK) { x--; }",
        ):
            self.build(main + more)
            code, text = self.stack()
            self.assertEqual(0, code, text)
            bounds.append(int(text.split()[1]))
        self.assertLess(bounds[0], bounds[1])
        self.assertEqual(bounds[1], bounds[2], "interrupts that mask each other do not nest")
        self.assertLess(bounds[2], bounds[3])

    def test_too_deep_a_stack_is_refused(self):
        self.build("volatile char x; int main(void) { volatile char b[2100]; b[x] = 1; for (;;) x = b[x]; }")
        self.assertEqual(1, self.stack()[0])

    def test_recursion_is_refused(self):
        self.build(
            "volatile char x; __attribute__((noinline)) int f(int a) { return a ? f(a - 1) * x + x : 0; }"
            "int main(void) { return f(x); }"
        )
        code, text = self.stack()
        self.assertEqual(1, code)
        self.assertIn("recursion: f > f", text.replace("__vectors > main > ", "").replace("__vectors > ", ""))

    def test_calls_through_pointers_must_be_listed(self):
        self.build(
            "typedef char fn(void); volatile char x; char one(void) { volatile char b[60]; b[x] = 1; return b[2]; }"
            "fn *volatile p = one; int main(void) { return p() + x; }"
        )
        code, text = self.stack()
        self.assertEqual(1, code)
        self.assertIn("calls through a pointer", text)
        code, text = self.stack("main: o?e")
        self.assertEqual(0, code, text)
        self.assertGreaterEqual(int(text.split()[1]), 60)


class Outline(ToolTest):
    """tools/outline.py, with a program in the place of the assembler that prints what it is given."""

    SHIFT = ["lsl r18", "rol r19", "rol r20", "rol r21"]

    def function(self, name, *instructions):
        """Returns a function as the compiler writes it."""
        lines = [f"{i}" if i.endswith(":") else f"\t{i}" for i in instructions]
        head = [f'\t.section\t.text.{name},"ax",@progbits', f"{name}:", "\tpush r28", "/* prologue: function */"]
        return "\n".join(head + lines + [f"\t.size\t{name}, .-{name}", ""])

    def outline(self, *functions, timed=""):
        """Returns the instructions and labels of the outcome."""
        self.write("order.ld", "".join(f"*(.text.{name} .text.{name}.*)\n" for name in "abcd"))
        source = self.write("in.s", "\t.file\t\"x\"\n__tmp_reg__ = 0\n" + "\n".join(functions))
        code, text = self.tool("outline.py", "--as", "cat", "--order", "order.ld", "--timed", timed, "--", str(source))
        self.assertEqual(0, code, text)
        kept = [line.split(";")[0].strip() for line in text.splitlines()]
        return [line for line in kept if line and line[0] != "/" and (line[0] != "." or line.endswith(":")) and "=" not in line]

    def expanded(self, lines):
        """Puts back what is called, and what is jumped to; returns {function: instructions}."""
        at = {line[:-1]: number for number, line in enumerate(lines) if line.endswith(":")}

        def body(number, inside):
            found = []
            for line in lines[number:]:
                word, _, name = line.partition(" ")
                if line.endswith(":"):
                    continue
                if ".Loutlined" in name:
                    found += body(at[name], word == "call")
                else:
                    found.append(line)
                if line == "ret" or word == "jmp":
                    return found[:-1] if inside else found
            return found

        return {name: body(number, False) for name, number in at.items() if not name.startswith(".L")}

    def test_a_repeated_sequence_is_kept_once(self):
        functions = [self.function(n, f"ldi r22,{n!r}", *self.SHIFT, f"mov r24,r{i}", "ret") for i, n in enumerate("abcd")]
        lines = self.outline(*functions)
        self.assertEqual(1, lines.count("lsl r18"))
        self.assertEqual(4, len([line for line in lines if line.startswith("call ")]))
        for i, name in enumerate("abcd"):
            self.assertEqual(
                ["push r28", f"ldi r22,{name!r}", *self.SHIFT, f"mov r24,r{i}", "ret"], self.expanded(lines)[name]
            )

    def test_a_common_end_is_kept_once_with_what_it_pops(self):
        end = ["sts x,r24", "pop r28", "ret"]
        lines = self.outline(self.function("a", "ldi r24,1", *end), self.function("b", "ldi r24,2", *end))
        self.assertEqual(1, lines.count("pop r28"))
        self.assertEqual({"a": ["push r28", "ldi r24,1", *end], "b": ["push r28", "ldi r24,2", *end]}, self.expanded(lines))

    def untouched(self, *instructions, timed=""):
        """Whether four functions with these instructions stay as they are."""
        functions = [self.function(n, f"ldi r22,{i}", *instructions, f"mov r24,r{i}", "ret") for i, n in enumerate("abcd")]
        return not any("outlined" in line for line in self.outline(*functions, timed=timed))

    def test_what_may_not_be_moved_stays(self):
        self.assertFalse(self.untouched(*self.SHIFT))
        self.assertTrue(self.untouched("cli", *self.SHIFT, "out __SREG__,r18"))
        self.assertTrue(self.untouched("push r2", "push r3", "push r4", "pop r4"))
        self.assertTrue(self.untouched("in r28,__SP_L__", "out __SP_L__,r28", "in r28,__SP_L__", "out __SP_L__,r28"))
        self.assertTrue(self.untouched("brne .L1", ".L1:", "breq .L2", ".L2:", "brcs .L3", ".L3:"))

    def test_a_skipped_instruction_stays_behind_its_skip(self):
        lines = self.outline(*(self.function(n, f"sbrc r2,{i}", *self.SHIFT, f"mov r24,r{i}", "ret") for i, n in enumerate("abcd")))
        for i in range(4):
            self.assertEqual("lsl r18", lines[lines.index(f"sbrc r2,{i}") + 1])
        lines = self.outline(*(self.function(n, f"ldi r22,{i}", *self.SHIFT, "sbrc r2,0", f"mov r24,r{i}", "ret") for i, n in enumerate("abcd")))
        for i in range(4):
            self.assertEqual("sbrc r2,0", lines[lines.index(f"mov r24,r{i}") - 1])

    def test_where_time_counts_only_long_sequences_are_called(self):
        self.assertTrue(self.untouched(*self.SHIFT, timed="a b c d"))
        self.assertFalse(self.untouched(*self.SHIFT, *self.SHIFT, timed="a b c d"))


class Trace(ToolTest):
    """tools/trace.py"""

    def setUp(self):
        super().setUp()
        rows = "".join(f"| HAR-00{n} | text | S | L1 | seen |\n" for n in (1, 2, 3))
        self.write("docs/requirements.md", f"## HAR — Ramp\n\n{rows}\n## Annex A\n\n| HAR-004 | not a row |\n")
        self.comment("/* HAR-001..HAR-002 */")
        self.result("PASS")

    def comment(self, comment):
        """Writes the test with that comment."""
        self.write("test/t.c", f"{comment}\nstatic void test_a(void)\n{{\n}}\n")

    def result(self, result):
        """Writes the test's result."""
        self.write("build/test-results/t.txt", f"test/t.c:2:test_a:{result}\n")

    def count(self, number):
        """Writes the number that must be reached."""
        self.write("docs/trace-count", f"{number}\n")

    def test_range_is_counted(self):
        code, text = self.tool("trace.py")
        self.assertEqual(0, code)
        self.assertIn("2 of 3 requirements", text)
        self.assertIn("HAR-002  test_a", text)

    def test_failed_test_shows_nothing(self):
        self.result("FAIL: expected 1")
        self.assertIn("0 of 3 requirements", self.tool("trace.py")[1])

    def test_unknown_requirement_is_an_error(self):
        self.comment("/* HAR-004 */")
        self.assertEqual(1, self.tool("trace.py")[0])

    def test_fall_is_an_error(self):
        self.count(3)
        self.assertEqual(1, self.tool("trace.py", "--raise")[0])

    def test_rise_is_kept(self):
        self.count(1)
        self.assertEqual(0, self.tool("trace.py", "--raise")[0])
        self.assertEqual("2\n", (self.folder / "docs/trace-count").read_text(encoding="utf-8"))

    def test_comment_must_stand_directly_above(self):
        self.comment("/* HAR-001 */\nint x;")
        self.assertIn("0 of 3 requirements", self.tool("trace.py")[1])


class Runner(ToolTest):
    """tools/run_tests.py"""

    def run_script(self, script):
        """Runs a shell script as a test program; returns the exit code and the last line."""
        path = self.write("unit/test_x", f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        code, text = self.tool("run_tests.py", "--tests", "unit/test_x", "--check", "good=true", "--timeout", "1")
        return code, text.splitlines()[-1]

    def test_totals_are_summed(self):
        self.assertEqual((0, "6 passed, 0 failed"), self.run_script("echo 5 Tests 0 Failures 0 Ignored"))

    def test_ignored_is_not_passed(self):
        self.assertEqual((0, "4 passed, 0 failed"), self.run_script("echo 5 Tests 0 Failures 2 Ignored"))

    def test_failures_fail(self):
        self.assertEqual((1, "4 passed, 2 failed"), self.run_script("echo 5 Tests 2 Failures 0 Ignored; exit 2"))

    def test_python_totals_are_read(self):
        code, line = self.run_script("printf 'Ran 5 tests in 1.0s\\n\\nFAILED (failures=1, errors=1, skipped=1)\\n'; exit 1")
        self.assertEqual((1, "3 passed, 2 failed"), (code, line))
        self.assertEqual((0, "6 passed, 0 failed"), self.run_script("printf 'Ran 5 tests in 1.0s\\n\\nOK\\n'"))

    def test_crash_fails(self):
        self.assertEqual((1, "1 passed, 1 failed"), self.run_script("kill -SEGV $$"))

    def test_crash_after_the_sum_fails(self):
        self.assertEqual(
            (1, "6 passed, 1 failed"), self.run_script("echo 5 Tests 0 Failures 0 Ignored; kill -ABRT $$")
        )

    def test_no_test_fails(self):
        self.assertEqual((1, "1 passed, 1 failed"), self.run_script("echo 0 Tests 0 Failures 0 Ignored"))

    def test_hang_fails(self):
        self.assertEqual((1, "1 passed, 1 failed"), self.run_script("exec sleep 60"))

    def test_missing_binary_fails(self):
        code, text = self.tool("run_tests.py", "--tests", "none", "--check", "bad=false")
        self.assertEqual((1, "0 passed, 2 failed"), (code, text.splitlines()[-1]))


if __name__ == "__main__":
    unittest.main()
