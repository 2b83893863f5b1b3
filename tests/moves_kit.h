/* SPDX-License-Identifier: Apache-2.0
 *
 * For tests of derivatives by what moves: a room, and triangles and cameras that are moved in
 * long double, without the velocities that are tested. */
#ifndef IMP_TEST_MOVES_KIT_H
#define IMP_TEST_MOVES_KIT_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "move/moves.h"

/* Materials that both sides of thin things have. */
#define THIN_GREEN                                                                       \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.4,.7,.5'/></bsdf></bsdf>"
#define THIN_PALE                                                                        \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.7,.6,.5'/></bsdf></bsdf>"
#define THIN_RED                                                                         \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.8,.2,.1'/></bsdf></bsdf>"

typedef long double real;

struct triangle {
    real p[3][3];
};

/* Rodrigues about a centre and a shift: numbers n [6], times h. */
static inline void pose_apply(const double *n, imp_v3 centre, real h, real p[3])
{
    real a[3], r[3], out[3], angle = 0, along = 0;
    for (int i = 0; i < 3; i++) {
        r[i] = p[i] - (real)centre[i];
        a[i] = h * n[3 + i];
        angle += a[i] * a[i];
    }
    angle = sqrtl(angle);
    for (int i = 0; i < 3; i++) along += (angle > 0 ? a[i] /= angle : 0) * r[i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        out[i] = r[i] * cosl(angle) + (a[j] * r[l] - a[l] * r[j]) * sinl(angle) +
                 a[i] * along * (1 - cosl(angle)) + h * n[i];
    }
    for (int i = 0; i < 3; i++) p[i] = (real)centre[i] + out[i];
}

/* X + h (e + A (X - c)) of numbers e, A [12]. */
static inline void affine_apply(const double *n, imp_v3 centre, real h, real p[3])
{
    real r[3];
    for (int i = 0; i < 3; i++) r[i] = p[i] - (real)centre[i];
    for (int i = 0; i < 3; i++)
        for (int j = -1; j < 3; j++)
            p[i] += h * (j < 0 ? (real)n[i] : n[3 + 3 * i + j] * r[j]);
}

/* The triangle of a shape where the movers have the numbers h theta. */
static inline struct triangle triangle_moved(const struct imp__moves *m, int shape,
                                             int prim, const double *theta, real h)
{
    const struct imp_triangles *t = &m->scene->shapes[shape]->triangles;
    const uint32_t *index = t->indices + 3 * (size_t)prim;
    struct triangle out;
    for (int c = 0; c < 3; c++) {
        real *p = out.p[c];
        for (int i = 0; i < 3; i++) p[i] = (real)t->positions[3 * (size_t)index[c] + i];
        for (int k = 0; k < m->n_movers; k++) {
            const struct imp__mover *x = &m->mover[k];
            const double *n = theta + x->first;
            if (x->shape != shape) continue;
            if (x->kind == IMP_MOVE_POSE) pose_apply(n, x->centre, h, p);
            if (x->kind == IMP_MOVE_AFFINE) affine_apply(n, x->centre, h, p);
            const bool whole = x->kind == IMP_MOVE_POSE || x->kind == IMP_MOVE_AFFINE;
            for (int i = 0; i < 3 && !whole; i++)
                p[i] += h * (x->kind == IMP_MOVE_SCALE
                                 ? n[0] * (p[i] - (real)x->centre[i])
                                 : (real)n[3 * (size_t)index[c] + (size_t)i]);
        }
    }
    return out;
}

static inline void triangle_point(const struct triangle *t, const double b[3], real p[3])
{
    for (int i = 0; i < 3; i++)
        p[i] = b[0] * t->p[0][i] + b[1] * t->p[1][i] + b[2] * t->p[2][i];
}

/* The unit normal; returns twice the area. */
static inline real triangle_normal(const struct triangle *t, real n[3])
{
    real e[2][3], length = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++) e[k][i] = t->p[k + 1][i] - t->p[0][i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        n[i] = e[0][j] * e[1][l] - e[0][l] * e[1][j];
        length += n[i] * n[i];
    }
    length = sqrtl(length);
    for (int i = 0; i < 3; i++) n[i] /= length;
    return length;
}

static inline real dot_real(const real a[3], const real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Central difference of order four from values at h, -h, 2h, -2h. */
static inline real difference(const real f[4], real h)
{
    return (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h);
}
static const int difference_at[4] = {1, -1, 2, -2};

/* A unit direction in a triangle that is glued to it. */
static inline void triangle_grain(const struct triangle *t, real s[3])
{
    real length = 0;
    for (int i = 0; i < 3; i++) {
        s[i] = 0.3L * (t->p[1][i] - t->p[0][i]) + 0.8L * (t->p[2][i] - t->p[0][i]);
        length += s[i] * s[i];
    }
    for (int i = 0; i < 3; i++) s[i] /= sqrtl(length);
}

/* ---- A room ------------------------------------------------------------------------ */

/* A floor, a wall, a block above the floor and a lamp; a camera of 24 x 16 pixels. NULL: what is
 * there most often. */
struct room_parts {
    const char *rest; /* integrator, sky, more shapes */
    const char
        *grey; /* the inside of <bsdf id='grey'> and its type: of floor and block */
    const char *filter;                /* "type='box'" */
    const char *camera, *block, *lamp; /* what follows in their transforms */
};

#define ROOM_GREY                                                                        \
    "<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"

/* Of its transform's end, and of its filter. */
#define ROOM_CAMERA                                                                      \
    "<sensor type='perspective' id='camera'><float name='fov' value='50'/>"              \
    "<transform name='to_world'><lookat origin='.4,-5.5,2.3' target='0,0,.6' "           \
    "up='0,0,1'/>%s</transform><film type='hdrfilm'><integer name='width' value='24'/>"  \
    "<integer name='height' value='16'/><rfilter %s/></film></sensor>"

static inline void room_write(const struct room_parts *r, char *xml, size_t n)
{
    static const char format[] =
        "<scene version='3.0.0'>%s" ROOM_CAMERA "%s"
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
        "value='3'/></transform><ref id='grey'/></shape>"
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale x='3' "
        "y='1.5'/><rotate x='1' angle='90'/><translate y='3' z='1.5'/></transform>"
        "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
        "value='.3,.5,.7'/></bsdf></bsdf></shape>"
        "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' y='.5' "
        "z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' z='.7'/>%s"
        "</transform><ref id='grey'/></shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "
        "y='.7'/><rotate x='1' angle='170'/><translate x='.9' y='-.2' z='3.2'/>%s"
        "</transform><emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter>"
        "</shape></scene>";
    snprintf(xml, n, format, r->rest ? r->rest : "", r->camera ? r->camera : "",
             r->filter ? r->filter : "type='box'", r->grey ? r->grey : ROOM_GREY,
             r->block ? r->block : "", r->lamp ? r->lamp : "");
}

static inline imp_scene *room_build(imp_context *ctx, const struct room_parts *r)
{
    char xml[16384];
    room_write(r, xml, sizeof xml);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* Three things that move, six numbers each. */
enum { ROOM_NUMBERS = 18 };
static const char *const room_objects[] = {"block", "lamp", "camera"};

static inline imp_scene *room_posed(imp_context *ctx, const struct room_parts *r)
{
    imp_scene *scene = room_build(ctx, r);
    for (int k = 0; k < 3; k++)
        test_must(ctx, imp_scene_add_pose(scene, room_objects[k]));
    return scene;
}
static inline void room_poses_set(imp_context *ctx, imp_scene *scene,
                                  const double numbers[ROOM_NUMBERS])
{
    for (int k = 0; k < 3; k++) {
        char name[32];
        size_t index;
        snprintf(name, sizeof name, "%s.pose", room_objects[k]);
        test_must(ctx, imp_scene_find_param(scene, name, &index));
        test_must(ctx, imp_scene_set_values(scene, index, 6, numbers + 6 * k));
    }
}

/* Parallel rays along -z on a film of 4 x 4, before a sky of radiance 5: pictures of black things are
 * areas. */
static inline imp_scene *before_sky_build(imp_context *ctx, const char *objects)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/>"
             "<sensor type='orthographic'><transform name='to_world'><scale value='2'/>"
             "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film "
             "type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
             "value='16'/><rfilter type='box'/></film></sensor><emitter type='constant'>"
             "<rgb name='radiance' value='5'/></emitter>%s</scene>",
             objects);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#endif
