/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses and their gradients as imp_problem_objective makes them (leave-one-out,
 * jackknife: adjoint.c), against what the samples themselves give. A replicate of n = 2
 * samples of a pixel with radiances A, B and derivatives x_A, x_B along a direction has,
 * with M = (A + B)/2 and the loss l against target T,
 *
 *     l2, relative   value  w/2 (A - T)(B - T)        gradient  (l'(A) x_B + l'(B) x_A)/2
 *     l1             value  l(M)                      gradient  (l'(A) x_B + l'(B) x_A)/2
 *     log            value  2 l(M) - (l(A) + l(B))/2
 *                    gradient  l'(M) (x_A + x_B) - (l'(A) x_A + l'(B) x_B)/2
 *
 * Products of different samples only, so the first two lines need no argument to be
 * unbiased (of l1: the gradient of one sample's loss); the third is the jackknife. The
 * same walks are made again with tangents, and derivatives of l are taken as differences
 * of its values, so nothing but rounding is left. A leave-one-out mean divided by n in
 * place of n - 1 is wrong by a factor 2 here.
 *
 * Pixels have a box filter, whatever the sensor's: through wider ones a pixel is a ratio
 * of sums over its neighbours' samples too. */
#include "check.h"
#include "film/film_picture.h"
#include "inverse/problem/loss.h"
#include "walk/path/baseline.h"
#include <math.h>
#include <string.h>

#define N       4    /* samples of a pixel: two replicates of two */
#define LIMIT   1e-6 /* radiances are rounded to floats, 6e-8 of each */
#define EPSILON 1e-2 /* of the relative and the log loss, as targets have it */
#define STEP    1e-4 /* of differences of l, relative to the radiance */
#define KINDS   4

static const struct {
    enum imp_loss loss;
    const char *value, *gradient;
} kinds[KINDS] = {{IMP_LOSS_L2, "l2", "l2 gradient"},
                  {IMP_LOSS_RELATIVE_L2, "relative", "relative gradient"},
                  {IMP_LOSS_L1, "l1", "l1 gradient"},
                  {IMP_LOSS_LOG, "log", "log gradient"}};

struct losses {
    struct imp__check *check;
    size_t channels, values; /* values of a picture */
    uint64_t seed;
    float *T;           /* [values] */
    double *x_dot;      /* [n active] */
    double *g;          /* [n active] */
    imp_film *films[N]; /* sample i of every pixel: [2 channels] radiance, tangent */
};

/* ---- Samples ------------------------------------------------------------------- */

struct pass {
    struct imp_tracer tracer;
    const double *x_dot;
    size_t channels;
};

static void sample(const void *payload, struct imp_sample *s)
{
    const struct pass *p = payload;
    struct imp_walk walk;
    imp__sample_walk(s, &p->tracer, &walk);
    const imp_spec tangent = imp__walk_tangent(&p->tracer, &walk, p->x_dot);
    for (size_t c = 0; c < p->channels; c++) {
        s->value[c] = walk.L[c];
        s->value[p->channels + c] = tangent[c];
    }
}

static enum imp_status samples_make(struct losses *l)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = l->check;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    struct imp_tracer tracer = c->tracer;
    tracer.seed = l->seed;
    /* That of the losses: their gradients are compared walk by walk. */
    IMP_TRY(imp__baseline_set(&tracer, (int64_t)N * film->crop_w * film->crop_h));
    for (int i = 0; i < N; i++) {
        struct pass pass = {tracer, l->x_dot, l->channels};
        const struct imp_picture picture = {.sensor = c->tracer.sensor,
                                            .stage = "check",
                                            .names =
                                                l->channels == 3 ? "0,1,2,3,4,5" : "0,1",
                                            .n = (int)(2 * l->channels),
                                            .sample = sample,
                                            .payload = &pass,
                                            .first = i};
        struct imp_run run = c->run;
        run.spp = 1;
        IMP_TRY(imp__picture_make(c->ctx, &picture, &run, &l->films[i]));
    }
out:
    return st;
}

/* Every value by about its size, to the side where the picture becomes brighter, so that
 * nothing cancels. */
static enum imp_status direction_make(struct losses *l)
{
    struct imp__check *c = l->check;
    struct imp_run run = c->run;
    run.spp = N;
    run.seed = l->seed;
    for (size_t i = 0; i < l->values; i++) l->T[i] = 1;
    const enum imp_status st = imp_problem_reverse(c->problem, l->T, &run, l->g, NULL);
    for (size_t k = 0; st == IMP_OK && k < c->problem->scene->n_params; k++) {
        const struct imp_param *p = &c->problem->scene->params[k];
        const int64_t base = c->problem->active.base[k];
        for (size_t e = 0; base >= 0 && e < p->info.count; e++) {
            const size_t i = (size_t)base + e;
            const double u = 0.5 + imp__u01(imp__key(11, i, 0), 0);
            l->x_dot[i] = copysign(u * imp__check_scale(p, e), l->g[i]);
        }
    }
    return st;
}

static double radiance(const struct losses *l, int i, size_t k)
{
    return l->films[i]->mean[k / l->channels * 2 * l->channels + k % l->channels];
}
static double tangent(const struct losses *l, int i, size_t k)
{
    const size_t C = l->channels;
    return l->films[i]->mean[k / C * 2 * C + C + k % C];
}

/* True if T is so close to a sample, or to the mean of two, that a difference would step
 * over the kink of l1. */
static bool near_kink(const struct losses *l, size_t k, double T)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double M = (radiance(l, i, k) + radiance(l, j, k)) / 2;
            if (fabs(M - T) < 0.01 * (M + T)) return true;
        }
    return false;
}

/* Random targets of the size of the mean radiance. */
static void target_make(struct losses *l)
{
    double mean = 0;
    for (size_t k = 0; k < l->values; k++)
        for (int i = 0; i < N; i++) mean += radiance(l, i, k) / (double)(N * l->values);
    for (size_t k = 0; k < l->values; k++) {
        double T = mean * (0.2 + 1.6 * imp__u01(imp__key(12, k, 0), 0));
        while (T > 0 && near_kink(l, k, T)) T *= 0.95;
        l->T[k] = (float)T;
    }
}

/* ---- Expected from the samples ------------------------------------------------- */

static double loss(enum imp_loss kind, double I, double T)
{
    struct imp__loss_at at;
    imp__loss_eval(kind, 1, EPSILON, I, T, &at);
    return at.value;
}

/* l'(I): central differences, or at 0 the one-sided formula of second order. Single walks
 * that carry wavelengths may be outside the gamut; log takes what is below 0 for 0. */
static double slope(enum imp_loss kind, double I, double T)
{
    if (kind == IMP_LOSS_LOG) I = fmax(I, 0);
    const double h = STEP * fmax(I, EPSILON);
    if (I > h) return (loss(kind, I + h, T) - loss(kind, I - h, T)) / (2 * h);
    return (4 * loss(kind, I + h, T) - 3 * loss(kind, I, T) - loss(kind, I + 2 * h, T)) /
           (2 * h);
}

struct expected {
    double value, gradient;
    double value_size, gradient_size; /* sums of the terms' sizes: for rounding */
};

static void term(double t, double *sum, double *size)
{
    *sum += t;
    *size += fabs(t);
}

static void pair_add(enum imp_loss kind, double T, double A, double B, double x_A,
                     double x_B, struct expected *e)
{
    const double M = (A + B) / 2, of_A = slope(kind, A, T), of_B = slope(kind, B, T);
    double *v = &e->value, *v_size = &e->value_size;
    double *g = &e->gradient, *g_size = &e->gradient_size;
    if (kind == IMP_LOSS_LOG) {
        term(2 * loss(kind, M, T), v, v_size);
        term(-(loss(kind, A, T) + loss(kind, B, T)) / 2, v, v_size);
        term(slope(kind, M, T) * (x_A + x_B), g, g_size);
        term(-(of_A * x_A + of_B * x_B) / 2, g, g_size);
        return;
    }
    if (imp__loss_quadratic(kind)) { /* A B = M^2 - (A - B)^2/4, relative to T */
        term(loss(kind, M, T), v, v_size);
        term(-loss(kind, T + (A - B) / 2, T), v, v_size);
    } else {
        term(loss(kind, M, T), v, v_size);
    }
    term(of_A * x_B / 2, g, g_size);
    term(of_B * x_A / 2, g, g_size);
}

static struct expected expected(const struct losses *l, enum imp_loss kind)
{
    struct expected e = {0};
    for (size_t k = 0; k < l->values; k++)
        for (int i = 0; i < N; i += 2)
            pair_add(kind, l->T[k], radiance(l, i, k), radiance(l, i + 1, k),
                     tangent(l, i, k), tangent(l, i + 1, k), &e);
    const double replicates = N / 2;
    e.value /= replicates, e.value_size /= replicates;
    e.gradient /= replicates, e.gradient_size /= replicates;
    return e;
}

/* ---- What imp_problem_objective makes of them ---------------------------------- */

/* A problem with the same active values, and our target alone. */
static enum imp_status problem_make(struct losses *l, enum imp_loss kind,
                                    imp_problem **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *from = l->check->problem;
    const struct imp_film_desc *film = &l->check->tracer.sensor->film;
    struct imp_target t = IMP_TARGET_INIT;
    imp_problem *p = NULL;
    IMP_TRY(imp_problem_create(from->scene, &p));
    memcpy(p->chosen, from->chosen, from->scene->n_params);
    imp__active_destroy(p->ctx, &p->active);
    IMP_TRY(imp__active_create(from->scene, p->chosen, &p->active));
    p->n = p->active.n;
    t.sensor = l->check->outer.sensor;
    t.width = film->crop_w;
    t.height = film->crop_h;
    t.channels = (int)l->channels;
    t.loss = kind;
    t.epsilon = EPSILON;
    t.pixels = l->T;
    IMP_TRY(imp_problem_add_target(p, &t));
    *out = p;
    p = NULL;
out:
    imp_problem_destroy(p);
    return st;
}

static enum imp_status row_add(struct losses *l, const char *name, double value,
                               double reference, double size)
{
    struct imp_check_row row = {.value = value, .reference = reference, .limit = LIMIT};
    row.error = value == reference ? 0 : fabs(value - reference) / size;
    row.ok = row.error <= row.limit;
    return imp__check_row(l->check, "loss", name, -1, &row);
}

static enum imp_status check_loss(struct losses *l, int k)
{
    enum imp_status st = IMP_OK;
    const struct expected e = expected(l, kinds[k].loss);
    struct imp_run run = l->check->run;
    struct imp_estimate value;
    double gradient = 0, size = 0;
    imp_problem *p = NULL;
    IMP_TRY(problem_make(l, kinds[k].loss, &p));
    run.spp = N;
    run.seed = l->seed;
    IMP_TRY(imp_problem_objective(p, NULL, &run, &value, l->g, NULL));
    for (size_t i = 0; i < p->n; i++) {
        gradient += l->g[i] * l->x_dot[i];
        size += fabs(l->g[i] * l->x_dot[i]);
    }
    IMP_TRY(row_add(l, kinds[k].value, value.value, e.value, e.value_size));
    IMP_TRY(
        row_add(l, kinds[k].gradient, gradient, e.gradient, fmax(size, e.gradient_size)));
    st = imp__check_progress(l->check, 1);
out:
    imp_problem_destroy(p);
    return st;
}

/* Both sides differ by rounding alone, so a part of a large picture tests as much as all
 * of it: a window in its middle, or the whole picture if the window is dark. */
#define WINDOW 48

static void window_set(struct imp_film_desc *film)
{
    const int w = imp_min(film->crop_w, WINDOW), h = imp_min(film->crop_h, WINDOW);
    film->crop_x += (film->crop_w - w) / 2;
    film->crop_y += (film->crop_h - h) / 2;
    film->crop_w = w;
    film->crop_h = h;
}

static void losses_free(struct losses *l)
{
    for (int i = 0; i < N; i++) imp_film_destroy(l->films[i]);
    imp__release(l->check->ctx, l->T);
    imp__release(l->check->ctx, l->x_dot);
}

static bool any_light(const struct losses *l)
{
    for (int i = 0; i < N; i++)
        for (size_t k = 0; k < l->values; k++)
            if (radiance(l, i, k) > 0) return true;
    return false;
}

/* Samples of the film with its present window. */
static enum imp_status losses_begin(struct imp__check *c, struct losses *out)
{
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    struct losses l = {.check = c,
                       .channels = (size_t)c->problem->scene->channels,
                       .seed = imp__mix64(c->outer.seed ^ 0x10557)};
    l.values = (size_t)film->crop_w * (size_t)film->crop_h * l.channels;
    l.T = imp__alloc(c->ctx, l.values, sizeof *l.T);
    l.x_dot = imp__alloc(c->ctx, 2 * c->problem->n, sizeof *l.x_dot);
    if (!l.T || !l.x_dot)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    l.g = l.x_dot + c->problem->n;
    IMP_TRY(direction_make(&l));
    IMP_TRY(samples_make(&l));
out:
    if (st != IMP_OK) losses_free(&l);
    else *out = l;
    return st;
}

enum imp_status imp__check_losses(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    struct imp_film_desc *film = &c->problem->scene->sensors[c->outer.sensor]->film;
    const struct imp_film_desc whole = *film;
    struct losses l = {.check = c};
    film->filter.radius = 0.5; /* a sample belongs to its own pixel alone */
    window_set(film);
    c->total = c->done + KINDS;
    IMP_TRY(losses_begin(c, &l));
    if (!any_light(&l) && (film->crop_w < whole.crop_w || film->crop_h < whole.crop_h)) {
        losses_free(&l);
        l = (struct losses){.check = c};
        *film = whole;
        film->filter.radius = 0.5;
        IMP_TRY(losses_begin(c, &l));
    }
    target_make(&l);
    for (int k = 0; k < KINDS; k++) IMP_TRY(check_loss(&l, k));
out:
    *film = whole;
    losses_free(&l);
    return st;
}
