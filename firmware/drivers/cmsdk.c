/* UART and timer of Arm's Cortex-M System Design Kit (DDI 0479), as on every MPS2 board. The board
 * gives CMSDK_UART, CMSDK_TIMER (base addresses), CMSDK_UART_IRQ and CMSDK_HZ (their clock).
 */
#include "cortexm.h"
#include "port.h"
#include "semihosting.h"

#define REGISTER(base, offset) (*(volatile uint32_t *)((base) + (offset)))

#define UART_DATA    REGISTER(CMSDK_UART, 0x00U)
#define UART_STATE   REGISTER(CMSDK_UART, 0x04U)
#define UART_CONTROL REGISTER(CMSDK_UART, 0x08U)
#define UART_CLEAR   REGISTER(CMSDK_UART, 0x0CU)
#define UART_DIVIDER REGISTER(CMSDK_UART, 0x10U)

#define TIMER_CONTROL REGISTER(CMSDK_TIMER, 0x00U)
#define TIMER_VALUE   REGISTER(CMSDK_TIMER, 0x04U)
#define TIMER_RELOAD  REGISTER(CMSDK_TIMER, 0x08U)

enum { TX_FULL = 1, RX_FULL = 2, TX_ENABLE = 1, RX_ENABLE = 2, RX_INTERRUPT = 8 };

void port_init(void)
{
    UART_DIVIDER = CMSDK_HZ / PORT_BAUD;
    UART_CONTROL = TX_ENABLE | RX_ENABLE | RX_INTERRUPT;
    TIMER_RELOAD = 0xFFFFFFFFU;
    TIMER_VALUE = 0xFFFFFFFFU;
    TIMER_CONTROL = 1U;
    cortexm_wake_on(CMSDK_UART_IRQ);
    cortexm_tick(CMSDK_HZ / 1000U);
}

void port_poll(void)
{
    while ((UART_STATE & RX_FULL) != 0U) {
        port_received((uint8_t)(UART_DATA & 0xFFU));
    }
}

bool port_write(uint8_t byte)
{
    if ((UART_STATE & TX_FULL) != 0U) {
        return false;
    }
    UART_DATA = byte;
    return true;
}

uint32_t port_time_us(void)
{
    static uint32_t ticks_before;
    static uint32_t rest; /* ticks that do not make a whole microsecond yet */
    static uint32_t time_us;
    const uint32_t ticks = 0xFFFFFFFFU - TIMER_VALUE;
    rest += ticks - ticks_before;
    ticks_before = ticks;
    time_us += rest / (CMSDK_HZ / 1000000U);
    rest %= CMSDK_HZ / 1000000U;
    return time_us;
}

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    return semihosting_convert(conversion, count, codes);
}

void port_idle(void)
{
    cortexm_sleep(CMSDK_UART_IRQ);
    UART_CLEAR = 0xFU;
}
