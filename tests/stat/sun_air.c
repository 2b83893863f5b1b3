/* SPDX-License-Identifier: Apache-2.0
 *
 * What a traced sky is made of: the irradiance of a sun, and optical depths of air by the named laws. */
#include "media_kit.h"
#include "scene/scene.h"

static imp_context *ctx;

/* ---- The sun --------------------------------------------------------------------------- */

/* A floor sees E = Int L cos dw = L pi sin(a)^2 cos of the sun's angle. */
static void irradiance(void)
{
    static const double radius[2] = {.004675, .4}, angle[2] = {0, .9};
    for (int k = 0; k < 4; k++) {
        char text[1024];
        const double a = radius[k / 2], tilt = angle[k % 2];
        double mean[3], se[3];
        snprintf(text, sizeof text,
                 "<scene version='3.0.0'><integrator type='path'/><emitter type='sun' "
                 "id='sun'><vector name='direction' x='%.17g' y='0' z='%.17g'/><rgb "
                 "name='radiance' value='3,2,1'/><float name='radius' value='%g'/>"
                 "</emitter><shape type='rectangle'/><sensor type='perspective'>"
                 "<transform name='to_world'><lookat origin='0,0,2' target='0,0,0' "
                 "up='0,1,0'/></transform><float name='fov' value='20'/><film "
                 "type='hdrfilm'><integer name='width' value='4'/><integer name='height' "
                 "value='4'/></film></sensor></scene>",
                 sin(tilt), -cos(tilt), a);
        imp_scene *s = test_scene_text(ctx, text, IMP_RGB);
        media_mean(ctx, s, 4096, mean, se);
        for (int c = 0; c < 3; c++)
            media_near(mean[c], se[c] + 1e-7 * mean[c],
                       .5 * (3 - c) * pow(sin(a), 2) * cos(tilt), 2e-3 * mean[c],
                       "a floor in the sun");
        imp_scene_destroy(s);
    }
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'/><emitter type='sun' id='sun'>"
        "<vector name='direction' x='0' y='0' z='-1'/></emitter><sensor "
        "type='radiancemeter'><point name='origin' x='0' y='0' z='0'/><vector "
        "name='direction' x='0.00467' y='0' z='1'/><film type='hdrfilm'><integer "
        "name='width' value='1'/><integer name='height' "
        "value='1'/></film></sensor><sensor "
        "type='radiancemeter'><point name='origin' x='0' y='0' z='0'/><vector "
        "name='direction' x='0.00468' y='0' z='1'/><film type='hdrfilm'><integer "
        "name='width' value='1'/><integer name='height' value='1'/></film></sensor>"
        "</scene>",
        IMP_MONO);
    struct imp_run run = IMP_RUN_INIT;
    double inside[3], outside[3], se[3];
    run.spp = 16;
    media_mean_run(ctx, s, &run, inside, se, IMP_DROP_NONE);
    run.sensor = 1;
    media_mean_run(ctx, s, &run, outside, se, IMP_DROP_NONE);
    tap_ok(inside[0] == 1 && outside[0] == 0, "its edge is at .004675 rad");

    struct imp_param_info info = {.size = sizeof info};
    size_t index;
    test_must(ctx, imp_scene_find_param(s, "sun.radius.value", &index));
    test_must(ctx, imp_scene_get_param(s, index, &info));
    tap_ok(!(info.flags & IMP_PARAM_DIFFERENTIABLE),
           "its radius can be set, and has no derivative");
    imp_scene_destroy(s);
}

/* ---- The laws -------------------------------------------------------------------------- */

/* Extinction of the air of scenes/sky.xml at a height, at four wavelengths. */
static imp_spec air_at(const imp_scene *s, const double nm[4], double h)
{
    const struct imp_medium *m = s->media[0];
    struct imp_carried carried = {.n = 4, .nm = {nm[0], nm[1], nm[2], nm[3]}};
    const struct imp_texcoord at = {.p = {0, h, 0, 0}, .carried = &carried};
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    return c.extinction;
}
static void laws(void)
{
    /* Hansen and Travis's numbers, and those of the constant of graphics. */
    static const double nm[4] = {400, 450, 550, 700};
    static const double tau[2][4] = {{.36007, .22129, .09728, .03653},
                                     {.387694, .242033, .108463, .041336}};
    for (int law = 0; law < 2; law++) {
        imp_scene *s = test_scene(ctx, "sky.xml", IMP_SPECTRAL, law ? "law=power" : NULL);
        imp_spec sum = {0};
        enum { N = 4000 };
        for (int i = 0; i < N; i++) /* to 80 km: exp(-10) is not there */
            sum += air_at(s, nm, (i + .5) * 80. / N) * (80. / N);
        for (int k = 0; k < 4; k++) {
            char what[80];
            snprintf(what, sizeof what, "optical depth at %g nm by %s", nm[k],
                     law ? "power" : "hansen_travis");
            tap_near(sum[k] / (1 - exp(-10.)), tau[law][k], 1e-4, 5e-6, what);
        }
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(0);
    irradiance();
    laws();
    imp_context_destroy(ctx);
    return tap_done();
}
