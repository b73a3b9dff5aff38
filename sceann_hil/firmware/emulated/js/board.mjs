/*
 * One emulated board that does what it is told on standard input, a line of JSON at a time, and answers with a line:
 *
 *   node board.mjs rp2040|atmega328p IMAGE MODULES
 *   {"us": 1000, "in": "00ff", "adc": {"0": 512}, "pins": {"15": 0}}   lets at most so much of its time pass
 *   {"us": 87, "out": "0102", "motors": [0, 0], "store": 0}            until a byte came out
 *
 * Its time passes in these calls only, so nothing depends on how busy the computer is. IMAGE is the memory from the beginning of flash;
 * MODULES is the folder that has node_modules.
 */
import fs from 'node:fs';
import readline from 'node:readline';
import { createRequire } from 'node:module';

const [kind, image, modules] = process.argv.slice(2);
const require = createRequire(modules + '/');
const BYTE_US = 10e6 / 115200;

function rp2040() {
    const { Simulator, GPIOPinState } = require('rp2040js');
    const simulator = new Simulator();
    const chip = simulator.rp2040;
    const silent = () => {};
    chip.logger = { debug: silent, info: silent, warn: silent, error: silent };
    const program = fs.readFileSync(image);
    const out = [];
    let operations = 0, cutAt = -1;

    /* The chip's ROM is not ours to copy. These are its functions for flash, in a ROM of our own: each stops the core with BKPT n, and
     * what it does is done here. */
    const FUNCTIONS = ['IF', 'EX', 'RE', 'RP', 'FC', 'CX'];
    const rom = new Uint16Array(8192);
    const LOOK_UP = 0x100;
    rom[0x14 >> 1] = 0x200;
    rom[0x18 >> 1] = LOOK_UP | 1;
    rom[LOOK_UP >> 1] = 0xbe00;
    rom[(LOOK_UP >> 1) + 1] = 0x4770;  // bx lr
    FUNCTIONS.forEach((name, k) => {
        rom[(0x120 >> 1) + 2 * k] = 0xbe01 + k;
        rom[(0x120 >> 1) + 2 * k + 1] = 0x4770;
    });
    const start = () => {
        chip.core.VTOR = 0x10000100;
        const view = new DataView(chip.flash.buffer, chip.flash.byteOffset);
        chip.core.SP = view.getUint32(0x100, true);
        chip.core.PC = view.getUint32(0x104, true) & ~1;
    };
    chip.loadBootrom(new Uint32Array(rom.buffer));
    chip.flash.set(program);
    start();
    let dark = false;
    chip.onBreak = (code) => {
        const r = chip.core.registers;
        if (code === 0) {
            const at = FUNCTIONS.indexOf(String.fromCharCode(r[1] & 255, r[1] >> 8 & 255));
            r[0] = at < 0 ? 0 : (0x120 + 4 * at) | 1;
            return;
        }
        const name = FUNCTIONS[code - 1];
        if (name === 'RE' || name === 'RP') {
            operations++;
            dark = operations === cutAt;
        }
        if (name === 'RE') {
            chip.flash.fill(0xff, r[0], r[0] + (dark ? r[1] >> 1 : r[1]));
        } else if (name === 'RP') {
            const n = dark ? r[2] >> 1 : r[2];
            for (let k = 0; k < n; k++) {
                chip.flash[r[0] + k] &= chip.readUint8(r[1] + k);
            }
        }
    };
    chip.uart[0].onByte = (byte) => out.push(byte);
    for (const pin of [13, 14, 15, 1]) {
        chip.gpio[pin].setInputValue(true);
    }
    return {
        out,
        step() {
            const cycles = chip.core.executeInstruction();
            simulator.clock.tick(cycles * 8);
            return cycles * 0.008;
        },
        feed(byte) {
            chip.uart[0].feedByte(byte);
            return true;
        },
        adc(channel, value) {
            chip.adc.channelValues[channel] = value << 2;
        },
        pin(pin, level) {
            chip.gpio[pin].setInputValue(level !== 0);
        },
        cut(at) {
            cutAt = operations + at;
        },
        get dark() {
            return dark;
        },
        status() {
            const compare = chip.readUint32(0x4005000c);
            return { motors: [compare & 0xffff, compare >>> 16], light: chip.gpio[25].value === GPIOPinState.High ? 1 : 0, operations };
        },
        store: () => Buffer.from(chip.flash.subarray(2040 * 1024, 2048 * 1024)).toString('hex'),
        setStore(bytes) {
            chip.flash.set(bytes, 2040 * 1024);
        },
    };
}

function atmega328p() {
    const avr = require('avr8js');
    const flash = new Uint16Array(0x4000);
    new Uint8Array(flash.buffer).set(fs.readFileSync(image));
    const cpu = new avr.CPU(flash);
    const clock = new avr.AVRClock(cpu, 16e6);
    const ports = { B: new avr.AVRIOPort(cpu, avr.portBConfig), D: new avr.AVRIOPort(cpu, avr.portDConfig) };
    new avr.AVRTimer(cpu, avr.timer0Config);
    new avr.AVRTimer(cpu, avr.timer1Config);
    new avr.AVRWatchdog(cpu, avr.watchdogConfig, clock);
    const memory = new avr.EEPROMMemoryBackend(1024);
    new avr.AVREEPROM(cpu, memory);
    const adc = new avr.AVRADC(cpu, avr.adcConfig);
    const usart = new avr.AVRUSART(cpu, avr.usart0Config, 16e6);
    const out = [];
    let sentAt = -Infinity;
    usart.onByteTransmit = (byte) => {
        out.push(byte);
        sentAt = cpu.cycles;
    };
    /* When the program writes UCSR0B this emulator forgets a byte that waits, and it takes an empty transmitter for a full one after its
     * interrupt came and nothing was sent. A chip does neither. */
    const UCSR0B = 0xc1, UDR0 = 0xc6;
    const writeControl = cpu.writeHooks[UCSR0B], readData = cpu.readHooks[UDR0];
    let byteWaits = false;
    usart.onRxComplete = () => { byteWaits = true; };
    cpu.readHooks[UDR0] = (address) => {
        byteWaits = false;
        return readData(address);
    };
    cpu.writeHooks[UCSR0B] = (...values) => {
        const done = writeControl(...values);
        if (byteWaits) {
            cpu.setInterruptFlag(usart.RXC);
        }
        if (cpu.cycles >= sentAt + usart.cyclesPerChar) {
            cpu.setInterruptFlag(usart.UDRE);
        }
        return done;
    };
    for (const pin of [0, 2, 3]) {
        ports.D.setPin(pin, true);
    }
    ports.B.setPin(0, true);
    cpu.data[0x54] = 1;                // power on
    return {
        out,
        step() {
            const before = cpu.cycles;
            avr.avrInstruction(cpu);
            cpu.tick();
            return (cpu.cycles - before) / 16;
        },
        feed: (byte) => usart.writeByte(byte) !== false,
        adc(channel, value) {
            adc.channelValues[channel] = value * 5 / 1023;
        },
        pin(pin, level) {
            (pin < 8 ? ports.D : ports.B).setPin(pin & 7, level !== 0);
        },
        cut() {},
        dark: false,
        status() {
            const control = cpu.data[0x44];
            return { motors: [control & 0x80 ? cpu.data[0x47] : 0, control & 0x20 ? cpu.data[0x48] : 0], light: cpu.data[0x25] >> 5 & 1 };
        },
        store: () => Buffer.from(memory.memory).toString('hex'),
        setStore(bytes) {
            memory.memory.set(bytes);
        },
    };
}

const board = { rp2040, atmega328p }[kind]();
const waiting = [];
let now = 0, nextByte = 0;

function run(us) {
    const end = now + us;
    while (now < end && board.out.length === 0 && !board.dark) {
        if (waiting.length > 0 && now >= nextByte && board.feed(waiting[0])) {
            waiting.shift();
            nextByte = Math.max(now, nextByte) + BYTE_US;
        }
        now += board.step();
    }
    if (board.dark) {
        now = end;                     /* time goes on without it */
    }
}

for await (const line of readline.createInterface({ input: process.stdin })) {
    const order = JSON.parse(line);
    waiting.push(...Buffer.from(order.in ?? '', 'hex'));
    Object.entries(order.adc ?? {}).forEach(([channel, value]) => board.adc(Number(channel), value));
    Object.entries(order.pins ?? {}).forEach(([pin, level]) => board.pin(Number(pin), level));
    if (order.cut !== undefined) {
        board.cut(order.cut);
    }
    if (order.store !== undefined) {
        board.setStore(Buffer.from(order.store, 'hex'));
    }
    run(order.us ?? 0);
    const out = Buffer.from(board.out.splice(0)).toString('hex');
    const answer = { us: now, out, dark: board.dark, ...board.status() };
    process.stdout.write(JSON.stringify(order.dump ? { ...answer, store: board.store() } : answer) + '\n');
}
