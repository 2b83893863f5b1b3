/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: recorded walks. What rays and random numbers have settled of a walk (where it
 * scattered, its directions, densities, light samples and what stood in their way) does
 * not depend on reflectances, lamps and roughness. It can be kept, and evaluated at other
 * parameters without a ray:
 *
 *     imp_walks_keep          draw and keep the walks of a scene
 *     imp_scene_set_values    other parameters
 *     run.walks = walks       imp_render, imp_problem_objective and all others that take
 *                             an imp_run then evaluate these walks in place of tracing
 *     imp_walks_weigh         how many of them still count
 *
 * At the parameters that they were drawn at, recorded walks give what tracing gives, to
 * the bit, unless roulette was given a floor (imp_walks_options) or they are those of a
 * loss with points of Sobol's sequence: recorded walks serve losses of all kinds with
 * one number of sets, and a loss that is traced has the sets that are best for it. At
 * others they are unbiased, and their variance grows where densities move away: with a
 * narrower lobe much, with reflectances and lamps not at all. Many evaluations of the
 * same walks share their noise, so that a fit's errors have to come from fresh ones
 * (imp_fit takes care of that).
 */
#ifndef IMPORTON_WALKS_H
#define IMPORTON_WALKS_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

struct imp_walks_options {
    size_t size;
    size_t memory; /**< bytes that the walks may take; 0: 2^30 */
    /** 0: the walks of imp_render with this run. 1: walks of losses and their gradients
     * (imp_problem_objective), of which pictures can be made too. They are the same walks
     * unless wavelengths are stratified or points are those of Sobol's sequence, whose
     * sets have to be independent of each other for a loss. Recorded walks are then two or
     * more replicates of two sets; a quadratic loss that is traced may have one
     * replicate, and one that is not quadratic has four sets. */
    bool losses;
    bool all_sensors; /**< not 0: of all sensors; 0: of run->sensor alone */
    /** Least probability with which roulette lets a walk go on: reflectances up to its
     * root keep a finite variance however long walks are. 0: .8; negative: what the
     * integrator decides, as for walks that are not kept. */
    double survival;
    /** Least effective sample size, a fraction of the walks, with which they are
     * evaluated; 0: .5. */
    double ess;
    /** Ranks of a team keep a share each, to be written (imp_walks_write) and not
     * evaluated: memory and work are divided. 0: each keeps all of them. */
    bool spread;
    /** Room for extinctions that vary in space, of grids: collisions are drawn under
     * bounds that many times as high, at least an eighth of the medium's largest and one
     * over the size of its box before they are raised by this factor less 1, and a tenth
     * of them at least count as real. Such numbers may then grow up to the bounds, also
     * from 0, and walks have the derivative with respect to them. Walks become longer,
     * and their variance larger. 0 or 1: none; at most 64. */
    double headroom;
};
#define IMP_WALKS_OPTIONS_INIT IMP_INIT_ZERO(struct imp_walks_options)

/** Draw walks at the scene's present parameters and keep them: about 164 bytes a vertex.
 * The scene must outlive them. Parameters with a gradient may change afterwards, but for
 * those of graded indices, which move rays. By extinctions collisions were drawn: they
 * may change where they were not 0, up to the bounds under which collisions were drawn,
 * and walks have no derivative with respect to them, unless there is headroom. Alpha
 * stays that of the draw.
 * @param run     as of imp_render; NULL for the defaults.
 * @param options NULL for the defaults.
 * @param[out] out the caller destroys it.
 * @return IMP_OK; IMP_CANCELLED; IMP_E_ARG; IMP_E_NOMEM if they need more than
 *         options->memory (the message says how much); IMP_E_UNSUPPORTED, with the
 *         reason, for light walks, through graded indices that are active,
 *         past shapes with a priority, from sensors that are surfaces, integrators that
 *         make no walks or have transmittance=delta, and in parts. Ranks of a team keep
 *         all walks each. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_walks_keep(imp_scene *scene, const struct imp_run *run,
               const struct imp_walks_options *options, imp_walks **out);
/** walks may be NULL. No run may use them any more. */
IMP_API void imp_walks_destroy(imp_walks *walks);

/** Write the walks to a file, with all that evaluating them takes: materials, lights,
 * textures and grids with their numbers, but no meshes. The file is written whole or not
 * at all, by rank 0 of a team, of which all ranks make this call. Its bytes do not depend
 * on the number of threads and ranks.
 * @return IMP_OK; IMP_E_ARG; IMP_E_IO; IMP_E_NOMEM; IMP_E_UNSUPPORTED, with the reason,
 *         for scenes whose materials need triangles (attributes, bump maps on meshes),
 *         with graded indices, and instances in instances. */
IMP_API IMP_MUST_CHECK enum imp_status imp_walks_write(const imp_walks *walks,
                                                       const char *path);

/** Read walks from a file.
 * @param scene   NULL: what the file holds becomes a scene (imp_walks_scene) that has all
 *                parameters and no geometry: walks are evaluated in it, and none are
 *                traced. It is destroyed with the walks; problems on it go first. Else
 *                the scene that they were drawn in, at any numbers that may change.
 * @param options memory and ess count; NULL for the defaults.
 * @param[out] out the caller destroys it. The parameters are those of the draw if the
 *                scene is the file's.
 * @return IMP_OK; IMP_E_ARG: walks of another scene, and what differs; IMP_E_SCENE: the
 *         file is of another version, byte order or build; IMP_E_IO, also if it is
 *         damaged; IMP_E_NOMEM: they need more than options->memory. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_walks_read(imp_context *context, imp_scene *scene, const char *path,
               const struct imp_walks_options *options, imp_walks **out);

struct imp_walks_info {
    size_t size;
    int n_sensors; /**< with recorded walks */
    int spp;       /**< walks of a pixel, of the first of these sensors */
    uint64_t seed;
    double n_walks, n_vertices, bytes;
    double survival; /**< floor of roulette; 0: none */
    bool losses;     /**< as of imp_walks_options */
};
/** Set info->size first. @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_walks_get_info(const imp_walks *walks,
                                           struct imp_walks_info *info);

/** The scene in which they are evaluated; the caller's. That of walks which were read
 * with their scene: destroyed with the walks, not by the caller. */
IMP_API imp_scene *imp_walks_scene(const imp_walks *walks);

struct imp_walks_weight {
    size_t size;
    /** Effective sample size as a fraction of the walks, from 0 to 1: of the densities'
     * ratios w = p(theta')/p(theta), (sum w)^2/(n sum w^2). It ranks two draws; it is
     * no measure of the variance. */
    double ess;
    /** Growth of the second moment from step to step of roulette, estimated; from 1 on,
     * walks without a last depth have no finite variance. 0: no roulette. */
    double growth;
    double n_walks;      /**< of the estimate */
    const char *refused; /**< why they are not evaluated at these parameters; NULL: they
                              are. It belongs to this thread, until its next call. */
};
#define IMP_WALKS_WEIGHT_INIT IMP_INIT_ZERO(struct imp_walks_weight)
/** What the walks of a sensor are worth at the scene's present parameters.
 * @param mask [height][width]: pixels with 0 are left out; NULL: none are.
 * @param[out] weight set its size first.
 * @return IMP_OK, also where they are refused; IMP_E_ARG if there are none of this
 *         sensor; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_walks_weigh(const imp_walks *walks, int sensor,
                                                       const float *mask,
                                                       struct imp_walks_weight *weight);

#ifdef __cplusplus
}
#endif
#endif
