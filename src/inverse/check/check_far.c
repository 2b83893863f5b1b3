/* SPDX-License-Identifier: Apache-2.0
 *
 * Where light walks of skies and of parallel lights without a surface begin, a point and a
 * direction. Such a walk is a line: its direction d, and the foot of the perpendicular from the
 * centre of the scene's ball, of radius r. What is claimed is
 *
 *     p = pdf_emission(d)/(pi r^2)      per steradian and area across d, in the ball; else 0
 *
 * against q: directions by lobes (check_lobes.h), feet even in a disk of radius 1.1 r. Sums as
 * in check_directions.c. A walk that begins inside of the ball would miss what lies before it:
 * that none does is a part, too. Parallel light of a surface: check_areas.c. */
#include "check_lobes.h"
#include "check_sources.h"
#include "math/rng.h"
#include "math/warp.h"
#include <math.h>

#define WIDER 1.1 /* the disk of q */
enum {
    WHOLE,
    RATIOS,
    SIDES = RATIOS + 6,   /* quarters of the directions */
    RINGS = SIDES + 4,    /* thirds of the disk, and beyond it */
    QUARTERS = RINGS + 4, /* of the disk */
    AGREE = QUARTERS + 4,
    BEFORE,
    NARROWLY
};

struct far {
    const struct imp_scene *scene;
    const struct imp_emitter *light;
    bool parallel;           /* all walks have one direction */
    imp_v3 along;            /* that one */
    struct imp__lobes lobes; /* of the directions that light comes from */
};

/* The foot of a line, in units of r: along two axes across d. */
static void foot_of(const struct far *x, imp_v3 p, imp_v3 d, double foot[2])
{
    const struct imp_frame f = imp__frame_from_normal(d);
    const imp_v3 from = (p - x->scene->ball.centre) * (1 / x->scene->ball.radius);
    foot[0] = imp__dot(from, f.s);
    foot[1] = imp__dot(from, f.t);
}

static double direction_q(const struct far *x, imp_v3 d)
{
    return x->parallel ? 1 : imp__lobes_pdf(&x->lobes, -d);
}

/* p, q: without the factor 1/(pi r^2) of both. */
static void line_add(const struct far *x, struct imp__pair *pair, double p, imp_v3 d,
                     const double foot[2], bool drawn)
{
    const double q = direction_q(x, d) / (WIDER * WIDER),
                 part = (drawn ? q : p) / (q + p), a = drawn ? part : 0,
                 b = drawn ? 0 : part;
    if (!(p > 0)) return;
    const double ring = imp__sqr(foot[0]) + imp__sqr(foot[1]);
    imp__pair_add(pair, WHOLE, a, b);
    imp__pair_add(pair, RATIOS + imp_min((int)(6 * p / (p + q)), 5), a, b);
    imp__pair_add(pair, SIDES + (d[0] > 0) + 2 * (d[1] > 0), a, b);
    imp__pair_add(pair, RINGS + imp_min((int)(3 * ring * (1 - 1e-9)), 3), a, b);
    imp__pair_add(pair, QUARTERS + (foot[0] > 0) + 2 * (foot[1] > 0), a, b);
    if (!x->parallel && imp__lobes_narrowly(&x->lobes, -d))
        imp__pair_add(pair, NARROWLY, a, b);
}

static double claimed(const struct far *x, imp_v3 d)
{
    const struct imp_emission e = {{0, 0}, INFINITY, 1, d};
    return x->light->ops->pdf_emission(x->light, &e);
}

static void far_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct far *x = payload;
    const struct imp_ball *ball = &x->scene->ball;
    const struct imp_key key = imp__key(seed, 0xfa4, (uint64_t)i);
    struct imp_emission_sample s;
    double u[9], foot[2];
    for (int k = 0; k < 9; k++) u[k] = imp__u01(key, (uint32_t)k);
    s.located.prim = -1;
    if (x->light->ops->sample_emission(x->light, ball, u, &s) && s.pdf_d > 0) {
        const double area = IMP_PI * imp__sqr(ball->radius),
                     pdf = s.pdf_p * area * s.pdf_d;
        foot_of(x, s.p, s.d, foot);
        line_add(x, p, pdf, s.d, foot, true);
        const double other = claimed(x, s.d),
                     across = imp__sqr(foot[0]) + imp__sqr(foot[1]),
                     before = -imp__dot(s.p - ball->centre, s.d) / ball->radius;
        imp__pair_add(p, AGREE, other > 0 ? fmin(pdf / other, 2) : 2, 1);
        imp__pair_add(p, BEFORE, before > sqrt(fmax(0, 1 - across)) - 1e-9, 1);
    }
    const imp_v3 d = x->parallel ? x->along : -imp__lobes_sample(&x->lobes, u + 4);
    const double r = WIDER * sqrt(u[7]), phi = IMP_2PI * u[8];
    foot[0] = r * cos(phi);
    foot[1] = r * sin(phi);
    if (r <= 1) line_add(x, p, claimed(x, d), d, foot, false);
}

enum imp_status imp__check_far(struct imp__draw_list *l, const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = places->tracer.scene;
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        const unsigned flags = e->ops->flags;
        struct imp_emission_sample s;
        if (!(flags & (IMP_EMITTER_FAR | IMP_EMITTER_ENVIRONMENT)) || e->shape ||
            !e->ops->sample_emission || !e->ops->pdf_emission)
            continue;
        struct far *x = imp__arena_array(&l->arena, 1, sizeof *x);
        if (!x) IMP_TRY(imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check"));
        *x = (struct far){
            .scene = scene, .light = e, .parallel = (flags & IMP_EMITTER_DELTA) != 0};
        s.located.prim = -1;
        if (!x->parallel) imp__lobes_of_sky(&x->lobes, e, scene->ball.centre);
        else if (e->ops->sample_emission(e, &scene->ball, (double[4]){0.5, 0.5, 0.5, 0.5},
                                         &s))
            x->along = s.d;
        else continue;
        IMP_TRY(imp__draw_add(
            l, &(struct imp__draw_row){.method = "leaves",
                                       .name = e->name ? e->name : e->ops->name,
                                       .pair = far_pair,
                                       .payload = x,
                                       .slack = 1e-3,
                                       .fine = 1u << NARROWLY}));
    }
out:
    return st;
}
