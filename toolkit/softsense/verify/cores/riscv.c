/* RISC-V under QEMU's virt machine: minstret counts, the ns16550 says. */
#include <stdint.h>

int main(void);

#define TICK_MASK 0xFFFFFFFFu

#define UART (*(volatile uint8_t *)0x10000000)
#define TEST_FINISHER (*(volatile uint32_t *)0x100000)

static void put(char c)
{
    UART = (uint8_t)c;
}

static void begin(void)
{
}

static uint32_t ticks(void)
{
    uint32_t count;

    __asm__ volatile(".option push\n .option arch, +zicsr\n csrr %0, minstret\n .option pop"
                     : "=r"(count));
    return count;
}

static void finish(void)
{
    TEST_FINISHER = 0x5555;
}

/* The C library keeps errno where tp points. */
__attribute__((naked, used, section(".start"))) void start(void)
{
    __asm__ volatile("la sp, stack_top\n la tp, thread\n j main");
}
