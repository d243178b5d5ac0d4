/* What the cross-check types. Factory settings: 200 steps a revolution, full step, slow speed 10 RPM, pulses of 2 us,
 * 38,400 Bd. The image `fine` (crosscheck.mk) has 8 microsteps and pulses of 1 us.
 *
 * image    the image, if it is not the firmware as it is delivered
 * name     the row of the table
 * typed    [milliseconds after the first line may be typed, bytes]
 * pulses   how many pulses each start from standstill must make, in order; within one of them intervals are compared
 *          (ANY: as many as the board; a stop cuts it short)
 * ms       length of the run after the first line */
import { ANY } from './compare.mjs';

export const cases = [
    { name: 'single pulses + + - -',
      typed: [[0, '+'], [5, '+'], [10, '-'], [15, '-']],
      pulses: [1, 1, 1, 1], ms: 40 },
    { name: 'harmonic', typed: [[0, 'm400v150a1d1\r']], pulses: [400], ms: 2000 },
    { name: 'harmonic, two starts', typed: [[0, 'm60v100a5d5\r'], [700, 'm60\r']], pulses: [60, 60], ms: 1400 },
    { name: 'harmonic, steep', typed: [[0, 'm2000v2400a10d10\r']], pulses: [2000], ms: 1500 },
    { name: 'harmonic, fraction', typed: [[0, 'm200v60a.75d1.33\r']], pulses: [200], ms: 1800 },
    { name: 'harmonic, truncated', typed: [[0, 'm100v300a1d2\r']], pulses: [100], ms: 1200 },
    { name: 'linear', typed: [[0, 'm400l1v160a20d20\r']], pulses: [400], ms: 1800 },
    { name: 'linear, truncated', typed: [[0, 'm300l1v600a100d50\r']], pulses: [300], ms: 1000 },
    { name: 'slow, 33 ms and 60 ms', typed: [[0, 'm8v9\r'], [400, 'm8v5\r']], pulses: [8, 8], ms: 1100 },
    { name: 'slow, vc123457', typed: [[0, 'm5vc123457\r']], pulses: [5], ms: 800 },
    { name: 'around 73 RPM (65,536 ticks)', typed: [[0, 'm120v76a2d2\r']], pulses: [120], ms: 1000 },
    { name: 'no ramp, 999', typed: [[0, 'm500v200a999d999\r']], pulses: [500], ms: 850 },
    { name: 'no ramp, short', typed: [[0, 'm2vc1000a999d999\r'], [20, 'm1\r']], pulses: [2, 1], ms: 50 },
    { name: 'streamed, same speed',
      typed: [[0, 'm200v200a5d999\r'], [20, 'm200v200a999d999\r']],
      pulses: [400], ms: 1000 },
    { name: 'streamed, faster and slower',
      typed: [[0, 'm200v150a5d999\r'], [20, 'm200v300a5d999\r'], [40, 'm200v100a5d5\r']],
      pulses: [600], ms: 1800 },
    { name: 'reversal through ramps', typed: [[0, 'm150v150a5d5\r'], [20, 'm-150\r']], pulses: [300], ms: 1600 },
    { name: 'reversal at 999',
      typed: [[0, 'm100v200a999d999\r'], [20, 'm-100\r'], [40, 'm100\r']],
      pulses: [300], ms: 600 },
    { name: 'start wait', typed: [[0, 'm60v150a10d10t150000\r']], pulses: [60], ms: 800 },
    { name: 'start wait in the queue',
      typed: [[0, 'm60v150a10d10\r'], [20, 'm60t100000\r']],
      pulses: [120], ms: 1200 },
    { name: 'cruise vc100 through ramps', typed: [[0, 'm6000vc100a10d10\r']], pulses: [6000], ms: 1300 },
    { name: 'cruise vc20', typed: [[0, 'm20000vc20a999d999\r']], pulses: [20000], ms: 450 },
    { name: 'cruise vc3', typed: [[0, 'm100000vc3a999d999\r']], pulses: [100000], ms: 350 },
    { name: 'long, 5 rev/s', typed: [[0, 'm6000v300a2d2\r']], pulses: [6000], ms: 6800 },
    { name: 'stop with prejudice, then a start',
      typed: [[0, 'm2000v150a10d10\r'], [401, 'S\r'], [450, 'm50\r']],
      pulses: [ANY, 50], ms: 900 },
    { name: 'stop with grace, then a start',
      typed: [[0, 'm2000v150a10d10\r'], [401, 's\r'], [900, 'm50\r']],
      pulses: [ANY, 50], ms: 1400 },
    { name: 'next with grace',
      typed: [[0, 'm2000v150a5d5\r'], [20, 'm-50\r'], [501, 'n\r']],
      pulses: [ANY], ms: 1600 },
    { name: 'next with prejudice',
      typed: [[0, 'm2000v150a5d5\r'], [20, 'm50\r'], [501, 'N\r']],
      pulses: [ANY], ms: 1200 },
    { image: 'fine', name: '8 microsteps, cruise 2 us',
      typed: [[0, 'm10000vc16a999d999\r']],
      pulses: [80000], ms: 250 },
    { image: 'fine', name: '8 microsteps, harmonic', typed: [[0, 'm300v200a2d3\r']], pulses: [2400], ms: 1500 },
    { image: 'fine', name: '8 microsteps, linear', typed: [[0, 'm-800l1v300a50d40\r']], pulses: [6400], ms: 1700 },
];
