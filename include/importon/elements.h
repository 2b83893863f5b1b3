/* SPDX-License-Identifier: Apache-2.0
 *
 * elements.h: the deterministic solver. Radiance and directional importance travel over
 * one hierarchy of links between surface elements (Christensen, Salesin, DeRose, "A
 * Continuous Adjoint Formulation for Radiance Transport", 1993; docs/elements.md). In the
 * order of use:
 *
 *     imp_elements_create       polygons and materials of a scene, checked
 *     imp_elements_solve        refine and solve until a stopping rule
 *     imp_elements_image        pictures through the scene's sensors, any number of views
 *     imp_elements_sensitivity  what every light and every reflectance does to the
 *                               measurement
 *     imp_elements_fit          lights and reflectances for wanted measurements
 *
 * It takes rectangles, cubes and meshes; area lights; materials that are smooth,
 * isotropic and without textures. What cannot be projected is refused by name. Results
 * have no noise, do not depend on the thread count, and are biased by the mesh and the
 * directional order. The conventions of importon.h hold.
 */
#ifndef IMPORTON_ELEMENTS_H
#define IMPORTON_ELEMENTS_H

#include <importon/importon.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct imp_elements imp_elements;

enum imp_elements_source_kind {
    IMP_ELEMENTS_CAMERA = 0, /**< mean of the channels of a sensor's picture or a part */
    IMP_ELEMENTS_PLANE, /**< mean illuminance (luminance of the irradiance) of a virtual
                           parallelogram, which does not occlude */
    IMP_ELEMENTS_SHAPE  /**< mean illuminance of a shape's front */
};

/** A measurement, and so a source of importance. Several are added with their weights. */
struct imp_elements_source {
    size_t size;
    enum imp_elements_source_kind kind;
    double weight; /**< 0: 1 */
    int sensor;    /**< camera */
    int region[4]; /**< camera: x0, y0, x1, y1 in pixels, end excluded; all 0: all */
    double origin[3], edge_u[3],
        edge_v[3];     /**< plane; its front is along edge_u x edge_v */
    const char *shape; /**< shape: its name */
};
#define IMP_ELEMENTS_SOURCE_INIT IMP_INIT_ZERO(struct imp_elements_source)

/** Reciprocal modified Phong in place of a shape's material, seen from its front:
 * kd/pi + ks (n+2)/(2 pi) max(0, mirror(wi).wo)^n. */
struct imp_elements_phong {
    size_t size;
    const char *shape; /**< name; "*" for all that are not lights */
    double kd[3], ks[3], exponent;
};
/** Give a shape's light a direction: radiance L0 max(0, w.axis)^exponent along w. */
struct imp_elements_beam {
    size_t size;
    const char *shape;
    double axis[3]; /**< world; all 0: the shape's normal */
    double exponent;
};
#define IMP_ELEMENTS_PHONG_INIT IMP_INIT_ZERO(struct imp_elements_phong)
#define IMP_ELEMENTS_BEAM_INIT  IMP_INIT_ZERO(struct imp_elements_beam)

struct imp_elements_options {
    size_t size;
    int order;          /**< of the directional basis, 2..12; 0: by the materials */
    bool no_importance; /**< refine by radiance alone (the baseline of 1993) */
    int sensor;         /**< of the picture that decides when to stop */
    int rays;    /**< per side of a pixel's grid; 0: 3 to 24, more in small pictures;
                      to 64 of a meter on a shape */
    double stop; /**< relative change of the goal: of the measurements if there
                    are sources, RMS of the picture if there are none or `picture` is
                    set; 0: 0.01; < 0: never stop for that */
    double eps_first,
        eps_last; /**< link tolerance relative to what passes; 0: 0.05, 5e-6 */
    int sweeps, final_sweeps; /**< 0: 4, 12 */
    int max_level;            /**< of subdivision; 0: 9 */
    size_t max_links;         /**< 0: 20 million */
    size_t max_bytes;         /**< 0: 4 GiB */
    double time_limit_s;      /**< 0: none; reached: ends as if cancelled */
    uint64_t seed;
    size_t n_sources;                          /**< 0: the sensor's whole picture */
    const struct imp_elements_source *sources; /**< each as long as its own `size` */
    size_t n_phong;
    const struct imp_elements_phong *phong; /**< likewise */
    size_t n_beams;
    const struct imp_elements_beam *beams; /**< likewise */
    imp_progress_fn progress;
    void *progress_payload;
    bool picture; /**< beside its sources the sensor's picture decides when to stop */
};
#define IMP_ELEMENTS_OPTIONS_INIT IMP_INIT_ZERO(struct imp_elements_options)

/**
 * Take the scene's polygons and project its materials. The scene must outlive the result
 * and keep its parameters until imp_elements_update.
 * @return IMP_OK; IMP_E_ARG; IMP_E_UNSUPPORTED, with the shape's name, for a shape,
 * material or light that has no place here; IMP_E_NOMEM also if the first links alone are
 * over the budget: the message has the estimate.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_create(const imp_scene *scene, const struct imp_elements_options *options,
                    imp_elements **out);
/** elements may be NULL. Guides made from it go first. */
IMP_API void imp_elements_destroy(imp_elements *elements);

/** Refine and solve. @return IMP_OK; IMP_CANCELLED (progress or time limit): what was
 * reached is a valid, coarser solution; IMP_E_NUMERIC if reflections do not die away;
 * IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_elements_solve(imp_elements *elements);

/** Read the scene's parameters again and solve on the same links, without refining.
 * @return as imp_elements_solve. */
IMP_API IMP_MUST_CHECK enum imp_status imp_elements_update(imp_elements *elements);

/** One line of the schedule's log. */
struct imp_elements_step {
    size_t size;
    double eps; /**< absolute */
    size_t links, elements, leaves;
    int64_t rays;
    double measure;
    double change; /**< of the goal, as in `stop`; NaN at first */
    double elapsed_s;
};
struct imp_elements_info {
    size_t size;
    int order, functions; /**< of the basis */
    size_t polygons, elements, leaves, links;
    size_t skipped; /**< polygons without area */
    int64_t rays;
    size_t bytes; /**< held */
    double bytes_per_link, bytes_per_element;
    double measure;         /**< the weighted measurements, radiance side */
    double measure_direct;  /**< part of it: lights seen by the eye */
    double measure_adjoint; /**< the same number from emission x importance */
    double worst_residual;  /**< relative L2 error of the worst lobe in the basis */
    const char *reason;     /**< why it stopped */
    size_t n_steps;
    const struct imp_elements_step *steps;
    double luminance;  /**< part of `measure` from cameras, as luminance; NaN: none */
    size_t n_measures; /**< sources, 1 if none was given */
    const double *measures; /**< [n_measures] of each by itself, without its weight */
};
/** Set info->size first; strings and arrays belong to the elements, until they are
 * solved again.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_get_info(const imp_elements *elements, struct imp_elements_info *info);

enum imp_elements_image {
    IMP_ELEMENTS_FLAT = 0, /**< every element's own value */
    IMP_ELEMENTS_GOURAUD,  /**< interpolated, without cracks */
    IMP_ELEMENTS_GATHER, /**< last reflection by the true material and fresh visibility */
    IMP_ELEMENTS_IMPORTANCE /**< mean exitant importance, one channel "importance" */
};
/** A picture through a sensor; `rays` per side of a pixel's grid, 0: as in the options.
 * @param[out] out the caller destroys it.
 * @return IMP_OK; IMP_E_ARG if there is no such sensor or kind, or nothing was
 *         solved; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_elements_image(const imp_elements *elements,
                                                          int sensor,
                                                          enum imp_elements_image kind,
                                                          int rays, imp_film **out);

/** One derivative of the measurement. */
struct imp_elements_row {
    size_t size;
    const char *name; /**< parameter; of overrides "SHAPE.phong.kd" ... */
    int param;        /**< index in the scene, -1: an override */
    size_t element;   /**< number inside it */
    bool emission;    /**< it scales a light, linearly */
    double value, derivative;
    double share;       /**< value x derivative / measure; those of emission sum to 1 */
    double share_error; /**< of imp_elements_share_errors, else NaN */
};
/** Derivatives of the measurement to every light and material value, links fixed,
 * largest |value x derivative| first. Rows belong to the object until the next call.
 * @param[out] rows [n_rows] (IMP_ROW).
 * @return IMP_OK; IMP_E_ARG; IMP_CANCELLED; IMP_E_NUMERIC if reflections do not die
 *         away; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_sensitivity(imp_elements *elements, const struct imp_elements_row **rows,
                         size_t *n_rows);

/**
 * imp_elements_sensitivity, with the error of each share that the directional order l
 * makes: |share in order l - share in order l - 2|, on the same links. Where l is below
 * 4, or the order below too small for a lobe, order l + 2 takes its place; NaN where that
 * is above 12. 0 where nothing is glossy. Takes the memory of the elements again, and the
 * time of solving without refinement.
 * @return as imp_elements_sensitivity. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_share_errors(imp_elements *elements, const struct imp_elements_row **rows,
                          size_t *n_rows);

/* ---- Design: parameters of the scene for wanted measurements ----------------------- */

/** Bounds for the active variables of parameters that match; inside the scene's own. */
struct imp_elements_bounds {
    size_t size;
    const char *glob;
    double lo, hi;
};
#define IMP_ELEMENTS_BOUNDS_INIT IMP_INIT_ZERO(struct imp_elements_bounds)
struct imp_elements_fit_options {
    size_t size;
    enum imp_optimizer optimizer; /**< IMP_ADAM, the 0: IMP_LM up to 256 variables, else
                                       IMP_LBFGS */
    int max_iterations;           /**< of every round; 0: 100 */
    double tolerance;             /**< of steps, relative; 0: 1e-8 */
    int rounds;            /**< at most, each on links refined at the last answer; 0: 3 */
    const double *targets; /**< [n_sources] of the elements' options */
    size_t n_bounds;
    const struct imp_elements_bounds *bounds; /**< each as long as its own `size` */
};
#define IMP_ELEMENTS_FIT_OPTIONS_INIT IMP_INIT_ZERO(struct imp_elements_fit_options)
struct imp_elements_goal {
    size_t size;
    double target, before, after; /**< a source's measurement, without its weight */
};
struct imp_elements_fit_result {
    size_t size;
    int iterations, rounds;
    double objective;
    bool linear; /**< only lights were active: the measurements are linear in x */
    size_t n_goals;
    const struct imp_elements_goal *goals; /**< [n_goals] */
    size_t n;
    const struct imp_fit_variable *variables; /**< [n]; no intervals: there is no noise */
    size_t n_history;
    const double *history;
    const char *reason;
};

/* clang-format off */
/**
 * Find the problem's active variables (lights, reflectances) for which every source of
 * the elements measures its target, inside bounds: the least value of
 *
 *     1/2 sum over sources of weight ((J - target) / scale)^2
 *         + the problem's regularisers
 *
 * where scale is |target|, or 1 if that is 0, by adjoint sensitivities. With lights alone
 * it is a linear least-squares problem with bounds, solved from one adjoint solution a
 * source. The problem needs no targets of its own. Progress and time limit are those of
 * the elements' options. The scene and the elements end at the answer; the result belongs
 * to the problem and lives until its next fit.
 * More variables than targets, without a regulariser on them, is a warning: many answers
 * meet the targets.
 * @return IMP_OK; IMP_CANCELLED (the state reached is set); IMP_E_ARG, also for a
 * negative target; IMP_E_UNSUPPORTED for an active variable of which finite elements have
 * no derivative.
 */
/* clang-format on */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_fit(imp_elements *elements, imp_problem *problem,
                 const struct imp_elements_fit_options *options,
                 const struct imp_elements_fit_result **result);

struct imp_elements_guide_options {
    size_t size;
    /** Light samples, and where light walks begin, as without a guide. */
    bool no_lights;
    double share; /**< of continuations drawn towards indirect light, or importance, 0 to
                        1 exclusive */
    /** Russian roulette by expected contribution instead of throughput: a walk continues
     * with probability roulette x (radiance expected after this vertex) / (radiance
     * expected of the whole walk), clamped to [0.2, 1]. 0: off; 0.5 to 1 where most light
     * is direct, 4 where little is. */
    double roulette;
};
#define IMP_ELEMENTS_GUIDE_OPTIONS_INIT IMP_INIT_ZERO(struct imp_elements_guide_options)
/** The solution as a guide for walks: set imp_run.guide. Light samples follow what every
 * light sends to a place; drawing directions by it, or roulette, pays in some scenes only
 * (docs/elements.md) and is off by default. Light walks follow the
 * importance of the elements' sensor, unless that was not solved: which light sends them,
 * from where and whither, and `share` of their directions; roulette is for walks from the
 * sensor. The elements must outlive it; a guide
 * of an old solution stays correct, and helps less. Destroy it with imp_guide_destroy.
 * options may be NULL.
 * @return IMP_OK; IMP_E_ARG for a share or roulette outside its range, or before
 *         imp_elements_solve; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_guide(const imp_elements *elements,
                   const struct imp_elements_guide_options *options, imp_guide **out);

/** Write elements and links to a file; open it again with the same scene and options.
 * @return of opening also IMP_E_IO if the file is damaged (it has a checksum), IMP_E_SCENE if it is
 * of another scene, IMP_E_UNSUPPORTED if another version of importon wrote it. */
IMP_API IMP_MUST_CHECK enum imp_status imp_elements_save(const imp_elements *elements,
                                                         const char *path);
/** Read what imp_elements_save wrote.
 * @param[out] out the caller destroys it.
 * @return as imp_elements_create; IMP_E_IO; IMP_E_SCENE for a damaged file (it has a
 *         checksum) or another scene; IMP_E_UNSUPPORTED if another version of
 *         importon wrote it. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_open(const imp_scene *scene, const struct imp_elements_options *options,
                  const char *path, imp_elements **out);

/* ---- One element at a time, to be drawn ------------------------------------------ */

#define IMP_ELEMENTS_NO_PARENT SIZE_MAX
/** A leaf, or what leaves are parts of. World coordinates; one value a channel (mono: the
 * first of three). */
struct imp_elements_element {
    size_t size;
    const char *shape; /**< its name, of the scene; NULL: a measuring plane */
    size_t polygon;    /**< of the input; the sides of a two-sided one are two */
    size_t parent;     /**< index of an element, or IMP_ELEMENTS_NO_PARENT */
    int level;         /**< of subdivision, 0: the whole polygon */
    bool leaf;
    int source;  /**< the first source of the options that measures it; -1: none does */
    int corners; /**< 3 or 4 */
    double corner[4][3];  /**< counterclockwise, seen from the front */
    double area;          /**< of what no solid covers */
    double radiance[3];   /**< exitant, mean over the hemisphere */
    double importance;    /**< likewise, per solid angle */
    double irradiance[3]; /**< NaN: black and not measured, or covered */
    double illuminance;   /**< luminance of the irradiance */
};
#define IMP_ELEMENTS_ELEMENT_INIT IMP_INIT_ZERO(struct imp_elements_element)
/** Element `index`, below imp_elements_info.elements. Strings belong to the scene.
 * Set out->size first.
 * @return IMP_OK; IMP_E_ARG if there is no such element. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_get_element(const imp_elements *elements, size_t index,
                         struct imp_elements_element *out);

/** What one link brings. */
struct imp_elements_arrival {
    size_t size;
    size_t from; /**< index of the element that sends */
    double irradiance[3];
    double illuminance;
    double measure; /**< of the measurement: what passes here, radiance x importance */
};
/**
 * What arrives at an element, link by link, brightest first: over its own links, those of
 * all above it (their part for this element) and those of its parts. Irradiances add up
 * to the element's, but for what the last sweep of the solution moved.
 * @param[out] arrivals [*n], to be freed with imp_free.
 * @return IMP_OK; IMP_E_ARG if there is no such element; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_arrivals(const imp_elements *elements, size_t index,
                      struct imp_elements_arrival **arrivals, size_t *n);

/**
 * Illuminance at points of the polygon of an element, with the kernel and visibility of
 * each point itself instead of means over elements: the middles of width x height cells,
 * along the polygon's first edge (x) and its last (y, from the first corner).
 * @param[out] illuminance [height][width]; NaN outside a triangle.
 * @return IMP_OK; IMP_E_ARG if there is no such element, or for sizes below 1;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_elements_illuminance(const imp_elements *elements, size_t index, int width,
                         int height, double *illuminance);

/** Leaves with their mean exitant radiance and importance, by extension: .ply, .json.
 * @return IMP_OK; IMP_E_ARG for another extension; IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_elements_export(const imp_elements *elements,
                                                           const char *path);

#ifdef __cplusplus
}
#endif
#endif
