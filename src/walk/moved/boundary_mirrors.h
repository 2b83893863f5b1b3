/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of boundary.h: what draws see in mirrors and through glass, and planes that are mirrors. */
#ifndef IMP_WALK_BOUNDARY_MIRRORS_H
#define IMP_WALK_BOUNDARY_MIRRORS_H

#include "boundary.h"
#include "moved_chain.h"

struct imp__edge_draw;

/* ---- Planes: boundary_planes.c ---- */
/* A flat mirror, or a face of glass. */
struct imp__plane {
    int shape; /* as imp_hit has it */
    int64_t place;
    int64_t facet; /* of the shape's first one: where plane_of has it; -1: it is a disk */
    imp_v3 p, n;   /* a point; unit normal */
    double loose;  /* how far from that the normal may be, in radians */
    size_t first, behind; /* planes of the shape */
    double
        index; /* of glass, behind the normal over in front of it; 0: it bends nothing */
};
/* Planes of the scene that are mirrors. */
enum imp_status imp__mirrors_find(struct imp__boundary *b);

/* ---- Lines over them: boundary_mirror.c ---- */
/* Mirrors on a line, from where it begins on. */
struct imp__mirror {
    struct imp__mirror *on; /* the next one; NULL: none */
    double ratio; /* of glass, as imp__bend has it for what sees the line's beginning */
    struct imp__glued x;
    struct imp_surface at;
};
struct imp__mirrors {
    int n;
    bool bends; /* one of them is curved, or glass: there are no images */
    struct imp__mirror *first, *last;
};
bool imp__mirror_add(struct imp__edge_draw *d, struct imp__mirrors *all,
                     const struct imp_hit *hit, const struct imp_surface *at);
/* What a hit reflects of light along the unit vector w. */
imp_spec imp__edge_reflected(const struct imp__edge_draw *d, const struct imp_hit *hit,
                             const struct imp_surface *at, imp_v3 w);
/* An adjoint of the velocity of the point *p, where the line begins, as what is seen from its other end:
 * what that is to the mirrors, n ends more, and, returned, to the velocity of the image there, *p then. */
imp_v3 imp__mirrors_bar(const struct imp__mirrors *all, imp_v3 *p, imp_v3 bar,
                        struct imp__flux_end *end, int *n_ends);
/* The same of any mirrors and glass, seen from the point `from`: what an adjoint of the point p is to them, and
 * (p, bar) to the image of p, where there is one; else to the place p next to `from` where the ray meets
 * the last of them, and (turn) to the direction of the ray. */
struct imp__seen {
    imp_v3 p, bar, turn;
};
struct imp__seen imp__mirrors_seen(const struct imp__mirrors *all, imp_v3 from, imp_v3 p,
                                   imp_v3 bar, struct imp__flux_end *end, int *n_ends);
/* The same of an adjoint of the direction behind all of them. */
struct imp__seen imp__mirrors_seen_far(const struct imp__mirrors *all, imp_v3 from,
                                       imp_v3 turn, struct imp__flux_end *end,
                                       int *n_ends);
/* What that counts where it is the camera that sees: two ends at most. */
void imp__seen_camera(const struct imp__edge_draw *d, const struct imp__seen *x,
                      struct imp__flux *f);
/* How the camera may see a place: over planes, the first next to the camera, which are drawn with a
 * probability; `eye` is the camera's image, next to the place, or that of the direction of its rays.
 * False: there are no mirrors. */
#define IMP_SIGHT_MAX 64
struct imp__sight {
    int n;
    const struct imp__plane *plane[IMP_SIGHT_MAX];
    double chance;
    imp_v3 eye;
    /* By imp__sight_reach: mirrors from the place on, what they let pass to the camera, from the
     * first one on, how many surfaces that are; the connection of the image. */
    struct imp__mirrors mirrors;
    imp_spec T;
    int bounces;
    struct imp_sensor_sample to;
};
bool imp__sight_draw(const struct imp__edge_draw *d, unsigned dims, struct imp__sight *s);
/* False: it is not seen so. The line to the first mirror is the caller's. */
bool imp__sight_reach(struct imp__edge_draw *d, struct imp__sight *s, imp_v3 p);
/* The same of what is infinitely far along the unit vector w. */
bool imp__sight_reach_far(struct imp__edge_draw *d, struct imp__sight *s, imp_v3 w);

/* The image of a point behind the planes, as the camera sees it. */
imp_v3 imp__sight_image(const struct imp__sight *s, imp_v3 p);
/* Connects a point of the mirror next to the camera, with what passes on the way. */
bool imp__sight_film(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 mirror);

/* ---- Curved mirrors and glass: boundary_bent.c, boundary_bender.c ---- */
/* A line of the direction w that meets the scene, mostly one that meets such a shape: a point of it before all
 * shapes, and one over the density per area across it. */
imp_v3 imp__bent_line(const struct imp__edge_draw *d, imp_v3 w, const double u[2],
                      double *spread);
enum imp_status imp__benders_add(struct imp__boundary *b, const struct imp__body *body);
/* What a hit lets through of power along the unit vector w, and bends, by this ratio (imp__bend). 0: nothing. */
imp_spec imp__edge_refracted(const struct imp__edge_draw *d, const struct imp_hit *hit,
                             const struct imp_surface *at, imp_v3 w, double *ratio);
/* A direction from a place, one over whose density is *spread: an even one, or, where there are balls, in half
 * of all draws towards one. */
imp_v3 imp__bent_direction(const struct imp__edge_draw *d, imp_v3 p, const double u[2],
                           double *spread);
/* Is the draw's point where a line touches such a ball, which reflects all light there? What is seen just inside of its limb is what is
 * seen beside it, times *R, one vertex farther on; a look past it, so far apart, would see some of what
 * lies within. 1: m points into the ball; -1: out of it; 0: it is no such point. */
int imp__edge_limb(const struct imp__edge_draw *d, imp_v3 m, imp_spec *R);

#endif
