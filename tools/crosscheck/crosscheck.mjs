/* Runs one image in avr8js and on the board, and compares every rising edge of clk.
 *
 * Usage:   crosscheck.mjs [--case text] image folder
 * Needs:   Node 20; <image>.hex and .elf; in the folder board_edges, probe and fine/sac (each .hex and .elf), made by
 *          crosscheck.mk. Scripts and edge lists of the run go there too.
 * Errors:  exit status 1 when a case fails, 2 when nothing could be compared.
 * What is compared, within which bounds, and why: docs/crosscheck.md. */
import { spawn } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { cases } from './cases.mjs';
import { compare } from './compare.mjs';
import { CPU_HZ, runWitness } from './witness.mjs';

const FIRST_LINE_MS = 1100; /* the prompt is out by then */
const PROBE_CYCLES = 1_500_000;
const PROBE_PULSE = 16;
const CYCLES_PER_MS = CPU_HZ / 1000;
const here = dirname(fileURLToPath(import.meta.url));

const hex = (text) => Buffer.from(text, 'latin1').toString('hex');

/* Starts the board on a script; the promise gives { edges: [{ cycle, dir }], text }. */
function startBoard({ image, folder, name, typed, untilCycle }) {
    const tool = join(folder, 'board_edges');
    const stem = join(folder, name);
    const orders = typed.map(({ cycle, text }) => `type ${cycle} ${hex(text)}\n`);
    writeFileSync(`${stem}.script`, `${orders.join('')}end ${untilCycle}\n`);
    const child = spawn(tool, [`${image}.elf`, `${stem}.script`, `${stem}.edges`], {
        stdio: ['ignore', 'inherit', 'inherit'],
    });
    return new Promise((resolve, reject) => {
        child.on('error', reject);
        child.on('exit', (status) => {
            if (status !== 0) return reject(new Error(`${tool} ended with status ${status}`));
            const run = { edges: [], text: '' };
            for (const line of readFileSync(`${stem}.edges`, 'ascii').trimEnd().split('\n')) {
                const [first, second = ''] = line.split(' ');
                if (first === 'text') run.text = Buffer.from(second, 'hex').toString('latin1');
                else run.edges.push({ cycle: Number(first), dir: Number(second) });
            }
            resolve(run);
        });
    });
}

/* The edges that the datasheet dictates for probe_periods.def, one list a train, from the train's start. */
function probeTrains() {
    const source = readFileSync(join(here, 'probe_periods.def'), 'ascii').replace(/\/\*[^]*?\*\//g, '');
    const trains = [];
    let at = 0;
    for (const [, kind, list] of source.matchAll(/(\w+)\(([^)]*)\)/g)) {
        const [ticks, periods] = list.split(',').map(Number);
        if (kind === 'TRAIN') {
            trains.push([]);
            at = -ticks;
        }
        for (let n = 0; n < (periods || 0); n++, at += ticks)
            if (kind === 'PULSES') trains[trains.length - 1].push(at + ticks - PROBE_PULSE);
    }
    return trains;
}

async function runBoth(options) {
    const board = startBoard(options);
    board.catch(() => {}); /* reported where it is awaited */
    const witness = runWitness({ ...options, hexPath: `${options.image}.hex` });
    return { witness, board: await board };
}

/* The probe: avr8js and the board, each against the datasheet. */
async function runProbe(folder) {
    const trains = probeTrains();
    const edges = trains.flat().map((cycle) => ({ cycle, dir: 0 }));
    const counts = trains.map((train) => train.length);
    const { witness, board } = await runBoth({
        image: join(folder, 'probe'), folder, name: 'probe', typed: [], untilCycle: PROBE_CYCLES,
    });
    const asWitness = { edges: board.edges.map(({ cycle, dir }) => ({ exact: cycle, raw: cycle, dir })) };
    const rows = [
        compare('probe: avr8js and datasheet', witness, { edges }, counts),
        compare('probe: board and datasheet', asWitness, { edges }, counts),
    ];
    for (const row of rows) { /* the datasheet's list has no start of its own */
        row.start = 0;
        row.faults = row.faults.filter((fault) => !fault.startsWith('a first edge'));
    }
    return rows;
}

async function runCase(item, number, image, folder) {
    const at = (ms) => Math.round((FIRST_LINE_MS + ms) * CYCLES_PER_MS);
    const typed = item.typed.map(([ms, text]) => ({ cycle: at(ms), text }));
    const { witness, board } = await runBoth({
        image, folder, name: `case${number}`, typed, untilCycle: at(item.ms),
    });
    const row = compare(item.name, witness, board, item.pulses);
    if (witness.text !== board.text) {
        row.faults.push('what the terminal shows differs');
        writeFileSync(join(folder, `case${number}.text`), `avr8js:\n${witness.text}\n\nboard:\n${board.text}\n`);
    }
    return row;
}

const COLUMNS = [
    ['case', 32, (row) => row.name.padEnd(32)],
    ['edges', 7, (row) => String(row.edges).padStart(7)],
    ['interval', 8, (row) => String(row.exact).padStart(8)],
    ['drift', 5, (row) => String(row.drift).padStart(5)],
    ['pin', 4, (row) => String(Math.max(row.raw, row.rawDrift)).padStart(4)],
    ['start', 5, (row) => String(row.start).padStart(5)],
    ['verdict', 7, (row) => (row.faults.length ? 'FAILED' : 'passed')],
];

function print(row) {
    console.log(COLUMNS.map(([, , cell]) => cell(row)).join('  '));
    for (const fault of row.faults) console.log(`    ${fault}`);
}

async function main(args) {
    const only = args[0] === '--case' ? args.splice(0, 2)[1] : '';
    const [delivered, folder] = args;
    if (!folder) {
        console.error('usage: crosscheck.mjs [--case text] image folder');
        return 2;
    }
    const images = { delivered, fine: join(folder, 'fine', 'sac') };
    console.log('Rising edges of clk, avr8js against the board; greatest differences in cycles of 62.5 ns.');
    console.log(COLUMNS.map(([title, width], i) => (i ? title.padStart(width) : title.padEnd(width))).join('  '));
    let failed = 0;
    let passed = 0;
    const count = (row) => {
        print(row);
        if (row.faults.length) failed++;
        else passed++;
    };
    for (const row of await runProbe(folder)) count(row);
    for (const [index, item] of cases.entries())
        if (item.name.includes(only)) count(await runCase(item, index + 1, images[item.image ?? 'delivered'], folder));
    console.log(`${passed} passed, ${failed} failed`);
    return failed ? 1 : 0;
}

try {
    process.exitCode = await main(process.argv.slice(2));
} catch (error) {
    console.error(`crosscheck: ${error.message}`);
    process.exitCode = 2;
}
