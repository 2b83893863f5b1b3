/* SPDX-License-Identifier: Apache-2.0
 *
 * Chains of curved mirrors and glass between the camera and a place, and rays that are roots
 * (boundary_bent.c, boundary_bent_draw.c, boundary_root.c). */
#ifndef IMP_WALK_BENT_CHAIN_H
#define IMP_WALK_BENT_CHAIN_H

#include "boundary_parts.h"

/* A ball or cylinder that is a mirror or of glass, or a disk or mesh of glass. */
enum imp__bender_kind {
    IMP_BENDER_BALL,
    IMP_BENDER_TUBE,
    IMP_BENDER_DISK,
    IMP_BENDER_MESH
};
struct imp__bender {
    enum imp__bender_kind kind;
    int shape;
    int64_t place;
    struct imp_round round; /* of a ball; of others a ball around it */
    double index;           /* of a ball of glass, inside over outside; 0: another */
    struct imp__tube tube;
    int n_facets; /* of a mesh */
};

struct imp__bent_surface {
    imp_v3 p, n;   /* of a plane a point and its normal; of a ball its centre */
    imp_v3 axis;   /* of a cylinder, p a point of it; 0: it is none */
    double radius; /* 0: a plane */
    bool inside;   /* the ray meets it from inside */
    double ratio;  /* as imp__bend has it */
    int plane;     /* its number, from 1 on; 0: it is none */
    int shape;
    int64_t place;
    imp_v3 q, normal; /* where it is met; the normal there */
};
struct imp__bent_chain {
    int n;
    struct imp__bent_surface at[IMP_SIGHT_MAX];
};
/* A ray and its derivatives by two numbers. */
struct imp__bent_ray {
    imp_v3 o, w, o_d[2], w_d[2];
};

/* What the ray is to meet: a place, or a direction, or, where radius > 0, a ball that it touches, at the plane across
 * `across` through its centre; of a cylinder about the axis through p, at that plane through p. */
struct imp__bent_goal {
    imp_v3 p, across, axis;
    double radius;
    bool far;      /* `across` is the unit direction that is wanted behind all surfaces */
    bool on_glass; /* it lies on flat glass, or a rim of glass, and is seen from within */
};
struct imp__bent_root {
    imp_v3 from; /* the direction at the eye, or where a parallel ray begins */
    struct imp__bent_chain chain;
    imp_v3 p, w;  /* where the goal is met, along w */
    double det;   /* of dp/dw across w; of a direction, of that by the one at the eye */
    imp_v3 along; /* of lines that touch: the direction of the curve of all these */
};

/* What a draw has found, of the key that these dimensions make. */
struct imp__bent_found {
    unsigned dims;
    struct imp__bent_goal goal;
    struct imp__bent_root root;
    double draws; /* one over the probability to find it; 0: not known */
};
/* How the camera may see a place over curved mirrors and through glass; as imp__sight_draw and
 * imp__sight_reach at once. s->chance has still to be divided by imp__bent_draws. */
bool imp__bent_reach(struct imp__edge_draw *d, unsigned dims, imp_v3 p,
                     struct imp__sight *s, struct imp__bent_found *x);
/* The same of a point of an edge, as imp__edge_any chooses it, or of a ball or cylinder that is touched by
 * what the camera sees. */
bool imp__bent_any(struct imp__edge_draw *d, struct imp__sight *s,
                   struct imp__bent_found *x);
/* The same of what is infinitely far along the unit vector w. */
bool imp__bent_reach_far(struct imp__edge_draw *d, imp_v3 w, struct imp__sight *s,
                         struct imp__bent_found *x);
/* One over the probability that a draw finds this, in the mean. It takes long: for what counts. */
double imp__bent_draws(const struct imp__edge_draw *d, const struct imp__bent_found *x);

/* ---- Draws of chains: boundary_bent_draw.c ---- */
/* Random numbers of a draw: of the ball, two of the point on it, of planes before it; then for each
 * surface; and of roots. */
#define IMP_BENT_PASSES 256 /* surfaces in all */
enum {
    IMP_BENT_WHICH,
    IMP_BENT_POINT_U,
    IMP_BENT_POINT_V,
    IMP_BENT_PLANES,
    IMP_BENT_FIRST = IMP_BENT_PLANES + 2 + 2 * IMP_SIGHT_MAX,
    IMP_BENT_KEEP = IMP_BENT_FIRST + 3 * IMP_BENT_PASSES,
    IMP_BENT_GO_ON,
    IMP_BENT_WHICH_WAY
};
/* A root that a draw finds. of: it is to be this one; NULL: any. False: none. */
bool imp__bent_draw(const struct imp__edge_draw *d, struct imp_key key,
                    const struct imp__bent_goal *goal, const struct imp__bent_root *of,
                    struct imp__bent_root *x);

static inline imp_v3 imp__across_axis(imp_v3 axis, imp_v3 r)
{
    return r - axis * imp__dot(axis, r);
}
/* The ray of a direction at the eye, or that begins at a place. */
struct imp__bent_ray imp__bent_begin(const struct imp__edge_draw *d, imp_v3 from);
/* Newton's method, from x->from over x->chain, by steps that bring the ray nearer to the goal. False: it ends
 * nowhere. */
bool imp__bent_find(const struct imp__edge_draw *d, const struct imp__bent_goal *goal,
                    struct imp__bent_root *x);
/* How often light is reflected inside, up to `most`: m with the chance 1/((m + 1)(m + 2)), the last with the
 * rest. */
static inline int imp__inside_draw(double u, int most, double *chance)
{
    const int m = imp_min((int)(imp_min(1 / (1 - u), 1e6)) - 1, most);
    *chance *= m < most ? 1 / ((m + 1.0) * (m + 2.0)) : 1 / (m + 1.0);
    return m;
}
/* Plane k of a flat mirror or of glass, and which ones its shape has: how many, from which on. */
struct imp__plane_range {
    size_t first, n;
    double index; /* behind its normal over in front of it; 0: it bends nothing */
};
/* The index of what is behind a hit's normal over what is in front of it; 0: it bends nothing. */
double imp__glass_index(const struct imp_scene *scene, const struct imp__body *body);
struct imp__plane_range imp__plane_surface(const struct imp__boundary *b, size_t k,
                                           struct imp__bent_surface *out);
/* The number of the plane that has been hit, from 1 on; 0: it is none. */
int imp__plane_number(const struct imp__boundary *b, const struct imp_hit *hit);
/* Is it a chain of a plane that bends and planes that reflect behind it? Such roots are known; of places within
 * glass. */
bool imp__flat_chain(const struct imp__bent_goal *goal, const struct imp__bent_chain *c);
bool imp__flat_draw(const struct imp__edge_draw *d, struct imp_key key,
                    const struct imp__bent_goal *goal, struct imp__bent_root *x,
                    double *draws);
/* Is it a chain over one ball, of which all roots are known? */
bool imp__round_chain(const struct imp__edge_draw *d, const struct imp__bent_goal *goal,
                      const struct imp__bent_chain *c);
/* A root over such a chain, and one over the probability to draw it. False: none. */
bool imp__round_draw(const struct imp__edge_draw *d, struct imp_key key,
                     const struct imp__bent_goal *goal, struct imp__bent_root *x,
                     double *draws);
bool imp__bent_same(const struct imp__edge_draw *d, const struct imp__bent_root *a,
                    const struct imp__bent_root *b);

#endif
