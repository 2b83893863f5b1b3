/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: a scene from photographs. Given a scene with rough guesses and photographs of its
 * sensors, imp_measure finds the numbers of the scene in stages, each of which begins where the one
 * before has ended:
 *
 *     cameras    poses and fields of view, with exposure, lights and materials beside them
 *     lens       principal points and distortion, with all of these beside them; where it or its numbers
 *                are named
 *     exposure   exposure, white balance, vignetting and gamma of the films, with that factor
 *     lights     radiances of lamps and sky
 *     materials  reflectances, roughnesses, media
 *     textures   parameters of more than 12 numbers that are no spectra (Adam, coarse to fine)
 *     together   all of the stages before, textures where there are no more than 236 numbers: this
 *                is where the intervals come from
 *
 * Before and after "together" blocks of pixels that do not fit where most others do (something that has
 * moved, the photographer's reflection) lose their weight; stages whose numbers have moved on are
 * repeated where the photographs are not explained, which is judged by what is left over and
 * their noise. Each decision is a line of text with its number. docs/measure.md.
 */
#ifndef IMPORTON_MEASURE_H
#define IMPORTON_MEASURE_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A photograph of a sensor. Pixels are as those of a target (struct imp_target): of a film with a
 * gamma the values of the file, from 0 to 1, else linear in light. */
struct imp_photo {
    size_t size;
    const char *name; /**< for messages; NULL: its sensor's */
    int sensor;
    int width, height, channels; /**< must be the sensor's; channels 1 or the scene's */
    const float *pixels;         /**< [height][width][channels] */
    const float *weights;        /**< [height][width], >= 0; NULL: 1 everywhere */
    bool clipped;     /**< values <= low or >= high are clipped (imp_problem_clip) */
    double low, high; /**< these levels */
    /** One standard deviation of the noise of its values; 0: estimated from differences between
     * neighbouring pixels, but at least that of rounding to `step`. */
    double noise;
    double
        step; /**< between neighbouring values of the file, 1/255 of one of 8 bits; 0: none */
    /** What the camera wrote, 0 where it is not known. The focal length is that of a film of 36 x 24
     * mm with the same diagonal field of view, where NAME.x_fov begins if all photographs have one;
     * exposure_s iso/(100 f_number^2), known of all, gives the ratios of exposures at the start. */
    double focal_35mm, exposure_s, iso, f_number;
    /** Noise of a sensor: light of a value v (the value itself, but of a film with a gamma v^gamma) has the
     * variance read^2 + shot v + (relative v)^2, as in imp_plan_options, and rounding to `step` adds its
     * own. A gamma makes of it the variance of the value, and a shift of its mean, which is taken off. Where
     * one of them is above 0, `noise` is not used. */
    double read, shot, relative;
};
#define IMP_PHOTO_INIT IMP_INIT_ZERO(struct imp_photo)

enum imp_measure_stage {
    IMP_MEASURE_CAMERAS = 0,
    IMP_MEASURE_LENS,
    IMP_MEASURE_EXPOSURE,
    IMP_MEASURE_LIGHTS,
    IMP_MEASURE_MATERIALS,
    IMP_MEASURE_TEXTURES,
    IMP_MEASURE_TOGETHER,
    IMP_MEASURE_STAGES
};
/** "cameras", ..., "together"; NULL: there is no such stage. */
IMP_API const char *imp_measure_stage_name(enum imp_measure_stage stage);

/** A decision, as a sentence without a newline; called from the thread that called imp_measure. */
typedef void (*imp_measure_say_fn)(const char *line, void *payload);

struct imp_measure_options {
    size_t size;
    /** Names of stages with commas between them, in any order; NULL: all. "together" follows always,
     * but more than 236 numbers of textures alone. Where "lens" is among them, and `params` is NULL,
     * x_fov and opencv_k1 of the photographs' cameras are measured. */
    const char *stages;
    /** [n_params] names or patterns of what is measured, poses and other numbers of geometry
     * included ("camera.pose", "*.x_fov"). NULL: all parameters with a gradient that the photographs
     * may tell of, and the poses of their cameras. */
    const char *const *params;
    size_t n_params;
    const char *const
        *hold; /**< [n_hold] of these, what stays as it is; single numbers as
                                  imp_problem_hold has them: "left.pose[3-5]" */
    size_t n_hold;
    int rounds; /**< of all stages, at most; 0: 3 */
    double
        mask; /**< blocks with so many robust standard deviations of the logarithms of blocks'
                      residuals more than their median are masked; 0: 6; negative: none are */
    int max_iterations;     /**< of each fit; 0: imp_fit's */
    const char *checkpoint; /**< file, written after each stage; NULL: none */
    bool resume;            /**< go on from the checkpoint if it is there */
    imp_measure_say_fn say; /**< NULL: not called */
    void *say_payload;
};
#define IMP_MEASURE_OPTIONS_INIT IMP_INIT_ZERO(struct imp_measure_options)

/** A fit of a stage. */
struct imp_measure_row {
    size_t size;
    int round; /**< from 1 */
    enum imp_measure_stage stage;
    size_t n; /**< of its numbers */
    int iterations;
    double residual, residual_hi; /**< as of imp_fit_result */
    double chi2, chi2_se; /**< likewise, the error of the estimated noise included */
    bool explained;       /**< chi2 is within three of its errors above 1 */
    /** By how many of its standard errors a number of it has moved since, at most, until the end of
     * the round. */
    double moved;
};

/** A photograph afterwards. */
struct imp_measure_photo {
    size_t size;
    double noise; /**< of its values */
    double
        chi2;  /**< mean square of its residuals over the noise, masked blocks left out */
    int block; /**< width and height of a block in pixels */
    size_t n_blocks, n_masked;
    const float *weights; /**< [height][width]: of imp_photo, 0 where it is masked */
    const float
        *residual; /**< [height][width] root of the mean square of its channels' residuals
                                over their errors; NaN where nothing is compared */
};

struct imp_measure_result {
    size_t size;
    size_t n_rows;
    const struct imp_measure_row *rows; /**< [n_rows] in their order (IMP_ROW) */
    size_t n_photos;
    const struct imp_measure_photo *photos; /**< [n_photos] (IMP_ROW) */
    size_t n_lines;
    const char *const *lines; /**< [n_lines] all decisions */
    int rounds;
    bool explained; /**< by the last fit, with at most a quarter of a photograph masked */
    /** The last fit with intervals: of `problem`. */
    const struct imp_fit_result *fit;
    size_t n_textures;
    const size_t
        *textures; /**< [n_textures] those of the stage of this name that the last fit
                                 does not have: they have no intervals */
    /** Where it is not explained: numbers that are not measured and may be wrong. */
    size_t n_missing;
    const struct imp_missing *missing; /**< [n_missing] as of imp_problem_missing */
};

/**
 * Measure a scene by photographs; it ends at the best estimate.
 *
 * @param scene   committed. Poses become parameters of it, so that no problem may have been made
 *                with it before, unless it has them.
 * @param photos  [n] one at most of each sensor; arrays are borrowed until it returns.
 * @param options NULL for defaults.
 * @param run     samples of an evaluation; its sensor is ignored. NULL for defaults.
 * @param[out] problem the last fit's, of all measured numbers but large textures, with the photographs
 *                as targets: for imp_problem_get_fit_variable, imp_plan and the like. The caller
 *                destroys it.
 * @param[out] result belongs to the problem. On failure neither is written.
 * @return IMP_OK; IMP_CANCELLED (the scene has the last stage's end, the checkpoint is written);
 *         IMP_E_ARG for photographs that no sensor takes, that are black or clipped all over, or
 *         of another size than their sensor's picture, for a word that is no stage, where nothing
 *         is to be measured, and for a checkpoint of another task; IMP_E_IO also where another
 *         process writes it; and what imp_fit returns. Messages have the photograph's or the
 *         stage's name.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_measure(imp_scene *scene, const struct imp_photo *photos, size_t n,
            const struct imp_measure_options *options, const struct imp_run *run,
            imp_problem **problem, const struct imp_measure_result **result);

#ifdef __cplusplus
}
#endif

#endif
