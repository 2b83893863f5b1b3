/* SPDX-License-Identifier: Apache-2.0
 *
 * Sides are sorted by keys, in whose order they are put then; the first of them that has no line yet is
 * one, and takes those that lie on it (edges_sides.h). */
#include "edges_sides.h"
#include "base/arguments.h"
#include "base/context.h"
#include "base/radix.h"
#include <stdlib.h>

/* Directions that no scene is aligned with: by the first a line gets its sense, by the second
 * the point of it that is nearest to the middle becomes a number. */
static imp_v3 sense(void) { return imp__v3(0.5377, 0.6180, 0.5736); }
static imp_v3 mark(void) { return imp__v3(-0.4423, 0.7071, -0.5515); }

/* A side with its triangle. */
struct ends {
    imp_v3 a, b;       /* along the line */
    imp_v3 p, q, apex; /* as the triangle has them */
};

static struct imp__corners corners_of(const struct imp__sides *x, uint32_t body,
                                      uint32_t prim)
{
    const struct imp__body *on = &x->body[body];
    return imp__corners_mapped(x->scene, on->shape, (int)prim,
                               on->place > 0 ? x->map[body] : NULL);
}

static struct ends ends_of(const struct imp__corners *f, int corner)
{
    struct ends e = {
        .p = f->p[corner], .q = f->p[(corner + 1) % 3], .apex = f->p[(corner + 2) % 3]};
    const bool turned = imp__dot(e.q - e.p, sense()) < 0;
    e.a = turned ? e.q : e.p;
    e.b = turned ? e.p : e.q;
    return e;
}

/* False: it is a point, or its triangle is a line. */
static bool key_find(const struct imp__sides *x, const struct ends *e, double *key)
{
    const imp_v3 d = imp__normalize(e->b - e->a), r = e->a - x->middle;
    const imp_v3 in = e->apex - e->a, across = in - d * imp__dot(in, d);
    *key = imp__dot(r - d * imp__dot(r, d), mark());
    return imp__length(e->b - e->a) > x->near && imp__length(across) > 0;
}

struct imp__edge_face imp__side_face(const struct imp__sides *x,
                                     const struct imp__side *side)
{
    const struct imp__corners f = corners_of(x, side->body, side->prim);
    const struct ends e = ends_of(&f, side->corner);
    const imp_v3 d = imp__normalize(e.b - e.a), in = e.apex - e.a;
    return (struct imp__edge_face){
        .shape = x->body[side->body].shape,
        .prim = (int)side->prim,
        .place = x->body[side->body].place,
        .in = imp__normalize(in - d * imp__dot(in, d)),
        .n = imp__normalize(imp__cross(e.q - e.p, e.apex - e.p))};
}

static enum imp_status no_memory(const struct imp__sides *x)
{
    return imp__error(x->scene->ctx, IMP_E_NOMEM, "no memory for edges");
}

static int by_shape(const void *a, const void *b)
{
    const struct imp__body *x = a, *y = b;
    if (x->shape != y->shape) return x->shape < y->shape ? -1 : 1;
    return x->place < y->place ? -1 : x->place > y->place;
}

/* Returns how many sides they have. */
static enum imp_status bodies_take(struct imp__sides *x, const struct imp__body *body,
                                   size_t n_bodies, size_t *n_sides)
{
    imp_context *ctx = x->scene->ctx;
    bool placed = false;
    *n_sides = 0;
    x->body = imp__alloc_raw(ctx, n_bodies, sizeof *x->body);
    if (!x->body) return no_memory(x);
    for (size_t k = 0; k < n_bodies; k++) {
        const struct imp_shape *s = x->scene->shapes[body[k].shape];
        if (s->geometry != IMP_TRIANGLES) continue;
        x->body[x->n_bodies++] = body[k];
        placed |= body[k].place > 0;
        *n_sides += 3 * s->triangles.n_triangles;
    }
    qsort(x->body, x->n_bodies, sizeof *x->body, by_shape);
    if (!placed) return IMP_OK;
    x->map = imp__alloc(ctx, x->n_bodies, sizeof *x->map);
    if (!x->map) return no_memory(x);
    for (size_t k = 0; k < x->n_bodies; k++)
        if (x->body[k].place > 0)
            imp__place_map(x->scene, x->body[k].place, 0, &x->map[k][0], &x->map[k][1]);
    return IMP_OK;
}

/* Sets n. */
static void sides_list(struct imp__sides *x, struct imp_keyed *keyed)
{
    for (size_t k = 0; k < x->n_bodies; k++) {
        const struct imp_shape *s = x->scene->shapes[x->body[k].shape];
        for (size_t j = 0; j < s->triangles.n_triangles; j++) {
            const struct imp__corners f = corners_of(x, (uint32_t)k, (uint32_t)j);
            for (int c = 0; c < 3; c++) {
                const struct ends e = ends_of(&f, c);
                double key;
                if (!key_find(x, &e, &key)) continue;
                x->side[x->n] = (struct imp__side){.a = {e.a[0], e.a[1], e.a[2]},
                                                   .b = {e.b[0], e.b[1], e.b[2]},
                                                   .key = key,
                                                   .body = (uint32_t)k,
                                                   .prim = (uint32_t)j,
                                                   .corner = (uint8_t)c};
                keyed[x->n] = (struct imp_keyed){imp__radix_key(key), x->n};
                x->n++;
            }
        }
    }
}

enum imp_status imp__sides_make(struct imp__sides *x, const struct imp__body *body,
                                size_t n_bodies)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = x->scene->ctx;
    struct imp_keyed *keyed = NULL;
    struct imp__side spare;
    size_t n;
    IMP_TRY(bodies_take(x, body, n_bodies, &n));
    x->side = imp__alloc_raw(ctx, n, sizeof *x->side);
    keyed = imp__alloc_raw(ctx, 2 * n, sizeof *keyed);
    if (!x->side || !keyed) IMP_TRY(no_memory(x));
    sides_list(x, keyed);
    imp__radix_sort(keyed, x->n, keyed + n);
    imp__keyed_order(keyed, x->n, x->side, sizeof *x->side, &spare);
out:
    imp__release(ctx, keyed);
    return st;
}

void imp__sides_free(struct imp__sides *x)
{
    imp_context *ctx = x->scene->ctx;
    imp__release(ctx, x->body);
    imp__release(ctx, x->map);
    imp__release(ctx, x->side);
    x->body = NULL;
    x->map = NULL;
    x->side = NULL;
}

/* ---- Lines ------------------------------------------------------------------------------ */

static double off_line(imp_v3 a, imp_v3 d, imp_v3 p)
{
    const imp_v3 r = p - a;
    return imp__length(r - d * imp__dot(r, d));
}

static int by_from(const void *a, const void *b)
{
    const struct imp__side *x = *(struct imp__side *const *)a,
                           *y = *(struct imp__side *const *)b;
    return x->from != y->from ? (x->from < y->from ? -1 : 1) : x < y ? -1 : x > y;
}

static void line_sort(struct imp__side **on, size_t n)
{
    enum { FEW = 16 };
    if (n > FEW) {
        qsort(on, n, sizeof *on, by_from);
        return;
    }
    for (size_t k = 1; k < n; k++) {
        struct imp__side *const s = on[k];
        size_t j = k;
        for (; j > 0 && on[j - 1]->from > s->from; j--) on[j] = on[j - 1];
        on[j] = s;
    }
}

enum imp_status imp__lines_find(struct imp__sides *x, imp__line_work *work, void *payload)
{
    /* A side's own length tells its direction to near/length, and with the way to the middle
     * that moves the key. */
    const double window = 1e-5 * x->size;
    enum imp_status st = IMP_OK;
    struct imp__side **on =
        imp__alloc_raw(x->scene->ctx, x->n, sizeof(struct imp__side *));
    if (!on) return no_memory(x);
    for (size_t k = 0; k < x->n && st == IMP_OK; k++) {
        if (x->side[k].taken) continue;
        const double key = x->side[k].key;
        const imp_v3 a = imp__side_a(&x->side[k]),
                     d = imp__normalize(imp__side_b(&x->side[k]) - a);
        size_t n = 0;
        for (size_t j = k; j < x->n && x->side[j].key - key <= window; j++) {
            struct imp__side *s = &x->side[j];
            if (s->taken || off_line(a, d, imp__side_a(s)) > x->near ||
                off_line(a, d, imp__side_b(s)) > x->near)
                continue;
            s->taken = true;
            s->from = imp__dot(imp__side_a(s) - a, d);
            s->till = imp__dot(imp__side_b(s) - a, d);
            on[n++] = s;
        }
        line_sort(on, n);
        st = work(payload, on, n);
    }
    imp__release(x->scene->ctx, on);
    return st;
}
