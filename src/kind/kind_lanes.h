/* SPDX-License-Identifier: Apache-2.0
 *
 * Kinds in lanes: forms of a kind's functions that work on IMP_WIDE_LANES points or directions at a
 * time (math/wide_real.h). Lane k of a result has the bits that the kind's own function (kinds.h) gives
 * for lane k of the arguments. Where a lane's result does not count it may be anything.
 *
 * A kind without a form in lanes is called point by point. One that has some lists it in the table
 * of its concept (kind/bsdf/bsdfs_in_lanes.c, ...); tests/unit/bundles.c and bundles_kinds.c compare
 * both forms. */
#ifndef IMP_KIND_KIND_LANES_H
#define IMP_KIND_KIND_LANES_H

#include "math/wide_real.h"
#include <importon/kinds.h>

/* Colours: r, g, b, or four wavelengths. */
struct imp_wide_color {
    imp_wide c[4];
};
static inline struct imp_wide_color imp__wide_color(imp_spec s)
{
    return (struct imp_wide_color){
        {imp__wide(s[0]), imp__wide(s[1]), imp__wide(s[2]), imp__wide(s[3])}};
}

static inline imp_spec imp__color_lane(const struct imp_wide_color *x, int colors, int k)
{
    return (imp_spec){x->c[0][k], x->c[1][k], x->c[2][k], colors > 3 ? x->c[3][k] : 0};
}

/* Lane k is row[k]. */
static inline struct imp_wide_color imp__color_of_rows(const imp_spec row[IMP_WIDE_LANES])
{
    struct imp_wide_color out;
#if IMP_WIDE_LANES == 8
    imp_wide r[4], even[2], odd[2];
    for (int k = 0; k < 4; k++)
        r[k] = __builtin_shufflevector(row[k], row[k + 4], 0, 1, 2, 3, 4, 5, 6, 7);
    for (int k = 0; k < 2; k++) {
        even[k] =
            __builtin_shufflevector(r[2 * k], r[2 * k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        odd[k] =
            __builtin_shufflevector(r[2 * k], r[2 * k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    out.c[0] = __builtin_shufflevector(even[0], even[1], 0, 1, 8, 9, 4, 5, 12, 13);
    out.c[1] = __builtin_shufflevector(odd[0], odd[1], 0, 1, 8, 9, 4, 5, 12, 13);
    out.c[2] = __builtin_shufflevector(even[0], even[1], 2, 3, 10, 11, 6, 7, 14, 15);
    out.c[3] = __builtin_shufflevector(odd[0], odd[1], 2, 3, 10, 11, 6, 7, 14, 15);
#else
    imp_wide even[2], odd[2];
    for (int k = 0; k < 2; k++) {
        even[k] = __builtin_shufflevector(row[2 * k], row[2 * k + 1], 0, 4, 2, 6);
        odd[k] = __builtin_shufflevector(row[2 * k], row[2 * k + 1], 1, 5, 3, 7);
    }
    out.c[0] = __builtin_shufflevector(even[0], even[1], 0, 1, 4, 5);
    out.c[1] = __builtin_shufflevector(odd[0], odd[1], 0, 1, 4, 5);
    out.c[2] = __builtin_shufflevector(even[0], even[1], 2, 3, 6, 7);
    out.c[3] = __builtin_shufflevector(odd[0], odd[1], 2, 3, 6, 7);
#endif
    return out;
}

/* ---- Shapes ------------------------------------------------------------------------------ */

/* Hits of one shape: rows at[k] of columns. */
struct imp_wide_hits {
    double *const *o, *const *d; /* [3] columns: the rays */
    const double *t, *u, *v;     /* as of struct imp_hit */
    const int32_t *prim;
    const int32_t *at; /* [IMP_WIDE_LANES] */
};
struct imp_wide_surface {
    imp_wide3 p, ng;
    imp_wide_frame frame; /* shading frame */
    imp_wide uv[2];
};
/* Points of a light as seen from others, as of struct imp_light_sample. */
struct imp_wide_light {
    imp_wide3 wi, p;
    imp_wide pdf, cos_light;
    imp_wide_truth drawn; /* there is one */
    bool recorded;        /* given: what follows is wanted */
    imp_wide dist, uv[2], located[2];
    int32_t prim[IMP_WIDE_LANES];
};

/* Starts of walks from lights, as of struct imp_emission_sample. */
struct imp_wide_emission {
    imp_wide3 p, d, ng, n; /* n: shading normals */
    imp_wide uv[2], located[2], cos_light, cos_p, pdf_d;
    int32_t prim[IMP_WIDE_LANES];
    double pdf_p;
    imp_wide_truth drawn; /* there is one */
};

struct imp_shape_lanes {
    /* imp_shape_ops.surface; uv only if `uv`. */
    void (*surface)(const struct imp_shape *s, const struct imp_wide_hits *hits, bool uv,
                    struct imp_wide_surface *out);
    /* imp_shape_ops.sample_toward, of shapes with an area for which `lights` is true or NULL.
     * NULL: point by point. */
    void (*sample_toward)(const struct imp_shape *s, const imp_wide3 *ref,
                          const imp_wide u[2], struct imp_wide_light *out);
    bool (*lights)(const struct imp_shape *s);
    /* imp_shape_ops.sample_area, of the same shapes unless they are looked up by triangle: p, ng, n, uv
     * and located. NULL: point by point. */
    void (*sample_area)(const struct imp_shape *s, const imp_wide u[2],
                        struct imp_wide_emission *out);
};
/* NULL: this shape has none. */
const struct imp_shape_lanes *imp__shape_lanes(const struct imp_shape *s);

/* ---- Textures ---------------------------------------------------------------------------- */

/* What the derivative of a value goes to: of lane k the weights [n] times it to as many numbers of its
 * parameter, as of imp_sink.add, from its elements [n] on. */
struct imp_wide_texels {
    imp_wide element[4], weight[4];
    int32_t param[IMP_WIDE_LANES]; /* < 0: to none */
    int8_t channels[IMP_WIDE_LANES];
    int n;
};

struct imp_texture_lanes {
    bool (*covers)(const struct imp_texture *t);
    /* imp_texture_ops.eval in colours, of shapes that are not looked up by triangle; c[3] is
     * anything. */
    void (*eval)(const struct imp_texture *t, const imp_wide uv[2], bool scalar,
                 struct imp_wide_color *value);
    /* imp_texture_ops.scatter, likewise. False, or NULL: it has no such form. */
    bool (*texels)(const struct imp_texture *t, const imp_wide uv[2], bool scalar,
                   struct imp_wide_texels *out);
};
/* NULL: this texture has none. */
const struct imp_texture_lanes *imp__texture_lanes(const struct imp_texture *t);

/* ---- Materials --------------------------------------------------------------------------- */

/* Lobes, as of struct imp_dirs: IMP_SMOOTH, or the index of a delta lobe. */
typedef imp_wide_truth imp_wide_lobe;
static inline imp_wide_lobe imp__wide_smooth(void) { return ~(imp_wide_lobe){0}; }
static inline imp_wide_truth imp__is_smooth(imp_wide_lobe lobe)
{
    return lobe == imp__wide_smooth();
}

struct imp_bsdf_lanes {
    /* This one is covered: its parameters may say it is not. NULL: all are. */
    bool (*covers)(const struct imp_bsdf *b);
    /* imp_bsdf_ops.sample; u as there; derivative as of imp_dirs. Where it is true. *lobe is given
     * as smooth. */
    imp_wide_truth (*sample)(const struct imp_bsdf *b, uint64_t derivative,
                             const struct imp_wide_color *in, const imp_wide3 *wo,
                             const imp_wide u[3], imp_wide3 *wi, imp_wide_lobe *lobe);
    /* imp_bsdf_ops.pdf_eval, of the first `colors` of c. */
    imp_wide (*pdf_eval)(const struct imp_bsdf *b, uint64_t derivative,
                         const struct imp_wide_color *in, const imp_wide3 *wo,
                         const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                         struct imp_wide_color *f);
    /* imp_bsdf_ops.eval_d; d [n_in]. False: this one has none. NULL: none has. Not called where an
     * input is a component of another. */
    bool (*eval_d)(const struct imp_bsdf *b, const struct imp_wide_color *in,
                   const imp_wide3 *wo, const imp_wide3 *wi, const imp_wide_lobe *lobe,
                   int colors, struct imp_wide_color *d);
    /* imp_bsdf_ops.index_ratio, of kinds that have one. */
    imp_wide (*index_ratio)(const struct imp_bsdf *b, const struct imp_wide_color *in,
                            const imp_wide3 *wo, const imp_wide3 *wi,
                            const imp_wide_lobe *lobe);
    /* Its value is the same for all wo on one side of the surface. NULL: it is not. */
    bool (*even)(const struct imp_bsdf *b);
};
/* NULL: this material has none. Those that have one have no emission. */
const struct imp_bsdf_lanes *imp__bsdf_lanes(const struct imp_bsdf *b);

/* ---- Phase functions ---------------------------------------------------------------------- */

/* One value for all colours, which is the density, too; inputs are constants. */
struct imp_phase_lanes {
    imp_wide3 (*sample)(const struct imp_phase *p, const imp_wide3 *wo,
                        const imp_wide u[3]);
    imp_wide (*value)(const struct imp_phase *p, const imp_wide3 *wo,
                      const imp_wide3 *wi);
};
/* NULL: this phase function has none. */
const struct imp_phase_lanes *imp__phase_lanes(const struct imp_phase *p);

/* ---- Emitters ---------------------------------------------------------------------------- */

struct imp_emitter_lanes {
    bool (*covers)(const struct imp_emitter *e); /* NULL: all are */
    /* imp_emitter_ops.sample; out->drawn is given as the lanes that count. */
    void (*sample)(const struct imp_emitter *e, const imp_wide3 *ref, const imp_wide u[2],
                   struct imp_wide_light *out);
    bool far; /* its points are infinitely far */
    /* imp_emitter_ops.pdf, where they are; else NULL. */
    imp_wide (*pdf)(const struct imp_emitter *e, const imp_wide3 *ref,
                    const imp_wide3 *wi);
    /* imp_emitter_ops.sample_emission, where `emits`, or that is NULL. NULL: one by one. */
    void (*emission)(const struct imp_emitter *e, const imp_wide u[4],
                     struct imp_wide_emission *out);
    bool (*emits)(const struct imp_emitter *e);
    /* Radiance in colours that arrives from the directions wi, as decided, of those that are far and
     * not even (walk/core/emitted.h); else NULL. */
    void (*radiance)(const struct imp_emitter *e, const imp_wide3 *wi,
                     struct imp_wide_color *le);
};
/* NULL: this emitter has none. */
const struct imp_emitter_lanes *imp__emitter_lanes(const struct imp_emitter *e);

/* ---- Sensors ----------------------------------------------------------------------------- */

struct imp_wide_ray {
    imp_wide3 o, d;
    imp_wide near, far; /* as of struct imp_sensor_ray */
};
/* Points that see the sensor, as of struct imp_sensor_sample. */
struct imp_wide_seen {
    imp_wide3 p, wo;
    imp_wide px, py, weight;
    imp_wide_truth drawn; /* it may be on the film */
};
struct imp_sensor_lanes {
    bool (*covers)(const struct imp_sensor *s); /* NULL: all are */
    /* imp_sensor_ops.ray, without the numbers of a lens. */
    void (*ray)(const struct imp_sensor *s, imp_wide px, imp_wide py,
                struct imp_wide_ray *out);
    /* imp_sensor_ops.connect from points, without random numbers. */
    void (*connect)(const struct imp_sensor *s, const imp_wide3 *ref,
                    struct imp_wide_seen *out);
};
/* NULL: this sensor has none. */
const struct imp_sensor_lanes *imp__sensor_lanes(const struct imp_sensor *s);

#endif
