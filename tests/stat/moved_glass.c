/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where light goes through rough glass: a point of a pane before a bulb, from
 * all sides, against the formula of Walter et al. (2007) in long double; imp_problem_reverse against
 * central differences in a room with frosted glass, flat and round, through a leaf, and of a lamp across
 * the curve where transmission ends; and what is refused where it ends with a jump. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define FROSTED(ALPHA)                                                                   \
    "<bsdf type='roughdielectric'><float name='alpha' value='" ALPHA "'/></bsdf>"

/* ---- One point --------------------------------------------------------------------------------- */

#define INDEX 1.4L
#define ALPHA .7L

/* Walter's fit. */
static real smith(real z)
{
    const real a = fabsl(z) / (ALPHA * sqrtl(1 - z * z));
    return a >= 1.6L ? 1
                     : (3.535L * a + 2.181L * a * a) / (1 + 2.276L * a + 2.577L * a * a);
}
static real beckmann(real z)
{
    const real z2 = z * z, A = ALPHA * ALPHA;
    return expl((1 - 1 / z2) / A) / ((real)IMP_PI * A * z2 * z2);
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
               DG = beckmann(dot_real(m, n)) * smith(cos_o) * smith(cos_i);
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
             "<float name='alpha' value='%Lg'/><float name='int_ior' value='%Lg'/><float "
             "name='ext_ior' value='1'/></bsdf>"
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
#define PANE_OF(BSDF)                                                                    \
    "<shape type='rectangle' id='pane'><transform name='to_world'><scale x='.5' "        \
    "y='.4'/><rotate x='1' angle='80'/><translate x='.2' y='-2.5' "                      \
    "z='1.4'/></transform>" BSDF "</shape>"
#define PANE PANE_OF(FROSTED(".3"))
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

/* Very rough, so that there is light next to the curve, which is 50 degrees beside the pane's normal;
 * the lamp is there. */
#define BESIDE                                                                           \
    "<shape type='rectangle' id='beside'><transform name='to_world'><scale value='.8'/>" \
    "<lookat origin='1.7,-1.2,1.4' target='.2,-2.5,1.4' up='0,0,1'/></transform>"        \
    "<emitter type='area'><rgb name='radiance' value='5,6,7'/></emitter></shape>"
#define GGX_GLASS                                                                        \
    "<bsdf type='roughdielectric' id='glass'><string name='distribution' value='ggx'/>"  \
    "<float name='alpha' value='.3'/></bsdf>"
#define BURLEY_GLASS(INDEX)                                                              \
    "<bsdf type='principled' id='glass'><float name='spec_trans' value='.5'/>" INDEX     \
    "</bsdf>"

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* By the index, and by what does not move the jump. */
static void inputs_test(const char *what, const char *rest, const char *index,
                        const char *other)
{
    imp_scene *scene = room(rest);
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    tap_ok(imp_problem_activate(p, index) == IMP_E_BIAS &&
               strstr(imp_last_error(ctx), "facets of GGX"),
           "%s, its index # %s", what, imp_last_error(ctx));
    tap_ok(imp_problem_activate(p, other) == IMP_OK, "%s, %s", what, other);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}
static void jumps_test(void)
{
    static const char *const why = "roughdielectric with the distribution beckmann";
    number_refused("glass of GGX", room(DIRECT PANE_OF(GGX_GLASS)), "lamp.pose", why);
    number_refused("glass of principled", room(DIRECT PANE_OF(BURLEY_GLASS(""))),
                   "pane.pose", why);
    inputs_test("glass of GGX", DIRECT PANE_OF(GGX_GLASS), "glass.eta.value",
                "glass.alpha.value");
    inputs_test("glass of principled", DIRECT PANE_OF(BURLEY_GLASS("")),
                "glass.specular.value", "glass.roughness.value");
    inputs_test("glass of principled with eta",
                DIRECT PANE_OF(BURLEY_GLASS("<float name='eta' value='1.4'/>")),
                "glass.eta.value", "glass.spec_trans.value");
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
                               beside[] = {{"beside.pose", 0, .01},
                                           {"beside.pose", 5, .01},
                                           {"pane.pose", 3, .01},
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
    numbers_compare("direct, a lamp beside a pane",
                    room(DIRECT PANE_OF(FROSTED("1.5")) BESIDE), 48, 96, .05, beside);
    jumps_test();
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
