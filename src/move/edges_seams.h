/* SPDX-License-Identifier: Apache-2.0
 *
 * Seams: where triangles pass through each other, of different bodies or of a mesh that passes through
 * itself. A seam is an edge with four
 * faces, two halves of each triangle, and is never a silhouette: on each side of a line through it
 * lies a half of each. It moves as the line in which two moving planes meet: with V_1, V_2 what the
 * triangles' points there have, d its direction and i_1, i_2 across it in the triangles,
 *
 *     n_1.V = n_1.V_1,  n_2.V = n_2.V_2:   V = i_2 n_1.V_1/(n_1.i_2) + i_1 n_2.V_2/(n_2.i_1),
 *
 * up to shifts along d, which count nothing. */
#ifndef IMP_MOVE_EDGES_SEAMS_H
#define IMP_MOVE_EDGES_SEAMS_H

#include "edges.h"

/* An edge that lies along a surface, nearer to it than this part of the scene's size, touches it, on
 * whichever side: rays past edges are that exact (walk/moved/boundary_parts.h). */
#define IMP_SEAM_CONTACT 2e-5

struct imp__seam {
    imp_v3 a, b;
    struct imp__edge_face face[4]; /* halves of one triangle, then of the other */
    /* An edge of the first body, which is in the list, lies in the second one, and its first two
     * faces are on both sides of that: it is no seam, and what lies there may have no motion. */
    bool laid;
};
struct imp__seams {
    imp_context *ctx;
    size_t n, cap;
    struct imp__seam *seam;
};

/* All seams of bodies made of triangles. near: lengths below are none. */
enum imp_status imp__seams_find(const struct imp_scene *scene,
                                const struct imp__body *body, size_t n_bodies,
                                double near, double size, struct imp__seams *out);
void imp__seams_free(struct imp__seams *seams);

/* Two faces of one body in one plane, on both sides of an edge: nothing is there, unless a texture
 * has a seam, or shading normals have one. */
bool imp__edge_is_inner(const struct imp_scene *scene, const struct imp__edge_face f[2]);
/* Are four faces two such pairs, in planes that cross? Then they are sorted as those of a seam. */
bool imp__edge_is_crossing(const struct imp_scene *scene, struct imp__edge_face f[4]);

#endif
