#include "node.h"
#include "port.h"

int main(void)
{
    port_init();
    if (!node_init()) {
        /* Silence: the client says that nothing answers. The build refuses such networks. */
        return 1;
    }
    for (;;) {
        if (!node_step()) {
            port_idle();
        }
    }
}
