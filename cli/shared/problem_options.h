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

const char *loss_word(void);
/* The sensor that sees target i. */
int target_sensor(size_t i);
/* Samples per pixel that a loss, or without --target a picture, takes in this run. */
int problem_spp(const struct imp_run *run);

#endif
