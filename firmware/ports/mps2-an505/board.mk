# Arm MPS2, Cortex-M33 in QEMU; the UART is QEMU's first serial port.
DESCRIPTION = Arm MPS2, Cortex-M33 (QEMU mps2-an505)
CC          = arm-none-eabi-gcc
CFLAGS      = -O2 -std=c11 -mcpu=cortex-m33 -mthumb -ffunction-sections -fdata-sections -Idrivers -DCMSDK_UART=0x50200000U -DCMSDK_TIMER=0x50000000U -DCMSDK_UART_IRQ=32 -DCMSDK_HZ=20000000U -DPORT_FRAME_BYTES=1024 -DPORT_RECEIVE_BYTES=4096
LDFLAGS     = -nostartfiles --specs=nosys.specs -Wl,--gc-sections -Wl,-Ldrivers -Tports/mps2-an505/memory.ld
SOURCES     = drivers/cortexm.c drivers/cmsdk.c drivers/semihosting.c
RUN         = qemu-system-arm -M mps2-an505 -display none -monitor none -serial stdio -semihosting-config enable=on,target=native -kernel {program}
FLASH       =
