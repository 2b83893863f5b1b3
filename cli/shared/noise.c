/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of a sensor, as plan and measure take it. */
#include "noise.h"

#include "command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int noise_read(const char *text, bool has_white, struct noise *out)
{
    const struct {
        const char *key;
        double *to;
    } keys[] = {{"read", &out->read},
                {"shot", &out->shot},
                {"relative", &out->relative},
                {"white", &out->white}};
    const size_t n_keys = has_white ? 4 : 3;
    for (const char *at = text; *at;) {
        bool met = false;
        for (size_t k = 0; k < n_keys && !met; k++) {
            const size_t n = strlen(keys[k].key);
            char *end;
            if (strncmp(at, keys[k].key, n) != 0 || at[n] != '=') continue;
            *keys[k].to = strtod(at + n + 1, &end);
            met = end != at + n + 1 && (!*end || *end == ',') && *keys[k].to >= 0 &&
                  isfinite(*keys[k].to);
            if (met) at = end + (*end == ',');
        }
        if (!met)
            return cli_error(EXIT_USAGE,
                             "--noise %s: expected read=V, shot=V%s, with commas between "
                             "them, none negative",
                             text,
                             has_white ? ", relative=V or white=V" : " or relative=V");
    }
    return out->read > 0 || out->shot > 0 || out->relative > 0
               ? 0
               : cli_error(EXIT_USAGE,
                           "--noise %s: pictures without noise have intervals of 0; give "
                           "read, shot or relative",
                           text);
}
