/* SPDX-License-Identifier: Apache-2.0
 *
 * The boundary of derivatives by what moves (moved.h): integrals over the edges of the scene, by
 * which light jumps, of three kinds. V is the velocity of the edge, m normal to the plane of edge
 * and line of sight, dl a length along the edge, phi the angle between it and the line.
 *
 *     film     where the camera sees an edge, the picture jumps: with u the velocity of what it sees
 *              there at a fixed film position, and W the film's area over the area across its rays,
 *                  dI = int dl sin(phi) W [L(-m) - L(+m)] m.(V - u)
 *     light    a line from a point y of a light, at distance t_y, passes a silhouette on its way to
 *              a vertex x, at distance t_x behind it; m points away from the edge's faces:
 *                  dI = -int dA_y dl Le cos_y sin(phi)/t_y^2 f W(x) m.(V - V_line),
 *                  V_line = (t_y x' + t_x V_y)/(t_x + t_y): both ends of the line move;
 *              of a point light Le cos_y dA_y is its intensity, of parallel light along d
 *              Le cos_y dA_y/t_y^2 its irradiance and V_line = x' - t_x d'; of a sky that
 *              is not the same from everywhere L dw, and d' = 0
 *     scatter  what a vertex x receives from scattered light, and from a sky of one radiance, jumps
 *              at every edge that it sees; w is a direction from the edge to it:
 *                  dI = int dl dw sin(phi) f W(x) [L(-m) - L(+m)] m.(V - x')
 *
 * The border of a projector's picture is one to what it lights (boundary_border.c).
 *
 * Where bodies pass through each other, the seam is such an edge to the film and to scattered light, with
 * the velocity of the line in which two planes meet (move/edges_seams.h); the seam of a light is one
 * to what it lights, too (boundary_seam.c). Spheres have circles for seams.
 *
 * A sphere has a silhouette from everywhere: the circle on which a line touches it is an edge to the
 * film and to lights, with m its outward normal; of all lines that touch it, by place p, dA, and
 * turn about the normal, psi, dl dw sin(phi) is  dA dpsi/r. Silhouettes of a cylinder are two straight
 * lines; of lines that touch it at the angle psi to its axis it is  sin^2(psi) dA dpsi/r. The rims of
 * disks and cylinders are edges with one face, by their length; the rim on which a disk closes a
 * cylinder is one edge with two.
 *
 * The outline of a bsplinecurve is found at a place of its line, as turns at which a line touches it, two
 * of them or four (move/strand.h); of all lines that touch it, with the surface's curvature k along the
 * line, dl dw sin(phi) is  k dA dpsi.  Its ends are rims with one face, seen from outside alone.
 *
 * A mesh with vertex normals n_s, beside its geometric normal n, has two more places where light
 * jumps. Kernels are those of n_s, and vanish where it turns away from where the light goes:
 *
 *     shading  towards the direction w that is scattered at a point p of the mesh, with the circle
 *              psi of directions across n_s and the jump of what p scatters, lit side first:
 *                  dI = int dA_p dpsi |n.w| W(x) [L(n_s.w > 0) - L(n_s.w < 0)] n_s'.w
 *              of p that slides along w; to the camera the curve n_s.w = 0 on the mesh:
 *                  dI_p = int dl_p [L - L] |n.w| W (n_s'.w + n_s.w')/|grad n_s.w|
 *              with w' = 0 to a point of a meter, and of parallel rays that do not turn
 *     horizon  a ray that leaves p below the plane of its facet begins behind it, and the kernel
 *              does not vanish there; with psi in the facet's plane
 *                  dI = int dA_p dpsi f |n_s.w| W(p) [L(above) - L(below)] n'.w
 *              where what is emitted by a light at y, glued to it, has n'.w + n.(V_y - V)/d.
 *
 * Lines pass masks and null materials straight on (boundary_line.c). Where light samples stop at these
 * (path), what a light sends through one is scattered light; where they pass (volpath), a silhouette
 * counts by what passes outside it less what passes inside.
 *
 * Flat mirrors reflect lines, too (boundary_mirror.c). Lengths, angles and sides of an edge's image are
 * those of the edge, so that all formulas hold from where the image of the viewer stands; V - x' is then
 * what moves against the edge in its own space, also because mirrors do (moved_mirror.h). From an edge to
 * a vertex lines are reflected by chance; to the camera they are aimed, over chains of planes that are
 * drawn. Light samples meet no mirror: what a light sends over one is scattered light.
 *
 * Mirrors that are balls or tubes, and clear glass, turn lines likewise. Area across rays times solid angle
 * times the square of the index of refraction stays as it is along each of them, so that lines from edges
 * have no factor but of what is reflected or let through. From the camera to an edge a ray is looked for
 * (boundary_bent.c), with W by its derivatives. At the limb of such a ball all light is reflected, and goes
 * straight on: there nothing jumps but by the depth of walks, and tints.
 *
 * In a medium x is also a point of it: f |cos| dA is then sigma p dV, p the phase
 * function times the albedo, and L is times what passes from the edge to x. Of what a lamp sends to such a
 * point a part is in `light`, and the rest in `scatter` (imp__glued_part).
 *
 * The border of a medium, of type null and with the outward normal n, has no edges, and is a boundary
 * all over. With D sigma the extinction inside less that outside, D k = D(sigma p), and D g that of what is
 * emitted per length:
 *
 *     film     dI = int dA W [D g - D sigma L] n.(V - u),  L what the camera sees behind the border
 *     light    dI = int dA dA_y Le cos_y/t_y^2 [n.(V - x'') D k W(p) - n.(V - V_line) D sigma f W(x)]
 *     scatter  dI = int dA dw [L n.(V - x'') D k W(p) + (D g - D sigma L) n.(V - x') f W(x)]
 *
 * with p the place on the border, which scatters light, and x'' the velocity of what sees that: points
 * of a medium whose stretch of a ray ends at a border keep their distances (moved.h).
 *
 * While a shutter is open each draw has a time, of its lines and walks, and edges of instances that move in
 * time are where they are then (move/edges_timed.c).
 *
 * x' is the velocity of a vertex that slides, along the chain from the camera. W(x), what the
 * sensor makes of a unit of radiance times projected area that leaves x, is a connection to the
 * camera, or the walk goes on from x by transposed kernels and is connected from there: a walk
 * from an edge is a walk from a light with a sign. Points on edges are chosen by what a pilot has
 * found (move/edge_choice.h); those between a light and what it lights among the silhouettes seen
 * from the light's point. A meter sees edges from a point of its own in each draw, and that point
 * moves with its shape (boundary_meter.c); a sensor of single rays from the point that its ray meets
 * (boundary_ray.c). */
#ifndef IMP_WALK_BOUNDARY_H
#define IMP_WALK_BOUNDARY_H

#include "move/edge_choice.h"
#include "moved.h"

enum imp__boundary_kind { IMP_BOUNDARY_FILM, IMP_BOUNDARY_LIGHT, IMP_BOUNDARY_SCATTER };
#define IMP_BOUNDARY_KINDS 3

/* What has edges that are in no list. */
enum imp__edge_item_kind {
    IMP_ITEM_ROUND, /* silhouettes of spheres, cylinders and curves, rims of disks, cylinders and curves */
    IMP_ITEM_ARC,     /* seams of spheres */
    IMP_ITEM_SHADING, /* of a mesh with vertex normals */
    IMP_ITEM_HORIZON,
    IMP_ITEM_BORDER, /* of a projector's picture, to what it lights; it has no shape */
    IMP_ITEM_SKY,    /* where the camera sees a sky jump; it has no shape */
    IMP_ITEM_MEDIUM  /* the border of a medium, which has no edges */
};
struct imp__edge_item {
    enum imp__edge_item_kind kind;
    int shape;
    int64_t place;                /* the instance that the shape is in; 0: none */
    struct imp_sky_circle circle; /* IMP_ITEM_SKY */
    int sky;                      /* the emitter whose circle or border it is */
    bool glued;                   /* it goes with that */
    const struct imp__arc *arc;   /* IMP_ITEM_ARC */
    /* IMP_ITEM_ROUND: rims of a cylinder that a disk closes, whose edge they are; of such a disk the
     * direction out of the cylinder, at its end; 0: it closes none. */
    bool closed[2];
    imp_v3 wall;
    double *
        until; /* of meshes: [n_triangles + 1] area of the triangles before this one; of curves:
                   [n_segments + 1] length of edges of the segments before this one */
    /* IMP_ITEM_SHADING: triangles in which the shading normal may turn away from the camera, and
     * [n_seen + 1] the perimeters of those before, over distances. */
    size_t n_seen;
    int *seen;
    double *seen_until;
};

struct imp__plane;
struct imp__bender;

struct imp__boundary {
    const struct imp_tracer *tracer;
    struct imp_tracer plain; /* the same for walks of which the values alone count */
    const struct imp__moves *moves;
    const struct imp__edges *edges;
    struct imp__edge_tree tree;
    /* By the pilot: the second moment of what a draw of each kind brings to shifts; all 0: none was made. */
    double moment[IMP_BOUNDARY_KINDS];
    /* By the pilot, of all draws to shifts: the variance that the noise of what light counts adds,
     * however many draws there are. Not above 0: not known, or too small to be seen. */
    double noise;
    struct imp__edge_choice choice[IMP_BOUNDARY_KINDS];
    int n_items;
    struct imp__edge_item *item; /* [n_items] */
    /* [n_items + 2] probability of the items before this one; then that of all of them, and 1:
     * the rest is of edges. */
    double *part[IMP_BOUNDARY_KINDS];
    imp_v3 camera; /* where its rays meet, or the middle of its lens, or of a meter */
    bool parallel; /* its rays are: `camera` is their direction */
    bool rays;     /* they are one, or one for each pixel, and met by no line */
    bool wide;     /* they do not meet: a lens with an aperture, or a meter */
    bool mirrors;  /* a material of the scene is a mirror, in part, or bends light */
    bool bends;    /* it bends light, or is on a curved shape: benders */
    bool
        one_sided; /* a shape is met from outside alone, so that lines have a sense: curves */
    bool passes;                  /* a material of the scene lets light go straight on */
    bool through;                 /* also light samples, and that is no bounce */
    const struct imp_medium *fog; /* which fills the scene; NULL: none */
    bool media;                   /* media end within the scene: moves->borders */
    double size;                  /* of the scene */
    double outside; /* so far from its points is nothing, nor a medium that varies */
    size_t n_planes, cap_planes, n_facets, cap_facets;
    struct imp__plane *plane; /* [n_planes] of flat mirrors: boundary_planes.c */
    int *plane_of;            /* [n_facets] of these; -1: a facet without an area */
    size_t n_benders, n_balls, cap_benders;
    struct imp__bender *bender; /* [n_benders] balls, then meshes: boundary_bender.c */
    int n_lights;
    double *light_cdf; /* [n_emitters] of those that have draws, by power; last is 1 */
    /* [n_emitters] skies that have draws, and of these what a meter does not see by chance. */
    bool *drawn, *drawn_to_meter;
};

/* A velocity on which a flux depends: of a glued point, of what the camera makes of one, or of a
 * light without a shape. */
struct imp__flux_end {
    struct imp__glued x;
    struct imp__velocity bar; /* of a camera or light: bar.v alone */
    bool camera;
    int light; /* emitter, plus 1, whose place or direction it is; 0: none */
    /* The point of a camera's lens; or, from a light at a point, to what goes and turns with it; 0: that is
     * the light itself. */
    imp_v3 eye;
};

/* As imp__mover.shape. */
static inline int imp__flux_end_shape(const struct imp__flux_end *e)
{
    return e->camera  ? IMP_MOVE_CAMERA
           : e->light ? IMP_MOVE_EMITTER(e->light - 1)
                      : e->x.carrier;
}

/* What one draw brings to a film position: L times the sum of bar times velocity over its ends. */
struct imp__flux {
    struct imp__flux *next;
    double px, py;
    imp_spec L; /* by channels, over the density of the draw */
    int n_ends;
    struct imp__flux_end *end; /* [n_ends] */
};

/* IMP_E_UNSUPPORTED, with the name, as imp__moved_allowed, and where edges tear or shapes pass
 * through each other. Ended by imp__boundary_free; edges must have been built of the scene. */
enum imp_status imp__boundary_begin(const struct imp_tracer *tracer,
                                    const struct imp__moves *moves,
                                    const struct imp__edges *edges,
                                    struct imp__boundary *out);
void imp__boundary_free(struct imp__boundary *b);

/* How much light at a film position counts; the sign is of no interest. contrast [contrasts of
 * imp__boundary_learn]: by samples of the noise of that. */
typedef double imp__flux_weight(const void *payload, const struct imp__flux *flux,
                                double *contrast);
#define IMP_FLUX_CONTRASTS 64 /* at most */

/* A pilot chooses where on the edges later draws look: by the second moments of what its own draws
 * bring to all movers, shifts and turns weighed alike. Later draws are independent of it, and have
 * the mean that they had. draws: about how many will follow, of each kind; the pilot has an eighth.
 * weight NULL: all light counts alike. */
enum imp_status imp__boundary_learn(struct imp__boundary *b, int64_t draws,
                                    imp__flux_weight *weight, int contrasts,
                                    const void *payload);

/* One of n equal parts of the list of edges. */
struct imp__stratum {
    int64_t k, n;
};
/* Draw `index` of a kind, which looks there: what it brings, in the arena; the mean over draws of
 * all kinds, summed, is the boundary's part of the derivative. NULL: nothing. *no_memory is set
 * where there is none. */
struct imp__flux *imp__boundary_draw(const struct imp__boundary *b,
                                     struct imp_arena *arena,
                                     enum imp__boundary_kind kind, int64_t index,
                                     struct imp__stratum stratum, bool *no_memory);

/* Along theta_dot: the sum of bar.V; its transpose, times bar, added to theta_bar. */
double imp__flux_velocity(const struct imp__moves *moves, const struct imp__flux *flux,
                          const double *theta_dot);
void imp__flux_bar(const struct imp__moves *moves, const struct imp__flux *flux,
                   double bar, double *theta_bar);

#endif
