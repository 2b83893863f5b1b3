/* SPDX-License-Identifier: Apache-2.0
 *
 * --move and what is said of it. */
#include "design_moves.h"
#include "shared/command.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOVES_MAX 1000

static struct {
    struct arg_list move;
    double clearance;
    int steps, starts;
} o = {.clearance = 0.1};

const struct arg_option options_moves[] = {
    {ARG_LIST, 0, "move", "NAME[I-J][=LO,HI]",
     "places and aims of lamps that may change, by name or pattern, such as "
     "'lamp_*.position[0-1]'; LO,HI: bounds (default: the box of all shapes)",
     &o.move, 0, 0, NULL},
    {ARG_NUMBER, 0, "clearance", "LENGTH",
     "of what moves, from the box of all shapes (default 0.1 scene units)", &o.clearance,
     0, 1e9, NULL},
    {ARG_INT, 0, "steps", "N", "of a search for places, at most (default 60)", &o.steps,
     1, 10000, NULL},
    {ARG_INT, 0, "starts", "N",
     "searches for places: from the present ones, and from places that are drawn (1)",
     &o.starts, 1, 1000, NULL},
    {0}};

/* NAME[I-J]=LO,HI in its parts; name is a copy, to be freed. */
struct wish {
    char *name;
    int first, last; /* components; -1: all */
    double lo, hi;
};

static bool wish_read(const char *text, struct wish *w)
{
    *w = (struct wish){.name = cli_strdup(text), .first = -1};
    char *equal = strchr(w->name, '='), end;
    if (equal) {
        *equal = 0;
        if (sscanf(equal + 1, "%lf,%lf%c", &w->lo, &w->hi, &end) != 2 || !(w->lo < w->hi))
            return false;
    }
    char *open = strrchr(w->name, '[');
    const size_t length = strlen(w->name);
    if (!open || length == 0 || w->name[length - 1] != ']') return length > 0;
    const bool range = sscanf(open, "[%d-%d]%c", &w->first, &w->last, &end) == 2;
    if (!range && sscanf(open, "[%d]%c", &w->first, &end) != 1) return false;
    if (!range) w->last = w->first;
    *open = 0;
    return w->first >= 0 && w->first <= w->last && w->last < 6;
}

static bool ends_with(const char *name, const char *end)
{
    const size_t n = strlen(name), m = strlen(end);
    return n > m && !strcmp(name + n - m, end);
}

static int wish_take(const struct wish *w, const char *text, struct design_moves *out)
{
    char name[300];
    size_t found = 0;
    for (size_t k = 0; imp_scene_geometry_name(cli.scene, k, sizeof name, name) == IMP_OK;
         k++) {
        const bool pose = ends_with(name, ".pose");
        if (fnmatch(w->name, name, 0) != 0 ||
            !(pose || ends_with(name, ".position") || ends_with(name, ".direction")))
            continue;
        const int last = pose ? 5 : 2;
        found++;
        if (w->last > last)
            return cli_error(EXIT_USAGE, "--move %s: %s has %d numbers", text, name,
                             last + 1);
        for (int c = w->first < 0 ? 0 : w->first; c <= (w->first < 0 ? last : w->last);
             c++) {
            if (out->n == MOVES_MAX)
                return cli_error(EXIT_USAGE, "--move: more than %d numbers", MOVES_MAX);
            out->move[out->n++] = (struct imp_design_move){.size = sizeof *out->move,
                                                           .name = cli_strdup(name),
                                                           .component = c,
                                                           .lo = w->lo,
                                                           .hi = w->hi};
        }
    }
    if (found > 0) return 0;
    return cli_error(
        EXIT_USAGE,
        "--move %s: nothing of this name can be moved; positions are of point "
        "and spot lights and luminaires without a shape, poses of shapes",
        text);
}

int design_moves_make(bool catalogued, struct design_moves *out,
                      struct imp_design_options *options)
{
    int rc = 0;
    options->clearance = o.clearance;
    options->steps = o.steps;
    options->starts = o.starts;
    if (o.move.n == 0 &&
        (cli_typed("clearance") || cli_typed("steps") || cli_typed("starts")))
        return cli_error(EXIT_USAGE, "--clearance, --steps and --starts go with --move");
    if (o.move.n == 0) return 0;
    if (catalogued)
        return cli_error(
            EXIT_USAGE,
            "--move goes without --choose and --catalogue: choose first, then "
            "move what was chosen (--luminaire)");
    out->move = cli_alloc(MOVES_MAX, sizeof *out->move);
    for (size_t k = 0; k < o.move.n && !rc; k++) {
        struct wish w;
        if (!wish_read(o.move.item[k], &w))
            rc = cli_error(EXIT_USAGE,
                           "--move %s: expected NAME, NAME[2] or NAME[0-1], and =LO,HI "
                           "behind it for bounds",
                           o.move.item[k]);
        else rc = wish_take(&w, o.move.item[k], out);
        free(w.name);
    }
    return rc;
}

void design_moves_free(struct design_moves *m)
{
    for (size_t i = 0; i < m->n; i++) free((void *)(uintptr_t)m->move[i].name);
    free(m->move);
    *m = (struct design_moves){0};
}

/* Ends of the other starts, and how many are as good within the errors of both. */
static void starts_print(const struct imp_design_answer *a)
{
    size_t best = 0, as_good = 0, none = 0;
    for (size_t s = 1; s < a->n_starts; s++)
        if (a->start_objective[s] < a->start_objective[best]) best = s;
    if (a->n_starts < 2) return;
    printf("starts: ");
    for (size_t s = 0; s < a->n_starts; s++) {
        const double value = a->start_objective[s];
        none += isinf(value);
        as_good += s != best && isfinite(value) &&
                   value - a->start_objective[best] <= 2 * a->objective_se;
        if (isinf(value)) printf("%snone", s ? ", " : "");
        else printf("%s%.1f", s ? ", " : "", value);
    }
    printf("; %zu of the others %s as good within two errors", as_good,
           as_good == 1 ? "is" : "are");
    if (none > 0) printf(", %zu end%s without an answer", none, none == 1 ? "s" : "");
    printf("\n");
}

void design_moves_print(const struct design_moves *m, const struct imp_design_answer *a)
{
    int width = 5;
    for (size_t i = 0; i < m->n; i++) {
        const int n = (int)strlen(m->move[i].name) + 3;
        width = n > width ? n : width;
    }
    if (a->n_moves == 0) return;
    printf("\n%-*s  from      to        after %d step%s\n", width, "moved", a->steps,
           plural(a->steps));
    for (size_t i = 0; i < a->n_moves; i++) {
        char name[320];
        snprintf(name, sizeof name, "%s[%d]", m->move[i].name, m->move[i].component);
        printf("%-*s  %-8.4g  %.4g\n", width, name, a->moved_from[i], a->moved_to[i]);
    }
    starts_print(a);
}

void design_moves_json(struct json *j, const struct design_moves *m,
                       const struct imp_design_answer *a)
{
    json_array(j, "moves");
    for (size_t i = 0; i < a->n_moves; i++) {
        json_object(j, NULL);
        json_text(j, "name", m->move[i].name);
        json_integer(j, "component", m->move[i].component);
        json_number(j, "from", a->moved_from[i]);
        json_number(j, "to", a->moved_to[i]);
        json_end_object(j);
    }
    json_end_array(j);
    json_array(j, "starts");
    for (size_t s = 0; s < a->n_starts; s++) {
        json_object(j, NULL);
        json_number(j, "objective", a->start_objective[s]);
        json_numbers(j, "places", a->n_moves, a->start_place + s * a->n_moves);
        json_end_object(j);
    }
    json_end_array(j);
}

int design_moves_settings(FILE *f, const struct design_moves *m)
{
    for (size_t i = 0; i < m->n; i++) {
        struct imp_param_info info = {.size = sizeof info};
        double value[6];
        size_t param;
        if (i > 0 && !strcmp(m->move[i].name, m->move[i - 1].name)) continue;
        enum imp_status st = imp_scene_find_param(cli.scene, m->move[i].name, &param);
        if (st == IMP_OK) st = imp_scene_get_param(cli.scene, param, &info);
        if (st == IMP_OK) st = imp_scene_get_values(cli.scene, param, value);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        fprintf(f, "%s=", m->move[i].name);
        for (size_t k = 0; k < info.count; k++)
            fprintf(f, "%s%.9g", k ? "," : "", value[k]);
        fprintf(f, "\n");
    }
    return 0;
}
