/* SPDX-License-Identifier: Apache-2.0
 *
 * Three estimators of the derivative with respect to every number of an extinction, side by
 * side: variance, summed over the numbers, times what a walk costs, in look-ups of the
 * density and in processor time.
 *
 *     media_estimators [WALKS [N]]
 *
 * - naive: delta tracking differentiated as it stands, F/sigma at a collision, and -F l at a
 *   uniform point of a flight of length l; F is what the walk brings. In cells without
 *   extinction nothing collides, and the light that more of it would scatter is missed.
 * - ratio: differential ratio tracking (Nimier-David, Mueller, Keller, Jakob 2022). Along a
 *   segment tentative collisions are drawn with rate b, whose weights T_i/b by ratio
 *   tracking choose one of them; a walk from there brings what is gained, with the sum of
 *   the weights, and -F l at a uniform point of the flight is what is lost.
 * - probe: docs/media.md, 4. A uniform point of the flight itself, for both.
 *
 * The last two visit all segments of a walk, or one of them chosen uniformly. Walks are
 * analog: they are absorbed with the probability 1 - albedo, collide under one bound.
 *
 * The rod has a closed form (tests/rod.h), with which each row is compared, and the naive
 * one in the empty cell; the plume of N^3 cells (32) under a sky has none, so its rows are
 * compared with each other, by the sums of their derivatives over its empty cells and over
 * the others. */
#include "../tests/rod.h"
#include "plume.h"
#include <stdbool.h>
#include <time.h>

enum { SEGMENTS_MAX = 1000 };

struct ray {
    double o[3], d[3];
};

/* A grid over [0, 1]^3, or along z alone. */
struct body {
    int n[3];
    const float *sigma, *albedo; /* of the cells; albedo NULL: .9 */
    double bound;
    bool rod;
};

static uint64_t state = 1, lookups;
static double draw(void) { return plume_draw(&state); }

static size_t cell_at(const struct body *b, const struct ray *r, double t)
{
    size_t cell = 0;
    for (int a = 2; a >= 0; a--) {
        const int i = (int)((r->o[a] + r->d[a] * t) * b->n[a]);
        cell = cell * (size_t)b->n[a] + (size_t)(i < 0         ? 0
                                                 : i < b->n[a] ? i
                                                               : b->n[a] - 1);
    }
    lookups++;
    return cell;
}
static double albedo_of(const struct body *b, size_t cell)
{
    return b->albedo ? (double)b->albedo[cell] : .9;
}

/* Distance to the end of the body. */
static double reach(const struct ray *r)
{
    double t = INFINITY;
    for (int a = 0; a < 3; a++)
        if (r->d[a] != 0) t = fmin(t, ((r->d[a] > 0) - r->o[a]) / r->d[a]);
    return fmax(t, 0);
}
static double outside(const struct body *b, const struct ray *r)
{
    if (b->rod) return r->d[2] > 0 ? ROD_RIGHT : ROD_LEFT;
    return .5 + 1.5 * (r->d[1] > .8); /* a sky that is brighter above */
}
static void turn(const struct body *b, struct ray *r)
{
    if (b->rod) {
        r->d[2] = draw() < .5 ? 1 : -1;
        return;
    }
    const double z = 2 * draw() - 1, phi = 2 * M_PI * draw(), s = sqrt(1 - z * z);
    r->d[0] = s * cos(phi);
    r->d[1] = s * sin(phi);
    r->d[2] = z;
}

/* ---- Walks ---------------------------------------------------------------------------- */

struct segment {
    struct ray ray;
    double far, flown;
    bool collides;
    size_t cell; /* of the collision */
};

static bool fly(const struct body *b, struct segment *s)
{
    s->far = reach(&s->ray);
    s->collides = false;
    for (double t = 0;;) {
        t += -log1p(-draw()) / b->bound;
        if (t >= s->far) break;
        s->cell = cell_at(b, &s->ray, t);
        if (draw() * b->bound < (double)b->sigma[s->cell]) {
            s->collides = true;
            s->flown = t;
            return true;
        }
    }
    s->flown = s->far;
    return false;
}

/* Segments of a walk; *brings: what arrives at its start. */
static int walk(const struct body *b, struct ray r, struct segment *s, double *brings)
{
    *brings = 0;
    for (int n = 0; n < SEGMENTS_MAX; n++) {
        s[n].ray = r;
        if (!fly(b, &s[n])) {
            *brings = outside(b, &r);
            return n + 1;
        }
        if (draw() >= albedo_of(b, s[n].cell)) return n + 1;
        for (int a = 0; a < 3; a++) r.o[a] += r.d[a] * s[n].flown;
        turn(b, &r);
    }
    return SEGMENTS_MAX;
}

/* What is scattered back along r at distance t of it. */
static double scattered(const struct body *b, const struct ray *r, double t)
{
    static struct segment of_side[SEGMENTS_MAX];
    struct ray side = *r;
    double brings;
    for (int a = 0; a < 3; a++) side.o[a] += r->d[a] * t;
    turn(b, &side);
    walk(b, side, of_side, &brings);
    return brings;
}

/* ---- Estimators ------------------------------------------------------------------------- */

/* A walk's derivatives, by the cells that it has touched. */
struct gradient {
    double *of_walk;
    size_t *touched, n;
    double *sum;
    double square; /* of all cells, summed */
};
static void add(struct gradient *g, size_t cell, double x)
{
    if (x == 0) return;
    if (g->of_walk[cell] == 0) g->touched[g->n++] = cell;
    g->of_walk[cell] += x;
}
static void walk_close(struct gradient *g)
{
    for (size_t k = 0; k < g->n; k++) {
        double *x = &g->of_walk[g->touched[k]];
        g->sum[g->touched[k]] += *x;
        g->square += *x * *x; /* a cell that is listed twice has been cleared */
        *x = 0;
    }
    g->n = 0;
}

static void lose(const struct body *b, const struct segment *s, double F, double weight,
                 struct gradient *g)
{
    if (F == 0) return;
    const double t = s->flown * draw();
    add(g, cell_at(b, &s->ray, t), -F * s->flown * weight);
}

static void naive(const struct body *b, const struct segment *s, double F, double weight,
                  struct gradient *g)
{
    lose(b, s, F, weight, g);
    if (s->collides) add(g, s->cell, weight * F / (double)b->sigma[s->cell]);
}

static void ratio(const struct body *b, const struct segment *s, double F, double weight,
                  struct gradient *g)
{
    double T = 1, total = 0, at = 0;
    size_t cell = 0;
    lose(b, s, F, weight, g);
    for (double t = 0;;) {
        t += -log1p(-draw()) / b->bound;
        if (t >= s->far || T == 0) break;
        const size_t here = cell_at(b, &s->ray, t);
        total += T / b->bound;
        if (draw() * total < T / b->bound) {
            at = t;
            cell = here;
        }
        T *= 1 - (double)b->sigma[here] / b->bound;
    }
    if (total > 0)
        add(g, cell, weight * total * albedo_of(b, cell) * scattered(b, &s->ray, at));
}

static void probe(const struct body *b, const struct segment *s, double F, double weight,
                  struct gradient *g)
{
    const double t = s->flown * draw();
    const size_t cell = cell_at(b, &s->ray, t);
    const double gain = albedo_of(b, cell) * scattered(b, &s->ray, t);
    add(g, cell, weight * s->flown * (gain - F));
}

static const struct row {
    const char *name;
    void (*add)(const struct body *b, const struct segment *s, double F, double weight,
                struct gradient *g);
    bool one; /* segment of a walk */
} rows[] = {{"naive", naive, false},
            {"ratio, all segments", ratio, false},
            {"ratio, one segment", ratio, true},
            {"probe, all segments", probe, false},
            {"probe, one segment", probe, true}};

static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The derivatives of what arrives along rays from `start`, to mean and se [cells]. Returns
 * the sum of their variances, of one walk. */
static double estimate(const struct body *b, const struct row *row, int walks,
                       struct gradient *g, size_t cells, double *per_walk,
                       double *seconds)
{
    static struct segment s[SEGMENTS_MAX];
    memset(g->sum, 0, cells * sizeof *g->sum);
    g->square = 0;
    lookups = 0;
    const double start = cpu();
    for (int i = 0; i < walks; i++) {
        struct ray r = {{.5, .5, 0}, {0, 0, 1}};
        if (!b->rod)
            for (int a = 0; a < 2; a++) r.o[a] = draw();
        double F;
        const int n = walk(b, r, s, &F);
        const int only = row->one ? (int)(draw() * n) : -1;
        for (int k = 0; k < n; k++)
            if (only < 0 || k == only) row->add(b, &s[k], F, row->one ? n : 1, g);
        walk_close(g);
    }
    *seconds = (cpu() - start) / walks;
    *per_walk = (double)lookups / walks;
    double variance = g->square / walks;
    for (size_t k = 0; k < cells; k++) {
        g->sum[k] /= walks;
        variance -= g->sum[k] * g->sum[k];
    }
    return variance;
}

/* Of a sum over cells, from batches. */
enum { BATCHES = 32 };
struct moments {
    double sum, square;
};
static void moments_add(struct moments *m, double x)
{
    m->sum += x / BATCHES;
    m->square += x * x / BATCHES;
}
static double moments_se(const struct moments *m)
{
    return sqrt(fmax(m->square - m->sum * m->sum, 0) / (BATCHES - 1));
}

static void compare(const struct body *b, size_t cells, int walks)
{
    struct gradient g = {.of_walk = calloc(cells, sizeof *g.of_walk),
                         .touched = calloc(cells * 4 + 100000, sizeof *g.touched),
                         .sum = calloc(cells, sizeof *g.sum)};
    if (!g.of_walk || !g.touched || !g.sum) exit(3);
    puts("estimator             variance  look-ups  microseconds  variance x look-ups  "
         "variance x time  empty cells            others");
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct moments empty = {0}, full = {0}, worst[ROD_CELLS] = {{0}};
        double variance = 0, per_walk = 0, seconds = 0;
        for (int i = 0; i < BATCHES; i++) {
            double l, t;
            variance +=
                estimate(b, &rows[k], walks / BATCHES, &g, cells, &l, &t) / BATCHES;
            per_walk += l / BATCHES;
            seconds += t / BATCHES;
            double in[2] = {0, 0};
            for (size_t c = 0; c < cells; c++) in[b->sigma[c] > 0] += g.sum[c];
            moments_add(&empty, in[0]);
            moments_add(&full, in[1]);
            for (int c = 0; b->rod && c < ROD_CELLS; c++)
                moments_add(&worst[c], g.sum[c]);
        }
        printf("%-20s  %8.4g  %8.1f  %12.2f  %19.3g  %15.3g  %8.5f +- %.5f  %8.5f +- "
               "%.5f\n",
               rows[k].name, variance, per_walk, 1e6 * seconds, variance * per_walk,
               1e6 * variance * seconds, empty.sum, moments_se(&empty), full.sum,
               moments_se(&full));
        if (!b->rod) continue;
        double z = 0;
        for (int c = 0; c < ROD_CELLS; c++)
            if (c != 1)
                z = fmax(z, fabs(worst[c].sum - rod_derivative(c, 0)) /
                                moments_se(&worst[c]));
        printf(
            "    from the closed form: largest |z| of the seven cells %.1f, of the empty "
            "one %.1f\n",
            z, fabs(worst[1].sum - rod_derivative(1, 0)) / moments_se(&worst[1]));
    }
    free(g.of_walk);
    free(g.touched);
    free(g.sum);
}

int main(int argc, char **argv)
{
    const int walks = argc > 1 ? atoi(argv[1]) : 1000000,
              n = argc > 2 ? atoi(argv[2]) : 32;
    if (walks < BATCHES || n < 1 || n > 256) {
        fprintf(stderr, "usage: media_estimators [WALKS [N]]\n");
        return 2;
    }
    printf("The rod, %d walks; in its empty cell %.5f, in the others together ", walks,
           rod_derivative(1, 0));
    double others = 0;
    for (int c = 0; c < ROD_CELLS; c++) others += c != 1 ? rod_derivative(c, 0) : 0;
    printf("%.5f\n", others);
    const struct body rod = {.n = {1, 1, ROD_CELLS},
                             .sigma = rod_sigma,
                             .albedo = rod_albedo,
                             .bound = 8,
                             .rod = true};
    compare(&rod, ROD_CELLS, walks);

    const size_t cells = (size_t)n * (size_t)n * (size_t)n;
    float *sigma = malloc(cells * sizeof *sigma);
    if (!sigma) return 3;
    struct body plume = {.n = {n, n, n}, .sigma = sigma};
    plume_fill(n, 7, sigma);
    for (size_t k = 0; k < cells; k++) plume.bound = fmax(plume.bound, (double)sigma[k]);
    printf("The plume, %d^3 cells, bound %.3g\n", n, plume.bound);
    compare(&plume, cells, walks);
    free(sigma);
    return 0;
}
