/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where light goes through rough glass: a point of a pane before a bulb, from
 * all sides, against the formula of Walter et al. (2007) in long double; imp_problem_reverse against
 * central differences in a room with frosted glass, flat and round, and through a leaf. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define FROSTED(ALPHA)                                                                   \
    "<bsdf type='roughdielectric'><float name='alpha' value='" ALPHA                     \
    "'/><string name='distribution' value='ggx'/></bsdf>"

/* ---- One point --------------------------------------------------------------------------------- */

#define INDEX 1.4L
#define ALPHA .35L

static real smith(real z)
{
    const real tan2 = (1 - z * z) / (z * z);
    return 2 / (1 + sqrtl(1 + ALPHA * ALPHA * tan2));
}
static real ggx(real z)
{
    const real k = z * z * (ALPHA * ALPHA - 1) + 1;
    return ALPHA * ALPHA / ((real)IMP_PI * k * k);
}
/* Unpolarised, from the cosine c > 0 into a medium of the relative index e. */
static real fresnel(real c, real e)
{
    const real square = 1 - (1 - c * c) / (e * e);
    if (square <= 0) return 1;
    const real t = sqrtl(square), s = (c - e * t) / (c + e * t),
               p = (e * c - t) / (e * c + t);
    return (s * s + p * p) / 2;
}

static void unit(real v[3])
{
    const real l = sqrtl(dot_real(v, v));
    for (int i = 0; i < 3; i++) v[i] /= l;
}

/* The radiance along d that reaches the eye of what a bulb of the intensity 1 at p sends over the
 * glass in the plane through q with the normal n. */
static real seen(const real eye[3], const real d[3], const real p[3], const real q[3],
                 const real n[3])
{
    real x[3], wo[3], wi[3], m[3], r[3];
    for (int i = 0; i < 3; i++) r[i] = q[i] - eye[i];
    const real t = dot_real(r, n) / dot_real(d, n);
    for (int i = 0; i < 3; i++) {
        x[i] = eye[i] + t * d[i];
        wo[i] = -d[i];
        wi[i] = p[i] - x[i];
    }
    const real apart = dot_real(wi, wi);
    unit(wi);
    const real side = dot_real(wo, n) > 0 ? 1 : -1, cos_o = side * dot_real(wo, n),
               cos_i = side * dot_real(wi, n), e = side > 0 ? INDEX : 1 / INDEX,
               by = cos_i > 0 ? 1 : e;
    for (int i = 0; i < 3; i++) m[i] = wo[i] + by * wi[i];
    const real h2 = dot_real(m, m);
    unit(m);
    const real up = dot_real(m, n) * side > 0 ? 1 : -1;
    for (int i = 0; i < 3; i++) m[i] *= up;
    const real om = dot_real(wo, m), im = dot_real(wi, m), F = fresnel(om, e),
               DG = ggx(dot_real(m, n)) * smith(cos_o) * smith(cos_i);
    if (cos_i > 0) return F * DG / (4 * cos_o) / apart;
    return (1 - F) * DG * om * -im / (cos_o * h2) / apart;
}

/* By numbers of the pane's pose and of the bulb's place, times h. */
static real seen_moved(const double eye[3], const double at[3], const double bulb[3],
                       const double pose[6], const double shift[3], real h)
{
    real d[3], p[3], o[3], q[3] = {0, 0, 0}, n[3] = {0, 0, 1};
    pose_apply(pose, (imp_v3){0}, h, q);
    pose_apply(pose, (imp_v3){0}, h, n);
    for (int i = 0; i < 3; i++) {
        n[i] -= q[i];
        o[i] = eye[i];
        d[i] = (real)at[i] - eye[i];
        p[i] = bulb[i] + h * shift[i];
    }
    unit(d);
    return seen(o, d, p, q, n);
}

/* The pane is the square [-2, 2]^2 of the plane z = 0. */
static void point_test(const char *what, const double eye[3], const double bulb[3])
{
    static const double at[3] = {.2, -.1, 0}, still[6] = {0};
    static const char *const names[] = {"pane.pose", "bulb.position"};
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>" DIRECT
             "<sensor type='radiancemeter'><vector name='origin' value='%g,%g,%g'/>"
             "<vector name='direction' value='%g,%g,%g'/><film type='hdrfilm'><integer "
             "name='width' value='1'/><integer name='height' value='1'/><rfilter "
             "type='box'/></film></sensor><shape type='rectangle' id='pane'><transform "
             "name='to_world'><scale value='2'/></transform><bsdf type='roughdielectric'>"
             "<float name='alpha' value='%Lg'/><string name='distribution' value='ggx'/>"
             "<float name='int_ior' value='%Lg'/><float name='ext_ior' value='1'/></bsdf>"
             "</shape><emitter type='point' id='bulb'><point name='position' "
             "value='%g,%g,%g'/><spectrum name='intensity' value='1'/></emitter></scene>",
             eye[0], eye[1], eye[2], at[0] - eye[0], at[1] - eye[1], at[2] - eye[2],
             ALPHA, INDEX, bulb[0], bulb[1], bulb[2]);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    for (int k = 0; k < 2; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    for (int k = 0; k < 2; k++) {
        struct tap_stat g[MEAN_NUMBERS_MAX] = {{0, 0, 0}};
        double ref[6], most = 0, worst = 0;
        const int n = k == 0 ? 6 : 3;
        mean_gradient(ctx, scene, names[k], 4, 1, g);
        for (int i = 0; i < n; i++) {
            const real h = 1e-4L;
            double one[6] = {0};
            real f[4];
            one[i] = 1;
            for (int j = 0; j < 4; j++)
                f[j] = seen_moved(eye, at, bulb, k == 0 ? one : still,
                                  k == 0 ? still : one, h * difference_at[j]);
            ref[i] = (double)difference(f, h);
            most = fmax(most, fabs(ref[i]));
        }
        for (int i = 0; i < n; i++) worst = fmax(worst, fabs(g[i].mean - ref[i]) / most);
        tap_ok(most > 0 && worst < 1e-5, "%s, %s # largest %.5g, off by %.1e of it", what,
               names[k], most, worst);
    }
    imp_scene_destroy(scene);
}

/* ---- Rooms ------------------------------------------------------------------------------------- */

/* Before the camera, smaller than its picture; beside the block, under the lamp. */
#define PANE                                                                             \
    "<shape type='rectangle' id='pane'><transform name='to_world'><scale x='.5' "        \
    "y='.4'/><rotate x='1' angle='80'/><translate x='.2' y='-2.5' "                      \
    "z='1.4'/></transform>" FROSTED(".3") "</shape>"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><point name='center' value='1,-.6,.7'/><float "      \
    "name='radius' value='.5'/>" FROSTED(".3") "</shape>"
/* A sheet that lets light through on its way from the lamp. */
#define LEAF                                                                             \
    "<shape type='rectangle' id='leaf'><transform name='to_world'><scale x='.5' "        \
    "y='.4'/><rotate y='1' angle='15'/><translate x='.8' y='-.4' z='1.6'/></transform>"  \
    "<bsdf type='principledthin'><rgb name='base_color' value='.6,.7,.2'/><float "       \
    "name='roughness' value='.6'/><float name='diff_trans' value='.9'/></bsdf></shape>"
#define CUBE                                                                             \
    "<shape type='cube' id='cube'><transform name='to_world'><scale value='.35'/>"       \
    "<rotate z='1' angle='30'/><translate x='1.2' y='-.8' z='.6'/></transform>" FROSTED( \
        ".4") "</shape>"

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const double above[3] = {.3, -1, 2}, below[3] = {-.4, .6, -1.5},
                        aside[3] = {1.2, .7, 1.1}, deep[3] = {.5, .9, -2};
    static const struct number pane[] = {{"pane.pose", 0, .008},
                                         {"pane.pose", 3, .012},
                                         {"camera.pose", 4, .004},
                                         {NULL, 0, 0}},
                               cube[] = {{"cube.pose", 0, .012},
                                         {"cube.pose", 5, .02},
                                         {"lamp.pose", 0, .02},
                                         {NULL, 0, 0}},
                               leaf[] = {{"leaf.pose", 3, .02},
                                         {"leaf.pose", 2, .01},
                                         {"lamp.pose", 1, .02},
                                         {NULL, 0, 0}},
                               ball[] = {{"ball.center", 0, .012},
                                         {"ball.radius", 0, .012},
                                         {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    point_test("through a pane", above, below);
    point_test("from behind a pane", below, above);
    point_test("in a pane", above, aside);
    point_test("in a pane from behind", below, deep);
    numbers_compare("direct, a pane", room(DIRECT PANE), 48, 192, .05, pane);
    numbers_compare("direct, a leaf", room(DIRECT LEAF), 48, 96, .05, leaf);
    if (is_long) {
        numbers_compare("direct, a pane and a sky", room(DIRECT SKY PANE), 512, 1024, .03,
                        pane);
        numbers_compare("path, a cube", room(PATH CUBE), 1024, 1024, .1, cube);
        numbers_compare("path, a ball", room(PATH BALL), 1024, 1024, .1, ball);
    }
    imp_context_destroy(ctx);
    return tap_done();
}
