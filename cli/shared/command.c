/* SPDX-License-Identifier: Apache-2.0
 *
 * The start and the end of every command, and how it talks: context, scene, settings. */
#include "command.h"

#include "display.h"
#include "part.h"
#include "proof.h"
#include "ranks.h"
#include "sensor_names.h"
#include "settings.h"
#include "text/progress.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct cli cli;

/* ---- Talking ------------------------------------------------------------------- */

/* Messages quote files and arguments, which may hold what moves a terminal's cursor: control
 * characters, in UTF-8 those of C1 too. */
static void plain(char *text)
{
    for (unsigned char *p = (unsigned char *)text; *p; p++)
        if ((*p < 32 && *p != '\n' && *p != '\t') || *p == 127) *p = '?';
        else if (*p == 0xc2 && p[1] >= 0x80 && p[1] < 0xa0) p[0] = p[1] = '?';
}

char *cli_plain(const char *text)
{
    char *copy = cli_strdup(text);
    plain(copy);
    return copy;
}

static void print(bool error, const char *format, va_list args)
{
    char *text = NULL;
    progress_clear();
    if (vasprintf(&text, format, args) < 0) return;
    plain(text);
    if (ranks_first()) fprintf(stderr, "%s%s\n", error ? "importon: " : "", text);
    if (error) ranks_remember(true, text);
    free(text);
}

int cli_error(int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print(true, format, args);
    va_end(args);
    return code;
}

static int exit_code(enum imp_status status)
{
    switch (status) {
    case IMP_OK: return EXIT_DONE;
    case IMP_CANCELLED: return cli_done();
    case IMP_PART: return EXIT_STOP;
    case IMP_E_ARG:
    case IMP_E_SCENE:
    case IMP_E_UNSUPPORTED:
    case IMP_E_BIAS: return EXIT_USAGE;
    case IMP_E_IO:
    case IMP_E_NOMEM:
    case IMP_E_PATHS:
    case IMP_E_NUMERIC: return EXIT_RUN;
    }
    return EXIT_RUN;
}
int cli_fail(enum imp_status status, const char *what)
{
    if (status == IMP_PART) return part_end();
    const char *ended; /* the reason, where it is another rank */
    const int ended_code = ranks_ended(&ended);
    if (ended_code) return cli_error(ended_code, "%s", ended);
    const char *message = cli.context ? imp_last_error(cli.context) : "";
    if (status == IMP_CANCELLED && !strcmp(message, imp_status_text(status)))
        message = "interrupted before there was a result";
    if (!message[0]) message = imp_status_text(status);
    const size_t n =
        what ? strlen(what) : 0; /* "FILE:LINE:COLUMN: ..." names it already */
    if (what && !(strncmp(message, what, n) == 0 && message[n] == ':'))
        return cli_error(exit_code(status), "%s: %s", what, message);
    return cli_error(exit_code(status), "%s", message);
}
int cli_done(void)
{
    return progress_interrupted() ? EXIT_SIGNAL + progress_interrupted() : EXIT_DONE;
}

void cli_say(const char *format, ...)
{
    va_list args;
    if (cli.quiet) return;
    va_start(args, format);
    print(false, format, args);
    va_end(args);
}

struct json cli_json(void)
{
    struct json j = {stdout, 0};
    json_object(&j, NULL);
    json_text(&j, "importon", imp_version());
    json_text(&j, "command", cli.name);
    return j;
}
void cli_json_end(struct json *j)
{
    json_end_object(j);
    fputc('\n', j->file);
}

void *cli_alloc(size_t n, size_t size)
{
    void *memory = calloc(n ? n : 1, size);
    if (!memory) exit(cli_error(EXIT_RUN, "out of memory"));
    return memory;
}

char *cli_strdup(const char *text)
{
    char *copy = strdup(text);
    if (!copy) exit(cli_error(EXIT_RUN, "out of memory"));
    return copy;
}

double cli_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- Opening ------------------------------------------------------------------- */

/* Was this warning printed before? A fit and the pictures that it writes cause the same ones. */
static bool said_before(const char *warning)
{
    static char *said[16];
    size_t k = 0;
    for (; k < sizeof said / sizeof *said && said[k]; k++)
        if (strcmp(said[k], warning) == 0) return true;
    if (k < sizeof said / sizeof *said) said[k] = cli_strdup(warning);
    return false;
}

static void on_log(enum imp_log_level level, const char *message, void *payload)
{
    (void)payload;
    if (level == IMP_LOG_WARNING && said_before(message)) return;
    if (level == IMP_LOG_WARNING) ranks_remember(false, message);
    cli_say("importon: %s%s", level == IMP_LOG_WARNING ? "warning: " : "", message);
}

int cli_open(void)
{
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    if (cli.context) return 0;
    options.threads = cli.threads;
    options.log = on_log;
    const enum imp_status st = imp_context_create(&options, &cli.context);
    if (st != IMP_OK) return cli_fail(st, NULL);
    const int rc = ranks_open(cli.context);
    if (!rc) return cli.part ? part_open() : manifest_open();
    return rc;
}

int cli_writes(void) { return ranks_first() && !cli.verifies; }

/* Cut "a;b;c" into a list, of a text that is returned: to be freed after the list. */
static char *split_search(const char *paths, struct arg_list *list)
{
    char *copy = cli_strdup(paths), *save = NULL;
    for (char *p = strtok_r(copy, ";", &save); p; p = strtok_r(NULL, ";", &save))
        args_list_add(list, p);
    return copy;
}

/* The parameters as --set takes them. Long ones are cut short; not in JSON. */
static int dump(void)
{
    enum { SHOWN = 12 };
    struct json j = {0};
    if (cli.json) {
        j = cli_json();
        json_array(&j, "params");
    }
    for (size_t i = 0; i < imp_scene_n_params(cli.scene); i++) {
        struct imp_param_info info = {.size = sizeof info};
        double *values;
        enum imp_status st = imp_scene_get_param(cli.scene, i, &info);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        values = cli_alloc(info.count, sizeof *values);
        st = imp_scene_get_values(cli.scene, i, values);
        if (st == IMP_OK && cli.json) {
            json_object(&j, NULL);
            json_text(&j, "name", info.name);
            json_numbers(&j, "value", info.count, values);
            json_end_object(&j);
        } else if (st == IMP_OK) {
            printf("%s=", info.name);
            for (size_t k = 0; k < info.count && k < SHOWN; k++)
                printf("%s%.9g", k ? "," : "", values[k]);
            printf("%s\n", info.count > SHOWN ? ",..." : "");
        }
        free(values);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    }
    if (cli.json) {
        json_end_array(&j);
        cli_json_end(&j);
    }
    return EXIT_STOP;
}

/* A coarse solution is enough: lights need their shares to some per cent. */
static int guide_make(void)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_guide_options g = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    o.sensor = cli.sensor;
    o.seed = cli.seed;
    o.stop = 0.05;
    o.progress = progress_report;
    g.share = cli.guide_share;
    g.roulette = cli.guide_roulette;
    enum imp_status st = imp_elements_create(cli.scene, &o, &cli.elements);
    if (st == IMP_OK) st = imp_elements_solve(cli.elements);
    if (!cli_failed(st)) st = imp_elements_guide(cli.elements, &g, &cli.guiding);
    return cli_failed(st) ? cli_fail(st, cli.scene_path) : 0;
}

int cli_load(const char *path)
{
    struct imp_load_options options = IMP_LOAD_OPTIONS_INIT;
    struct arg_list search = {0};
    enum imp_status st;
    int rc = cli_open();
    if (!rc && ranks_first()) rc = display_open(); /* before the scene takes its time */
    if (rc) return rc;

    cli.scene_path = path;
    options.mode = (enum imp_color_mode)cli.mode;
    options.upsampling = (enum imp_upsampling)cli.upsampling;
    options.defines = cli.defines.item;
    options.n_defines = cli.defines.n;
    options.luminaires = cli.luminaires.item;
    options.n_luminaires = cli.luminaires.n;
    options.weights = cli.weights;
    /* A guide has rays of its own. */
    if (cli.brief && !cli.guide && cli.guide_share <= 0 && cli.guide_roulette <= 0)
        options.spp = cli.spp;
    options.bins = cli.bins;
    options.lenient = (enum imp_lenience)cli.lenient;
    char *folders = cli.search ? split_search(cli.search, &search) : NULL;
    options.search = search.item;
    options.n_search = search.n;
    if (!strcmp(path, "-")) {
        size_t length = 0;
        char *xml = ranks_first() ? read_all(stdin, SIZE_MAX, &length) : NULL;
        if (!xml && ranks_first())
            return cli_error(EXIT_RUN, "standard input: %s", strerror(errno));
        if ((rc = ranks_broadcast(&xml, &length))) return rc;
        cli.scene_path = "<stdin>";
        st = imp_scene_load_string(cli.context, xml, length, cli.scene_path, &options,
                                   &cli.scene);
        free(xml);
    } else {
        st = imp_scene_load(cli.context, path, &options, &cli.scene);
    }
    args_list_free(&search);
    free(folders);
    if (st != IMP_OK) {
        rc = cli_fail(st, NULL);
        return st == IMP_E_IO ? EXIT_USAGE : rc;
    }
    for (size_t i = 0; i < cli.sets.n && !rc; i++) rc = settings_apply(cli.sets.item[i]);
    if (!rc && cli.sensor_text) rc = sensor_set(cli.sensor_text);
    if (!rc && cli.dump) rc = dump();
    if (!rc && (cli.guide || cli.guide_share > 0 || cli.guide_roulette > 0))
        rc = guide_make();
    return rc;
}

void cli_close(void)
{
    display_close();
    imp_guide_destroy(cli.guiding);
    imp_elements_destroy(cli.elements);
    imp_scene_destroy(cli.scene);
    imp_parts_destroy(cli.parts);
    imp_manifest_destroy(cli.manifest);
    imp_context_destroy(cli.context);
    args_list_free(&cli.defines);
    args_list_free(&cli.sets);
    args_list_free(&cli.luminaires);
}

struct imp_run cli_run(void)
{
    struct imp_run run = IMP_RUN_INIT;
    run.sensor = cli.sensor;
    run.spp = cli.spp;
    run.seed = cli.seed;
    run.time_limit_s = cli.time_s;
    run.progress = progress_report;
    run.guide = cli.guiding;
    run.wavelengths = (enum imp_wavelength_sampling)cli.wavelengths;
    run.wavelength_set = cli.wavelength_set;
    run.from = (enum imp_from)cli.from;
    run.points = (enum imp_points)cli.points;
    return run;
}
bool cli_typed(const char *name)
{
    const size_t n = strlen(name);
    for (size_t k = 0; k < cli.typed.n; k++) {
        const char *word = cli.typed.item[k];
        if (!strncmp(word, "--", 2) && !strncmp(word + 2, name, n) && word[2 + n] == '=')
            return true;
    }
    return false;
}

int cli_spp(const struct imp_run *run)
{
    struct imp_sensor_info info = {.size = sizeof info};
    if (run->spp > 0) return run->spp;
    if (imp_scene_get_sensor(cli.scene, run->sensor, &info) != IMP_OK) return 0;
    return info.spp;
}

const char *cli_number_name(const struct imp_param_info *info, size_t element, char *text,
                            size_t size)
{
    if (info->count == 1) snprintf(text, size, "%s", info->name);
    else snprintf(text, size, "%s[%zu]", info->name, element);
    return text;
}
const char *cli_number_row(const struct imp_param_info *info, size_t element, char *text,
                           size_t size)
{
    cli_number_name(info, element, text, size);
    const size_t used = strlen(text);
    if (info->wavelengths_nm)
        snprintf(text + used, size - used, " %g nm", info->wavelengths_nm[element]);
    return text;
}
