# Arduino Uno, ATmega328P at 16 MHz (2 KB RAM, 32 KB flash); the UART is that of its USB chip.
# -O1: gcc 5.4's -O2 code of the self-test does not return under QEMU 7.2.
DESCRIPTION = Arduino Uno, AVR ATmega328P (QEMU uno)
CC          = avr-gcc
CFLAGS      = -O1 -std=gnu11 -mmcu=atmega328p -ffunction-sections -fdata-sections -DPORT_FRAME_BYTES=96 -DPORT_RECEIVE_BYTES=256
LDFLAGS     = -Wl,--gc-sections
SOURCES     = ports/avr-uno/port.c
RUN         = qemu-system-avr -M uno -display none -monitor none -serial stdio -bios {program}
FLASH       = avrdude -p atmega328p -c arduino -P {port} -U flash:w:{program}:e
