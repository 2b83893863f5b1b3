/* SPDX-License-Identifier: Apache-2.0
 *
 * Points in sets belong to a pixel of the whole film and to the number of a sample: crops,
 * threads, a picture with a time limit, and walks that are shown one by one have the same. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

enum { WIDTH = 20, HEIGHT = 14, N = 3 * WIDTH * HEIGHT };

/* crop: elements of the film that cut it, or "". */
static imp_scene *scene_of(imp_context *ctx, const char *filter, const char *crop)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='4'/></integrator><sensor type='perspective'><float name='fov' "
             "value='40'/><transform name='to_world'><lookat origin='0,0,4' "
             "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
             "name='width' value='%d'/><integer name='height' value='%d'/>%s<rfilter "
             "type='%s'/></film></sensor><shape type='rectangle'><transform "
             "name='to_world'><scale value='3'/><translate z='-1'/></transform><bsdf "
             "type='diffuse' id='wall'><rgb name='reflectance' value='.5,.4,.3'/></bsdf>"
             "</shape><shape type='sphere'><float name='radius' value='.6'/><bsdf "
             "type='roughconductor' id='ball'><float name='alpha' value='.3'/></bsdf>"
             "</shape><shape type='rectangle'><transform name='to_world'><scale "
             "value='.5'/><rotate y='1' angle='180'/><translate x='-1' z='1.5'/>"
             "</transform><emitter type='area'><rgb name='radiance' value='8,7,6'/>"
             "</emitter></shape><emitter type='constant'><rgb name='radiance' "
             "value='.3,.4,.5'/></emitter></scene>",
             WIDTH, HEIGHT, crop, filter);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static struct imp_run run_of(int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    run.points = IMP_POINTS_SOBOL;
    run.spp = spp;
    run.seed = 11;
    return run;
}

static imp_film *picture(imp_context *ctx, const imp_scene *s, const struct imp_run *run)
{
    imp_film *film;
    test_must(ctx, imp_render(s, run, &film));
    return film;
}

static void crops(imp_context *ctx)
{
    enum { X = 5, Y = 3, W = 9, H = 6 };
    char crop[400];
    snprintf(crop, sizeof crop,
             "<integer name='crop_offset_x' value='%d'/><integer name='crop_offset_y' "
             "value='%d'/><integer name='crop_width' value='%d'/><integer "
             "name='crop_height' value='%d'/>",
             X, Y, W, H);
    const struct imp_run run = run_of(70);
    imp_scene *s = scene_of(ctx, "box", ""), *cut = scene_of(ctx, "box", crop);
    imp_film *whole = picture(ctx, s, &run), *part = picture(ctx, cut, &run);
    int same = 0;
    for (int y = 0; y < H; y++) {
        const size_t row = 3 * sizeof(float) * W;
        const int at = 3 * ((Y + y) * WIDTH + X);
        same +=
            !memcmp(imp_film_mean(whole) + at, imp_film_mean(part) + 3 * W * y, row) &&
            !memcmp(imp_film_se(whole) + at, imp_film_se(part) + 3 * W * y, row);
    }
    tap_ok(same == H, "a crop has the bits of the whole picture # %d of %d rows", same,
           H);
    imp_film_destroy(whole);
    imp_film_destroy(part);
    imp_scene_destroy(s);
    imp_scene_destroy(cut);
}

struct answer {
    float mean[N], se[N];
    double g[8], g_se[8];
    struct imp_estimate loss;
};

static void answer(const char *filter, int threads, struct answer *a)
{
    imp_context *ctx = test_context(threads);
    imp_scene *s = scene_of(ctx, filter, "");
    const struct imp_run run = run_of(70);
    imp_film *film = picture(ctx, s, &run);
    struct imp_target t = IMP_TARGET_INIT;
    imp_problem *p;
    memset(a, 0, sizeof *a);
    memcpy(a->mean, imp_film_mean(film), sizeof a->mean);
    memcpy(a->se, imp_film_se(film), sizeof a->se);
    for (int i = 0; i < N; i++) imp_film_mean(film)[i] *= 1.1f;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "wall.*"));
    test_must(ctx, imp_problem_activate(p, "ball.alpha*"));
    t.pixels = imp_film_mean(film);
    t.width = WIDTH, t.height = HEIGHT, t.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_objective(p, NULL, &run, &a->loss, a->g, a->g_se));
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

static void threads(const char *filter)
{
    static struct answer one, three;
    answer(filter, 1, &one);
    answer(filter, 3, &three);
    tap_ok(!memcmp(&one, &three, sizeof one) && one.g_se[0] > 0,
           "%s: the same bits from one thread and from three", filter);
}

/* A pixel is the mean of the walks that imp_walk_describe shows, over four sets of points, whose
 * numbers begin at multiples of 64. */
static void shown(imp_context *ctx)
{
    enum { SPP = 128, SET = 32, X = 8, Y = 6 };
    const struct imp_run run = run_of(SPP);
    imp_scene *s = scene_of(ctx, "box", "");
    imp_film *film = picture(ctx, s, &run);
    double sum[3] = {0}, worst = 0;
    for (int i = 0; i < SPP; i++) {
        double L[3] = {NAN, NAN, NAN};
        char *text;
        const int number = i / SET * 64 + i % SET;
        test_must(ctx, imp_walk_describe(s, &run, X, Y, number, 1, &text));
        const char *at = strstr(text, "\"radiance\":");
        if (at) sscanf(at, "\"radiance\":[%lf,%lf,%lf]", &L[0], &L[1], &L[2]);
        for (int c = 0; c < 3; c++) sum[c] += L[c] / SPP;
        imp_free(ctx, text);
    }
    for (int c = 0; c < 3; c++)
        worst =
            fmax(worst, fabs(sum[c] / imp_film_mean(film)[3 * (Y * WIDTH + X) + c] - 1));
    tap_ok(worst < 1e-6, "a pixel is the mean of its walks, shown one by one # %.1e",
           worst);
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

/* With a time limit passes are shorter, and have the same points. */
static void timed(imp_context *ctx)
{
    struct imp_run run = run_of(192);
    imp_scene *s = scene_of(ctx, "box", "");
    imp_film *planned = picture(ctx, s, &run);
    double worst = 0;
    run.time_limit_s = 1e4;
    imp_film *film = picture(ctx, s, &run);
    for (int i = 0; i < N; i++) {
        const double a = imp_film_mean(film)[i], b = imp_film_mean(planned)[i];
        worst = fmax(worst, fabs(a - b) / b);
    }
    tap_ok(worst < 1e-6,
           "a picture with a time limit has the points of one without # %.1e", worst);
    imp_film_destroy(film);
    imp_film_destroy(planned);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(2);
    crops(ctx);
    threads("box");
    threads("gaussian");
    shown(ctx);
    timed(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
