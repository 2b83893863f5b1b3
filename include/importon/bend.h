/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays that bend in a graded refractive index, and the exact adjoint of their bending
 * (Teh, O'Toole, Gkioulekas 2022). A first program, in order:
 *
 *     imp_field_grid_create   an index field: spline or trilinear grid, profiles, sums
 *     imp_bend_trace          rays through it -> exits
 *     imp_bend_adjoint        dC/d(exit) of every ray -> dC/d(field, origins, directions)
 *     imp_bend_load           or all of it from a file: field, rays, targets
 *     imp_bend_fit            a field that minimises the distance to the targets
 *
 * A ray has position x and optical momentum v, |v| = eta(x), and follows the canonical
 * equations x' = v, v' = eta grad eta. The gradient is the derivative of the program that
 * traces, step by step; memory does not grow with the number of steps. Same conventions
 * as importon.h.
 */
#ifndef IMPORTON_BEND_H
#define IMPORTON_BEND_H

#include <importon/importon.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Index fields -------------------------------------------------------------- */

typedef struct imp_field imp_field;

enum imp_field_interp {
    IMP_FIELD_SPLINE = 0, /**< cubic B-spline: twice differentiable. The default. */
    IMP_FIELD_TRILINEAR /**< fast; its adjoint is not the macroscopic derivative (docs) */
};
enum imp_field_param {
    IMP_FIELD_ETA = 0, /**< the numbers are the index */
    IMP_FIELD_ETA2     /**< the numbers are eta^2/2 */
};

struct imp_field_grid {
    size_t size;
    enum imp_field_interp interp;
    enum imp_field_param param;
    int cells[3];          /**< x, y, z */
    double lo[3], hi[3];   /**< the box the cells fill */
    bool single;           /**< trace with float samples; theta stays double */
    double gladstone_dale; /**< K: samples are densities rho, index 1 + K rho (Gladstone
                                and Dale); 0: samples are the index */
};
#define IMP_FIELD_GRID_INIT IMP_INIT_ZERO(struct imp_field_grid)

/** A grid with the same index everywhere. theta: [z][y][x] coefficients, cells + 3 along
 * an axis for splines (the first node lies one spacing before lo), cells + 1 for
 * trilinear.
 * @return IMP_OK; IMP_E_ARG for an empty box, absurd sizes or an index that is not
 * positive; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_grid_create(imp_context *context, const struct imp_field_grid *grid,
                      double index, imp_field **out);

/** Profiles by name: "constant", "luneburg", "maxwell", "rod" (n^2 parabolic),
 * "rod-vendor", "rod-power", "sech", "plume", "polynomial", "axial", "linear". Parameters
 * in the order of imp_field_param_name, imp_field_profile_count of
 * them. axis: unit vector of kinds that have one; NULL: z.
 * params [imp_field_profile_count(kind)], axis [3]; both are copied.
 * @return IMP_OK; IMP_E_ARG for an unknown kind or parameters without an index;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_profile_create(imp_context *context, const char *kind, const double *params,
                         const double *axis, imp_field **out);
/** Number of parameters of a profile kind, 0 if there is no such kind. */
IMP_API size_t imp_field_profile_count(const char *kind);

struct imp_field_radial {
    size_t size;
    bool cylinder; /**< 1: r is the distance from an axis; 0: from the centre */
    double centre[3], axis[3];
    double radius; /**< of the last cell; beyond it the outermost polynomial goes on */
    int cells;     /**< of the cubic spline in r^2: cells + 3 coefficients */
};
#define IMP_FIELD_RADIAL_INIT                                                            \
    IMP_INIT(struct imp_field_radial, .axis[2] = 1, .radius = 1, .cells = 16)
/** The same index everywhere, symmetric about a point or an axis: a cubic spline in
 * r^2. theta: [cells + 3].
 * @return IMP_OK; IMP_E_ARG for sizes or an index that are not positive; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_radial_create(imp_context *context, const struct imp_field_radial *radial,
                        double index, imp_field **out);

struct imp_field_rz {
    size_t size;
    double centre[3], axis[3];
    double radius;        /**< of the last cell across the axis */
    double lo, hi;        /**< along the axis, from the centre */
    int cells_r, cells_z; /**< of the cubic spline in r^2 and along the axis */
};
#define IMP_FIELD_RZ_INIT                                                                \
    IMP_INIT(struct imp_field_rz, .axis[2] = 1, .radius = 1, .lo = -1, .hi = 1,          \
             .cells_r = 8, .cells_z = 16)
/** Symmetric about an axis: a tensor cubic spline in r^2 and z. theta:
 * [cells_z + 3][cells_r + 3].
 * @return as imp_field_radial_create. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_rz_create(imp_context *context,
                                                           const struct imp_field_rz *rz,
                                                           double index, imp_field **out);
/** Set rz->size first.
 * @return IMP_OK; IMP_E_ARG if the field is another kind. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_get_rz(const imp_field *field,
                                                        struct imp_field_rz *rz);

#define IMP_FIELD_AXIAL (-1)
struct imp_field_symmetry {
    size_t size;
    bool mirror[3]; /**< across the middle planes of x, y, z */
    int axis;       /**< 0, 1, 2: of turns about the middle */
    int fold;       /**< turns: 2 halves, 4 quarters, IMP_FIELD_AXIAL: nodes at one
                        distance from the axis are one number; 0: none */
};
#define IMP_FIELD_SYMMETRY_INIT IMP_INIT(struct imp_field_symmetry, .axis = 2)
/** A grid that keeps a symmetry: nodes that are taken into each other have one number.
 * Takes the grid over, also on failure; its coefficients become their means. Quarter and
 * all turns need as many cells of one size in both directions. Refining keeps
 * the function for mirrors, halves and quarters, and nearly so for all turns.
 * @return IMP_OK; IMP_E_ARG: not a grid, not square; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_tie_create(imp_context *context, imp_field *grid,
                     const struct imp_field_symmetry *symmetry, imp_field **out);

/** 1 + k (eta - 1): a field at another wavelength. Takes the field over, also on failure;
 * theta is the field's.
 * @return IMP_OK; IMP_E_ARG for a k that is not finite; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_scaled_create(imp_context *context,
                                                               imp_field *field, double k,
                                                               imp_field **out);

/** eta = sum of the parts. Takes them over, also on failure; theta is theirs, one after
 * the other.
 * parts [n].
 * @return IMP_OK; IMP_E_ARG for n = 0; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_sum_create(imp_context *context, size_t n, imp_field **parts, imp_field **out);

/** Read .vol (Mitsuba's grid volume), .npy (3-D, [z][y][x], float32 or float64) or a
 * profile as text (docs/bend.md). Volumes hold samples at the cell corners; `grid`
 * gives the box of a .npy and the interpolation of both (its `cells` are ignored); NULL:
 * the defaults.
 * @return IMP_OK; IMP_E_IO; IMP_E_SCENE for a damaged file; IMP_E_ARG for a grid
 *         without a box; IMP_E_UNSUPPORTED; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_read(imp_context *context,
                                                      const char *path,
                                                      const struct imp_field_grid *grid,
                                                      imp_field **out);
/** Write samples at cell corners (.vol, .npy), or a radial or rz profile (any other
 * name).
 * @return IMP_E_ARG for other fields; IMP_E_UNSUPPORTED for profiles that could not be
 *         read again: numbers beyond 1e12, a radius or height below 1e-12
 *         (docs/bend.md). */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_write(const imp_field *field,
                                                       const char *path);

/** field may be NULL. Surfaces must not use it any more. */
IMP_API void imp_field_destroy(imp_field *field);

/** "spline", "trilinear", "radial", "rz", "tied grid", "scaled", "sum", or the profile's
 * name. */
IMP_API const char *imp_field_kind(const imp_field *field);
/** Length of theta. 0 for NULL. */
IMP_API size_t imp_field_n_theta(const imp_field *field);
/** theta [imp_field_n_theta].
 * @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_field_get_theta(const imp_field *field, double *theta);
/** @return IMP_OK; IMP_E_ARG if a value is not finite: nothing is set.
 * theta [imp_field_n_theta] is copied. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_set_theta(imp_field *field,
                                                           const double *theta);
/** Name of number i, NULL for grids. */
IMP_API const char *imp_field_param_name(const imp_field *field, size_t i);
/** The box where the field is defined; infinite for profiles.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_field_get_bounds(const imp_field *field, double lo[3],
                                             double hi[3]);
/** The grid (of a tied one, too), or IMP_E_ARG if it is not one. Set grid->size first.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_get_grid(const imp_field *field,
                                                          struct imp_field_grid *grid);

/** Index, gradient [3], Hessian [6] = xx yy zz xy xz yz. gradient and hessian may be
 * NULL. As functions of a point, this and the next two take any number and give what
 * comes of it.
 * eta [1], gradient [3], hessian [6]. */
IMP_API void imp_field_eval(const imp_field *field, const double x[3], double *eta,
                            double *gradient, double *hessian);
/** The transpose: theta_bar += a d eta/d theta + b . d grad eta/d theta.
 * theta_bar [imp_field_n_theta] is added to. */
IMP_API void imp_field_splat(const imp_field *field, const double x[3], double a,
                             const double b[3], double *theta_bar);
/** The derivative along theta_dot.
 * theta_dot [imp_field_n_theta]; eta_dot [1]. */
IMP_API void imp_field_tangent(const imp_field *field, const double x[3],
                               const double *theta_dot, double *eta_dot,
                               double gradient_dot[3]);

/** Samples of the index (or of density, see imp_field_grid) at the corners of cells,
 * [z][y][x], cells + 1 along an axis. A spline passes through them.
 * samples [z][y][x].
 * @return IMP_OK; IMP_E_ARG if the field is no grid, or an index is not positive;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_set_samples(imp_field *field,
                                                             const double *samples);
/** Transpose of imp_field_set_samples, for param eta: samples_bar = (d theta/d samples)^T
 * theta_bar.
 * theta_bar [imp_field_n_theta]; samples_bar [z][y][x] is overwritten.
 * @return IMP_OK; IMP_E_ARG if the field is no grid; IMP_E_UNSUPPORTED for grids of
 *         eta^2/2; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_samples_vjp(const imp_field *field,
                                                             const double *theta_bar,
                                                             double *samples_bar);
/** The same function on twice as many cells along each axis; its transpose takes
 * fine_bar [imp_field_n_theta(fine)] to coarse_bar.
 * @param[out] out the caller destroys it.
 * @return IMP_OK; IMP_E_ARG if the field is no grid; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_refine(const imp_field *field,
                                                        imp_field **out);
/** fine_bar [imp_field_n_theta(fine)], coarse_bar [imp_field_n_theta(field)], which is
 * overwritten.
 * @return as imp_field_refine. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_refine_vjp(const imp_field *field, const double *fine_bar, double *coarse_bar);

/* ---- Rays ---------------------------------------------------------------------- */

enum imp_bend_scheme {
    IMP_BEND_LEAPFROG = 0, /**< drift-kick-drift (Stoermer-Verlet): order 2 */
    IMP_BEND_EULER,        /**< symplectic Euler: order 1 */
    IMP_BEND_VERLET,       /**< kick-drift-kick: order 2 */
    IMP_BEND_YOSHIDA4,     /**< three leapfrogs: order 4 */
    IMP_BEND_ARC,          /**< leapfrog in arc length, dx/ds = v/|v|, reversible */
    IMP_BEND_ARC_INDEX     /**< supplement (23): dx/ds = v/eta, cannot be reversed */
};
#define IMP_BEND_N_SCHEMES 6

/** How the adjoint recomputes the ray's states. */
enum imp_bend_way {
    IMP_BEND_REVERSE = 0, /**< reverses the steps from the exit: nothing is stored */
    IMP_BEND_STORED,      /**< trace again into a buffer of one ray: 48 B a step */
    IMP_BEND_PSEUDO       /**< approximate reversal of IMP_BEND_ARC_INDEX: biased; for
                             comparisons */
};

enum imp_bend_surface_type {
    IMP_BEND_PLANE = 0, /**< n.x = offset; crossed along n */
    IMP_BEND_SPHERE,    /**< |x - centre| = radius, from inside */
    IMP_BEND_CYLINDER,  /**< distance from an axis (centre, normal) = radius, from inside
                         */
    IMP_BEND_DISC,      /**< plane through centre within radius of it */
    IMP_BEND_BOX,       /**< lo .. hi, from inside */
    IMP_BEND_SDF,       /**< field = 0, from negative to positive */
    IMP_BEND_APPROACH,  /**< first closest approach to centre */
    IMP_BEND_MESH       /**< the shapes of `scene`, from inside; facets are planes */
};

/** Effect of a surface on a ray. */
enum imp_bend_event {
    IMP_BEND_END = 0, /**< the ray ends; momentum as it is (index-matched) */
    IMP_BEND_REFRACT, /**< the ray ends refracted into `index`; total reflection goes on
                       */
    IMP_BEND_MIRROR,  /**< reflected, goes on */
    IMP_BEND_STOP     /**< the ray is lost: counted as missed */
};

struct imp_bend_surface {
    size_t size;
    enum imp_bend_surface_type type;
    enum imp_bend_event event;
    int group;        /**< rays of this group only; -1: all */
    double normal[3]; /**< of planes and discs; axis of a cylinder. Normalised. */
    double offset;    /**< of a plane */
    double centre[3];
    double radius;
    double lo[3], hi[3];  /**< of a box */
    double index;         /**< outside, for IMP_BEND_REFRACT */
    const imp_field *sdf; /**< its value is the distance; shared, not copied */
    const imp_scene
        *scene; /**< of a mesh: committed, its shapes are closed; shared, not copied */
};
#define IMP_BEND_SURFACE_INIT                                                            \
    IMP_INIT(struct imp_bend_surface, .group = -1, .normal[2] = 1, .radius = 1,          \
             .index = 1)

/** A plane whose crossing is recorded and does not end the ray. */
struct imp_bend_tap {
    size_t size;
    double normal[3], offset;
    int group; /**< as of a surface */
};
#define IMP_BEND_TAP_INIT IMP_INIT(struct imp_bend_tap, .normal[2] = 1, .group = -1)

struct imp_bend_options {
    size_t size;
    enum imp_bend_scheme scheme;
    enum imp_bend_way way;
    double step;        /**< in sigma, or in length for arc-length schemes; 0: half a cell
                             (trilinear) or one cell (spline) over the greatest index */
    uint32_t max_steps; /**< a ray that needs more is dropped and counted; 0: 100000 */
    bool outside;       /**< rays start outside the surfaces, in a medium of index
                             `outside_index`: they go straight to the first and enter */
    double outside_index; /**< 0: 1 */
    double grazing;       /**< |cos| at the exit below which a ray is dropped; 0: 0.05;
                               negative: none */
    double reversal;      /**< reversed start off by more than this (relative) is counted;
                               0: 1e-10 */
    size_t n_surfaces;    /**< 0: the field's own box, momentum as it is */
    const struct imp_bend_surface *surfaces;
    size_t n_taps; /**< at most 16 */
    const struct imp_bend_tap *taps;
    imp_progress_fn progress;
    void *progress_payload;
};
#define IMP_BEND_OPTIONS_INIT IMP_INIT_ZERO(struct imp_bend_options)

enum imp_bend_flags { /* flags of an exit; rays with one of DROPPED have no derivative */
                      IMP_BEND_TRUNCATED = 1, /**< more than max_steps */
                      IMP_BEND_MISSED =
                          2, /**< left the field, or met IMP_BEND_STOP, or no surface */
                      IMP_BEND_STARTED_OUT =
                          4, /**< the start is not inside the surfaces */
                      IMP_BEND_GRAZING =
                          8, /**< exit too close to the surface's tangent */
                      IMP_BEND_BROKEN =
                          16, /**< not finite, or |v|^2 off eta^2 by more than 10 % */
                      IMP_BEND_DROPPED = 31,
                      IMP_BEND_ENERGY = 32, /**< |v|^2 off eta^2 by more than 1 %: kept */
                      IMP_BEND_REFLECTED =
                          64, /**< totally reflected or mirrored on the way: kept */
                      IMP_BEND_TAP_MISSED =
                          128 /**< of a tap's record: plane not crossed */
};

/** End of a ray, or its crossing of a tap: all that is stored between tracing and
 * adjoint.
 */
struct imp_bend_exit {
    double x[3], v[3]; /**< position; momentum (after refraction) */
    double path;       /**< optical path length, int eta ds */
    double tau;        /**< length of the last, fractional step */
    double norm2;      /**< |v|^2 before refraction */
    uint32_t steps;    /**< whole steps before it */
    uint16_t surface;  /**< index in options.surfaces */
    uint8_t flags;     /**< enum imp_bend_flags */
    uint8_t segments;  /**< reflections + 1 */
};

struct imp_bend_stats {
    size_t size;
    uint64_t rays, traced, steps;
    uint64_t truncated, missed, started_out, grazing, broken, energy, reflected,
        taps_missed;
    uint64_t reversal;     /**< of an adjoint: rays not reversed to their start */
    double worst_energy;   /**< max | |v|^2 - eta^2 | / eta^2 at exits */
    double worst_reversal; /**< max |x - x0| / size */
};
#define IMP_BEND_STATS_INIT IMP_INIT_ZERO(struct imp_bend_stats)

/** Rays: arrays of n. group may be NULL (all 0). Directions need not be unit. */
struct imp_bend_rays {
    size_t size;
    size_t n;
    const double (*x)[3], (*d)[3];
    const uint16_t *group;
};
#define IMP_BEND_RAYS_INIT IMP_INIT_ZERO(struct imp_bend_rays)

/**
 * Trace. Same bits for any number of threads.
 *
 * @param[out] exits [n]
 * @param[out] taps  [n][n_taps]; may be NULL if there are no taps
 * @param[out] stats may be NULL
 * @return IMP_OK, also when rays were lost: look at stats. IMP_E_ARG; IMP_E_NOMEM;
 *         IMP_CANCELLED.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_trace(const imp_field *field, const struct imp_bend_options *options,
               const struct imp_bend_rays *rays, struct imp_bend_exit *exits,
               struct imp_bend_exit *taps, struct imp_bend_stats *stats);

/** The cotangent of an exit: dC/dx, dC/dv, dC/dpath with x, v, path taken as independent.
 */
struct imp_bend_cotangent {
    double x[3], v[3], path;
};

/** Gradients of an adjoint. Arrays may be NULL: not wanted; all are overwritten. */
struct imp_bend_gradient {
    size_t size;
    double *theta;           /**< [n_theta] */
    double (*x)[3], (*d)[3]; /**< [n] origins; directions as given: a ray depends on d/|d|
                                  alone, so this is across d and falls as 1/|d| */
    double (*surfaces)[8];   /**< [n_surfaces]: 0-2 normal (plane) or centre, 3 offset or
                                  radius, 4 index outside; not for box, SDF and mesh */
    double *energy;          /**< [n] K = lam.v + mu.F at the start: 0 up to truncation */
};
#define IMP_BEND_GRADIENT_INIT IMP_INIT_ZERO(struct imp_bend_gradient)

/** The exact derivative of imp_bend_trace with the same arguments. Dropped rays give
 * nothing. exits, taps as traced; bars [n], tap_bars [n][n_taps] (NULL: zero).
 * @return as imp_bend_trace; IMP_E_BIAS for IMP_BEND_ARC_INDEX with IMP_BEND_REVERSE. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_adjoint(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const struct imp_bend_exit *exits,
                 const struct imp_bend_exit *taps, const struct imp_bend_cotangent *bars,
                 const struct imp_bend_cotangent *tap_bars, struct imp_bend_gradient *out,
                 struct imp_bend_stats *stats);

/** Forward derivative along (theta_dot, x_dot, d_dot), each may be NULL: dots [n],
 * tap_dots [n][n_taps] in the same layout as cotangents.
 * theta_dot [n_theta], x_dot and d_dot [n].
 * @return as imp_bend_trace. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_tangent(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const double *theta_dot,
                 const double (*x_dot)[3], const double (*d_dot)[3],
                 struct imp_bend_cotangent *dots, struct imp_bend_cotangent *tap_dots);

/** One ray as points (x, y, z, path), for drawing: the caller frees *points with
 * imp_free.
 * @return IMP_OK; IMP_E_ARG if there is no such ray; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_path(const imp_field *field, const struct imp_bend_options *options,
              const struct imp_bend_rays *rays, size_t ray, double (**points)[4],
              size_t *n_points, struct imp_bend_exit *exit);

/* ---- Problems: a field, rays, targets ------------------------------------------ */

typedef struct imp_bend imp_bend;

/** Takes the field over, also on failure. The theta of the field is what a fit changes.
 * @return IMP_OK; IMP_E_ARG; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_create(imp_context *context,
                                                       imp_field *field, imp_bend **out);
/** bend may be NULL. Its field ends with it. */
IMP_API void imp_bend_destroy(imp_bend *bend);
/** The field: lives until the bend is destroyed or a fit refines it. */
IMP_API imp_field *imp_bend_field(imp_bend *bend);

/** Scheme, step, ... of all rays; surfaces and taps are copied. `step` 0 follows the
 * grid: min(step_max, step_cells * cell), see imp_bend_set_step.
 * @return IMP_OK; IMP_E_ARG for a number out of its range; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_set_options(imp_bend *bend, const struct imp_bend_options *o);
/** Called while the rays of imp_bend_objective, _run, _check, _step_error, _arrivals and
 * _image are traced: nonzero stops them with IMP_CANCELLED. NULL: none. The same as
 * `progress` of the options. A fit calls its own instead. */
IMP_API void imp_bend_set_progress(imp_bend *bend, imp_progress_fn progress,
                                   void *payload);
/** The step when options.step is 0: cells * spacing, at most `most` (0: no limit).
 * @return IMP_OK; IMP_E_ARG if one is not a number >= 0. */
IMP_API enum imp_status imp_bend_set_step(imp_bend *bend, double cells, double most);

/** A bundle: rays that share surfaces, taps and targets by its number (their group).
 * x, d [n]; power [n] or NULL (1/n each). *bundle may be NULL.
 * All are copied; bundle [1].
 * @return IMP_OK; IMP_E_ARG for a number that is not finite, or a direction of length
 *         0; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_add_rays(imp_bend *bend, size_t n, const double (*x)[3], const double (*d)[3],
                  const double *power, int *bundle);
/** Rays of all bundles. 0 for NULL. */
IMP_API size_t imp_bend_n_rays(const imp_bend *bend);
/** 0 for NULL. */
IMP_API int imp_bend_n_bundles(const imp_bend *bend);

enum imp_dispersion_model {
    IMP_CAUCHY = 0, /**< n = c0 + c1/l^2 + c2/l^4 */
    IMP_SELLMEIER   /**< n^2 = 1 + sum_k c_k l^2/(l^2 - c_{3+k}), k = 0, 1, 2 */
};
/** The index of a material; wavelengths l in micrometres. */
struct imp_dispersion {
    size_t size;
    enum imp_dispersion_model model;
    double coefficient[6];
    double reference; /**< wavelength at which the field is the index */
};
#define IMP_DISPERSION_INIT IMP_INIT(struct imp_dispersion, .reference = 0.5875618)
/** The formula. */
IMP_API double imp_dispersion_index(const struct imp_dispersion *d, double um);
/** Rays of a bundle have this wavelength: they see the index 1 + k (eta - 1), with
 * k = (n(um) - 1)/(n(reference) - 1). @return IMP_E_ARG if k is not positive. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_set_wavelength(imp_bend *bend, int bundle, const struct imp_dispersion *d,
                        double um);

/** The wavelength in micrometres of a bundle, 0 if it was given none: its rays see the
 * index as it is. */
IMP_API double imp_bend_wavelength(const imp_bend *bend, int bundle);

enum imp_bend_target_type {
    IMP_BEND_FOCUS = 0,  /**< mean |x - point|^2/2 */
    IMP_BEND_SPOT,       /**< mean |x - centroid|^2/2 */
    IMP_BEND_POINTS,     /**< mean |x - data_i|^2/2, data [n][3] */
    IMP_BEND_DIRECTION,  /**< mean |d - point|^2/2 */
    IMP_BEND_DIRECTIONS, /**< mean |d - data_i|^2/2, data [n][3] */
    IMP_BEND_DEFLECTION, /**< mean |P(v - v0) - data_i|^2/2, P across the first direction
                          */
    IMP_BEND_PATH,       /**< mean (S - data_i)^2/2, data [n] */
    IMP_BEND_WAVEFRONT,  /**< variance of S / 2 */
    IMP_BEND_IMAGE,      /**< mean over pixels (E/mean - T/mean)^2/2 of the irradiance */
    IMP_BEND_FARFIELD,   /**< the same of directions: u and v span direction cosines */
    IMP_BEND_SHAPE       /**< mean G(x)^2/2, G the distance to `sdf` */
};
#define IMP_BEND_N_TARGETS 11

struct imp_bend_target {
    size_t size;
    enum imp_bend_target_type type;
    int bundle;    /**< -1: all rays */
    int tap;       /**< -1: where rays exit; else the tap they cross */
    double weight; /**< 0: 1 */
    bool at_plane; /**< go on straight, in index `outside`, to normal.x = offset */
    double normal[3], offset, outside;
    double point[3];
    const double *data;   /**< copied */
    const imp_field *sdf; /**< shared */
    /** Picture: pixel (0, 0) has its corner at origin, u runs along a row, v down a
     * column; both as long as the whole picture (of unit length in a far field: direction
     * cosines origin + a u + b v). pixels [height][width], copied. */
    int width, height;
    double origin[3], u[3], v[3];
    const float *pixels;
};
#define IMP_BEND_TARGET_INIT                                                             \
    IMP_INIT(struct imp_bend_target, .bundle = -1, .tap = -1, .normal[2] = 1,            \
             .outside = 1)
/** A plane's normal is turned towards the rays' first directions. Rays that meet it
 * at a slant (cosine) below 0.05, or go backwards, do not count; between 0.05 and 0.15
 * they count less and less: a smooth weight, differentiated.
 * @return IMP_OK; IMP_E_ARG for a bundle, tap or data that do not exist; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_add_target(imp_bend *bend, const struct imp_bend_target *t);

/** weight/2 sum of squared differences of grid coefficients along each axis, of order 1
 * or 2; edge > 0: sum sqrt(D^2 + edge^2) instead.
 * @return IMP_OK; IMP_E_ARG for another field or order, or a negative weight;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_add_smoothness(imp_bend *bend, double weight, int order, double edge);
/** Bounds of every value of the field; default for grids of the index: 1 .. infinity.
 * @return IMP_OK; IMP_E_ARG if not lo < hi. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_set_bounds(imp_bend *bend, double lo,
                                                           double hi);
/** Hold values, which a fit then does not change at any level: grid coefficients in the
 * `layers` outermost layers, those whose node is outside a sphere, or one number; each is
 * set to `value` (NaN: unchanged).
 * @return IMP_OK; IMP_E_ARG for another field; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_hold_rim(imp_bend *bend, int layers,
                                                         double value);
/** The same of the nodes outside a sphere.
 * @return as imp_bend_hold_rim. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_hold_outside(imp_bend *bend,
                                                             const double centre[3],
                                                             double radius, double value);
/** The same of value i of theta.
 * @return IMP_OK; IMP_E_ARG if there is none; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_hold_number(imp_bend *bend, size_t i,
                                                            double value);

/** Objective and its gradient with respect to all values of the field (held ones: 0).
 * The rays are fixed, so both are exact: no standard error belongs to them. gradient
 * [n_theta], stats may be NULL. targets [n targets]: their parts; may be NULL.
 * @return IMP_OK, also if a part of the rays is lost (look at stats); IMP_E_NUMERIC if no
 * ray comes to its end (stats is set); IMP_E_ARG; IMP_E_NOMEM; IMP_CANCELLED.
 * value [1], may be NULL. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_objective(imp_bend *bend, double *value,
                                                          double *gradient,
                                                          double *targets,
                                                          struct imp_bend_stats *stats);
/** Exits of all rays with the field as it is; taps [n][n_taps] may be NULL.
 * exits [imp_bend_n_rays].
 * @return as imp_bend_trace. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_run(imp_bend *bend,
                                                    struct imp_bend_exit *exits,
                                                    struct imp_bend_exit *taps,
                                                    struct imp_bend_stats *stats);
/** imp_bend_path of one ray of the problem.
 * @return as imp_bend_path. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_ray(imp_bend *bend, size_t ray, double (**points)[4], size_t *n_points);
/** Position, direction and path of a ray at a target's plane, and its share of the
 * target's power. */
struct imp_bend_arrival {
    double x[3], d[3], path, weight;
    uint32_t ray;
};
/** arrivals [imp_bend_n_rays]; *n is set.
 * @return IMP_OK; IMP_E_ARG if there is no such target; IMP_E_NOMEM; IMP_CANCELLED. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_arrivals(imp_bend *bend, size_t target, struct imp_bend_arrival *arrivals,
                  size_t *n);
/** Irradiance that an image target sees, [height][width], mean 1 when all power arrives.
 * pixels [height][width] of the target.
 * @return IMP_OK; IMP_E_ARG if it is no image; IMP_E_NOMEM; IMP_CANCELLED. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_image(imp_bend *bend, size_t target,
                                                      float *pixels);
/** 0 for NULL. */
IMP_API size_t imp_bend_n_targets(const imp_bend *bend);
/** Target i as it was added; arrays belong to the bend. Set target->size first.
 * @return IMP_OK; IMP_E_ARG if there is none. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_get_target(const imp_bend *bend, size_t i, struct imp_bend_target *target);
/** All rays, with their bundles as groups; arrays belong to the bend. Set rays->size
 * first.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API enum imp_status imp_bend_get_rays(const imp_bend *bend,
                                          struct imp_bend_rays *rays);
/** The options in use, with the step that rays take.
 * Set o->size first; arrays belong to the bend.
 * @return IMP_OK; IMP_E_ARG if no step can be chosen. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_get_options(const imp_bend *bend,
                                                            struct imp_bend_options *o);

/** A fit between two iterations. */
struct imp_bend_fit_step {
    size_t size;
    int level, levels; /**< the first level is 0 */
    int iteration;     /**< completed ones of this level */
    double value;      /**< objective, the last of its history */
};
/** Called after each iteration from the thread that called imp_bend_fit; the field is the
 * best so far, and may be traced and drawn, not changed. Non-zero stops the fit. */
typedef int (*imp_bend_fit_step_fn)(const struct imp_bend_fit_step *step, void *payload);

#define IMP_BEND_LEVELS_MAX 8
/** Does the optimiser's memory of one level serve the next? L-BFGS has its pairs, Adam
 * its moments, MMA none. */
enum imp_bend_carry {
    IMP_BEND_CARRY_AUTO = 0, /**< of L-BFGS alone */
    IMP_BEND_CARRY_ON = 1,
    IMP_BEND_CARRY_OFF = -1
};
struct imp_bend_fit_options {
    size_t size;
    enum imp_optimizer optimizer;        /**< IMP_LBFGS, IMP_ADAM, IMP_MMA */
    int levels;                          /**< grids: refined levels - 1 times; 0: 1 */
    int iterations[IMP_BEND_LEVELS_MAX]; /**< 0: as the level before; first 0: 50 */
    double learning_rate;   /**< Adam: of `scale`; halved at each level; 0: 0.05 */
    double tolerance;       /**< of `scale`; 0: 1e-6 */
    double scale;           /**< a large change of a number; 0: 0.1 */
    const char *checkpoint; /**< rewritten at every level and every few seconds */
    bool resume;
    imp_progress_fn progress;
    void *progress_payload;
    enum imp_bend_carry carry;
    imp_bend_fit_step_fn step; /**< NULL: not called */
    void *step_payload;
    /** L-BFGS on grids: a length of the scene, over which the field's changes are smooth as
     * long as the rays allow it: steps are steepest in the metric (I - l^2 Laplace)^-1 (the
     * Sobolev gradient; Neuberger 1997). 0: every coefficient for itself. */
    double smooth_length;
};
#define IMP_BEND_FIT_OPTIONS_INIT                                                        \
    IMP_INIT(struct imp_bend_fit_options, .optimizer = IMP_LBFGS)

struct imp_bend_fit_result {
    size_t size;
    int iterations, levels; /**< done */
    double start, value;    /**< objective before (first level) and after (last) */
    size_t n_history;
    const double *history; /**< [n_history] objective of every evaluation */
    const char *reason;
    struct imp_bend_stats stats; /**< of the final field */
};
/** The result's arrays belong to the bend and live until its next fit.
 * @return IMP_OK; IMP_CANCELLED (the best field so far is set); IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_fit(imp_bend *bend, const struct imp_bend_fit_options *options,
             struct imp_bend_fit_result *result);

/**
 * Check a problem at its present field: splat against tangent ("transpose"), reverse
 * against forward ("dot"), the gradient against central differences of steps 1e-2 to 1e-8
 * ("difference"), reversal, energy, the error of the step by halving it ("step": value is
 * the order seen, error the rms error of exits), and how many rays come to their end
 * ("rays": value of reference, error the part that is lost). Rows belong to the bend
 * until its next check.
 * @return IMP_OK also when rows fail: look at `ok`; IMP_E_NUMERIC if no ray comes to its
 * end: nothing was checked.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_check(imp_bend *bend, const struct imp_check_row **rows, size_t *n_rows);
/** Error of exits by the step, from about `pilots` rays traced with t, t/2, t/4: rms over
 * rays, and the order seen (0: not to be seen). Outputs may be NULL.
 * @return IMP_E_NUMERIC if no ray comes to its end with all three steps.
 * error [1], order [1]. */
IMP_API IMP_MUST_CHECK enum imp_status imp_bend_step_error(imp_bend *bend, size_t pilots,
                                                           double *error, double *order);

/** A bend from a file: <scene> with a <medium type="graded">, <rays> and <target>s
 * (docs/bend.md). options may be NULL.
 * @param[out] out the caller destroys it.
 * @return as imp_scene_load. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_load(imp_context *context, const char *path,
              const struct imp_load_options *options, imp_bend **out);
/** The same from memory: xml [length]; name (may be NULL) is the file of messages.
 * @return as imp_bend_load. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_load_string(imp_context *context, const char *xml, size_t length,
                     const char *name, const struct imp_load_options *options,
                     imp_bend **out);

#ifdef __cplusplus
}
#endif
#endif
