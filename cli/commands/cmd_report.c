/* SPDX-License-Identifier: Apache-2.0
 *
 * importon report: what lies in a folder of results becomes one page. Pictures are known
 * by the names that fit, jacobian and render give them, JSON answers by their first keys. */
#include "shared/command.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/walk_items.h"

#include <dirent.h>
#include <errno.h>
#include <importon/report.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define JSON_MAX ((size_t)1 << 28) /* bytes of one answer */

static const char *title, *scene_file, *truth_file;
static struct arg_list walks;

static const struct arg_option options[] = {
    {ARG_TEXT, 0, "title", "TEXT", "title of the page (default: the folder's name)",
     &title, 0, 0, NULL},
    {ARG_TEXT, 0, "truth", "FILE",
     "draw what is true beside what a fit found: NAME=V[,V..] a line", &truth_file, 0, 0,
     NULL},
    {ARG_TEXT, 0, "scene", "SCENE", "show random walks of this scene", &scene_file, 0, 0,
     NULL},
    {ARG_LIST, 0, "walks", "N|X,Y",
     "of a grid of N x N pixels (default 16), or of this pixel", &walks, 0, 0, NULL},
    {0}};

/* What the page will hold, and what it is made of. */
struct collection {
    struct imp_report_item *item;
    size_t n;
    char **owned;
    size_t n_owned;
    imp_film **film;
    size_t n_films;
    const char *command; /* that made the result; of its picture */
};

static void *grown(void *array, size_t n, size_t size)
{
    void *more = realloc(array, n * size);
    if (!more) exit(cli_error(EXIT_RUN, "out of memory"));
    return more;
}

static char *keep(struct collection *c, char *text)
{
    c->owned = grown(c->owned, c->n_owned + 1, sizeof *c->owned);
    return c->owned[c->n_owned++] = text;
}

static struct imp_report_item *add(struct collection *c, const char *kind)
{
    c->item = grown(c->item, c->n + 1, sizeof *c->item);
    c->item[c->n] = (struct imp_report_item)IMP_REPORT_ITEM_INIT;
    c->item[c->n].kind = kind;
    return &c->item[c->n++];
}

static void collection_free(struct collection *c)
{
    for (size_t i = 0; i < c->n_films; i++) imp_film_destroy(c->film[i]);
    for (size_t i = 0; i < c->n_owned; i++) free(c->owned[i]);
    free(c->film);
    free(c->owned);
    free(c->item);
}

/* ---- Files of the folder --------------------------------------------------------- */

static bool ends(const char *name, const char *with)
{
    const size_t n = strlen(name), m = strlen(with);
    return n > m && !strcmp(name + n - m, with);
}

/* All of a file and a zero, to be freed; NULL with the reason printed. */
static char *file_text(const char *path, size_t *length)
{
    char *text = NULL;
    size_t used = 0, room = 0;
    FILE *f = fopen(path, "rb");
    while (f && !ferror(f) && !feof(f) && used < JSON_MAX) {
        room = room ? 2 * room : 65536;
        text = grown(text, room + 1, 1);
        used += fread(text + used, 1, room - used, f);
    }
    if (!f || ferror(f) || used >= JSON_MAX) {
        cli_error(EXIT_RUN, "%s: %s", path,
                  f && used >= JSON_MAX ? "longer than an answer" : strerror(errno));
        free(text);
        text = NULL;
    } else {
        text[used] = 0;
        *length = used;
    }
    if (f) fclose(f);
    return text;
}

/* Answers begin {"importon":"VERSION","command":"WORD", and the word is the item's kind;
 * other JSON is not ours. */
static int add_answer(struct collection *c, const char *path, const char *name)
{
    static const char head[] = "{\"importon\":\"", second[] = "\",\"command\":\"";
    size_t length;
    char *text = file_text(path, &length);
    if (!text) return EXIT_RUN;
    keep(c, text);
    const char *word =
        strncmp(text, head, sizeof head - 1) == 0 ? strstr(text, second) : NULL;
    const size_t n = word ? strcspn(word + sizeof second - 1, "\"") : 0;
    if (!n || word - text > 64) return 0;
    char *kind = keep(c, strndup(word + sizeof second - 1, n));
    struct imp_report_item *item = add(c, kind);
    item->name = name;
    item->json = text;
    return 0;
}

/* The pictures that controls.csv names are derivatives. */
static bool is_control(const char *table, const char *name)
{
    const size_t n = strlen(name);
    for (const char *line = table; line; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (!strncmp(line, name, n) && line[n] == ',') return true;
    }
    return false;
}

/* "target-2.exr" is the target of view 2. */
static int view_of(const char *stem)
{
    const char *dash = strrchr(stem, '-');
    return dash && dash[1] && strspn(dash + 1, "0123456789") == strlen(dash + 1)
               ? atoi(dash + 1)
               : 0;
}

static int add_picture(struct collection *c, const char *path, const char *name,
                       const char *controls)
{
    static const struct {
        const char *begins, *role, *shown;
    } known[] = {{"target", "target", "target"},
                 {"recovered", "picture", "recovered"},
                 {"before", NULL, "start"},
                 {"picture", "picture", "picture"}};
    imp_film *film = NULL;
    const int rc = picture_read(path, &film);
    if (rc) return rc;
    c->film = grown(c->film, c->n_films + 1, sizeof *c->film);
    c->film[c->n_films++] = film;
    /* The derivatives are there one by one. */
    if (imp_film_text(film, PICTURE_LAYERS)) return 0;
    char *stem = keep(c, strndup(name, strlen(name) - strlen(".exr")));
    /* The effect of the values that a fit did not determine is a derivative, too. */
    const bool loose = !strncmp(name, "undetermined", strlen("undetermined"));
    const bool control = loose || (controls && is_control(controls, name));
    struct imp_report_item *item = add(c, control ? "derivative" : "picture");
    item->name = stem;
    item->film = film;
    if (loose) {
        item->view = view_of(stem);
        item->role = "undetermined";
    }
    if (control) return 0;
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        const size_t n = strlen(known[k].begins);
        if (strncmp(name, known[k].begins, n) || (name[n] != '.' && name[n] != '-'))
            continue;
        item->role = known[k].role;
        if (item->role && !strcmp(item->role, "picture") && !c->command)
            c->command = imp_film_text(film, "importon.command");
        item->name = known[k].shown;
        item->view = view_of(stem);
    }
    return 0;
}

/* PNG and SVG files are taken where they are not the preview of a picture, or the curve
 * that the page draws itself. */
static int add_image(struct collection *c, const char *path, const char *name)
{
    char *exr = strdup(path);
    size_t length;
    if (!exr) return cli_error(EXIT_RUN, "out of memory");
    memcpy(strrchr(exr, '.'), ".exr", 4);
    const bool preview = access(exr, F_OK) == 0;
    free(exr);
    if (preview || !strcmp(name, "loss.svg")) return 0;
    char *bytes = file_text(path, &length);
    if (!bytes) return EXIT_RUN;
    struct imp_report_item *item = add(c, "image");
    item->name = name;
    item->image = keep(c, bytes);
    item->image_size = length;
    return 0;
}

/* Target, result, start, and the others by their names. */
static int place_of(const char *name)
{
    static const char *const first[] = {"target", "recovered", "picture", "before"};
    int k = 0;
    while (k < 4 && strncmp(name, first[k], strlen(first[k]))) k++;
    return k;
}
static int by_place(const struct dirent **a, const struct dirent **b)
{
    const int d = place_of((*a)->d_name) - place_of((*b)->d_name);
    return d ? d : strverscmp((*a)->d_name, (*b)->d_name);
}
static int is_result(const struct dirent *e)
{
    static const char *const extension[] = {".exr", ".json", ".png", ".svg"};
    bool good = false;
    for (size_t k = 0; k < sizeof extension / sizeof *extension; k++)
        good |= ends(e->d_name, extension[k]);
    return good && e->d_name[0] != '.';
}

static int collect(struct collection *c, const char *folder)
{
    struct dirent **entry = NULL;
    char *csv = join_path(folder, "controls.csv"), *controls = NULL;
    const int n = scandir(folder, &entry, is_result, by_place);
    int rc = n < 0 ? cli_error(EXIT_USAGE, "%s: %s", folder, strerror(errno)) : 0;
    if (n == 0)
        rc = cli_error(EXIT_USAGE,
                       "%s: no results of importon are there (*.exr, *.json, *.png)",
                       folder);
    FILE *f = n > 0 ? fopen(csv, "rb") : NULL;
    if (f) {
        fclose(f);
        size_t length;
        controls = file_text(csv, &length);
    }
    free(csv);
    for (int i = 0; i < n; i++) {
        const char *name = keep(c, cli_strdup(entry[i]->d_name));
        char *path = join_path(folder, name);
        if (!rc)
            rc = ends(name, ".exr")    ? add_picture(c, path, name, controls)
                 : ends(name, ".json") ? add_answer(c, path, name)
                                       : add_image(c, path, name);
        free(path);
        free(entry[i]);
    }
    free(entry);
    free(controls);
    return rc;
}

/* ---- Truth ------------------------------------------------------------------------ */

/* Lines NAME=V[,V..], as --set takes them, as an object: of one value NAME, of more NAME[0], .. */
static int add_truth(struct collection *c)
{
    size_t length, room;
    char *text = file_text(truth_file, &length), *out = NULL, *save = NULL, name[256];
    if (!text) return EXIT_RUN;
    keep(c, text);
    FILE *f = open_memstream(&out, &room);
    if (!f) exit(cli_error(EXIT_RUN, "out of memory"));
    struct json j = {f, 0};
    int rc = 0;
    json_object(&j, NULL);
    for (char *line = strtok_r(text, "\r\n", &save); line && !rc;
         line = strtok_r(NULL, "\r\n", &save)) {
        if (*line == '#') continue;
        char *at = strchr(line, '='), *end = at;
        const int many = at && strchr(at, ',') != NULL;
        if (at) *at = 0;
        for (int k = 0; end && (!k || *end == ',') && !rc; k++) {
            char *const from = end + 1;
            const double value = strtod(from, &end);
            if (end == from) end = NULL;
            snprintf(name, sizeof name, many ? "%s[%d]" : "%s", line, k);
            if (end) json_number(&j, name, value);
        }
        if (!end || *end || at == line)
            rc = cli_error(EXIT_USAGE, "%s: '%.60s': expected NAME=NUMBER[,NUMBER..]",
                           truth_file, line);
    }
    json_end_object(&j);
    fclose(f);
    struct imp_report_item *item = add(c, "truth");
    item->json = keep(c, out);
    item->name = truth_file;
    return rc;
}

/* ---- Walks ------------------------------------------------------------------------ */

/* --walks: a grid's side, or pixels; 0, or an exit code with the reason printed. */
static int pixels_read(const struct imp_sensor_info *sensor, int (**out)[2], size_t *n)
{
    int side = walks.n ? 0 : 16;
    *out = cli_alloc(walks.n + 64 * 64, sizeof **out);
    *n = 0;
    for (size_t k = 0; k < walks.n; k++) {
        int x, y, end = 0;
        const char *text = walks.item[k];
        if (sscanf(text, "%d,%d%n", &x, &y, &end) == 2 && !text[end]) {
            if (x < 0 || y < 0 || x >= sensor->width || y >= sensor->height)
                return cli_error(EXIT_USAGE, "--walks %s: the picture has %d x %d pixels",
                                 text, sensor->width, sensor->height);
            (*out)[*n][0] = x;
            (*out)[(*n)++][1] = y;
        } else if (sscanf(text, "%d%n", &x, &end) == 1 && !text[end] && x >= 1 &&
                   x <= 64 && !side) {
            side = x;
        } else {
            return cli_error(EXIT_USAGE,
                             "--walks '%s': a number from 1 to 64, or a pixel X,Y", text);
        }
    }
    for (int i = 0; i < side * side; i++, ++*n) {
        (*out)[*n][0] = (int)((i % side + 0.5) * sensor->width / side);
        (*out)[*n][1] = (int)((i / side + 0.5) * sensor->height / side);
    }
    return 0;
}

/* One walk from the middle of each cell of a grid over the picture, or 16 of each pixel
 * that is named. */
static int add_walks(struct collection *c)
{
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    int(*pixel)[2] = NULL;
    size_t n = 0;
    int rc = cli_load(scene_file);
    if (rc) return rc;
    const struct imp_run run = cli_run();
    const enum imp_status st = imp_scene_get_sensor(cli.scene, run.sensor, &sensor);
    if (st != IMP_OK) return cli_fail(st, scene_file);
    rc = pixels_read(&sensor, &pixel, &n);
    char *text = rc ? NULL
                    : walks_json(&run, n, (const int(*)[2])pixel,
                                 walks.n && strchr(walks.item[0], ',') ? 16 : 1, &rc);
    free(pixel);
    if (!text) return rc;
    struct imp_report_item *item = add(c, "walks");
    item->json = keep(c, text);
    item->name = scene_file;
    return 0;
}

static int run_report(int n, char **operand)
{
    struct collection all = {0};
    struct imp_report report = IMP_REPORT_INIT;
    (void)n;
    int rc = walks.n && !scene_file ? cli_error(EXIT_USAGE, "--walks needs --scene") : 0;
    if (!rc) rc = cli_open();
    if (rc) return rc;
    char *automatic = cli.out ? NULL : join_path(operand[0], "report.html");
    const char *path = cli.out ? cli.out : automatic;
    rc = collect(&all, operand[0]);
    if (!rc && truth_file) rc = add_truth(&all);
    if (!rc && scene_file) rc = add_walks(&all);
    if (!rc && strcmp(path, "-")) rc = overwrite_check(path, OUTPUT_PAGE);
    if (!rc) {
        report.title = title ? title : operand[0];
        report.command = all.command;
        report.items = all.item;
        report.n_items = all.n;
        const enum imp_status st = imp_report_write(
            cli.context, &report, strcmp(path, "-") ? path : "/dev/stdout");
        if (st != IMP_OK) rc = cli_fail(st, NULL);
        else
            cli_say("%s (pictures: %zu, answers: %zu)", path, all.n_films,
                    all.n - all.n_films);
    }
    collection_free(&all);
    free(automatic);
    return rc;
}

const struct command command_report = {
    {"report",
     "DIR",
     "one HTML page of the results in a folder",
     {options, options_scene, options_file, options_general},
     1,
     1},
    run_report,
    0,
    0,
    REPLAYS_NEVER};
