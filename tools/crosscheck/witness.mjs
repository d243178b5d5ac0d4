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
/* A byte at 38,400 Bd as the sender times it; from its start bit to RXC0: 153 samples of 26 cycles,
 * and half a sample till the first (datasheet 20.8). */
const BYTE_CYCLES = 10 * (CPU_HZ / 38400);
const RX_DELAY = 153 * 26 + 13;
const RXC_BIT = 1 << 7;
const TXC_BIT = 0x40;
const STATUS_BITS = 0xbc; /* RXC0, UDRE0, FE0, DOR0, UPE0 */
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

/* In avr8js a write of UCSR0A clears all its flags; on the chip it clears TXC0 where a one is written, and no other. */
function keepFlags(cpu, usart) {
    const { UCSRA } = usart.config;
    const write = cpu.writeHooks[UCSRA];
    cpu.writeHooks[UCSRA] = (value, before, ...rest) => {
        const written = write(value, before, ...rest);
        cpu.data[UCSRA] |= before & (STATUS_BITS | (TXC_BIT & ~value));
        return written;
    };
}

/* typed: [{ cycle, text }], bytes back to back, the first start bit at that cycle.
 * Returns { edges: [{ raw, exact, dir }], text }: raw is the cycle at which avr8js has moved the pin, exact
 * the cycle at which its counter met OCR1B. */
export function runWitness({ hexPath, typed = [], untilCycle }) {
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
    keepFlags(cpu, usart);

    let text = '';
    usart.onByteTransmit = (byte) => {
        text += String.fromCharCode(byte);
    };

    const edges = [];
    portB.addListener((now, before) => {
        if (!(now & ~before & CLK_BIT)) return;
        const { tcnt, ocrA, ocrB, lastCycle, timerMode } = timer1;
        const counted = timerMode === FAST_PWM;
        if (counted && ocrB >= ocrA) return; /* the chip makes no pulse here */
        const late = tcnt >= ocrB ? tcnt - ocrB : tcnt + ocrA + 1 - ocrB;
        edges.push({ raw: cpu.cycles, exact: counted ? lastCycle - late : cpu.cycles, dir: now & DIR_BIT ? 1 : 0 });
    });

    const bytes = typed.flatMap(({ cycle, text: line }) =>
        Array.from(line, (char, at) => ({
            cycle: cycle + Math.round(at * BYTE_CYCLES) + RX_DELAY,
            byte: char.charCodeAt(0),
        }))
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
    return { edges, text };
}
