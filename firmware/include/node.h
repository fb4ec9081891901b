/* The node: bytes in, frames handled, frames out, and the stream at its rate. */
#ifndef NODE_H
#define NODE_H

#include <stdbool.h>

/* Call once after port_init(). Returns false when the networks do not fit this firmware. */
bool node_init(void);

/* Does what is to be done now, and returns; true when there was something. Call for ever. */
bool node_step(void);

#endif
