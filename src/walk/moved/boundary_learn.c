/* SPDX-License-Identifier: Apache-2.0
 *
 * The pilot of the boundary (boundary.h): draws whose second moments, by cells of the list of edges,
 * become chances of later draws. Shifts and turns of a mover have different units: a first quarter
 * of the draws finds the sums of their squares, by which the others divide. */
#include "base/context.h"
#include "boundary_parts.h"

enum { LOOKS_LEAST = 2, LOOKS = 8, PART = 8 };

struct pilot {
    struct imp__boundary *b;
    struct imp_arena arena;
    imp__flux_weight *weight;
    const void *payload;
    int n_groups;
    double *group; /* [n_groups] of one draw: 3 for a shift, 3 for a turn of each mover */
    double *square; /* [n_groups] sums over the first draws, of each three alike */
    double *moment; /* [cells] */
    double *shift;  /* [cells] sums of squares of what shifts alone bring */
    int contrasts;
    /* [2][contrasts][3 movers] what the noise of light brings to shifts, by two halves of the draws, each
     * as the mean over so many. */
    double *noise[2], times;
    bool no_memory;
};

static double light_of(const struct pilot *x, const struct imp__flux *f, double *contrast)
{
    if (x->weight) return x->weight(x->payload, f, contrast);
    return imp__sum_used(f->L, x->b->tracer->scene->channels);
}

/* A shift of mover k by the noise of a flux. */
static void noise_add(struct pilot *x, int half, int k, imp_v3 shift,
                      const double *contrast)
{
    const size_t n = 3 * (size_t)x->b->moves->n_movers;
    for (int c = 0; c < x->contrasts; c++)
        for (int j = 0; j < 3; j++)
            x->noise[half][(size_t)c * n + (size_t)(3 * k + j)] +=
                x->times * contrast[c] * shift[j];
}

/* What a flux makes of a shift of each mover, and of a turn about its centre. half: of the draws whose
 * noise counts; -1: not of those. */
static void groups_add(struct pilot *x, const struct imp__flux *f, int half)
{
    const struct imp__moves *moves = x->b->moves;
    double contrast[IMP_FLUX_CONTRASTS];
    const double light = light_of(x, f, contrast);
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        for (int i = 0; i < f->n_ends; i++) {
            const struct imp__flux_end *e = &f->end[i];
            if (imp__flux_end_shape(e) != m->shape) continue;
            imp_v3 turn = imp__cross(e->x.p - m->centre, e->bar.v);
            if (e->x.smooth || !imp__is_zero(e->bar.n))
                turn +=
                    imp__cross(e->x.n, e->bar.n) + imp__cross(e->x.shade, e->bar.shade);
            if (half >= 0) noise_add(x, half, k, e->bar.v, contrast);
            for (int j = 0; j < 3; j++) {
                x->group[6 * k + j] += light * e->bar.v[j];
                x->group[6 * k + 3 + j] += light * turn[j];
            }
        }
    }
}

/* One draw; false: it brings nothing. half: as of groups_add. */
static bool look(struct pilot *x, enum imp__boundary_kind kind, int64_t index, int64_t n,
                 int half, struct imp__edge_draw *d)
{
    const struct imp_arena_mark mark = imp__arena_mark(&x->arena);
    *d = (struct imp__edge_draw){
        .b = x->b, .arena = &x->arena, .choice = &x->b->choice[kind]};
    d->key = imp__key(x->b->tracer->seed,
                      UINT64_MAX - IMP_BOUNDARY_KINDS - (uint64_t)kind, (uint64_t)index);
    d->u = ((double)(index % n) + imp__u01(d->key, IMP_EDGE_WHICH)) / (double)n;
    d->u = imp_min(d->u, 1 - 0x1p-53);
    for (int k = 0; k < x->n_groups; k++) x->group[k] = 0;
    imp__boundary_work(d, kind);
    for (const struct imp__flux *f = d->first; f; f = f->next) groups_add(x, f, half);
    imp__arena_rewind(&x->arena, mark);
    x->no_memory |= d->no_memory;
    return d->first != NULL;
}

static double square3(const double *v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

#define KEPT 0.3 /* probability that stays as it was, of spheres and edges */
/* The same along the list of edges; and where they may be seen over chains that few draws find, which a pilot
 * misses, and whose roots count for much. */
#define KEPT_ALONG 0.15
#define KEPT_BENT  0.5

/* Spheres and edges by roots of the second moments that each would have alone. What is counted of one
 * that was chosen with the probability c is that moment over c. */
static void parts_learn(const struct pilot *x, double *part, int n_cells)
{
    const int n = x->b->n_items;
    const double edges = part[n + 1] - part[n];
    double root = 0, sum = 0, before = 0;
    for (int k = 0; k < n_cells; k++) root += sqrt(x->moment[k]);
    if (n_cells > 0) root *= sqrt(edges / n_cells);
    for (int k = 0; k < n; k++)
        sum += sqrt((part[k + 1] - part[k]) * x->moment[n_cells + k]);
    sum += root;
    if (!(sum > 0) || !(sum < INFINITY)) return;
    for (int k = 0; k < n; k++) {
        const double own = part[k + 1] - before; /* part[k] has been overwritten */
        const double found = sqrt(own * x->moment[n_cells + k]) / sum;
        before = part[k + 1];
        part[k + 1] = part[k] + KEPT * own + (1 - KEPT) * found;
    }
    if (edges == 0) part[n] = 1;
}

/* The second moment of what a draw brings to shifts, when cells and items have their best chances: with
 * w_c the part of it that cell c of probability q_c has, (sum_c sqrt(w_c q_c))^2. part: before they learn. */
static double moment_after(const struct pilot *x, const double *part, int n_cells,
                           int64_t n)
{
    const int items = x->b->n_items;
    double sum = 0;
    for (int k = 0; k < n_cells; k++)
        sum += sqrt(x->shift[k] * (part[items + 1] - part[items]) / n_cells);
    for (int k = 0; k < items; k++)
        sum += sqrt(x->shift[n_cells + k] * (part[k + 1] - part[k]));
    return sum * sum / (double)n;
}

static void kind_learn(struct pilot *x, enum imp__boundary_kind kind, int64_t n)
{
    struct imp__edge_choice *c = &x->b->choice[kind];
    struct imp__edge_draw d;
    for (int k = 0; k < x->n_groups; k++) x->square[k] = 0;
    for (int k = 0; k < c->n_cells + x->b->n_items; k++) x->moment[k] = x->shift[k] = 0;
    x->times = 2.0 / (double)n;
    for (int64_t i = 0; i < n / 4; i++) {
        if (!look(x, kind, i, n / 4, -1, &d)) continue;
        for (int k = 0; k < x->n_groups; k += 3) x->square[k] += square3(x->group + k);
    }
    for (int64_t i = 0; i < n; i++) {
        if (!look(x, kind, n + i, n, (int)(i & 1), &d)) continue;
        double sum = 0;
        for (int k = 0; k < x->n_groups; k += 6)
            x->shift[d.cell] += square3(x->group + k);
        for (int k = 0; k < x->n_groups; k += 3)
            if (x->square[k] > 0) sum += square3(x->group + k) / x->square[k];
        x->moment[d.cell] += sum;
    }
    x->b->moment[kind] = moment_after(x, x->b->part[kind], c->n_cells, n);
    if (x->b->edges->n > 0)
        imp__edge_choice_learn(c, x->moment,
                               x->b->n_benders > 0 ? KEPT_BENT : KEPT_ALONG);
    if (x->b->n_items > 0) parts_learn(x, x->b->part[kind], c->n_cells);
}

/* The mean over contrasts of the squares of their sums; by two halves of the draws, whose own noise is
 * not counted so. */
static double noise_of(const struct pilot *x)
{
    const size_t n = 3 * (size_t)x->b->moves->n_movers * (size_t)x->contrasts;
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += x->noise[0][k] * x->noise[1][k];
    return x->contrasts > 0 ? sum / x->contrasts : 0;
}

/* Where edges are more than the first draws, few of these see one that matters, and rare ones that bring
 * much, above all of scattered light, none. Draws by what they have found tell second moments and the noise
 * of light better. Moments are halved, as those of the best chances are (moment_after). */
static void look_again(struct pilot *x, int64_t n)
{
    const size_t sums = 3 * (size_t)x->b->moves->n_movers * (size_t)x->contrasts;
    struct imp__edge_draw d;
    for (int h = 0; h < 2; h++)
        for (size_t k = 0; k < sums; k++) x->noise[h][k] = 0;
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS; kind++) {
        double sum = 0;
        for (int64_t i = 0; i < n; i++) {
            if (!look(x, (enum imp__boundary_kind)kind, 2 * n + i, n, (int)(i & 1), &d))
                continue;
            for (int k = 0; k < x->n_groups; k += 6) sum += square3(x->group + k);
        }
        x->b->moment[kind] = sum / (2.0 * (double)n);
    }
}

/* Cells in place of the one of the beginning. */
static enum imp_status cells_make(struct imp__boundary *b, int kind, int n)
{
    struct imp__edge_choice *c = &b->choice[kind];
    double *cell = imp__alloc(b->edges->ctx, (size_t)n + 1, sizeof *cell);
    if (!cell) return imp__error(b->edges->ctx, IMP_E_NOMEM, "no memory for edges");
    imp__release(b->edges->ctx, c->cell);
    c->cell = cell;
    c->n_cells = n;
    for (int k = 0; k <= n; k++) cell[k] = (double)k / n;
    return IMP_OK;
}

enum imp_status imp__boundary_learn(struct imp__boundary *b, int64_t draws,
                                    imp__flux_weight *weight, int contrasts,
                                    const void *payload)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = b->tracer->scene->ctx;
    struct pilot x = {
        .b = b, .weight = weight, .payload = payload, .contrasts = contrasts};
    if (b->edges->n == 0 && b->n_items == 0) return IMP_OK;
    const int64_t n = draws / PART;
    const int cells = (int)imp_min(n / LOOKS, (int64_t)IMP_EDGE_CELLS_MAX);
    if (cells < LOOKS_LEAST) return IMP_OK; /* too few to learn from */
    x.n_groups = 6 * b->moves->n_movers;
    imp__arena_init(&x.arena, ctx);
    x.group = imp__alloc(ctx, (size_t)x.n_groups + 1, sizeof *x.group);
    x.square = imp__alloc(ctx, (size_t)x.n_groups + 1, sizeof *x.square);
    x.moment = imp__alloc(ctx, (size_t)(cells + b->n_items), sizeof *x.moment);
    x.shift = imp__alloc(ctx, (size_t)(cells + b->n_items), sizeof *x.shift);
    for (int h = 0; h < 2; h++)
        x.noise[h] =
            imp__alloc(ctx, (size_t)(x.n_groups / 2 * contrasts) + 1, sizeof *x.noise[h]);
    if (!x.group || !x.square || !x.moment || !x.shift || !x.noise[0] || !x.noise[1])
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for edges"));
    for (int kind = 0; kind < IMP_BOUNDARY_KINDS && !x.no_memory; kind++) {
        if (b->edges->n > 0) IMP_TRY(cells_make(b, kind, cells));
        kind_learn(&x, (enum imp__boundary_kind)kind, (int64_t)cells * LOOKS);
    }
    if (contrasts > 0 && (size_t)cells * LOOKS < b->edges->n && !x.no_memory)
        look_again(&x, (int64_t)cells * LOOKS);
    if (x.no_memory) st = imp__error(ctx, IMP_E_NOMEM, "no memory for edges");
    b->noise = noise_of(&x);
out:
    imp__arena_free(&x.arena);
    imp__release(ctx, x.group);
    imp__release(ctx, x.square);
    imp__release(ctx, x.moment);
    imp__release(ctx, x.shift);
    imp__release(ctx, x.noise[0]);
    imp__release(ctx, x.noise[1]);
    return st;
}
