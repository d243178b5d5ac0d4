/* The firmware image in avr8js: types lines into USART0 and notes every rising edge of clk (PB2) with the level of dir
 * (PB5).
 *
 * Units:   CPU cycles since reset.
 * Errors:  throws an Error with one line.
 * What avr8js makes of Timer1, and why an edge has two stamps: docs/crosscheck.md. */
import { readFileSync } from 'node:fs';
import avr8js from 'avr8js';

const { CPU, AVRIOPort, AVRTimer, AVRUSART, AVREEPROM, EEPROMMemoryBackend, AVRClock, AVRWatchdog } = avr8js;
const { avrInstruction } = avr8js;

export const CPU_HZ = 16_000_000;
const FLASH_BYTES = 0x8000;
const RAM_BYTES = 0x800;
const EEPROM_BYTES = 1024;
const CLK_BIT = 1 << 2;
const DIR_BIT = 1 << 5;
/* Start bit to RXC0 at 38,400 Bd: 153 samples of 26 cycles, and half a sample till the first (datasheet 20.8). */
const RX_DELAY = 153 * 26 + 13;
const RXC_BIT = 1 << 7;
const RXEN_BIT = 1 << 4;
const FAST_PWM = 3; /* avr8js' number for the family of modes */

/* Intel HEX with data records only, as avr-objcopy writes it. */
export function loadHex(path) {
    const flash = new Uint8Array(FLASH_BYTES).fill(0xff);
    for (const line of readFileSync(path, 'ascii').split(/\r?\n/)) {
        if (!line.startsWith(':')) continue;
        const bytes = Uint8Array.from(line.slice(1).match(/../g), (pair) => parseInt(pair, 16));
        if (bytes.reduce((sum, byte) => sum + byte, 0) & 0xff) throw new Error(`${path}: checksum of ${line}`);
        const [count, high, low, type] = bytes;
        if (type === 0) flash.set(bytes.subarray(4, 4 + count), (high << 8) | low);
    }
    return flash;
}

/* In avr8js each write of UCSR0B forgets a byte that has been received and not yet read; on the chip RXC0 stays set. */
function keepReceived(cpu, usart) {
    const { UCSRA, UCSRB } = usart.config;
    const write = cpu.writeHooks[UCSRB];
    cpu.writeHooks[UCSRB] = (value, ...rest) => {
        const received = cpu.data[UCSRA] & RXC_BIT;
        const written = write(value, ...rest);
        if (received && value & RXEN_BIT) cpu.setInterruptFlag(usart.RXC);
        return written;
    };
}

/* typed: [{ cycle, text }], bytes back to back from that cycle on; charCycles: 10 bits as the sender times them.
 * rxDelay: from the falling edge of the start bit to the byte in the receiver.
 * Returns { edges: [{ raw, exact, dir }], glitches, text }: raw is the cycle at which avr8js has moved the pin, exact
 * the cycle at which its counter met OCR1B; glitches counts pulses of no length. */
export function runWitness({ hexPath, typed = [], untilCycle, charCycles = 10 * (CPU_HZ / 38400), rxDelay = RX_DELAY }) {
    const cpu = new CPU(new Uint16Array(loadHex(hexPath).buffer), RAM_BYTES);
    new AVRWatchdog(cpu, avr8js.watchdogConfig, new AVRClock(cpu, CPU_HZ));
    const portB = new AVRIOPort(cpu, avr8js.portBConfig);
    const portC = new AVRIOPort(cpu, avr8js.portCConfig);
    const portD = new AVRIOPort(cpu, avr8js.portDConfig);
    for (let bit = 0; bit < 8; bit++) {
        /* no pull-ups in avr8js: inputs that nothing drives read 1; T1 is left low */
        if (bit !== 2 && bit !== 5) portB.setPin(bit, true);
        portC.setPin(bit, true);
        if (bit !== 5) portD.setPin(bit, true);
    }
    new AVRTimer(cpu, avr8js.timer0Config);
    const timer1 = new AVRTimer(cpu, avr8js.timer1Config);
    new AVREEPROM(cpu, new EEPROMMemoryBackend(EEPROM_BYTES));
    const usart = new AVRUSART(cpu, avr8js.usart0Config, CPU_HZ);
    usart.UDRE.constant = true; /* or the flag is lost when its vector is entered */
    keepReceived(cpu, usart);

    let text = '';
    usart.onByteTransmit = (byte) => {
        text += String.fromCharCode(byte);
    };

    const edges = [];
    let glitches = 0;
    portB.addListener((now, before) => {
        if (!((now ^ before) & CLK_BIT)) return;
        if (now & CLK_BIT) {
            const { tcnt, ocrA, ocrB, lastCycle, timerMode } = timer1;
            const late = tcnt >= ocrB ? tcnt - ocrB : tcnt + ocrA + 1 - ocrB;
            edges.push({
                raw: cpu.cycles,
                exact: timerMode === FAST_PWM ? lastCycle - late : cpu.cycles,
                dir: now & DIR_BIT ? 1 : 0,
                fall: -1,
                unreachable: timerMode === FAST_PWM && ocrB >= ocrA,
            });
        } else if (edges.length) {
            const last = edges[edges.length - 1];
            last.fall = cpu.cycles;
            if (last.unreachable) {
                edges.pop();
                glitches++;
            }
        }
    });

    const bytes = typed.flatMap(({ cycle, text: line }) =>
        Array.from(line, (char, at) => ({ cycle: cycle + Math.round(at * charCycles) + rxDelay, byte: char.charCodeAt(0) }))
    );
    let next = 0;
    while (cpu.cycles < untilCycle) {
        const limit = next < bytes.length ? Math.min(bytes[next].cycle, untilCycle) : untilCycle;
        while (cpu.cycles < limit) {
            avrInstruction(cpu);
            cpu.tick();
        }
        while (next < bytes.length && bytes[next].cycle <= cpu.cycles) usart.writeByte(bytes[next++].byte, true);
    }
    return { edges, glitches, text };
}
