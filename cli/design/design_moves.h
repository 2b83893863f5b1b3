/* SPDX-License-Identifier: Apache-2.0
 *
 * --move: places and aims that a design may change, by name or pattern. */
#ifndef IMP_CLI_DESIGN_MOVES_H
#define IMP_CLI_DESIGN_MOVES_H

#include "text/args.h"
#include "text/json.h"
#include <importon/design.h>
#include <stdbool.h>
#include <stdio.h>

struct design_moves {
    struct imp_design_move *move; /* [n] */
    size_t n;
};

extern const struct arg_option options_moves[];

/* What --move names in the scene; catalogued: luminaires are chosen from files. 0, or an exit code with
 * the reason printed. */
int design_moves_make(bool catalogued, struct design_moves *out,
                      struct imp_design_options *options);
void design_moves_free(struct design_moves *m);

/* From where to where, as lines, JSON, and lines for --set @FILE. */
void design_moves_print(const struct design_moves *m, const struct imp_design_answer *a);
void design_moves_json(struct json *j, const struct design_moves *m,
                       const struct imp_design_answer *a);
int design_moves_settings(FILE *f, const struct design_moves *m);

#endif
