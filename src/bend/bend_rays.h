/* SPDX-License-Identifier: Apache-2.0
 *
 * Ray tracing in a graded refractive index. A field kind is a table of functions (eval,
 * splat, tangent); an integration scheme is a list of drifts and kicks; a ray ends, is
 * refracted or is reflected at a surface. The forward step, its adjoint and its tangent
 * read the same list, so the derivative is that of the program that traces. Equation
 * numbers: Teh et al. 2022, supplement, with the corrections of docs/bend.md. */
#ifndef IMP_BEND_RAYS_H
#define IMP_BEND_RAYS_H

#include "field.h"

#define IMP_BEND_TAPS_MAX     16
#define IMP_BEND_SEGMENTS_MAX 64

/* ---- Schemes ------------------------------------------------------------------- */

struct imp__stage {
    bool kick;
    double part;
};
struct imp__scheme {
    const char *name;
    int order;
    bool arc;        /* the parameter is length, the kick is linear in eta */
    bool index_form; /* supplement (23), (24): its own step, no stages */
    int n_stages;
    struct imp__stage stage[8];
};
extern const struct imp__scheme imp__schemes[IMP_BEND_N_SCHEMES];

/* Position, momentum, optical path. */
struct imp__state {
    imp_v3 x, v;
    double path;
};

/* One step of length t for n <= IMP_LANES rays; arrays beside each other. */
void imp__step(const struct imp__scheme *s, const imp_field *f, double t, int n,
               imp_v3 *x, imp_v3 *v, double *path);
/* The same for one ray, with d/dt of everything. */
void imp__step_rate(const struct imp__scheme *s, const imp_field *f, double t,
                    struct imp__state *state, struct imp__state *rate);
/* Tangent: `dot` goes with `state` (dot->path too); t is held fixed; theta_dot may be
 * NULL. */
void imp__step_tangent(const struct imp__scheme *s, const imp_field *f, double t,
                       const double *theta_dot, struct imp__state *state,
                       struct imp__state *dot);
/* Adjoint of a step: takes state and cotangents after the step to those before it.
 * `before` holds stored states before the step; NULL: they are recomputed by reversing
 * the step (index form: by its biased pseudo-reverse). */
struct imp__back {
    imp_v3 x[IMP_LANES], v[IMP_LANES], lam[IMP_LANES], mu[IMP_LANES];
    double path_bar[IMP_LANES];
};
void imp__step_adjoint(const struct imp__scheme *s, const imp_field *f, double t, int n,
                       struct imp__back *b, const struct imp__state *const *before,
                       struct imp__bar *bar);
/* Adjoint of the kick of ray i, given the field's jet at its position. Returns the
 * cotangents of the index (*value) and of its gradient (*slope), to be splatted. A path
 * cotangent adds S_bar 2 t eta to the value's and S_bar t 2F to lam. */
static inline __attribute__((always_inline)) void
imp__kick_back(bool arc, double dt, const struct imp__jet *j, struct imp__back *b, int i,
               double *value, imp_v3 *slope)
{
    if (arc) {
        b->v[i] -= dt * j->g;
        *value = b->path_bar[i] * dt;
        *slope = dt * b->mu[i];
    } else {
        const double te = dt * j->eta;
        b->v[i] -= te * j->g;
        *value = dt * imp__dot(b->mu[i], j->g) + 2 * te * b->path_bar[i];
        *slope = te * b->mu[i];
    }
    b->lam[i] += *value * j->g + imp__jet_times(j, *slope);
}

/* ---- Surfaces ------------------------------------------------------------------ */

enum imp__surface_kind {
    IMP__PLANE,
    IMP__SPHERE,
    IMP__CYLINDER,
    IMP__DISC,
    IMP__SDF,
    IMP__APPROACH,
    IMP__MESH
};
/* A surface as the tracer uses it: a box has been split into six planes. G < 0 inside; a
 * ray crosses where G goes from <= 0 to > 0. */
struct imp__surface {
    enum imp__surface_kind kind;
    enum imp_bend_event event;
    int id;      /* index in options.surfaces */
    imp_v3 n, c; /* normal or axis; centre */
    double offset, radius, index;
    const imp_field *sdf;
    const imp_scene *scene; /* MESH: n and offset are those of the facet that was hit */
};
/* G, its gradients in x and v, and Hess_x G times a vector. */
struct imp__surface_at {
    double g;
    imp_v3 gx, gv;
};
void imp__surface_eval(const struct imp__surface *s, const imp_v3 *x, const imp_v3 *v,
                       struct imp__surface_at *at);
void imp__surface_hess(const struct imp__surface *s, const imp_v3 *x, const imp_v3 *m,
                       imp_v3 *out);
/* The first facet of a MESH surface that the segment from a to b crosses outwards (with
 * `inwards`: inwards), as a plane. False: it crosses none. */
bool imp__facet(const struct imp__surface *s, const imp_v3 *a, const imp_v3 *b,
                bool inwards, double nearest, struct imp__surface *facet);
/* Does x, on the surface's plane, lie within a disc's radius? True for other kinds. */
bool imp__surface_covers(const struct imp__surface *s, const imp_v3 *x);

/* Refraction of momentum v at unit normal n into index e2, or reflection: `mirror`, or
 * total reflection (docs/bent-rays.md 3.5). */
struct imp__bend_turn {
    imp_v3 v;
    bool reflected;
    double a, q, c, sign;
};
void imp__bend_turn(const imp_v3 *n, const imp_v3 *v, double e2, bool mirror,
                    struct imp__bend_turn *out);
/* From the cotangent of the new momentum to those of v, n and e2. */
void imp__bend_turn_vjp(const struct imp__bend_turn *t, const imp_v3 *n, const imp_v3 *v,
                        double e2, const imp_v3 *bar, imp_v3 *v_bar, imp_v3 *n_bar,
                        double *e2_bar);
void imp__bend_turn_jvp(const struct imp__bend_turn *t, const imp_v3 *n, const imp_v3 *v,
                        double e2, const imp_v3 *v_dot, const imp_v3 *n_dot,
                        double e2_dot, imp_v3 *dot);

/* ---- Plans: options made ready ------------------------------------------------- */

struct imp__domain { /* the surfaces of one group of rays */
    imp_v3 lo,
        hi; /* inside this box no face of a box is crossed and the field is defined */
    int n, n_general; /* the last n_general are not faces of boxes */
    struct imp__surface *surface;
};
struct imp__plan {
    imp_context *ctx;
    const imp_field *field;
    const struct imp__scheme *scheme;
    struct imp_bend_options options;
    double t, grazing, outside_index, reversal;
    double size;   /* longest side of the field's box, or of the rays' origins */
    imp_v3 lo, hi; /* a ray outside this has left the field: its box and a margin */
    uint32_t max_steps;
    int n_groups;
    struct imp__domain *
        domain; /* [n_groups + 1]; the last serves groups without surfaces of their own */
    struct imp__surface *surfaces;
    struct imp__surface taps[IMP_BEND_TAPS_MAX];
    int tap_group[IMP_BEND_TAPS_MAX];
    int n_taps;
};
/* A caller's options, checked: sizes, numbers, and that arrays are there. */
enum imp_status imp__bend_options_take(imp_context *ctx, const char *function,
                                       const char *name,
                                       const struct imp_bend_options *in,
                                       struct imp_bend_options *own);
enum imp_status imp__plan_create(const imp_field *field,
                                 const struct imp_bend_options *options,
                                 const struct imp_bend_rays *rays, struct imp__plan *out);
void imp__plan_destroy(struct imp__plan *plan);
static inline int imp__ray_group(const struct imp_bend_rays *rays, size_t i)
{
    return rays->group ? rays->group[i] : 0;
}
static inline const struct imp__domain *imp__plan_domain(const struct imp__plan *p,
                                                         int group)
{
    return &p->domain[group < p->n_groups ? group : p->n_groups];
}

/* Start of ray i: position and momentum; with options.outside also its entry point. */
struct imp__start {
    imp_v3 x0, d0;                    /* as given, d0 unit */
    double length;                    /* |d| as given */
    struct imp__state at;             /* where the steps begin */
    const struct imp__surface *entry; /* NULL: begins at x0 */
    double tau;          /* length in sigma of the straight line to the entry */
    struct imp__jet jet; /* value and gradient of the field at `at` */
    unsigned flags;
    struct imp__surface facet; /* the entry itself if that is a mesh */
};
/* The surface entered. A function, since a start that is copied may not point into
 * itself. */
static inline const struct imp__surface *imp__start_entry(const struct imp__start *s)
{
    return s->entry && s->entry->kind == IMP__MESH ? &s->facet : s->entry;
}
void imp__start_ray(const struct imp__plan *p, const struct imp_bend_rays *rays, size_t i,
                    struct imp__start *out);

/* Length of the fractional step from `from` onto one surface, and the state there. */
double imp__land_on(const struct imp__plan *p, const struct imp__surface *s,
                    const struct imp__state *from, double t, double g0, double g1,
                    struct imp__state *at);

/* The first surface that the step from `from` to (x1, v1) crosses; NULL: none. *facet
 * stores the facet if that is a mesh. */
const struct imp__surface *
imp__land_first(const struct imp__plan *p, const struct imp__domain *d,
                const struct imp__state *from, const imp_v3 *x1, const imp_v3 *v1,
                double *tau, struct imp__state *at, struct imp__surface *facet);

/* A segment of a ray ends at a surface; this is its end before refraction or reflection.
 */
struct imp__segment {
    struct imp__state at, from; /* at the surface; at the start of the fractional step */
    const struct imp__surface *surface;
    double tau;
    uint32_t steps;
    struct imp__surface facet; /* `surface` points here for meshes */
};
/* One ray with its segments recorded. Same bits as the tracer of many rays. */
struct imp__track {
    imp_context *ctx;
    bool states;              /* record the state at the start of each step, too */
    struct imp__state *state; /* [n]; those of segment k begin at sum (steps + 1) */
    size_t n, capacity;
    int n_segments;
    struct imp__segment segment[IMP_BEND_SEGMENTS_MAX];
    struct imp_bend_exit exit, tap[IMP_BEND_TAPS_MAX];
};
enum imp_status imp__track_ray(const struct imp__plan *p,
                               const struct imp_bend_rays *rays, size_t i,
                               struct imp__track *track);
void imp__track_free(struct imp__track *track);

/* Rays first .. last - 1, on the calling thread. */
enum imp_status imp__trace_some(const struct imp__plan *p,
                                const struct imp_bend_rays *rays, size_t first,
                                size_t last, struct imp_bend_exit *exits,
                                struct imp_bend_exit *taps);
enum imp_status imp__count(const struct imp__plan *p, size_t n,
                           const struct imp_bend_exit *exits,
                           const struct imp_bend_exit *taps,
                           struct imp_bend_stats *stats);
/* The surface of an exit; for boxes the face. */
const struct imp__surface *imp__exit_surface(const struct imp__plan *p, int group,
                                             const struct imp_bend_exit *e);

static inline imp_v3 imp__v3_load(const double a[3]) { return imp__v3(a[0], a[1], a[2]); }
static inline void imp__v3_store(imp_v3 v, double a[3])
{
    a[0] = v[0], a[1] = v[1], a[2] = v[2];
}
/* lo <= x <= hi; false for NaN. */
static inline bool imp__inside(const imp_v3 *x, const imp_v3 *lo, const imp_v3 *hi)
{
    const imp_v3 a = *x;
    return a[0] >= (*lo)[0] && a[1] >= (*lo)[1] && a[2] >= (*lo)[2] && a[0] <= (*hi)[0] &&
           a[1] <= (*hi)[1] && a[2] <= (*hi)[2];
}

#endif
