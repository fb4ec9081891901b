# RISC-V rv32imac on QEMU's virt machine; the UART is its ns16550.
DESCRIPTION = RISC-V rv32imac (QEMU virt)
CC          = riscv64-unknown-elf-gcc
CFLAGS      = -O2 -std=c11 -march=rv32imac -mabi=ilp32 -mcmodel=medany -ffunction-sections -fdata-sections --specs=picolibc.specs -Idrivers -DPORT_FRAME_BYTES=1024 -DPORT_RECEIVE_BYTES=4096
LDFLAGS     = -nostartfiles -Wl,--gc-sections -Tports/riscv32-virt/memory.ld
SOURCES     = ports/riscv32-virt/port.c drivers/semihosting.c
RUN         = qemu-system-riscv32 -M virt -m 8M -bios none -display none -monitor none -serial stdio -semihosting-config enable=on,target=native -kernel {program}
FLASH       =
