"""Boards without hardware: the firmware as a Linux process, in simavr, in QEMU.

Each is a serial line (`write`, `read`) with a chip behind it that runs the same sources as the real board.
"""
