/* SPDX-License-Identifier: Apache-2.0
 *
 * Fields of refractive index: a kind is a table of functions (eval, splat, tangent). The
 * structs of those kinds that other files need to see are at the end. */
#ifndef IMP_BEND_FIELD_H
#define IMP_BEND_FIELD_H

#include "base/arguments.h"
#include "base/pool.h"
#include "math/vec.h"
#include <importon/bend.h>

#define IMP_LANES           8 /* rays traced side by side, to hide the latency of loads */
#define IMP_FIELD_THETA_MAX ((size_t)1 << 30)

/* ---- Fields -------------------------------------------------------------------- */

/* Value, gradient and (symmetric) Hessian by columns. */
struct imp__jet {
    double eta;
    imp_v3 g, h[3];
};

/* Accumulator of a gradient. A slice of rays reaches few blocks of a large gradient, so
 * blocks are cleared when first touched, and only those are added to the sum
 * (bend_gradient.c). */
#define IMP_BLOCK_SHIFT 12
struct imp__bar {
    double *theta;    /* gradient of the whole field */
    size_t first;     /* offset of the part that splats (in a sum of fields) */
    uint8_t *touched; /* dirty flags by block; NULL: theta was cleared by the caller */
};
void imp__bar_touch(struct imp__bar *bar, size_t first_block, size_t last_block);
/* The gradient of this part, with the blocks of numbers i .. i + n - 1 cleared and
 * marked. */
static inline double *imp__bar_reach(struct imp__bar *bar, size_t i, size_t n)
{
    if (bar->touched) {
        const size_t a = (bar->first + i) >> IMP_BLOCK_SHIFT,
                     b = (bar->first + i + n - 1) >> IMP_BLOCK_SHIFT;
        if (imp_unlikely(b - a > 1 || !(bar->touched[a] & bar->touched[b])))
            imp__bar_touch(bar, a, b);
    }
    return bar->theta + bar->first;
}

/* Order in which n lanes add to a gradient. Neighbours in a beam reach overlapping rows,
 * and a load that overlaps a store still in the store buffer stalls; so they alternate.
 */
static inline int imp__lane_order(int n, int k)
{
    return n == IMP_LANES ? (k >> 1) + IMP_LANES / 2 * (k & 1) : k;
}

struct imp__back;

struct imp__field_ops {
    const char *name;
    /* At n <= IMP_LANES points. order 1: h is not touched. */
    void (*eval)(const imp_field *f, int n, const imp_v3 *x, int order,
                 struct imp__jet *jet);
    /* theta_bar += a d eta/d theta + b . d g/d theta: the transpose of `tangent`. */
    void (*splat)(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                  struct imp__bar *bar);
    /* Adjoint of a kick for n <= IMP_LANES rays: eval and splat in one, for kinds that
     * can share work between them. NULL: the two are called. bar may be NULL. */
    void (*kick_back)(const imp_field *f, bool arc, double dt, int n, struct imp__back *b,
                      struct imp__bar *bar);
    void (*tangent)(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                    double *eta_dot, imp_v3 *g_dot);
    /* Called after theta changed; may be NULL. */
    void (*changed)(imp_field *f);
    void (*destroy)(
        imp_field *f); /* releases what the kind owns besides theta; may be NULL */
    /* Called after f->theta points elsewhere (into a sum's numbers); may be NULL. */
    void (*moved)(imp_field *f);
    const char *(*param_name)(const imp_field *f,
                              size_t i); /* NULL: numbers without names */
    const char *jumps; /* why paths have no derivative by its numbers; NULL: they have */
};

struct imp_field {
    const struct imp__field_ops *ops;
    imp_context *ctx;
    size_t n_theta;
    double *theta;
    bool borrowed;  /* theta belongs to a sum */
    imp_v3 lo, hi;  /* where it is defined; infinite for profiles */
    double spacing; /* smallest spacing of samples; 0: no samples */
};

/* Set ops, n_theta, bounds (infinite) and allocate theta. `size` of the kind's struct,
 * whose first member is the field. */
enum imp_status imp__field_new(imp_context *ctx, const struct imp__field_ops *ops,
                               size_t size, size_t n_theta, imp_field **out);

static inline void imp__field_eval1(const imp_field *f, const imp_v3 *x, int order,
                                    struct imp__jet *jet)
{
    f->ops->eval(f, 1, x, order, jet);
}
static inline imp_v3 imp__jet_times(const struct imp__jet *j, imp_v3 m) /* H m */
{
    return j->h[0] * m[0] + j->h[1] * m[1] + j->h[2] * m[2];
}
/* Greatest index: of grids the greatest coefficient, otherwise sampled along the
 * diagonals of lo..hi. */
double imp__field_index_max(const imp_field *f);

/* grid.c: spline and trilinear share nodes, files and levels. */
#define IMP_GRID_CELLS_MAX 8192 /* along an axis */
struct imp__grid {
    imp_field base;
    struct imp_field_grid desc;
    int nodes[3];         /* x, y, z */
    imp_v3 origin, inv_h; /* corner of cell 0; cells per length */
    float *single;        /* theta as floats, NULL: double is used */
    double most;          /* greatest coefficient, since the last change */
};
bool imp__field_is_grid(const imp_field *f);
/* Numbers of grid f -> of the grid that is twice as fine; linear. */
enum imp_status imp__grid_prolong(const imp_field *f, const double *coarse, double *fine);
enum imp_status imp__tie_refine(const imp_field *f, imp_field **out);
/* The same for a grid or a tied grid; `finer` is its refined field. */
enum imp_status imp__field_prolong(const imp_field *f, const imp_field *finer,
                                   const double *coarse, double *fine);
/* The cell that contains x, as a grid of one cell with the coefficients `local`. */
struct imp__grid imp__grid_cell(const struct imp__grid *g, imp_v3 x, double *local,
                                size_t corner[3]);
/* For both kinds of grids: `tangent` of the table. */
void imp__grid_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                       double *eta_dot, imp_v3 *g_dot);
void imp__grid_changed(imp_field *f);
void imp__grid_destroy(imp_field *f);
extern const struct imp__field_ops imp__field_spline, imp__field_trilinear,
    imp__field_radial, imp__field_rz, imp__field_tie, imp__field_sum;

/* From the jet of u = eta^2/2, the number that some fields store, to that of eta, in place:
 *
 *     eta = sqrt(2 u),    g = grad u / eta,    H = (Hess u - g g^T)/eta */
static inline void imp__jet_from_eta2(struct imp__jet *j, int order)
{
    j->eta = sqrt(2 * j->eta);
    const double inv = 1 / j->eta;
    j->g *= inv;
    if (order < 2) return;
    for (int k = 0; k < 3; k++) j->h[k] = (j->h[k] - j->g * j->g[k]) * inv;
}
/* Its transpose, from cotangents of eta and g to those of u and grad u, by
 *
 *     d eta = du/eta,    dg = (d grad u - g d eta)/eta                              ... */
static inline void imp__eta2_vjp(const struct imp__jet *at, double *a, imp_v3 *b)
{
    const double inv = 1 / at->eta;
    *b *= inv;
    *a = (*a - imp__dot(*b, at->g)) * inv;
}
/* ... and tangents of u, grad u (in j) -> of eta, g. */
static inline void imp__eta2_jvp(const struct imp__jet *at, struct imp__jet *j)
{
    const double inv = 1 / at->eta;
    j->eta *= inv;
    j->g = (j->g - at->g * j->eta) * inv;
}
/* Cubic B-splines on one axis: numbers first .. first + 3 at local coordinate t of
 * `cells` cells, values and derivatives times inv_h, inv_h^2. Beyond the ends the
 * outermost polynomial goes on. */
struct imp__bend_basis {
    int first;
    double b[4], d[4], dd[4];
};
static inline struct imp__bend_basis imp__bend_basis_of(double t, int cells, double inv_h)
{
    struct imp__bend_basis s;
    s.first = (int)imp_clamp(t, 0.0, (double)(cells - 1));
    const double u = t - s.first, m = 1 - u, k = inv_h;
    s.b[0] = m * m * m / 6;
    s.b[1] = (3 * u * u * u - 6 * u * u + 4) / 6;
    s.b[2] = (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6;
    s.b[3] = u * u * u / 6;
    s.d[0] = -m * m / 2 * k;
    s.d[1] = (3 * u * u - 4 * u) / 2 * k;
    s.d[2] = (-3 * u * u + 2 * u + 1) / 2 * k;
    s.d[3] = u * u / 2 * k;
    s.dd[0] = (1 - u) * k * k;
    s.dd[1] = (3 * u - 2) * k * k;
    s.dd[2] = (1 - 3 * u) * k * k;
    s.dd[3] = u * k * k;
    return s;
}

/* Radial spline's data, for its file. */
struct imp__radial {
    imp_field base;
    struct imp_field_radial desc;
    imp_v3 centre, axis;
    double h; /* spacing in u = r^2 */
};

/* rz.c: [z][r]. */
struct imp__rz {
    imp_field base;
    struct imp_field_rz desc;
    imp_v3 centre, axis;
    double inv_u, inv_z; /* cells per r^2 and along the axis */
    int n_u, n_z;        /* numbers along them */
};
/* tie.c: a grid whose coefficients are numbers shared by the nodes of an orbit. */
struct imp__tie {
    imp_field base;
    struct imp_field_symmetry desc;
    imp_field *grid;
    uint32_t *number; /* [n_theta of the grid] */
    double *share;    /* [n_theta] 1 over the nodes of an orbit */
};
/* The grid of a grid or a tie, NULL for other kinds; *number as above, NULL of a grid. */
const struct imp__grid *imp__field_nodes(const imp_field *f, const uint32_t **number);

/* profile_file.c: radial and rz fields as text. */
struct imp_bytes;
enum imp_status imp__profile_read(imp_context *ctx, const char *path,
                                  const struct imp_bytes *b, imp_field **out);
enum imp_status imp__profile_write(const imp_field *f, const char *path);

/* Name of parameter i of a profile kind, NULL past the last. */
const char *imp__profile_param(const char *kind, size_t i);

#endif
