/* USART 0 and timer 1 of the ATmega328P. */
#include "port.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#define TICKS_PER_US 2U /* timer 1 at F_CPU / 8 */
#define F_CPU_HZ 16000000UL

static volatile uint32_t overflows;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

ISR(USART_RX_vect)
{
    port_received(UDR0);
}

void port_init(void)
{
    /* Double speed: 115200 Bd within 2.1 %. */
    UBRR0 = (uint16_t)((F_CPU_HZ / 4UL / PORT_BAUD - 1UL) / 2UL);
    UCSR0A = (uint8_t)(1U << U2X0);
    UCSR0C = (uint8_t)((1U << UCSZ01) | (1U << UCSZ00));
    UCSR0B = (uint8_t)((1U << RXCIE0) | (1U << RXEN0) | (1U << TXEN0));
    TCCR1B = (uint8_t)(1U << CS11);
    TIMSK1 = (uint8_t)(1U << TOIE1);
    sei();
}

void port_poll(void)
{
}

bool port_write(uint8_t byte)
{
    if ((UCSR0A & (1U << UDRE0)) == 0U) {
        return false;
    }
    UDR0 = byte;
    return true;
}

uint32_t port_time_us(void)
{
    const uint8_t interrupts = SREG;
    cli();
    uint32_t high = overflows;
    const uint16_t low = TCNT1;
    /* The timer has gone round, and the interrupt for it still waits. */
    if ((TIFR1 & (1U << TOV1)) != 0U && low < 0x8000U) {
        high++;
    }
    SREG = interrupts;
    return (high << 15) + low / TICKS_PER_US;
}

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    (void)conversion;
    (void)count;
    (void)codes;
    return false; /* nothing is known of a board's wiring */
}

void port_idle(void)
{
}
