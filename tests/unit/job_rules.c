/* SPDX-License-Identifier: Apache-2.0
 *
 * What goes with what (walk/rules): every pair of integrators, sensors, things of a scene and
 * jobs either works, with finite numbers, or is refused by the sentence of a rule; and a
 * feature that this test declares is refused everywhere by its rows alone. */
#include "base/context.h"
#include "base/film.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/rules/features.h"
#include <fnmatch.h>
#include <importon/walks.h>
#include <math.h>

static imp_context *ctx;

/* ---- The table ---------------------------------------------------------------------- */

static void table_is_sound(void)
{
    int twice = 0, used[IMP_FEATURE_COUNT] = {0}, idle = 0;
    for (int a = 0; a < imp__n_job_rules; a++) {
        const struct imp_job_rule *r = &imp__job_rules[a];
        for (int b = 0; b < a; b++) {
            const struct imp_job_rule *o = &imp__job_rules[b];
            twice += r->feature == o->feature && r->with == o->with &&
                     r->other == o->other && r->relation == o->relation;
        }
        used[r->feature] = used[r->other] = 1;
        if (r->with != IMP_HAS_ANY) used[r->with] = 1;
    }
    for (int f = 0; f < IMP_FEATURE_COUNT; f++) {
        idle += !used[f];
        if (!used[f]) printf("# no rule: %s\n", imp__feature_names[f]);
    }
    tap_ok(twice == 0, "%d rules, none of them twice", imp__n_job_rules);
    tap_ok(idle == 0, "%d features, each in a rule", IMP_FEATURE_COUNT);
}

/* Is this message a rule's sentence, with some names put in? */
static int is_a_sentence(const char *message, int *rule)
{
    for (int k = 0; k < imp__n_job_rules; k++) {
        char pattern[IMP_SENTENCE_MAX + 2] = "*";
        size_t n = 1;
        for (const char *c = imp__job_rules[k].sentence; *c; c++) {
            pattern[n++] = *c == '{' ? '*' : *c;
            if (*c == '{') c = strchr(c, '}');
        }
        pattern[n] = 0;
        *rule = k;
        if (fnmatch(pattern, message, 0) == 0) return 1;
    }
    return 0;
}

/* ---- Jobs --------------------------------------------------------------------------- */

enum job { PICTURE, GRADIENT, JACOBIAN, RECORD, PRINT, N_JOBS };
static const char *const job_names[] = {"picture", "gradient", "jacobian", "record",
                                        "print"};

static int all_finite(const double *x, size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (!isfinite(x[k])) return 0;
    return 1;
}

/* The loss of a grey picture, or the derivative of one pixel. */
static enum imp_status problem_run(imp_scene *scene, const struct imp_run *run,
                                   enum job job, int *fine)
{
    imp_problem *p;
    float *pixels = NULL;
    double *g = NULL, *se = NULL;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_estimate e = {0};
    const struct imp_sensor *s = scene->sensors[0];
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    t.width = s->film.crop_w;
    t.height = s->film.crop_h;
    t.channels = scene->channels;
    const size_t n = (size_t)t.width * (size_t)t.height * (size_t)t.channels,
                 n_x = imp_problem_n_variables(p);
    pixels = calloc(n, sizeof *pixels);
    g = calloc(n_x + 1, sizeof *g);
    se = calloc(n_x + 1, sizeof *se);
    float *adjoint = calloc(3 * n, sizeof *adjoint);
    for (size_t k = 0; k < n; k++) pixels[k] = 0.1f;
    for (size_t k = 0; k < 3 * n; k++) adjoint[k] = 1;
    t.pixels = pixels;
    enum imp_status st;
    if (job == GRADIENT) {
        test_must(ctx, imp_problem_add_target(p, &t));
        st = imp_problem_objective(p, NULL, run, &e, g, se);
    } else {
        st = imp_problem_reverse(p, adjoint, run, g, se);
    }
    *fine = st != IMP_OK || (all_finite(g, n_x) && all_finite(se, n_x));
    free(pixels);
    free(adjoint);
    free(g);
    free(se);
    imp_problem_destroy(p);
    return st;
}

static enum imp_status run_job(imp_scene *scene, enum imp_from from, enum job job,
                               int *fine)
{
    struct imp_run run = IMP_RUN_INIT;
    enum imp_status st;
    run.spp = 16;
    run.from = from;
    run.drop_budget = 1;
    *fine = 1;
    if (job == PICTURE) {
        imp_film *film = NULL;
        st = imp_render(scene, &run, &film);
        const size_t n =
            film ? (size_t)film->width * (size_t)film->height * (size_t)film->channels
                 : 0;
        for (size_t k = 0; k < n; k++) *fine &= isfinite(film->mean[k]) != 0;
        imp_film_destroy(film);
    } else if (job == RECORD) {
        imp_walks *w = NULL;
        st = imp_walks_keep(scene, &run, NULL, &w);
        imp_walks_destroy(w);
    } else if (job == PRINT) {
        char *text = NULL;
        st = imp_walk_describe(scene, &run, 0, 0, 0, 0, &text);
        imp_free(ctx, text);
    } else {
        st = problem_run(scene, &run, job, fine);
    }
    return st;
}

/* ---- Scenes ------------------------------------------------------------------------- */

static const char frame[] =
    "<scene version='3.0.0'>%s%s%s"
    "<shape type='rectangle' id='floor'><bsdf type='diffuse' id='paint'/>%s</shape>"
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale value='.3'/>"
    "<rotate x='1' angle='180'/><translate z='1.5'/></transform><emitter type='area'>"
    "<rgb name='radiance' value='3'/></emitter></shape></scene>";
#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='2'/><integer name='height' "      \
    "value='2'/><rfilter type='box'/>"
static const char *const integrators[] = {
    "<integrator type='path'/>",
    "<integrator type='direct'/>",
    "<integrator type='volpath'/>",
    "<integrator type='photons'/>",
    "<integrator type='ptracer'/>",
    "<integrator type='bdpt'/>",
    "<integrator type='stam'/>",
    "<integrator type='path'><boolean name='hide_emitters' value='true'/></integrator>",
    "<integrator type='ptracer'><boolean name='hide_emitters' "
    "value='true'/></integrator>",
    "<integrator type='moment'><integrator type='path'/></integrator>"};
#define LOOK                                                                             \
    "<transform name='to_world'><lookat origin='0,-2,2' target='0,0,0' up='0,0,1'/>"     \
    "</transform>"
static const char *const sensors[] = {
    "<sensor type='perspective' id='eye'>" LOOK FILM "</film></sensor>",
    "<sensor type='perspective' id='eye'>" LOOK FILM
    "<boolean name='sample_border' value='true'/></film></sensor>",
    "<sensor type='perspective' id='eye'>" LOOK FILM
    "<string name='pixel_format' value='rgba'/></film></sensor>",
    "<sensor type='orthographic' id='eye'>" LOOK FILM "</film></sensor>",
    "<sensor type='radiancemeter' id='eye'>" LOOK
    "<film type='hdrfilm'><integer name='width' value='1'/><integer name='height' "
    "value='1'/><rfilter type='box'/></film></sensor>",
    "<shape type='rectangle'><transform name='to_world'><scale value='.2'/><translate "
    "z='.3'/></transform><sensor type='irradiancemeter' id='eye'>" FILM
    "</film></sensor></shape>"};
static const char *const things[] = {
    "",
    "<emitter type='constant'/>",
    "<emitter type='point'><point name='position' x='0' y='0' z='1'/></emitter>",
    "<shape type='sphere'><float name='radius' value='.2'/><bsdf type='null'/>"
    "<medium type='homogeneous' name='interior'><rgb name='sigma_t' value='1,2,3'/>"
    "<rgb name='albedo' value='.5'/></medium></shape>",
    "<shape type='sphere'><float name='radius' value='.2'/><bsdf "
    "type='dielectric'/></shape>",
    "<shape type='rectangle'><bsdf type='mask'><float name='opacity' value='.5'/><bsdf "
    "type='diffuse'/></bsdf></shape>",
    "<emitter type='directional'><vector name='direction' x='0' y='0' z='-1'/>"
    "<float name='sampling_weight' value='0'/></emitter>"};

static imp_scene *scene_of(const char *integrator, const char *sensor, const char *thing)
{
    char xml[8192];
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene = NULL;
    snprintf(xml, sizeof xml, frame, integrator, sensor, thing, "");
    return imp_scene_load_string(ctx, xml, strlen(xml), "pair", &o, &scene) == IMP_OK
               ? scene
               : NULL;
}

/* What is no combination: said when the scene is read, or by one kind. */
static int is_a_limit(enum imp_status st, const char *message)
{
    return st == IMP_E_SCENE || st == IMP_E_BIAS ||
           strstr(message, "collisions were drawn") != NULL;
}

static void pairs_work_or_are_refused(void)
{
    int worked = 0, refused = 0, unread = 0, wrong = 0, seen[256] = {0}, sentences = 0;
    for (size_t i = 0; i < imp_count(integrators); i++)
        for (size_t s = 0; s < imp_count(sensors); s++)
            for (size_t t = 0; t < imp_count(things); t++) {
                imp_scene *scene = scene_of(integrators[i], sensors[s], things[t]);
                if (!scene) {
                    unread++;
                    continue;
                }
                for (int from = IMP_FROM_SCENE; from <= IMP_FROM_LIGHTS; from++)
                    for (int job = 0; job < N_JOBS; job++) {
                        int fine, rule = 0;
                        const enum imp_status st =
                            run_job(scene, (enum imp_from)from, (enum job)job, &fine);
                        const char *message = st == IMP_OK ? "" : imp_last_error(ctx);
                        const int sentence = st && is_a_sentence(message, &rule);
                        if (sentence && !seen[rule]) seen[rule] = 1, sentences++;
                        worked += st == IMP_OK && fine;
                        refused += sentence;
                        if ((st == IMP_OK && fine) || sentence || is_a_limit(st, message))
                            continue;
                        if (wrong++ < 10)
                            printf("# %s | %.40s | %.40s | from %d, %s: %s %s\n",
                                   integrators[i], sensors[s], things[t], from,
                                   job_names[job], imp_status_text(st), message);
                    }
                imp_scene_destroy(scene);
            }
    printf("# %d worked, %d refused by %d sentences, %d scenes not read\n", worked,
           refused, sentences, unread);
    tap_ok(wrong == 0, "every pair works, or is refused by a sentence of the table");
    tap_ok(worked > 1000 && refused > 1000 && sentences >= 14,
           "both are seen often, and by 14 sentences and more");
}

/* ---- A feature that is declared here ------------------------------------------------- */

static bool is_declared(const struct imp_job *job, struct imp_bearer *by)
{
    for (int b = 0; job->scene && b < job->scene->n_bsdfs; b++)
        if (strcmp(job->scene->bsdfs[b]->name, "paint") == 0) {
            *by = (struct imp_bearer){.name = "paint"};
            return true;
        }
    return false;
}
static const struct imp_job_rule rows[] = {
    {IMP_HAS_DECLARED, IMP_HAS_ANY, IMP_EXCLUDES, IMP_HAS_MEDIA, IMP_E_UNSUPPORTED,
     "{its.name} goes with no media, such as '{name}'"},
    {IMP_HAS_DECLARED, IMP_HAS_ANY, IMP_EXCLUDES, IMP_HAS_SURFACE_SENSOR,
     IMP_E_UNSUPPORTED, "{its.name} needs a camera, and {sensor} is none"}};
static const struct imp_declared declared = {is_declared, rows, (int)imp_count(rows)};

static void declared_is_refused(const char *sensor, const char *thing,
                                const char *sentence)
{
    imp_scene *scene = scene_of(integrators[2], sensor, thing);
    ctx->declared = &declared;
    for (int job = 0; job < N_JOBS; job++) {
        int fine;
        const enum imp_status st = run_job(scene, IMP_FROM_SCENE, (enum job)job, &fine);
        if (!sentence)
            tap_ok(st == IMP_OK && fine, "declared, and with all it needs: %s",
                   job_names[job]);
        else
            tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), sentence),
                   "declared: %s is refused: %s", job_names[job], imp_last_error(ctx));
    }
    ctx->declared = NULL;
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    table_is_sound();
    declared_is_refused(sensors[0], things[0], NULL);
    declared_is_refused(sensors[0], things[3], "paint goes with no media");
    declared_is_refused(sensors[5], things[0], "paint needs a camera, and eye is none");
    pairs_work_or_are_refused();
    imp_context_destroy(ctx);
    return tap_done();
}
