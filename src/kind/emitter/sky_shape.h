/* SPDX-License-Identifier: Apache-2.0
 *
 * Skies whose radiance is a function of the angle Z to the zenith times one of the angle x to
 * the sun, those of CIE S 011 (ciesky.c) and of Perez (perezsky.c):
 *
 *     L = factor g(Z) f(x),   g(Z) = 1 + a exp(b/cos Z),   f(x) = 1 + c (exp(d x) - h) + e cos^2 x
 *
 * Below the horizon they are dark. Drawn by the cosine to the zenith and uniformly over the
 * upper hemisphere, half each. */
#ifndef IMP_KIND_EMITTER_SKY_SHAPE_H
#define IMP_KIND_EMITTER_SKY_SHAPE_H

#include "kind/build.h"
#include "math/vec.h"

/* Diffuse irradiance of level ground, above 0, and direct irradiance across the sun's rays. */
struct imp__perez_weather {
    double diffuse, direct;  /* W m^-2 */
    double extraterrestrial; /* W m^-2 */
};

struct imp__sky_shape {
    imp_v3 axis[3]; /* x, y and z (up) of the sky, world */
    imp_v3 sun;     /* unit, world */
    double n[5], h; /* a to e */
    bool overcast;  /* (1 + 2 cos Z)/3 in place of f g */
    double factor;  /* L at scale 1 over f g */
    /* What follows from the sun's place: a to e and the factor. Set by the kind, with what it needs. */
    void (*fit)(struct imp__sky_shape *s);
    double level; /* of the zenith, or of level ground */
    bool on_ground;
    struct imp__perez_weather weather;
};

extern const struct imp_input_desc imp__sky_shape_inputs[]; /* scale */

/* Axes and sun, from `to_world` and sun_direction or a place and a time. The sun's place in
 * the world, not the sky, is *of_world. */
enum imp_status imp__sky_shape_place(const struct imp_build *b, struct imp__sky_shape *s,
                                     bool *of_world);
/* IMP_E_SCENE if the sun, which `what` needs, is below the horizon. */
enum imp_status imp__sky_shape_by_day(const struct imp_build *b,
                                      const struct imp__sky_shape *s, bool of_world,
                                      const char *what);
/* f g in direction w from the ground; 0 below the horizon, and where the formula is negative. */
double imp__sky_shape_at(const struct imp__sky_shape *s, imp_v3 w);
/* Int f g cos Z dw. */
double imp__sky_shape_horizontal(const struct imp__sky_shape *s);

/* What emitters of this kind have in common but their name and how they are built. */
#define IMP__SKY_SHAPE_OPS                                                               \
    .size = sizeof(struct imp_emitter_ops),                                              \
    .object_size = sizeof(struct imp__sky_shape), .flags = IMP_EMITTER_ENVIRONMENT,      \
    .inputs = imp__sky_shape_inputs, .eval = imp__sky_shape_eval,                        \
    .eval_d = imp__sky_shape_eval_d, .sample = imp__sky_shape_sample,                    \
    .pdf = imp__sky_shape_pdf, .sample_emission = imp__sky_emission_sample,              \
    .pdf_emission = imp__sky_emission_pdf, .jumps = imp__sky_shape_jumps,                \
    .move = imp__sky_shape_move
void imp__sky_shape_eval(const struct imp_emitter *e, const imp_spec *in,
                         const struct imp_emission *x, imp_spec *le);
void imp__sky_shape_eval_d(const struct imp_emitter *e, const imp_spec *in,
                           const struct imp_emission *x, imp_spec *dle);
bool imp__sky_shape_sample(const struct imp_emitter *e, const imp_v3 *ref,
                           const double u[2], struct imp_light_sample *out);
double imp__sky_shape_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                          const imp_v3 *wi, const struct imp_hit *hit,
                          const struct imp_surface *at);
int imp__sky_shape_jumps(const struct imp_emitter *e,
                         struct imp_sky_circle out[IMP_SKY_CIRCLES]);
void imp__sky_shape_move(struct imp_emitter *e, const double to_world[12]);

#endif
