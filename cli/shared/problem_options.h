/* SPDX-License-Identifier: Apache-2.0
 *
 * The options for parameters, targets and loss, and the imp_problem made from them.
 * Shared by gradient, jacobian, check and fit. */
#ifndef IMP_CLI_CMD_PROBLEM_H
#define IMP_CLI_CMD_PROBLEM_H

#include "command.h"

struct problem_options {
    struct arg_list params, same, factor, log, hold, targets, masks, tikhonov, stay,
        smooth;
    const char *clip; /* NULL: not given */
    int loss;
    double epsilon;
};
extern struct problem_options problem_options;
extern const struct arg_option options_params[], options_targets[];

/* A problem on cli.scene with --param active ("*" if none is given), and --target,
 * --tikhonov, --stay and --smooth added. 0, or an exit code with the reason printed. */
int problem_open(imp_problem **out);
/* With --clip: decides the weights of clipped values, at the scene's present parameters.
 * A fit does that itself. 0, or an exit code with the reason printed. */
int problem_censor(imp_problem *problem);
void problem_close(imp_problem *problem);

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
const char *loss_word(void);
/* The sensor that sees target i. */
int target_sensor(size_t i);
/* Samples per pixel that a loss, or without --target a picture, takes in this run. */
int problem_spp(const struct imp_run *run);

#endif
