/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of a problem, parameter by parameter: as JSON, and as pictures and volumes. */
#ifndef IMP_CLI_BLOCKS_H
#define IMP_CLI_BLOCKS_H

#include "command.h"

/* x in pieces: one for each active parameter, or for several that are tied. */
struct block {
    struct imp_param_info info; /* of the first; of a factor, what it is called */
    size_t first, n;            /* x[first .. first + n) */
    struct imp_tie_info tie;
    const imp_problem *problem;
};
struct block *problem_blocks(const imp_problem *problem, size_t *n_blocks);
/* Too long for a line of numbers: goes to a picture, or is summed up. */
int block_is_large(const struct block *b);
/* Is its number i held (imp_problem_hold)? */
int block_held(const struct block *b, size_t i);
/* {"name":..,"unit":..,"held":[indices]} and what the caller adds before json_end_object. */
void block_json(struct json *j, const struct block *b);
/* "log", "same", "multiplies", where they apply. */
void block_ties_json(struct json *j, const struct block *b);
/* May block_write write there? `errors`: with standard errors. */
int block_writable(const struct block *b, const char *folder, int errors);
/* What block_write wrote there in a former run, if anything; it was found writable. */
void block_remove(const struct block *b, const char *folder);
/* A texture's values as a picture in `folder`, named by the parameter: `x` in plain
 * colours, or, with `se` of the same length, signed. [h][w] or [h][w][1 or 3]; what has
 * another shape is a row; a volume is a .vol file. *path is to be freed. 0, or an exit
 * code with the reason printed. */
int block_write(const struct block *b, const double *x, const double *se,
                const char *folder, char **path);

#endif
