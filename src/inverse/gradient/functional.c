/* SPDX-License-Identifier: Apache-2.0
 *
 * Functionals of a picture, F = sum_p s_p I_p, with standard errors (influence.h). */
#include "base/team.h"
#include "inverse/estimate/influence.h"
#include "inverse/estimate/moved_pictures.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/estimate/replicates.h"
#include "light_gradient.h"
#include "math/hash.h"
#include "objective_gradient.h"
#include "scene/unlit.h"
#include "walk/lights/light_walk.h"
#include "walk/run/run.h"
#include <math.h>
#include <string.h>

static void radiance(const struct imp__functional *f, struct imp_sample *s)
{
    struct imp_walk walk;
    imp__sample_walk(s, &f->tracer, &walk);
    for (int c = 0; c < f->channels; c++) s->value[c] = walk.L[c];
}

/* The radiance; through a box filter also what the sample adds to F. */
static void sample_value(const void *payload, struct imp_sample *s)
{
    const struct imp__functional *f = payload;
    const size_t C = (size_t)f->channels;
    radiance(f, s);
    if (f->W) return;
    const size_t p = (size_t)s->y * (size_t)f->film->crop_w + (size_t)s->x;
    s->value[C] = 0;
    for (size_t c = 0; c < C; c++) s->value[C] += f->adjoint[p * C + c] * s->value[c];
}

static void sample_position(const void *payload, struct imp_sample *s)
{
    const struct imp__functional *f = payload;
    imp__walk_position(&f->tracer, s->x, s->y, s->index, &s->px, &s->py);
    s->value[0] = 0;
}

/* What all functions here begin with. *weights: room for W with a wide filter. *ones: the
 * adjoint of the mean, where none is given. */
static enum imp_status begin(imp_problem *p, const float *adjoint,
                             const struct imp_run *run, struct imp__functional *f,
                             double **weights, float **ones)
{
    imp_context *ctx = p->ctx;
    p->edge_terms = true; /* of the gradient, which is made in its own place */
    enum imp_status st = imp__problem_tracer_of_any_end(p, run, NULL, &f->tracer);
    p->edge_terms = false;
    if (st == IMP_OK) st = imp__sensor_lit(p->scene, f->tracer.sensor);
    if (st != IMP_OK) return st;
    imp__problem_tell(p, &f->tracer);
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
static double inner_product(const struct imp__functional *f, const imp_film *film)
{
    const size_t C = (size_t)f->channels, stride = (size_t)film->channels;
    double sum = 0;
    for (size_t p = 0; p < (size_t)film->width * (size_t)film->height; p++)
        for (size_t c = 0; c < C; c++)
            sum += (double)f->adjoint[p * C + c] * film->mean[p * stride + c];
    return sum / f->norm;
}

/* W of the picture's samples, from their positions alone. */
static enum imp_status weights_make(imp_context *ctx, const struct imp__functional *f,
                                    const struct imp_run *run, double *weights)
{
    struct imp_run own = *run;
    imp_film *film = NULL;
    own.spp = f->spp;
    own.time_limit_s = 0;
    const struct imp_picture picture = {
        .sensor = f->tracer.sensor,
        .stage = "errors",
        .names = "W",
        .n = 1,
        .sample = sample_position,
        .payload = f,
        .weights = weights,
        /* in the order in which the picture adds them */
        .set = imp__tracer_set(&f->tracer, imp__walks_of(run, f->tracer.sensor)),
        .points = imp__tracer_sets(&f->tracer)};
    const enum imp_status st = imp__picture_make(ctx, &picture, &own, &film);
    imp_film_destroy(film);
    return st;
}

/* Standard errors [1 + n_groups]. `picture_W`: W is known from the picture, if there is
 * one. A part keeps the sums of its walks; all else is computed where it is needed. */
static enum imp_status errors(imp_context *ctx, const struct imp__functional *f,
                              const struct imp_run *run, double *weights, bool picture_W,
                              double *se)
{
    enum imp_status st = IMP_OK;
    struct imp__influence influence = {0};
    const bool apart = imp__team_apart(ctx), part = imp__team_part(ctx);
    if (weights && (!picture_W || part)) {
        if (apart) ctx->team->alone++;
        st = weights_make(ctx, f, run, weights);
        if (apart) ctx->team->alone--;
        IMP_TRY(st);
    }
    IMP_TRY(imp__influence_sample(ctx, f, run, &influence));
    if (apart) ctx->team->alone++;
    st = imp__influence_errors(ctx, f, run, &influence, se);
    if (apart) ctx->team->alone--;
out:
    imp__influence_free(ctx, &influence);
    return st;
}

static enum imp_status picture_value(imp_context *ctx, struct imp__functional *f,
                                     double *weights, const struct imp_run *run,
                                     struct imp_estimate *out)
{
    enum imp_status st = IMP_OK;
    static const char *const names[] = {"0", "0,1", "0,1,2", "0,1,2,3"};
    const bool box = !weights;
    const int n = f->channels + box;
    struct imp_estimate value = {0};
    imp_film *film = NULL;
    f->tracer.active = NULL; /* nothing is differentiated here, and no walk is swept */
    f->tracer.value_only = true;
    const struct imp_picture picture = {
        .sensor = f->tracer.sensor,
        .stage = "picture",
        .walks = imp__bundle_use(&f->tracer),
        .names = names[n - 1],
        .n = n,
        .sample = sample_value,
        .payload = f,
        .weights = weights,
        .set = imp__tracer_set(&f->tracer, imp__walks_of(run, f->tracer.sensor)),
        .points = imp__tracer_sets(&f->tracer)};
    /* Through a box filter errors are the pixels', if these have any. */
    const int spp = (int)imp_max(imp__walks_of(run, f->tracer.sensor), (int64_t)1);
    const bool one_pass = box && spp > 1;
    st = imp__picture_make(ctx, &picture, run, &film);
    if (st != IMP_PART) IMP_TRY(st);
    f->spp = film ? (int)film->spp : spp;
    f->picture = film;
    if (!one_pass || (film && f->spp <= 1))
        IMP_TRY(errors(ctx, f, run, weights, true, &value.se));
    if (!film) IMP_TRY(IMP_PART);
    value.value = inner_product(f, film);
    if (one_pass && f->spp > 1) {
        for (size_t p = 0; p < (size_t)film->width * (size_t)film->height; p++)
            value.se += imp__sqr((double)film->se[p * (size_t)n + (size_t)n - 1]);
        value.se = sqrt(value.se) / f->norm;
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
        return imp__error(ctx, IMP_E_ARG, "neither value nor gradient is wanted");
    IMP_RUN(ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    struct imp__functional f = {0};
    struct imp_estimate estimate = {0};
    double *weights = NULL, *g = NULL;
    float *ones = NULL;
    IMP_TRY(begin(p, adjoint, &own, &f, &weights, &ones));
    if (gradient) {
        /* A later failure must leave the caller's values unchanged. */
        if (value) g = imp__alloc(ctx, 2 * p->n, sizeof *g);
        if (value && !g) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for gradients"));
        double *mean = g ? g : gradient, *se = g ? g + p->n : gradient_se;
        st = imp_problem_reverse(p, f.adjoint, &own, mean, se);
        if (st != IMP_PART) IMP_TRY(st);
        for (size_t k = 0; st == IMP_OK && k < p->n; k++) {
            mean[k] /= f.norm;
            if (se) se[k] /= f.norm;
        }
    }
    if (value) {
        IMP_TRY(imp__problem_same(p, &own, "functional"));
        if (f.tracer.integrator->from_lights)
            IMP_TRY(imp__light_functional(&f, &own, &estimate.value, &estimate.se));
        else IMP_TRY(picture_value(ctx, &f, weights, &own, &estimate));
    }
    if (imp__team_part(ctx)) IMP_TRY(IMP_PART);
    if (value) *value = estimate;
    if (g) memcpy(gradient, g, p->n * sizeof *g);
    if (g && gradient_se) memcpy(gradient_se, g + p->n, p->n * sizeof *g);
out:
    imp__release(ctx, g);
    imp__release(ctx, weights);
    imp__release(ctx, ones);
    return st;
}

/* ---- Sums over derivative pictures --------------------------------------------- */

static enum imp_status pictures_check(const imp_problem *p,
                                      const struct imp__functional *f)
{
    for (size_t k = 0; k <= p->n; k++) {
        const imp_film *film = k < p->n ? f->films[k] : f->picture;
        if (!film || film->width != f->film->crop_w || film->height != f->film->crop_h ||
            film->channels != f->channels)
            return imp__error(p->ctx, IMP_E_ARG,
                              "the pictures are not those of this problem's sensor");
    }
    return IMP_OK;
}

/* Were all parts of these sums made with the same adjoint and groups? */
static enum imp_status sums_same(imp_problem *p, const struct imp__functional *f,
                                 const struct imp_run *run)
{
    const size_t n =
        (size_t)f->film->crop_w * (size_t)f->film->crop_h * (size_t)f->channels;
    uint64_t own = imp__hash(0, f->adjoint, n * sizeof *f->adjoint), theirs;
    bool known = false;
    enum imp_status st = IMP_OK;
    IMP_TRY(imp__problem_same(p, run, "sums of derivative pictures"));
    own = theirs = imp__hash(own, f->group, p->n * sizeof *f->group);
    IMP_TRY(imp__team_keep(p->ctx, &theirs, sizeof theirs, &known));
    if (own != theirs)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                           "the parts were made with another adjoint, or other groups"));
out:
    return st;
}

/* The same by light walks, which need no pictures. */
static enum imp_status light_errors(imp_context *ctx, const struct imp__functional *f,
                                    const struct imp_run *run, double *se)
{
    const size_t n = 1 + (size_t)f->n_groups;
    struct imp_run own = *run;
    own.spp = imp__error_spp(f->spp);
    double *mean = imp__alloc(ctx, n, sizeof *mean);
    if (!mean) return imp__error(ctx, IMP_E_NOMEM, "no memory for sums");
    const enum imp_status st = imp__light_functional(f, &own, mean, se);
    for (size_t k = 0; st == IMP_OK && k < n; k++)
        se[k] *= sqrt((double)own.spp / f->spp);
    imp__release(ctx, mean);
    return st;
}

/* The part that poses have at edges: se [1 + n_groups] grows by it. */
static enum imp_status edge_errors(imp_context *ctx, const struct imp__functional *f,
                                   const struct imp_run *run, double *se)
{
    const int n = f->n_groups, spp = imp__error_spp(f->spp);
    const struct imp__moved_run r = {run, "errors", 0, spp};
    double *own = imp__alloc(ctx, (size_t)n, sizeof *own);
    if (!own) return imp__error(ctx, IMP_E_NOMEM, "no memory for sums");
    const enum imp_status st = imp__moved_sums(f->moved, f, &r, own);
    for (int g = 0; st == IMP_OK && g < n; g++)
        se[1 + g] = hypot(se[1 + g], own[g] * sqrt((double)spp / f->spp));
    imp__release(ctx, own);
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
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    const bool part = imp__team_part(ctx);
    if (!part) IMP_REQUIRE(ctx, primal, "primal");
    if (!part) IMP_REQUIRE(ctx, films, "films");
    IMP_REQUIRE(ctx, sums, "sums");
    if (p->n == 0) return imp__error(ctx, IMP_E_ARG, "no parameter is active");
    IMP_RUN(ctx, own, run);
    IMP_FLOAT_MODE;
    IMP_READS(p->scene);
    const size_t n = group ? (size_t)n_groups : p->n;
    struct imp__functional f = {0};
    double *weights = NULL, *se = NULL;
    float *ones = NULL;
    int *each = NULL;
    struct imp__moved_gradient moved = {0};
    IMP_TRY(begin(p, adjoint, &own, &f, &weights, &ones));
    if (imp__problem_moves(p)) {
        IMP_TRY(imp__moved_begin(p, &f.tracer, &moved));
        IMP_TRY(imp__moved_learn(&moved, IMP_MOVED_PILOT));
        if (moved.moves.n > 0) f.moved = &moved;
    }
    f.picture = primal;
    f.films = films;
    if (!part) IMP_TRY(pictures_check(p, &f));
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
    f.derivatives = true;
    f.spp = part ? (int)imp__walks_of(&own, f.tracer.sensor) : (int)primal->spp;
    for (size_t k = 0; k <= n; k++) se[k] = NAN;
    IMP_TRY(sums_same(p, &f, &own));
    if (f.spp > 0) { /* else interrupted before every pixel had its samples */
        const enum imp_status ended = f.tracer.integrator->from_lights
                                          ? light_errors(ctx, &f, &own, se)
                                          : errors(ctx, &f, &own, weights, false, se);
        if (ended != IMP_CANCELLED && ended != IMP_PART) IMP_TRY(ended);
        if (ended != IMP_CANCELLED && f.moved) IMP_TRY(edge_errors(ctx, &f, &own, se));
        if (ended == IMP_PART) IMP_TRY(IMP_PART);
    }
    const double none = f.spp > 0 ? 0 : NAN;
    if (value)
        *value =
            (struct imp_estimate){.value = none + inner_product(&f, primal), .se = se[0]};
    for (size_t g = 0; g < n; g++)
        sums[g] = (struct imp_estimate){.value = none, .se = se[g + 1]};
    for (size_t k = 0; k < p->n; k++) sums[each[k]].value += inner_product(&f, films[k]);
out:
    imp__moved_end(&moved);
    imp__release(ctx, each);
    imp__release(ctx, se);
    imp__release(ctx, weights);
    imp__release(ctx, ones);
    return st;
}
