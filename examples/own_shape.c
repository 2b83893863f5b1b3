/* SPDX-License-Identifier: Apache-2.0
 *
 * own_shape: a shape that the library does not have, written in the host program, and its
 * self-test.
 *
 * A dome is the half z > 0 of a sphere of radius r about its center:
 *
 *     p = center + r (sin(a) cos(b), sin(a) sin(b), cos(a)),     u = b/(2 pi), v = cos(a)
 *
 * so that dA = 2 pi r^2 du dv: uv is uniform by area. The program prints the contracts of two
 * domes, of which one has turned normals.
 *
 *     cc own_shape.c $(pkg-config --cflags --libs importon) -lm
 */
#include <importon/kinds.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

struct dome {
    imp_v3 center, axis[3]; /* unit; the last one points to the top */
    double radius, side;    /* 1: normals point outwards */
};

static double length_of(imp_v3 a) { return sqrt(imp_v3_dot(&a, &a)); }

/* The box of its sphere, which may be larger than what it bounds. */
static void bound(const struct dome *c, struct imp_shape *s)
{
    for (int i = 0; i < 3; i++) {
        s->lo[i] = c->center[i] - c->radius;
        s->hi[i] = c->center[i] + c->radius;
    }
}

/* A shape reads its own properties, flip_normals too: a property that nobody reads is an error. */
static enum imp_status build(const struct imp_build *b, void *self, struct imp_shape *s)
{
    struct dome *c = self;
    double center[3];
    enum imp_status st = imp_build_vector(b, "center", (double[3]){0, 0, 0}, center);
    if (st == IMP_OK) st = imp_build_float(b, "radius", 1, &c->radius);
    if (st == IMP_OK) st = imp_build_bool(b, "flip_normals", false, &s->flip_normals);
    if (st != IMP_OK) return st;
    if (!(c->radius > 0))
        return imp_build_error(b, "radius", IMP_E_SCENE, "radius = %g", c->radius);
    for (int i = 0; i < 3; i++) {
        c->center[i] = center[i];
        c->axis[i][i] = 1;
    }
    c->side = s->flip_normals ? -1 : 1;
    s->geometry = IMP_ANALYTIC;
    s->area = 2 * pi * c->radius * c->radius;
    bound(c, s);
    return IMP_OK;
}

/* The point of uv. */
static void place(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim)
{
    const struct dome *c = s->self;
    const double z = uv[1], rho = sqrt(fmax(0, 1 - z * z)), b = 2 * pi * uv[0];
    const imp_v3 round = c->axis[0] * cos(b) + c->axis[1] * sin(b);
    const imp_v3 across = c->axis[1] * cos(b) - c->axis[0] * sin(b);
    const imp_v3 outward = round * rho + c->axis[2] * z;
    (void)prim;
    out->p = c->center + outward * c->radius;
    out->ng = out->n = outward * c->side;
    out->uv[0] = uv[0];
    out->uv[1] = uv[1];
    out->dp_du = across * (2 * pi * c->radius * rho);
    out->dp_dv = (c->axis[2] - round * (z / fmax(rho, 1e-9))) * c->radius;
    out->s = across; /* across the normal, also at the top */
    out->t = (imp_v3){out->n[1] * across[2] - out->n[2] * across[1],
                      out->n[2] * across[0] - out->n[0] * across[2],
                      out->n[0] * across[1] - out->n[1] * across[0]};
}

static bool intersect(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                      double tmin, double tmax, struct imp_hit *hit)
{
    const struct dome *c = s->self;
    const imp_v3 from = *o - c->center;
    const double a = imp_v3_dot(d, d), b = imp_v3_dot(&from, d) / a;
    const imp_v3 foot = from - *d * b; /* of the line, nearest to the centre */
    const double e = c->radius * c->radius - imp_v3_dot(&foot, &foot);
    if (!(e >= 0)) return false;
    for (int k = -1; k <= 1; k += 2) {
        const double t = -b + k * sqrt(e / a);
        const imp_v3 q = from + *d * t;
        if (!(t > tmin && t < tmax) || imp_v3_dot(&q, &c->axis[2]) < 0) continue;
        hit->t = t;
        hit->u = hit->v = 0;
        hit->prim = 0;
        return true;
    }
    return false;
}

static void surface(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out)
{
    const struct dome *c = s->self;
    const imp_v3 q = *o + *d * hit->t - c->center;
    const double turn =
        atan2(imp_v3_dot(&q, &c->axis[1]), imp_v3_dot(&q, &c->axis[0])) / (2 * pi);
    const double uv[2] = {turn < 0 ? turn + 1 : turn,
                          imp_v3_dot(&q, &c->axis[2]) / length_of(q)};
    place(s, uv, out, NULL);
}

static void sample_area(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out)
{
    place(s, u, out, NULL);
}

/* Drawn by area; per steradian, p = dist^2/(area |cos|). */
static double pdf_toward(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    const imp_v3 to = at->p - *ref;
    const double dist = length_of(to), cosine = fabs(imp_v3_dot(&to, &at->ng)) / dist;
    (void)hit;
    return cosine > 1e-12 ? dist * dist / (s->area * cosine) : 0;
}
static bool sample_toward(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out)
{
    struct imp_surface at;
    place(s, u, &at, NULL);
    const imp_v3 to = at.p - *ref;
    out->pdf = pdf_toward(s, ref, NULL, &at);
    if (!(out->pdf > 0)) return false;
    out->dist = length_of(to);
    out->wi = to / out->dist;
    out->uv[0] = at.uv[0];
    out->uv[1] = at.uv[1];
    out->cos_light = -imp_v3_dot(&out->wi, &at.n);
    out->p = at.p;
    out->ng = at.ng;
    return true;
}

/* A turn and a shift, three rows of four. It changes `self`, area and box alone. */
static void move(struct imp_shape *s, const double m[12])
{
    struct dome *c = s->self;
    const struct dome was = *c;
    for (int i = 0; i < 3; i++) {
        const imp_v3 row = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
        c->center[i] = imp_v3_dot(&row, &was.center) + m[4 * i + 3];
        for (int k = 0; k < 3; k++) c->axis[k][i] = imp_v3_dot(&row, &was.axis[k]);
    }
    bound(c, s);
}

static const struct imp_shape_ops dome = {.size = sizeof(struct imp_shape_ops),
                                          .name = "dome",
                                          .object_size = sizeof(struct dome),
                                          .build = build,
                                          .intersect = intersect,
                                          .surface = surface,
                                          .sample_toward = sample_toward,
                                          .pdf_toward = pdf_toward,
                                          .sample_area = sample_area,
                                          .place = place,
                                          .move = move};

static const char scene_text[] =
    "<scene version='3.0.0'>"
    "<shape type='dome' id='roof'><float name='radius' value='2'/>"
    "<emitter type='area'><rgb name='radiance' value='1,1,1'/></emitter></shape>"
    "<shape type='dome' id='bowl'><vector name='center' x='1' y='2' z='9'/>"
    "<boolean name='flip_normals' value='true'/></shape></scene>";

int main(void)
{
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    const struct imp_selftest_row *rows = NULL;
    size_t n = 0, broken = 0;

    enum imp_status st = imp_context_create(NULL, &context);
    if (st == IMP_OK) st = imp_register_shape(context, &dome);
    if (st == IMP_OK)
        st = imp_scene_load_string(context, scene_text, strlen(scene_text), "domes", NULL,
                                   &scene);
    if (st == IMP_OK) st = imp_selftest(scene, IMP_SELFTEST_SHAPE, NULL, &rows, &n);
    if (st != IMP_OK) fprintf(stderr, "%s\n", imp_last_error(context));
    for (size_t i = 0; i < n; i++) {
        const struct imp_selftest_row *r = IMP_ROW(imp_selftest_row, rows, i);
        printf("%s %-8s error %-10.2g %s\n", r->object, r->contract, r->error,
               r->ok > 0   ? "ok"
               : r->ok < 0 ? "too few draws"
                           : "FAILED");
        broken += r->ok == IMP_VERDICT_WRONG;
    }
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st != IMP_OK || n == 0 || broken > 0;
}
