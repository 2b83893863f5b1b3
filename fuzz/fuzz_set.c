/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of `--set @FILE`. Each is taken, or ends with a message that names it; all numbers of the
 * scene are then still such as it may have. */
#include "memory_file.h"
#include "shared/command.h"
#include "shared/ranks.h"
#include "shared/settings.h"
#include <math.h>
#include <stdarg.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'><film "
    "type='hdrfilm'><integer name='width' value='2'/><integer name='height' "
    "value='2'/></film></sensor><emitter type='constant' id='sky'><float name='radiance' "
    "value='1'/></emitter><bsdf type='roughconductor' id='m'><float name='alpha' "
    "value='.2'/><spectrum name='eta' value='1.5'/></bsdf><shape type='sphere'><bsdf "
    "type='diffuse' id='a'><rgb name='reflectance' "
    "value='.1,.2,.3'/></bsdf></shape><shape "
    "type='rectangle'><ref id='m'/></shape></scene>";

/* ---- What cli/shared/settings.c has from the command ------------------------------------------ */

struct cli cli;
static char said[1024];

void *cli_alloc(size_t n, size_t size)
{
    void *p = calloc(n ? n : 1, size);
    if (!p) abort();
    return p;
}
char *cli_strdup(const char *text)
{
    char *copy = strdup(text);
    if (!copy) abort();
    return copy;
}
int cli_error(int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(said, sizeof said, format, args);
    va_end(args);
    return code;
}
int cli_fail(enum imp_status status, const char *what)
{
    snprintf(said, sizeof said, "%s: %s", what, imp_last_error(cli.context));
    return status == IMP_OK ? 0 : EXIT_USAGE;
}
bool ranks_reads(void) { return true; }
int ranks_broadcast(char **bytes, size_t *n)
{
    (void)bytes, (void)n;
    return 0;
}

/* ---- The target ------------------------------------------------------------------------ */

enum { MOST = 64 };

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "%s\n", imp_last_error(cli.context));
    abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct memory_file file;
    static char option[80];
    static double first[MOST][16];
    static struct imp_param_info info[MOST];
    static size_t n;
    if (!cli.context) {
        struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
        o.threads = 1;
        memory_file_open(&file);
        snprintf(option, sizeof option, "@%s", file.path);
        cli.scene_path = "fuzz.xml";
        must(imp_context_create(&o, &cli.context));
        must(imp_scene_load_string(cli.context, scene_text, sizeof scene_text - 1,
                                   "fuzz.xml", NULL, &cli.scene));
        n = imp_scene_n_params(cli.scene);
        if (n < 4 || n > MOST) abort();
        for (size_t k = 0; k < n; k++) {
            info[k].size = sizeof info[k];
            must(imp_scene_get_param(cli.scene, k, &info[k]));
            if (info[k].count > 16) abort();
            must(imp_scene_get_values(cli.scene, k, first[k]));
        }
    }
    memory_file_put(&file, data, size);
    said[0] = 0;
    const int rc = settings_apply(option);
    if (rc != 0 && !strstr(said, file.path)) abort();
    if (rc == 0 && said[0]) abort();
    for (size_t k = 0; k < n; k++) {
        double x[16];
        must(imp_scene_get_values(cli.scene, k, x));
        for (size_t i = 0; i < info[k].count; i++)
            if (!(x[i] >= info[k].lo && x[i] <= info[k].hi) || !isfinite(x[i])) abort();
        must(imp_scene_set_values(cli.scene, k, info[k].count, first[k]));
    }
    return 0;
}
