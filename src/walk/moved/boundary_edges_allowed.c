/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges and seams that the boundary cannot differentiate (boundary.h), refused by name. */
#include "base/arguments.h"
#include "boundary_allowed.h"

static const char *face_name(const struct imp__boundary *b, size_t face)
{
    return b->tracer->scene->shapes[b->edges->face[face].shape]->name;
}

/* The first face of an edge that is of another body than its first; that, if there is none. */
static size_t other_face(const struct imp__boundary *b, const struct imp__edge *e)
{
    const struct imp__edge_face *f = &b->edges->face[e->first];
    for (int k = 1; k < e->n_faces; k++)
        if (f[k].shape != f->shape || f[k].place != f->place) return e->first + (size_t)k;
    return e->first;
}

static bool is_black(const struct imp_scene *scene, const struct imp_bsdf *b)
{
    const imp_v3 nowhere = {0};
    bool black = imp__is_lambertian(b);
    for (int k = 0; k < b->n_in && black; k++) {
        imp_spec most;
        imp__input_most(b->input[k], &nowhere, &nowhere, &most);
        black = !imp__is_textured(b) && !(imp__max_used(most, scene->lanes == 4) > 0);
    }
    return black;
}

/* Points of a meter are glued to it, and what they see jumps where it passes through a surface. Next
 * to the seam of a light, d away, points of a surface and of the light have derivatives that grow like
 * 1/d: the surface must not reflect. */
static enum imp_status seam_allowed(const struct imp__boundary *b,
                                    const struct imp__edge_face *f,
                                    const struct imp__edge_face *g)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_sensor *sensor = b->tracer->sensor;
    const char *own = scene->shapes[f->shape]->name,
               *other = scene->shapes[g->shape]->name;
    if (sensor->shape && f->place == 0 && f->shape == sensor->shape->index)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: shape '%s' passes through '%s', the "
            "shape of meter '%s'",
            other, own, sensor->name);
    if (b->through && scene->shapes[f->shape]->emitter >= 0)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: light '%s' passes through shape "
                          "'%s', and walks are those of volpath (path has them)",
                          own, other);
    const int met = imp__placed_shape(scene, g->shape, g->place);
    if (scene->shapes[f->shape]->emitter >= 0 &&
        !is_black(scene, imp__shape_bsdf(scene, scene->shapes[met])))
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: light '%s' passes through shape "
                          "'%s', which reflects: next to where they meet derivatives "
                          "grow without bound (a black one may stand there)",
                          own, other);
    return IMP_OK;
}

/* A light's own circle has no draws. */
static enum imp_status arc_allowed(const struct imp__boundary *b,
                                   const struct imp__arc *arc)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < 2; k++) {
        const struct imp__edge_face *f = &arc->side[k], *g = &arc->side[1 - k];
        if (scene->shapes[f->shape]->emitter >= 0)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: light '%s' passes through "
                              "shape '%s', and one of them is a sphere",
                              scene->shapes[f->shape]->name,
                              scene->shapes[g->shape]->name);
        IMP_CHECKED(seam_allowed(b, f, g));
    }
    return IMP_OK;
}

static enum imp_status seams_allowed(const struct imp__boundary *b)
{
    for (size_t k = 0; k < b->edges->n; k++) {
        const struct imp__edge *e = &b->edges->edge[k];
        if (!e->seam) continue;
        const struct imp__edge_face *f = &b->edges->face[e->first];
        IMP_CHECKED(seam_allowed(b, f, f + 2));
        IMP_CHECKED(seam_allowed(b, f + 2, f));
    }
    for (size_t k = 0; k < b->edges->n_arcs; k++)
        IMP_CHECKED(arc_allowed(b, &b->edges->arc[k]));
    return IMP_OK;
}

/* An edge at which faces meet that let light samples pass in different parts: it is no silhouette for
 * a line through both, and the light jumps there. NULL: none. */
static const struct imp__edge_face *edge_mixed(const struct imp__boundary *b)
{
    for (size_t k = 0; b->passes && b->through && k < 2 * b->edges->n_arcs; k++) {
        const struct imp__edge_face *f = &b->edges->arc[k / 2].side[k % 2];
        const struct imp_hit hit = {.shape = f->shape, .place = f->place};
        if (imp__hit_bsdf(b->tracer->scene, &hit)->straight) return f;
    }
    for (size_t k = 0; b->passes && b->through && k < b->edges->n; k++) {
        const struct imp__edge *e = &b->edges->edge[k];
        const struct imp_bsdf *first = NULL;
        for (int j = 0; j < e->n_faces; j++) {
            const struct imp__edge_face *f = &b->edges->face[e->first + (size_t)j];
            const struct imp_hit hit = {.shape = f->shape, .place = f->place};
            const struct imp_bsdf *own = imp__hit_bsdf(b->tracer->scene, &hit);
            if (!first) first = own;
            if ((own->straight || first->straight) && (own != first || e->n_faces > 2))
                return f;
        }
    }
    return NULL;
}

enum imp_status imp__edges_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp__edge *torn = imp__edges_torn(b->edges, b->moves);
    if (torn)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: an edge of shape '%s' at (%g, %g, %g) "
            "lies on shape '%s', and they move differently",
            face_name(b, torn->first), torn->a[0], torn->a[1], torn->a[2],
            face_name(b, other_face(b, torn)));
    int other = -1;
    const int rim = imp__rims_torn(b->edges, scene, b->moves, &other);
    if (rim >= 0)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: a rim of shape '%s' lies on one of "
            "shape '%s', and they are not the wall and the lid of a can that "
            "stands still",
            scene->shapes[rim]->name, scene->shapes[other]->name);
    const struct imp__edge_face *mixed = edge_mixed(b);
    if (mixed)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: at an edge of shape '%s' materials meet that "
            "let different parts of the light straight through, which light samples of "
            "volpath see (those of path do not)",
            scene->shapes[mixed->shape]->name);
    const int pierced = imp__edges_pierced(b->edges, scene, &other);
    if (pierced >= 0)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "derivatives by what moves: shape '%s' passes through shape '%s', "
            "and where they meet is no edge: one of them is a disk or cylinder, or a "
            "curve",
            scene->shapes[other]->name, scene->shapes[pierced]->name);
    return seams_allowed(b);
}
