/* SPDX-License-Identifier: Apache-2.0
 *
 * --want: what a grid shall have. */
#ifndef IMP_CLI_ROOM_WANTS_H
#define IMP_CLI_ROOM_WANTS_H

#include "text/args.h"
#include <importon/design.h>
#include <stdbool.h>

#define WANTS_MAX 200

extern const struct arg_option options_wants[];
/* "average", "minimum", .. by enum imp_design_want_of. */
extern const char *const want_words[];

/* The wants that were given; want [WANTS_MAX]. 0, or an exit code with the reason printed. */
int wants_read(struct imp_design_want *want, size_t *n);
bool wants_given(void);
/* Name and unit of its sensor; the unit is "" of ratios and ratings. */
const char *want_sensor(const struct imp_design_want *w);
const char *want_unit(const struct imp_design_want *w);
/* Is the wanted value the largest? */
static inline bool want_is_upper(const struct imp_design_want *w)
{
    return w->of == IMP_WANT_MAXIMUM || w->of == IMP_WANT_UGR;
}

#endif
