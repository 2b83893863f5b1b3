/* SPDX-License-Identifier: Apache-2.0
 *
 * Features of scenes: media, materials, lights. */
#include "found.h"

#include "scene/media_around.h"
#include "walk/core/active.h"

/* ---- Scenes ------------------------------------------------------------------------ */

/* Where records are read, nothing is traced. */
IMP_FOUND(NO_GEOMETRY)
{
    return j->scene->rayless && !imp__job_has(j, IMP_HAS_RECORDING, by);
}
IMP_FOUND(MEDIA)
{
    if (j->scene->n_media == 0) return false;
    *by = (struct imp_bearer){.name = j->scene->media[0]->name};
    return true;
}
IMP_FOUND(GRADED_MEDIA)
{
    (void)by;
    return j->scene->n_bodies > 0;
}
IMP_FOUND(EMITTING_MEDIUM)
{
    for (int m = 0; m < j->scene->n_media; m++)
        if (j->scene->media[m]->emits) {
            *by = (struct imp_bearer){.name = j->scene->media[m]->name};
            return true;
        }
    return false;
}
IMP_FOUND(PRIORITIES)
{
    (void)by;
    return j->scene->priorities != NULL;
}

/* The first material with `flag`; NULL: none. */
static const struct imp_bsdf *material_with(const struct imp_job *j, unsigned flag)
{
    for (int b = 0; b < j->scene->n_bsdfs; b++)
        if (j->scene->bsdfs[b]->flags & flag) return j->scene->bsdfs[b];
    return NULL;
}
/* The material in it, or it itself, whose directions are turned. */
static const struct imp_bsdf *turned_of(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++)
        if (b->child[k]->flags & IMP_BSDF_TURNED) return turned_of(b->child[k]);
    return b;
}
IMP_FOUND(TURNED_MATERIAL)
{
    const struct imp_bsdf *b = material_with(j, IMP_BSDF_TURNED);
    if (!b) return false;
    b = turned_of(b);
    IMP_BEARS(b);
    by->more = b->n_child ? "shades about normals of its own"
                          : "is a fibre, which light enters where it is seen";
    return true;
}
/* Is what the material emits 0, whatever is differentiated? */
static bool is_dark(const struct imp_bsdf *b, const struct imp_active *active)
{
    for (int j = 0; j < b->n_own; j++) {
        const struct imp_input *in = b->input[j];
        if (b->ops->inputs[j].role != IMP_EMISSION) continue;
        if (in->texture || !imp__is_zero(in->value)) return false;
        if (active && in->param >= 0 && active->base[in->param] >= 0) return false;
    }
    for (int k = 0; k < b->n_child; k++)
        if (!is_dark(b->child[k], active)) return false;
    return true;
}
IMP_FOUND(GLOWING_MATERIAL)
{
    for (int b = 0; b < j->scene->n_bsdfs; b++) {
        const struct imp_bsdf *m = j->scene->bsdfs[b];
        if (!(m->flags & IMP_BSDF_EMIT) || is_dark(m, j->active)) continue;
        IMP_BEARS(m);
        return true;
    }
    return false;
}
IMP_FOUND(STRAIGHT_MATERIAL)
{
    for (int b = 0; j->walks && j->walks->media && b < j->scene->n_bsdfs; b++) {
        const struct imp_bsdf *m = j->scene->bsdfs[b];
        if (!m->straight || m->flags & IMP_BSDF_NULL) continue;
        IMP_BEARS(m);
        return true;
    }
    return false;
}
IMP_FOUND(JUMPING_MATERIAL)
{
    const struct imp_scene *s = j->scene;
    const struct imp_bsdf *b = material_with(j, IMP_BSDF_JUMP);
    struct imp_bearer nobody;
    if (!b || imp__job_has(j, IMP_HAS_NOT_ONE_CONVEX, &nobody) || !s) return false;
    IMP_BEARS(b);
    return true;
}
/* The attached form of the exponent here has neither the gradient of what arrives nor
 * boundary terms (docs/estimators.md 4): it is right only where both are zero, a convex
 * object under a constant environment whose weight does not jump at the horizon. */
IMP_FOUND(NOT_ONE_CONVEX)
{
    (void)by;
    const struct imp_scene *s = j->scene;
    return !(s->n_shapes == 1 && !s->world && s->environment >= 0 && s->n_emitters == 1 &&
             s->emitters[0]->ops->flags & IMP_EMITTER_UNIFORM &&
             s->shapes[0]->ops->flags & IMP_SHAPE_CONVEX);
}

/* ---- Lights ------------------------------------------------------------------------ */

IMP_FOUND(SILENT_LIGHT)
{
    for (int k = 0; k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (e->ops->sample_emission && e->ops->pdf_emission &&
            !(e->shape && !e->shape->ops->sample_area))
            continue;
        IMP_BEARS(e);
        return true;
    }
    return false;
}
IMP_FOUND(UNSAMPLED_LIGHT)
{
    for (int k = 0; k < j->scene->n_emitters; k++)
        if (j->scene->emitters[k]->weight == 0) {
            IMP_BEARS(j->scene->emitters[k]);
            return true;
        }
    return false;
}
/* Light sampling alone never samples a light where its emission is 0, so it misses the
 * derivative there. */
IMP_FOUND(GAPPED_LIGHT_ACTIVE)
{
    for (int k = 0; j->active && k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (!(e->ops->flags & IMP_EMITTER_GAPS) || !j->active->emitter[k]) continue;
        IMP_BEARS(e);
        return true;
    }
    return false;
}
IMP_FOUND(SKY)
{
    if (j->scene->environment < 0) return false;
    IMP_BEARS(j->scene->emitters[j->scene->environment]);
    return true;
}
/* Does the sensor's medium go on outside of everything, and does a light lie there? */
IMP_FOUND(LIGHT_BEYOND_MEDIUM)
{
    if (!j->sensor || !j->sensor->medium) return false;
    const struct imp_ball *ball = j->sensor->scene;
    const imp_v3 up = imp__v3(0, 0, 2 * ball->radius);
    for (int k = 0; k < j->scene->n_emitters; k++) {
        const struct imp_emitter *e = j->scene->emitters[k];
        if (!(e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR)) || e->shape)
            continue;
        *by = (struct imp_bearer){.name = j->sensor->medium->name, .more = e->name};
        return imp__medium_around(j->scene, ball->centre + up, imp__v3(0, 0, -1),
                                  j->sensor->medium) != NULL;
    }
    return false;
}
