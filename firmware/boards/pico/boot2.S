/*
 * The first 252 bytes of flash: the ROM copies them into RAM and runs them there, once their CRC (in boot2.c) holds. They set the flash
 * up for reading with the command that all chips know (03h), and start the program behind them.
 */
    .syntax unified
    .cpu cortex-m0plus
    .thumb
    .section .boot2_code, "ax"
    .global boot2
boot2:
    ldr r3, =0x18000000        /* the flash interface */
    movs r1, #0
    str r1, [r3, #0x08]        /* off */
    movs r1, #4
    str r1, [r3, #0x14]        /* a quarter of the core's clock */
    ldr r1, =0x001F0300        /* 32 bits a frame, command and address first */
    str r1, [r3, #0x00]
    ldr r1, =0x03000218        /* command 03h of 8 bits, address of 24 */
    ldr r0, =0x180000F4
    str r1, [r0]
    movs r1, #0
    str r1, [r3, #0x04]        /* one frame at a time */
    movs r1, #1
    str r1, [r3, #0x08]        /* on */
    ldr r0, =0x10000100        /* the program's vectors */
    ldr r1, =0xE000ED08
    str r0, [r1]
    ldmia r0, {r0, r1}
    msr msp, r0
    bx r1
    .align 2
    .ltorg
