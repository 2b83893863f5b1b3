/* SPDX-License-Identifier: Apache-2.0
 *
 * The medium at a point, found by a ray to the next boundary; and media that end within the scene, at
 * boundaries of type null. */
#ifndef IMP_SCENE_MEDIA_AROUND_H
#define IMP_SCENE_MEDIA_AROUND_H

#include "scene.h"

/* The next surface that bounds media, from *o along d, others passed, and is it met from inside? *o
 * is then behind it. NULL: there is none. */
const struct imp_shape *imp__border_next(const struct imp_scene *scene, imp_v3 *o,
                                         imp_v3 d, bool *outwards);

/* The medium at p, by the next boundary along d; `otherwise` if there is none. */
const struct imp_medium *imp__medium_around(const struct imp_scene *scene, imp_v3 p,
                                            imp_v3 d, const struct imp_medium *otherwise);

/* Does this shape say where a medium ends, and pass light as if nothing were there? */
static inline bool imp__is_border(const struct imp_scene *scene,
                                  const struct imp_shape *s)
{
    return s->interior != s->exterior && imp__shape_bsdf(scene, s)->flags & IMP_BSDF_NULL;
}

/* Has a medium of the scene an extinction that varies? */
bool imp__media_vary(const struct imp_scene *scene);

struct imp__borders {
    const struct imp_scene *scene;
    bool any;                         /* media end within the scene, or vary */
    bool varies;                      /* one of them does */
    const struct imp_medium *outside; /* of all of them */
};
/* otherwise: the medium outside where there is none. */
struct imp__borders imp__borders_of(const struct imp_scene *scene,
                                    const struct imp_medium *otherwise);
/* The medium in which a ray from o along w begins. */
static inline const struct imp_medium *imp__borders_at(const struct imp__borders *b,
                                                       imp_v3 o, imp_v3 w)
{
    return imp__medium_around(b->scene, o, w, b->outside);
}

#endif
