/* SPDX-License-Identifier: Apache-2.0
 *
 * Residuals d = picture - target of all colour channels, with the standard error s of both
 * together, against what noise alone would leave. Single pixels are no measure of it: where
 * light is rare, d and the estimate of s are large in the same few pixels, and d^2/s^2 is
 * far from a chi-square. Sums over blocks of pixels are unbiased both, so chi-square per
 * number is
 *
 *     the mean over blocks of  sum d^2 / sum s^2,      1 if all is noise.
 *
 * Its spread is that of the blocks (by their quartiles, relative to their median, which a
 * few regions that differ do not move), and at least that of Gaussian noise where the
 * channels of a pixel, and CORRELATED neighbours, are one number, since filters may be
 * wider than a pixel. Regions are blocks, or windows of them, whose sum of d is beyond
 * LIMIT standard errors by the same count, with neighbours of the same sign. */
#include "explained.h"
#include "base/context.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CORRELATED    4.
#define LIMIT         4.
#define LEAST_FREEDOM 3.   /* of 2 and fewer a ratio has no mean */
#define CERTAIN       1e-3 /* relative: half floats stay below */
enum { SIDE_MAX = 32, BLOCK_MIN = 4, REGIONS = 5, CHANNELS = 4, SAMPLES_MIN = 8 };

struct pair { /* colour channels of both: index, and of the error; -1: none */
    const imp_film *film[2];
    int n, value[2][CHANNELS], error[2][CHANNELS];
    bool noise[2];
};

/* Errors may be in channels of their own, as in EXR files. */
static int error_channel(const imp_film *f, const char *name)
{
    char own[16];
    own[0] = 0;
    if (strlen(name) < sizeof own - 4) strcat(strcpy(own, "se."), name);
    return f->se || !*own ? -1 : imp__film_find(f, own);
}

static bool pair_make(struct pair *p, const imp_film *picture, const imp_film *target)
{
    static const char *const names[] = {"R", "G", "B", "Y"};
    *p = (struct pair){.film = {picture, target}};
    if (picture->width != target->width || picture->height != target->height)
        return false;
    for (int k = 0; k < CHANNELS; k++) {
        const int at[2] = {imp__film_find(picture, names[k]),
                           imp__film_find(target, names[k])};
        if (at[0] < 0 || at[1] < 0) continue;
        for (int side = 0; side < 2; side++) {
            p->value[side][p->n] = at[side];
            p->error[side][p->n] = error_channel(p->film[side], names[k]);
        }
        p->n++;
    }
    for (int side = 0; side < 2 && p->n; side++)
        for (int c = 0; c < p->n; c++)
            p->noise[side] = p->film[side]->se ||
                             (p->error[side][c] >= 0 && (c == 0 || p->noise[side]));
    return p->n > 0;
}

static double value_at(const struct pair *p, int side, size_t pixel, int c)
{
    const imp_film *f = p->film[side];
    return f->mean[pixel * (size_t)f->channels + (size_t)p->value[side][c]];
}
static double error_at(const struct pair *p, int side, size_t pixel, int c)
{
    const imp_film *f = p->film[side];
    const size_t at = pixel * (size_t)f->channels;
    if (!p->noise[side]) return 0;
    return f->se ? f->se[at + (size_t)p->value[side][c]]
                 : f->mean[at + (size_t)p->error[side][c]];
}

struct block {
    double difference, target; /* sums over pixels and channels */
    double dd, ss, s4;         /* of d^2, s^2 and s^4 */
    double variance;           /* of the sum over pixels of the channels' mean */
    double pixels;
    double certain; /* numbers without noise that differ */
    int state;      /* -1, 1: beyond the limit on that side; 0 else */
    bool seen;
};

struct sums {
    double n, left_out; /* numbers with a residual, and those without */
    double certain;     /* of the blocks */
    int block, columns, rows;
    struct block *blocks;
};

static void pixel_take(const struct pair *p, struct sums *s, size_t pixel,
                       struct block *b)
{
    double error = 0;
    for (int c = 0; c < p->n; c++) {
        const double v = value_at(p, 0, pixel, c), t = value_at(p, 1, pixel, c);
        const double size = hypot(error_at(p, 0, pixel, c), error_at(p, 1, pixel, c));
        if (!isfinite(v - t) || !isfinite(size)) {
            s->left_out += 1;
            continue;
        }
        b->difference += v - t;
        b->target += t;
        error += size / p->n;
        if (size > 0) {
            s->n += 1;
            b->dd += (v - t) * (v - t);
            b->ss += size * size;
            b->s4 += pow(size, 4);
        } else {
            s->left_out += 1;
            b->certain += fabs(v - t) > CERTAIN * fmax(fabs(v), fabs(t));
        }
    }
    b->variance += error * error;
    b->pixels += 1;
}

static void sums_take(const struct pair *p, struct sums *s)
{
    const int w = p->film[0]->width, h = p->film[0]->height;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++)
            pixel_take(p, s, (size_t)y * (size_t)w + (size_t)x,
                       &s->blocks[y / s->block * s->columns + x / s->block]);
}

/* ---- Regions --------------------------------------------------------------------- */

struct region {
    int lo[2], hi[2]; /* blocks */
    double difference, target, variance, pixels;
};

/* z of a sum of differences over pixels and n channels. */
static double z_of(double difference, double variance, int n)
{
    return variance > 0 ? difference / n / sqrt(CORRELATED * variance) : 0;
}

/* The block and its neighbours of the same state; at most SIDE_MAX^2 of them. */
static void region_grow(struct sums *s, int at, struct region *r, int *stack)
{
    int n = 0;
    const int state = s->blocks[at].state;
    stack[n++] = at;
    s->blocks[at].seen = true;
    while (n) {
        const int k = stack[--n], x = k % s->columns, y = k / s->columns;
        const struct block *b = &s->blocks[k];
        r->lo[0] = imp_min(r->lo[0], x), r->hi[0] = imp_max(r->hi[0], x);
        r->lo[1] = imp_min(r->lo[1], y), r->hi[1] = imp_max(r->hi[1], y);
        r->difference += b->difference;
        r->target += b->target;
        r->variance += b->variance;
        r->pixels += b->pixels;
        const int next[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
        for (int i = 0; i < 4; i++) {
            const int u = next[i][0], v = next[i][1];
            if (u < 0 || v < 0 || u >= s->columns || v >= s->rows) continue;
            struct block *o = &s->blocks[v * s->columns + u];
            if (o->seen || o->state != state) continue;
            o->seen = true;
            stack[n++] = v * s->columns + u;
        }
    }
}

static int larger(const void *p, const void *q)
{
    const struct region *a = p, *b = q;
    const double x = fabs(a->difference), y = fabs(b->difference);
    return (x < y) - (x > y);
}

static void put_number(struct imp_text *t, const char *key, double v)
{
    if (isfinite(v)) imp__put(t, ",\"%s\":%.9g", key, v);
    else imp__put(t, ",\"%s\":null", key);
}

static void put_regions(struct imp_text *t, const struct pair *p, struct sums *s,
                        struct region *regions, size_t n)
{
    qsort(regions, n, sizeof *regions, larger);
    imp__put(t, ",\"n_regions\":%zu,\"regions\":[", n);
    for (size_t k = 0; k < n && k < REGIONS; k++) {
        const struct region *r = &regions[k];
        const int x = r->lo[0] * s->block, y = r->lo[1] * s->block;
        const int x_end = imp_min((r->hi[0] + 1) * s->block, p->film[0]->width);
        const int y_end = imp_min((r->hi[1] + 1) * s->block, p->film[0]->height);
        imp__put(t, "%s{\"x\":%d,\"y\":%d,\"width\":%d,\"height\":%d", k ? "," : "", x, y,
                 x_end - x, y_end - y);
        put_number(t, "difference", r->difference / (r->pixels * p->n));
        put_number(t, "relative", r->difference / r->target);
        put_number(t, "z", s->n > 0 ? z_of(r->difference, r->variance, p->n) : NAN);
        imp__put(t, "}");
    }
    imp__put(t, "]");
}

/* Windows of `side` x `side` blocks: what differs a little over a large area is seen by
 * them alone. Blocks of the window that differ the same way are beyond the limit with it. */
static void windows_mark(struct sums *s, int channels, int side)
{
    for (int y = 0; y + side <= s->rows; y++)
        for (int x = 0; x + side <= s->columns; x++) {
            double difference = 0, variance = 0;
            for (int k = 0; k < side * side; k++) {
                const struct block *b =
                    &s->blocks[(y + k / side) * s->columns + x + k % side];
                difference += b->difference;
                variance += b->variance;
            }
            if (fabs(z_of(difference, variance, channels)) <= LIMIT) continue;
            for (int k = 0; k < side * side; k++) {
                struct block *b = &s->blocks[(y + k / side) * s->columns + x + k % side];
                const double z = z_of(b->difference, b->variance, channels);
                if (side == 1 || (z * difference > 0 && fabs(z) > 1))
                    b->state = difference > 0 ? 1 : -1;
            }
        }
}

/* Without noise no block is significant: the one with the largest difference is reported. */
static size_t find_regions(struct sums *s, int channels, struct region *regions,
                           int *stack)
{
    const int n = s->columns * s->rows;
    size_t found = 0;
    int worst = 0;
    for (int side = 4; side > 0 && s->n > 0; side /= 2) windows_mark(s, channels, side);
    for (int k = 0; k < n && s->certain > 0; k++)
        if (s->blocks[k].certain > 0)
            s->blocks[k].state = s->blocks[k].difference > 0 ? 1 : -1;
    for (int k = 0; k < n; k++)
        if (fabs(s->blocks[k].difference) > fabs(s->blocks[worst].difference)) worst = k;
    for (int k = 0; k < n; k++) {
        const bool alone = s->n == 0 && k == worst && s->blocks[k].difference != 0;
        if (s->blocks[k].seen || !(s->blocks[k].state || alone)) continue;
        if (alone) s->blocks[k].state = 2;
        regions[found] = (struct region){.lo = {n, n}, .hi = {-1, -1}};
        region_grow(s, k, &regions[found++], stack);
    }
    return found;
}

/* ---- Chi-square ------------------------------------------------------------------- */

static int ascending(const void *p, const void *q)
{
    const double a = *(const double *)p, b = *(const double *)q;
    return (a > b) - (a < b);
}

/* Degrees of freedom of an error, at least. */
static double freedom_of(const struct pair *p)
{
    double least = INFINITY;
    for (int side = 0; side < 2; side++)
        if (p->noise[side] && p->film[side]->sets > 1)
            least = fmin(least, (double)p->film[side]->sets - 1);
    return least;
}

/* Mean of the blocks, and its standard error if all is noise; ratios [blocks] is room. Where s^2
 * has few degrees of freedom, a ratio has the mean k/(k - 2), with k = freedom S_2^2/(c S_4) of
 * the sum over a block (Satterthwaite 1946), c channels being one. */
static double chi_square(const struct sums *s, int channels, double freedom,
                         double *ratios, double *error)
{
    size_t n = 0;
    double sum = 0, pixels = 0;
    for (int k = 0; k < s->columns * s->rows; k++) {
        const struct block *b = &s->blocks[k];
        if (!(b->ss > 0)) continue;
        const double k2 = fmax(freedom * b->ss * b->ss / (channels * b->s4), freedom);
        const double mean = 1 / (1 - 2 / fmax(k2, LEAST_FREEDOM));
        sum += ratios[n++] = b->dd / b->ss / mean;
        pixels += b->pixels;
    }
    *error = NAN;
    if (!n) return NAN;
    qsort(ratios, n, sizeof *ratios, ascending);
    /* Half of what is between the quartiles is .6745 standard deviations. */
    const double spread =
        (ratios[3 * n / 4] - ratios[n / 4]) / (2 * 0.6745) / ratios[n / 2];
    *error = fmax(isfinite(spread) ? spread / sqrt((double)n) : 0,
                  sqrt(2 * CORRELATED / pixels));
    return sum / (double)n;
}

/* The fewest samples that errors come from; 0: not known. */
static int64_t least_samples(const struct pair *p)
{
    int64_t least = 0;
    for (int side = 0; side < 2; side++) {
        const int64_t n = p->noise[side] ? p->film[side]->spp : 0;
        if (n > 0 && (least == 0 || n < least)) least = n;
    }
    return least;
}

static void put_answer(struct imp_text *t, const struct pair *p, struct sums *s,
                       double *ratios, struct region *regions, int *stack)
{
    static const char *const noise[2][2] = {{"none", "target"}, {"picture", "both"}};
    const bool both = p->noise[0] && p->noise[1];
    for (int k = 0; k < s->columns * s->rows && both; k++)
        s->certain += s->blocks[k].certain;
    const size_t found = find_regions(s, p->n, regions, stack);
    const int64_t samples = least_samples(p);
    const bool known = s->n > 0 && (samples == 0 || samples >= SAMPLES_MIN);
    double error;
    const double chi2 = chi_square(s, p->n, freedom_of(p), ratios, &error);
    imp__put(t, "{\"numbers\":%.0f,\"left_out\":%.0f,\"noise\":\"%s\"", s->n, s->left_out,
             noise[p->noise[0]][p->noise[1]]);
    put_number(t, "chi2", chi2);
    imp__put(t, ",\"expected\":");
    if (known) imp__put(t, "[%.9g,%.9g]", fmax(0, 1 - 2 * error), 1 + 2 * error);
    else imp__put(t, "null");
    /* Noise that is not known can only explain more. */
    const bool fits = known && chi2 <= 1 + 2 * error && found == 0;
    const bool differs = both && ((known && !fits) || s->certain > 0);
    imp__put(t, ",\"explained\":%s", fits ? "true" : differs ? "false" : "null");
    imp__put(t, ",\"block\":%d", s->block);
    put_regions(t, p, s, regions, found);
    imp__put(t, "}");
}

bool imp__explained_put(struct imp_text *t, const imp_film *picture,
                        const imp_film *target)
{
    struct pair p;
    struct sums s = {0};
    if (!pair_make(&p, picture, target)) return false;
    const int side = imp_max(picture->width, picture->height);
    s.block = imp_max(BLOCK_MIN, (side + SIDE_MAX - 1) / SIDE_MAX);
    s.columns = (picture->width + s.block - 1) / s.block;
    s.rows = (picture->height + s.block - 1) / s.block;
    const size_t n = (size_t)s.columns * (size_t)s.rows;
    s.blocks = imp__alloc(t->ctx, n, sizeof *s.blocks);
    struct region *regions = imp__alloc(t->ctx, n, sizeof *regions);
    double *ratios = imp__alloc(t->ctx, n, sizeof *ratios);
    int *stack = imp__alloc(t->ctx, n, sizeof *stack);
    const bool room = s.blocks && regions && ratios && stack;
    if (room) {
        sums_take(&p, &s);
        put_answer(t, &p, &s, ratios, regions, stack);
    }
    t->failed = t->failed || !room;
    imp__release(t->ctx, s.blocks);
    imp__release(t->ctx, regions);
    imp__release(t->ctx, ratios);
    imp__release(t->ctx, stack);
    return room;
}
