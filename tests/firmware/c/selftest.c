/* An exported header checks itself; also built as C++. The exit status is what the self-test says. */
#include "net.h"

int main(void)
{
    net_t net;
    uint16_t sensors[NET_SENSORS] = { 0 };
    int16_t motors[NET_MOTORS];
    net_reset(&net);
    net_step(&net, sensors, motors);
    return net_self_test();
}
