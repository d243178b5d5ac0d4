; Linked as the firmware is: a NOBITS section alone at the start of RAM, .data behind it.
    .section .segments, "aw", @nobits
    .global ring
ring: .skip 192

    .data
    .global greeting
greeting: .byte 0x12, 0x34, 0x56, 0x78

    .section .bss
    .global done
done: .skip 1

    .text
    .global main
main:
    ldi r16, 1
    sts done, r16
1:  rjmp 1b
    .global __do_copy_data, __do_clear_bss ; the start-up code, which comes only when asked for
