/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers made of a picture, F = sum_p s_p I_p, with standard errors.
 *
 * Pixels of a filter wider than a pixel share samples, so their errors may not be added
 * as if they were independent. A pixel is a ratio, I_p = sum_i w_ip L_i / W_p with W_p =
 * sum_i w_ip, and to first order sample i moves F by
 *
 *     e_i = sum_p s_p w_ip / W_p (L_i - I_p)
 *
 * (linearised ratio estimator; Cochran, Sampling Techniques, 6.3). Samples are
 * independent, and every pixel q of the film sends the same number n of them, so that
 *
 *     Var F = sum_q n Var(e in q)                               (strata; Cochran, 5.3)
 *
 * I_p and W_p are known only when the picture is there. A second pass then walks some of
 * the same walks again and looks at e as a picture through a box filter. Through a box
 * filter I_p and W_p are constants of their stratum, and F needs one pass. */
#include "base/team.h"
#include "estimate.h"
#include "film/film_picture.h"
#include "lanes.h"
#include "light_gradient.h"
#include "walk/run.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Samples per pixel of the second pass: a quarter of the picture's, but not so few that
 * the errors themselves become noisy. Two make a variance. */
#define ERROR_SHARE 4
#define ERROR_SPP   16

struct functional {
    struct imp_tracer tracer;
    const struct imp_film_desc *film;
    int channels, margin; /* extra pixels sampled on every side */
    int spp;              /* of the picture */
    const float *adjoint; /* [height][width][channels] */
    double norm;          /* F = sum(adjoint * picture) / norm */
    const double *W;      /* [height][width]; NULL: spp everywhere */
    const imp_film *picture;
    imp_film *const *films; /* [tracer.active->n]; NULL: no derivatives */
    const int *group;       /* [tracer.active->n] */
    int n_groups;
};

static int error_spp(int spp)
{
    return imp_max(2, imp_min(spp, imp_max(ERROR_SPP, spp / ERROR_SHARE)));
}

static void radiance(const struct functional *f, struct imp_sample *s)
{
    struct imp_walk walk;
    imp__sample_walk(s, &f->tracer, &walk);
    for (int c = 0; c < f->channels; c++) s->value[c] = walk.L[c];
}

/* ---- The second pass ----------------------------------------------------------- */

/* e_i of the picture, and of the sums of derivative pictures: value [1 + n_groups]. */
static void sample_influence(const void *payload, struct imp_sample *s)
{
    const struct functional *f = payload;
    const struct imp_film_desc *film = f->film;
    const size_t C = (size_t)f->channels, K = f->films ? f->tracer.active->n : 0;
    double *value = s->value,
           *lane = imp__arena_take(s->arena, (K + 1) * C, sizeof *lane);
    struct imp_taps across, down;
    for (int g = 0; g <= f->n_groups; g++) value[g] = 0;
    s->dropped = IMP_DROP_MEMORY;
    if (!lane) return;
    struct imp_sample own = *s; /* of the film without its margin */
    own.x -= f->margin;
    own.y -= f->margin;
    own.value = lane;
    if (f->films) imp__lanes_sample(&f->tracer, &own);
    else radiance(f, &own);
    s->px = own.px;
    s->py = own.py;
    /* A dropped walk, counted by the picture, has the influence of radiance 0. */
    s->dropped = own.dropped == IMP_DROP_MEMORY ? IMP_DROP_MEMORY : IMP_DROP_NONE;
    if (imp__film_border(film) > 0) {
        imp__film_taps(&film->filter, s->px - film->crop_x, 0, film->crop_w - 1, &across);
        imp__film_taps(&film->filter, s->py - film->crop_y, 0, film->crop_h - 1, &down);
    } else {
        across = (struct imp_taps){.first = s->x, .n = 1, .w = {1}};
        down = (struct imp_taps){.first = s->y, .n = 1, .w = {1}};
    }
    for (int j = 0; j < down.n; j++)
        for (int i = 0; i < across.n; i++) {
            const size_t p = (size_t)(down.first + j) * (size_t)film->crop_w +
                             (size_t)(across.first + i);
            const double W = f->W ? f->W[p] : f->spp;
            if (W == 0) continue;
            for (size_t c = 0; c < C; c++) {
                const size_t at = p * C + c;
                const double a = f->adjoint[at] * down.w[j] * across.w[i] / W;
                value[0] += a * (lane[c] -
                                 f->picture->mean[p * (size_t)f->picture->channels + c]);
                for (size_t k = 0; k < K; k++)
                    value[1 + f->group[k]] +=
                        a * (lane[(k + 1) * C + c] - f->films[k]->mean[at]);
            }
        }
}

/* Standard errors of the picture's number and of the groups', se [1 + n_groups]. */
static enum imp_status influence(imp_context *ctx, const struct functional *f,
                                 const struct imp_run *run, double *se)
{
    enum imp_status st = IMP_OK;
    const size_t n = (size_t)f->n_groups + 1;
    struct imp_sensor strata = *f->tracer.sensor; /* its pixels, each by itself */
    struct imp_run own = *run;
    imp_film *film = NULL;
    char *names = imp__alloc(ctx, n, 12);
    if (!names) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for standard errors"));
    for (size_t k = 0, used = 0; k < n; k++)
        used += (size_t)snprintf(names + used, 12, "%s%zu", k ? "," : "", k);
    strata.film.filter.radius = 0.5;
    strata.film.crop_w += 2 * f->margin;
    strata.film.crop_h += 2 * f->margin;
    strata.film.sample_border = false;
    own.spp = error_spp(f->spp);
    own.time_limit_s = 0;
    const struct imp_picture picture = {.sensor = &strata,
                                        .stage = "errors",
                                        .names = names,
                                        .n = (int)n,
                                        .sample = sample_influence,
                                        .payload = f,
                                        .set = imp__tracer_set(&f->tracer, own.spp)};
    IMP_TRY(imp__picture_make(ctx, &picture, &own, &film));
    for (size_t k = 0; k < n; k++) {
        double sum = 0;
        for (size_t q = 0; q < (size_t)film->width * (size_t)film->height; q++)
            sum += imp__sqr((double)film->se[q * n + k]);
        /* sum n Var, with se^2 = Var / own.spp */
        se[k] = sqrt(sum * own.spp * f->spp) / f->norm;
    }
out:
    imp_film_destroy(film);
    imp__release(ctx, names);
    return st;
}

/* ---- The picture --------------------------------------------------------------- */

/* The radiance; through a box filter also what the sample adds to F. */
static void sample_value(const void *payload, struct imp_sample *s)
{
    const struct functional *f = payload;
    const size_t C = (size_t)f->channels;
    radiance(f, s);
    if (f->W) return;
    const size_t p = (size_t)s->y * (size_t)f->film->crop_w + (size_t)s->x;
    s->value[C] = 0;
    for (size_t c = 0; c < C; c++) s->value[C] += f->adjoint[p * C + c] * s->value[c];
}

static void sample_position(const void *payload, struct imp_sample *s)
{
    const struct functional *f = payload;
    imp__walk_position(&f->tracer, s->x, s->y, s->index, &s->px, &s->py);
    s->value[0] = 0;
}

/* What all functions here begin with. *weights: room for W with a wide filter. *ones: the
 * adjoint of the mean, where none is given. */
static enum imp_status begin(imp_problem *p, const float *adjoint,
                             const struct imp_run *run, struct functional *f,
                             double **weights, float **ones)
{
    imp_context *ctx = p->ctx;
    const enum imp_status st = imp__problem_tracer_of_any_end(p, run, NULL, &f->tracer);
    if (st != IMP_OK) return st;
    f->film = &f->tracer.sensor->film;
    f->channels = p->scene->channels;
    f->margin = f->film->sample_border ? imp__film_border(f->film) : 0;
    f->adjoint = adjoint;
    f->norm = 1;
    const size_t pixels = (size_t)f->film->crop_w * (size_t)f->film->crop_h;
    const size_t n = pixels * (size_t)f->channels;
    if (imp__film_border(f->film) > 0) {
        *weights = imp__alloc(ctx, pixels, sizeof **weights);
        if (!*weights) return imp__error(ctx, IMP_E_NOMEM, "no memory for a functional");
        f->W = *weights;
    }
    if (adjoint) return imp__adjoint_check(p, f->film, adjoint, "adjoint");
    *ones = imp__alloc(ctx, n, sizeof **ones);
    if (!*ones) return imp__error(ctx, IMP_E_NOMEM, "no memory for a functional");
    for (size_t i = 0; i < n; i++) (*ones)[i] = 1;
    f->adjoint = *ones;
    f->norm = (double)n;
    return IMP_OK;
}

/* F of a film's first `channels` channels. */
static double inner_product(const struct functional *f, const imp_film *film)
{
    const size_t C = (size_t)f->channels, stride = (size_t)film->channels;
    double sum = 0;
    for (size_t p = 0; p < (size_t)film->width * (size_t)film->height; p++)
        for (size_t c = 0; c < C; c++)
            sum += (double)f->adjoint[p * C + c] * film->mean[p * stride + c];
    return sum / f->norm;
}

static enum imp_status picture_value(imp_context *ctx, struct functional *f,
                                     double *weights, const struct imp_run *run,
                                     struct imp_estimate *out)
{
    enum imp_status st = IMP_OK;
    static const char *const names[] = {"0", "0,1", "0,1,2", "0,1,2,3"};
    const bool box = !weights;
    const int n = f->channels + box;
    struct imp_estimate value = {0, 0, 0};
    imp_film *film = NULL;
    f->tracer.active = NULL; /* nothing is differentiated here */
    const struct imp_picture picture = {
        .sensor = f->tracer.sensor,
        .stage = "picture",
        .names = names[n - 1],
        .n = n,
        .sample = sample_value,
        .payload = f,
        .weights = weights,
        .set = imp__tracer_set(&f->tracer, imp__walks_of(run, f->tracer.sensor))};
    /* Standard errors through a wide filter need the picture, so each part computes all
     * of it. */
    const int spp = run->spp > 0 ? run->spp : f->tracer.sensor->spp;
    const bool one_pass = box && spp > 1, apart = !one_pass && imp__team_apart(ctx);
    double kept[2] = {0, 0}; /* the value, and samples per pixel */
    bool known = false;
    if (apart && imp__team_merges(ctx))
        IMP_TRY(imp__team_keep(ctx, kept, sizeof kept, &known));
    if (!known) {
        if (apart) ctx->team->alone++;
        st = imp__picture_make(ctx, &picture, run, &film);
        if (apart) ctx->team->alone--;
        IMP_TRY(st);
        kept[0] = inner_product(f, film);
        kept[1] = (double)film->spp;
        if (apart) IMP_TRY(imp__team_keep(ctx, kept, sizeof kept, &known));
    }
    value.value = kept[0];
    f->spp = (int)kept[1];
    f->picture = film;
    if (one_pass && f->spp > 1) {
        for (size_t p = 0; p < (size_t)film->width * (size_t)film->height; p++)
            value.se += imp__sqr((double)film->se[p * (size_t)n + (size_t)n - 1]);
        value.se = sqrt(value.se) / f->norm;
    } else {
        IMP_TRY(influence(ctx, f, run, &value.se));
    }
    *out = value;
out:
    imp_film_destroy(film);
    return st;
}

enum imp_status imp_problem_functional(imp_problem *p, const float *adjoint,
                                       const struct imp_run *run,
                                       struct imp_estimate *value, double *gradient,
                                       double *gradient_se)
{
    struct imp_run own;
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    if (!value && !gradient)
        return imp__error(ctx, IMP_E_ARG, "neither value nor gradient is asked for");
    IMP_RUN(ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    struct functional f = {0};
    struct imp_estimate estimate = {0, 0, 0};
    double *weights = NULL, *g = NULL;
    float *ones = NULL;
    IMP_TRY(begin(p, adjoint, &own, &f, &weights, &ones));
    if (gradient) {
        g = imp__alloc(ctx, 2 * p->n, sizeof *g);
        if (!g) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for gradients"));
        st = imp_problem_reverse(p, f.adjoint, &own, g, g + p->n);
        if (st != IMP_PART) IMP_TRY(st);
        for (size_t k = 0; k < 2 * p->n; k++) g[k] /= f.norm;
    }
    if (value) {
        IMP_TRY(imp__problem_same(p, &own, "functional"));
        if (f.tracer.integrator->from_lights)
            IMP_TRY(imp__light_functional(&f.tracer, f.adjoint, f.norm, &own, &estimate));
        else IMP_TRY(picture_value(ctx, &f, weights, &own, &estimate));
    }
    if (imp__team_part(ctx)) IMP_TRY(IMP_PART);
    if (value) *value = estimate;
    if (gradient) memcpy(gradient, g, p->n * sizeof *g);
    if (gradient && gradient_se) memcpy(gradient_se, g + p->n, p->n * sizeof *g);
out:
    imp__release(ctx, g);
    imp__release(ctx, weights);
    imp__release(ctx, ones);
    return st;
}

/* ---- Sums over derivative pictures --------------------------------------------- */

/* W of the picture's samples, from their positions alone. */
static enum imp_status weights_make(imp_context *ctx, const struct functional *f,
                                    const struct imp_run *run, double *weights)
{
    struct imp_run own = *run;
    imp_film *film = NULL;
    own.spp = f->spp;
    own.time_limit_s = 0;
    const struct imp_picture picture = {.sensor = f->tracer.sensor,
                                        .stage = "errors",
                                        .names = "W",
                                        .n = 1,
                                        .sample = sample_position,
                                        .payload = f,
                                        .weights = weights};
    const enum imp_status st = imp__picture_make(ctx, &picture, &own, &film);
    imp_film_destroy(film);
    return st;
}

enum imp_status imp_problem_jacobian_sums(imp_problem *p, const float *adjoint,
                                          const struct imp_run *run,
                                          const imp_film *primal, imp_film *const *films,
                                          const int *group, int n_groups,
                                          struct imp_estimate *value,
                                          struct imp_estimate *sums)
{
    struct imp_run own;
    enum imp_status st = IMP_OK, ended = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_REQUIRE(ctx, primal, "primal");
    IMP_REQUIRE(ctx, films, "films");
    IMP_REQUIRE(ctx, sums, "sums");
    if (p->n == 0) return imp__error(ctx, IMP_E_ARG, "no parameter is active");
    IMP_RUN(ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    const size_t n = group ? (size_t)n_groups : p->n;
    struct functional f = {0};
    double *weights = NULL, *se = NULL;
    float *ones = NULL;
    int *each = NULL;
    IMP_TRY(begin(p, adjoint, &own, &f, &weights, &ones));
    if (f.tracer.integrator->from_lights)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "derivative pictures are made by walks from the sensor"));
    for (size_t k = 0; k <= p->n; k++) {
        const imp_film *film = k < p->n ? films[k] : primal;
        if (!film || film->width != f.film->crop_w || film->height != f.film->crop_h ||
            film->channels != f.channels)
            IMP_TRY(imp__error(ctx, IMP_E_ARG,
                               "the pictures are not those of this problem's sensor"));
    }
    for (size_t k = 0; group && k < p->n; k++)
        if (group[k] < 0 || group[k] >= n_groups)
            IMP_TRY(imp__error(ctx, IMP_E_ARG, "group %d of number %zu is not below %d",
                               group[k], k, n_groups));
    each = imp__alloc(ctx, p->n, sizeof *each);
    se = imp__alloc(ctx, n + 1, sizeof *se);
    if (!each || !se) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for sums"));
    for (size_t k = 0; k < p->n; k++) each[k] = group ? group[k] : (int)k;
    f.group = each;
    f.n_groups = (int)n;
    f.picture = primal;
    f.films = films;
    f.spp = (int)primal->spp;
    for (size_t k = 0; k <= n; k++) se[k] = NAN;
    if (imp__team_apart(ctx)) ctx->team->alone++;
    if (f.spp > 0) { /* else interrupted before every pixel had its samples */
        if (weights) ended = weights_make(ctx, &f, &own, weights);
        if (ended == IMP_OK) ended = influence(ctx, &f, &own, se);
    }
    if (imp__team_apart(ctx)) ctx->team->alone--;
    if (f.spp > 0) {
        if (ended != IMP_CANCELLED) IMP_TRY(ended);
    }
    if (value) *value = (struct imp_estimate){inner_product(&f, primal), se[0], 0};
    for (size_t g = 0; g < n; g++) sums[g] = (struct imp_estimate){0, se[g + 1], 0};
    for (size_t k = 0; k < p->n; k++) sums[each[k]].value += inner_product(&f, films[k]);
out:
    imp__release(ctx, each);
    imp__release(ctx, se);
    imp__release(ctx, weights);
    imp__release(ctx, ones);
    return st;
}
