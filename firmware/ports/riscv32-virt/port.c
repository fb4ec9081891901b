/* ns16550 UART and the machine timer of QEMU's virt machine. */
#include "port.h"
#include "semihosting.h"

#define UART(offset)  (*(volatile uint8_t *)(0x10000000U + (offset)))
#define PLIC(offset)  (*(volatile uint32_t *)(0x0C000000U + (offset)))
#define MTIME_LOW     (*(volatile uint32_t *)0x0200BFF8U)
#define MTIMECMP_LOW  (*(volatile uint32_t *)0x02004000U)
#define MTIMECMP_HIGH (*(volatile uint32_t *)0x02004004U)
#define MTIME_HIGH    (*(volatile uint32_t *)0x0200BFFCU)

enum {
    DATA = 0, INTERRUPTS = 1, FIFO = 2, LINE_CONTROL = 3, LINE_STATUS = 5,
    RX_READY = 0x01, TX_EMPTY = 0x20, UART_SOURCE = 10, TICKS_PER_US = 10,
    PLIC_ENABLE = 0x2000, PLIC_CLAIM = 0x200004,
};

void start(void);

/* Stack, empty memory, main(); a trap stops. */
__attribute__((naked, used, section(".start"))) void start(void)
{
    __asm volatile("la sp, _stack_top\n\t"
                   "la t0, 3f\n\t"
                   ".option arch, +zicsr\n\tcsrw mtvec, t0\n\t"
                   "la t0, _bss_start\n\t"
                   "la t1, _bss_end\n"
                   "1: bgeu t0, t1, 2f\n\t"
                   "sw zero, 0(t0)\n\t"
                   "addi t0, t0, 4\n\t"
                   "j 1b\n"
                   "2: call main\n\t"
                   ".balign 4\n"
                   "3: wfi\n\t"
                   "j 3b");
}

void port_init(void)
{
    UART(LINE_CONTROL) = 3; /* 8 bits, no parity */
    UART(FIFO) = 1;
    UART(INTERRUPTS) = 1; /* a byte wakes the core */
    PLIC(UART_SOURCE * 4U) = 1;
    PLIC(PLIC_ENABLE) = 1U << UART_SOURCE;
    /* Timer and external interrupts may wake the core; they are never taken. */
    __asm volatile(".option push\n\t.option arch, +zicsr\n\tcsrw mie, %0\n\t.option pop"
                   :: "r"(0x880U));
}

void port_poll(void)
{
    while ((UART(LINE_STATUS) & RX_READY) != 0U) {
        port_received(UART(DATA));
    }
}

bool port_write(uint8_t byte)
{
    if ((UART(LINE_STATUS) & TX_EMPTY) == 0U) {
        return false;
    }
    UART(DATA) = byte;
    return true;
}

uint32_t port_time_us(void)
{
    static uint32_t before;
    static uint32_t rest; /* ticks that do not make a whole microsecond yet */
    static uint32_t time_us;
    const uint32_t ticks = MTIME_LOW;
    rest += ticks - before;
    before = ticks;
    time_us += rest / TICKS_PER_US;
    rest %= TICKS_PER_US;
    return time_us;
}

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    return semihosting_convert(conversion, count, codes);
}

void port_idle(void)
{
    const uint32_t low = MTIME_LOW;
    const uint32_t high = MTIME_HIGH;
    const uint32_t wake = low + 1000U * TICKS_PER_US;
    MTIMECMP_HIGH = high + ((wake < low) ? 1U : 0U);
    MTIMECMP_LOW = wake;
    __asm volatile("wfi" ::: "memory");
    const uint32_t source = PLIC(PLIC_CLAIM);
    if (source != 0U) {
        PLIC(PLIC_CLAIM) = source;
    }
}
