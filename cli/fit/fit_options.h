/* SPDX-License-Identifier: Apache-2.0
 *
 * How a fit searches: options that fit and view share. */
#ifndef IMP_CLI_FIT_OPTIONS_H
#define IMP_CLI_FIT_OPTIONS_H

#include "shared/command.h"

struct fit_choice {
    int optimizer, iterations, no_intervals, levels, missing, variate, allocation;
    double learning_rate, tolerance, momentum;
    double memory; /* MB; < 0: not given */
    double headroom;
    double mesh_lambda; /* < 0: not given */
};
extern struct fit_choice fit_choice;
extern const struct arg_option options_search[],
    options_missing[]; /* the latter: of fit */
struct imp_fit_options fit_choice_options(void);
const char *fit_optimizer_word(void);

#endif
