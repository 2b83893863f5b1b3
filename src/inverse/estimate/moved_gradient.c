/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses, inside walks and at edges (moved_gradient.h). */
#include "moved_gradient.h"
#include "base/arguments.h"
#include "problem_tracer.h"
#include "scene/pose.h"
#include "walk/path/first_segment.h"
#include <math.h>
#include <string.h>

const int imp__moved_times[IMP_BOUNDARY_KINDS] = {
    [IMP_BOUNDARY_FILM] = 1, [IMP_BOUNDARY_LIGHT] = 1, [IMP_BOUNDARY_SCATTER] = 4};

static const struct imp_pose *next_active(const struct imp_problem *p,
                                          const struct imp_pose *from)
{
    while (from && (p->active.base[from->param] < 0 || !imp__pose_moves(from)))
        from = from->next;
    return from;
}

/* Movers for each active pose, about where the object's centre is now. */
static enum imp_status movers_add(const struct imp_problem *p,
                                  struct imp__moved_gradient *m)
{
    const struct imp_sensor *sensor = m->tracer->sensor;
    const int instances = imp__pose_instances(p->scene);
    int n = 0, others = 0; /* active parameters that are no pose */
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next)
        n += q->group >= 0 ? instances : 1;
    m->pose = imp__alloc(p->ctx, (size_t)n, sizeof *m->pose);
    if (!m->pose) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for poses");
    for (size_t i = 0; i < p->scene->n_params; i++) others += p->active.base[i] >= 0;
    for (const struct imp_pose *q = next_active(p, p->scene->poses); q;
         q = next_active(p, q->next)) {
        others--;
        if (q->sensor && q->sensor != sensor) continue; /* it is not looked through */
        const int before = m->moves.n_movers;
        IMP_CHECKED(imp__moves_add_pose(&m->moves, q));
        for (int k = before; k < m->moves.n_movers; k++) m->pose[k] = q;
    }
    m->alone = others == 0;
    return IMP_OK;
}

enum imp_status imp__moved_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer,
                                 struct imp__moved_gradient *out)
{
    enum imp_status st = IMP_OK;
    *out = (struct imp__moved_gradient){.tracer = tracer};
    for (int k = 0; k < IMP_BOUNDARY_KINDS; k++) out->draws[k] = imp__moved_times[k];
    out->moves = imp__moves_begin(p->scene, tracer->sensor);
    out->moves.seams_join = p->seams_join;
    if (imp__segment_first(tracer)->through)
        out->moves.borders = imp__borders_of(p->scene, tracer->sensor->medium);
    IMP_TRY(imp__moved_allowed(tracer));
    IMP_TRY(movers_add(p, out));
    IMP_TRY(imp__edges_build(
        p->scene, out->moves.borders.any ? IMP_EDGES_BUT_BORDERS : IMP_EDGES_ALL,
        &out->edges));
    IMP_TRY(imp__boundary_begin(tracer, &out->moves, &out->edges, &out->boundary));
    IMP_TRY(imp__splat_scale_create(p->ctx, &tracer->sensor->film, &out->scale));
out:
    return st;
}

enum imp_status imp__moved_possible(struct imp_problem *p, const struct imp_run *run)
{
    struct imp__moved_gradient m = {0};
    struct imp_tracer tracer;
    struct imp_run own = *run;
    p->edge_terms = true;
    enum imp_status st =
        p->n_targets > 0
            ? imp__target_tracer(p, imp__target_part(&p->targets[0], 0), 0, &own, &tracer)
            : imp__problem_tracer_of_any_end(p, &own, NULL, &tracer);
    p->edge_terms = false;
    if (st == IMP_OK) st = imp__moved_begin(p, &tracer, &m);
    imp__moved_end(&m);
    return st;
}

void imp__moved_end(struct imp__moved_gradient *m)
{
    if (!m->tracer) return;
    imp_context *ctx = m->tracer->scene->ctx;
    imp__moved_adjoint_free(&m->adjoint);
    imp__splat_scale_destroy(ctx, &m->scale);
    imp__boundary_free(&m->boundary);
    if (m->edges.ctx) imp__edges_free(&m->edges);
    imp__moves_free(&m->moves);
    imp__release(ctx, m->pose);
    *m = (struct imp__moved_gradient){0};
}

/* A replicate touches few of many numbers: the others are passed over eight at a time. */
static inline bool is_empty(const double *v, size_t k, size_t n)
{
    uint64_t bits = 0, one;
    if (k % 8 != 0 || k + 8 > n) return false;
    for (int i = 0; i < 8; i++) {
        memcpy(&one, v + k + i, sizeof one);
        bits |= one;
    }
    return bits == 0;
}

void imp__moved_numbers(const struct imp__moved_gradient *m, double *bar, imp_spec lane,
                        struct imp_sink *sink)
{
    for (int k = 0; k < m->moves.n_movers; k++) {
        const struct imp_pose *pose = m->pose[k];
        double *own = bar + m->moves.mover[k].first;
        imp__pose_numbers_bar(&m->moves, &m->moves.mover[k], pose, own);
        for (size_t e = 0; e < pose->n; e++) {
            if (is_empty(own, e, pose->n)) {
                e += 7;
                continue;
            }
            const imp_spec lanes = lane * own[e];
            if (own[e] != 0) sink->add(sink, pose->param, e, 1, &lanes);
        }
    }
}

static double counts_at(const void *payload, const struct imp__flux *f, double *contrast)
{
    const struct imp__moved_gradient *m = payload;
    return imp__moved_adjoint_at(&m->adjoint, &m->scale, f->px, f->py, &f->L,
                                 m->adjoint.contrasts > 0 ? contrast : NULL);
}

#define LOSS_WALKS 4  /* for a draw of each kind */
#define LOSS_EDGE  64 /* draws for an edge */
/* Costs, in those of a draw from an edge that the camera sees: of the pilot for a draw of each kind that
 * is said to follow, and of an edge on the list. */
#define PILOT 0.4
#define EDGE  0.6

enum imp_status imp__moved_learn(struct imp__moved_gradient *m, int spp)
{
    const struct imp_sensor *sensor = m->tracer->sensor;
    const struct imp_film_desc *film = &sensor->film;
    const int64_t walks =
        (int64_t)film->crop_w * film->crop_h * (spp > 0 ? spp : sensor->spp);
    m->walks = (double)walks;
    /* In a loss a fraction of a draw of each kind follows for each walk (imp__moved_share); many edges
     * need a pilot that sees them. */
    const int64_t few = imp_max(walks / LOSS_WALKS, (int64_t)m->edges.n * LOSS_EDGE),
                  draws = m->adjoint.pairs > 0 ? imp_min(few, walks) : walks;
    m->ahead = PILOT * (double)draws + EDGE * (double)m->edges.n;
    /* As many contrasts of few numbers as of many, so that draws do not depend on the others. */
    return imp__boundary_learn(
        &m->boundary, draws, m->adjoint.image ? counts_at : NULL,
        m->adjoint.image ? imp_min(m->adjoint.contrasts, IMP_CONTRASTS_MANY) : 0, m);
}

/* With second moments M of one draw, n draws of a kind add M/n to the variance, and cost n c: of the
 * cost S of a walk's draws, n is in proportion to sqrt(M/c), and W walks have
 *
 *     Var = V + B/(W S),    B = (sum of sqrt(M c))^2,
 *
 * in the time W (a + S), with V the variance of the rest: that of the adjoint's noise, which the pilot
 * has seen. Their product is least at S^2 = a B/(V W), and nowhere between a/2 and 3 a more than 1.5
 * times that. S stays there, since what the pilot knows of V may be all wrong. Costs are relative to
 * that of an edge that the camera sees; a is that of a walk, with its part of what came before. What the
 * pilot says of moments are those of the best chances, about half of what draws have, and light that is
 * scattered brings much by few draws, of which it may have seen none. */
#define WALK    0.25
#define MOMENTS 2   /* true ones over those of the pilot */
#define LEAST   0.5 /* S over a */
#define UNKNOWN 2   /* where the pilot saw none of V */
#define MOST    3
#define UNSEEN  2 /* S, where it did not look, and more of the rare light */
#define RARE    4
static const double cost[IMP_BOUNDARY_KINDS] =
    {[IMP_BOUNDARY_FILM] = 1, [IMP_BOUNDARY_LIGHT] = 1, [IMP_BOUNDARY_SCATTER] = 0.35},
                    least[IMP_BOUNDARY_KINDS] = {[IMP_BOUNDARY_FILM] = 0.03,
                                                 [IMP_BOUNDARY_LIGHT] = 0.06,
                                                 [IMP_BOUNDARY_SCATTER] = 0.2};

void imp__moved_share(struct imp__moved_gradient *m)
{
    const double *moment = m->boundary.moment, V = m->boundary.noise;
    const double a = WALK + m->ahead / m->walks,
                 rare = m->adjoint.contrasts > 0 ? 1 : RARE;
    double sum = 0, S = m->adjoint.contrasts > 0 ? UNKNOWN * a : UNSEEN;
    for (int k = 0; k < IMP_BOUNDARY_KINDS; k++) sum += sqrt(moment[k] * cost[k]);
    if (!(sum > 0) || !(sum < INFINITY)) return;
    if (m->adjoint.contrasts > 0 && V > 0)
        S = imp_clamp(sum * sqrt(MOMENTS * a / (V * m->walks)), LEAST * a, MOST * a);
    for (int k = 0; k < IMP_BOUNDARY_KINDS; k++)
        m->draws[k] = imp_max(S * sqrt(moment[k] / cost[k]) / sum, rare * least[k]);
}

bool imp__moved_walk(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, imp_spec adjoint, double *bar)
{
    return imp__moved_sweep(m->tracer, arena, &m->moves, walk,
                            imp__walk_values(m->tracer, walk, adjoint), bar);
}

/* ---- Draws of a replicate ----------------------------------------------------------- */

struct draws {
    const struct imp__moved_gradient *m;
    double *velocity; /* [moves.n] of a flux; 0 between fluxes */
    double *bar;      /* [moves.n] sum over draws */
    double *half[2];  /* [moves.n][contrasts]; NULL: not wanted */
};

/* floor(k n/of), whose product may be beyond 64 bits. */
static int64_t part_of(int64_t k, int64_t n, int64_t of)
{
    return (int64_t)((__int128)k * n / of);
}

/* A number that a flux depends on. */
static void number_count(const struct draws *d, size_t number, double counts,
                         const double *contrast, double *half)
{
    const int all = d->m->adjoint.contrasts;
    const double v = d->velocity[number];
    if (v == 0) return; /* of no use, or counted already */
    d->velocity[number] = 0;
    d->bar[number] += counts * v;
    if (!half) return;
    half += number * (size_t)all;
    for (int k = 0; k < all; k++) half[k] += contrast[k] * v;
}

static void flux_add(const struct draws *d, const struct imp__flux *f, double weight,
                     int half)
{
    const struct imp__moves *moves = &d->m->moves;
    double contrast[IMP_CONTRASTS];
    const double counts =
        imp__moved_adjoint_at(&d->m->adjoint, &d->m->scale, f->px, f->py, &f->L,
                              d->half[half] ? contrast : NULL) *
        weight;
    /* Half of the draws of all replicates. */
    for (int k = 0; d->half[half] && k < d->m->adjoint.contrasts; k++)
        contrast[k] *= weight / d->m->adjoint.pairs;
    imp__flux_bar(moves, f, 1, d->velocity);
    for (int i = 0; i < f->n_ends; i++)
        for (int k = 0; k < moves->n_movers; k++) {
            const struct imp__mover *m = &moves->mover[k];
            if (imp__flux_end_shape(&f->end[i]) != m->shape) continue;
            size_t index[IMP_TOUCHED_MOST];
            const size_t n = imp__mover_touched(moves, m, &f->end[i].x, index);
            for (size_t j = 0; j < n; j++)
                number_count(d, index[j], counts, contrast, d->half[half]);
        }
}

static bool draws_add(const struct draws *d, struct imp_arena *arena,
                      struct imp__replicates plan, int x, int y, int b)
{
    const struct imp__moved_gradient *m = d->m;
    const struct imp_film_desc *film = &m->tracer->sensor->film;
    const int margin = m->scale.margin, width = film->crop_w + 2 * margin;
    const int64_t pixels = (int64_t)width * (film->crop_h + 2 * margin);
    const int64_t pixel = (int64_t)(y + margin) * width + x + margin;
    bool no_memory = false;
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
        /* They are those of all pixels; this one has its part of them, which may be none. */
        const int64_t n = imp_max(
            (int64_t)llround(plan.n * m->draws[kind] * (double)pixels), (int64_t)1);
        const int64_t first = part_of(pixel, n, pixels),
                      behind = part_of(pixel + 1, n, pixels);
        for (int64_t i = first; i < behind; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(arena);
            const struct imp__flux *f = imp__boundary_draw(
                &m->boundary, arena, (enum imp__boundary_kind)kind, m->first + b * n + i,
                (struct imp__stratum){i, n}, &no_memory);
            for (; f; f = f->next) flux_add(d, f, 1 / (double)n, (i + b) & 1);
            imp__arena_rewind(arena, mark);
        }
    }
    return !no_memory;
}

bool imp__moved_replicate(const struct imp__moved_gradient *m, struct imp_arena *arena,
                          struct imp__replicates plan, int x, int y, int b, bool draws,
                          double *inside, double *contrasts, struct imp_sink *sink)
{
    const size_t n = m->moves.n, part = (size_t)m->adjoint.contrasts * n;
    const int all = contrasts ? m->adjoint.contrasts : 0;
    struct draws d = {.m = m, .velocity = inside + n, .bar = inside + 2 * n};
    if (contrasts) {
        d.half[0] = contrasts + part;
        d.half[1] = contrasts + 2 * part;
    }
    if (draws && !draws_add(&d, arena, plan, x, y, b)) return false;
    const uint64_t signs = contrasts ? imp__contrast_signs(&m->adjoint, x, y, b / 2) : 0;
    const double share = contrasts ? (b % 2 ? -0.5 : 0.5) / m->adjoint.pairs : 0;
    for (size_t e = 0; e < n; e++) {
        if (is_empty(inside, e, n)) {
            e += 7;
            continue;
        }
        if (inside[e] == 0) continue;
        for (int k = 0; k < all; k++)
            contrasts[e * (size_t)all + (size_t)k] +=
                imp__contrast_sign(signs, k) * share * inside[e];
        d.bar[e] += inside[e];
        inside[e] = 0;
    }
    imp__moved_numbers(m, d.bar, (imp_spec){1, 0, 0, 0}, sink);
    for (size_t e = 0; e < n; e++)
        if (is_empty(d.bar, e, n)) e += 7;
        else d.bar[e] = 0;
    return true;
}

bool imp__moved_draws(const struct imp__moved_gradient *m, struct imp_arena *arena,
                      struct imp__replicates plan, int x, int y, int b, double *bar,
                      double *velocity)
{
    const struct draws d = {.m = m, .velocity = velocity, .bar = bar};
    return draws_add(&d, arena, plan, x, y, b);
}

/* ---- Variance ------------------------------------------------------------------------ */

/* Numbers of poses among the active numbers. */
struct numbers {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    double *value; /* [active->n] */
};

static void number_add(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    const struct numbers *s = (const struct numbers *)sink;
    (void)channels;
    if (s->active->base[param] < 0) return;
    s->value[imp__active_at(s->active, param, element)] +=
        (*bar)[0] * imp__active_slope(s->active, param, element);
}

/* Not below this part of the variance at fixed adjoints, where contrasts, which are few, say that
 * the noise of A takes the rest away. */
#define LEAST_PART 0.1

enum imp_status imp__moved_variance(const struct imp__moved_gradient *m,
                                    const struct imp_active *active,
                                    const double *contrasts, const double *own,
                                    double *more)
{
    imp_context *ctx = m->tracer->scene->ctx;
    const size_t n = active->n, N = m->moves.n, all = (size_t)m->adjoint.contrasts;
    double *value = imp__alloc(ctx, 3 * n + N, sizeof *value), *bar = value + 3 * n;
    if (!value) return imp__error(ctx, IMP_E_NOMEM, "no memory for errors");
    memset(more, 0, n * sizeof *more);
    for (size_t c = 0; c < all; c++) {
        memset(value, 0, 3 * n * sizeof *value);
        for (size_t part = 0; part < 3; part++) {
            struct numbers s = {{number_add, false}, active, value + part * n};
            for (size_t e = 0; e < N; e++) bar[e] = contrasts[(part * N + e) * all + c];
            imp__moved_numbers(m, bar, (imp_spec){1, 0, 0, 0}, &s.sink);
        }
        for (size_t k = 0; k < n; k++) {
            const double inside = value[k], one = value[n + k], other = value[2 * n + k];
            more[k] += (inside * (one + other) + one * other) / (double)all;
        }
    }
    for (size_t k = 0; k < n; k++)
        if (more[k] != 0) more[k] = fmax(more[k], (LEAST_PART - 1) * own[k]);
    imp__release(ctx, value);
    return IMP_OK;
}
