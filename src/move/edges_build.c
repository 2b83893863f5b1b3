/* SPDX-License-Identifier: Apache-2.0
 *
 * Makes the list of edges (edges.h): the sides of all triangles, sorted by the line on which they
 * lie; along each line they are cut where one begins or ends, and what lies between two cuts is
 * one edge with the faces of all sides that cover it. */
#include "base/arguments.h"
#include "base/context.h"
#include "edges_seams.h"
#include "kind/sensor/receiver.h"
#include <stdlib.h>

#define NEAR 2e-6 /* of the scene's size: sides nearer to each other lie on each other */

/* One side of a triangle. */
struct side {
    imp_v3 a, b;
    double key;        /* the same for sides on one line, and with luck for no other */
    double from, till; /* along the line that represents them */
    size_t line;
    struct imp__edge_face face;
};

struct building {
    imp_context *ctx;
    const struct imp_scene *scene;
    imp_v3 middle;
    double near, size;
    size_t n, cap; /* sides */
    struct side *side;
    double *cut; /* [2 n] */
    size_t cap_edges, cap_laid, cap_faces;
    struct imp__edges *out;
};

/* Directions that no scene is aligned with: by the first a line gets its sense, by the second
 * the point of it that is nearest to the middle becomes a number. */
static imp_v3 sense(void) { return imp__v3(0.5377, 0.6180, 0.5736); }
static imp_v3 mark(void) { return imp__v3(-0.4423, 0.7071, -0.5515); }

static void side_add(struct building *x, const struct imp__edge_face *face, imp_v3 p,
                     imp_v3 q, imp_v3 apex)
{
    struct side *s = &x->side[x->n];
    const bool turned = imp__dot(q - p, sense()) < 0;
    s->a = turned ? q : p;
    s->b = turned ? p : q;
    const imp_v3 d = imp__normalize(s->b - s->a), r = s->a - x->middle;
    const imp_v3 in = apex - s->a, across = in - d * imp__dot(in, d);
    if (!(imp__length(s->b - s->a) > x->near) || !(imp__length(across) > 0)) return;
    s->key = imp__dot(r - d * imp__dot(r, d), mark());
    s->face = *face;
    s->face.in = imp__normalize(across);
    s->face.n = imp__normalize(imp__cross(q - p, apex - p));
    x->n++;
}

static void body_add(struct building *x, const struct imp__body *body)
{
    const struct imp_shape *s = x->scene->shapes[body->shape];
    struct imp_map map[2];
    if (s->geometry != IMP_TRIANGLES) return;
    if (body->place > 0) imp__place_map(x->scene, body->place, 0, &map[0], &map[1]);
    for (size_t j = 0; j < s->triangles.n_triangles; j++) {
        const struct imp__edge_face face = {
            .shape = body->shape, .prim = (int)j, .place = body->place};
        const struct imp__corners f = imp__corners_mapped(x->scene, body->shape, (int)j,
                                                          body->place > 0 ? map : NULL);
        for (int c = 0; c < 3; c++)
            side_add(x, &face, f.p[c], f.p[(c + 1) % 3], f.p[(c + 2) % 3]);
    }
}

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
                return imp__error(
                    x->ctx, IMP_E_UNSUPPORTED,
                    "derivatives by what moves: an instance has a motion of its own");
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
                      "derivatives by what moves are of triangles, spheres, disks and "
                      "circular cylinders, and shape '%s' (%s) %s",
                      s->name, s->ops->name, why);
}

/* How many sides there are. */
static enum imp_status sides_count(const struct building *x, size_t *n)
{
    *n = 0;
    for (size_t k = 0; k < x->out->n_bodies; k++) {
        const struct imp__body *body = &x->out->body[k];
        const struct imp_shape *s = x->scene->shapes[body->shape];
        if (imp__moves_curved(x->scene, body->shape, body->place)) continue;
        if (s->smooth && !imp__moves_smooth(x->scene, body->shape))
            return refuse(x, s, "has normals of its own over its triangles");
        if (imp__moves_curved(x->scene, body->shape, 0))
            return refuse(x, s, "is stretched by its instance");
        if (s->geometry != IMP_TRIANGLES) return refuse(x, s, "is none");
        *n += 3 * s->triangles.n_triangles;
    }
    return IMP_OK;
}

static enum imp_status sides_make(struct building *x)
{
    size_t n;
    IMP_CHECKED(bodies_list(x));
    IMP_CHECKED(sides_count(x, &n));
    x->side = imp__alloc(x->ctx, n + 1, sizeof *x->side);
    x->cut = imp__alloc(x->ctx, 2 * n + 1, sizeof *x->cut);
    if (!x->side || !x->cut)
        return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    for (size_t k = 0; k < x->out->n_bodies; k++) body_add(x, &x->out->body[k]);
    return IMP_OK;
}

static int by_key(const void *a, const void *b)
{
    const struct side *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    if (x->face.shape != y->face.shape) return x->face.shape < y->face.shape ? -1 : 1;
    if (x->face.place != y->face.place) return x->face.place < y->face.place ? -1 : 1;
    return x->face.prim < y->face.prim ? -1 : x->face.prim > y->face.prim;
}
static int by_line(const void *a, const void *b)
{
    const struct side *x = a, *y = b;
    if (x->line != y->line) return x->line < y->line ? -1 : 1;
    return x->from != y->from ? (x->from < y->from ? -1 : 1) : by_key(a, b);
}
static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double off_line(const struct side *line, imp_v3 p)
{
    const imp_v3 d = imp__normalize(line->b - line->a), r = p - line->a;
    return imp__length(r - d * imp__dot(r, d));
}

/* Sides on one line get its number: the first of them in the order of keys. */
static void lines_find(struct building *x)
{
    /* A side's own length tells its direction to near/length, and with the way to the middle
     * that moves the key. */
    const double window = 1e-5 * x->size;
    for (size_t k = 0; k < x->n; k++) x->side[k].line = SIZE_MAX;
    for (size_t k = 0; k < x->n; k++) {
        struct side *line = &x->side[k];
        if (line->line != SIZE_MAX) continue;
        const imp_v3 d = imp__normalize(line->b - line->a);
        for (size_t j = k; j < x->n && x->side[j].key - line->key <= window; j++) {
            struct side *s = &x->side[j];
            if (s->line != SIZE_MAX || off_line(line, s->a) > x->near ||
                off_line(line, s->b) > x->near)
                continue;
            s->line = k;
            s->from = imp__dot(s->a - line->a, d);
            s->till = imp__dot(s->b - line->a, d);
        }
    }
}

static enum imp_status edge_add(struct building *x, const struct side *first, size_t n,
                                double from, double till)
{
    struct imp__edges *out = x->out;
    const size_t before = out->n_faces;
    const struct side *long_one = NULL;
    for (size_t k = 0; k < n; k++) {
        const struct side *s = &first[k];
        if (s->from > from + x->near || s->till < till - x->near) continue;
        struct imp__edge_face *more =
            imp__grow(x->ctx, out->face, &x->cap_faces, out->n_faces + 1, sizeof *more);
        if (!more) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
        out->face = more;
        more[out->n_faces++] = s->face;
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
    const imp_v3 along =
        (long_one->b - long_one->a) * (1 / (long_one->till - long_one->from));
    more[out->n++] = (struct imp__edge){
        long_one->a + along * (imp_max(from, long_one->from) - long_one->from),
        long_one->a + along * (imp_min(till, long_one->till) - long_one->from), before,
        faces, faces == 4 && imp__edge_is_crossing(x->scene, own)};
    return IMP_OK;
}

/* All edges of one line: between each cut and the next. */
static enum imp_status line_cut(struct building *x, const struct side *first, size_t n)
{
    for (size_t k = 0; k < n; k++) {
        x->cut[2 * k] = first[k].from;
        x->cut[2 * k + 1] = first[k].till;
    }
    qsort(x->cut, 2 * n, sizeof *x->cut, by_value);
    double from = x->cut[0];
    for (size_t k = 1; k < 2 * n; k++) {
        if (!(x->cut[k] - from > x->near)) continue;
        /* The sides that may cover it: sorted by their beginning. */
        size_t lo = 0, hi = 0;
        while (hi < n && first[hi].from <= from + x->near) hi++;
        while (lo < hi && first[lo].till < x->cut[k] - x->near) lo++;
        const enum imp_status st = edge_add(x, first + lo, hi - lo, from, x->cut[k]);
        if (st != IMP_OK) return st;
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
    IMP_CHECKED(imp__seams_find(x->scene, x->out->body, x->out->n_bodies, x->near,
                                x->size, &seams));
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < seams.n && st == IMP_OK; k++)
        st = seam_take(x, &seams.seam[k]);
    imp__seams_free(&seams);
    return st;
}

/* ---- Order of the list --------------------------------------------------------------- */

/* An edge and where the middle of it is on Morton's curve through the scene's box. */
struct placed {
    uint64_t code;
    struct imp__edge edge;
};

static int by_code(const void *a, const void *b)
{
    const struct placed *x = a, *y = b;
    if (x->code != y->code) return x->code < y->code ? -1 : 1;
    return x->edge.first < y->edge.first ? -1 : x->edge.first > y->edge.first;
}

static enum imp_status edges_order(struct building *x)
{
    struct imp__edges *out = x->out;
    struct placed *placed = imp__alloc(x->ctx, out->n + 1, sizeof *placed);
    if (!placed) return imp__error(x->ctx, IMP_E_NOMEM, "no memory for edges");
    for (size_t k = 0; k < out->n; k++) {
        const imp_v3 r = (out->edge[k].a + out->edge[k].b) * 0.5 - x->middle;
        placed[k].edge = out->edge[k];
        for (int bit = 19; bit >= 0; bit--)
            for (int i = 0; i < 3; i++) {
                const double at = imp_clamp(r[i] / x->size + 0.5, 0.0, 1.0);
                const uint32_t cell = (uint32_t)(at * 1048575);
                placed[k].code = placed[k].code << 1 | (cell >> bit & 1);
            }
    }
    qsort(placed, out->n, sizeof *placed, by_code);
    for (size_t k = 0; k < out->n; k++) out->edge[k] = placed[k].edge;
    imp__release(x->ctx, placed);
    return IMP_OK;
}

enum imp_status imp__edges_build(const struct imp_scene *scene, enum imp__edges_of of,
                                 struct imp__edges *out)
{
    enum imp_status st = IMP_OK;
    struct building x = {.ctx = scene->ctx, .scene = scene, .out = out};
    *out = (struct imp__edges){.ctx = scene->ctx, .of = of};
    x.middle = (scene->lo + scene->hi) * 0.5;
    x.size = imp__length(scene->hi - scene->lo);
    x.near = NEAR * x.size;
    IMP_TRY(sides_make(&x));
    qsort(x.side, x.n, sizeof *x.side, by_key);
    lines_find(&x);
    qsort(x.side, x.n, sizeof *x.side, by_line);
    for (size_t k = 0, n; k < x.n; k += n) {
        for (n = 1; k + n < x.n && x.side[k + n].line == x.side[k].line;) n++;
        IMP_TRY(line_cut(&x, &x.side[k], n));
    }
    IMP_TRY(seams_add(&x));
    IMP_TRY(edges_order(&x));
    IMP_TRY(imp__arcs_find(scene, out));
out:
    imp__release(x.ctx, x.side);
    imp__release(x.ctx, x.cut);
    if (st != IMP_OK) imp__edges_free(out);
    return st;
}
