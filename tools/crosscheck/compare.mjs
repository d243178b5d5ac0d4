/* Compares two lists of rising edges. Pure.
 *
 * Units:   CPU cycles.
 * Tests:   test/crosscheck/compare_test.mjs
 * The bounds and their reasons: docs/crosscheck.md. */

export const EXACT_BOUND = 0; /* avr8js' counter against the board's pin: any interval, any sum of intervals */
export const RAW_BOUND = 7; /* avr8js' pin against the board's pin, likewise: what it lags behind its counter */
export const START_BOUND = 400; /* from a line typed to its first edge: software */

/* Greatest difference between two lists of times: of neighbours, and since the first of all; and where the neighbours
 * first differ by more than the bound, or -1. */
function difference(a, b, bound) {
    let interval = 0;
    let drift = 0;
    let first = -1;
    for (let i = 1; i < a.length; i++) {
        const apart = Math.abs(a[i] - a[i - 1] - (b[i] - b[i - 1]));
        if (first < 0 && apart > bound) first = i;
        interval = Math.max(interval, apart);
        drift = Math.max(drift, Math.abs(a[i] - a[0] - (b[i] - b[0])));
    }
    return { interval, drift, first };
}

/* Stands for the number of pulses of a start which a stop cuts short: as many as the board has made. */
export const ANY = null;

/* witness.edges: [{ exact, raw, dir }]; board.edges: [{ cycle, dir }]; trains: how many pulses each start from
 * standstill must make, at most one of them ANY. Returns a row of the table; faults is empty when the case has
 * passed. */
export function compare(name, witness, board, trains) {
    const row = { name, edges: board.edges.length, exact: 0, drift: 0, raw: 0, rawDrift: 0, start: 0, faults: [] };
    const known = trains.reduce((sum, pulses) => sum + pulses, 0);
    const wanted = trains.includes(ANY) ? Math.max(known, board.edges.length) : known;
    if (witness.edges.length !== board.edges.length)
        row.faults.push(`avr8js made ${witness.edges.length} edges, the board ${board.edges.length}`);
    if (board.edges.length !== wanted)
        row.faults.push(`${wanted} edges were commanded, the board made ${board.edges.length}`);
    const both = Math.min(witness.edges.length, board.edges.length);
    const turned = board.edges.slice(0, both).findIndex((edge, i) => edge.dir !== witness.edges[i].dir);
    if (turned >= 0) row.faults.push(`dir differs at edge ${turned + 1}`);
    let from = 0;
    for (const pulses of trains) {
        const to = Math.min(from + (pulses === ANY ? wanted - known : pulses), both);
        if (from >= to) break;
        const pins = board.edges.slice(from, to).map((edge) => edge.cycle);
        const counted = witness.edges.slice(from, to).map((edge) => edge.exact);
        const exact = difference(counted, pins, EXACT_BOUND);
        const raw = difference(witness.edges.slice(from, to).map((edge) => edge.raw), pins, RAW_BOUND);
        if (exact.first >= 0) {
            const at = exact.first;
            row.faults.push(`interval before edge ${from + at + 1}: avr8js ${counted[at] - counted[at - 1]}, ` +
                `the board ${pins[at] - pins[at - 1]} cycles`);
        }
        row.exact = Math.max(row.exact, exact.interval);
        row.drift = Math.max(row.drift, exact.drift);
        row.raw = Math.max(row.raw, raw.interval);
        row.rawDrift = Math.max(row.rawDrift, raw.drift);
        row.start = Math.max(row.start, Math.abs(witness.edges[from].exact - pins[0]));
        from = to;
    }
    if (row.drift > EXACT_BOUND) row.faults.push(`the time since the first edge differs by ${row.drift} cycles`);
    if (Math.max(row.raw, row.rawDrift) > RAW_BOUND) row.faults.push(`avr8js' pin lags by ${row.rawDrift} cycles`);
    if (row.start > START_BOUND) row.faults.push(`a first edge differs by ${row.start} cycles`);
    return row;
}
