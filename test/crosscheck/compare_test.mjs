/* The comparison of the cross-check must see each kind of difference. Prints one line; exit status 1 on a failure. */
import assert from 'node:assert/strict';
import { ANY, compare, EXACT_BOUND, RAW_BOUND, START_BOUND } from '../../tools/crosscheck/compare.mjs';

const PERIOD = 1000;
const PULSES = 20;
const TRAINS = [12, 8];

/* Two runs that agree; witnessChange and boardChange get the edge, its number, and may return another edge or null. */
function verdict(witnessChange, boardChange = (edge) => edge, trains = TRAINS) {
    const times = Array.from({ length: PULSES }, (_, i) => 5000 + i * PERIOD + (i >= TRAINS[0] ? 777 : 0));
    const list = (edges, change) => edges.map(change).filter((edge) => edge);
    const witness = { edges: list(times.map((at) => ({ exact: at, raw: at, dir: 0 })), witnessChange) };
    const board = { edges: list(times.map((at) => ({ cycle: at, dir: 0 })), boardChange) };
    return compare('test', witness, board, trains).faults;
}

const same = (edge) => edge;
const later = (edge, exact, raw = exact) => ({ ...edge, exact: edge.exact + exact, raw: edge.raw + raw });

const tests = {
    'equal runs pass': () => assert.deepEqual(verdict(same), []),
    'a constant offset passes': () => assert.deepEqual(verdict((edge) => later(edge, START_BOUND)), []),
    'a later start passes within its bound': () =>
        assert.deepEqual(verdict((edge, i) => later(edge, i >= TRAINS[0] ? START_BOUND : 0)), []),
    'a later start fails beyond it': () =>
        assert.notDeepEqual(verdict((edge, i) => later(edge, i >= TRAINS[0] ? START_BOUND + 1 : 0)), []),
    'a lagging pin passes within its bound': () =>
        assert.deepEqual(verdict((edge, i) => later(edge, 0, i % 2 ? RAW_BOUND : 0)), []),
    'a lagging pin fails beyond it': () =>
        assert.notDeepEqual(verdict((edge, i) => later(edge, 0, i === 3 ? RAW_BOUND + 1 : 0)), []),
    'one moved edge fails': () =>
        assert.notDeepEqual(verdict((edge, i) => later(edge, i === 3 ? EXACT_BOUND + 1 : 0, 0)), []),
    'one moved edge at the end of a start fails': () =>
        assert.notDeepEqual(verdict((edge, i) => later(edge, i === TRAINS[0] - 1 ? EXACT_BOUND + 1 : 0, 0)), []),
    'a drift of a cycle in all fails': () =>
        assert.notDeepEqual(verdict((edge, i) => later(edge, i < 6 ? 0 : EXACT_BOUND + 1)), []),
    'a missing edge fails': () => assert.notDeepEqual(verdict((edge, i) => (i === 4 ? null : edge)), []),
    'the same edge missing in both fails': () => {
        const drop = (edge, i) => (i === PULSES - 1 ? null : edge);
        assert.notDeepEqual(verdict(drop, drop), []);
    },
    'a missing last edge fails': () =>
        assert.notDeepEqual(verdict(same, (edge, i) => (i === PULSES - 1 ? null : edge)), []),
    'a start cut short passes': () =>
        assert.deepEqual(verdict((edge, i) => later(edge, i < 12 ? 0 : 9), undefined, [ANY, 8]), []),
    'a start cut short by another edge fails': () =>
        assert.notDeepEqual(verdict((edge, i) => (i === 11 ? null : edge), undefined, [ANY, 8]), []),
    'fewer edges than commanded beside a start cut short fail': () =>
        assert.notDeepEqual(verdict(same, undefined, [ANY, PULSES + 1]), []),
    'another dir fails': () =>
        assert.notDeepEqual(verdict((edge, i) => (i === 7 ? { ...edge, dir: 1 } : edge)), []),
};

for (const [name, test] of Object.entries(tests)) {
    try {
        test();
    } catch (error) {
        console.error(`compare_test: ${name}: ${error.message}`);
        process.exitCode = 1;
    }
}
if (!process.exitCode) console.log(`compare_test: ${Object.keys(tests).length} passed`);
