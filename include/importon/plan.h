/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: which measurement next. Candidates, pictures that could be taken, each with its noise
 * and cost, are ranked by how much they would shrink the intervals of the active numbers (optimal
 * design of experiments: Fedorov 1972; Chaloner and Verdinelli, Statist. Sci. 10, 1995).
 *
 * A picture with Jacobian J and noise of variance 1/W adds the information I = J^T W J to what is
 * known, which is estimated without bias from one pass of walks at the scene's present
 * parameters (docs/estimators.md 15). With S_0 the covariance before (of priors and of what has
 * been measured), the covariance after the pictures of a set is S = (S_0^-1 + sum I)^-1, and
 *
 *     gain   D:  (log det S_0 - log det S)/m, of the m wanted numbers: the mean of
 *                log (variance before / variance after) over the axes of the ellipsoid
 *            A:  log (trace S_0 / trace S), numbers in units of their priors
 *
 * so that intervals shrink to exp(-gain/2) of their lengths. The Monte Carlo error of the entries
 * of I is carried to the gain and to the differences of gains: candidates whose gains it cannot
 * tell apart form a group. docs/do/plan.md, docs/estimators.md 23.
 */
#ifndef IMPORTON_PLAN_H
#define IMPORTON_PLAN_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A picture that could be taken, or has been. */
struct imp_plan_candidate {
    size_t size;
    const char *name; /**< for messages; NULL: its sensor's */
    int sensor;
    /** The sensor, a perspective camera, stands at `origin` and looks at `target`, `up` upwards
     * (0: any), in place of where the scene has it. */
    bool placed;
    double origin[3], target[3], up[3];
    /** Names of the lamps that are on, with their radiances in the scene; patterns, separated by
     * commas. NULL: all. */
    const char *lamps;
    double time; /**< of exposure, in those that the noise is given for; 0: 1 */
    double cost; /**< of taking it, in any unit, such as minutes; 0: 1 */
    bool have;   /**< it has been taken: its information counts, and it is not ranked */
};
#define IMP_PLAN_CANDIDATE_INIT IMP_INIT_ZERO(struct imp_plan_candidate)

enum imp_plan_criterion { IMP_PLAN_D = 0, IMP_PLAN_A };

/** What is wanted, what is known, and how noisy pictures are. The variance of a value v of a
 * picture that was exposed for a time t, in the units of the scene's pictures, is
 *
 *     read^2/t^2 + shot v/t + (relative v)^2
 *
 * (EMVA 1288: dark noise and quantisation, photon noise, non-uniformity), and values with
 * t v >= white are saturated: they tell nothing. */
struct imp_plan_options {
    size_t size;
    enum imp_plan_criterion criterion;
    /** [n_of] indices in x of the wanted numbers; NULL: all. Those that are held (imp_problem_hold) do
     * not count, and have no interval. */
    const size_t *of;
    size_t n_of;
    /** [imp_problem_n_variables] one standard deviation of what is known of a number without
     * pictures, in units of x; 0: its large change (its range where it has two bounds, else its
     * size), which keeps numbers that no picture determines from being infinite. NULL: all 0. */
    const double *prior;
    double read, shot, relative, white; /**< all 0: read is 1 % of each picture's mean */
    size_t
        take; /**< pictures to choose together; 0: 1, or with `budget` as many as fit in */
    double
        budget; /**< of the chosen ones' costs; 0: none, and the gain over the cost counts */
};
#define IMP_PLAN_OPTIONS_INIT IMP_INIT_ZERO(struct imp_plan_options)

/** A candidate, and what it would bring. */
struct imp_plan_row {
    size_t size;
    size_t candidate; /**< index */
    struct imp_estimate gain;
    struct imp_estimate worth; /**< gain over cost, by which rows are ordered */
    /** Number of its group, from 0: the worths of a group are within 2.5 times the errors of their
     * differences from its first one. */
    size_t group;
    double lit; /**< fraction of its values that count: neither saturated nor 0 */
    /** [n] standard deviation of each number after it, in its own unit (of a logarithm, of the
     * number); infinite: not determined, that is known worse than by half of the large change. */
    const double *se;
    const double *information;    /**< [n][n] J^T W J, per unit of x each */
    const double *information_se; /**< [n][n] one standard error of each entry */
    const double *pull;           /**< [n][n] d gain / d information */
};

struct imp_plan_result {
    size_t size;
    size_t n;            /**< of x */
    const double *today; /**< [n] as imp_plan_row.se, without new pictures */
    const double *prior; /**< [n] in units of x, as used */
    const double *span;  /**< [n] the numbers' large changes, in units of x */
    size_t n_rows;
    const struct imp_plan_row *rows; /**< [n_rows] the best first (IMP_ROW) */
    size_t n_chosen;
    const size_t
        *chosen; /**< [n_chosen] indices of candidates, in the order of their worth */
    struct imp_estimate chosen_gain;
    const double *chosen_se; /**< [n] after all chosen ones */
    /** Combinations that stay undetermined with all candidates together: [n_loose][n] unit
     * vectors, numbers in units of `span`. */
    size_t n_loose;
    const double *loose;
};

/** Rank candidates, and choose a set of them: one after the other by what they add, then by
 * exchanges of one for another while these improve it.
 *
 * The problem's active variables are the numbers; its targets and regularisers do not count. The
 * scene is moved and lit for each candidate in turn, and afterwards is as before.
 * @param candidates [n] at most 4096.
 * @param options NULL for defaults.
 * @param run     samples of each candidate, its pilot picture and its information; its sensor is
 *                ignored. NULL for defaults.
 * @param[out] result it belongs to the problem, until the next call.
 * @return IMP_OK; IMP_CANCELLED; IMP_E_ARG where nothing is active, no candidate is to be ranked,
 *         one names no lamp or looks nowhere, more are to be chosen than there are, a number is
 *         out of its range, or all values of all of them are 0 or saturated (where those of one
 *         are, it is a warning with its name); IMP_E_UNSUPPORTED for a sensor that cannot be
 *         placed, as of imp_scene_add_pose; and what imp_problem_jacobian refuses. Messages have the
 *         candidate's name. Where the context makes parts, a part has whole candidates, 1/N of
 *         them, and returns IMP_PART.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_plan(imp_problem *problem, const struct imp_plan_candidate *candidates, size_t n,
         const struct imp_plan_options *options, const struct imp_run *run,
         const struct imp_plan_result **result);

/** Improve the place of a camera along the derivative of its gain, on the sphere around its target: each
 * round ranks it and four places around it, by differences, until the derivative is within twice its
 * error.
 * @param candidates [n] those that we have, and one that is placed: the first that has not been taken.
 * @param rounds  at most, 1 to 200.
 * @param[out] origin [3] the place found.
 * @param[out] gain   there, of random numbers of its own.
 * @return as imp_plan; IMP_E_ARG where no candidate is placed; IMP_E_UNSUPPORTED where the context makes
 *         parts.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_plan_improve(imp_problem *problem, const struct imp_plan_candidate *candidates,
                 size_t n, const struct imp_plan_options *options,
                 const struct imp_run *run, int rounds, double origin[3],
                 struct imp_estimate *gain);

/** Name of a lamp, as imp_plan_candidate.lamps has it, 0 <= lamp < imp_scene_info.n_emitters. It
 * belongs to the scene. NULL if there is none. */
IMP_API const char *imp_plan_lamp(const imp_scene *scene, int lamp);

/** Which pixels of a candidate tell of which number: per pixel and channel the information
 * w J_i^2 on each number, and sum over i, j of pull_ij w J_i J_j, its share in a criterion. Products
 * are of two independent derivative pictures, so that sums over pixels are the
 * information without bias, and noise may make single pixels negative.
 * @param pull [n][n], of imp_plan_row, or any other.
 * @param[out] films [n + 1] one for each number, then the criterion's; the caller destroys them.
 * @return as imp_plan; IMP_E_UNSUPPORTED where the context makes parts.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_plan_map(imp_problem *problem, const struct imp_plan_candidate *candidate,
             const struct imp_plan_options *options, const struct imp_run *run,
             const double *pull, imp_film **films);

#ifdef __cplusplus
}
#endif

#endif
