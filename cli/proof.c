/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests of render, gradient and fit. */
#include "proof.h"
#include "overwrite.h"
#include "part.h"
#include "progress.h"
#include "ranks.h"

#include <stdlib.h>
#include <string.h>

static int status(enum imp_status st) { return st == IMP_OK ? 0 : cli_fail(st, NULL); }

int manifest_open(void)
{
    static const char *const commands[] = {"render", "gradient", "fit"};
    int known = 0;
    if (!cli.manifest_path) return 0;
    for (size_t k = 0; k < sizeof commands / sizeof *commands; k++)
        known |= !strcmp(cli.name, commands[k]);
    if (!known)
        return cli_error(EXIT_USAGE, "%s: --manifest is for render, gradient and fit",
                         cli.name);
    if (cli.time_s > 0)
        return cli_error(EXIT_USAGE,
                         "%s: --manifest and --time do not go together: a clock cannot "
                         "be repeated",
                         cli.name);
    for (int k = 0; k < cli.n_operands; k++)
        if (!strcmp(cli.operand[k], "-"))
            return cli_error(EXIT_USAGE,
                             "%s: what comes from standard input cannot be verified "
                             "later: --manifest needs files",
                             cli.name);
    int rc = overwrite_check(cli.manifest_path, OUTPUT_MANIFEST);
    if (rc) return rc;
    char *text = part_command();
    if (!text) return cli_error(EXIT_RUN, "out of memory");
    rc = status(imp_manifest_create(cli.context, text, &cli.manifest));
    free(text);
    return rc;
}

int manifest_begin(void)
{
    if (!cli.manifest) return 0;
    return status(imp_context_set_manifest(cli.context, cli.manifest));
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

int manifest_output(const char *path)
{
    if (!cli.manifest || !cli_writes() || !strcmp(path, "-")) return 0;
    return status(imp_manifest_output(cli.manifest, path));
}

int manifest_end(int rc)
{
    if (!cli.manifest || cli.verifies || rc != EXIT_DONE || progress_interrupted())
        return rc;
    /* Of commands that print, the answer. */
    if (!strcmp(cli.name, "gradient") && cli.out) rc = manifest_output(cli.out);
    return rc ? rc : status(imp_manifest_write(cli.manifest, cli.manifest_path));
}
