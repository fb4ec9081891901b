/* The board below the node: what every folder in ports/ provides.
 *
 * Re-entrancy: the node calls all of these from one thread. port_received() is the one call in the
 * other direction; a port may make it from an interrupt or from within port_poll().
 */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stdint.h>

/* Longest frame before COBS, both ways, in bytes. A board sets it in its board.mk. */
#ifndef PORT_FRAME_BYTES
#define PORT_FRAME_BYTES 512
#endif

/* Bytes that may wait between the wire and the node; a power of two. Up to 256 the indexes are
 * single bytes, so that an 8-bit core reads them whole while its interrupt writes. */
#ifndef PORT_RECEIVE_BYTES
#define PORT_RECEIVE_BYTES 2048
#endif

/* Symbol rate of the link, told to the client; 0 where the link has none (a pipe). */
#ifndef PORT_BAUD
#define PORT_BAUD 115200
#endif

/* Clocks, UART, converter: called once, first. */
void port_init(void);

/* Hands every byte that has arrived to port_received(). Empty where an interrupt does it. */
void port_poll(void);

/* Takes one byte to send and returns true, or returns false at once when there is no room. */
bool port_write(uint8_t byte);

/* Microseconds since some moment before port_init() returned; wraps around at 2^32. Must be called
 * at least once per minute; the node calls it all the time. */
uint32_t port_time_us(void);

/* Reads `count` channels of the converter into codes, as conversion number `conversion` (0, 1, ...
 * since boot). Returns false where the board has no converter or its feeder is silent. */
bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[]);

/* Called when there is nothing to do: may sleep until a byte arrives, for 1 ms at most. */
void port_idle(void);

/* Provided by node.c: one byte has arrived. Drops it, and counts it, when the queue is full. */
void port_received(uint8_t byte);

#endif
