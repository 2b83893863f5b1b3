/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: samples until the wanted error is reached. Looks are taken after n, 2n, 4n,
 * ... samples per pixel, n = run->spp, each time as many new independent ones as there
 * were. The k-th look may err with probability risk/(k (k + 1)), whose sum over all
 * looks is `risk`, so that the answer keeps its promise wherever the sequence ends
 * (alpha spending: Lan and DeMets, Biometrika 70, 1983). docs/estimators.md, 19.
 *
 * The bound holds where standard errors are right, which takes enough samples: light
 * that has not been found yet is in none of them. An answer of 0 is never near enough.
 * Each look reads the scene by itself: it may not be changed before the last one.
 */
#ifndef IMPORTON_UNTIL_H
#define IMPORTON_UNTIL_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

struct imp_until_options {
    size_t size;
    double relative; /**< the wanted error, as a part of the answer; 0: .05 */
    double risk;     /**< probability, at most, that it is missed, below 1; 0: .05 */
    int most_spp;    /**< samples per pixel, at most; 0: 65536 */
    /** For gradients of a loss, from the third look on: by the variance of the parameters
     * that are known least. */
    enum imp_allocation allocation;
};
#define IMP_UNTIL_OPTIONS_INIT IMP_INIT_ZERO(struct imp_until_options)

/** How a sequence ended. */
struct imp_until_end {
    size_t size;
    bool reached;    /**< 1: the wanted error was; 0: the samples or the time were up */
    int looks;       /**< how many there were */
    int64_t spp;     /**< samples per pixel of all of them */
    double relative; /**< bound of the error at the last look, as a part of the answer */
};
#define IMP_UNTIL_END_INIT IMP_INIT_ZERO(struct imp_until_end)

/**
 * A picture whose error is a part `relative` of it: with probability 1 - risk
 * sum (I - truth)^2 <= relative^2 sum I^2, over pixels and channels.
 * @param run     run->spp: samples before the first look, 0: 16; at least 2. With
 *                time_limit_s the first look ends then, and no other is begun that would
 *                not end in time if it took as long as all before.
 * @param options NULL for defaults.
 * @param[out] out the mean over all looks with its standard errors; the caller destroys
 *                it.
 * @param[out] end may be NULL.
 * @return as imp_render; IMP_CANCELLED with what the looks before gave, or in the first
 *         as imp_render; IMP_E_UNSUPPORTED for pictures without standard errors.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_render_until(const imp_scene *scene, const struct imp_run *run,
                 const struct imp_until_options *options, imp_film **out,
                 struct imp_until_end *end);

/**
 * A loss, or a sum over pictures (imp_problem_functional), with its gradient, until each
 * active parameter's gradient is known to a part `relative`: with probability 1 - risk,
 * of each parameter, |g - truth| <= relative |g|, lengths over the parameter's numbers. A
 * parameter whose gradient is 0 never gets there. With gradient NULL the same of the
 * value.
 * @param adjoint  [height][width][channels]; NULL: the loss of the targets.
 * @param run      as in imp_render_until, but that the first look takes its time.
 * @param options  NULL for defaults.
 * @param value    may be NULL.
 * @param gradient,gradient_se [n]; both NULL: the value alone.
 * @param[out] end may be NULL.
 * @return as imp_problem_objective or imp_problem_functional; IMP_CANCELLED with what the
 *         looks before gave, if there were any.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_until(imp_problem *problem, const float *adjoint, const struct imp_run *run,
                  const struct imp_until_options *options, struct imp_estimate *value,
                  double *gradient, double *gradient_se, struct imp_until_end *end);

#ifdef __cplusplus
}
#endif

#endif
