/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: values of a target that were clipped. A photograph's white means "at least",
 * its black "at most": such values are censored data. They have no weight where the
 * scene agrees with them, and count as the level itself where it does not. All values of
 * such a target count the less, the less the walks of a loss know them beside the target's noise. Which they
 * are is decided by pictures of other random numbers than those of losses, so that
 * losses, gradients and Gauss-Newton matrices stay unbiased for the weights that were
 * decided (docs/estimators.md, 20; docs/photographs.md).
 */
#ifndef IMPORTON_CLIP_H
#define IMPORTON_CLIP_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Values <= low or >= high of a target were clipped there. Levels are in the target's
 * own numbers; of a file of 8 bits that goes from 0 to 1 they are .5/255 and 254.5/255.
 * Until imp_problem_censor or imp_fit decides, clipped values have no weight.
 * @param target in the order of imp_problem_add_target.
 * @param low    below all numbers: none are clipped there. @param high the same above.
 * @return IMP_OK; IMP_E_ARG if there is no such target, it has levels, not low < high, or
 * one is not finite;
 * IMP_E_UNSUPPORTED for films with response curves that are not three; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_clip(imp_problem *problem, int target,
                                                        double low, double high);

/** Decide which values of clipped targets count, at the present parameters: by pictures
 * with four times the samples of `run`, at least 64, and a seed made from run->seed. For
 * own optimisers, now and then; imp_fit does it by itself. Targets without levels stay as
 * they are.
 * @param run run->sensor is ignored; NULL for defaults.
 * @return as imp_render. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_censor(imp_problem *problem,
                                                          const struct imp_run *run);

/** All targets with levels, as decided last. */
struct imp_clipped {
    size_t size;
    size_t numbers; /**< of these targets that have a weight */
    size_t clipped; /**< of these, at the levels or beyond */
    size_t silent;  /**< that have no weight now: the scene agrees that they are clipped,
                         or nearly */
    size_t against; /**< clipped values that count: the scene disagrees */
};
#define IMP_CLIPPED_INIT IMP_INIT_ZERO(struct imp_clipped)
/** Set out->size first. @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status imp_problem_get_clipped(const imp_problem *problem,
                                                               struct imp_clipped *out);

#ifdef __cplusplus
}
#endif

#endif
