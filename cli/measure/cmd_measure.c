/* SPDX-License-Identifier: Apache-2.0
 *
 * importon measure: a scene from photographs, in stages, with every decision printed. */
#include "exif.h"
#include "fit/fit_pictures.h"
#include "measure_answer.h"
#include "photos.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "text/progress.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static struct {
    struct arg_list hold;
    const char *stages;
    int rounds, iterations, no_masks;
    double mask;
} o;

static const struct arg_option options[] = {
    {ARG_TEXT, 0, "stages", "NAME[,..]",
     "of cameras, lens, exposure, lights, materials, textures (default: all)", &o.stages,
     0, 0, NULL},
    {ARG_LIST, 'p', "param", "GLOB",
     "what is measured: a name or a pattern (default: all, and the cameras' poses)",
     &problem_options.params, 0, 0, NULL},
    {ARG_LIST, 0, "hold", "NAME[i-j]",
     "of these, what stays as it is: *.gamma.value, left.pose[3-5]", &o.hold, 0, 0, NULL},
    {ARG_INT, 0, "rounds", "N", "of all stages, at most (default 3)", &o.rounds, 1, 100,
     NULL},
    {ARG_INT, 'n', "iterations", "N",
     "of each search, at most (default 30); a fit with clipped values takes two to six",
     &o.iterations, 1, 1e9, NULL},
    {ARG_NUMBER, 0, "mask-above", "S",
     "mask blocks of pixels whose residuals are S robust standard deviations above the "
     "others' (default 6)",
     &o.mask, 1, 1e9, NULL},
    {ARG_FLAG, 0, "no-masks", NULL, "mask nothing", &o.no_masks, 0, 0, NULL},
    {0}};

static void say(const char *line, void *payload)
{
    (void)payload;
    if (cli.json) return;
    progress_clear();
    char *plain = cli_plain(line);
    printf("%s\n", plain);
    fflush(stdout);
    free(plain);
}

static struct imp_measure_options choice(const char *checkpoint)
{
    struct imp_measure_options m = IMP_MEASURE_OPTIONS_INIT;
    m.stages = o.stages;
    m.params = problem_options.params.n ? problem_options.params.item : NULL;
    m.n_params = problem_options.params.n;
    m.hold = o.hold.n ? o.hold.item : NULL;
    m.n_hold = o.hold.n;
    m.rounds = o.rounds;
    m.mask = o.no_masks ? -1 : o.mask;
    m.max_iterations = o.iterations;
    m.checkpoint = checkpoint;
    m.resume = !cli.overwrite;
    m.say = say;
    return m;
}

static int measure(const struct photos *photos, const char *checkpoint)
{
    const struct imp_measure_options options_of = choice(checkpoint);
    const struct imp_run run = cli_run();
    struct next_photo next = {0};
    struct measure_answer a = {.photos = photos, .next = &next};
    const enum imp_status st = imp_measure(cli.scene, photos->photo, photos->n,
                                           &options_of, &run, &a.problem, &a.result);
    if (st == IMP_CANCELLED) {
        if (checkpoint)
            cli_say("importon: interrupted; the same command goes on from %s",
                    checkpoint);
        else cli_say("importon: interrupted; with -o DIR it can go on");
        return cli_done();
    }
    if (st != IMP_OK) {
        fit_pictures_refused(st);
        return cli_fail(st, cli.scene_path);
    }
    int rc = next_photo_find(a.problem, photos, a.result, &next);
    if (!rc) rc = measure_answer_give(&a);
    if (!rc && checkpoint) (void)unlink(checkpoint);
    next_photo_free(&next);
    imp_problem_destroy(a.problem);
    return rc;
}

static bool knows_exif(const struct photos *photos)
{
    for (size_t i = 0; i < photos->n; i++)
        if (photos->photo[i].focal_35mm > 0 || photos->photo[i].exposure_s > 0)
            return true;
    return false;
}

/* Files of a kind that carries EXIF, and none of which does: what begins elsewhere then. Of those that only some
 * have, the library tells. */
static void exif_say(const struct photos *photos)
{
    static const char *const carry[] = {".jpg",  ".jpeg", ".png", ".tif",
                                        ".tiff", ".dng",  NULL};
    const char *first = NULL;
    if (knows_exif(photos)) return;
    if (!exif_is_built()) {
        cli_say("importon: EXIF is not read: this importon was built without libexif");
        return;
    }
    for (size_t i = 0; i < photos->n && !first; i++) {
        const char *dot = strrchr(photos->path[i], '.');
        for (int k = 0; dot && carry[k]; k++)
            if (!strcasecmp(dot, carry[k])) first = photos->path[i];
    }
    if (first)
        cli_say("importon: %s%s no EXIF: exposures begin by means, fields of view where "
                "the scene has them",
                first, photos->n > 1 ? " and the other photographs have" : " has");
}

static int run_measure(int n, char **operand)
{
    struct photos photos = {0};
    char *scene = NULL, *checkpoint = NULL;
    int rc = photos_scene(n, operand, &scene);
    if (!rc) rc = cli_load(scene);
    if (!rc) rc = photos_read(n, operand, &photos);
    if (!rc) exif_say(&photos);
    if (!rc && cli.out) {
        checkpoint = join_path(cli.out, "measure.checkpoint");
        rc = measure_answer_writable();
        if (!rc) rc = checkpoint_writable(checkpoint, !cli.overwrite);
        if (!rc && cli.overwrite) (void)unlink(checkpoint);
        if (!rc) rc = fit_targets_write();
        if (!rc) rc = fit_pictures_write("before", 0);
    }
    if (!rc) rc = measure(&photos, checkpoint);
    photos_free(&photos);
    args_list_free(&o.hold);
    problem_close(NULL);
    free(checkpoint);
    free(scene);
    return rc ? rc : cli_done();
}

const struct command command_measure = {
    {"measure",
     "SCENE PHOTO... | FOLDER",
     "a scene from photographs, in stages, with intervals",
     {options, options_photos, options_run, options_scene, options_folder,
      options_general},
     1,
     -1},
    run_measure,
    0,
    0,
    REPLAYS_NEVER};
