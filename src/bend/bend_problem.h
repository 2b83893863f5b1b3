/* SPDX-License-Identifier: Apache-2.0
 *
 * A problem of bent rays: field, rays, targets and the rules of a fit. bend_problem.c makes it,
 * target.c and bend_image.c evaluate targets, objective.c adds them up and differentiates,
 * bend_fit.c minimises. */
#ifndef IMP_BEND_PROBLEM_H
#define IMP_BEND_PROBLEM_H

#include "bend_rays.h"

struct imp__target_of_rays {
    struct imp_bend_target desc; /* data, pixels point to copies */
    double *data;                /* [n_data] */
    size_t n_data;
    float *pixels;      /* divided by their mean */
    size_t first, last; /* rays */
    double power;       /* of these rays together */
};

struct imp__hold { /* numbers that a fit may not change: a rule, applied at each level */
    enum { IMP_HOLD_RIM, IMP_HOLD_OUTSIDE, IMP_HOLD_NUMBER } kind;
    int layers;
    imp_v3 centre;
    double radius, value;
    size_t number;
};

struct imp__smooth {
    double weight, edge;
    int order;
};

struct imp_bend {
    imp_context *ctx;
    imp_field *field;
    struct imp_bend_options options;
    struct imp_bend_surface *surfaces;
    struct imp_bend_tap *taps;
    double step_cells, step_max;
    double lo, hi;
    bool bounds_set;

    size_t n, cap_x, cap_d, cap_group, cap_power;
    double (*x)[3], (*d)[3], *power;
    uint16_t *group;
    int n_bundles;
    size_t *bundle_first; /* [n_bundles + 1] */
    size_t cap_bundles;

    double *dispersion; /* [cap_dispersion] factor of eta - 1 by bundle; NULL: all 1 */
    size_t cap_dispersion;
    double *um; /* [cap_um] wavelength by bundle in micrometres; 0: none was given */
    size_t cap_um;

    size_t n_targets, cap_targets;
    struct imp__target_of_rays *targets;
    size_t n_holds, cap_holds;
    struct imp__hold *holds;
    size_t n_smooths, cap_smooths;
    struct imp__smooth *smooths;

    imp_field **sdfs; /* owned, made by the loader */
    size_t n_sdfs, cap_sdfs;
    imp_scene **scenes; /* of mesh surfaces, likewise */
    size_t n_scenes, cap_scenes;

    struct imp_check_row *rows; /* of the last check */
    size_t n_rows, cap_rows;
    double *history; /* of the last fit */
    size_t n_history, cap_history;
};

/* IMP_E_NUMERIC, with the counts in the message, if no ray reached an end: a value or a
 * check over no rays would appear to be perfect. */
enum imp_status imp__bend_traced(const imp_bend *b, const struct imp_bend_stats *s);
/* The options, with the step chosen from the grid where none is given. */
void imp__bend_options(const imp_bend *b, struct imp_bend_options *o);
/* The same; IMP_E_ARG if no step can be chosen. */
enum imp_status imp__bend_options_ready(const imp_bend *b, struct imp_bend_options *o);
static inline struct imp_bend_rays imp__bend_rays(const imp_bend *b)
{
    return (struct imp_bend_rays){.size = sizeof(struct imp_bend_rays),
                                  .n = b->n,
                                  .x = (const double(*)[3])b->x,
                                  .d = (const double(*)[3])b->d,
                                  .group = b->group};
}

/* dispersion.c: a field at another wavelength; its numbers are those of `of`. */
struct imp__scaled {
    imp_field base;
    imp_field *of;
    double k;
};
void imp__scaled_init(struct imp__scaled *s, imp_field *of, double k);
double imp__bend_factor(const imp_bend *b, const struct imp_bend_rays *rays, size_t i);
/* imp_bend_trace, _adjoint and _tangent, each ray in the field at its bundle's
 * wavelength. */
enum imp_status
imp__bundles_trace(const imp_bend *b, imp_field *field, const struct imp_bend_options *o,
                   const struct imp_bend_rays *rays, struct imp_bend_exit *exits,
                   struct imp_bend_exit *taps, struct imp_bend_stats *stats);
enum imp_status imp__bundles_adjoint(const imp_bend *b, const struct imp_bend_options *o,
                                     const struct imp_bend_rays *rays,
                                     const struct imp_bend_exit *exits,
                                     const struct imp_bend_exit *taps,
                                     const struct imp_bend_cotangent *bars,
                                     const struct imp_bend_cotangent *tap_bars,
                                     double *theta, struct imp_bend_stats *stats);
enum imp_status imp__bundles_tangent(const imp_bend *b, const struct imp_bend_options *o,
                                     const struct imp_bend_rays *rays,
                                     const double *theta_dot,
                                     struct imp_bend_cotangent *dots);

/* Calls `each` for the parts of a sum, or for a field that is none. `offset` is that of
 * the part's theta in the whole. */
void imp__field_leaves(imp_field *f, size_t offset,
                       void (*each)(imp_field *leaf, size_t offset, void *payload),
                       void *payload);

/* mask [n_theta]: 1 for held numbers; theta (may be NULL): their values are set. */
void imp__bend_hold(const imp_bend *b, uint8_t *mask, double *theta);
/* Bounds of all numbers. */
void imp__bend_bounds(const imp_bend *b, double *lo, double *hi);

/* A ray at its target: at its exit or tap, or continued straight to the target's plane.
 */
struct imp__arrival {
    imp_v3 x, d, v;
    double path, weight, s, slope;
};
bool imp__arrive(const struct imp_bend_target *t, const struct imp_bend_exit *e,
                 struct imp__arrival *a);
/* Adds to the cotangent of the exit, from those of the arrival: of position, direction
 * (d_bar), momentum (v_bar), path and weight. */
void imp__arrive_vjp(const struct imp_bend_target *t, const struct imp__arrival *a,
                     imp_v3 x_bar, imp_v3 d_bar, imp_v3 v_bar, double path_bar,
                     double weight_bar, struct imp_bend_cotangent *bar);
static inline const struct imp_bend_exit *
imp__target_exit(const struct imp_bend_target *t, const struct imp_bend_exit *exits,
                 const struct imp_bend_exit *taps, size_t n_taps, size_t i)
{
    return t->tap < 0 ? &exits[i] : &taps[i * n_taps + (size_t)t->tap];
}

/* Numbers a ray of a target's data; 0: the type has none. */
size_t imp__target_numbers(enum imp_bend_target_type type);
/* Value of one target; adds cotangents to bars [n], tap_bars (NULL: value only). */
enum imp_status imp__target_value(const imp_bend *b, const struct imp__target_of_rays *t,
                                  const struct imp_bend_exit *exits,
                                  const struct imp_bend_exit *taps, double *value,
                                  struct imp_bend_cotangent *bars,
                                  struct imp_bend_cotangent *tap_bars);
/* Image targets; pixels [height][width] not NULL: the irradiance itself. */
enum imp_status imp__image_value(const imp_bend *b, const struct imp__target_of_rays *t,
                                 const struct imp_bend_exit *exits,
                                 const struct imp_bend_exit *taps, double *value,
                                 struct imp_bend_cotangent *bars,
                                 struct imp_bend_cotangent *tap_bars, float *pixels);
/* Smoothness of all grids; adds to gradient [n_theta], which may be NULL. */
double imp__smooth_value(const imp_bend *b, double *gradient);

#endif
