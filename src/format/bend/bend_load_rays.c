/* SPDX-License-Identifier: Apache-2.0
 *
 * <rays>: bundles, each with a frame whose z axis runs along the beam (or from a point
 * source to the centre). Children of <rays> are given in that frame and apply to every
 * bundle of the element. */
#include "base/number.h"
#include "bend_load.h"
#include "format/search.h"
#include <string.h>

#define GOLDEN_ANGLE 2.39996322972865332
#define RAYS_MAX     20000000 /* of a file: 160 bytes each, before they are traced */

/* Axes so that x and y are those of the world for z = (0, 0, 1). */
static struct imp__bendfile_frame frame_of(imp_v3 origin, imp_v3 direction)
{
    struct imp__bendfile_frame f = {.o = origin, .n = imp__normalize(direction)};
    const imp_v3 up =
        fabs(f.n[1]) < 0.999 ? imp__v3(0, 1, 0) : imp__v3(0, 0, -copysign(1, f.n[1]));
    f.s = imp__normalize(imp__cross(up, f.n));
    f.t = imp__cross(f.n, f.s);
    return f;
}

/* Point i of n spread over the sphere (Fibonacci lattice). */
static imp_v3 sphere_point(int64_t i, int64_t n)
{
    const double z = 1 - (2 * (double)i + 1) / (double)n, r = sqrt(fmax(0, 1 - z * z));
    return imp__v3(r * cos(GOLDEN_ANGLE * (double)i), r * sin(GOLDEN_ANGLE * (double)i),
                   z);
}

enum pattern { DISC, GRID, FAN };

/* Point i of n in the unit disc, the square +-1, or on the line +-1. */
static imp_v3 pattern_point(enum pattern p, int64_t i, int64_t n)
{
    const double u = ((double)i + 0.5) / (double)n;
    switch (p) {
    case DISC:
        return imp__v3(sqrt(u) * cos(GOLDEN_ANGLE * (double)i),
                       sqrt(u) * sin(GOLDEN_ANGLE * (double)i), 0);
    case GRID: {
        const int64_t side = (int64_t)ceil(sqrt((double)n) - 1e-9);
        return imp__v3(2 * ((double)(i % side) + 0.5) / (double)side - 1,
                       2 * ((double)(i / side) + 0.5) / (double)side - 1, 0);
    }
    case FAN: return imp__v3(2 * u - 1, 0, 0);
    }
    return (imp_v3){0};
}

struct bundle {
    bool point;
    enum pattern pattern;
    int64_t count;
    double radius, start, on_sphere, angle;
};

static void bundle_rays(const struct bundle *b, const struct imp__bendfile_frame *f,
                        double (*x)[3], double (*d)[3])
{
    for (int64_t i = 0; i < b->count; i++) {
        const imp_v3 q = pattern_point(b->pattern, i, b->count);
        imp_v3 p = {0}, v = imp__v3(0, 0, 1);
        if (b->point) { /* equal solid angles in a cone; a fan has equal angles */
            p[2] = b->start;
            const double r = sqrt(imp__dot(q, q));
            if (b->pattern == FAN) {
                v = imp__v3(sin(b->angle * q[0]), 0, cos(b->angle * q[0]));
            } else {
                const double c = 1 - imp_min(r * r, 1.0) * (1 - cos(b->angle));
                const double s = sqrt(fmax(0, 1 - c * c));
                v = r > 0 ? imp__v3(s * q[0] / r, s * q[1] / r, c) : v;
            }
        } else {
            p = q * b->radius;
            const double r2 = imp__dot(p, p);
            p[2] = b->on_sphere > 0 ? -sqrt(fmax(0, b->on_sphere * b->on_sphere - r2))
                                    : b->start;
        }
        imp__v3_store(imp__bendfile_point(f, p), x[i]);
        imp__v3_store(imp__bendfile_direction(f, v), d[i]);
    }
}

static enum imp_status bundle_add(struct imp__bendfile *l, struct imp_node *node,
                                  const struct bundle *b,
                                  const struct imp__bendfile_frame *f, double um)
{
    enum imp_status st = IMP_OK;
    double(*x)[3] = imp__alloc(l->ctx, (size_t)b->count, sizeof *x);
    double(*d)[3] = imp__alloc(l->ctx, (size_t)b->count, sizeof *d);
    int bundle;
    if (!x || !d) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for rays"));
    bundle_rays(b, f, x, d);
    IMP_TRY(imp_bend_add_rays(l->bend, (size_t)b->count, (const double(*)[3])x,
                              (const double(*)[3])d, NULL, &bundle));
    if (um > 0) {
        st = imp_bend_set_wavelength(l->bend, bundle, &l->dispersion, um);
        if (st == IMP_E_ARG)
            st = imp__node_error(l->ctx, node, IMP_E_SCENE, "no index at %g um", um);
        if (st != IMP_OK) goto out;
    }
    void *grown = imp__grow(l->ctx, l->frames, &l->cap_frames, (size_t)bundle + 1,
                            sizeof *l->frames);
    if (grown) l->frames = grown;
    void *nodes =
        imp__grow(l->ctx, l->nodes, &l->cap_nodes, (size_t)bundle + 1, sizeof *l->nodes);
    if (nodes) l->nodes = nodes;
    if (!grown || !nodes) IMP_TRY(imp__error(l->ctx, IMP_E_NOMEM, "no memory for rays"));
    l->frames[bundle] = *f;
    l->nodes[bundle] = node;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "surface") != 0) continue;
        c->used = true;
        IMP_TRY(imp__bendfile_surface(l, c->node, f, bundle));
    }
out:
    imp__release(l->ctx, x);
    imp__release(l->ctx, d);
    return st;
}

#define WAVELENGTHS_MAX 64

/* "0.486 0.588 0.656": micrometres; none: 0, the reference. */
static enum imp_status wavelengths_read(struct imp__bendfile *l, struct imp_node *node,
                                        double um[WAVELENGTHS_MAX], int *n)
{
    const char *text;
    const enum imp_status st =
        imp__props_string(l->ctx, node, "wavelengths", NULL, &text);
    *n = 0;
    um[0] = 0;
    if (st != IMP_OK || !text) return st;
    if (!l->dispersive)
        return imp__node_error(
            l->ctx, node, IMP_E_SCENE,
            "has wavelengths, and the medium none of 'cauchy', 'glass' and "
            "'sellmeier_b'");
    const char *end = text + strlen(text);
    for (;;) {
        text += strspn(text, " ,");
        if (*text == 0 && *n > 0) return IMP_OK;
        if (*n == WAVELENGTHS_MAX || !imp__number(&text, end, &um[*n]) ||
            !(um[*n] >= 0.01 && um[*n] <= 1000))
            return imp__prop_error(l->ctx, node, imp__node_prop(node, "wavelengths"),
                                   IMP_E_SCENE, "1 to %d wavelengths of 0.01 to 1000 um",
                                   WAVELENGTHS_MAX);
        ++*n;
    }
}

enum imp_status imp__bendfile_rays(struct imp__bendfile *l, struct imp_node *node)
{
    static const char *const patterns[] = {"disc", "grid", "fan"};
    enum imp_status st = IMP_OK;
    struct bundle b = {0};
    const double zero[3] = {0}, z[3] = {0, 0, 1};
    double origin[3], direction[3], degrees;
    int64_t directions, views;
    int pattern, n_um;
    double um[WAVELENGTHS_MAX];
    b.point = strcmp(node->type, "point") == 0;
    if (!b.point && strcmp(node->type, "beam") != 0)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "is of no known type: there are beam "
                                "and point"));
    IMP_TRY(imp__props_choice(l->ctx, node, "pattern", patterns, 3, 0, &pattern));
    IMP_TRY(imp__props_int(l->ctx, node, "count", 1000, 1, RAYS_MAX, &b.count));
    IMP_TRY(imp__props_vector(l->ctx, node, "origin", zero, origin));
    IMP_TRY(imp__props_vector(l->ctx, node, "direction", z, direction));
    IMP_TRY(imp__props_int(l->ctx, node, "directions", 0, 0, 60000, &directions));
    IMP_TRY(imp__props_int(l->ctx, node, "views", 0, 0, 60000, &views));
    IMP_TRY(imp__bendfile_number(l, node, "start", b.point ? 0 : -1, -1e300, 1e300,
                                 &b.start));
    b.pattern = (enum pattern)pattern;
    if (b.point) {
        IMP_TRY(imp__bendfile_number(l, node, "angle", 10, 0, 180, &degrees));
        b.angle = degrees * IMP_PI / 180;
    } else {
        IMP_TRY(imp__bendfile_number(l, node, "radius", 1, 0, 1e300, &b.radius));
        IMP_TRY(imp__bendfile_number(l, node, "on_sphere", 0, 0, 1e300, &b.on_sphere));
        if (b.on_sphere > 0 && b.on_sphere < b.radius)
            IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                    "starts on a sphere of radius %g "
                                    "and is %g wide",
                                    b.on_sphere, b.radius));
    }
    if (!(imp__length(imp__v3_load(direction)) > 0))
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE, "has no direction"));
    IMP_TRY(wavelengths_read(l, node, um, &n_um));
    const int64_t n = directions > 0 ? directions : views > 0 ? views : 1;
    const int64_t all = n * imp_max(n_um, 1) * b.count + (int64_t)l->bend->n;
    if (all > RAYS_MAX)
        IMP_TRY(imp__node_error(l->ctx, node, IMP_E_SCENE,
                                "makes %lld rays in all: at most %d are read from a file",
                                (long long)all, RAYS_MAX));
    for (int64_t i = 0; i < n; i++) {
        imp_v3 dir = imp__v3_load(direction);
        if (directions > 0) {
            dir = sphere_point(i, n);
        } else if (views > 0) { /* over half a turn about y */
            const double a = IMP_PI * (double)i / (double)n;
            dir = imp__v3(sin(a), 0, cos(a));
        }
        const struct imp__bendfile_frame f = frame_of(imp__v3_load(origin), dir);
        for (int k = 0; k < imp_max(n_um, 1); k++)
            IMP_TRY(bundle_add(l, node, &b, &f, um[k]));
    }
out:
    return st;
}
