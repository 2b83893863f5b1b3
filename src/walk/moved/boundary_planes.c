/* SPDX-License-Identifier: Apache-2.0
 *
 * Which planes of a scene are mirrors or faces of glass (boundary.h). Facets whose corners, as far as they are
 * rounded, lie in one plane are in one. */
#include "base/arguments.h"
#include "bent_chain.h"
#include "moved_mirror.h"

#define ROUND                                                                            \
    1e-6 /* of corners, which are floats or decimals in a file, per coordinate */
#define LOOSE 1e-3 /* of slivers: what they are in is not known better than this */
#define MOST  4096 /* planes of a shape */

static enum imp_status plane_add(struct imp__boundary *b, const struct imp__plane *x)
{
    const struct imp_scene *scene = b->tracer->scene;
    struct imp__plane *more =
        imp__grow(scene->ctx, b->plane, &b->cap_planes, b->n_planes + 1, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    b->plane = more;
    b->plane[b->n_planes++] = *x;
    return IMP_OK;
}

static double most(imp_v3 p)
{
    return imp_max(imp_max(fabs(p[0]), fabs(p[1])), fabs(p[2]));
}

/* Is a triangle with the normal n, known to `loose`, in the plane, as far as corners that are rounded
 * tell? Of slivers beside each other corners alone would tell too little. */
static bool plane_has(const struct imp__plane *x, const imp_v3 p[3], imp_v3 n,
                      double loose)
{
    if (imp__length(imp__cross(x->n, n)) > x->loose + loose) return false;
    if (x->index > 0 && imp__dot(x->n, n) < 0) return false; /* glass is on one side */
    for (int k = 0; k < 3; k++) {
        const imp_v3 r = p[k] - x->p;
        if (fabs(imp__dot(x->n, r)) > ROUND * most(p[k]) + x->loose * imp__length(r))
            return false;
    }
    return true;
}

/* The plane of a triangle among those of its shape, from `first` on: the largest one tells its normal. */
static enum imp_status facet_add(struct imp__boundary *b, size_t first,
                                 struct imp__plane x, const imp_v3 p[3], double side,
                                 int *plane)
{
    const imp_v3 n = imp__cross(p[1] - p[0], p[2] - p[0]) * side;
    double longest = 0, far = 0;
    *plane = -1;
    if (imp__is_zero(n)) return IMP_OK;
    for (int k = 0; k < 3; k++) {
        longest = imp_max(longest, imp__length(p[k] - p[(k + 1) % 3]));
        far = imp_max(far, most(p[k]));
    }
    x.p = p[0];
    x.n = imp__normalize(n);
    const double loose = ROUND * far * longest / imp__length(n);
    x.loose = imp_min(loose, LOOSE);
    size_t k = first;
    while (k < b->n_planes && !plane_has(&b->plane[k], p, x.n, loose)) k++;
    *plane = (int)k;
    if (k == b->n_planes) return plane_add(b, &x);
    if (x.loose < b->plane[k].loose) b->plane[k] = x;
    return IMP_OK;
}

double imp__glass_index(const struct imp_scene *scene, const struct imp__body *body)
{
    const struct imp_hit hit = {.shape = body->shape, .place = body->place};
    const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
    const struct imp_dirs dirs = {{0, 0, 1, 0}, {0}, IMP_GLASS_BENDS, 0};
    const struct imp_texcoord nowhere = {.prim = 0};
    imp_spec in[IMP_INPUTS_MAX];
    if (!imp__is_glass(b)) return 0;
    imp__inputs_eval(b->input, b->n_in, &nowhere, in);
    return b->ops->index_ratio(b, in, &dirs);
}

/* Where normals of hits point, 1: as the order of corners tells. */
static double side_of(const struct imp_scene *scene, const struct imp__body *body, int n)
{
    struct imp_hit hit = {.shape = body->shape, .place = body->place};
    for (; hit.prim < n; hit.prim++) {
        const imp_v3 unused = {0};
        const struct imp__corners f =
            imp__corners(scene, body->shape, hit.prim, body->place, 0);
        struct imp_surface at;
        imp__hit_surface(scene, &hit, &unused, &unused, &at);
        const double side = imp__dot(at.ng, imp__cross(f.p[1] - f.p[0], f.p[2] - f.p[0]));
        if (side != 0) return side > 0 ? 1 : -1;
    }
    return 1;
}

/* Planes from `first` on are all that a shape has. */
static void planes_end(struct imp__boundary *b, size_t first)
{
    for (size_t k = first; k < b->n_planes; k++) {
        b->plane[k].first = first;
        b->plane[k].behind = b->n_planes;
    }
}

static enum imp_status facets_add(struct imp__boundary *b, const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_shape *s = scene->shapes[body->shape];
    const size_t first = b->n_planes, n = s->triangles.n_triangles;
    int *more =
        imp__grow(scene->ctx, b->plane_of, &b->cap_facets, b->n_facets + n, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    b->plane_of = more;
    const struct imp__plane x = {.shape = body->shape,
                                 .place = body->place,
                                 .facet = (int64_t)b->n_facets,
                                 .index = imp__glass_index(scene, body)};
    const double side = x.index > 0 ? side_of(scene, body, (int)n) : 1;
    for (size_t i = 0; i < n; i++) {
        const struct imp__corners f =
            imp__corners(scene, body->shape, (int)i, body->place, 0);
        IMP_CHECKED(facet_add(b, first, x, f.p, side, &b->plane_of[b->n_facets++]));
        if (b->n_planes - first > MOST)
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: shape '%s' is a mirror of more than "
                "%d facets",
                s->name, MOST);
    }
    return IMP_OK;
}

struct imp__plane_range imp__plane_surface(const struct imp__boundary *b, size_t k,
                                           struct imp__bent_surface *out)
{
    const struct imp__plane *x = &b->plane[k];
    *out = (struct imp__bent_surface){
        .p = x->p, .n = x->n, .plane = (int)k + 1, .shape = x->shape, .place = x->place};
    return (struct imp__plane_range){x->first, x->behind - x->first, x->index};
}

/* Is it a hit of this plane's shape? */
static bool is_of_shape(const struct imp__boundary *b, const struct imp__plane *x,
                        const struct imp_hit *hit)
{
    return hit->place == x->place &&
           (hit->shape == x->shape ||
            hit->shape == imp__placed_shape(b->tracer->scene, x->shape, x->place));
}

int imp__plane_number(const struct imp__boundary *b, const struct imp_hit *hit)
{
    size_t k = 0;
    while (k < b->n_planes && !is_of_shape(b, &b->plane[k], hit)) k = b->plane[k].behind;
    if (k == b->n_planes) return 0;
    const int64_t facet = b->plane[k].facet;
    return 1 + (facet < 0 ? (int)k : b->plane_of[facet + hit->prim]);
}

enum imp_status imp__mirrors_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (size_t k = 0; k < b->edges->n_bodies; k++) {
        const struct imp__body *body = &b->edges->body[k];
        const int placed = imp__placed_shape(scene, body->shape, body->place);
        if (!imp__mirror_lobes(imp__shape_bsdf(scene, scene->shapes[placed]))) continue;
        const size_t first = b->n_planes;
        if (scene->shapes[body->shape]->geometry == IMP_TRIANGLES) {
            IMP_CHECKED(facets_add(b, body));
            planes_end(b, first);
            if (imp__is_glass(imp__shape_bsdf(scene, scene->shapes[placed])))
                IMP_CHECKED(imp__benders_add(b, body));
            continue;
        }
        if (!imp__moves_disk(scene, body->shape)) {
            IMP_CHECKED(imp__benders_add(b, body));
            continue;
        }
        const struct imp__rim_point rim = imp__rim(scene, body->shape, body->place, 0, 0);
        const struct imp__plane x = {.shape = body->shape,
                                     .place = body->place,
                                     .facet = -1,
                                     .p = rim.p,
                                     .n = rim.n,
                                     .index = imp__glass_index(scene, body)};
        IMP_CHECKED(plane_add(b, &x));
        planes_end(b, first);
        if (imp__is_glass(imp__shape_bsdf(scene, scene->shapes[placed])))
            IMP_CHECKED(imp__benders_add(b, body));
    }
    return IMP_OK;
}
