/* SPDX-License-Identifier: Apache-2.0
 *
 * The contracts of kinds, tested on the objects of a scene: one file a concept, each with
 * one function here and a line in selftest.c. */
#ifndef IMP_INVERSE_SELFTEST_H
#define IMP_INVERSE_SELFTEST_H

#include "math/draws.h"
#include "math/rng.h"
#include "math/stat.h"
#include "scene/scene.h"

struct imp__scores;
struct imp__selftest {
    imp_context *ctx;
    const struct imp_scene *scene;
    struct imp_selftest_options options;
    bool raises;  /* draws are added until 2 % would be seen */
    double level; /* of one chi-square, so that all together fail 1 % (Sidak 1967) */
    struct imp__sphere_tree *tree;
    struct imp_selftest_row *rows;
    size_t n_rows, cap_rows;
    double start_s, asked_s; /* imp__now(); when the caller was asked last */
    double part;             /* of the objects that are done */
    bool stopped;            /* by the caller */
};

/* Asks the caller, a few times a second, whether to go on; a number that was stopped on its way
 * means nothing, and no row is added any more (IMP_CANCELLED). */
bool imp__selftest_stopped(struct imp__selftest *t);
/* The same as a function of draws.h; the payload is the test. */
bool imp__selftest_watch(void *test);

/* Add a row; ok is error <= limit, or what it is already if that is -1. */
enum imp_status imp__selftest_row(struct imp__selftest *t,
                                  const struct imp_selftest_row *row);
/* Number `value` of failures among n answers: there may be none. */
enum imp_status imp__selftest_count(struct imp__selftest *t, const char *object,
                                    const char *kind, const char *contract, double value,
                                    double n);
/* The least chance of some chi-squares. */
enum imp_status imp__selftest_draws(struct imp__selftest *t, const char *object,
                                    const char *kind, double chance, double sees);
/* A z-score. */
enum imp_status imp__selftest_z(struct imp__selftest *t, const char *object,
                                const char *kind, const char *contract,
                                const struct imp__scores *s);

/* ---- selftest_power.c: what a test would have seen ---- */
/* A relative error that rows want to see, with the probability IMP_SELFTEST_POWER. */
#define IMP_SELFTEST_WANTED 0.02
#define IMP_SELFTEST_POWER  0.95
#define IMP_SELFTEST_LIMIT  4.5 /* of |z|: 1 in 150,000 by chance, and objects have tens */

/* Chi-squares of several directions, one by one and together. */
struct imp__chances {
    double least;            /* chance of one, or of their sum */
    double chi2, degrees, n; /* sums over those with enough cells; n: draws */
};
#define IMP_CHANCES_INIT                                                                 \
    {                                                                                    \
        .least = 1                                                                       \
    }
void imp__chances_add(struct imp__chances *c, const struct imp__draws *test, int n);
/* All are there. Returns the root mean square relative error that the sum would have seen. */
double imp__chances_end(struct imp__chances *c, double level);

/* Values against references at several places, one by one and together: the relative error that
 * all have is estimated by weights 1/variance. */
struct imp__scores {
    double z, value, reference, se; /* the worst */
    double sum, weight;             /* of relative errors */
    double sees;
};
void imp__scores_add(struct imp__scores *s, double value, double reference, double se);
void imp__scores_end(struct imp__scores *s);

/* Draws of the next try: so many that `sees` becomes what is wanted. 0: it is, or the caller
 * has said how many, or there are as many as there may be. */
int imp__selftest_more(const struct imp__selftest *t, int n, double sees);

enum imp_status imp__selftest_materials(struct imp__selftest *t);
enum imp_status imp__selftest_lights(struct imp__selftest *t);
enum imp_status imp__selftest_cameras(struct imp__selftest *t);
enum imp_status imp__selftest_phases(struct imp__selftest *t);
enum imp_status imp__selftest_media(struct imp__selftest *t);
enum imp_status imp__selftest_shapes(struct imp__selftest *t);

/* The contracts of one material, or of what scatters like one; name and kind are given. */
enum imp_status imp__selftest_bsdf(struct imp__selftest *t, const struct imp_bsdf *b,
                                   const char *name, const char *kind);

/* A direction that is not near the horizon, above it for even i. */
imp_v3 imp__selftest_direction(int i, uint64_t seed);

/* ---- selftest_derivative.c: derivatives of a BSDF against differences ---- */
typedef void imp__bsdf_value(const struct imp_bsdf *b, const imp_spec *in,
                             const struct imp_dirs *d, imp_spec *f);
struct imp__derivative_tally {
    long numbers, kinks; /* compared; of these, where the value is not smooth */
    bool lanes_mixed;
};
/* Input j as its kind declares it, children's included. */
const struct imp_input_desc *imp__bsdf_input(const struct imp_bsdf *b, int j);
/* Has it no gradient, by its kind or in this object? */
bool imp__bsdf_input_fixed(const struct imp_bsdf *b, int j);
/* Largest error of df, relative to the derivative and to what rounding of f allows a
 * difference to see. `in` is moved and put back. */
double imp__bsdf_derivative_error(const struct imp_bsdf *b, imp_spec *in,
                                  const struct imp_dirs *d, imp__bsdf_value *value,
                                  const imp_spec *df, int lanes,
                                  struct imp__derivative_tally *t);

#endif
