/* Prints the hash of SAMPLES samples of the built-in sequence of the law, as 16 hexadecimal digits. */
#include "engine_mount_controller.h"

extern int puts(const char *text); /* of the C library, or of bare_cortex_m.c */

static engine_mount_controller_t controller;

int main(void)
{
    const uint64_t hash = engine_mount_controller_sequence_hash(&controller, SAMPLES);
    char text[17];
    for (int place = 0; place < 16; place++) {
        text[place] = "0123456789abcdef"[(hash >> (60 - 4 * place)) & 15u];
    }
    text[16] = '\0';
    return (puts(text) < 0) || !engine_mount_controller_self_test(&controller);
}
