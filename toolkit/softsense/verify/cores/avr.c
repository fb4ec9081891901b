/* An ATmega328P under simavr: timer 1 counts cycles, the USART says. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

#define TICK_MASK 0xFFFFFFFFu

static volatile uint16_t overflows;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

static void put(char c)
{
    while ((UCSR0A & (1 << UDRE0)) == 0) {
    }
    UDR0 = (uint8_t)c;
}

/* At an eighth of the clock the interrupt takes a share of 1e-4 of the time. */
static void begin(void)
{
    UCSR0B = 1 << TXEN0;
    TIMSK1 = 1 << TOIE1;
    TCCR1B = 1 << CS11;
    sei();
}

static uint32_t ticks(void)
{
    uint16_t low, high;

    cli();
    low = TCNT1;
    high = overflows;
    /* The timer has gone round, and the interrupt for it still waits. */
    if ((TIFR1 & (1 << TOV1)) != 0 && low < 0x8000u) {
        high++;
    }
    sei();
    return ((uint32_t)high << 16) + low;
}

/* simavr leaves when nothing can wake the core. */
static void finish(void)
{
    cli();
    sleep_enable();
    sleep_cpu();
}
