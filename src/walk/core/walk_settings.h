/* SPDX-License-Identifier: Apache-2.0
 *
 * Settings that several integrators of walks have in common, read from the scene (_read) and
 * settled when all of it is there. */
#ifndef IMP_WALK_SETTINGS_H
#define IMP_WALK_SETTINGS_H

#include "walk_integrator.h"

/* hide_emitters and max_depth; `fallback`: the default of max_depth. */
enum imp_status imp__depth_read(const struct imp_build *build, int fallback,
                                struct imp_integrator *i, struct imp_walk_integrator *w);

/* How light samples choose among the lights. */
enum imp_status imp__light_choice_read(const struct imp_build *build,
                                       struct imp_walk_integrator *w);
void imp__light_choice_ready(struct imp_scene *scene, struct imp_walk_integrator *w);

/* Weights of the densities of directions, and how many vertices draw from each of them:
 * walks then become trees of up to IMP_DENSITIES^split branches. */
enum imp_status imp__mixture_read(const struct imp_build *build,
                                  struct imp_walk_integrator *w);
/* If nobody wrote weights: path draws from kernels, and towards proxies, which are there to
 * be aimed at; photons, which no connection helps, towards lights as well. */
enum imp_status imp__mixture_settle(struct imp_scene *scene,
                                    const struct imp_integrator *i,
                                    struct imp_walk_integrator *w);

/* Makes w->other_end, walks of the same settings that begin at the other end. */
enum imp_status imp__other_end_make(const struct imp_build *build,
                                    struct imp_walk_integrator *w);

#endif
