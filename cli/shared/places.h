/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the things that numbers of geometry move are in the pictures, for what a page draws over
 * them. */
#ifndef IMP_CLI_PLACES_H
#define IMP_CLI_PLACES_H

#include "blocks.h"
#include "problem_options.h"

/* Numbers of a search [n][n_numbers], as imp_fit_step.history_x; n 0: none. Things with a to_world
 * have no way, since their matrices move the middle, too. */
struct places_way {
    size_t n, n_numbers;
    const double *x;
};

/* "places": [..] of the blocks that move what is in the pictures of the targets, or, without any, of
 * the sensor of -s, at the scene's present numbers; nothing if there are none. */
void places_json(struct json *j, const struct block *blocks, size_t n_blocks,
                 const struct places_way *way);
/* The same of parameters of cli.scene [n], in the picture of -s. */
void places_params_json(struct json *j, const size_t *param, size_t n);

#endif
