/* SPDX-License-Identifier: Apache-2.0
 *
 * The lamps of a design: luminaires of the scene, and a catalogue of what may be in their
 * places. */
#ifndef IMP_CLI_DESIGN_LAMPS_H
#define IMP_CLI_DESIGN_LAMPS_H

#include "text/args.h"
#include <importon/design.h>
#include <stdbool.h>

struct design_lamps {
    struct imp_design_lamp *lamp; /* [n] */
    const char **file;            /* [n] of the catalogue; NULL: the scene's own */
    char **place;                 /* [n] */
    size_t n;
};

extern const struct arg_option options_lamps[];

/* Read --choose and --catalogue, before the scene is loaded with what they name. 0, or an exit
 * code with the reason printed; likewise the next. */
int design_catalogue_read(void);
/* Are luminaires chosen from files? */
bool design_is_catalogued(void);
/* The lamps of the scene. */
int design_lamps_make(struct design_lamps *out);
void design_lamps_free(struct design_lamps *l);

#endif
