/* Macros of the assembler: all that a function must not change, saved and given back by the two pieces of code that
 * -mcall-prologues has in the image anyway.
 *
 * save_registers: r2 to r17, r28 and r29 on the stack, and below them a frame of so many bytes, of which the first is at
 * Y + 1; Z is lost, X has their number. restore_registers: and back to the caller; nothing else may be on the stack.
 * Context: functions of the main loop. Errors: none. Source: avr-gcc, libgcc's __prologue_saves__. */
#ifndef BASE_REGISTERS_H
#define BASE_REGISTERS_H

.macro save_registers frame=0
        ldi     r26, \frame
        ldi     r27, 0
        ldi     r30, pm_lo8(1f)
        ldi     r31, pm_hi8(1f)
        jmp     __prologue_saves__
1:
.endm

.macro restore_registers frame=0
        in      r28, 0x3D
        in      r29, 0x3E
        .if \frame
        adiw    r28, \frame
        .endif
        ldi     r30, 18
        jmp     __epilogue_restores__
.endm

#endif
