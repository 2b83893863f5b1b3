/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer as a scene file. */
#include "fit_scene.h"

#include "shared/command.h"
#include "shared/output.h"
#include "shared/picture_files.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SCENE    "scene.xml"
#define TEXTURES "textures.txt"

/* ---- Where the scene is, seen from the folder ------------------------------------------- */

/* A path from folder `from` to file `to`, both without links, dots and repeated slashes. */
static char *path_between(const char *from, const char *to)
{
    size_t same = 0, up = 0;
    for (size_t i = 0;; i++) {
        const int from_ends = !from[i] || from[i] == '/', to_ends = to[i] == '/';
        if (from_ends && to_ends) same = i;
        if (!from[i] || from[i] != to[i]) break;
    }
    for (const char *c = from + same; *c; c++) up += *c == '/' && c[1];
    const char *rest = to + same + (to[same] == '/');
    const size_t n = 3 * up + strlen(rest) + 1;
    char *path = cli_alloc(n, 1), *at = path;
    for (size_t i = 0; i < up; i++, at += 3) memcpy(at, "../", 3);
    memcpy(at, rest, strlen(rest) + 1);
    return path;
}

/* The file `path` as a scene in -o DIR has to name it; without such a file: as it is. */
static char *named(const char *path)
{
    char *from = realpath(cli.out, NULL), *to = realpath(path, NULL), *name;
    name = from && to ? path_between(from, to) : cli_strdup(path);
    free(from);
    free(to);
    return name;
}

/* ---- XML -------------------------------------------------------------------------------- */

/* The value of an attribute: a scene file's own parameters begin with $. */
static void put_value(FILE *f, const char *text)
{
    for (; *text; text++) switch (*text) {
        case '&': fputs("&amp;", f); break;
        case '<': fputs("&lt;", f); break;
        case '"': fputs("&quot;", f); break;
        case '\n': fputs("&#10;", f); break;
        case '\t': fputs("&#9;", f); break;
        case '$': fputs("\\$", f); break;
        default: fputc(*text, f);
        }
}

static void put_file(FILE *f, const char *tag, const char *attribute, const char *path)
{
    char *name = named(path);
    fprintf(f, "    <%s %s=\"", tag, attribute);
    put_value(f, name);
    fputs("\"/>\n", f);
    free(name);
}

/* "NAME=VALUE" */
static void put_pair(FILE *f, const char *tag, const char *pair)
{
    const char *equal = strchr(pair, '=');
    char *name = cli_strdup(pair);
    if (equal) {
        name[equal - pair] = 0;
        fprintf(f, "    <%s name=\"", tag);
        put_value(f, name);
        fputs("\" value=\"", f);
        put_value(f, equal + 1);
        fputs("\"/>\n", f);
    }
    free(name);
}

static void put_search(FILE *f)
{
    char *all = cli_strdup(cli.search ? cli.search : ""), *rest = NULL;
    for (char *one = strtok_r(all, ";", &rest); one; one = strtok_r(NULL, ";", &rest))
        put_file(f, "path", "value", one);
    free(all);
}

static void put_scene(FILE *f, int textures)
{
    fprintf(f,
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
            "<!-- importon %s: a scene, with the values that were found. -->\n"
            "<scene version=\"3.0.0\">\n",
            imp_version());
    put_search(f);
    for (size_t i = 0; i < cli.defines.n; i++)
        put_pair(f, "default", cli.defines.item[i]);
    put_file(f, "include", "filename", cli.scene_path);
    for (size_t i = 0; i < cli.sets.n; i++) {
        const char *set = cli.sets.item[i];
        if (*set == '@') put_file(f, "set", "filename", set + 1);
        else put_pair(f, "set", set);
    }
    fputs("    <set filename=\"recovered.txt\"/>\n", f);
    if (textures) fprintf(f, "    <set filename=\"%s\"/>\n", TEXTURES);
    fputs("</scene>\n", f);
}

/* ---- Files ------------------------------------------------------------------------------ */

static void put_values(FILE *f, const char *name)
{
    struct imp_param_info info = {.size = sizeof info};
    size_t index;
    if (imp_scene_find_param(cli.scene, name, &index) != IMP_OK ||
        imp_scene_get_param(cli.scene, index, &info) != IMP_OK)
        return;
    double *values = cli_alloc(info.count, sizeof *values);
    if (imp_scene_get_values(cli.scene, index, values) == IMP_OK) {
        fprintf(f, "%s=", info.name);
        for (size_t i = 0; i < info.count; i++)
            fprintf(f, "%s%.17g", i ? "," : "", values[i]);
        fputc('\n', f);
    }
    free(values);
}

/* A former fit's file would read what this one has found; fit_scene_writable has looked whose it
 * is. Only the rank that writes: another would remove what that one has just written. */
static void former_remove(const char *path)
{
    if (cli_writes()) (void)unlink(path);
}

static int textures_write(const char *const *large, size_t n)
{
    char *path = join_path(cli.out, TEXTURES);
    struct output to;
    int rc = 0;
    if (n == 0) {
        former_remove(path);
    } else if (!(rc = output_open(&to, path, OUTPUT_SETTINGS))) {
        fprintf(to.file, "# importon %s textures\n", imp_version());
        for (size_t k = 0; k < n; k++) put_values(to.file, large[k]);
        rc = output_close(&to, 0);
    }
    free(path);
    return rc;
}

int fit_scene_writable(void)
{
    const int rc = overwrite_check_in(cli.out, SCENE, OUTPUT_SCENE);
    return rc ? rc : overwrite_check_in(cli.out, TEXTURES, OUTPUT_SETTINGS);
}

int fit_scene_write(const char *const *large, size_t n)
{
    char *path = join_path(cli.out, SCENE);
    struct output to;
    int rc = textures_write(large, n);
    if (!rc) former_remove(path);
    /* A scene from standard input is in no file that could be included. */
    if (!rc && cli.luminaires.n)
        cli_say("importon: no %s is written: a scene file has no --luminaire", SCENE);
    else if (!rc && access(cli.scene_path, F_OK) == 0 &&
             !(rc = output_open(&to, path, OUTPUT_SCENE))) {
        put_scene(to.file, n > 0);
        rc = output_close(&to, 0);
    }
    free(path);
    return rc;
}
