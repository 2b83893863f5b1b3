/* SPDX-License-Identifier: Apache-2.0
 *
 * What adds rows that draw: one file a subject. */
#ifndef IMP_INVERSE_CHECK_SOURCES_H
#define IMP_INVERSE_CHECK_SOURCES_H

#include "check_draws.h"
#include "check_places.h"

/* A row for every material and medium that has places: directions. */
enum imp_status imp__check_directions(struct imp__draw_list *l,
                                      const struct imp__places *places);

/* A row for the choice of lights, and one for every kind of light with a density: choices,
 * points. */
enum imp_status imp__check_lights(struct imp__draw_list *l,
                                  const struct imp__places *places);

/* Rows for every medium: flights, passes. */
enum imp_status imp__check_flights(struct imp__draw_list *l,
                                   const struct imp__places *places);
/* Rows for meters and for kinds of lights: areas, leaves. */
enum imp_status imp__check_areas(struct imp__draw_list *l,
                                 const struct imp__places *places);
/* Rows for light walks of skies and parallel lights: leaves. */
enum imp_status imp__check_far(struct imp__draw_list *l,
                               const struct imp__places *places);
/* Rows for what a guide draws: guides. */
enum imp_status imp__check_guides(struct imp__draw_list *l,
                                  const struct imp__places *places);
/* A row for the weights of bidirectional walks: weights. */
enum imp_status imp__check_weights(struct imp__draw_list *l,
                                   const struct imp__places *places);
/* Rows for what a walk begins with: film, times, waves. */
enum imp_status imp__check_film(struct imp__draw_list *l,
                                const struct imp__places *places);

#endif
