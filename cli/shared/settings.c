/* SPDX-License-Identifier: Apache-2.0
 *
 * --set: values of parameters from the command line and from files. */
#include "settings.h"

#include "command.h"
#include "ranks.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

char *read_all(FILE *file, size_t limit, size_t *length)
{
    size_t capacity = 1 << 16, n = 0;
    char *text = cli_alloc(capacity + 1, 1);
    errno = 0;
    for (size_t got; (got = fread(text + n, 1, capacity - n, file)) > 0;) {
        n += got;
        if (n >= limit) break;
        if (n < capacity) continue;
        char *grown = realloc(text, (capacity *= 2) + 1);
        if (!grown) {
            free(text);
            errno = ENOMEM;
            return NULL;
        }
        text = grown;
    }
    if (n < limit && !ferror(file)) {
        text[n] = 0;
        *length = n;
        return text;
    }
    if (n >= limit) errno = EFBIG;
    else if (!errno) errno = EIO;
    free(text);
    return NULL;
}

enum imp_status settings_pose(const char *name)
{
    const char *dot = strrchr(name, '.');
    size_t index;
    if (imp_scene_find_param(cli.scene, name, &index) == IMP_OK) return IMP_OK;
    const enum imp_status st = imp_scene_add_geometry(cli.scene, name);
    /* What is wrong with a name that parameters of other kinds may have is said later. */
    return st == IMP_E_ARG && !(dot && !strcmp(dot, ".pose")) ? IMP_OK : st;
}

#define SET_FILE_MAX ((size_t)256 << 20) /* ten million numbers of 17 digits */

/* Files that were read before their settings are applied. */
static struct held {
    char *path, *text;
    size_t length;
} * held;
static size_t n_held;

static char *file_read(const char *path, size_t *length)
{
    FILE *f = fopen(path, "r");
    if (!f) return NULL;
    char *text = read_all(f, SET_FILE_MAX, length);
    const int code = errno;
    fclose(f);
    errno = code;
    return text;
}

const char *settings_hold(const char *path, size_t *length)
{
    char *text = file_read(path, length);
    if (!text) return NULL;
    struct held *grown = realloc(held, (n_held + 1) * sizeof *grown);
    if (!grown) exit(cli_error(EXIT_RUN, "out of memory"));
    held = grown;
    held[n_held++] = (struct held){cli_strdup(path), text, *length};
    return text;
}

/* The first of this name is given away; else the file is read. */
static char *held_take(const char *path, size_t *length)
{
    for (size_t k = 0; k < n_held; k++) {
        if (!held[k].text || strcmp(held[k].path, path) != 0) continue;
        char *text = held[k].text;
        *length = held[k].length;
        free(held[k].path);
        held[k] = (struct held){NULL, NULL, 0};
        return text;
    }
    return file_read(path, length);
}

/* "@FILE": one ID=VALUE a line; empty lines and lines that begin with # are skipped. */
static int apply_set_file(const char *path)
{
    const bool reads = ranks_reads();
    size_t length = 0;
    int rc;
    char *text = reads ? held_take(path, &length) : NULL;
    const int code = errno;
    if (reads && !text && code == EFBIG)
        return cli_error(EXIT_USAGE, "--set @%s: not shorter than %zu MiB", path,
                         SET_FILE_MAX >> 20);
    if (reads && !text)
        return cli_error(code == ENOMEM ? EXIT_RUN : EXIT_USAGE, "--set @%s: %s", path,
                         strerror(code));
    if (cli.mpi_files == 0 && (rc = ranks_broadcast(&text, &length))) return rc;
    const enum imp_status st = imp_scene_set_text(cli.scene, text, length, path);
    free(text);
    return st == IMP_OK ? 0 : cli_fail(st, path);
}

static int apply_set(const char *text)
{
    char *what;
    const enum imp_status st = imp_scene_set_text(cli.scene, text, strlen(text), NULL);
    if (st == IMP_OK) return 0;
    if (asprintf(&what, "--set %s", text) < 0) exit(cli_error(EXIT_RUN, "out of memory"));
    const int rc = cli_fail(st, what);
    free(what);
    /* Numbers that no scene can have are the caller's mistake, though they are found when things move. */
    return st == IMP_E_NUMERIC ? EXIT_USAGE : rc;
}

int settings_apply(const char *text)
{
    return *text == '@' ? apply_set_file(text + 1) : apply_set(text);
}
