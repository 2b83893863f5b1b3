/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of boundary.h: what its three kinds of draws share. */
#ifndef IMP_WALK_BOUNDARY_PARTS_H
#define IMP_WALK_BOUNDARY_PARTS_H

#include "boundary_mirrors.h"
#include "scene/instances.h"

/* A ray of a sensor that has one for each pixel, and what it meets. */
struct imp__edge_ray {
    struct imp_hit hit;
    struct imp_surface at;
    imp_v3 o, d;
    double px, py;
    bool meets;
};

struct imp__edge_draw {
    const struct imp__boundary *b;
    bool values; /* of its walks the values alone count: they are not recorded */
    struct imp_arena *arena;
    struct imp_key key;
    const struct imp_waves *waves; /* of all its walks; NULL: colours */
    double time;                   /* of its lines and walks */
    const struct imp__edge_choice *choice;
    const struct imp__edges *edges;    /* those of `edge`: where they are at its time */
    const double *part;                /* of spheres and edges (boundary.h) */
    double u;                          /* by which the point is chosen */
    const struct imp__edge_item *item; /* NULL: an edge */
    double chance;                     /* of the item, or of all edges */
    const struct imp__edge
        *edge;    /* NULL: a sphere or cylinder touched by a line, or a rim */
    bool touches; /* a line that touches a sphere or cylinder */
    bool rim;
    imp_v3 p, along; /* the point, and the unit direction of the edge */
    imp_v3
        out; /* of a line that touches: the outward normal; of a rim: in its surface, away from it */
    double inv_pdf; /* of the point, per length; of a line that touches a sphere */
    double
        spread; /* one over the density of the direction of imp__edge_touched, where it touches nothing */
    int cell;     /* of the choice; behind all cells, of which sphere */
    int prim;     /* of a medium's border, or a curve: where the point is */
    double place; /* of a curve: along its segment */
    struct imp__flux *first, **end;
    bool no_memory;
    double lens
        [4]; /* numbers of the point through which the sensor sees, and of connections */
    imp_v3
        eye; /* that point; of parallel rays their direction; of meters among mirrors */
    struct imp__edge_ray ray; /* where b->rays */
    imp_spec extinction;      /* of the medium; 0: there is none */
    double near; /* walks that look past the edge scatter behind this distance alone */
};

/* Random numbers of a draw; walks that leave it have others. */
enum {
    IMP_EDGE_WHICH,
    IMP_EDGE_LIGHT,
    IMP_EDGE_LIGHT_U,
    IMP_EDGE_LIGHT_V,
    IMP_EDGE_DIR_U,
    IMP_EDGE_DIR_V,
    IMP_EDGE_WALK
};
enum { IMP_EDGE_WALK_U, IMP_EDGE_WALK_V, IMP_EDGE_SURVIVE, IMP_EDGE_WALK_DIMS };
#define IMP_EDGE_LOBE   (1u << 20) /* behind all of those: by which a lobe is chosen */
#define IMP_EDGE_WAVE   (1u << 21) /* and from which wavelengths are drawn */
#define IMP_EDGE_SENSOR (1u << 22) /* four, of a point of a meter or lens */
#define IMP_EDGE_PASS   (1u << 23) /* whether light goes straight on through a mask */
#define IMP_EDGE_PART   (1u << 25) /* which part of a sky whose sun moves */
#define IMP_EDGE_FLIGHT (1u << 24) /* two, of how far it goes in a medium: of each line */
#define IMP_EDGE_MIRROR (1u << 26) /* by which mirrors it is seen: of each connection */
#define IMP_EDGE_BENT                                                                    \
    (1u << 28) /* whether it is seen from a ball that is a mirror or glass */
#define IMP_EDGE_MEDIUM (1u << 27) /* of the point of a medium's border */
#define IMP_EDGE_TIME   (1u << 29)

/* So far beside an edge, per distance to it, it is looked past; rays are traced in float, whose
 * rounding is a tenth of that. */
#define IMP_BESIDE 1e-5
/* So far before the edge a look begins at least, per what it is apart from it. */
#define IMP_SHORT_OF 30
/* Surfaces nearer behind an edge, per size of the scene, are what it stands on. */
#define IMP_CONTACT 2e-5

static inline const struct imp_carried *imp__edge_waves(const struct imp__edge_draw *d)
{
    return d->waves ? &d->waves->carried : NULL;
}

static inline const struct imp_tracer *imp__edge_tracer(const struct imp__edge_draw *d)
{
    return d->values ? &d->b->plain : d->b->tracer;
}

/* Chooses an item, or the edges. False: there is none. */
bool imp__edge_item_choose(struct imp__edge_draw *d);
/* Sets the edge and its point: of all edges, and of spheres' silhouettes from there; of silhouettes of
 * lines from there; of all edges, and lines that touch spheres, along *w. `from` is a direction where
 * lines are parallel. False: none. */
bool imp__edge_any(struct imp__edge_draw *d, imp_v3 from, bool parallel);
bool imp__edge_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel);
bool imp__edge_touched(struct imp__edge_draw *d, imp_v3 *w);
/* The parts of a cylinder's edges: its rims, of which a point is set, or its wall, with its two silhouettes or
 * lines that touch it. Divides d->chance by the probability, and makes d->u uniform again. False: a rim that
 * is the edge of a lid. */
bool imp__edge_tube_part(struct imp__edge_draw *d, const struct imp__tube *c, bool *wall);
/* ---- Curves: boundary_strand.c ---- */
/* The same of an item that is one; its lengths (imp__edge_item.until); imp__edge_merges. */
bool imp__strand_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel);
bool imp__strand_touched(struct imp__edge_draw *d, const double u[2], imp_v3 *w);
enum imp_status imp__strand_lengths(const struct imp__boundary *b,
                                    struct imp__edge_item *item);
bool imp__strand_merges(const struct imp__edge_draw *d, imp_v3 w, double beside);
/* How far from an edge looks along w past it are: from the rim of a curve's end further than from others. */
double imp__strand_apart(const struct imp__edge_draw *d, imp_v3 w, double apart);
/* The velocity of the edge's point, as its surface carries it, or its two surfaces, counts m: the ends
 * of a flux, one or two. */
#define IMP_EDGE_ENDS 2
int imp__edge_ends(const struct imp__edge_draw *d, imp_v3 m, struct imp__flux_end *end);
/* A place beside the edge's point that no rounding hides behind its own sphere. */
imp_v3 imp__edge_clear(const struct imp__edge_draw *d);
/* Where the picture of a cylinder's opening, into which a look along w goes, nears the outline, the wall
 * is thinner than the look is apart from the rim, `beside` it: it sees what is beside the outline, which
 * has draws of its own. */
bool imp__edge_merges(const struct imp__edge_draw *d, imp_v3 w, double beside);
/* ---- Straight lines: boundary_line.c ---- */
/* The material of what was hit, which in an instance may be its own. */
static inline const struct imp_bsdf *imp__hit_bsdf(const struct imp_scene *scene,
                                                   const struct imp_hit *hit)
{
    return imp__shape_bsdf(
        scene, scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)]);
}
struct imp__line {
    imp_spec T;   /* what it lets pass */
    double times; /* one over the probability with which it was chosen */
    int bounces;  /* surfaces that it passes, as max_depth counts them */
    /* By imp__edge_follow alone: mirrors, its direction behind them, and T and bounces from the first
     * one on. */
    struct imp__mirrors mirrors;
    imp_v3 w;
    imp_spec T_mirrored;
    int bounces_mirrored;
};
/* From o along r, up to the part `till` of it. False: nothing comes through. */
bool imp__edge_line(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till,
                    struct imp__line *line);
/* From o + from w along the unit vector w to where light is scattered, through masks and over mirrors by
 * chance, at a surface or (hit->shape -1) in the medium: number `dims` of the draw's lines. hit->t is
 * its distance. False: nowhere. */
bool imp__edge_follow(struct imp__edge_draw *d, imp_v3 o, imp_v3 w, double from,
                      unsigned dims, struct imp_hit *hit, struct imp_surface *at,
                      struct imp__line *line);
/* ---- Media: boundary_media.c ---- */
static inline bool imp__edge_fades(const struct imp__edge_draw *d)
{
    return d->b->fog || d->b->media;
}
/* The medium in which a line from o along w begins. NULL: none. */
const struct imp_medium *imp__edge_medium(const struct imp__edge_draw *d, imp_v3 o,
                                          imp_v3 w);
imp_spec imp__edge_extinction(const struct imp__edge_draw *d, const struct imp_medium *m,
                              imp_v3 p);
/* What one medium lets pass on the line o + t w between these distances. */
imp_spec imp__edge_fading(const struct imp__edge_draw *d, const struct imp_medium *m,
                          imp_v3 o, imp_v3 w, double near, double far);
/* What media let pass from o along the unit vector w over this length; and one over that. */
imp_spec imp__edge_cleared(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                           double length);
imp_spec imp__edge_uncleared(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                             double length);
/* What the first part of the camera's ray, before its near clip, which nothing fades in, would not let
 * pass, of a line from there: one over that. */
imp_spec imp__edge_unclipped(const struct imp__edge_draw *d,
                             const struct imp_sensor_sample *to);
double imp__edge_clip(const struct imp__edge_draw *d, const struct imp_sensor_sample *to);
/* Does light go straight on through what a ray from o along r hit? *T is multiplied by its part. */
bool imp__edge_hit_passes(const struct imp__edge_draw *d, const struct imp_hit *hit,
                          imp_v3 o, imp_v3 r, imp_spec *T);
/* Does light go straight on through what the draw's edge belongs to? */
bool imp__edge_passes(const struct imp__edge_draw *d);
/* The vertex whose emission a light sample could have brought to where a recorded walk begins, and *T
 * what passes on the way. NULL: there is none. */
const struct imp_vertex *imp__walk_met(const struct imp__edge_draw *d,
                                       const struct imp_walk *walk, imp_spec *T);
/* Looks from here along the unit vector w past the draw's point, so far away, in media begin next to it;
 * what passes on the way there (T) is then the caller's factor, which is returned, and else that of the
 * walks. */
imp_spec imp__edge_near(struct imp__edge_draw *d, imp_v3 w, double distance, double apart,
                        imp_spec T);
/* A walk along a ray, behind `before` vertices. hit: what it meets; NULL: that is traced. */
void imp__edge_walk(struct imp__edge_draw *d, const struct imp_sensor_ray *ray,
                    int before, struct imp_hit *hit, struct imp_walk *walk);
/* Is the edge's point hidden from o, r away? Its own faces do not hide it, but a ray along one may meet
 * it anywhere. *T: what passes on the way. */
bool imp__edge_is_hidden(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, imp_spec *T);
/* Is a hit one of this face? */
bool imp__edge_face_hit(const struct imp__edge_draw *d, const struct imp__edge_face *f,
                        const struct imp_hit *hit);
/* A walk from o to a hit of a triangle, behind `before` vertices: the point is as exact as its weights. */
void imp__look_at(struct imp__edge_draw *d, imp_v3 o, struct imp_hit *hit, int before,
                  struct imp_walk *walk);
/* Past the edge's point as imp__edge_beside, from o, or, where `parallel`, in the direction from o to
 * the edge: where its face is what a ray there meets, the walk begins at the face, next to the edge.
 * False: no such face is met, or none is there. */
bool imp__edge_face_look(struct imp__edge_draw *d, imp_v3 o, bool parallel, imp_v3 m,
                         double apart, int before, struct imp_walk *walk);
/* The point at which a look along w past the edge's point aims, on the side that the unit vector m, across
 * both, points to, so far apart: of a face that is narrower there, a point of it. */
imp_v3 imp__edge_beside(const struct imp__edge_draw *d, imp_v3 w, imp_v3 m, double apart);
/* A flux more, with room for n ends. NULL: no memory. */
struct imp__flux *imp__flux_add(struct imp__edge_draw *d, int n);
static inline struct imp__flux_end imp__flux_glued(const struct imp__glued *x, imp_v3 bar)
{
    return (struct imp__flux_end){*x, {.v = bar}, false, 0, {0}};
}
static inline struct imp__flux_end
imp__flux_camera(const struct imp__edge_draw *d, const struct imp__glued *x, imp_v3 bar)
{
    return (struct imp__flux_end){*x, {.v = bar}, true, 0, d->eye};
}
/* A jump by L at a film position, with room for n ends. NULL: nothing jumps, or no memory. */
struct imp__flux *imp__jump_add(struct imp__edge_draw *d,
                                const struct imp_sensor_sample *to, imp_spec L, int n);
/* What the camera sees at a film position. */
imp_spec imp__look_through(struct imp__edge_draw *d, double px, double py);
/* The flux of a jump of the picture where the draw's point is seen; of a circle of a sky, with the
 * point d->p at the distance 1 from the camera. T: what passes on the way there. */
void imp__film_jump(struct imp__edge_draw *d, const struct imp_sensor_sample *to,
                    imp_spec T);
/* What is seen past the edge's point, so far apart, on the side that m points to, from a vertex at a
 * surface, behind `before` vertices. */
void imp__look_past(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 m,
                    double apart, int before, struct imp_walk *walk);
/* What a vertex at a hit sees towards a place, behind `before` vertices. */
void imp__look_from(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 to,
                    int before, struct imp_walk *walk);
/* What arrives along a recorded walk from a vertex x, without the emission of a light that it
 * meets first, which is glued to that (of x in a medium a part), and of skies that are drawn
 * [n_emitters] (NULL: none is). Vertex i of it has number i + before of the whole path. */
struct imp__seen_from {
    int before;
    bool floats;
    double farther; /* from x to where the walk begins */
    bool mirrored;  /* a mirror is between, and no light sample comes that way */
    const bool *drawn;
    const imp_spec *limb
        [2]; /* of imp__jumps: what each of the two looks has behind a limb; NULL: none */
};
imp_spec imp__arrives(const struct imp__boundary *b, const struct imp_walk *walk,
                      struct imp__seen_from x);
/* Vertices behind the edge for which light is known: what jumps by depth [*n], in the arena. NULL:
 * no memory, or nothing jumps. x.before: vertices between x and where the walks begin; more: what is
 * emitted there, for all depths. */
imp_spec *imp__jumps(struct imp__edge_draw *d, const struct imp_walk *lo,
                     const struct imp_walk *hi, imp_spec times, imp_spec more,
                     struct imp__seen_from x, int *n);
/* What a walk brings that leaves out what it has behind a limb (R, NULL: none), one vertex farther on. */
imp_spec imp__arrives_limb(const struct imp__boundary *b, const struct imp_walk *walk,
                           struct imp__seen_from x, const imp_spec *R);

/* What light that arrives at `at` (a hit of this shape) along w brings to the sensor: from there,
 * and over further vertices. Light: radiance times all factors but f W(x). `back`: vertices that
 * follow behind the edge, for max_depth. fill: the ends that are not of the chain, n of them, and
 * L_at, light where the chain has `depth` vertices (NULL: the same for all). slide: what the
 * vertex's velocity counts. */
struct imp__edge_light {
    imp_v3 w;
    imp_spec light;
    const imp_spec *by_depth; /* [n_depths] in place of light; NULL: light */
    int n_depths;
    int behind;   /* segments of the path behind x */
    bool horizon; /* light is per area of x, and not times the cosine there */
    bool border;  /* x is on the border of its medium */
    imp_v3 slide;
    struct imp__flux_end end[1 + IMP_EDGE_ENDS];
    int n_ends;
    const struct imp__flux_end *mirror_end; /* [n_mirror_ends], more of these */
    int n_mirror_ends;
};
void imp__edge_reach(struct imp__edge_draw *d, const struct imp_hit *hit,
                     const struct imp_surface *at, const struct imp__edge_light *light);

/* ---- Borders of media: boundary_media.c, boundary_light.c ---- */
struct imp__border_point {
    const struct imp_medium *inside, *outside;
    imp_spec more; /* extinction inside, less that outside */
    imp_spec glow; /* radiance per length that is emitted inside, less that outside */
};
/* Sets the point d->p of the item's border, with its normal d->out. False: it has none. */
bool imp__border_point(struct imp__edge_draw *d, struct imp__border_point *x);
/* Light that arrives at the border, per area of it: what it scatters there. */
void imp__border_scatter(struct imp__edge_draw *d, const struct imp__border_point *x,
                         struct imp__edge_light light);
void imp__draw_border_film(struct imp__edge_draw *d);
void imp__draw_border_light(struct imp__edge_draw *d);
void imp__draw_border_scatter(struct imp__edge_draw *d);
/* ---- Single rays: boundary_ray.c ---- */
/* The point in the middle of what the sensor looks at, by which edges are chosen; its own centre where it
 * looks at nothing. */
void imp__ray_looked_at(const struct imp__boundary *b, imp_v3 *at);
/* A pixel and its ray, by d->lens. */
void imp__ray_draw(struct imp__edge_draw *d);
void imp__draw_ray(struct imp__edge_draw *d);
/* f cos of light from w at the point that the ray meets. */
imp_spec imp__ray_receives(const struct imp__edge_draw *d, imp_v3 w);
/* A jump by L of the ray's reading. NULL: nothing jumps, or no memory. */
struct imp__flux *imp__ray_jump_add(struct imp__edge_draw *d, imp_spec L);
/* The point slides along the ray: two ends of f, where a shift of the point counts `shift`. */
void imp__ray_point_ends(const struct imp__edge_draw *d, imp_v3 shift,
                         struct imp__flux *f);

/* ---- Seams of lights: boundary_seam.c ---- */
/* Which surface of a seam, 0 or 1, is a light that a walk meets first, at the seam. -1: none. */
int imp__seam_side(const struct imp__edge_draw *d, const struct imp_walk *walk);
/* What such a walk brings, on the side that m points away from, to what lies at a hit along w. */
void imp__seam_emission(struct imp__edge_draw *d, const struct imp_hit *hit,
                        const struct imp_surface *at, const struct imp_walk *walk,
                        imp_v3 m, imp_v3 w, imp_spec times);

/* ---- Meters: boundary_meter.c ---- */
/* Has it a place for each pixel, and no area? */
bool imp__meter_is_points(const struct imp_sensor *s);
/* The point that connections make of the first two numbers. */
void imp__meter_draw(const struct imp_sensor *s, const double u[4],
                     struct imp_surface *at);
/* What the velocity of a meter's point counts. */
struct imp__flux_end imp__meter_end(const struct imp__edge_draw *d,
                                    const struct imp_sensor_sample *to, imp_v3 bar);
/* Where a line along `to` meets the front of a meter with an area, behind the edge and not behind
 * `hit`, what else it meets first (NULL: nothing); and what light that arrives there brings. */
struct imp__meter_point {
    struct imp_surface at;
    double film[2]; /* in [0, 1) */
};
bool imp__meter_meet(const struct imp__edge_draw *d, imp_v3 o, imp_v3 to,
                     const struct imp_hit *hit, struct imp__meter_point *x);
void imp__meter_reach(struct imp__edge_draw *d, const struct imp__meter_point *x,
                      const struct imp__edge_light *light);

/* ---- One draw of each kind ---- */
void imp__boundary_work(struct imp__edge_draw *d, enum imp__boundary_kind kind);
void imp__draw_film(struct imp__edge_draw *d);
void imp__draw_meter(struct imp__edge_draw *d);
/* As the sensor sees it over a chain of mirrors. */
void imp__draw_mirrored(struct imp__edge_draw *d, bool bent);
void imp__draw_light(struct imp__edge_draw *d);
void imp__draw_border(struct imp__edge_draw *d);
/* Radiance, intensity or irradiance of a light with or without a shape along a line, which leaves it at
 * this cosine. */
imp_spec imp__edge_sent(const struct imp__edge_draw *d, int light, double cosine,
                        imp_v3 along);
void imp__draw_scatter(struct imp__edge_draw *d);
void imp__draw_sky_film(struct imp__edge_draw *d);
void imp__draw_sky_mirrored(struct imp__edge_draw *d);
/* Over curved mirrors and glass, as the camera sees it, and what it lights so. */
void imp__draw_sky_bent(struct imp__edge_draw *d);
void imp__draw_sky_scatter(struct imp__edge_draw *d);
/* A direction of the item's circle; sets d->along and d->inv_pdf, per length at the distance 1. */
imp_v3 imp__sky_circle_draw(struct imp__edge_draw *d);
/* How much more arrives from next to w, a point of the item's circle, on the side that m points away
 * from. */
imp_spec imp__sky_jump(const struct imp__edge_draw *d, imp_v3 w, imp_v3 m);
/* ---- boundary_items.c ---- */
/* Edges, by measures of each kind, and items. IMP_E_NOMEM. */
enum imp_status imp__boundary_choices_make(struct imp__boundary *b);
/* ---- Of meshes with vertex normals: boundary_shading.c, boundary_turning.c, boundary_horizon.c ---- */
void imp__draw_shading_film(struct imp__edge_draw *d);
void imp__draw_shading_ray(struct imp__edge_draw *d);
void imp__draw_shading_mirrored(struct imp__edge_draw *d);
void imp__draw_shading_scatter(struct imp__edge_draw *d);
void imp__draw_horizon(struct imp__edge_draw *d);
/* A point of the item's mesh by area, with the draw's number `dim`, d->inv_pdf per area; false: it has
 * none. */
bool imp__edge_item_point(struct imp__edge_draw *d, unsigned dim, struct imp_hit *hit,
                          struct imp_surface *at);
/* The surface of the item's mesh at hit->prim, u and v; sets the rest of the hit. */
void imp__edge_item_surface(const struct imp__edge_draw *d, struct imp_hit *hit,
                            struct imp_surface *at);
/* A point of the curve N.(eye - p) = 0 on a random line; false: the line does not cross it. Sets d->inv_pdf,
 * per length of the curve. mirrored: the eye is an image of the sensor's. */
bool imp__edge_turning_point(struct imp__edge_draw *d, imp_v3 eye, bool mirrored,
                             struct imp_hit *hit);
/* Sets the lists of an item; freed by imp__edge_item_free. */
enum imp_status imp__edge_item_measure(const struct imp__boundary *b,
                                       struct imp__edge_item *item);
void imp__edge_item_free(imp_context *ctx, struct imp__edge_item *item);

#endif
