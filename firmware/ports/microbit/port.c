/* UART and timer of the nRF51 (reference manual, version 3.0). */
#include "cortexm.h"
#include "port.h"
#include "semihosting.h"

#define UART(offset)  (*(volatile uint32_t *)(0x40002000U + (offset)))
#define TIMER(offset) (*(volatile uint32_t *)(0x40008000U + (offset)))

enum {
    START_RX = 0x000, START_TX = 0x008, RX_READY = 0x108, TX_READY = 0x11C,
    INTERRUPT_SET = 0x304, ENABLE = 0x500, PIN_TX = 0x50C, PIN_RX = 0x514, RXD = 0x518,
    TXD = 0x51C, BAUD = 0x524,
    TIMER_START = 0x000, TIMER_CAPTURE = 0x040, TIMER_BITS = 0x508, TIMER_PRESCALER = 0x510,
    TIMER_VALUE = 0x540, TIMER_COMPARE = 0x544, TIMER_COMPARED = 0x144, TIMER_INTERRUPTS = 0x304,
    UART_INTERRUPT = 2, TIMER_INTERRUPT = 8,
};

static bool sent_before;

void port_init(void)
{
    UART(PIN_TX) = 24;
    UART(PIN_RX) = 25;
    UART(BAUD) = 0x01D7E000U; /* 115200 */
    UART(ENABLE) = 4;
    UART(START_TX) = 1;
    UART(START_RX) = 1;
    UART(INTERRUPT_SET) = 1U << 2; /* a byte wakes the core */
    TIMER(TIMER_BITS) = 3;         /* 32 */
    TIMER(TIMER_PRESCALER) = 4;    /* 16 MHz / 2^4: microseconds */
    TIMER(TIMER_INTERRUPTS) = 1U << 17;
    TIMER(TIMER_START) = 1;
    cortexm_wake_on(UART_INTERRUPT);
    cortexm_wake_on(TIMER_INTERRUPT);
}

void port_poll(void)
{
    while (UART(RX_READY) != 0U) {
        UART(RX_READY) = 0;
        port_received((uint8_t)(UART(RXD) & 0xFFU));
    }
}

bool port_write(uint8_t byte)
{
    if (sent_before && UART(TX_READY) == 0U) {
        return false;
    }
    UART(TX_READY) = 0;
    UART(TXD) = byte;
    sent_before = true;
    return true;
}

uint32_t port_time_us(void)
{
    TIMER(TIMER_CAPTURE) = 1;
    return TIMER(TIMER_VALUE);
}

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    return semihosting_convert(conversion, count, codes);
}

void port_idle(void)
{
    TIMER(TIMER_COMPARED) = 0;
    TIMER(TIMER_COMPARE) = port_time_us() + 1000U;
    cortexm_sleep(UART_INTERRUPT);
    cortexm_clear(TIMER_INTERRUPT);
}
