/* SPDX-License-Identifier: Apache-2.0
 *
 * Options of a problem (targets, losses, regularisers, active parameters) and the
 * problem made from them. */
#include "problem_options.h"

#include "photograph.h"
#include "picture_files.h"
#include "settings.h"

#include <importon/clip.h>
#include <stdlib.h>
#include <string.h>

struct problem_options problem_options;

static const char *const loss_words[] = {"l2", "relative", "l1", "log", NULL};
static const enum imp_loss losses[] = {IMP_LOSS_L2, IMP_LOSS_RELATIVE_L2, IMP_LOSS_L1,
                                       IMP_LOSS_LOG};

const struct arg_option options_params[] = {
    {ARG_LIST | ARG_REPLAYS, 'p', "param", "GLOB",
     "active parameters: a name or a pattern (default '*'); of geometry NAME.pose, "
     "scale, to_world, "
     "vertex_positions, control_points, center, radius, p0, p1, x_fov, position, "
     "direction, turn",
     &problem_options.params, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "same", "GLOB,..",
     "values of all these are equal: one paint", &problem_options.same, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "factor", "GLOB,..",
     "all these keep their ratios: one factor", &problem_options.factor, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "log", "GLOB,..",
     "these are fitted as logarithms, and stay positive", &problem_options.log, 0, 0,
     NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "hold", "NAME[i-j]",
     "these numbers stay as they are: block.pose[2-4]", &problem_options.hold, 0, 0,
     NULL},
    {0}};

const struct arg_option options_targets[] = {
    {ARG_LIST | ARG_REPLAYS, 'T', "target", "FILE[@SENSOR]",
     "picture to match, of this sensor (name or number); several without @SENSOR: one "
     "for each sensor, in order",
     &problem_options.targets, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "mask", "FILE",
     "weights of the pixels, one for each --target in order", &problem_options.masks, 0,
     0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "clip", "auto|LOW,HIGH",
     "values at these levels were clipped: white is at least, black at most",
     &problem_options.clip, 0, 0, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 0, "loss", "LOSS", "l2 (default), relative, l1 or log",
     &problem_options.loss, 0, 0, loss_words},
    {ARG_NUMBER | ARG_REPLAYS, 0, "epsilon", "E",
     "constant of the relative and log losses (default 0.01)", &problem_options.epsilon,
     1e-12, 1e12, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "tikhonov", "GLOB=W",
     "add W/2 |x|^2 over these parameters", &problem_options.tikhonov, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "stay", "GLOB=W",
     "add W/2 |x - start|^2 over these parameters", &problem_options.stay, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "smooth", "GLOB=W",
     "add W/2 |grad x|^2 over these textures and spectra", &problem_options.smooth, 0, 0,
     NULL},
    {0}};

const char *loss_word(void) { return loss_words[problem_options.loss]; }

/* "GLOB=W"; the glob is a new string. */
static int split_weight(const char *option, const char *text, char **glob, double *weight)
{
    const char *equal = strrchr(text, '=');
    char *end;
    if (equal && equal > text) {
        *weight = strtod(equal + 1, &end);
        if (end != equal + 1 && !*end && *weight >= 0) {
            if (!(*glob = strndup(text, (size_t)(equal - text))))
                return cli_error(EXIT_RUN, "out of memory");
            return 0;
        }
    }
    return cli_error(EXIT_USAGE, "--%s %s: expected GLOB=WEIGHT, the weight not negative",
                     option, text);
}

enum regulariser { TIKHONOV, STAY, SMOOTH };
static int add_regularisers(imp_problem *problem, enum regulariser kind,
                            const char *option, const struct arg_list *list)
{
    for (size_t i = 0; i < list->n; i++) {
        char *glob = NULL;
        double weight = 0;
        int rc = split_weight(option, list->item[i], &glob, &weight);
        if (rc) return rc;
        const enum imp_status st =
            kind == SMOOTH
                ? imp_problem_add_smoothness(problem, glob, weight)
                : imp_problem_add_tikhonov(problem, glob, weight, kind == STAY);
        free(glob);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    }
    return 0;
}

/* What speaks of a loss is not ignored where there is none. */
static int needs_target(void)
{
    const struct problem_options *o = &problem_options;
    const char *option = o->masks.n      ? "mask"
                         : o->clip       ? "clip"
                         : o->loss       ? "loss"
                         : o->epsilon    ? "epsilon"
                         : o->tikhonov.n ? "tikhonov"
                         : o->stay.n     ? "stay"
                         : o->smooth.n   ? "smooth"
                                         : NULL;
    if (!o->targets.n && option)
        return cli_error(EXIT_USAGE, "--%s is part of a loss, and needs a --target",
                         option);
    if (o->epsilon > 0 && losses[o->loss] != IMP_LOSS_RELATIVE_L2 &&
        losses[o->loss] != IMP_LOSS_LOG)
        return cli_error(
            EXIT_USAGE, "--epsilon is of the relative and log losses: --loss %s has none",
            loss_word());
    return 0;
}

int target_sensor(size_t i)
{
    const struct problem_options *o = &problem_options;
    const int named = picture_sensor(o->targets.item[i]);
    return named >= 0 ? named : o->targets.n > 1 ? (int)i : cli.sensor;
}

/* Several targets either all name their sensors, or are one for each sensor, in order:
 * what else could be meant is not guessed. */
static int match_sensors(void)
{
    const struct arg_list *t = &problem_options.targets;
    struct imp_scene_info scene = {.size = sizeof scene};
    size_t named = 0;
    imp_scene_get_info(cli.scene, &scene);
    for (size_t i = 0; i < t->n; i++) named += picture_sensor(t->item[i]) >= 0;
    if (t->n < 2 || named == t->n) return 0;
    if (named)
        return cli_error(EXIT_USAGE,
                         "%zu of %zu targets name a sensor: name one for each, like "
                         "--target %s@0",
                         named, t->n, t->item[picture_sensor(t->item[0]) >= 0 ? 1 : 0]);
    if (t->n == (size_t)scene.n_sensors && !cli.sensor) return 0;
    if (t->n == (size_t)scene.n_sensors)
        return cli_error(EXIT_USAGE,
                         "--sensor %d and %zu targets: name the sensor of each target, "
                         "like --target %s@%d",
                         cli.sensor, t->n, t->item[0], cli.sensor);
    return cli_error(EXIT_USAGE,
                     "%zu targets, but the scene has %d %s: name the sensor of each "
                     "target, like --target %s@0 --target %s@%d",
                     t->n, scene.n_sensors, scene.n_sensors == 1 ? "sensor" : "sensors",
                     t->item[0], t->item[1], scene.n_sensors > 1);
}

int problem_spp(const struct imp_run *run)
{
    const int spp = cli_spp(run);
    return problem_options.targets.n && spp == 1 ? 2 : spp;
}

static int add_target(imp_problem *problem, int i, const struct imp_target *target)
{
    const struct problem_options *o = &problem_options;
    const char *spec = o->targets.item[i];
    double low = 0, high = 0;
    int rc = 0;
    if (o->clip) rc = photograph_levels(spec, o->clip, target, &low, &high);
    else photograph_warn_clipped(spec, target);
    if (rc) return rc;
    enum imp_status st = imp_problem_add_target(problem, target);
    if (st == IMP_OK && o->clip) st = imp_problem_clip(problem, i, low, high);
    return st == IMP_OK ? 0 : cli_fail(st, spec);
}

static int add_targets(imp_problem *problem)
{
    const struct problem_options *o = &problem_options;
    const int unclear = match_sensors();
    if (unclear) return unclear;
    if (o->masks.n > o->targets.n)
        return cli_error(EXIT_USAGE, "%zu masks, but only %zu %s", o->masks.n,
                         o->targets.n, o->targets.n == 1 ? "target" : "targets");
    for (size_t i = 0; i < o->targets.n; i++) {
        struct imp_target target = IMP_TARGET_INIT;
        const char *mask = i < o->masks.n ? o->masks.item[i] : NULL;
        const int rc = picture_target(o->targets.item[i], mask, &target);
        if (rc) return rc;
        target.sensor = target_sensor(i);
        target.loss = losses[o->loss];
        target.epsilon = o->epsilon;
        photograph_undo_srgb(o->targets.item[i], &target);
        const int failed = add_target(problem, (int)i, &target);
        picture_target_free(&target);
        if (failed) return failed;
    }
    return 0;
}

static enum imp_status add_ties(imp_problem *problem)
{
    const struct problem_options *o = &problem_options;
    const struct {
        const struct arg_list *globs;
        enum imp_tie kind;
    } ties[] = {
        {&o->same, IMP_TIE_SAME}, {&o->factor, IMP_TIE_FACTOR}, {&o->log, IMP_TIE_LOG}};
    enum imp_status st = IMP_OK;
    /* Equal values that are logarithms become logarithms together: first these. */
    for (size_t k = 0; k < 3 && st == IMP_OK; k++)
        for (size_t i = 0; i < ties[k].globs->n && st == IMP_OK; i++)
            st = imp_problem_tie(problem, ties[k].globs->item[i], ties[k].kind);
    for (size_t i = 0; i < o->hold.n && st == IMP_OK; i++)
        st = imp_problem_hold(problem, o->hold.item[i]);
    return st;
}

int problem_open(imp_problem **out)
{
    const struct problem_options *o = &problem_options;
    imp_problem *problem = NULL;
    int rc = needs_target();
    if (rc) return rc;
    enum imp_status st = IMP_OK;
    for (size_t i = 0; i < o->params.n && st == IMP_OK; i++)
        if (!strpbrk(o->params.item[i], "*?[")) st = settings_pose(o->params.item[i]);
    if (st == IMP_OK) st = imp_problem_create(cli.scene, &problem);
    for (size_t i = 0; i < o->params.n && st == IMP_OK; i++)
        st = imp_problem_activate(problem, o->params.item[i]);
    if (st == IMP_OK && o->params.n == 0) st = imp_problem_activate(problem, "*");
    if (st == IMP_OK) st = add_ties(problem);
    if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    if (!rc) rc = add_targets(problem);
    const struct imp_run run = cli_run();
    if (!rc && o->targets.n && cli_spp(&run) == 1)
        cli_say("importon: a loss without bias takes 2 samples per pixel: 2 are taken");
    if (!rc) rc = add_regularisers(problem, TIKHONOV, "tikhonov", &o->tikhonov);
    if (!rc) rc = add_regularisers(problem, STAY, "stay", &o->stay);
    if (!rc) rc = add_regularisers(problem, SMOOTH, "smooth", &o->smooth);
    if (rc) imp_problem_destroy(problem);
    else *out = problem;
    return rc;
}

int problem_censor(imp_problem *problem)
{
    const struct imp_run run = cli_run();
    if (!problem_options.clip) return 0;
    const enum imp_status st = imp_problem_censor(problem, &run);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

void problem_close(imp_problem *problem)
{
    struct problem_options *o = &problem_options;
    imp_problem_destroy(problem);
    args_list_free(&o->params);
    args_list_free(&o->same);
    args_list_free(&o->factor);
    args_list_free(&o->log);
    args_list_free(&o->hold);
    args_list_free(&o->targets);
    args_list_free(&o->masks);
    args_list_free(&o->tikhonov);
    args_list_free(&o->stay);
    args_list_free(&o->smooth);
}
