/* SPDX-License-Identifier: Apache-2.0
 *
 * Test of densities against an oracle: the picture again with directions drawn uniformly
 * by every material, and with lights hit by rays instead of sampled (except those that no
 * ray can hit), so that the only densities are 1/2pi and 1/4pi. Both pictures are
 * compared block by block, and their z together by chi-square. Rows `energy` give, for
 * each density of the mixture, its share of the first directions that walks draw from a
 * mixture, and of the energy that arrives through them; where there are several lights or
 * proxies, also for each. */
#include "check.h"
#include "film/film_picture.h"
#include "math/stat.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define BLOCKS  8     /* along a side, at most */
#define P_LIMIT 0.01  /* of chi-square */
#define Z_LIMIT 5     /* of one block */
#define NOISY   0.05  /* relative error of the oracle that decides nothing */
#define SECOND  0x5a3 /* distinguishes the seeds of the two pictures */
#define AIMS    16    /* lights and proxies with rows of their own, at most */

/* Values of a sample: radiance, then parts of the first channels' sum. */
enum { MET = IMP_DENSITIES, CONNECTED, PARTS, SQUARE = PARTS + IMP_DENSITIES, LOOKED };
struct looked {
    struct imp_tracer tracer;
    int channels;
    bool parts;
    int aims; /* with rows of their own; energy and draws of k: LOOKED + 2 k */
};

/* Number of lights and proxies with rows of their own; 0 if there is at most one light
 * and one proxy, whose rows would repeat those of the density. */
static int aims_told(const struct imp_scene *scene)
{
    const struct imp_aims *t = &scene->aims;
    const bool several = t->n_lights > 1 || t->n - t->n_lights > 1;
    return t->aimed && several && t->n <= AIMS ? t->n : 0;
}

/* Distributes a direction that was drawn towards lights or proxies over them: its energy
 * by the posterior probability S_t p_t(w)/sum of each, its count by S_t/sum, which also
 * is used where w is unknown. */
static void aims_add(const struct looked *j, const struct imp_vertex *v, double energy,
                     double *part)
{
    const struct imp_aims *t = &j->tracer.scene->aims;
    const bool proxies = v->d.drawn == IMP_DENSITY_PROXIES;
    if (j->aims == 0 || (!proxies && v->d.drawn != IMP_DENSITY_EMITTERS)) return;
    const int first = proxies ? t->n_lights : 0, end = proxies ? t->n : t->n_lights;
    const imp_v3 p = imp__decided_v3(v->d.p);
    double chance[AIMS], along[AIMS], chances = 0, sum = 0;
    imp__aims_apart(t, p, NULL, chance);
    for (int k = first; k < end; k++) chances += chance[k];
    if (v->next) {
        const imp_v3 next = imp__decided_v3(v->next->d.p);
        const imp_v3 w = v->next->d.shape >= 0 ? imp__normalize(next - p) : next;
        imp__aims_apart(t, p, &w, along);
        for (int k = first; k < end; k++) sum += along[k];
    }
    for (int k = first; k < end; k++) {
        const double drawn = chances > 0 ? chance[k] / chances : 0;
        part[LOOKED + 2 * k] += energy * (sum > 0 ? along[k] / sum : drawn);
        part[LOOKED + 2 * k + 1] += drawn;
    }
}

static double sum_used(const struct looked *j, imp_spec L)
{
    return j->channels == 1 ? L[0] : imp__sum3(L);
}

/* Splits the light of a walk: emission that is hit and light samples before the first
 * direction drawn from a mixture, and what arrives through that direction, by the density
 * that drew it. Counts these draws from PARTS on. */
static void parts_add(const struct looked *j, const struct imp_walk *walk, imp_spec P,
                      double *part)
{
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        part[MET] += sum_used(j, P * v->e);
        part[CONNECTED] += sum_used(j, P * v->b);
        const bool choice = v->bsdf && v->d.goes_on && v->d.lobe == IMP_SMOOTH;
        for (const struct imp_side *s = v->side; s; s = s->next)
            parts_add(j, &s->walk, P, part);
        if (choice) {
            const double energy = sum_used(j, P * v->w * v->beyond);
            part[v->d.drawn] += energy;
            part[PARTS + v->d.drawn] += 1;
            aims_add(j, v, energy, part);
            return;
        }
        P *= v->w;
    }
}

/* Second moment of the oracle's walks, estimated by the picture's: a term c of a walk
 * that drew its directions with densities p has E_u[c_u^2] = E_p[c_p^2 prod p/u], with u
 * the uniform density. Products of two terms are left out, and a light sample counts as
 * if its weight were 1/p. The estimate includes light that the oracle itself hits too
 * rarely. */
static double square_of(const struct looked *j, const struct imp_walk *walk)
{
    imp_spec P = imp__spec(1);
    double ratio = 1, square = 0;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        const bool sphere = v->bsdf && v->bsdf->flags & IMP_BSDF_TRANSMIT;
        const double domain = IMP_2PI * (sphere ? 2 : 1);
        square += imp__sqr(sum_used(j, P * v->e)) * ratio;
        if (v->d.connection == IMP_CONNECTED && v->d.light.weight > 0)
            square += imp__sqr(sum_used(j, P * v->b)) * ratio * domain /
                      (double)v->d.light.weight;
        for (const struct imp_side *s = v->side; s; s = s->next)
            square += imp__sqr(sum_used(j, P)) * ratio * square_of(j, &s->walk);
        if (!v->d.goes_on) break;
        P *= v->w;
        if (v->bsdf && v->d.lobe == IMP_SMOOTH)
            ratio *= fmax((double)v->d.pdf * domain, 1e-3);
    }
    return square;
}

static void sample(const void *payload, struct imp_sample *out)
{
    const struct looked *j = payload;
    struct imp_walk walk;
    double *part = out->value + j->channels;
    imp__sample_walk(out, &j->tracer, &walk);
    for (int c = 0; c < j->channels; c++) out->value[c] = walk.L[c];
    if (!j->parts) return;
    for (int k = 0; k < LOOKED + 2 * j->aims; k++) part[k] = 0;
    if (walk.dropped || !walk.valid) return;
    parts_add(j, &walk, imp__spec(1), part);
    part[SQUARE] = fmin(square_of(j, &walk), 1e30);
}

static enum imp_status picture_make(struct imp__check *c, const struct looked *j,
                                    imp_film **out)
{
    const int parts = j->parts ? LOOKED + 2 * j->aims : 0;
    char names[8 + 5 * (LOOKED + 2 * AIMS)] = "R,G,B";
    if (j->channels == 1) snprintf(names, sizeof names, "Y");
    for (int k = 0; k < parts; k++) {
        const size_t n = strlen(names);
        snprintf(names + n, sizeof names - n, ",p%d", k);
    }
    struct imp_run run = c->run;
    const struct imp_picture picture = {.sensor = j->tracer.sensor,
                                        .stage = "check",
                                        .names = names,
                                        .n = j->channels + parts,
                                        .sample = sample,
                                        .payload = j};
    run.seed = j->tracer.seed;
    return imp__picture_make(c->ctx, &picture, &run, out);
}

/* ---- Blocks ---------------------------------------------------------------------- */

static struct imp_estimate block_mean(const imp_film *f, int channel, const int from[2],
                                      const int to[2])
{
    double sum = 0, square = 0;
    const double n = (double)(to[0] - from[0]) * (to[1] - from[1]);
    for (int y = from[1]; y < to[1]; y++)
        for (int x = from[0]; x < to[0]; x++) {
            const size_t i =
                ((size_t)y * (size_t)f->width + (size_t)x) * (size_t)f->channels +
                (size_t)channel;
            sum += f->mean[i];
            square += imp__sqr(f->se[i]);
        }
    return (struct imp_estimate){.value = sum / n, .se = sqrt(square) / n};
}

static struct imp_estimate block_at(const imp_film *f, int channel, int k, int from[2],
                                    int to[2])
{
    const int nx = imp_min(BLOCKS, f->width), ny = imp_min(BLOCKS, f->height);
    const int i = k % nx, j = k / nx;
    from[0] = i * f->width / nx;
    from[1] = j * f->height / ny;
    to[0] = (i + 1) * f->width / nx;
    to[1] = (j + 1) * f->height / ny;
    return block_mean(f, channel, from, to);
}

/* Least variance of a block of the oracle: the second moment that the other picture's
 * walks predict, less the square of the block's mean. */
static double predicted(const imp_film *own, int channels, int k, double mean)
{
    int from[2], to[2];
    double sum = 0;
    for (int c = 0; c < channels; c++) sum += block_at(own, c, k, from, to).value;
    const double square = block_at(own, channels + SQUARE, k, from, to).value;
    const double pixels = (double)(to[0] - from[0]) * (to[1] - from[1]);
    const double part = sum > 0 ? mean / sum : 0;
    return fmax(square * part * part - mean * mean, 0) / (pixels * (double)own->spp);
}

static enum imp_status channel_compare(struct imp__check *c, const imp_film *own,
                                       const imp_film *oracle, int channel, int channels,
                                       const char *name)
{
    enum imp_status st = IMP_OK;
    const int blocks = imp_min(BLOCKS, own->width) * imp_min(BLOCKS, own->height);
    double mean = 0, variance = 0;
    struct imp_check_row worst = {.limit = Z_LIMIT, .error = -1};
    char where[64] = "", all[64];
    double chi2 = 0, n = 0;
    for (int k = 0; k < blocks; k++) {
        int from[2], to[2];
        const struct imp_estimate x = block_at(own, channel, k, from, to),
                                  y = block_at(oracle, channel, k, from, to);
        const double own_variance = x.se * x.se,
                     its_variance =
                         fmax(y.se * y.se, predicted(own, channels, k, x.value)),
                     se = sqrt(own_variance + its_variance);
        mean += y.value;
        variance += its_variance;
        if (!(se > 0)) continue;
        const double z = (x.value - y.value) / se;
        chi2 += z * z;
        n++;
        if (fabs(z) <= worst.error) continue;
        worst.value = x.value;
        worst.reference = y.value;
        worst.se = se;
        worst.error = fabs(z);
        snprintf(where, sizeof where, "%s in %d,%d..%d,%d", name, from[0], from[1],
                 to[0] - 1, to[1] - 1);
    }
    if (n == 0) return IMP_OK; /* black, or the same in every walk */
    const bool noisy = sqrt(variance) > NOISY * fabs(mean);
    worst.ok = !(worst.error <= Z_LIMIT) ? 0 : noisy ? -1 : 1;
    IMP_TRY(imp__check_row(c, "uniform", where, -1, &worst));
    const double p = imp__chi2_tail(chi2, n);
    struct imp_check_row sum = {
        .value = chi2, .reference = n, .limit = 1 - P_LIMIT, .error = 1 - p};
    sum.ok = !(p > P_LIMIT) ? 0 : noisy ? -1 : 1;
    snprintf(all, sizeof all, "%s chi-square of %g blocks", name, n);
    IMP_TRY(imp__check_row(c, "uniform", all, -1, &sum));
out:
    return st;
}

static enum imp_status blocks_compare(struct imp__check *c, const imp_film *own,
                                      const imp_film *oracle, int channels)
{
    static const char *const name[] = {"R", "G", "B"};
    enum imp_status st = IMP_OK;
    for (int k = 0; k < channels; k++)
        IMP_TRY(
            channel_compare(c, own, oracle, k, channels, channels == 1 ? "Y" : name[k]));
out:
    return st;
}

/* ---- Energy ---------------------------------------------------------------------- */

/* `drew`: part of the directions; below 0: nothing draws it. */
static enum imp_status energy_row(struct imp__check *c, const char *name, double arrives,
                                  double drew)
{
    const struct imp_check_row row = {
        .value = arrives, .reference = drew < 0 ? arrives : drew, .ok = 1};
    if (!(arrives > 0) && !(row.reference > 0)) return IMP_OK;
    return imp__check_row(c, "energy", name, -1, &row);
}

static enum imp_status energy_rows(struct imp__check *c, const imp_film *f,
                                   const struct looked *j)
{
    enum imp_status st = IMP_OK;
    double energy = 0, draws = 0, part[LOOKED + 2 * AIMS];
    const struct imp_aims *t = &j->tracer.scene->aims;
    const int from[2] = {0, 0}, to[2] = {f->width, f->height};
    for (int k = 0; k < LOOKED + 2 * j->aims; k++)
        part[k] = block_mean(f, j->channels + k, from, to).value;
    for (int k = 0; k < PARTS; k++) energy += part[k];
    for (int k = 0; k < IMP_DENSITIES; k++) draws += part[PARTS + k];
    if (!(energy > 0)) return IMP_OK;
    for (int k = 0; k < IMP_DENSITIES; k++)
        IMP_TRY(energy_row(c, imp__density_name[k], part[k] / energy,
                           draws > 0 ? part[PARTS + k] / draws : 0));
    IMP_TRY(energy_row(c, "met before", part[MET] / energy, -1));
    IMP_TRY(energy_row(c, "connections", part[CONNECTED] / energy, -1));
    for (int k = 0; k < j->aims; k++) {
        char name[128];
        const char *own = t->list[k].shape->name;
        snprintf(name, sizeof name, "%s: %s",
                 imp__density_name[k < t->n_lights ? IMP_DENSITY_EMITTERS
                                                   : IMP_DENSITY_PROXIES],
                 own ? own : "");
        IMP_TRY(energy_row(c, name, part[LOOKED + 2 * k] / energy,
                           draws > 0 ? part[LOOKED + 2 * k + 1] / draws : 0));
    }
out:
    return st;
}

/* ---- The check ------------------------------------------------------------------- */

enum imp_status imp__check_sampling(struct imp__check *c)
{
    static const struct imp_mixing uniform = {
        .weight = {[IMP_DENSITY_UNIFORM] = 1, [IMP_DENSITY_GUIDE] = 0}};
    enum imp_status st = IMP_OK;
    imp_film *own = NULL, *oracle = NULL;
    /* Pixels that share no samples. */
    struct imp_sensor sensor = *c->tracer.sensor;
    for (size_t k = 0; imp__filter_kinds[k]; k++)
        if (strcmp(imp__filter_kinds[k]->name, "box") == 0)
            sensor.film.filter = (struct imp_filter){imp__filter_kinds[k], NULL, 0.5};
    sensor.film.sample_border = false;
    struct imp_walk_integrator blind = *c->tracer.integrator;
    blind.directions = true;
    blind.only_points = blind.lights;
    blind.split = 0;
    struct looked j = {.tracer = c->tracer,
                       .channels = c->problem->scene->channels,
                       .parts = true,
                       .aims = aims_told(c->problem->scene)};
    j.tracer.active = NULL;
    j.tracer.sensor = &sensor;
    c->total = 2;
    IMP_TRY(picture_make(c, &j, &own));
    IMP_TRY(imp__check_progress(c, 1));
    IMP_TRY(imp__check_aims(c, &j.tracer));
    j.parts = false;
    j.tracer.value_only = true;
    j.tracer.seed = imp__mix64(c->tracer.seed ^ SECOND);
    j.tracer.integrator = &blind;
    j.tracer.mixing = &uniform;
    IMP_TRY(picture_make(c, &j, &oracle));
    IMP_TRY(blocks_compare(c, own, oracle, j.channels));
    IMP_TRY(energy_rows(c, own, &j));
    st = imp__check_progress(c, 1);
out:
    imp_film_destroy(own);
    imp_film_destroy(oracle);
    return st;
}
