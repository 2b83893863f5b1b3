/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests of render, gradient and fit. */
#include "proof.h"
#include "overwrite.h"
#include "problem_options.h"
#include "ranks.h"
#include "replay.h"
#include "text/progress.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Most bytes of sums in a manifest without --manifest. They are in memory twice until the end:
 * of 1 MB, a picture of 128 x 128 took a fifth more memory in all. */
#define LIMIT_BESIDE ((size_t)1 << 18)

static char *beside; /* path of a manifest without --manifest; NULL: none */

static int status(enum imp_status st) { return st == IMP_OK ? 0 : cli_fail(st, NULL); }

/* Why the run cannot be repeated; NULL: it can. */
static const char *unrepeatable(void)
{
    if (!(cli_command(cli.name)->replays & REPLAYS_MANIFEST))
        return "--manifest is for render, gradient and fit";
    if (cli.time_s > 0)
        return "--manifest and --time do not go together: a clock cannot be repeated";
    for (int k = 0; k < cli.n_operands; k++)
        if (!strcmp(cli.operand[k], "-"))
            return "what comes from standard input cannot be verified later: --manifest "
                   "needs files";
    return NULL;
}

int manifest_open(void)
{
    const char *why = unrepeatable();
    if (!cli.manifest_path && (cli.no_manifest || why)) return 0;
    if (why) return cli_error(EXIT_USAGE, "%s: %s", cli.name, why);
    const char *unfit = replay_unfit();
    if (unfit && !cli.manifest_path) return 0;
    if (unfit)
        return cli_error(
            EXIT_USAGE,
            "%s: --manifest and %s do not go together: no manifest may carry "
            "this option",
            cli.name, unfit);
    int rc = cli.manifest_path ? overwrite_check(cli.manifest_path, OUTPUT_MANIFEST) : 0;
    if (rc) return rc;
    char *text = replay_line();
    if (!text) return cli_error(EXIT_RUN, "out of memory");
    rc = status(imp_manifest_create(cli.context, text, &cli.manifest));
    free(text);
    return rc;
}

static void beside_drop(void)
{
    imp_manifest_destroy(cli.manifest);
    cli.manifest = NULL;
    free(beside);
    beside = NULL;
}

/* Not a pipe or a device, which cannot be read again. */
static int is_file_or_none(const char *path)
{
    struct stat s;
    return stat(path, &s) != 0 || S_ISREG(s.st_mode) || S_ISDIR(s.st_mode);
}
static int replaceable(const char *path)
{
    char magic[8] = "";
    FILE *file = fopen(path, "rb");
    if (!file) return 1;
    const size_t n = fread(magic, 1, sizeof magic, file);
    fclose(file);
    return n == 0 || !memcmp(magic, "impproof", sizeof magic);
}

int manifest_whole(void)
{
    return cli.manifest ? status(imp_manifest_set_limit(cli.manifest, 0)) : 0;
}

/* Losses by light tracing are sums over all pixels: no parts of them are kept. */
static int loss_from_lights(void)
{
    struct imp_scene_info info = {.size = sizeof info};
    const int is_fit = !strcmp(cli.name, "fit");
    if (!is_fit && (strcmp(cli.name, "gradient") || problem_options.targets.n == 0))
        return 0;
    if (cli.from != IMP_FROM_SCENE) return cli.from == IMP_FROM_LIGHTS;
    return imp_scene_get_info(cli.scene, &info) == IMP_OK && info.integrator &&
           (!strcmp(info.integrator, "ptracer") || !strcmp(info.integrator, "bdpt"));
}

int manifest_begin(const char *output)
{
    if (!cli.manifest || cli.verifies || cli.manifest_path)
        return cli.manifest ? status(imp_context_set_manifest(cli.context, cli.manifest))
                            : 0;
    if (!output || !strcmp(output, "-") || !is_file_or_none(output) ||
        loss_from_lights()) {
        beside_drop();
        return 0;
    }
    beside = cli_alloc(strlen(output) + sizeof "/.manifest", 1);
    sprintf(beside, strcmp(cli.name, "fit") ? "%s.manifest" : "%s/manifest", output);
    if (replaceable(beside)) {
        enum imp_status st = imp_manifest_set_limit(cli.manifest, LIMIT_BESIDE);
        if (st == IMP_OK) st = imp_context_set_manifest(cli.context, cli.manifest);
        return status(st);
    }
    cli_say("importon: warning: %s is no manifest, and stays", beside);
    beside_drop();
    return 0;
}
int manifest_pause(void)
{
    return cli.manifest ? status(imp_context_set_manifest(cli.context, NULL)) : 0;
}

int manifest_numbers(const char *name, const double *x, size_t n)
{
    if (!cli.manifest) return 0;
    return status(imp_manifest_result(cli.manifest, name, x, n * sizeof *x));
}

int manifest_film(const char *name, const imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    char part[64];
    if (!cli.manifest) return 0;
    imp_film_get_info(film, &info);
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    enum imp_status st = imp_manifest_result(cli.manifest, name,
                                             imp_film_mean((imp_film *)(uintptr_t)film),
                                             n * sizeof(float));
    snprintf(part, sizeof part, "errors of the %s", name);
    if (st == IMP_OK && imp_film_se((imp_film *)(uintptr_t)film))
        st = imp_manifest_result(cli.manifest, part,
                                 imp_film_se((imp_film *)(uintptr_t)film),
                                 n * sizeof(float));
    return status(st);
}

void manifest_wrote(const char *path)
{
    struct stat info;
    if (!cli.manifest || !cli_writes() || stat(path, &info) != 0 ||
        !S_ISREG(info.st_mode))
        return;
    const enum imp_status st = imp_manifest_output(cli.manifest, path);
    if (st != IMP_OK)
        cli_say("importon: warning: not in the manifest: %s",
                imp_last_error(cli.context));
}

int manifest_end(int rc)
{
    enum imp_status st = IMP_OK;
    if (!cli.manifest || cli.verifies || rc != EXIT_DONE || progress_interrupted() ||
        !(beside || cli.manifest_path))
        goto out;
    st = imp_manifest_write(cli.manifest, beside ? beside : cli.manifest_path);
    /* The result is there; without a manifest that was wanted, the run has failed. */
    if (st != IMP_OK && beside)
        cli_say("importon: warning: no manifest: %s", imp_last_error(cli.context));
    else rc = status(st);
out:
    free(beside);
    beside = NULL;
    return rc;
}
