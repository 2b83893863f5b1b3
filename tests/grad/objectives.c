/* SPDX-License-Identifier: Apache-2.0
 *
 * Objective and gradient of every loss, through every filter, with masks, crops, several
 * sensors, luminance targets, hidden lights and regularisers: the gradient against
 * central differences of objectives of other seeds. What is said to be without bias is
 * held to z alone, at 4 samples per pixel; the rest also to its distance from a long run.
 */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

#define W 6
#define H 5

static imp_context *ctx;

struct setup {
    const char *what, *filter, *film, *integrator;
    int spp;
    enum imp_loss loss;
    bool mask, luminance, two, regularised;
};

static const char xml[] =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
    "value='4'/>%s"
    "</integrator>"
    "<sensor type='perspective'><transform name='to_world'><lookat origin='0,1,4' "
    "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>%s<rfilter "
    "type='%s'/></film>"
    "</sensor>"
    "<sensor type='orthographic'><transform name='to_world'><lookat origin='2,1,3' "
    "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='4'/><integer name='height' value='3'/>"
    "<rfilter type='box'/></film></sensor>"
    "<emitter type='constant' id='sky'><rgb name='radiance' "
    "value='0.3,0.4,0.5'/></emitter>"
    "<shape type='sphere'><bsdf type='roughconductor' id='metal'><float name='alpha' "
    "value='0.4'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='4'/>"
    "<rotate x='1' angle='-90'/><translate y='-1'/></transform>"
    "<bsdf type='diffuse' id='floor'><texture type='bitmap' name='reflectance' id='map'>"
    "<string name='filename' value='%s/textured/waves.png'/></texture></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='1.2'/>"
    "<rotate x='1' angle='90'/><translate y='1.4'/></transform>"
    "<emitter type='area' id='lamp'><rgb name='radiance' "
    "value='1.2,0.9,0.6'/></emitter></shape>"
    "</scene>";

#define SIZE "<integer name='width' value='6'/><integer name='height' value='5'/>"
#define CROP                                                                             \
    "<integer name='width' value='13'/><integer name='height' value='11'/>"              \
    "<integer name='crop_offset_x' value='3'/><integer name='crop_offset_y' value='4'/>" \
    "<integer name='crop_width' value='6'/><integer name='crop_height' value='5'/>"
#define BORDER SIZE "<boolean name='sample_border' value='true'/>"
#define HIDE   "<boolean name='hide_emitters' value='true'/>"

static const struct setup setups[] = {
    {"L2", "box", SIZE, "", 4, .loss = IMP_LOSS_L2},
    {"L2, 2 samples", "box", SIZE, "", 2, .loss = IMP_LOSS_L2},
    {"L2, 67 samples", "box", SIZE, "", 67, .loss = IMP_LOSS_L2},
    {"L2 with a mask", "box", SIZE, "", 4, .loss = IMP_LOSS_L2, .mask = true},
    {"L2 of luminance", "box", SIZE, "", 4, .loss = IMP_LOSS_L2, .luminance = true},
    {"L2, two sensors", "box", SIZE, "", 4, .loss = IMP_LOSS_L2, .two = true},
    {"L2, a crop", "box", CROP, "", 4, .loss = IMP_LOSS_L2},
    {"L2, hidden lights", "box", SIZE, HIDE, 4, .loss = IMP_LOSS_L2},
    {"L2, regularised", "box", SIZE, "", 4, .loss = IMP_LOSS_L2, .regularised = true},
    {"relative L2", "box", SIZE, "", 4, .loss = IMP_LOSS_RELATIVE_L2, .mask = true},
    {"relative L2 of luminance", "box", SIZE, "", 4, .loss = IMP_LOSS_RELATIVE_L2,
     .luminance = true},
    {"L2, tent", "tent", SIZE, "", 64, .loss = IMP_LOSS_L2, .mask = true},
    {"L2, gaussian", "gaussian", SIZE, "", 64, .loss = IMP_LOSS_L2},
    {"L2, gaussian, crop", "gaussian", CROP, "", 64, .loss = IMP_LOSS_L2},
    {"L2, gaussian, border", "gaussian", BORDER, "", 64, .loss = IMP_LOSS_L2},
    {"L2, gaussian, luminance", "gaussian", SIZE, "", 64, .loss = IMP_LOSS_L2,
     .luminance = true},
    {"relative L2, tent", "tent", SIZE, "", 64, .loss = IMP_LOSS_RELATIVE_L2},
    {"L1", "box", SIZE, "", 256, .loss = IMP_LOSS_L1},
    {"log", "box", SIZE, "", 128, .loss = IMP_LOSS_LOG},
    {"log of luminance with a mask", "box", SIZE, "", 128, .loss = IMP_LOSS_LOG,
     .luminance = true, .mask = true},
    {"log, gaussian", "gaussian", SIZE, "", 128, .loss = IMP_LOSS_LOG},
};

static struct imp_estimate estimate(imp_problem *p, const double *x, int spp,
                                    uint64_t seed, double *g, double *se)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate J;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_objective(p, x, &run, &J, g, se));
    return J;
}

static void check(const struct setup *q)
{
    char text[4096];
    float pixels[W * H * 3], other[4 * 3 * 3], weights[W * H];
    snprintf(text, sizeof text, xml, q->integrator, q->film, q->filter, IMP_SCENES);
    imp_scene *s = test_scene_text(ctx, text, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "*");
    const size_t n = imp_problem_n_variables(p);
    const int channels = q->luminance ? 1 : 3;

    /* Darker than the picture by more than noise: L1 has its kink elsewhere. */
    for (int k = 0; k < W * H * 3; k++) pixels[k] = (float)(0.06 + 0.05 * cos(k));
    for (int k = 0; k < 36; k++) other[k] = 0.04f;
    for (int k = 0; k < W * H; k++) weights[k] = k % 3 ? 0.5f * (float)(k % 5) : 0;
    struct imp_target t = IMP_TARGET_INIT;
    t.width = W, t.height = H, t.channels = channels, t.pixels = pixels;
    t.loss = q->loss;
    t.scale = 0.7;
    t.epsilon = 0.05;
    if (q->mask) t.weights = weights;
    test_must(ctx, imp_problem_add_target(p, &t));
    if (q->two) {
        t = (struct imp_target)IMP_TARGET_INIT;
        t.sensor = 1, t.width = 4, t.height = 3, t.channels = 3, t.pixels = other;
        test_must(ctx, imp_problem_add_target(p, &t));
    }
    if (q->regularised) {
        test_must(ctx, imp_problem_add_tikhonov(p, "sky.*", 3, 0));
        test_must(ctx, imp_problem_add_tikhonov(p, "map.*", 0.01, 1));
        test_must(ctx, imp_problem_add_smoothness(p, "map.*", 0.002));
    }

    /* Every number moves, in proportion to itself. */
    double *x = malloc(6 * n * sizeof *x), *v = x + n, *y = v + n, *g = y + n,
           *se = g + n, *mean = se + n;
    imp_problem_get_x(p, x);
    for (size_t i = 0; i < n; i++)
        v[i] = (i % 3 + 1) * 0.3 * fmin(x[i], fmax(1 - x[i], 0.5));
    const double h = 0.1;
    const uint64_t batches = q->spp < 8 ? 256 : 16;
    struct tap_stat fd = {0}, slope = {0}, value = {0};
    memset(mean, 0, n * sizeof *mean);
    double claimed = 0;
    int bias = -1;
    for (uint64_t b = 0; b < batches; b++) {
        struct imp_estimate J[3];
        for (int k = 1; k <= 2; k++) {
            for (size_t i = 0; i < n; i++) y[i] = x[i] + (k == 1 ? h : -h) * v[i];
            J[k] = estimate(p, y, q->spp, 1000 + b, NULL, NULL);
        }
        J[0] = estimate(p, x, q->spp, 5000 + b, g, se);
        double along = 0;
        for (size_t i = 0; i < n; i++) along += g[i] * v[i];
        tap_add(&fd, (J[1].value - J[2].value) / (2 * h));
        tap_add(&slope, along);
        tap_add(&value, J[0].value);
        claimed += J[0].se * J[0].se / (double)batches;
        bias = J[0].bias_order;
    }
    const double both = hypot(tap_se(&fd), tap_se(&slope));
    const double z = fabs(fd.mean - slope.mean) / both;
    static const int orders[] = {0, 0, 1, 2};
    /* Ratios of wide filters leave O(1/N). */
    const bool biased = orders[q->loss] > 0 || strcmp(q->filter, "box") != 0;
    tap_ok(z < 4.5 || (biased && fabs(fd.mean - slope.mean) < 0.02 * fabs(fd.mean)),
           "%s: gradient # %.5g +- %.2g, differences %.5g +- %.2g, z %.2f", q->what,
           slope.mean, tap_se(&slope), fd.mean, tap_se(&fd), z);
    tap_ok(both < 0.1 * fabs(fd.mean), "%s: the test can tell # %.2g", q->what,
           both / fabs(fd.mean));
    tap_ok(bias == orders[q->loss] || (strcmp(q->filter, "box") != 0 && bias <= 1),
           "%s: bias order %d", q->what, bias);

    /* The reported standard error is the spread over seeds (16 of them or 256). */
    const double ratio =
        claimed > 0 ? sqrt(claimed / (double)batches) / tap_se(&value) : 0;
    const double size =
        strcmp(q->filter, "box") == 0 && q->loss <= IMP_LOSS_RELATIVE_L2 ? 2 : 5;
    tap_ok(ratio > 0.5 && ratio < size, "%s: standard error # %.2f of the spread",
           q->what, ratio);

    /* A long run has next to no bias, and nor has the mean of short ones. */
    const struct imp_estimate truth =
        estimate(p, x, q->spp < 32 ? 2048 : 64 * q->spp, 9, g, se);
    double along = 0, along_se = 0;
    for (size_t i = 0; i < n; i++) along += g[i] * v[i], along_se += pow(se[i] * v[i], 2);
    along_se = sqrt(along_se);
    const double off = fabs(truth.value - value.mean),
                 allowed = 4.5 * hypot(truth.se, tap_se(&value));
    tap_ok(off < allowed + (biased ? 0.02 * truth.value : 0),
           "%s: value # %.6g +- %.2g, long run %.6g +- %.2g", q->what, value.mean,
           tap_se(&value), truth.value, truth.se);
    const double g_off = fabs(along - slope.mean);
    tap_ok(g_off < 4.5 * hypot(2 * along_se, tap_se(&slope)) +
                       (biased ? 0.03 * fabs(along) : 0),
           "%s: gradient of a long run # %.5g, %.5g +- %.2g", q->what, along, slope.mean,
           tap_se(&slope));
    free(x);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(1);
    for (size_t k = 0; k < sizeof setups / sizeof *setups; k++) check(&setups[k]);
    imp_context_destroy(ctx);
    return tap_done();
}
