/* What the node says: kinds of message and their payloads. The byte tables are in
 * firmware/README.md; this is the only C file that knows them.
 */
#ifndef MESSAGES_H
#define MESSAGES_H

#include "frame.h"
#include "health.h"

enum {
    MESSAGE_IDENTIFY = 0x01,
    MESSAGE_ESTIMATE = 0x02,
    MESSAGE_BATCH = 0x03,
    MESSAGE_SELF_TEST = 0x04,
    MESSAGE_STREAM = 0x05,
    MESSAGE_STATISTICS = 0x06,
    MESSAGE_SAMPLE = 0x40, /* sent unasked while the stream is on */
    MESSAGE_ERROR = 0x7F,
    MESSAGE_ANSWER = 0x80, /* set in every answer's kind */
};

/* Why a request is refused; zero is never sent. */
enum message_error {
    MESSAGE_DONE = 0,
    MESSAGE_BAD_VERSION,  /* of the protocol: the answer's header carries ours */
    MESSAGE_BAD_KIND,     /* unknown */
    MESSAGE_BAD_LENGTH,   /* the payload does not fit its kind and the networks */
    MESSAGE_BAD_SESSION,  /* not that of the last identify: this board has been reset since */
    MESSAGE_BAD_NETWORK,  /* there is no such network */
    MESSAGE_BAD_RATE,     /* stream faster than the board's limit */
    MESSAGE_NO_CONVERTER, /* this board has no converter, or its feeder is silent */
};

enum {
    MESSAGE_FLAG_UNCALIBRATED = 0x01, /* an input lies outside its calibrated range */
    MESSAGE_FLAG_FAILED = 0x02,       /* a sensor has failed */
    MESSAGE_FLAG_FALLBACK = 0x04,     /* a fallback network has answered */
    MESSAGE_FLAG_UNTRUSTED = 0x08,    /* no network does without the failed sensor */
};

/* Network number in a request: let the health of the sensors choose. */
enum { MESSAGE_CHOOSE = 0xFF };

struct statistics {
    uint32_t frames;    /* intact, received */
    uint32_t damaged;   /* failed COBS, CRC or check, too long or too short */
    uint32_t overrun;   /* bytes lost because the queue was full */
    uint32_t answers;   /* requests answered with anything but an error */
    uint32_t refused;   /* requests answered with an error */
    uint32_t estimates; /* networks evaluated */
};

/* The node's state that messages read and change. All zero to begin with. */
struct messages {
    uint16_t session; /* set by identify; 0 since the last reset */
    uint32_t period_us; /* of the stream; 0: off */
    uint32_t next_us;
    uint32_t conversion; /* number of the next conversion */
    uint16_t sample;     /* sequence number of the next sample */
    struct health health;
    struct statistics statistics;
};

/* Whether a sample of all channels and one row of estimates fit into a frame. */
bool messages_fit(void);

/* Answers one request: writes the whole answer, before COBS, to bytes[PORT_FRAME_BYTES] and
 * returns its length. Defined for every request, however malformed. */
size_t messages_answer(struct messages *messages, const struct frame *request, uint8_t bytes[]);

/* Converts, estimates and writes a sample as above; returns 0 where there is no converter. */
size_t messages_sample(struct messages *messages, uint8_t bytes[]);

#endif
