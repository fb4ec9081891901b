/* Start of any Cortex-M: vector table, memory, main(). Idle: sleep until the tick or a byte. */
#include "cortexm.h"

#include <stdint.h>

extern uint32_t _data_load, _data_start, _data_end, _bss_start, _bss_end;

int main(void);
void reset_handler(void);
void _stack_top(void); /* an address, not a function; typed so that it may stand in the table */
static void halt(void);

typedef void (*handler)(void);

/* Interrupts stay masked: a pending one wakes the core from its sleep and is then cleared. */
__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
    _stack_top, reset_handler, halt, halt, halt, halt, halt, halt,
    0, 0, 0, halt, halt, 0, halt, halt,
};

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010U)
#define SYSTICK_RELOAD  (*(volatile uint32_t *)0xE000E014U)
#define SYSTICK_VALUE   (*(volatile uint32_t *)0xE000E018U)
#define NVIC_ENABLE     ((volatile uint32_t *)0xE000E100U)
#define NVIC_CLEAR      ((volatile uint32_t *)0xE000E280U)
#define SYSTEM_CONTROL  (*(volatile uint32_t *)0xE000ED04U)
#define PENDING_SYSTICK_CLEAR 0x02000000U

void reset_handler(void)
{
    __asm volatile("cpsid i");
    const uint32_t *from = &_data_load;
    for (uint32_t *to = &_data_start; to < &_data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = &_bss_start; to < &_bss_end; to++) {
        *to = 0;
    }
    (void)main();
    halt();
}

static void halt(void)
{
    for (;;) {
    }
}

void cortexm_tick(uint32_t cycles)
{
    SYSTICK_RELOAD = cycles - 1U;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 7U;
}

void cortexm_wake_on(uint8_t interrupt)
{
    NVIC_ENABLE[interrupt / 32U] = (uint32_t)1 << (interrupt % 32U);
}

void cortexm_clear(uint8_t interrupt)
{
    NVIC_CLEAR[interrupt / 32U] = (uint32_t)1 << (interrupt % 32U);
}

void cortexm_sleep(uint8_t interrupt)
{
    __asm volatile("dsb\n\twfi" ::: "memory");
    SYSTEM_CONTROL = PENDING_SYSTICK_CLEAR;
    cortexm_clear(interrupt);
}
