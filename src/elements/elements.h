/* SPDX-License-Identifier: Apache-2.0
 *
 * Finite elements with directional radiance and importance (Christensen, Salesin, DeRose
 * 1993; docs/elements.md). Surfaces are cut into a hierarchy of elements; a link carries
 * radiance from its source element to its receiver, and importance back. Cosine-weighted
 * moments of what arrives are gathered over the links; reflection is one matrix per
 * element.
 *
 * With A_i areas, R the material in the basis, and link samples of weight K_s and
 * direction w_s:
 *
 *     c_i = sum K_s/A_i (l_j . H_j(-w_s) + Le_j(-w_s)) H_i(w_s)     moments of radiance
 *     b_j = sum K_s/A_j (g_i . H_i(w_s)) H_j(-w_s)                  moments of importance
 *     l_i = R c_i,   g_i = R (b_i + a_i/A_i) + s_i
 *
 * where a is importance that arrives from the eye and s what a measuring patch emits. R is
 * symmetric and both sums are over the same links, so a.l = Le . (S^T g) to rounding. */
/* clang-format off */
/* clang-format on */
#ifndef IMP_ELEMENTS_H
#define IMP_ELEMENTS_H

#include "base/arguments.h"
#include "base/pool.h"
#include "scene/scene.h"
#include <importon/elements.h>

#define EL_ORDER_MAX 12
#define EL_N_MAX     91  /* (order + 1)(order + 2)/2 */
#define EL_BLOCK_MAX 231 /* sum over m of squared block sizes at order 12 */
#define EL_LEVEL_MAX 10
#define EL_NONE      UINT32_MAX

/* ---- elements_basis.c: even-parity real spherical harmonics on the hemisphere ----------- */

/* H_lm = sqrt(2) Y_lm, l + m even: orthonormal on z > 0. Stored by m: all l of m = 0,
 * then of m = 1 with cosine, m = 1 with sine, m = 2 ... */
struct imp__el_basis {
    int order, n;
    int size[EL_ORDER_MAX + 1];    /* number of l for each m */
    int start[EL_ORDER_MAX + 1];   /* index of the first function of m (cosine) */
    double lead[EL_ORDER_MAX + 1]; /* H_mm without (x + iy)^m */
    double inv[EL_ORDER_MAX + 1][EL_ORDER_MAX / 2 + 1];
    double mid[EL_ORDER_MAX + 1][EL_ORDER_MAX / 2 + 1];
    double low[EL_ORDER_MAX + 1][EL_ORDER_MAX / 2 + 1];
};
void imp__basis_init(struct imp__el_basis *b, int order);
/* Four directions at once, one a lane; h [n]. */
void imp__basis_eval4(const struct imp__el_basis *b, imp_spec x, imp_spec y, imp_spec z,
                      imp_spec *h);
void imp__basis_eval(const struct imp__el_basis *b, imp_v3 w, double *h);

/* ---- polygon.c ----------------------------------------------------------------- */

/* Integral of cos cos'/r^2 over the polygon v [n], n <= 4, as seen from x on a plane with
 * normal `normal`: pi times the point-to-polygon form factor, exact, with what lies
 * behind the plane cut away. `facing` is the polygon's normal; 0 from behind. */
double imp__polygon_factor(imp_v3 x, imp_v3 normal, int n, const imp_v3 *v,
                           imp_v3 facing);
double imp__polygon_area(int n, const imp_v3 *v);

/* ---- material.c ---------------------------------------------------------------- */

struct imp__el_material {
    const struct imp_bsdf *bsdf; /* NULL: phong, or black */
    bool flipped;                /* the back of a two-sided one */
    bool phong;
    const char *label; /* of a Phong override: its shape */
    double kd[3], ks[3], exponent;
    int n;                     /* basis functions: 0 black, 1 Lambert, else basis.n */
    double r[3][EL_BLOCK_MAX]; /* R by blocks of m, per channel */
    double albedo[3];          /* hemispherical: R_00/2 */
    double albedo_max;         /* largest directional albedo */
    double residual;           /* worst relative L2 error of a lobe in the basis */
    int n_d;                   /* derivatives of R, one for each input with a parameter */
    struct imp__el_material_d {
        int param, count; /* count 3: one a channel; 1: all channels together */
        const char *name; /* of a Phong coefficient, else NULL */
        double value[3];
        double (*r)[EL_BLOCK_MAX]; /* [3] */
    } * d;
};
/* BRDF (without cosine), 1/sr, local directions, all channels. */
void imp__el_brdf(const struct imp__el_material *m, imp_v3 wo, imp_v3 wi, double f[3]);
/* Fill r, albedo, residual and d for basis b. @return IMP_E_UNSUPPORTED with `shape` in
 * the message. m->n is set to 0, 1 or b->n. */
enum imp_status imp__el_project(imp_context *ctx, struct imp_arena *a,
                                const struct imp__el_basis *b, int ch, const char *shape,
                                struct imp__el_material *m);
/* y = R x over one channel's coefficients; r is one [EL_BLOCK_MAX]. */
void imp__el_apply(const struct imp__el_basis *b, int n, const double *r, const double *x,
                   double *y);

/* ---- Geometry ------------------------------------------------------------------ */

enum imp__el_light { EL_DARK, EL_UNIFORM, EL_LOBE, EL_PROFILE };

struct imp__el_root { /* an input polygon, one side of it */
    int shape;        /* -1: a virtual patch */
    int corners;      /* 3 or 4 */
    int material;     /* index */
    struct imp_frame frame;
    imp_v3 v[4];
    double area;
    enum imp__el_light light;
    double radiance[3]; /* L0 */
    imp_v3 axis;        /* EL_LOBE, world: L0 max(0, w.axis)^power */
    double power;       /* its exponent; of EL_PROFILE: mean radiance of the hemisphere */
    const struct imp_emitter *profiled;  /* EL_PROFILE: L0 is the scale */
    const struct imp_input *power_input; /* of a light of the scene; NULL: an option's */
    int light_param, light_count;        /* its parameter, -1: none */
    const char *light_name;
    double light_value[3];
    bool measured;  /* by a source: it has a coefficient even if it is black */
    double measure; /* importance that it emits, a constant */
    uint32_t element;
    int back; /* root of its other side, -1: none */
};

struct imp__element {
    uint32_t root, parent, child; /* child: first of four, 0: leaf */
    uint8_t level, corners;
    double area, radius; /* area: of the exposed part */
    double exposed;      /* fraction that no solid covers */
    imp_v3 centre, v[4];
    size_t coef;     /* first coefficient, in units of one channel's number */
    uint32_t hit[2]; /* the rays of the eye that end in it: [first, end) of the hits */
};

struct imp__el_link { /* src -> rcv */
    uint32_t src, rcv;
    double k[4];   /* K_s: area of the receiver's quarter x Q x V */
    float w[3][4]; /* from receiver to source, world, [axis][sample] */
};

struct imp__el_hit { /* where a ray of the eye ended */
    uint32_t root;   /* EL_NONE: nowhere, or on a black side */
    uint32_t source; /* importance source it belongs to, EL_NONE: to the view alone */
    uint32_t ray;    /* its number in the order of tracing: index of `seen` */
    uint32_t path;   /* imp__el_path of (u, v) */
    double u, v;
    imp_v3 w; /* towards the eye, world */
    double weight;
};

struct imp_elements {
    imp_context *ctx;
    const struct imp_scene *scene;
    struct imp_elements_options opt;
    struct imp_arena arena;
    bool quiet;    /* no warnings */
    int ch;        /* channels */
    double lum[3]; /* weights of the channels in an illuminance: luminance */
    double eye[3]; /* in what a camera measures: the mean of the channels */
    struct imp__el_basis basis;
    double eps; /* now */

    int n_materials;
    struct imp__el_material *materials;
    size_t n_roots, cap_roots;
    struct imp__el_root *roots;
    int **prim_root; /* [n_shapes][n_prims]: front root, -1: none */
    size_t n_sources;
    struct imp_elements_source *sources;
    double *weight;    /* [n_sources] present weights in the measurement */
    double *each;      /* [n_sources] measurements at the last step, without weights */
    size_t *first_ray; /* [n_sources] of camera sources: index into `seen` */
    double size;       /* of the scene, for tolerances */

    size_t n_elements, cap_elements;
    struct imp__element *elements;
    size_t n_coef, cap_coef; /* numbers of one channel */
    double *l, *g, *c, *b;   /* [ch n_coef], an element's channels together */
    double *from_above; /* part of c that the parent's links give (elements_sweep.c) */
    double *a;          /* [n_coef] */
    size_t cap_l, cap_g, cap_c, cap_b, cap_above, cap_a;

    size_t n_links, cap_links;
    struct imp__el_link *links; /* sorted by receiver when `sorted` */
    size_t *in_start;           /* [n_elements + 1] into links */
    size_t *out_start;          /* [n_elements + 1] into out */
    uint32_t *out;              /* link indices by source */
    double *value;              /* [4 ch n_links], see elements_sweep.c */
    size_t cap_in, cap_out_start, cap_out, cap_value;
    bool sorted;

    /* Rays of camera sources and of the view, the picture of the call: by root and
     * path, so that those of an element are together; misses last. */
    size_t n_hits;
    struct imp__el_hit *hits;
    double *seen;              /* [n_hits] radiance along each ray, in order of tracing */
    size_t first_view, n_view; /* rays of the view; none: no picture is made */
    double *picture;           /* the view's pixels at the last step */

    int64_t rays;
    size_t skipped; /* polygons without area */
    size_t n_log, cap_log;
    struct imp_elements_step *log;
    double start_s, deadline_s;
    double last_tick_s, fraction;
    bool stop; /* by progress, or the deadline passed */
    bool solved, has_importance;
    const char *reason;
    struct imp_elements_row *rows;
    size_t n_rows, cap_rows;
};

static inline double *imp__el_at(const imp_elements *e, double *array,
                                 const struct imp__element *x)
{
    return array + (size_t)e->ch * x->coef;
}
static inline const struct imp__el_root *imp__el_root_of(const imp_elements *e,
                                                         const struct imp__element *x)
{
    return &e->roots[x->root];
}
static inline const struct imp__el_material *
imp__el_material_of(const imp_elements *e, const struct imp__element *x)
{
    return &e->materials[e->roots[x->root].material];
}
/* Number of basis functions of an element. A measuring patch needs its constant one. */
static inline int imp__el_n(const imp_elements *e, const struct imp__el_root *r)
{
    const int n = e->materials[r->material].n;
    return n == 0 && r->measured ? 1 : n;
}
/* Emitted radiance along w (world, away from the surface), relative to L0. */
static inline double imp__el_lobe(const struct imp__el_root *r, imp_v3 w)
{
    if (r->light == EL_DARK) return 0;
    if (r->light == EL_UNIFORM) return 1;
    if (r->light == EL_PROFILE) return r->profiled->ops->profile->value(r->profiled, &w);
    const double c = imp__dot(w, r->axis);
    return c > 0 ? pow(c, r->power) : 0;
}

/* solve.c: imp_elements_create; `quiet`: without warnings, which were given before. */
enum imp_status imp__el_create(const imp_scene *scene,
                               const struct imp_elements_options *options, bool quiet,
                               imp_elements **out);
/* Has the scene this sensor? Otherwise an error. */
enum imp_status imp__el_sensor_check(const imp_elements *e, int sensor);

/* options.c: check and copy. */
enum imp_status imp__el_options(imp_elements *e,
                                const struct imp_elements_options *options);
/* lights.c: what the shape's light gives the polygon, and what its material itself emits
 * (Stam's ambient terms). */
enum imp_status imp__el_emitter_take(imp_elements *e, const struct imp_shape *s,
                                     struct imp__el_root *r);
enum imp_status imp__el_ambient_take(imp_elements *e, const struct imp_shape *s,
                                     const struct imp_bsdf *b, bool flipped,
                                     struct imp__el_root *r);
/* elements_measure.c: a polygon for a measuring plane; mark the fronts of a measured shape. */
enum imp_status imp__el_plane_add(imp_elements *e, const struct imp_elements_source *src);
enum imp_status imp__el_measure_shape(imp_elements *e,
                                      const struct imp_elements_source *src);
/* elements_measure.c: give every source the weight w [n_sources]: what the polygons emit as
 * importance and what the eye's hits weigh. Then imp__el_bin, and sweeps. */
void imp__el_weigh(imp_elements *e, const double *w);
/* roots.c: polygons, lights and materials of the scene; errors name the shape. */
enum imp_status imp__el_roots(imp_elements *e);
/* Prefix what refuses an object of the scene with where the object was written. */
enum imp_status imp__el_refused_at(const imp_elements *e, enum imp_status st,
                                   const void *object);
enum imp_status imp__el_root_append(imp_elements *e, const struct imp__el_root *r,
                                    int *index);
/* materials.c */
enum imp_status imp__el_materials(imp_elements *e); /* project; after roots */
/* The material with these properties, made if new. */
enum imp_status imp__el_material_add(imp_elements *e, const struct imp__el_material *m,
                                     int *index);

/* element.c */
enum imp_status imp__el_element_root(imp_elements *e, uint32_t root);
/* Four children for each of these leaves, in this order; they inherit l and g. */
enum imp_status imp__el_split(imp_elements *e, const uint32_t *element, size_t n);
/* Which child of which holds (u, v), down to the last level: two bits each, the first on
 * top. */
uint32_t imp__el_path(int corners, double u, double v);
/* The leaf at (u, v) of a root, and its corners there (uv [corners][2], may be NULL). */
uint32_t imp__el_find(const imp_elements *e, uint32_t root, double u, double v,
                      double uv[4][2]);
/* The element at (u, v) that is a leaf or at the level. */
uint32_t imp__el_find_level(const imp_elements *e, uint32_t root, double u, double v,
                            int level);
/* Quarter q of an element: its polygon. */
void imp__el_quarter(const struct imp__element *x, int q, imp_v3 v[4]);
/* The point of polygon v [corners] at (s, t) of the unit square. */
imp_v3 imp__el_point(int corners, const imp_v3 *v, double s, double t);

/* link.c */
/* Is nothing of one visible from the other, whatever is between? */
bool imp__el_back_facing(const imp_elements *e, const struct imp__element *a,
                         const struct imp__element *b);
/* Is the segment free between points of two polygons? */
bool imp__el_sees(const imp_elements *e, const struct imp__el_root *rcv, imp_v3 x,
                  const struct imp__el_root *src, imp_v3 y);
/* Make the link; *keep false: provably nothing passes. Adds its rays to *rays. */
void imp__el_link_make(const imp_elements *e, uint32_t src, uint32_t rcv,
                       struct imp__el_link *out, bool *keep, int64_t *rays);
/* A bound of the unoccluded K of any sample. */
double imp__el_link_bound(const imp_elements *e, const struct imp__el_link *link);
size_t imp__el_bytes(const imp_elements *e);
enum imp_status imp__el_links_first(imp_elements *e);
/* Sort the first `all` links by receiver, without those that are gone (NULL: none is),
 * index by source, make room for the values. */
enum imp_status imp__el_links_sort(imp_elements *e, const unsigned char *gone,
                                   size_t all);

/* elements_sum.c: the sum of part(e, first, end, how) over ranges of [0, n), by all threads; the
 * ranges and the order of adding depend on n alone. */
double imp__el_sum(const imp_elements *e, size_t n,
                   double (*part)(const imp_elements *e, size_t first, size_t end,
                                  const void *how),
                   const void *how);

/* refine.c: refine all links whose error is over e->eps. */
enum imp_status imp__el_refine(imp_elements *e, bool importance, bool *full);
/* The scale of eps: what passes over all links together. */
double imp__el_total(const imp_elements *e, bool importance);

/* elements_sweep.c: n Jacobi sweeps of both fields. `cold`: from zero. */
enum imp_status imp__el_sweep(imp_elements *e, int n, bool importance, bool cold);
/* What the four samples of a link carry, [channels]: radiance from the source, importance
 * from the receiver; either may be NULL. */
void imp__el_ends(const imp_elements *e, const struct imp__el_link *link,
                  imp_spec *radiance, imp_spec *importance);
void imp__el_emission(const imp_elements *e, const struct imp__el_link *link,
                      const struct imp__el_root *r, imp_spec *radiance);

/* source.c */
enum imp_status imp__el_sources(imp_elements *e); /* camera hits; before links */
/* Coordinates of a point of a root, in [0, 1). */
void imp__el_locate(const struct imp__el_root *r, imp_v3 p, double *u, double *v);
/* First surface along a ray; false: none, or a black side. */
bool imp__el_trace(const imp_elements *e, const struct imp_sensor_ray *ray,
                   struct imp__el_hit *hit);
void imp__el_ray(const struct imp_sensor *s, int x, int y, int k, int side,
                 struct imp_sensor_ray *ray);

/* elements_measure.c */
/* The measurement from radiance; `direct` (may be NULL): emitters that the eye sees. */
double imp__el_measure(const imp_elements *e, double *direct);
/* The part of the camera sources, as luminance; NaN: there is none. */
double imp__el_luminance(const imp_elements *e);
/* The same from the emitters: emission x importance. */
double imp__el_measure_adjoint(const imp_elements *e);
/* *sum += what element j's own light adds to the measurement over its links. */
void imp__el_given_add(const imp_elements *e, size_t j, double *sum);
/* The first source that measures a root; -1: none. */
int imp__el_source_of(const imp_elements *e, uint32_t root);
/* What every source measures by itself, from radiance, without weights: J [n_sources]. */
enum imp_status imp__el_measure_each(imp_elements *e, double *J);

/* eye.c */
/* Order the hits and give the elements theirs; after they were taken. */
enum imp_status imp__el_hits_sort(imp_elements *e);
/* The hits of the parent that are its child k's. */
void imp__el_hits_share(const imp_elements *e, const struct imp__element *parent, int k,
                        struct imp__element *child);
enum imp_status imp__el_bin(imp_elements *e); /* a from the hits */
/* Fill `seen` from the present solution. */
enum imp_status imp__el_see(imp_elements *e);
/* Relative change of the results since the last call: the larger of the view's RMS
 * and, where sources were given, sum w |dJ| / sum w |J| over their measurements J. NaN
 * the first time. */
enum imp_status imp__el_look(imp_elements *e, double *change);

/* elements_image.c */
/* Radiance of a hit towards its w, from the leaf. */
void imp__el_flat(const imp_elements *e, const struct imp__el_hit *hit, double out[3]);
/* Add what arrives at (u, v) of a root over the links of its leaf and of all above that,
 * evaluated for this very point: four pieces of each source, with the kernel exact and a
 * ray to their centres. `to`: reflected that way (world) by the true BRDF; NULL:
 * irradiance. */
void imp__el_gather(const imp_elements *e, uint32_t root, double u, double v,
                    const imp_v3 *to, double out[3]);
/* export.c: mean exitant radiance over the hemisphere and importance, per solid angle. */
void imp__el_means(const imp_elements *e, const struct imp__element *x,
                   double radiance[3], double *importance);
/* solve.c: sweeps until the solution moves by less than `tolerance`, `n` at a time. */
enum imp_status imp__el_settle(imp_elements *e, int n, bool importance, double tolerance);
/* Lights and reflectances as the scene has them now; the polygons stay. */
enum imp_status imp__el_parameters(imp_elements *e);
/* Call the host's progress; sets e->stop. */
void imp__el_tick(imp_elements *e, const char *stage, double fraction, const char *note);

#endif
