/* SPDX-License-Identifier: Apache-2.0
 *
 * Pairs of bodies whose boxes pass through each other, of these the pairs of triangles that cross, and
 * of these the segments in which they do (edges_seams.h).
 *
 * Where a side of a triangle lies in another one's plane, as of a mesh that has vertices where it is
 * crossed, the two triangles alone do not cross: with the triangle on the other side of that side, they
 * do. What has both on one side stands on the surface: that side is an edge of its own, and no seam. */
#include "edges_seams.h"
#include "base/arguments.h"
#include "base/context.h"
#include "body_tree.h"
#include <stdlib.h>

/* Contacts: triangles whose boxes are so far from each other do not touch, as near as they are taken
 * to. */
#define APART 4

/* A side of a triangle that lies in another one, as far as it does. */
struct lying {
    imp_v3 a, b;
    size_t body, other;
    struct imp__edge_face face, in_other;
    int side; /* of the other's normal, on which the triangle is */
};

struct boxed {
    imp_v3 lo, hi;
    size_t body;
};

struct seeking {
    const struct imp_scene *scene;
    const struct imp__body *body;
    double near, contact;
    struct imp__seams *out;
    struct imp__body_tree *tree; /* [n_bodies] as they are needed */
    size_t f, g;                 /* bodies of the pair */
    size_t n_lying, cap_lying;
    struct lying *lying;
};

void imp__seams_free(struct imp__seams *seams)
{
    if (seams->ctx) imp__release(seams->ctx, seams->seam);
    *seams = (struct imp__seams){0};
}

/* ---- Two triangles --------------------------------------------------------------------- */

/* A triangle against a plane: distances of its corners, 0 where they are in it. */
struct cut {
    imp_v3 n; /* of the triangle */
    double s[3], exact[3];
    int zeros;
    bool crosses;
};

static struct cut cut_by(const struct seeking *x, const struct imp__body_triangle *f,
                         imp_v3 p, imp_v3 n)
{
    struct cut c = {.n =
                        imp__normalize(imp__cross(f->p[1] - f->p[0], f->p[2] - f->p[0]))};
    int close = 0;
    bool above = false, below = false;
    for (int k = 0; k < 3; k++) {
        c.exact[k] = imp__dot(n, f->p[k] - p);
        close += fabs(c.exact[k]) <= x->contact;
    }
    for (int k = 0; k < 3; k++) {
        c.s[k] = fabs(c.exact[k]) <= (close >= 2 ? x->contact : x->near) ? 0 : c.exact[k];
        c.zeros += c.s[k] == 0;
        above |= c.s[k] > 0;
        below |= c.s[k] < 0;
    }
    c.crosses = above && below;
    return c;
}

/* Places along the line of a point and direction. */
struct interval {
    double lo, hi;
};
static void interval_add(struct interval *i, double at)
{
    i->lo = imp_min(i->lo, at);
    i->hi = imp_max(i->hi, at);
}

/* Where a triangle meets the plane that cuts it. */
static struct interval cut_interval(const struct imp__body_triangle *f,
                                    const struct cut *c, imp_v3 o, imp_v3 d)
{
    struct interval out = {INFINITY, -INFINITY};
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3;
        if (c->s[k] == 0) interval_add(&out, imp__dot(f->p[k] - o, d));
        if (!(c->s[k] * c->s[next] < 0)) continue;
        const double t = c->s[k] / (c->s[k] - c->s[next]);
        interval_add(&out, imp__dot(f->p[k] + (f->p[next] - f->p[k]) * t - o, d));
    }
    return out;
}

static struct imp__edge_face face_of(const struct imp__body *body,
                                     const struct imp__body_triangle *f, imp_v3 n,
                                     imp_v3 in)
{
    return (struct imp__edge_face){
        .shape = body->shape, .prim = f->prim, .place = body->place, .in = in, .n = n};
}

static enum imp_status seam_add(struct imp__seams *out, const struct imp__seam *seam)
{
    struct imp__seam *more =
        imp__grow(out->ctx, out->seam, &out->cap, out->n + 1, sizeof *more);
    if (!more) return imp__error(out->ctx, IMP_E_NOMEM, "no memory for edges");
    out->seam = more;
    more[out->n++] = *seam;
    return IMP_OK;
}

/* A side of f that lies in the plane of g, which f's plane cuts. */
static enum imp_status lying_add(struct seeking *x, size_t body, size_t other,
                                 const struct imp__body_triangle *f,
                                 const struct imp__body_triangle *g, const struct cut *cf,
                                 const struct cut *cg)
{
    int apex = 0;
    for (int k = 0; k < 3; k++)
        if (cf->s[k] != 0) apex = k;
        else if (fabs(cf->exact[k]) > x->near) return IMP_OK; /* it stands on it */
    const imp_v3 o = f->p[(apex + 1) % 3], r = f->p[(apex + 2) % 3] - o;
    const imp_v3 d = imp__normalize(r), up = f->p[apex] - o;
    const struct interval i = cut_interval(g, cg, o, d);
    const double from = imp_max(i.lo, 0.0), till = imp_min(i.hi, imp__length(r));
    if (!(till - from > x->near)) return IMP_OK;
    struct lying *more =
        imp__grow(x->scene->ctx, x->lying, &x->cap_lying, x->n_lying + 1, sizeof *more);
    if (!more) return imp__error(x->scene->ctx, IMP_E_NOMEM, "no memory for edges");
    x->lying = more;
    more[x->n_lying++] = (struct lying){
        .a = o + d * from,
        .b = o + d * till,
        .body = body,
        .other = other,
        .face =
            face_of(&x->body[body], f, cf->n, imp__normalize(up - d * imp__dot(up, d))),
        .in_other =
            face_of(&x->body[other], g, cg->n, imp__normalize(imp__cross(cg->n, d))),
        .side = cf->s[apex] > 0 ? 1 : -1};
    return IMP_OK;
}

/* Triangles of one mesh that have a corner in common meet there, and do not cross. */
static bool are_joined(const struct imp__body_triangle *f,
                       const struct imp__body_triangle *g)
{
    for (int k = 0; k < 9; k++)
        if (imp__is_zero(f->p[k / 3] - g->p[k % 3])) return true;
    return false;
}

static enum imp_status pair_work(void *payload, const struct imp__body_triangle *f,
                                 const struct imp__body_triangle *g)
{
    struct seeking *x = payload;
    if (x->f == x->g && are_joined(f, g)) return IMP_OK;
    const imp_v3 n_g = imp__cross(g->p[1] - g->p[0], g->p[2] - g->p[0]),
                 n_f = imp__cross(f->p[1] - f->p[0], f->p[2] - f->p[0]);
    if (imp__is_zero(n_g) || imp__is_zero(n_f)) return IMP_OK;
    const struct cut cf = cut_by(x, f, g->p[0], imp__normalize(n_g));
    if (!cf.crosses && cf.zeros != 2) return IMP_OK;
    const struct cut cg = cut_by(x, g, f->p[0], cf.n);
    if (!cf.crosses && cg.crosses) return lying_add(x, x->f, x->g, f, g, &cf, &cg);
    if (cf.crosses && !cg.crosses && cg.zeros == 2)
        return lying_add(x, x->g, x->f, g, f, &cg, &cf);
    if (!cf.crosses || !cg.crosses) return IMP_OK;

    const imp_v3 d = imp__normalize(imp__cross(cf.n, cg.n)), o = f->p[0];
    const struct interval i = cut_interval(f, &cf, o, d), j = cut_interval(g, &cg, o, d);
    const double from = imp_max(i.lo, j.lo), till = imp_min(i.hi, j.hi);
    if (!(till - from > x->near)) return IMP_OK;
    /* The line's point that is nearest to o lies off it, in f's plane and in that of g. */
    const imp_v3 in_f = imp__cross(cf.n, d), in_g = imp__cross(cg.n, d);
    const imp_v3 on = o + in_f * (imp__dot(cg.n, g->p[0] - o) / imp__dot(cg.n, in_f));
    struct imp__seam seam = {.a = on + d * from, .b = on + d * till};
    for (int k = 0; k < 2; k++) {
        const double sign = k ? -1 : 1;
        seam.face[k] = face_of(&x->body[x->f], f, cf.n, in_f * sign);
        seam.face[2 + k] = face_of(&x->body[x->g], g, cg.n, in_g * sign);
    }
    return seam_add(x->out, &seam);
}

/* ---- Sides that lie in a triangle of another body -------------------------------------- */

static int by_place(const void *a, const void *b)
{
    const struct lying *x = a, *y = b;
    if (x->other != y->other) return x->other < y->other ? -1 : 1;
    if (x->in_other.prim != y->in_other.prim)
        return x->in_other.prim < y->in_other.prim ? -1 : 1;
    if (x->body != y->body) return x->body < y->body ? -1 : 1;
    if (x->side != y->side) return x->side < y->side ? -1 : 1;
    return x->face.prim < y->face.prim ? -1 : x->face.prim > y->face.prim;
}

/* Triangles of a body on both sides of another one's, with a side in common, as far as it is. */
static enum imp_status lying_pair(struct seeking *x, const struct lying *f,
                                  const struct lying *g)
{
    const imp_v3 d = imp__normalize(f->b - f->a), r = g->a - f->a, q = g->b - f->a;
    const double a = imp__dot(r, d), b = imp__dot(q, d), off = 4 * x->near;
    if (imp__length(r - d * a) > off || imp__length(q - d * b) > off) return IMP_OK;
    const double from = imp_max(0.0, imp_min(a, b)),
                 till = imp_min(imp__length(f->b - f->a), imp_max(a, b));
    if (!(till - from > x->near)) return IMP_OK;
    struct imp__seam seam = {.a = f->a + d * from,
                             .b = f->a + d * till,
                             .face = {f->face, g->face, f->in_other, f->in_other}};
    seam.face[3].in = -seam.face[3].in;
    seam.laid = !imp__edge_is_inner(x->scene, seam.face);
    return seam_add(x->out, &seam);
}

static enum imp_status lying_work(struct seeking *x)
{
    if (x->n_lying == 0) return IMP_OK;
    qsort(x->lying, x->n_lying, sizeof *x->lying, by_place);
    for (size_t k = 0, n; k < x->n_lying; k += n) {
        const struct lying *first = &x->lying[k];
        size_t below = 0;
        for (n = 0; k + n < x->n_lying; n++) {
            const struct lying *f = &first[n];
            if (f->other != first->other || f->in_other.prim != first->in_other.prim ||
                f->body != first->body)
                break;
            below += f->side < 0;
        }
        for (size_t i = 0; i < below; i++)
            for (size_t j = below; j < n; j++)
                IMP_CHECKED(lying_pair(x, &first[i], &first[j]));
    }
    return IMP_OK;
}

/* ---- Bodies ---------------------------------------------------------------------------- */

static int by_lo(const void *a, const void *b)
{
    const struct boxed *x = a, *y = b;
    if (x->lo[0] != y->lo[0]) return x->lo[0] < y->lo[0] ? -1 : 1;
    return x->body < y->body ? -1 : x->body > y->body;
}

/* Boxes that only touch have nothing in them that passes through the other. */
static bool boxes_cross(const struct boxed *a, const struct boxed *b, double near)
{
    for (int k = 0; k < 3; k++)
        if (a->lo[k] + near >= b->hi[k] || b->lo[k] + near >= a->hi[k]) return false;
    return true;
}

static enum imp_status bodies_work(struct seeking *x, size_t f, size_t g)
{
    /* In the order of the scene, whatever that of the boxes. */
    x->f = f < g ? f : g;
    x->g = f < g ? g : f;
    for (int k = 0; k < 1 + (f != g); k++) {
        const size_t body = k ? x->g : x->f;
        if (x->tree[body].n == 0)
            IMP_CHECKED(imp__body_tree_build(x->scene, &x->body[body], &x->tree[body]));
    }
    return imp__body_pairs(&x->tree[x->f], &x->tree[x->g], APART * x->contact, pair_work,
                           x);
}

static size_t boxes_make(const struct seeking *x, size_t n_bodies, struct boxed *box)
{
    size_t n = 0;
    for (size_t k = 0; k < n_bodies; k++) {
        const struct imp_shape *s = x->scene->shapes[x->body[k].shape];
        struct imp_map map[2];
        if (s->geometry != IMP_TRIANGLES || s->triangles.n_triangles == 0) continue;
        box[n] = (struct boxed){s->lo, s->hi, k};
        if (x->body[k].place > 0) {
            imp__place_map(x->scene, x->body[k].place, 0, &map[0], &map[1]);
            imp__map_box(&map[0], &box[n].lo, &box[n].hi);
        }
        n++;
    }
    return n;
}

enum imp_status imp__seams_find(const struct imp_scene *scene,
                                const struct imp__body *body, size_t n_bodies,
                                double near, double size, struct imp__seams *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct seeking x = {.scene = scene,
                        .body = body,
                        .near = near,
                        .contact = IMP_SEAM_CONTACT * size,
                        .out = out};
    *out = (struct imp__seams){.ctx = ctx};
    struct boxed *box = imp__alloc(ctx, n_bodies + 1, sizeof *box);
    x.tree = imp__alloc(ctx, n_bodies + 1, sizeof *x.tree);
    if (!box || !x.tree) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for edges"));
    const size_t n = boxes_make(&x, n_bodies, box);
    qsort(box, n, sizeof *box, by_lo);
    for (size_t i = 0; i < n; i++) {
        const struct imp_shape *s = scene->shapes[body[box[i].body].shape];
        if (!(s->ops->flags & IMP_SHAPE_CONVEX))
            IMP_TRY(bodies_work(&x, box[i].body, box[i].body));
        for (size_t j = i + 1; j < n && box[j].lo[0] <= box[i].hi[0]; j++)
            if (boxes_cross(&box[i], &box[j], near))
                IMP_TRY(bodies_work(&x, box[i].body, box[j].body));
    }
    IMP_TRY(lying_work(&x));
out:
    for (size_t k = 0; x.tree && k < n_bodies; k++) imp__body_tree_free(ctx, &x.tree[k]);
    imp__release(ctx, x.tree);
    imp__release(ctx, x.lying);
    imp__release(ctx, box);
    if (st != IMP_OK) imp__seams_free(out);
    return st;
}

/* ---- Faces of edges in the list -------------------------------------------------------- */

/* Have two triangles a side in common, vertices and with them uv? */
static bool is_welded(const struct imp_triangles *t, int prim, int other)
{
    const uint32_t *i = t->indices;
    int common = 0;
    for (int k = 0; k < 9; k++) common += i[3 * prim + k / 3] == i[3 * other + k % 3];
    return common >= 2;
}

bool imp__edge_is_inner(const struct imp_scene *scene, const struct imp__edge_face f[2])
{
    if (f[0].shape != f[1].shape || f[0].place != f[1].place ||
        !(imp__length(f[0].in + f[1].in) < 1e-6))
        return false;
    const struct imp_shape *s = scene->shapes[f[0].shape];
    const struct imp_bsdf *b = imp__shape_bsdf(
        scene, scene->shapes[imp__placed_shape(scene, f[0].shape, f[0].place)]);
    bool varies = s->smooth;
    for (int k = 0; k < b->n_in; k++) varies |= b->input[k]->texture != NULL;
    return !varies || is_welded(&s->triangles, f[0].prim, f[1].prim);
}

#define CROSSING 1e-4 /* radians: planes that are nearer to parallel do not cross here */

bool imp__edge_is_crossing(const struct imp_scene *scene, struct imp__edge_face f[4])
{
    for (int k = 1; k < 4; k++) {
        const struct imp__edge_face pair[2][2] = {{f[0], f[k]},
                                                  {f[k == 1 ? 2 : 1], f[k == 3 ? 2 : 3]}};
        if (imp__length(imp__cross(pair[0][0].n, pair[1][0].n)) > CROSSING &&
            imp__edge_is_inner(scene, pair[0]) && imp__edge_is_inner(scene, pair[1])) {
            for (int i = 0; i < 4; i++) f[i] = pair[i / 2][i % 2];
            return true;
        }
    }
    return false;
}
