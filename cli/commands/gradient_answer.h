/* SPDX-License-Identifier: Apache-2.0
 *
 * What importon gradient has found: JSON, lines and plots of spectra. */
#ifndef IMP_CLI_GRADIENT_ANSWER_H
#define IMP_CLI_GRADIENT_ANSWER_H

#include "shared/blocks.h"

#include <importon/until.h>

struct gradient_answer {
    struct imp_estimate value;
    const char *functional; /* "loss", "mean" or "adjoint" */
    double *x, *grad, *se;
    int rounds, spp; /* of the run, each with spp samples at first */
    int spp_taken;   /* by a round's gradient: of the target with most of them */
    struct imp_until_end end;
};

/* until > 0: the gradient was taken to this error. paths [n_blocks]: files of large blocks. */
void gradient_json(const struct imp_run *run, double until,
                   const struct gradient_answer *r, const struct block *blocks,
                   size_t n_blocks, char **paths);
void gradient_print(const struct gradient_answer *r, const struct block *blocks,
                    size_t n_blocks, char **paths);

int gradient_is_spectrum(const struct block *b);
/* FOLDER/NAME.svg, to be freed. */
char *gradient_plot_path(const char *folder, const struct block *b);
int gradient_plot(const char *folder, const struct block *b,
                  const struct gradient_answer *r);

#endif
