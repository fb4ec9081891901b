# The same firmware as a native process: the UART is stdin and stdout, the converter a file.
DESCRIPTION = native process, needs only a C compiler
CC          = cc
CFLAGS      = -O2 -std=c11 -D_POSIX_C_SOURCE=200809L -DPORT_BAUD=0 -DPORT_FRAME_BYTES=1024 -DPORT_RECEIVE_BYTES=8192
LDFLAGS     =
SOURCES     = ports/host/port.c
RUN         = {program}
FLASH       =
