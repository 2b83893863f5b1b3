/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture until its error is small enough: the mean over stages, each of its own walks,
 * after each of which the error is tested (sequential testing).
 *
 * With s the standard errors of normal errors, the squared error E = sum (I - truth)^2
 * has the mean S = sum s^2. Whatever the errors share, E is beyond z^2 S no more often
 * than a normal variable is beyond +-z, for z >= 1.54 (Szekely and Bakirov, Probab.
 * Theory Relat. Fields 126, 2003). Where no more than c values share walks, the
 * eigenvalues of their covariance have at most the sum of squares c Q, Q = sum s^4, and
 * at most the size c max s^2, and
 *
 *     E > S + 2 (c Q x)^(1/2) + 2 x min(S, c max s^2)    with probability exp(-x) at most
 *
 * (Laurent and Massart, Ann. Statist. 28, 2000, lemma 1). The smaller of the two counts. */
#include "base/arguments.h"
#include "base/film.h"
#include "film_filter.h"
#include "film_measure.h"
#include "math/stat.h"
#include "walk/core/walk_integrator.h"
#include "walk/run/interim_looks.h"
#include <math.h>

/* Values whose errors depend on each other with one of them; 0: any may. */
static double sharing(const imp_scene *scene, const struct imp_run *run,
                      const struct imp_sensor *sensor, int channels)
{
    const struct imp_walk_integrator *walks = imp__walk_integrator(scene);
    if (run->from == IMP_FROM_LIGHTS || !walks || walks->from_lights || walks->both)
        return 0;
    const double side = 2 * imp__film_border(&sensor->film) + 1;
    return channels * side * side;
}

/* Sum of the squared standard errors, and its degrees of freedom: each of a film has sets - 1, and
 * their sum S^2/(c Q) times as many at least (Satterthwaite, Biometrics Bulletin 2, 1946). */
struct spread {
    double S, freedom;
};

static struct spread spread_of(const imp_film *film, double share)
{
    struct spread s = {0, film->sets > 1 ? (double)film->sets - 1 : INFINITY};
    double Q = 0;
    for (size_t i = 0; i < imp__film_values(film); i++) {
        const double v = imp__sqr((double)film->se[i]);
        s.S += v;
        Q += v * v;
    }
    if (share > 0 && Q > 0) s.freedom *= fmax(1, s.S * s.S / (share * Q));
    return s;
}

/* s: of the mean with another film of weight w. */
static void spread_mix(struct spread *s, struct spread other, double w)
{
    const double a = (1 - w) * (1 - w) * s->S, b = w * w * other.S;
    s->S = a + b;
    s->freedom =
        s->S > 0 ? s->S * s->S / (a * a / s->freedom + b * b / other.freedom) : INFINITY;
}

/* Bound of the error, over the picture's length, which is longer by its own noise. What bounds a
 * normal number bounds one of Student's distribution if its error is longer by `widen`. */
static double bound(const struct imp__looks *l, const imp_film *film, double share,
                    double freedom)
{
    double S = 0, Q = 0, M = 0, most = 0;
    for (size_t i = 0; i < imp__film_values(film); i++) {
        const double v = imp__sqr((double)film->se[i]);
        S += v;
        Q += v * v;
        most = fmax(most, v);
        M += imp__sqr((double)film->mean[i]);
    }
    const double z = imp__looks_z(l), widen = imp__student_of_normal(z, freedom) / z;
    double E = z * z * S;
    if (share > 0) {
        const double x = -log(imp__looks_risk(l));
        E = fmin(E, S + 2 * sqrt(share * Q * x) + 2 * x * fmin(S, share * most));
    }
    E *= widen * widen;
    return M > S ? sqrt(E / (M - S)) : INFINITY; /* darkness may be light not yet found */
}

/* all: the mean with another film of weight w. */
static void film_mix(imp_film *all, const imp_film *film, double w)
{
    for (size_t i = 0; i < imp__film_values(all); i++) {
        const double se = hypot((1 - w) * (double)all->se[i], w * (double)film->se[i]);
        all->mean[i] =
            (float)((1 - w) * (double)all->mean[i] + w * (double)film->mean[i]);
        all->se[i] = (float)se;
    }
    all->spp += film->spp;
    all->sets += film->sets;
    all->dropped += film->dropped;
    imp__drops_merge(&all->drops, &film->drops);
}

enum imp_status imp_render_until(const imp_scene *scene, const struct imp_run *run,
                                 const struct imp_until_options *options, imp_film **out,
                                 struct imp_until_end *end)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    struct imp__looks l;
    const struct imp_sensor *sensor;
    struct spread spread = {0, INFINITY};
    imp_film *all = NULL, *film = NULL;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "out");
    if (end) IMP_SIZED(scene->ctx, end, "end");
    IMP_RUN(scene->ctx, own, run);
    IMP_CHECKED(imp__looks_begin(scene->ctx, __func__, &own, options, &l));
    IMP_CHECKED(imp__run_sensor(scene, &own, &sensor));
    l.run.preview = NULL;
    while (imp__looks_next(&l)) {
        st = imp_render(scene, &l.run, &film);
        if (st == IMP_CANCELLED && all) {
            l.end.looks--;
            break;
        }
        if (st != IMP_OK && st != IMP_CANCELLED) goto out;
        if (!film || !film->se) {
            if (st == IMP_OK)
                st = imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                                "%s: the picture has no standard errors, by "
                                "which a wanted error could be found reached",
                                __func__);
            goto out;
        }
        const double share = sharing(scene, &own, sensor, film->channels);
        const struct spread own_spread = spread_of(film, share);
        if (!all) {
            all = film;
            spread = own_spread;
            l.end.spp = film->spp; /* the time may have been up */
        } else {
            spread_mix(&spread, own_spread, imp__looks_weight(&l));
            film_mix(all, film, imp__looks_weight(&l));
            imp_film_destroy(film);
        }
        film = NULL;
        if (st == IMP_CANCELLED) break;
        imp__looks_bound(&l, bound(&l, all, share, spread.freedom));
        if (own.preview) own.preview(all, own.preview_payload);
    }
out:
    imp_film_destroy(film);
    if (st != IMP_OK && st != IMP_CANCELLED) {
        imp_film_destroy(all);
        return st;
    }
    *out = all;
    if (all) l.end.spp = all->spp;
    if (end) IMP_GIVE(scene->ctx, end, l.end, "end");
    return st;
}
