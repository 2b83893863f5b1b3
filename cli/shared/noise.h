/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of a sensor (EMVA 1288): light of a value v has the variance read^2 + shot v + (relative v)^2. */
#ifndef IMP_CLI_NOISE_H
#define IMP_CLI_NOISE_H

#include <stdbool.h>

struct noise {
    double read, shot, relative;
    double white; /* values from here on are saturated; 0: none are */
};

/* --noise KEY=V[,..]: 0, or an exit code with its message. */
int noise_read(const char *text, bool has_white, struct noise *out);

#endif
