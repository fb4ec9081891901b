/* What every Cortex-M shares. */
#ifndef CORTEXM_H
#define CORTEXM_H

#include <stdint.h>

/* Wakes the sleeping core every `cycles` cycles (at most 2^24). */
void cortexm_tick(uint32_t cycles);

/* Lets external interrupt number `interrupt` wake the core; its handler never runs. */
void cortexm_wake_on(uint8_t interrupt);

/* Clears the pending interrupt `interrupt`. */
void cortexm_clear(uint8_t interrupt);

/* Sleeps until the tick or the interrupt, and clears both. */
void cortexm_sleep(uint8_t interrupt);

#endif
