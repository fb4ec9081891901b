# BBC micro:bit, Cortex-M0 (nRF51822, 16 KB RAM); the UART is that of the USB interface chip.
DESCRIPTION = BBC micro:bit, Cortex-M0 (QEMU microbit)
CC          = arm-none-eabi-gcc
CFLAGS      = -O2 -std=c11 -mcpu=cortex-m0 -mthumb -ffunction-sections -fdata-sections -Idrivers -DPORT_FRAME_BYTES=256 -DPORT_RECEIVE_BYTES=1024
LDFLAGS     = -nostartfiles --specs=nosys.specs -Wl,--gc-sections -Wl,-Ldrivers -Tports/microbit/memory.ld
SOURCES     = drivers/cortexm.c drivers/semihosting.c ports/microbit/port.c
RUN         = qemu-system-arm -M microbit -display none -monitor none -serial stdio -semihosting-config enable=on,target=native -kernel {program}
FLASH       =
