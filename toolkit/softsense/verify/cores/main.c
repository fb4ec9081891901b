/* Times CALL, less the loop around it; the core's file and SETUP stand before this one. */
#define BARRIER __asm__ volatile("" ::: "memory")

volatile int32_t sink;

static void number(uint32_t value)
{
    char text[10];
    int length = 0;

    do {
        text[length++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0u);
    while (length > 0) {
        put(text[--length]);
    }
    put('\n');
}

int main(void)
{
    uint32_t before, empty, full, i;

    begin();
    before = ticks();
    for (i = 0; i < CALLS; i++) {
        BARRIER;
    }
    empty = (ticks() - before) & TICK_MASK;
    before = ticks();
    for (i = 0; i < CALLS; i++) {
        CALL;
        BARRIER;
    }
    full = (ticks() - before) & TICK_MASK;
    number(full - empty);
    finish();
    return 0;
}
