/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays that bend in a graded refractive index, and the exact adjoint of their bending (Teh,
 * O'Toole, Gkioulekas 2022). A first program, in order:
 *
 *     imp_field_grid_create   an index field: spline or trilinear grid, profiles, sums
 *     imp_bend_trace          rays through it -> exits
 *     imp_bend_adjoint        dC/d(exit) of every ray -> dC/d(field, origins, directions)
 *     imp_bend_load           or all of it from a file: field, rays, targets
 *     imp_bend_fit            a field that does what the targets ask
 *
 * A ray has position x and optical momentum v, |v| = eta(x), and follows the canonical
 * equations x' = v, v' = eta grad eta. The gradient is the derivative of the program that
 * traces, step by step; memory does not grow with the number of steps. Same conventions as
 * importon.h.
 */
#ifndef IMPORTON_BEND_H
#define IMPORTON_BEND_H

#include <importon/importon.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Index fields ------------------------------------------------------------------ */

typedef struct imp_field imp_field;

enum imp_field_interp {
    IMP_FIELD_SPLINE = 0, /**< cubic B-spline: twice differentiable. The default. */
    IMP_FIELD_TRILINEAR   /**< fast; its adjoint is not the macroscopic derivative (docs) */
};
enum imp_field_param {
    IMP_FIELD_ETA = 0,    /**< the numbers are the index */
    IMP_FIELD_ETA2        /**< the numbers are eta^2/2 */
};

struct imp_field_grid {
    size_t size;
    enum imp_field_interp interp;
    enum imp_field_param param;
    int cells[3];              /**< x, y, z */
    double lo[3], hi[3];       /**< the box the cells fill */
    int single;                /**< trace with float samples; theta stays double */
};
#define IMP_FIELD_GRID_INIT                                                                \
    {sizeof(struct imp_field_grid), IMP_FIELD_SPLINE, IMP_FIELD_ETA, {0}, {0}, {0}, 0}

/** A grid with the same index everywhere. theta: [z][y][x] coefficients, cells + 3 along an
 * axis for splines (the first node lies one spacing before lo), cells + 1 for trilinear.
 * @return IMP_OK; IMP_E_ARG for an empty box, absurd sizes or an index that is not positive;
 *         IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_grid_create(imp_context *context,
                                                             const struct imp_field_grid *grid,
                                                             double index, imp_field **out);

/** Profiles by name: "constant", "luneburg", "maxwell", "rod" (n^2 parabolic), "rod-vendor",
 * "rod-power", "sech", "plume", "polynomial", "axial", "linear". Parameters in the order that
 * imp_field_param_name tells; imp_field_profile_count says how many there are.
 * axis: unit vector of kinds that have one; NULL: z. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_profile_create(imp_context *context,
                                                                const char *kind,
                                                                const double *params,
                                                                const double *axis,
                                                                imp_field **out);
/** Number of parameters of a profile kind, 0 if there is no such kind. */
IMP_API size_t imp_field_profile_count(const char *kind);

struct imp_field_radial {
    size_t size;
    int cylinder;         /**< 1: r is the distance from an axis; 0: from the centre */
    double centre[3], axis[3];
    double radius;        /**< of the last cell; beyond it the outermost polynomial goes on */
    int cells;            /**< of the cubic spline in r^2: cells + 3 coefficients */
};
#define IMP_FIELD_RADIAL_INIT {sizeof(struct imp_field_radial), 0, {0}, {0, 0, 1}, 1, 16}
IMP_API IMP_MUST_CHECK enum imp_status
imp_field_radial_create(imp_context *context, const struct imp_field_radial *radial,
                        double index, imp_field **out);

/** eta = sum of the parts. Takes them over, also on failure; theta is theirs, one after the
 * other. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_sum_create(imp_context *context, size_t n,
                                                            imp_field **parts,
                                                            imp_field **out);

/** Read .vol (Mitsuba's grid volume), .npy (3-D, [z][y][x], float32 or float64) or a profile as
 * text (docs/curved-rays.md). Volumes hold samples at the cell corners; `grid` gives the box of
 * a .npy and the interpolation of both (its `cells` are ignored); NULL: the defaults. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_read(imp_context *context, const char *path,
                                                      const struct imp_field_grid *grid,
                                                      imp_field **out);
/** Write samples at cell corners (.vol, .npy), or a radial profile (.txt). */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_write(const imp_field *field,
                                                       const char *path);

IMP_API void imp_field_destroy(imp_field *field);

/** "spline", "trilinear", "radial", "sum", or the profile's name. */
IMP_API const char *imp_field_kind(const imp_field *field);
IMP_API size_t imp_field_n_theta(const imp_field *field);
IMP_API void imp_field_get_theta(const imp_field *field, double *theta);
/** @return IMP_OK; IMP_E_ARG if a number is not finite: nothing is set. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_set_theta(imp_field *field,
                                                           const double *theta);
/** Name of number i, NULL for grids. */
IMP_API const char *imp_field_param_name(const imp_field *field, size_t i);
/** The box where the field is defined; infinite for profiles. */
IMP_API void imp_field_bounds(const imp_field *field, double lo[3], double hi[3]);
/** The grid, or IMP_E_ARG if it is not one. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_get_grid(const imp_field *field,
                                                          struct imp_field_grid *grid);

/** Index, gradient [3], Hessian [6] = xx yy zz xy xz yz. gradient and hessian may be NULL. */
IMP_API void imp_field_eval(const imp_field *field, const double x[3], double *eta,
                            double *gradient, double *hessian);
/** The transpose: theta_bar += a d eta/d theta + b . d grad eta/d theta. */
IMP_API void imp_field_splat(const imp_field *field, const double x[3], double a,
                             const double b[3], double *theta_bar);
/** The derivative along theta_dot. */
IMP_API void imp_field_tangent(const imp_field *field, const double x[3],
                               const double *theta_dot, double *eta_dot,
                               double gradient_dot[3]);

/** Samples of the index at the corners of cells, [z][y][x], cells + 1 along an axis. A spline
 * passes through them. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_set_samples(imp_field *field,
                                                             const double *samples);
/** Transpose of imp_field_set_samples, for param eta: samples_bar = (d theta/d samples)^T
 * theta_bar. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_samples_vjp(const imp_field *field,
                                                             const double *theta_bar,
                                                             double *samples_bar);
/** The same function on twice as many cells along each axis; its transpose takes
 * fine_bar [imp_field_n_theta(fine)] to coarse_bar. */
IMP_API IMP_MUST_CHECK enum imp_status imp_field_refine(const imp_field *field,
                                                        imp_field **out);
IMP_API IMP_MUST_CHECK enum imp_status imp_field_refine_vjp(const imp_field *field,
                                                            const double *fine_bar,
                                                            double *coarse_bar);

/* ---- Rays --------------------------------------------------------------------------- */

enum imp_bend_scheme {
    IMP_BEND_LEAPFROG = 0, /**< drift-kick-drift (Stoermer-Verlet): order 2 */
    IMP_BEND_EULER,        /**< symplectic Euler: order 1 */
    IMP_BEND_VERLET,       /**< kick-drift-kick: order 2 */
    IMP_BEND_YOSHIDA4,     /**< three leapfrogs: order 4 */
    IMP_BEND_ARC,          /**< leapfrog in arc length, dx/ds = v/|v|, reversible */
    IMP_BEND_ARC_INDEX     /**< supplement (23): dx/ds = v/eta, cannot be reversed */
};
#define IMP_BEND_N_SCHEMES 6

/** How the adjoint gets the path back. */
enum imp_bend_way {
    IMP_BEND_REVERSE = 0,  /**< runs the ray backwards: nothing is stored */
    IMP_BEND_STORED,       /**< trace again into a buffer of one ray: 48 B a step */
    IMP_BEND_PSEUDO        /**< of IMP_BEND_ARC_INDEX: biased; for comparisons only */
};

enum imp_bend_surface_type {
    IMP_BEND_PLANE = 0,    /**< n.x = offset; crossed along n */
    IMP_BEND_SPHERE,       /**< |x - centre| = radius, from inside */
    IMP_BEND_CYLINDER,     /**< distance from an axis (centre, normal) = radius, from inside */
    IMP_BEND_DISC,         /**< plane through centre within radius of it */
    IMP_BEND_BOX,          /**< lo .. hi, from inside */
    IMP_BEND_SDF,          /**< field = 0, from negative to positive */
    IMP_BEND_APPROACH,     /**< first closest approach to centre */
    IMP_BEND_MESH          /**< triangles, from inside */
};

/** What happens to a ray at a surface. */
enum imp_bend_event {
    IMP_BEND_END = 0,      /**< the ray ends; momentum as it is (index-matched) */
    IMP_BEND_REFRACT,      /**< the ray ends refracted into `index`; total reflection goes on */
    IMP_BEND_MIRROR,       /**< reflected, goes on */
    IMP_BEND_STOP          /**< the ray is lost: counted as missed */
};

struct imp_bend_surface {
    size_t size;
    enum imp_bend_surface_type type;
    enum imp_bend_event event;
    int group;             /**< rays of this group only; -1: all */
    double normal[3];      /**< of planes and discs; axis of a cylinder. Normalised. */
    double offset;         /**< of a plane */
    double centre[3];
    double radius;
    double lo[3], hi[3];   /**< of a box */
    double index;          /**< outside, for IMP_BEND_REFRACT */
    const imp_field *sdf;  /**< its value is the distance; shared, not copied */
    const float *positions;       /**< mesh: [3 n_vertices], copied */
    const uint32_t *triangles;    /**< [3 n_triangles], counter-clockwise from outside */
    size_t n_vertices, n_triangles;
};
#define IMP_BEND_SURFACE_INIT                                                              \
    {sizeof(struct imp_bend_surface), IMP_BEND_PLANE, IMP_BEND_END, -1, {0, 0, 1}, 0, {0}, \
     1, {0}, {0}, 1, 0, 0, 0, 0, 0}

/** A plane whose crossing is recorded and does not end the ray. */
struct imp_bend_tap { double normal[3], offset; int group; };

struct imp_bend_options {
    size_t size;
    enum imp_bend_scheme scheme;
    enum imp_bend_way way;
    double step;           /**< in sigma, or in length for arc-length schemes; 0: half a cell
                                (trilinear) or one cell (spline) over the greatest index */
    uint32_t max_steps;    /**< a ray that needs more is dropped and counted; 0: 100000 */
    int outside;           /**< rays start outside the surfaces, in a medium of index
                                `outside_index`: they go straight to the first and enter */
    double outside_index;  /**< 0: 1 */
    double grazing;        /**< |cos| at the exit below which a ray is dropped; 0: 0.05;
                                negative: none */
    double reversal;       /**< reversed start off by more than this (relative) is counted;
                                0: 1e-10 */
    size_t n_surfaces;     /**< 0: the field's own box, momentum as it is */
    const struct imp_bend_surface *surfaces;
    size_t n_taps;         /**< at most 16 */
    const struct imp_bend_tap *taps;
    imp_progress_fn progress;
    void *progress_payload;
};
#define IMP_BEND_OPTIONS_INIT                                                              \
    {sizeof(struct imp_bend_options), IMP_BEND_LEAPFROG, IMP_BEND_REVERSE, 0, 0, 0, 0, 0,  \
     0, 0, 0, 0, 0, 0, 0}

enum imp_bend_flags {      /* of an exit; a ray with one of DROPPED has no derivative */
    IMP_BEND_TRUNCATED = 1,   /**< more than max_steps */
    IMP_BEND_MISSED = 2,      /**< left the field, or met IMP_BEND_STOP, or no surface */
    IMP_BEND_STARTED_OUT = 4, /**< the start is not inside the surfaces */
    IMP_BEND_GRAZING = 8,     /**< exit too close to the surface's tangent */
    IMP_BEND_BROKEN = 16,     /**< not finite, or |v|^2 off eta^2 by more than 10 % */
    IMP_BEND_DROPPED = 31,
    IMP_BEND_ENERGY = 32,     /**< |v|^2 off eta^2 by more than 1 %: kept */
    IMP_BEND_REFLECTED = 64,  /**< totally reflected or mirrored on the way: kept */
    IMP_BEND_TAP_MISSED = 128 /**< of a tap's record: plane not crossed */
};

/** End of a ray, or its crossing of a tap. All that is kept of a ray between passes. */
struct imp_bend_exit {
    double x[3], v[3];     /**< position; momentum (after refraction) */
    double path;           /**< optical path length, int eta ds */
    double tau;            /**< length of the last, fractional step */
    double norm2;          /**< |v|^2 before refraction */
    uint32_t steps;        /**< whole steps before it */
    uint16_t surface;      /**< index in options.surfaces */
    uint8_t flags;         /**< enum imp_bend_flags */
    uint8_t segments;      /**< reflections + 1 */
};

struct imp_bend_stats {
    size_t size;
    uint64_t rays, traced, steps;
    uint64_t truncated, missed, started_out, grazing, broken, energy, reflected, taps_missed;
    uint64_t reversal;         /**< of an adjoint: rays not reversed to their start */
    double worst_energy;       /**< max | |v|^2 - eta^2 | / eta^2 at exits */
    double worst_reversal;     /**< max |x - x0| / size */
};
#define IMP_BEND_STATS_INIT {sizeof(struct imp_bend_stats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, \
                             0, 0, 0}

/** Rays: arrays of n. group may be NULL (all 0). Directions need not be unit. */
struct imp_bend_rays {
    size_t n;
    const double (*x)[3], (*d)[3];
    const uint16_t *group;
};

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

/** The cotangent of an exit: dC/dx, dC/dv, dC/dpath with x, v, path taken as independent. */
struct imp_bend_cotangent { double x[3], v[3], path; };

/** What the adjoint gives. Arrays may be NULL; all are overwritten. */
struct imp_bend_gradient {
    size_t size;
    double *theta;             /**< [n_theta] */
    double (*x)[3], (*d)[3];   /**< [n] origins, directions (tangent to the unit sphere) */
    double (*surfaces)[8];     /**< [n_surfaces]: 0-2 normal (plane) or centre, 3 offset or
                                    radius, 4 index outside; not for box, SDF and mesh */
    double *energy;            /**< [n] K = lam.v + mu.F at the start: 0 up to truncation */
};
#define IMP_BEND_GRADIENT_INIT {sizeof(struct imp_bend_gradient), 0, 0, 0, 0, 0}

/** The exact derivative of imp_bend_trace with the same arguments. Dropped rays give nothing.
 * exits, taps as traced; bars [n], tap_bars [n][n_taps] (NULL: zero).
 * @return as imp_bend_trace; IMP_E_BIAS for IMP_BEND_ARC_INDEX with IMP_BEND_REVERSE. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_adjoint(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const struct imp_bend_exit *exits,
                 const struct imp_bend_exit *taps, const struct imp_bend_cotangent *bars,
                 const struct imp_bend_cotangent *tap_bars, struct imp_bend_gradient *out,
                 struct imp_bend_stats *stats);

/** Forward derivative along (theta_dot, x_dot, d_dot), each may be NULL: dots [n],
 * tap_dots [n][n_taps] in the same layout as cotangents. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_tangent(const imp_field *field, const struct imp_bend_options *options,
                 const struct imp_bend_rays *rays, const double *theta_dot,
                 const double (*x_dot)[3], const double (*d_dot)[3],
                 struct imp_bend_cotangent *dots, struct imp_bend_cotangent *tap_dots);

/** One ray as points (x, y, z, path), for drawing: the caller frees *points with imp_free. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_bend_path(const imp_field *field, const struct imp_bend_options *options,
              const struct imp_bend_rays *rays, size_t ray, double (**points)[4],
              size_t *n_points, struct imp_bend_exit *exit);

#ifdef __cplusplus
}
#endif
#endif
