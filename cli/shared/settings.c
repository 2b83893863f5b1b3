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

static int set_error(const char *where, const char *text, const char *why)
{
    if (where) return cli_error(EXIT_USAGE, "%s: '%.60s': %s", where, text, why);
    return cli_error(EXIT_USAGE, "--set %s: %s", text, why);
}

enum imp_status settings_pose(const char *name)
{
    static const char *const tails[] = {"pose",
                                        "scale",
                                        "vertex_positions",
                                        "x_fov",
                                        "principal_point_offset_x",
                                        "principal_point_offset_y",
                                        "position",
                                        "direction"};
    const char *dot = strrchr(name, '.');
    size_t index;
    for (size_t k = 0; dot && k < sizeof tails / sizeof *tails; k++) {
        if (strcmp(dot + 1, tails[k]) != 0) continue;
        if (imp_scene_find_param(cli.scene, name, &index) == IMP_OK) return IMP_OK;
        const enum imp_status st = imp_scene_add_geometry(cli.scene, name);
        /* What is wrong with a name that parameters of other kinds may have is said later. */
        return st == IMP_E_ARG && k > 0 ? IMP_OK : st;
    }
    return IMP_OK;
}

/* One --set: "name=v" or "name=v,v,..". Messages begin with `where` it is written; NULL: on
 * the command line. */
static int apply_set(const char *where, const char *text)
{
    const char *equal = strchr(text, '=');
    char *name, *end, why[96];
    double *values = NULL;
    size_t index, n = 0;
    int rc = 0;
    enum imp_status st;

    if (!equal || equal == text) return set_error(where, text, "expected ID=VALUE");
    name = cli_alloc((size_t)(equal - text) + 1, 1);
    memcpy(name, text, (size_t)(equal - text));
    values = cli_alloc(strlen(equal), sizeof *values); /* more than there can be */
    for (const char *p = equal + 1;; p = end + 1) {
        values[n++] = strtod(p, &end);
        if (end == p || (*end && *end != ',')) {
            snprintf(why, sizeof why, "'%.60s' is not a number", p);
            rc = set_error(where, text, why);
            goto out;
        }
        if (!*end) break;
    }
    st = settings_pose(name);
    if (st == IMP_OK) st = imp_scene_find_param(cli.scene, name, &index);
    if (st == IMP_OK) st = imp_scene_set_values(cli.scene, index, n, values);
    if (st != IMP_OK) rc = cli_fail(st, where ? where : cli.scene_path);
out:
    free(name);
    free(values);
    return rc;
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
    size_t length = 0, number = 0;
    int rc = 0;
    char *text = reads ? held_take(path, &length) : NULL;
    const int code = errno;
    if (reads && !text && code == EFBIG)
        return cli_error(EXIT_USAGE, "--set @%s: not shorter than %zu MiB", path,
                         SET_FILE_MAX >> 20);
    if (reads && !text)
        return cli_error(code == ENOMEM ? EXIT_RUN : EXIT_USAGE, "--set @%s: %s", path,
                         strerror(code));
    if (cli.mpi_files == 0 && (rc = ranks_broadcast(&text, &length))) return rc;
    for (char *line = text, *next; !rc && line < text + length; line = next) {
        char *end = memchr(line, '\n', (size_t)(text + length - line)), *where;
        if (!end) end = text + length;
        next = end + 1;
        if (end > line && end[-1] == '\r') end--;
        *end = 0;
        if (asprintf(&where, "%s:%zu", path, ++number) < 0)
            exit(cli_error(EXIT_RUN, "out of memory"));
        if (strlen(line) != (size_t)(end - line))
            rc = cli_error(EXIT_USAGE, "%s: a zero byte: this is no list of settings",
                           where);
        else if (*line && *line != '#') rc = apply_set(where, line);
        free(where);
    }
    free(text);
    return rc;
}

int settings_apply(const char *text)
{
    return *text == '@' ? apply_set_file(text + 1) : apply_set(NULL, text);
}
