/* SPDX-License-Identifier: Apache-2.0
 *
 * Film files as commands read and write them: output paths, previews, the command line
 * in their header. */
#include "picture_files.h"

#include "command.h"
#include "display.h"
#include "overwrite.h"
#include "proof.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <math.h>
#include <stdio_ext.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Luminance of linear sRGB, as the scene format defines it (section 2). */
static const double luminance[3] = {0.212671, 0.715160, 0.072169};
const double *const picture_luminance = luminance;

/* ---- Files --------------------------------------------------------------------- */

char *join_path(const char *folder, const char *name)
{
    const size_t n = strlen(folder) + strlen(name) + 2;
    char *path = cli_alloc(n, 1);
    snprintf(path, n, "%s/%s", folder, name);
    return path;
}

int make_folder(const char *path)
{
    if (!cli_writes()) return 0;
    char *copy = strdup(path);
    int rc = 0;
    if (!copy) return cli_error(EXIT_RUN, "out of memory");
    for (char *p = copy + 1; !rc; p++) {
        if (*p && *p != '/') continue;
        const char end = *p;
        *p = 0;
        struct stat info;
        if (mkdir(copy, 0777) != 0 && errno != EEXIST)
            rc = cli_error(EXIT_RUN, "%s: cannot make this folder: %s", copy,
                           strerror(errno));
        else if (stat(copy, &info) == 0 && !S_ISDIR(info.st_mode))
            rc = cli_error(EXIT_RUN, "%s: this is not a folder", copy);
        *p = end;
        if (!end) break;
    }
    free(copy);
    return rc;
}

void make_file_name(char *name)
{
    for (char *p = name; *p; p++)
        if (*p == '/' || (p == name && *p == '.')) *p = '_';
}

/* The PNG beside a picture, in a new string; NULL: there is none. */
static char *preview_path(const char *path)
{
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    if (!dot || (slash && dot < slash) || !strcmp(dot, ".png")) return NULL;
    const size_t stem = (size_t)(dot - path);
    char *preview = cli_alloc(stem + 5, 1);
    memcpy(preview, path, stem);
    memcpy(preview + stem, ".png", 5);
    return preview;
}

int picture_writable(const char *path, int preview)
{
    static const struct {
        const char *extension;
        enum output_kind kind;
    } kinds[] = {{".exr", OUTPUT_EXR},
                 {".png", OUTPUT_PNG},
                 {".pfm", OUTPUT_PFM},
                 {".hdr", OUTPUT_HDR},
                 {".npy", OUTPUT_NPY}};
    const size_t n = strlen(path), n_kinds = sizeof kinds / sizeof kinds[0];
    size_t k = 0;
    if (!strcmp(path, "-")) return 0;
    while (k < n_kinds && (n < 5 || strcasecmp(path + n - 4, kinds[k].extension) != 0))
        k++;
    if (k == n_kinds)
        return cli_error(EXIT_USAGE,
                         "%s: the name must end in .exr, .png, .pfm, .hdr or .npy", path);
    int rc = overwrite_check(path, kinds[k].kind);
    char *beside = preview ? preview_path(path) : NULL;
    if (!rc && beside) rc = overwrite_check(beside, OUTPUT_PNG);
    free(beside);
    return rc;
}

void picture_remove(const char *path)
{
    if (!cli_writes()) return; /* another rank may have written it by now */
    char *beside = preview_path(path);
    unlink(path);
    if (beside) unlink(beside);
    free(beside);
}

/* A new temporary .exr file: EXR readers and writers want files they can seek in. */
static int temporary(char *path, size_t size)
{
    const char *folder = getenv("TMPDIR");
    snprintf(path, size, "%s/importonXXXXXX.exr", folder && *folder ? folder : "/tmp");
    const int fd = mkstemps(path, 4);
    if (fd < 0) cli_error(EXIT_RUN, "%s: cannot make a temporary file", path);
    return fd;
}

static int copy_stream(FILE *from, FILE *to)
{
    char buffer[1 << 16];
    for (size_t n; (n = fread(buffer, 1, sizeof buffer, from)) > 0;)
        if (fwrite(buffer, 1, n, to) != n) return 0;
    return !ferror(from) && fflush(to) == 0;
}

int picture_read(const char *path, imp_film **out)
{
    char name[4096];
    const int from_stdin = !strcmp(path, "-");
    if (from_stdin) {
        const int fd = temporary(name, sizeof name);
        if (fd < 0) return EXIT_RUN;
        FILE *file = fdopen(fd, "wb");
        const int good = file && copy_stream(stdin, file);
        if (file) fclose(file);
        if (!good) {
            unlink(name);
            return cli_error(EXIT_RUN, "cannot copy standard input");
        }
    }
    if (!from_stdin) overwrite_protect(path);
    const enum imp_status st = imp_film_read(cli.context, from_stdin ? name : path, out);
    if (from_stdin) unlink(name);
    if (st == IMP_OK) return 0;
    cli_fail(st, NULL);
    return st == IMP_E_NOMEM ? EXIT_RUN : EXIT_USAGE; /* an input that cannot be read */
}

static int write_to_stdout(const imp_film *film, const struct imp_write_options *options)
{
    char name[4096];
    const int fd = temporary(name, sizeof name);
    if (fd < 0) return EXIT_RUN;
    close(fd);
    const enum imp_status st = imp_film_write(film, name, options);
    FILE *file = st == IMP_OK ? fopen(name, "rb") : NULL;
    const int good = file && copy_stream(file, stdout), code = errno;
    if (file) fclose(file);
    unlink(name);
    if (st != IMP_OK) return cli_fail(st, NULL);
    if (good) return 0;
    __fpurge(stdout); /* reported here: nothing is left to fail at the end */
    clearerr(stdout);
    return cli_error(EXIT_RUN, "standard output: %s", strerror(code));
}

/* Gives back what was freed in making a large picture, or its file: the next file takes memory of its
 * own. Of small ones, which fits write many of, the next step has the pages. */
static void memory_return(const imp_film *film)
{
#ifdef __GLIBC__
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    if ((int64_t)info.width * info.height * info.channels > 1 << 18) malloc_trim(0);
#else
    (void)film;
#endif
}

int picture_write(const imp_film *film, const char *path, const struct picture_options *o)
{
    struct imp_write_options options = IMP_WRITE_OPTIONS_INIT;
    if (cli.verifies) return 0;
    memory_return(film);
    options.half = o->half;
    options.standard_error = o->standard_error;
    options.exposure = o->exposure;
    options.diverging = o->diverging;
    options.range = o->range;
    display_film(film, path);
    if (!strcmp(path, "-")) return write_to_stdout(film, &options);

    enum imp_status st = imp_film_write(film, path, &options);
    char *preview = o->no_preview ? NULL : preview_path(path);
    if (st == IMP_OK) manifest_wrote(path);
    memory_return(film);
    if (st == IMP_OK && preview) st = imp_film_write(film, preview, &options);
    if (st == IMP_OK && preview) manifest_wrote(preview);
    free(preview);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

/* By bisection on the count, as imp_film_write does it: the same bits. */
double picture_range(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *mean = imp_film_mean(film);
    double *size = cli_alloc(n, sizeof *size), lo = 0, hi = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (int c = 0; c < info.channels; c++) sum += (double)*mean++;
        size[i] = fabs(sum / info.channels);
        if (isfinite(size[i])) hi = fmax(hi, size[i]);
    }
    for (int step = 0; step < 40 && hi > 0; step++) {
        const double middle = (lo + hi) / 2;
        size_t above = 0;
        for (size_t i = 0; i < n; i++) above += size[i] > middle;
        if (above > n / 200) lo = middle;
        else hi = middle;
    }
    free(size);
    return hi > 0 ? hi : 1;
}

/* ---- Provenance ---------------------------------------------------------------- */

/* Append `word` to a shell command line, quoted where the shell would split or expand it.
 */
void quote_word(FILE *f, const char *word)
{
    const char *p = word;
    while (isalnum((unsigned char)*p) || (*p && strchr("-_./=,:@%+", *p))) p++;
    if (*word && !*p) {
        fputs(word, f);
        return;
    }
    fputc('\'', f);
    for (p = word; *p; p++) {
        if (*p == '\'') fputs("'\\''", f);
        else fputc(*p, f);
    }
    fputc('\'', f);
}

static void set_text(imp_film *film, const char *key, const char *value)
{
    if (imp_film_set_text(film, key, value) != IMP_OK)
        cli_say("importon: warning: %s could not be recorded", key);
}

void picture_stamp(imp_film *film, const struct imp_run *run)
{
    struct imp_film_info info = {.size = sizeof info};
    char text[64], *line = NULL;
    size_t length = 0;
    FILE *f = open_memstream(&line, &length);
    const time_t now = time(NULL);
    struct tm utc;

    if (f) {
        fputs("importon", f);
        for (int i = 0; i < cli.argc; i++) {
            fputc(' ', f);
            quote_word(f, cli.argv[i]);
        }
        if (fclose(f) == 0) set_text(film, "importon.command", line);
        free(line);
    }
    set_text(film, "importon.version", imp_version());
    snprintf(text, sizeof text, "%" PRIu64, run->seed);
    set_text(film, "importon.seed", text);
    imp_film_get_info(film, &info);
    snprintf(text, sizeof text, "%" PRId64, info.spp);
    set_text(film, "importon.spp", text);
    if (gmtime_r(&now, &utc) && strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc))
        set_text(film, "importon.time", text);
}
