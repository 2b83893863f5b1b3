/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of the interior derivative (moved_sweep.c, moved_fades.c, moved_lit.c, moved_pass.c): a walk while its adjoints are swept. */
#ifndef IMP_WALK_MOVED_SWEEP_H
#define IMP_WALK_MOVED_SWEEP_H

#include "moved_chain.h"
#include "moved_sent.h"
#include "walk/core/vertex.h"
#include "walk/media/media_along.h"
#include "walk/media/tracking.h"

/* What the values of vertex k depend on, as adjoints of their logarithms, by lanes. */
struct imp__pieces {
    imp_spec light; /* its light sample */
    imp_spec step;  /* the step, of all light but `met` */
    imp_spec met;   /* emission at its end */
    imp_spec on;    /* what goes on along the step */
    int lit;        /* vertex of that emission: the next one, or behind passes */
    imp_spec all;   /* what the camera sees of it, up to `front` */
};

struct imp__sweep {
    const struct imp_tracer *tracer;
    const struct imp__moves *moves;
    const struct imp_walk *walk;
    struct imp__link_point *at; /* [n] */
    struct imp__pieces *piece;  /* [n] */
    double *theta_bar;
    int first; /* vertex: 1 where the sensor has one before it */
    int front; /* the first vertex at which the camera's ray does not go straight on */
    imp_spec seen;       /* adjoint of the light that reaches it */
    bool meter;          /* the sensor is a surface, which is vertex `first` */
    bool through;        /* light samples pass what lets light go straight on */
    bool fog;            /* a medium fills the scene */
    bool media;          /* media end within it, or vary */
    bool varies;         /* one of them does */
    imp_spec extinction; /* fog: of that */
};

static inline bool imp__sweep_emitted(const struct imp_vertex *v)
{
    return v->d.scatterer != IMP_AT_SKY && v->d.met.emitter >= 0;
}

/* Where the ray to vertex k begins; of the camera's, in front of its near clip nothing fades. */
static inline imp_v3 imp__sweep_begin(const struct imp__sweep *s, int k)
{
    const struct imp_sensor_ray *ray = &s->walk->ray;
    return k > s->first ? s->at[k - 1].x.p : ray->o + ray->d * ray->t_near;
}

/* Where the ray to vertex k comes from, as its direction has it. */
static inline imp_v3 imp__sweep_from(const struct imp__sweep *s, int k)
{
    return k > s->front ? s->at[k - 1].x.p : s->walk->ray.o;
}

/* The light at y along d, of this adjoint; that of d. */
static inline imp_v3 imp__sweep_table_bar(const struct imp__sweep *s,
                                          const struct imp_emitter *e,
                                          const struct imp__glued *y, imp_v3 d,
                                          double bar, const struct imp_carried *carried)
{
    return imp__table_bar(s->moves, e, y, d, bar, s->tracer->scene->lanes, carried,
                          s->theta_bar);
}

/* An adjoint of the logarithm of the light on a line that ends in a medium of this extinction is this one
 * of the line's length there. */
static inline double imp__sweep_length_bar(const struct imp__sweep *s, imp_spec bar,
                                           imp_spec extinction)
{
    return -imp__sum_used(bar * extinction, s->tracer->scene->lanes);
}

/* The same where both ends move, and all between them in proportion, on the line from x to y over media that
 * this track has crossed (NULL: none): of its length, and, of media that vary, of its ends. */
struct imp__line_bar {
    double along;
    imp_v3 from, to;
};
struct imp__line_bar imp__sweep_line_bar(const struct imp__sweep *s, imp_spec bar,
                                         const struct imp_track *track,
                                         const struct imp_carried *carried, imp_v3 x,
                                         imp_v3 y);

/* An adjoint of the logarithm of the light on a line from o along w, in media that vary: what it is to a
 * shift of all of the line, which is returned, and to w; up to this length. */
imp_v3 imp__sweep_shift_bar(const struct imp__sweep *s, imp_spec bar,
                            const struct imp_carried *carried, imp_v3 o, imp_v3 w,
                            double length, imp_v3 *turn);

/* The extinction on the side of a surface that w, which leads there, comes from. */
imp_spec imp__sweep_before(const struct imp__sweep *s, imp_v3 p, imp_v3 ng, imp_v3 w,
                           const struct imp_carried *carried);

/* The ray from a vertex, or from the camera, to vertex k carries light of this adjoint, of which the
 * logarithm changes with its length: by what the surface there moves or, where k floats at the part s
 * of a stretch of length D,  ln(sigma exp(-sigma s D) D). Borders stay. */
static inline double imp__sweep_reach_bar(const struct imp__sweep *s, int k, imp_spec bar)
{
    const struct imp__link_point *x = &s->at[k];
    if (imp_likely(!s->fog && !s->media)) return 0;
    const double along = imp__sweep_length_bar(s, bar, x->extinction);
    if (!x->floats) return along;
    if (x->open) return 0;
    return imp__sum_used(bar, s->tracer->scene->lanes) / x->stretch + x->part * along;
}

/* ---- moved_lit.c ---- */
/* The derivatives of vertex k's kernel towards w, from the places of the chain, which are exact to
 * each other; recorded directions are rounded. False: it is Lambertian without textures, and w and
 * its normal are enough. */
bool imp__sweep_kernel(const struct imp__sweep *s, int k, const struct imp_vertex *v,
                       imp_v3 w, int lobe, struct imp__kernel_d *out);
/* The adjoint of vertex k's kernel towards w from that of its logarithm, by lanes; what it is to the
 * direction to the camera is kept. derived: by imp__sweep_kernel; NULL: Lambertian. */
struct imp__kernel_bar imp__sweep_kernel_bar(struct imp__sweep *s, int k,
                                             const struct imp__kernel_d *derived,
                                             imp_v3 w, imp_spec bar);
/* Light from the point y of a lamp that reaches vertex k, along -w, over media that it has crossed. */
void imp__sweep_lamp_bar(struct imp__sweep *s, int k, struct imp__link_point *y, imp_v3 w,
                         struct imp__kernel_bar *kernel, const struct imp_emitter *e,
                         imp_spec light, const struct imp_track *track,
                         const struct imp_carried *carried);
/* What a sky sends to vertex k along w: the part that is glued to it goes with it, through other
 * media. */
void imp__sweep_sky_bar(const struct imp__sweep *s, int k, int sky, imp_v3 w,
                        const struct imp__kernel_d *d, imp_spec bar,
                        const struct imp_carried *carried);
/* The light sample of vertex k. */
void imp__light_sample_bar(struct imp__sweep *s, int k, const struct imp_vertex *v);

/* Vertex k passes light straight on: its place does not move what follows, but a texture may let
 * pass another part, and a pane as it turns. */
void imp__pass_bar(struct imp__sweep *s, int k, const struct imp_vertex *v);
/* Vertex k is a mirror, or glass, to what follows. */
void imp__mirror_bar(struct imp__sweep *s, int k, const struct imp_vertex *v);

#endif
