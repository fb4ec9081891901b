/* A Cortex-M under QEMU: SysTick counts, semihosting says. */
#include <stdint.h>

int main(void);
extern uint32_t stack_top;

#define TICK_MASK 0xFFFFFFu

#define SYST_CSR (*(volatile uint32_t *)0xE000E010)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018)
#define CPACR (*(volatile uint32_t *)0xE000ED88)

static long semihost(long operation, const void *argument)
{
    register long r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;

    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void put(char c)
{
    semihost(3, &c);
}

static void begin(void)
{
    SYST_RVR = TICK_MASK;
    SYST_CVR = 0;
    SYST_CSR = 5;
}

static uint32_t ticks(void)
{
    return TICK_MASK - SYST_CVR;
}

static void finish(void)
{
    semihost(0x18, (void *)0x20026);
}

void reset(void)
{
    CPACR |= 0xFu << 20; /* the FPU, where there is one */
    main();
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top, (const void *)reset};
