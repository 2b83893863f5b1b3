/* SPDX-License-Identifier: Apache-2.0
 *
 * A sensor's children: its film and its sampler. The scene builder reads them before the
 * sensor's own build, which needs the film's aspect. */
#ifndef IMP_KIND_SENSOR_FILM_H
#define IMP_KIND_SENSOR_FILM_H

#include "kind/build.h"

/* The film that b->node describes, with its filter (docs/scene-format.md 10); node NULL:
 * the default film. Unused properties of the node and its rfilter are errors. */
enum imp_status imp__film_desc_build(const struct imp_build *b,
                                     struct imp_film_desc *out);

/* Response curves that are bins of equal width: text "from, to, n", in nm. */
enum imp_status imp__film_bins_build(const struct imp_build *b, const char *text,
                                     struct imp_film_desc *f);

/* Samples per pixel of the sampler b->node, rounded up as its kind does
 * (docs/scene-format.md 10), and the kind of its points; node NULL: 4, independent. */
enum imp_status imp__sampler_build(const struct imp_build *b, int *spp,
                                   enum imp_points *points);

/* The films and the samplers that there are, for imp__kind_choose. */
const void *imp__film_at(const void *payload, size_t i);
const void *imp__sampler_at(const void *payload, size_t i);

#endif
