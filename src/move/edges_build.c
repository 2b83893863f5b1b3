/* SPDX-License-Identifier: Apache-2.0
 *
 * Makes the list of edges (edges.h): the sides of all triangles by the line on which they lie
 * (edges_sides.h); along each line they are cut where one begins or ends, and what lies between two
 * cuts is one edge with the faces of all sides that cover it. */
#include "base/arguments.h"
#include "base/context.h"
#include "base/radix.h"
#include "edges_seams.h"
#include "edges_sides.h"
#include "kind/sensor/receiver.h"
#include "strand.h"
#include <stdlib.h>

#define NEAR 2e-6 /* of the scene's size: sides nearer to each other lie on each other */

struct building {
    imp_context *ctx;
    const struct imp_scene *scene;
    struct imp__sides sides;
    double *cut; /* [2 sides] */
    size_t cap_edges, cap_laid, cap_faces;
    struct imp__edges *out;
};

static int64_t places(const struct imp_scene *scene)
{
    return scene->world ? scene->world->n_places : 0;
}

static enum imp_status bodies_take(struct building *x, size_t n)
{
    if (x->out->body || n == 0) return IMP_OK;
    x->out->body = imp__alloc(x->ctx, n, sizeof *x->out->body);
    return x->out->body ? IMP_OK : imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
}

static bool is_among(const struct building *x, const struct imp_shape *s)
{
    const enum imp__edges_of of = x->out->of;
    if (of == IMP_EDGES_ALL) return true;
    const bool border = imp__is_border(x->scene, s);
    return of == IMP_EDGES_BUT_BORDERS ? !border : border || s->emitter >= 0;
}

/* All bodies: they are counted, then listed. */
static enum imp_status bodies_list(struct building *x)
{
    const struct imp_scene *scene = x->scene;
    for (int pass = 0; pass < 2; pass++) {
        size_t n = 0;
        for (int k = 0; k < imp__shapes_outside(scene); k++) {
            const struct imp_shape *s = scene->shapes[k];
            if (imp__shape_is_absent(s) || !is_among(x, s)) continue;
            if (pass) x->out->body[n] = (struct imp__body){k, 0};
            n++;
        }
        /* In instances neither is a border nor a lamp. */
        const bool alone = x->out->of == IMP_EDGES_LAMPS_BORDERS;
        for (int64_t place = 1; place <= places(scene) && !alone; place++) {
            const struct imp_group *g = imp__place_group(scene, place);
            if (!g)
                return imp__error(x->ctx, IMP_E_UNSUPPORTED,
                                  "derivatives by what moves: in a group an instance "
                                  "moves in time");
            for (int k = g->first; k < g->first + g->n_shapes; k++, n++)
                if (pass) x->out->body[n] = (struct imp__body){k, place};
        }
        IMP_CHECKED(bodies_take(x, n));
        x->out->n_bodies = n;
    }
    return IMP_OK;
}

static enum imp_status refuse(const struct building *x, const struct imp_shape *s,
                              const char *why)
{
    return imp__error(x->ctx, IMP_E_UNSUPPORTED,
                      "derivatives by what moves are of triangles, spheres, disks, "
                      "circular cylinders and bsplinecurves, and shape '%s' (%s) %s",
                      s->name, s->ops->name, why);
}

/* Are all shapes some whose edges are known? */
static enum imp_status bodies_allowed(const struct building *x)
{
    for (size_t k = 0; k < x->out->n_bodies; k++) {
        const struct imp__body *body = &x->out->body[k];
        const struct imp_shape *s = x->scene->shapes[body->shape];
        if (imp__is_strand(x->scene, body->shape, body->place) &&
            imp__strand_folds(x->scene, body->shape, body->place) >= 0)
            return refuse(x, s, "bends more sharply than its radius allows");
        if (imp__moves_curved(x->scene, body->shape, body->place)) continue;
        if (s->smooth && !imp__moves_smooth(x->scene, body->shape))
            return refuse(x, s, "has normals of its own over its triangles");
        if (imp__moves_curved(x->scene, body->shape, 0))
            return refuse(x, s, "is stretched by its instance");
        if (s->geometry != IMP_TRIANGLES) return refuse(x, s, "is none");
    }
    return IMP_OK;
}

/* Room for what a closed surface has. What is not used is not written, and takes no memory. */
static enum imp_status room_make(struct building *x)
{
    const size_t n = x->sides.n;
    x->cut = imp__alloc_raw(x->ctx, 2 * n, sizeof *x->cut);
    x->cap_faces = n;
    x->out->face = imp__alloc_raw(x->ctx, n, sizeof *x->out->face);
    x->cap_edges = n / 2 + 1;
    x->out->edge = imp__alloc_raw(x->ctx, x->cap_edges, sizeof *x->out->edge);
    return x->cut && x->out->face && x->out->edge
               ? IMP_OK
               : imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void cuts_sort(double *cut, size_t n)
{
    enum { FEW = 16 };
    if (n > FEW) {
        qsort(cut, n, sizeof *cut, by_value);
        return;
    }
    for (size_t k = 1; k < n; k++) {
        const double own = cut[k];
        size_t j = k;
        for (; j > 0 && cut[j - 1] > own; j--) cut[j] = cut[j - 1];
        cut[j] = own;
    }
}

static enum imp_status edge_add(struct building *x, struct imp__side *const *side,
                                size_t n, double from, double till)
{
    struct imp__edges *out = x->out;
    const double near = x->sides.near;
    const size_t before = out->n_faces;
    const struct imp__side *long_one = NULL;
    for (size_t k = 0; k < n; k++) {
        const struct imp__side *s = side[k];
        if (s->from > from + near || s->till < till - near) continue;
        struct imp__edge_face *more =
            imp__grow(x->ctx, out->face, &x->cap_faces, out->n_faces + 1, sizeof *more);
        if (!more) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
        out->face = more;
        more[out->n_faces++] = imp__side_face(&x->sides, s);
        if (!long_one || s->till - s->from > long_one->till - long_one->from)
            long_one = s;
    }
    const int faces = (int)(out->n_faces - before);
    struct imp__edge_face *own = out->face + before;
    if (faces == 0 || (faces == 2 && imp__edge_is_inner(x->scene, own))) {
        out->n_faces = before;
        return IMP_OK;
    }
    struct imp__edge *more =
        imp__grow(x->ctx, out->edge, &x->cap_edges, out->n + 1, sizeof *more);
    if (!more) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    out->edge = more;
    const imp_v3 a = imp__side_a(long_one),
                 along = (imp__side_b(long_one) - a) *
                         (1 / (long_one->till - long_one->from));
    more[out->n++] = (struct imp__edge){
        a + along * (imp_max(from, long_one->from) - long_one->from),
        a + along * (imp_min(till, long_one->till) - long_one->from), before, faces,
        faces == 4 && imp__edge_is_crossing(x->scene, own)};
    return IMP_OK;
}

/* All edges of one line: between each cut and the next. */
static enum imp_status line_cut(void *payload, struct imp__side *const *side, size_t n)
{
    struct building *x = payload;
    const double near = x->sides.near;
    for (size_t k = 0; k < n; k++) {
        x->cut[2 * k] = side[k]->from;
        x->cut[2 * k + 1] = side[k]->till;
    }
    cuts_sort(x->cut, 2 * n);
    double from = x->cut[0];
    for (size_t k = 1; k < 2 * n; k++) {
        if (!(x->cut[k] - from > near)) continue;
        /* The sides that may cover it: sorted by their beginning. */
        size_t lo = 0, hi = 0;
        while (hi < n && side[hi]->from <= from + near) hi++;
        while (lo < hi && side[lo]->till < x->cut[k] - near) lo++;
        IMP_CHECKED(edge_add(x, side + lo, hi - lo, from, x->cut[k]));
        from = x->cut[k];
    }
    return IMP_OK;
}

/* ---- Seams ------------------------------------------------------------------------------ */

static enum imp_status seam_take(struct building *x, const struct imp__seam *seam)
{
    struct imp__edges *out = x->out;
    struct imp__edge_face *faces =
        imp__grow(x->ctx, out->face, &x->cap_faces, out->n_faces + 4, sizeof *faces);
    if (faces) out->face = faces;
    struct imp__edge **list = seam->laid ? &out->laid : &out->edge;
    size_t *n = seam->laid ? &out->n_laid : &out->n;
    struct imp__edge *more = imp__grow(
        x->ctx, *list, seam->laid ? &x->cap_laid : &x->cap_edges, *n + 1, sizeof *more);
    if (more) *list = more;
    if (!faces || !more) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    more[(*n)++] = (struct imp__edge){seam->a, seam->b, out->n_faces, 4, !seam->laid};
    for (int k = 0; k < 4; k++) faces[out->n_faces++] = seam->face[k];
    return IMP_OK;
}

static enum imp_status seams_add(struct building *x)
{
    struct imp__seams seams;
    IMP_CHECKED(imp__seams_find(x->scene, x->out->body, x->out->n_bodies, x->sides.near,
                                x->sides.size, &seams));
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < seams.n && st == IMP_OK; k++)
        st = seam_take(x, &seams.seam[k]);
    imp__seams_free(&seams);
    return st;
}

/* ---- Order of the list --------------------------------------------------------------- */

/* Where the middle of an edge is on Morton's curve through the scene's box. */
static uint64_t code_of(const struct building *x, const struct imp__edge *e)
{
    const imp_v3 r = (e->a + e->b) * 0.5 - x->sides.middle;
    uint32_t cell[3];
    uint64_t code = 0;
    for (int i = 0; i < 3; i++)
        cell[i] = (uint32_t)(imp_clamp(r[i] / x->sides.size + 0.5, 0.0, 1.0) * 1048575);
    for (int bit = 19; bit >= 0; bit--)
        for (int i = 0; i < 3; i++) code = code << 1 | (cell[i] >> bit & 1);
    return code;
}

/* The instance that moves an edge in time, -1: none. imp__clocks_allowed refuses edges whose faces have
 * two. */
static int clock_of(const struct building *x, const struct imp__edge *e)
{
    return imp__place_clock(x->scene, x->out->face[e->first].place);
}

/* Edges of each run behind each other, in their order. */
static enum imp_status runs_make(struct building *x, struct imp_keyed *keyed)
{
    const struct imp_scene *scene = x->scene;
    struct imp__edges *out = x->out;
    const size_t n = out->n;
    size_t most = 0;
    for (int k = 0; scene->world && k < scene->world->n_instances; k++)
        most += scene->world->instance[k].motion != NULL;
    out->run = imp__alloc(x->ctx, most + 2, sizeof *out->run);
    if (!out->run) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    out->n_runs = 1;
    out->run[0].instance = -1;
    out->run[1].first = n;
    if (most == 0) return IMP_OK;
    for (size_t k = 0; k < n; k++)
        keyed[k].key = (uint64_t)(clock_of(x, &out->edge[keyed[k].value]) + 1);
    imp__radix_sort(keyed, n, keyed + n);
    for (size_t k = 0; k < n; k++) {
        const int clock = (int)keyed[k].key - 1;
        if (clock == out->run[out->n_runs - 1].instance) continue;
        out->run[out->n_runs++] = (struct imp__edge_run){k, clock};
    }
    out->run[out->n_runs].first = n;
    return IMP_OK;
}

static void faces_move(const struct imp__edges *out, struct imp__edge_face *to, size_t *n,
                       struct imp__edge *e)
{
    for (int k = 0; k < e->n_faces; k++)
        to[*n + (size_t)k] = out->face[e->first + (size_t)k];
    e->first = *n;
    *n += (size_t)e->n_faces;
}

/* Edges along the curve, and their faces as they are. */
static enum imp_status edges_order(struct building *x)
{
    struct imp__edges *out = x->out;
    const size_t n = out->n;
    struct imp_keyed *keyed = imp__alloc_raw(x->ctx, 2 * n, sizeof *keyed);
    struct imp__edge_face *face = imp__alloc_raw(x->ctx, out->n_faces, sizeof *face);
    const bool fits = keyed && face;
    enum imp_status st =
        fits ? IMP_OK : imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    for (size_t k = 0; k < n && fits; k++)
        keyed[k] = (struct imp_keyed){code_of(x, &out->edge[k]), k};
    if (fits) {
        size_t n_faces = 0;
        struct imp__edge spare;
        imp__radix_sort(keyed, n, keyed + n);
        st = runs_make(x, keyed);
        imp__keyed_order(keyed, n, out->edge, sizeof *out->edge, &spare);
        for (size_t k = 0; k < n; k++) faces_move(out, face, &n_faces, &out->edge[k]);
        for (size_t k = 0; k < out->n_laid; k++)
            faces_move(out, face, &n_faces, &out->laid[k]);
        imp__release(x->ctx, out->face);
        out->face = face;
    } else {
        imp__release(x->ctx, face);
    }
    imp__release(x->ctx, keyed);
    return st;
}

enum imp_status imp__edges_build(const struct imp_scene *scene, enum imp__edges_of of,
                                 struct imp__edges *out)
{
    enum imp_status st = IMP_OK;
    const double size = imp__length(scene->hi - scene->lo);
    struct building x = {.ctx = scene->ctx,
                         .scene = scene,
                         .sides = {.scene = scene,
                                   .middle = (scene->lo + scene->hi) * 0.5,
                                   .near = NEAR * size,
                                   .size = size},
                         .out = out};
    *out = (struct imp__edges){.ctx = scene->ctx, .of = of};
    IMP_TRY(bodies_list(&x));
    IMP_TRY(bodies_allowed(&x));
    IMP_TRY(imp__sides_make(&x.sides, out->body, out->n_bodies));
    IMP_TRY(room_make(&x));
    IMP_TRY(imp__lines_find(&x.sides, line_cut, &x));
    imp__sides_free(&x.sides); /* the largest of all, before there are more */
    imp__release(x.ctx, x.cut);
    x.cut = NULL;
    IMP_TRY(seams_add(&x));
    IMP_TRY(edges_order(&x));
    IMP_TRY(imp__arcs_find(scene, out));
    IMP_TRY(imp__clocks_allowed(out, scene));
out:
    imp__sides_free(&x.sides);
    imp__release(x.ctx, x.cut);
    if (st != IMP_OK) imp__edges_free(out);
    return st;
}
