/* SPDX-License-Identifier: Apache-2.0
 *
 * --choose, --catalogue, --lamps and what is said of them. */
#include "design_lamps.h"
#include "shared/command.h"
#include "shared/overwrite.h"

#include <errno.h>
#include <fnmatch.h>
#include <importon/plan.h>
#include <importon/rooms.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define ITEMS_MAX 1000

static struct {
    struct arg_list choose, watts, cost;
    const char *catalogue, *lamps, *levels;
    int all;
} o;

const struct arg_option options_lamps[] = {
    {ARG_LIST, 0, "choose", "NAME=FILE[,..]",
     "photometric files, one of which takes the place of each luminaire of this name or "
     "pattern; none: the place may stay empty",
     &o.choose, 0, 0, NULL},
    {ARG_TEXT, 0, "catalogue", "FILE",
     "the same from a file: lines NAME FILE, with watts=W, cost=C, levels=LO,HI behind",
     &o.catalogue, 0, 0, NULL},
    {ARG_TEXT, 0, "lamps", "NAME[,..]",
     "emitters that may be dimmed and left out, by name or pattern (default: those of "
     "--choose and --catalogue, else all luminaires)",
     &o.lamps, 0, 0, NULL},
    {ARG_FLAG, 0, "all", NULL, "each place has a lamp", &o.all, 0, 0, NULL},
    {ARG_TEXT, 0, "levels", "LO[,HI]",
     "levels of a lamp that is used (default 0.1,1; equal ones: on or off)", &o.levels, 0,
     0, NULL},
    {ARG_LIST, 0, "watts", "[NAME=]W", "watts at level 1, in place of the file's",
     &o.watts, 0, 0, NULL},
    {ARG_LIST, 0, "cost", "[NAME=]C", "cost of a lamp, for --least cost", &o.cost, 0, 0,
     NULL},
    {0}};

/* A line of the catalogue: FILE in the places of NAME; without a file, "none". */
struct item {
    char *name, *file;
    double watts, cost, least, most; /* 0: not given */
};
static struct {
    struct item *item;
    size_t n;
    char **text; /* [n_texts] for the loader */
    size_t n_texts;
} catalogue;

static int levels_read(const char *text, double *lo, double *hi)
{
    char end;
    *hi = 1;
    const int n = sscanf(text, "%lf,%lf%c", lo, hi, &end);
    return (n == 1 && !strchr(text, ',') && sscanf(text, "%lf%c", lo, &end) == 1) ||
                   n == 2
               ? *lo > 0 && *lo <= *hi && *hi <= 1
               : 0;
}

static int item_add(const char *name, const char *file, struct item **out)
{
    if (catalogue.n == ITEMS_MAX)
        return cli_error(EXIT_USAGE, "a catalogue has %d lines at most", ITEMS_MAX);
    if (!catalogue.item) catalogue.item = cli_alloc(ITEMS_MAX, sizeof *catalogue.item);
    struct item *item = &catalogue.item[catalogue.n++];
    *item = (struct item){.name = cli_strdup(name)};
    if (strcmp(file, "none") != 0) item->file = cli_strdup(file);
    *out = item;
    return 0;
}

bool design_is_catalogued(void) { return catalogue.n > 0; }

static int choose_read(const char *text)
{
    char *copy = cli_strdup(text), *save = NULL, *equal = strchr(copy, '=');
    int rc = 0;
    struct item *item;
    if (!equal || equal == copy || !equal[1])
        rc = cli_error(EXIT_USAGE,
                       "--choose %s: expected NAME=FILE,FILE, or NAME=FILE,none", text);
    else {
        *equal = 0;
        for (char *f = strtok_r(equal + 1, ",", &save); f && !rc;
             f = strtok_r(NULL, ",", &save))
            rc = item_add(copy, f, &item);
    }
    free(copy);
    return rc;
}

/* "key=value" behind a line. */
static int setting_read(const char *word, size_t line, struct item *item)
{
    const char *equal = strchr(word, '=');
    char *end = NULL;
    const size_t n = equal ? (size_t)(equal - word) : 0;
    const double value = equal ? strtod(equal + 1, &end) : NAN;
    const bool number = equal && end != equal + 1 && !*end && value > 0 && value < 1e12;
    if (n == 5 && !strncmp(word, "watts", n) && number) item->watts = value;
    else if (n == 4 && !strncmp(word, "cost", n) && number) item->cost = value;
    else if (!(n == 6 && !strncmp(word, "levels", n) &&
               levels_read(equal + 1, &item->least, &item->most)))
        return cli_error(EXIT_USAGE,
                         "%s:%zu: %s: expected watts=W, cost=C (above 0), or "
                         "levels=LO,HI in (0, 1]",
                         o.catalogue, line, word);
    return 0;
}

static int line_read(char *text, size_t line)
{
    char *save = NULL, *hash = strchr(text, '#');
    struct item *item;
    if (hash) *hash = 0;
    const char *name = strtok_r(text, " \t\r\n", &save);
    if (!name) return 0;
    const char *file = strtok_r(NULL, " \t\r\n", &save);
    if (!file || strchr(file, ',') || strchr(name, '='))
        return cli_error(
            EXIT_USAGE,
            "%s:%zu: %s: expected NAME FILE, or NAME none: luminaires of the "
            "scene, and a photometric file",
            o.catalogue, line, name);
    int rc = item_add(name, file, &item);
    for (char *word; !rc && (word = strtok_r(NULL, " \t\r\n", &save));)
        rc = item->file ? setting_read(word, line, item)
                        : cli_error(EXIT_USAGE, "%s:%zu: %s: 'none' has no settings",
                                    o.catalogue, line, word);
    return rc;
}

static int file_read(void)
{
    char *text = NULL;
    size_t room = 0, line = 0;
    int rc = 0;
    FILE *f = fopen(o.catalogue, "r");
    if (!f) return cli_error(EXIT_USAGE, "%s: %s", o.catalogue, strerror(errno));
    overwrite_protect(o.catalogue);
    while (!rc && getline(&text, &room, f) >= 0) rc = line_read(text, ++line);
    if (!rc && ferror(f))
        rc = cli_error(EXIT_RUN, "%s: %s", o.catalogue, strerror(errno));
    if (!rc && catalogue.n == 0)
        rc = cli_error(EXIT_USAGE, "%s: there is no line in it", o.catalogue);
    free(text);
    fclose(f);
    return rc;
}

/* Files of one name. */
static size_t files_of(const char *name)
{
    size_t n = 0;
    for (size_t k = 0; k < catalogue.n; k++)
        n += catalogue.item[k].file && !strcmp(catalogue.item[k].name, name);
    return n;
}

/* "NAME=FILE,FILE" for the loader, once for each name. */
static void luminaires_set(void)
{
    for (size_t k = 0; k < catalogue.n; k++) {
        const char *name = catalogue.item[k].name;
        bool first = true;
        for (size_t i = 0; i < k; i++) first &= strcmp(catalogue.item[i].name, name) != 0;
        if (!first || files_of(name) == 0) continue;
        size_t size = strlen(name) + 2;
        for (size_t i = 0; i < catalogue.n; i++)
            if (catalogue.item[i].file) size += strlen(catalogue.item[i].file) + 1;
        char *text = cli_alloc(size, 1);
        if (!catalogue.text)
            catalogue.text = cli_alloc(ITEMS_MAX, sizeof *catalogue.text);
        catalogue.text[catalogue.n_texts++] = text;
        strcat(strcat(text, name), "=");
        for (size_t i = 0, n = 0; i < catalogue.n; i++)
            if (catalogue.item[i].file && !strcmp(catalogue.item[i].name, name))
                strcat(n++ ? strcat(text, ",") : text, catalogue.item[i].file);
        args_list_add(&cli.luminaires, text);
    }
}

int design_catalogue_read(void)
{
    int rc = 0;
    double lo, hi;
    if (o.levels && !levels_read(o.levels, &lo, &hi))
        return cli_error(EXIT_USAGE, "--levels %s: expected LO or LO,HI in (0, 1]",
                         o.levels);
    for (size_t k = 0; k < o.choose.n && !rc; k++) rc = choose_read(o.choose.item[k]);
    if (!rc && o.catalogue) rc = file_read();
    if (!rc) luminaires_set();
    return rc;
}

/* ---- The lamps of the scene --------------------------------------------------------------- */

/* Does the emitter belong to this line? With several files of a name it is "PLACE:FILE". */
static bool is_of(const struct item *item, const char *emitter)
{
    const char *colon = strchr(emitter, ':');
    if (files_of(item->name) < 2) return !colon && fnmatch(item->name, emitter, 0) == 0;
    if (!colon) return false;
    char *place = cli_strdup(emitter);
    place[colon - emitter] = 0;
    bool is = fnmatch(item->name, place, 0) == 0;
    free(place);
    if (is && item->file) {
        const char *base = strrchr(item->file, '/');
        base = base ? base + 1 : item->file;
        const char *dot = strrchr(base, '.');
        const size_t n = dot && dot > base ? (size_t)(dot - base) : strlen(base);
        is = strlen(colon + 1) == n && !strncmp(colon + 1, base, n);
    }
    return is;
}

static bool is_named(const char *list, const char *name)
{
    char *copy = cli_strdup(list), *save = NULL;
    bool is = false;
    for (char *g = strtok_r(copy, ",", &save); g; g = strtok_r(NULL, ",", &save))
        is |= fnmatch(g, name, 0) == 0;
    free(copy);
    return is;
}

static bool is_luminaire(const char *name)
{
    for (int i = 0; i < imp_scene_n_luminaires(cli.scene); i++) {
        struct imp_luminaire_info info = {.size = sizeof info};
        if (imp_scene_get_luminaire(cli.scene, i, &info) == IMP_OK &&
            !strcmp(info.name, name))
            return true;
    }
    return false;
}

static void lamp_add(struct design_lamps *out, const char *name)
{
    struct imp_design_lamp l = IMP_DESIGN_LAMP_INIT;
    bool empty = !o.all, met = false;
    const size_t k = out->n;
    l.lamp = name;
    if (o.levels) levels_read(o.levels, &l.least, &l.most);
    for (size_t i = 0; i < catalogue.n; i++) {
        const struct item *item = &catalogue.item[i];
        if (!is_of(item, name)) continue;
        if (!met) empty = false; /* a catalogue says so itself */
        met = true;
        if (!item->file) empty = !o.all;
        else {
            out->file[k] = item->file;
            if (item->watts > 0) l.watts = item->watts;
            if (item->cost > 0) l.cost = item->cost;
            if (item->least > 0) l.least = item->least, l.most = item->most;
        }
    }
    const bool wanted = o.lamps       ? is_named(o.lamps, name)
                        : catalogue.n ? met
                                      : is_luminaire(name);
    if (!wanted && !met) return;
    out->place[k] = cli_strdup(name);
    if (strchr(name, ':') && met) *strchr(out->place[k], ':') = 0;
    l.place = out->place[k];
    l.needed = !empty;
    out->lamp[out->n++] = l;
}

/* --watts and --cost: a number, or one for names. */
static int numbers_set(const char *option, const char *text, struct design_lamps *out,
                       size_t offset)
{
    const char *equal = strrchr(text, '=');
    char *end, *glob = cli_strdup(equal ? text : "*");
    const double value = strtod(equal ? equal + 1 : text, &end);
    size_t met = 0;
    int rc = 0;
    if (equal) glob[equal - text] = 0;
    if (end == (equal ? equal + 1 : text) || *end || !(value > 0 && value < 1e12))
        rc = cli_error(EXIT_USAGE,
                       "--%s %s: expected a number above 0, or NAME= before it", option,
                       text);
    for (size_t k = 0; k < out->n && !rc; k++)
        if (fnmatch(glob, out->lamp[k].lamp, 0) == 0) {
            memcpy((char *)&out->lamp[k] + offset, &value, sizeof value);
            met++;
        }
    if (!rc && !met)
        rc = cli_error(EXIT_USAGE, "--%s %s: no lamp of the design has this name", option,
                       text);
    free(glob);
    return rc;
}

int design_lamps_make(struct design_lamps *out)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    int rc = 0;
    imp_scene_get_info(cli.scene, &scene);
    const size_t most = (size_t)scene.n_emitters;
    *out = (struct design_lamps){cli_alloc(most, sizeof *out->lamp),
                                 cli_alloc(most, sizeof *out->file),
                                 cli_alloc(most, sizeof *out->place), 0};
    for (int e = 0; e < scene.n_emitters; e++) {
        const char *name = imp_plan_lamp(cli.scene, e);
        if (name) lamp_add(out, name);
    }
    if (out->n == 0)
        rc = cli_error(EXIT_USAGE,
                       o.lamps ? "--lamps %s: the scene has no emitter of this name"
                               : "%s: there is no luminaire (emitter ies) in it; --lamps "
                                 "names other emitters",
                       o.lamps ? o.lamps : cli.scene_path);
    for (size_t k = 0; k < o.watts.n && !rc; k++)
        rc = numbers_set("watts", o.watts.item[k], out,
                         offsetof(struct imp_design_lamp, watts));
    for (size_t k = 0; k < o.cost.n && !rc; k++)
        rc = numbers_set("cost", o.cost.item[k], out,
                         offsetof(struct imp_design_lamp, cost));
    return rc;
}

void design_lamps_free(struct design_lamps *l)
{
    for (size_t k = 0; k < l->n; k++) free(l->place[k]);
    free(l->place);
    free(l->file);
    free(l->lamp);
    for (size_t k = 0; k < catalogue.n; k++) {
        free(catalogue.item[k].name);
        free(catalogue.item[k].file);
    }
    for (size_t k = 0; k < catalogue.n_texts; k++) free(catalogue.text[k]);
    free(catalogue.text);
    free(catalogue.item);
    args_list_free(&o.choose);
    args_list_free(&o.watts);
    args_list_free(&o.cost);
}
