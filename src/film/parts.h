/* SPDX-License-Identifier: Apache-2.0
 *
 * Is a call the one that the parts, or the other ranks of a team, were made by? */
#ifndef IMP_FILM_PARTS_H
#define IMP_FILM_PARTS_H

#include "base/team.h"
#include "scene/scene.h"

/* What a result depends on, and its name in a message. */
struct imp_same {
    const char *name;
    uint64_t hash;
};
#define IMP_SAME_MAX 12

/* Equal on all ranks and in all parts, or IMP_E_ARG with the first name that differs. */
enum imp_status imp__team_same(imp_context *ctx, const struct imp_same *same, int n);

/* Gives the team the parameters and random numbers of the sums that follow. */
void imp__team_state(const struct imp_scene *scene, const struct imp_run *run);

/* The scene at its present parameters, the sensor, and how Monte Carlo is run: fills
 * same[0..], returns how many. `call` names the function. */
int imp__same_run(const struct imp_scene *scene, const struct imp_run *run,
                  const char *call, struct imp_same same[IMP_SAME_MAX]);

#endif
