/* SPDX-License-Identifier: Apache-2.0
 *
 * Drawing points on shapes towards a reference point: draws against densities over the
 * sphere of directions, solid angles and form factors against closed forms, and the
 * lights that are made of them. */
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"

static imp_context *ctx;

enum { ROWS = 12, COLUMNS = 24, BINS = ROWS * COLUMNS };

/* The cone of directions from ref that holds the shape's bounding sphere; all directions
 * from inside it. Bins are equal solid angles. */
struct cone {
    struct imp_frame f;
    double height;
};
static struct cone cone_around(const struct imp_shape *s, imp_v3 ref)
{
    const imp_v3 to = (s->lo + s->hi) * 0.5 - ref;
    const double d = imp__length(to), r = 0.5 * imp__length(s->hi - s->lo);
    const imp_v3 axis = d > 0 ? to * (1 / d) : imp__v3(0, 0, 1);
    const double s2 = imp__sqr(r / d);
    return (struct cone){imp__frame_from_normal(axis),
                         d > r * 1.0001 ? s2 / (1 + sqrt(1 - s2)) : 2};
}
static int cone_bin(const struct cone *c, imp_v3 w)
{
    const imp_v3 l = imp__to_local(&c->f, w);
    /* 1 - cos from the sine: far cones are thin. */
    const double sin2 = l[0] * l[0] + l[1] * l[1];
    const double k = (l[2] > 0 ? sin2 / (1 + l[2]) : 1 - l[2]) / c->height;
    double phi = atan2(l[1], l[0]) / IMP_2PI;
    if (phi < 0) phi += 1;
    const int row = (int)(k * ROWS), column = (int)(phi * COLUMNS) % COLUMNS;
    return row >= ROWS ? -1 : row * COLUMNS + column;
}
static imp_v3 cone_direction(const struct cone *c, double u, double v)
{
    const double k = u * c->height, sine = sqrt(fmax(0, k * (2 - k)));
    return imp__to_world(
        &c->f, imp__v3(sine * cos(IMP_2PI * v), sine * sin(IMP_2PI * v), 1 - k));
}

/* Draws whose point is the first that their ray meets, against the integral of the
 * density of first hits. Both sides leave out what the shape itself hides, and what is
 * seen nearly from the edge: densities like 1/cos in directions too thin for the
 * quadrature. */
static void against_density(struct imp_shape *s, int round, imp_v3 ref, const char *where)
{
    enum { DRAWS = 40000, RAYS = 48 };
    const double grazing = 0.1;
    static double count[BINS], density[BINS], variance[BINS];
    const struct cone cone = cone_around(s, ref);
    const double bin_angle = IMP_2PI * cone.height / BINS;
    const double size = imp__length(s->hi - s->lo);
    struct tap_stat angle = {0}, angle_ref = {0};
    int outside = 0, none = 0, mismatch = 0, visible = 0;

    for (int i = 0; i < BINS; i++) count[i] = density[i] = variance[i] = 0;
    for (uint32_t i = 0; i < DRAWS; i++) {
        const struct imp_key key = imp__key(21, 0, i);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_light_sample l;
        struct imp_hit hit;
        if (!s->ops->sample_toward(s, &ref, u, &l)) {
            none++;
            tap_add(&angle, 0);
            continue;
        }
        mismatch += !(fabs(imp__length(l.wi) - 1) < 1e-12) || !(l.pdf > 0) ||
                    !(imp__length(ref + l.wi * l.dist - l.p) < 1e-9 * (1 + l.dist));
        const int found = imp__intersect(&world, &ref, &l.wi, 0, INFINITY, &hit);
        struct imp_surface at = {.uv = {0}};
        if (found) s->ops->surface(s, &hit, &ref, &l.wi, &at);
        if (!found || imp__length(at.p - l.p) > 1e-3 * size ||
            imp__dot(l.ng, at.ng) < 0.99) {
            tap_add(&angle, 0);
            continue;
        }
        const double pdf = s->ops->pdf_toward(s, &ref, &hit, &at),
                     c = imp__dot(at.ng, l.wi);
        /* Floats of Embree move the point along the surface by 1e-7 / cos. */
        if (fabs(c) > 0.05) {
            const double slack = s->geometry == IMP_ANALYTIC ? 1e-9 : 1e-3;
            mismatch += !(fabs(pdf / l.pdf - 1) < slack) ||
                        !(fabs(l.cos_light + imp__dot(l.wi, at.n)) < slack);
            if (fabs(at.uv[0] - l.uv[0]) < 0.5)
                mismatch += !(fabs(at.uv[0] - l.uv[0]) + fabs(at.uv[1] - l.uv[1]) < 1e-2);
        }
        visible++;
        const int bin = cone_bin(&cone, l.wi);
        if (bin < 0) outside++;
        else if (fabs(imp__dot(l.ng, l.wi)) > grazing) count[bin]++;
        tap_add(&angle, 1 / l.pdf);
    }
    for (int bin = 0; bin < BINS; bin++) {
        struct tap_stat p = {0};
        for (uint32_t i = 0; i < RAYS; i++) {
            const struct imp_key key = imp__key(22, (uint64_t)bin, i);
            const double u = (bin / COLUMNS + (i / 8 + imp__u01(key, 0)) / 6) / ROWS;
            const double v = (bin % COLUMNS + (i % 8 + imp__u01(key, 1)) / 8) / COLUMNS;
            const imp_v3 w = cone_direction(&cone, u, v);
            struct imp_hit hit;
            double f = 0;
            const int found = imp__intersect(&world, &ref, &w, 0, INFINITY, &hit);
            if (found) {
                struct imp_surface at;
                s->ops->surface(s, &hit, &ref, &w, &at);
                if (fabs(imp__dot(at.ng, w)) > grazing)
                    f = s->ops->pdf_toward(s, &ref, &hit, &at);
            }
            tap_add(&p, f * bin_angle);
            tap_add(&angle_ref, found ? IMP_2PI * cone.height : 0);
        }
        density[bin] = p.mean;
        variance[bin] = imp__sqr(tap_se(&p));
    }
    double chi2 = 0, dof = 0, total = 0;
    for (int bin = 0; bin < BINS; bin++) {
        const double p = count[bin] / DRAWS;
        total += density[bin];
        if (density[bin] * DRAWS < 10) continue;
        chi2 +=
            imp__sqr(p - density[bin]) / (fmax(p, density[bin]) / DRAWS + variance[bin]);
        dof++;
    }
    const double z = dof > 0 ? (chi2 - dof) / sqrt(2 * dof) : INFINITY;
    const double za =
        (angle.mean - angle_ref.mean) / hypot(tap_se(&angle), tap_se(&angle_ref));
    tap_ok(z < 5 && fabs(za) < 4.5 && outside == 0 && mismatch <= DRAWS / 2000 &&
               none <= DRAWS / 1000 && visible > DRAWS / 20 && total < 1.02 &&
               tap_se(&angle) < 0.05 * angle.mean,
           "%s%s from %s # chi2 z %.2f in %g bins, solid angle %.4g z %.2f, mismatch %d "
           "none %d "
           "visible %d",
           round ? "round " : "", s->ops->name, where, z, dof, angle.mean, za, mismatch,
           none, visible);
}

static void densities(void)
{
    static const char *const where[] = {"outside", "far away", "close to it", "inside"};
    for (int k = 0; imp__shape_kinds[k]; k++)
        for (int c = 0; c < 8; c++) {
            const struct imp_shape_ops *ops = imp__shape_kinds[k];
            const int place = c % 4, round = c >= 4;
            if (!ops->sample_toward) continue; /* it cannot be a light */
            if (round ? !ops->round : !strcmp(ops->name, "sphere")) continue;
            const int flat =
                !strcmp(ops->name, "rectangle") || !strcmp(ops->name, "disk");
            world_begin(ctx);
            struct imp_node *n = kind_node(ops);
            const struct imp_mat4 turn =
                imp__rotate(imp__normalize(imp__v3(1, 1, 3)), 50);
            const struct imp_mat4 scale =
                imp__scale(round ? imp__v3(1.3, 1.3, 1.3) : imp__v3(1.5, 1, 0.8));
            node_transform(n, imp__mat4_multiply(&turn, &scale));
            struct imp_shape *s = shape_build(n, NULL);
            if (!s || imp__intersector_create(&world) != IMP_OK) return;
            const double size = imp__length(s->hi - s->lo);
            const imp_v3 center = (s->lo + s->hi) * 0.5;
            imp_v3 ref = center + imp__normalize(imp__v3(0.3, -0.5, 0.8)) *
                                      (size * (place == 1 ? 30 : 1.2));
            if (place == 2) {
                struct imp_light_sample l;
                s->ops->sample_toward(s, &ref, (double[2]){0.37, 0.61}, &l);
                ref = l.p + l.ng * (0.05 * size);
            }
            if (place == 3) ref = center + imp__v3(0.06, -0.04, 0.03) * size;
            if (place == 3 && flat) {
                /* In its plane: seen from the edge there is nothing. */
                const imp_v3 edge = imp__vector(&turn, imp__v3(5, 0.2, 0));
                int drawn = 0;
                for (uint32_t i = 0; i < 1000; i++) {
                    const struct imp_key key = imp__key(2, 0, i);
                    struct imp_light_sample l;
                    drawn += s->ops->sample_toward(
                        s, &edge, (double[2]){imp__u01(key, 0), imp__u01(key, 1)}, &l);
                }
                tap_ok(drawn == 0, "%s: nothing to draw from the edge", ops->name);
            } else {
                against_density(s, round, ref, where[place]);
            }
            world_end();
        }
}

/* Points of an oval cylinder, sheared too, against its area: bins of phi and v, whose shares are
 * integrals of |dp_du x dp_dv| by trapezoids. */
static void oval_areas(void)
{
    enum { DRAWS = 200000, TURNS = 40, HEIGHTS = 5, STEPS = 200 };
    static const double width[] = {0.9, 0.3, 1e-2, 1e-5};
    for (int k = 0; k < 8; k++) {
        static int count[TURNS][HEIGHTS];
        double share[TURNS], sum = 0, chi2 = 0;
        struct imp_mat4 m = imp__scale(imp__v3(1, width[k % 4], 1.4));
        if (k >= 4) m.m[1] = 0.7, m.m[6] = 0.4, m.m[8] = -0.3;
        world_begin(ctx);
        struct imp_node *n = node_new("shape", "cylinder");
        node_transform(n, m);
        const struct imp_shape *s = shape_build(n, NULL);
        if (!s) {
            tap_ok(false, "a cylinder %g across is built", width[k % 4]);
            world_end();
            continue;
        }
        memset(count, 0, sizeof count);
        for (uint32_t i = 0; i < DRAWS; i++) {
            const struct imp_key key = imp__key(61, (uint64_t)k, i);
            struct imp_surface at;
            s->ops->sample_area(s, (double[2]){imp__u01(key, 0), imp__u01(key, 1)}, &at);
            count[imp_min((int)(at.uv[0] * TURNS), TURNS - 1)]
                 [(int)(at.uv[1] * HEIGHTS)]++;
        }
        for (int b = 0; b < TURNS; b++) {
            share[b] = 0;
            for (int i = 0; i <= STEPS; i++) {
                const double uv[2] = {(b + (double)i / STEPS) / TURNS, 0.5};
                struct imp_surface at;
                s->ops->place(s, uv, &at, NULL);
                share[b] += (i % STEPS ? 1 : 0.5) *
                            imp__length(imp__cross(at.dp_du, at.dp_dv)) / (STEPS * TURNS);
            }
            sum += share[b];
        }
        for (int b = 0; b < TURNS; b++)
            for (int v = 0; v < HEIGHTS; v++) {
                const double expected = DRAWS * share[b] / sum / HEIGHTS;
                chi2 += imp__sqr(count[b][v] - expected) / expected;
            }
        const double dof = TURNS * HEIGHTS - 1, z = (chi2 - dof) / sqrt(2 * dof);
        tap_ok(fabs(z) < 4.5 && fabs(sum / s->area - 1) < 1e-5,
               "points of a%s cylinder %g across # z %.2f, area %.8g, by trapezoids %.8g",
               k >= 4 ? " sheared" : "n oval", width[k % 4], z, s->area, sum);
        world_end();
    }
}

/* ---- closed forms -------------------------------------------------------------- */

static struct imp_shape *placed(const char *type, struct imp_mat4 m)
{
    struct imp_node *n = kind_node(shape_kind(type));
    node_transform(n, m);
    return shape_build(n, NULL);
}

/* Mean of g/pdf over draws whose point is met first. */
static struct tap_stat measure(const struct imp_shape *s, imp_v3 ref, imp_v3 facing,
                               int seed, int trace)
{
    struct tap_stat sum = {0};
    for (uint32_t i = 0; i < 60000; i++) {
        const struct imp_key key = imp__key((uint64_t)seed, 1, i);
        /* Stratified by the lattice of i: a small error for smooth integrands. */
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_light_sample l;
        struct imp_hit hit;
        double f = 0;
        if (s->ops->sample_toward(s, &ref, u, &l) &&
            (!trace || (imp__intersect(&world, &ref, &l.wi, 0, INFINITY, &hit) &&
                        fabs(hit.t - l.dist) < 1e-4 * (1 + l.dist))))
            f = imp__dot(facing, facing) > 0 ? fmax(0, imp__dot(facing, l.wi)) / l.pdf
                                             : 1 / l.pdf;
        tap_add(&sum, f);
    }
    return sum;
}

static void solid_angles(void)
{
    const imp_v3 none = imp__v3(0, 0, 0);
    const struct imp_mat4 one = imp__mat4_identity();
    static const struct {
        const char *type;
        double z, expected;
    } rows[] = {{"rectangle", 0.3, 0},   {"rectangle", 2, 0},
                {"disk", 0.3, 0},        {"disk", 2, 0},
                {"cube", 2.5, 0},        {"cube", 0, 4 * IMP_PI},
                {"mesh", 0, 4 * IMP_PI}, {"sphere", 0.4, 4 * IMP_PI},
                {"cylinder", 0.5, 0}};
    for (size_t k = 0; k < imp_count(rows); k++) {
        const double h = rows[k].z;
        double ref = rows[k].expected;
        if (!strcmp(rows[k].type, "rectangle")) ref = 4 * asin(1 / (1 + h * h));
        if (!strcmp(rows[k].type, "disk")) ref = IMP_2PI * (1 - h / sqrt(1 + h * h));
        /* Its top, 1.5 away; the sides hide behind it. */
        if (k == 4) ref = 4 * asin(1 / (1 + 1.5 * 1.5));
        if (!strcmp(rows[k].type, "cylinder")) ref = 4 * IMP_PI * 0.5 / sqrt(1 + 0.25);
        world_begin(ctx);
        struct imp_shape *s = placed(rows[k].type, one);
        if (!s || imp__intersector_create(&world) != IMP_OK) return;
        const struct tap_stat a = measure(s, imp__v3(0, 0, h), none, 31, 1);
        tap_z(&a, ref, 0.01 * ref, rows[k].type);
        world_end();
    }
    /* The sphere's cone: every draw has the density 1/(2 pi (1 - cos)), near and far. */
    for (int k = 0; k < 8; k++) {
        static const double distance[] = {1.0000001, 1.01, 2, 100, 1e4, 1e6, 1e8, 1e12};
        world_begin(ctx);
        const struct imp_shape *s = placed("sphere", one);
        const double d = distance[k];
        const imp_v3 ref = imp__normalize(imp__v3(1, 2, -2)) * d;
        const long double ld = imp__length(ref);
        const long double solid =
            2 * acosl(-1) * (1 / (ld * ld)) / (1 + sqrtl(1 - 1 / (ld * ld)));
        double worst = 0, on = 0, along = 0;
        for (uint32_t i = 0; s && i < 1000; i++) {
            const struct imp_key key = imp__key(8, 0, i);
            const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
            struct imp_light_sample l = {.pdf = 0};
            s->ops->sample_toward(s, &ref, u, &l);
            worst = fmax(worst, fabs(l.pdf * (double)solid - 1));
            on = fmax(on, fabs(imp__length(l.p) - 1));
            /* p lies on the ray, to the rounding of ref. */
            along = fmax(along, imp__length(ref + l.wi * l.dist - l.p) / d);
        }
        tap_ok(s && worst < 1e-8 && on < 1e-14 && along < 1e-7,
               "sphere from %g: density, point, ray # %.1e %.1e %.1e", d, worst, on,
               along);
        world_end();
    }
}

static void form_factors(void)
{
    /* F2a: coaxial discs of radius 0.5 and 1 at distance 1, R = pi A1 F12, from either.
     */
    const struct imp_mat4 half = imp__scale(imp__v3(0.5, 0.5, 0.5));
    struct imp_mat4 up = imp__rotate(imp__v3(1, 0, 0), 180);
    up.m[11] = 1;
    world_begin(ctx);
    const struct imp_shape *small = placed("disk", half), *large = placed("disk", up);
    for (int k = 0; k < 2; k++) {
        const struct imp_shape *from = k ? large : small, *to = k ? small : large;
        struct tap_stat r = {0};
        for (uint32_t i = 0; i < 400000; i++) {
            const struct imp_key key = imp__key(51, (uint64_t)k, i);
            double xy[2];
            imp__concentric_disk((double[2]){imp__u01(key, 0), imp__u01(key, 1)}, xy);
            const double radius = k ? 1 : 0.5;
            const imp_v3 p = imp__v3(xy[0] * radius, xy[1] * radius, k);
            struct imp_light_sample l;
            double f = 0;
            if (to->ops->sample_toward(
                    to, &p, (double[2]){imp__u01(key, 2), imp__u01(key, 3)}, &l) &&
                l.cos_light > 0)
                f = from->area * fabs(l.wi[2]) / l.pdf;
            tap_add(&r, f);
        }
        tap_z(&r, 1.1568931, 2e-3,
              k ? "F2a from the large disc" : "F2a from the small disc");
    }
    world_end();

    /* G2: a sphere of radius rho at distance d, receiver facing it: pi (rho/d)^2. */
    for (int k = 0; k < 4; k++) {
        static const double d[] = {1.05, 3, 40, 1e5};
        world_begin(ctx);
        const struct imp_shape *s = placed("sphere", imp__mat4_identity());
        const struct tap_stat e =
            measure(s, imp__v3(0, 0, d[k]), imp__v3(0, 0, -1), 61 + k, 0);
        const double ref = IMP_PI / (d[k] * d[k]);
        tap_z(&e, ref, 0.01 * ref, "G2: irradiance of a sphere");
        world_end();
    }
    /* A smooth-shaded mesh is drawn by its geometry: from inside, closed, flux 4 pi. */
    world_begin(ctx);
    const struct imp_shape *s = placed("mesh", imp__mat4_identity());
    struct tap_stat flux = {0};
    for (uint32_t i = 0; i < 60000; i++) {
        const struct imp_key key = imp__key(71, 0, i);
        const imp_v3 ref = imp__v3(0.1, 0.2, -0.3);
        struct imp_light_sample l;
        const int ok = s->ops->sample_toward(
            s, &ref, (double[2]){imp__u01(key, 0), imp__u01(key, 1)}, &l);
        tap_add(&flux, ok ? 1 / l.pdf : 0);
    }
    tap_z(&flux, 4 * IMP_PI, 0.08,
          "a convex mesh from inside: 4 pi, smooth normals or not");
    world_end();
}

/* ---- emitters ------------------------------------------------------------------ */

static enum imp_status emitter_status;
static struct imp_emitter *emitter_build(struct imp_node *n, const struct imp_shape *s,
                                         const double value[3])
{
    const struct imp_emitter_ops *ops = NULL;
    static const double vertical[] = {0, 40, 120}, horizontal[] = {0, 90, 180};
    static const double candela[] = {3, 2, 1, 3, 1, 2, 3, 4, 1};
    static const struct imp_ies_data table = {.n_vertical = 3,
                                              .n_horizontal = 3,
                                              .vertical = vertical,
                                              .horizontal = horizontal,
                                              .candela = candela};
    for (int i = 0; imp__emitter_kinds[i]; i++) /* a name may be a light, and an area */
        if (strcmp(imp__emitter_kinds[i]->name, n->type) == 0 &&
            (!ops || !s == !(imp__emitter_kinds[i]->flags & IMP_EMITTER_AREA)))
            ops = imp__emitter_kinds[i];
    n->ies = &table;
    if (strcmp(n->type, "perezsky") == 0) /* what it cannot be without */
        for (int k = 0; k < 2; k++)
            imp__node_add(&world.arena, n, k ? "direct" : "diffuse", IMP_PROP_FLOAT,
                          n->loc)
                ->number[0] = 3;
    struct imp_emitter *e = imp__arena_array(&world.arena, 1, sizeof *e);
    int n_in = 0;
    while (ops->inputs[n_in].name) n_in++;
    const struct imp_input **input =
        imp__arena_array(&world.arena, (size_t)n_in, sizeof *input);
    for (int i = 0; i < n_in; i++) {
        struct imp_input *x = imp__arena_array(&world.arena, 1, sizeof *x);
        x->param = -1;
        x->value = imp__v3(value[0], value[1], value[2]);
        input[i] = x;
    }
    *e = (struct imp_emitter){
        .ops = ops, .n_in = n_in, .input = input, .shape = s, .weight = 1};
    e->self = imp__arena_array(&world.arena, 1, ops->object_size + 1);
    const struct imp_build b = {.ctx = ctx, .node = n, .arena = &world.arena};
    emitter_status = ops->build ? ops->build(&b, e->self, e) : IMP_OK;
    if (emitter_status == IMP_OK) emitter_status = imp__props_finish(ctx, n);
    return emitter_status == IMP_OK ? e : NULL;
}

/* What every kind owes: eval is linear in its first input, eval_d is that factor, sample
 * and pdf agree, and light behind an area light is none. */
static void emitters(void)
{
    const double value[3] = {2, 3, 5};
    for (int k = 0; imp__emitter_kinds[k]; k++) {
        const struct imp_emitter_ops *ops = imp__emitter_kinds[k];
        const int area = ops->flags & IMP_EMITTER_AREA;
        const bool beam = area && ops->flags & IMP_EMITTER_DELTA; /* lights one prism */
        if (ops->place) continue; /* a picture: environment.c */
        world_begin(ctx);
        struct imp_shape *s = placed("rectangle", imp__mat4_identity());
        struct imp_emitter *e =
            emitter_build(node_new("emitter", ops->name), area ? s : NULL, value);
        if (!e || imp__intersector_create(&world) != IMP_OK) {
            tap_ok(0, "%s is built # %s", ops->name, imp_last_error(ctx));
            continue;
        }
        double worst = 0, slope = 0, other = 0;
        int behind = 0, lit = 0, delta_ok = 1;
        for (uint32_t i = 0; i < 4000; i++) {
            const struct imp_key key = imp__key(81, 0, i);
            const imp_v3 ref = imp__v3(imp__u01(key, 0) * 4 - 2, imp__u01(key, 1) * 4 - 2,
                                       imp__u01(key, 2) * 4 - 2);
            const double u[2] = {imp__u01(key, 3), imp__u01(key, 4)};
            struct imp_light_sample l;
            if (!ops->sample(e, &ref, u, &l)) continue;
            const struct imp_emission x = {.uv = {l.uv[0], l.uv[1]},
                                           .dist = l.dist,
                                           .cos_light = l.cos_light,
                                           .d = -l.wi};
            imp_spec in[8] = {imp__v3(2, 3, 5)}, twice[8] = {imp__v3(4, 6, 10)};
            imp_spec le, le2, dle[8];
            for (int j = 1; j < e->n_in; j++) in[j] = twice[j] = imp__spec(4);
            ops->eval(e, in, &x, &le);
            ops->eval(e, twice, &x, &le2);
            ops->eval_d(e, in, &x, dle);
            /* Light is linear in the first input, unless that is no strength (sunsky). */
            for (int c = 0; c < 3 && ops->inputs[0].role == IMP_EMISSION; c++) {
                slope = fmax(slope, fabs(le2[c] - 2 * le[c]) / (1 + le[c]));
                slope = fmax(slope, fabs(le[c] - dle[0][c] * in[0][c]) / (1 + le[c]));
            }
            for (int j = 1; j < e->n_in; j++) { /* others by central differences */
                imp_spec up[8], down[8], a, b;
                memcpy(up, in, sizeof up);
                memcpy(down, in, sizeof down);
                up[j] += 1e-5;
                down[j] -= 1e-5;
                ops->eval(e, up, &x, &a);
                ops->eval(e, down, &x, &b);
                for (int c = 0; c < 3; c++)
                    other =
                        fmax(other, fabs((a[c] - b[c]) / 2e-5 - dle[j][c]) / (1 + le[c]));
            }
            lit += le[0] > 0;
            behind += area && ref[2] < 0 && le[0] != 0;
            if (ops->flags & IMP_EMITTER_DELTA) {
                delta_ok &= l.pdf == 1 && ops->pdf(e, &ref, &l.wi, NULL, NULL) == 0;
                continue;
            }
            struct imp_hit hit;
            struct imp_surface at;
            if (area && (!imp__intersect(&world, &ref, &l.wi, 0, INFINITY, &hit) ||
                         fabs(l.cos_light) < 0.01))
                continue;
            if (area) s->ops->surface(s, &hit, &ref, &l.wi, &at);
            const double pdf =
                ops->pdf(e, &ref, &l.wi, area ? &hit : NULL, area ? &at : NULL);
            worst = fmax(worst, fabs(pdf / l.pdf - 1));
        }
        tap_ok(worst < 1e-3 && slope < 1e-15 && other < 1e-8 && behind == 0 &&
                   lit > (beam ? 300 : 1000) && delta_ok,
               "%s: eval, eval_d, sample, pdf # pdf %.1e slope %.1e behind %d lit %d",
               ops->name, worst, slope, behind, lit);
        world_end();
    }

    /* A beam about its normal, and aimed by 60 degrees: cos^4 about its axis, nothing
     * behind. */
    for (int aimed = 0; aimed < 2; aimed++) {
        world_begin(ctx);
        struct imp_node *node = node_new("emitter", "beam");
        if (aimed) node_vector(node, "axis", imp__v3(sqrt(3), 0, 1));
        struct imp_emitter *beam = emitter_build(
            node, placed("rectangle", imp__mat4_identity()), (double[3]){2, 2, 2});
        for (int k = -1; k < 8 && beam; k++) {
            const imp_spec in[2] = {imp__spec(2), imp__spec(4)};
            const double a = k * 0.3, off = aimed ? a - IMP_PI / 3 : a;
            const struct imp_emission x = {
                .dist = 1, .cos_light = cos(a), .d = imp__v3(sin(a), 0, cos(a))};
            imp_spec le;
            beam->ops->eval(beam, in, &x, &le);
            tap_near(le[0], cos(a) > 0 ? 2 * pow(fmax(0, cos(off)), 4) : 0, 1e-13, 1e-15,
                     aimed ? "an aimed beam" : "a beam about its normal");
        }
        world_end();
    }

    /* G1: point light I at height h, lateral x: I h / (h^2 + x^2)^(3/2). */
    world_begin(ctx);
    struct imp_node *n = node_new("emitter", "point");
    node_vector(n, "position", imp__v3(0, 0, 5));
    struct imp_emitter *e = emitter_build(n, NULL, (double[3]){1, 1, 1});
    const double x[] = {0, 1, 7};
    for (int k = 0; e && k < 3; k++) {
        const imp_v3 ref = imp__v3(x[k], 0, 0);
        struct imp_light_sample l;
        imp_spec le;
        e->ops->sample(e, &ref, (double[2]){0.5, 0.5}, &l);
        const struct imp_emission at = {
            .dist = l.dist, .cos_light = l.cos_light, .d = -l.wi};
        e->ops->eval(e, &e->input[0]->value, &at, &le);
        tap_near(le[0] * l.wi[2], 5 / pow(25 + x[k] * x[k], 1.5), 1e-14, 0,
                 "G1: point light");
        /* Section 16: over a diffuse floor 0.6, straight below. */
        if (k == 0)
            tap_near(le[0] * l.wi[2] * 0.6 / IMP_PI, 0.0076394, 5e-6, 0, "section 16");
    }
    struct imp_light_sample l;
    const imp_v3 self = imp__v3(0, 0, 5);
    tap_ok(e && !e->ops->sample(e, &self, (double[2]){0, 0}, &l),
           "not from the light itself");
    n = node_new("emitter", "point");
    node_transform(n, imp__translate(imp__v3(1, 2, 3)));
    e = emitter_build(n, NULL, (double[3]){1, 1, 1});
    const imp_v3 ref = imp__v3(1, 2, 0);
    tap_ok(e && e->ops->sample(e, &ref, (double[2]){0, 0}, &l) && l.wi[2] == 1 &&
               l.dist == 3,
           "point light by to_world");

    struct imp_shape *flat = placed("rectangle", imp__mat4_identity());
    const struct {
        const char *type, *prop, *words;
        int with_shape;
        double area;
    } errors[] = {{"area", NULL, "must be inside a shape", 0, 1},
                  {"area", "to_world", "the light is its shape", 1, 1},
                  {"area", NULL, "its shape 'rectangle' (rectangle) has no area", 1, 0},
                  {"stam_m1", NULL, "has no area", 1, 0},
                  {"beam", NULL, "must be inside a shape", 0, 1},
                  {"beam", NULL, "has no area", 1, 0},
                  {"point", "both", "position or to_world, not both", 0, 1},
                  {"constant", "to_world", "'to_world'", 0, 1}};
    for (size_t k = 0; k < imp_count(errors); k++) {
        n = node_new("emitter", errors[k].type);
        if (errors[k].prop) node_transform(n, imp__mat4_identity());
        if (errors[k].prop && !strcmp(errors[k].prop, "both"))
            node_vector(n, "position", imp__v3(0, 0, 0));
        flat->area = errors[k].area;
        e = emitter_build(n, errors[k].with_shape ? flat : NULL, (double[3]){1, 1, 1});
        tap_ok(!e && emitter_status == IMP_E_SCENE &&
                   strstr(imp_last_error(ctx), errors[k].words),
               "error: %s # %s", errors[k].words, imp_last_error(ctx));
    }
    world_end();
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    densities();
    oval_areas();
    solid_angles();
    form_factors();
    emitters();
    imp_context_destroy(ctx);
    return tap_done();
}
