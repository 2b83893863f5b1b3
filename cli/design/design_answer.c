/* SPDX-License-Identifier: Apache-2.0
 *
 * What a design prints. */
#include "design_answer.h"
#include "read/room_wants.h"
#include "shared/command.h"
#include "shared/output.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const char *const objectives[] = {"W", "lm", ""};
static const char *const objective_words[] = {"watts", "flux", "cost"};

const struct imp_design_finding *design_finding(const struct design_answer *a, size_t k)
{
    return IMP_ROW(imp_design_finding, a->answer->wants, k);
}
static size_t used(const struct design_answer *a, const double *level)
{
    size_t n = 0;
    for (size_t j = 0; j < a->answer->n_lamps; j++) n += level[j] > 0;
    return n;
}

/* ---- Settings ------------------------------------------------------------------------- */

/* The parameter that an emitter's output goes with, and its values, to be freed; NULL: it has
 * none. */
static double *scale_find(const char *lamp, size_t *param, struct imp_param_info *info)
{
    static const char *const inputs[] = {"scale", "radiance", "irradiance", "intensity"};
    for (size_t k = 0; k < sizeof inputs / sizeof *inputs; k++) {
        char name[600];
        *info = (struct imp_param_info){.size = sizeof *info};
        snprintf(name, sizeof name, "%s.%s.value", lamp, inputs[k]);
        if (imp_scene_find_param(cli.scene, name, param) != IMP_OK ||
            imp_scene_get_param(cli.scene, *param, info) != IMP_OK)
            continue;
        double *value = cli_alloc(info->count, sizeof *value);
        if (imp_scene_get_values(cli.scene, *param, value) == IMP_OK) return value;
        free(value);
    }
    return NULL;
}

static int no_scale(const char *option, const char *lamp)
{
    return cli_error(EXIT_USAGE, "--%s: lamp '%s' has no scale that could be set", option,
                     lamp);
}

/* Level times its values makes the answer. */
static int setting_print(FILE *f, const char *lamp, double level)
{
    struct imp_param_info info;
    size_t param;
    double *value = scale_find(lamp, &param, &info);
    if (!value) return no_scale("settings", lamp);
    fprintf(f, "%s=", info.name);
    for (size_t i = 0; i < info.count; i++)
        fprintf(f, "%s%.9g", i ? "," : "", value[i] * level);
    fprintf(f, "\n");
    free(value);
    return 0;
}

int design_levels_apply(const struct design_answer *a)
{
    for (size_t j = 0; j < a->answer->n_lamps; j++) {
        struct imp_param_info info;
        size_t param;
        double *value = scale_find(a->lamps->lamp[j].lamp, &param, &info);
        if (!value) return no_scale("report", a->lamps->lamp[j].lamp);
        for (size_t i = 0; i < info.count; i++) value[i] *= a->answer->level[j];
        const enum imp_status st =
            imp_scene_set_values(cli.scene, param, info.count, value);
        free(value);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    }
    return 0;
}

/* A luminaire of a catalogue takes the place's name, as --luminaire PLACE=FILE makes it. */
static const char *name_set(const struct design_answer *a, size_t j)
{
    return a->lamps->file[j] ? a->lamps->place[j] : a->lamps->lamp[j].lamp;
}

/* Is another lamp of its place used, or has one been written for the place already? */
static bool place_taken(const struct design_answer *a, size_t j)
{
    for (size_t k = 0; k < a->answer->n_lamps; k++)
        if (k != j && !strcmp(a->lamps->place[k], a->lamps->place[j]) &&
            (a->answer->level[k] > 0 || k < j))
            return true;
    return false;
}

int design_settings_write(const char *path, const struct design_answer *a)
{
    struct output out;
    int rc = output_open(&out, path, OUTPUT_SETTINGS);
    if (rc) return rc;
    fprintf(out.file, "# importon %s %s\n", imp_version(), cli.name);
    for (size_t j = 0; j < a->answer->n_lamps && !rc; j++) {
        const double level = a->answer->level[j];
        if (level == 0 && place_taken(a, j)) continue;
        /* The parameters of this scene have the lamp's own name, those of the scene that is made
         * by --luminaire the place's. */
        char *text = NULL;
        size_t size = 0;
        FILE *memory = open_memstream(&text, &size);
        rc = memory ? setting_print(memory, a->lamps->lamp[j].lamp, level)
                    : cli_error(EXIT_RUN, "out of memory");
        if (memory) fclose(memory);
        if (!rc)
            fprintf(out.file, "%s%s", name_set(a, j),
                    text + strlen(a->lamps->lamp[j].lamp));
        free(text);
    }
    if (!rc) rc = design_moves_settings(out.file, a->moves);
    return output_close(&out, rc);
}

/* "--luminaire PLACE=FILE" of each place whose file is not the scene's. */
static void luminaires_print(const struct design_answer *a, struct json *j)
{
    for (size_t k = 0; k < a->answer->n_lamps; k++) {
        if (!a->lamps->file[k] || (a->answer->level[k] == 0)) continue;
        if (j) {
            char *text =
                cli_alloc(strlen(a->lamps->place[k]) + strlen(a->lamps->file[k]) + 2, 1);
            strcat(strcat(strcat(text, a->lamps->place[k]), "="), a->lamps->file[k]);
            json_text(j, NULL, text);
            free(text);
        } else printf("    --luminaire %s=%s\n", a->lamps->place[k], a->lamps->file[k]);
    }
}

/* ---- Text ----------------------------------------------------------------------------- */

static void print_lamps(const struct design_answer *a)
{
    const struct imp_design_answer *d = a->answer;
    int width = 4;
    for (size_t j = 0; j < d->n_lamps; j++) {
        const int n = (int)strlen(a->lamps->lamp[j].lamp);
        width = n > width ? n : width;
    }
    printf("%-*s  level   watts     flux\n", width, "lamp");
    for (size_t j = 0; j < d->n_lamps; j++) {
        const double x = d->level[j];
        if (x == 0) continue;
        printf("%-*s  %-6.4g  %-8.4g  %.5g\n", width, a->lamps->lamp[j].lamp, x,
               x * d->lamp_watts[j], x * d->lamp_flux[j]);
    }
}

static void print_wants(const struct design_answer *a)
{
    printf("\n%-24s wanted      sure        value       price\n", "want");
    for (size_t k = 0; k < a->answer->n_wants; k++) {
        const struct imp_design_want *w = &a->wants[k];
        const struct imp_design_finding *f = design_finding(a, k);
        char what[300], price[64] = "-";
        snprintf(what, sizeof what, "%s %s", want_sensor(w), want_words[w->of]);
        if (f->price != 0)
            snprintf(price, sizeof price, "%.3g %s per %s", f->price,
                     objectives[a->options->least], *want_unit(w) ? want_unit(w) : "1");
        printf("%-24s %s %-9.4g %-11.5g %-11.5g %s%s\n", what,
               want_is_upper(w) ? "<=" : ">=", f->wanted, f->sure, f->value, price,
               f->holds ? "" : "  NOT SHOWN");
    }
}

static void print_others(const struct design_answer *a)
{
    const struct imp_design_answer *d = a->answer;
    const char *unit = objectives[a->options->least];
    if (d->n_others == 0) return;
    printf("\nother lamps\n");
    for (size_t k = 0; k < d->n_others; k++) {
        const double *x = d->other_level + k * d->n_lamps;
        const double more = d->other_objective[k] - d->objective;
        printf("    %.4g %s (%+.2g%s):", d->other_objective[k], unit, more,
               more <= 2 * d->objective_se ? ", as good within the errors" : "");
        for (size_t j = 0; j < d->n_lamps; j++)
            if (x[j] > 0) printf(" %s %.3g", a->lamps->lamp[j].lamp, x[j]);
        printf("\n");
    }
}

static void print_none(const struct design_answer *a)
{
    printf("no combination of the lamps has all that is wanted\n");
    printf("%-24s wanted      at best     with all others\n", "want");
    for (size_t k = 0; k < a->answer->n_wants; k++) {
        const struct imp_design_want *w = &a->wants[k];
        const struct imp_design_finding *f = design_finding(a, k);
        char what[300], with[64] = "none";
        snprintf(what, sizeof what, "%s %s", want_sensor(w), want_words[w->of]);
        if (!isnan(f->attainable)) snprintf(with, sizeof with, "%.5g", f->attainable);
        char alone[64] = "none";
        if (!isnan(f->alone)) snprintf(alone, sizeof alone, "%.5g", f->alone);
        printf("%-24s %s %-9.4g %-11s %s%s\n", what,
               want_is_upper(w) ? "<=" : ">=", f->wanted, alone, with,
               f->holds ? "" : "  not even alone");
    }
}

void design_print(const struct design_answer *a)
{
    const struct imp_design_answer *d = a->answer;
    const int what = (int)a->options->least;
    if (!d->found && d->n_moves > 0)
        printf("places were searched near the first ones, and none was found: ");
    if (!d->found && !d->proven)
        printf("no combination was found in %lld branch%s, and it is not shown that "
               "there is "
               "none (--nodes)\n",
               (long long)d->nodes, d->nodes == 1 ? "" : "es");
    else if (!d->found) print_none(a);
    if (!d->found) return;
    printf("%zu of %zu lamps: %.4g W, %.5g lm", used(a, d->level), d->n_lamps, d->watts,
           d->flux);
    if (d->cost > 0) printf(", cost %.6g", d->cost);
    if (d->proven)
        printf("; no combination needs less%s\n\n", d->n_moves ? " at these places" : "");
    else
        printf("; the search ended with a bound of %.4g %s (--nodes)\n\n", d->bound,
               objectives[what]);
    print_lamps(a);
    design_moves_print(a->moves, d);
    print_wants(a);
    printf("%s %g %% confidence, by fresh walks (round %d)\n",
           d->holds ? "all of it holds with" : "NOT all of it is shown to hold with",
           100 * (a->options->confidence > 0 ? a->options->confidence : 0.95), d->rounds);
    if (what != IMP_LEAST_COST)
        printf("error of the %s: %.2g %s at most; %.2g %s are margin for errors of walks "
               "(--spp)\n",
               objective_words[what], d->objective_se, objectives[what], d->margin,
               objectives[what]);
    print_others(a);
    bool files = false;
    for (size_t j = 0; j < d->n_lamps; j++) files |= a->lamps->file[j] && d->level[j] > 0;
    if (!files) return;
    printf("\nthe scene with these luminaires (levels: --settings FILE, then --set "
           "@FILE)\n");
    luminaires_print(a, NULL);
}

/* ---- JSON ----------------------------------------------------------------------------- */

static void json_lamps(struct json *j, const struct design_answer *a)
{
    const struct imp_design_answer *d = a->answer;
    json_array(j, "lamps");
    for (size_t k = 0; k < d->n_lamps; k++) {
        json_object(j, NULL);
        json_text(j, "name", a->lamps->lamp[k].lamp);
        json_text(j, "place", a->lamps->place[k]);
        if (a->lamps->file[k]) json_text(j, "file", a->lamps->file[k]);
        json_number(j, "level", d->level[k]);
        json_number(j, "watts", d->lamp_watts[k]);
        json_number(j, "flux", d->lamp_flux[k]);
        json_end_object(j);
    }
    json_end_array(j);
}

void design_json(const struct design_answer *a)
{
    const struct imp_design_answer *d = a->answer;
    struct json j = cli_json();
    json_bool(&j, "found", d->found);
    json_bool(&j, "holds", d->holds);
    json_bool(&j, "proven", d->proven);
    json_text(&j, "least", objective_words[a->options->least]);
    if (d->found) {
        json_number(&j, "objective", d->objective);
        json_number(&j, "bound", d->bound);
        json_number(&j, "objective_se", d->objective_se);
        json_number(&j, "margin", d->margin);
        json_number(&j, "watts", d->watts);
        json_number(&j, "flux", d->flux);
        json_number(&j, "cost", d->cost);
    }
    json_integer(&j, "rounds", d->rounds);
    json_integer(&j, "nodes", d->nodes);
    json_lamps(&j, a);
    design_moves_json(&j, a->moves, d);
    json_array(&j, "wants");
    for (size_t k = 0; k < d->n_wants; k++) {
        const struct imp_design_finding *f = design_finding(a, k);
        json_object(&j, NULL);
        json_text(&j, "sensor", want_sensor(&a->wants[k]));
        json_text(&j, "of", want_words[a->wants[k].of]);
        json_text(&j, "unit", want_unit(&a->wants[k]));
        json_number(&j, "wanted", f->wanted);
        json_number(&j, d->found ? "value" : "alone", d->found ? f->value : f->alone);
        json_number(&j, d->found ? "sure" : "attainable",
                    d->found ? f->sure : f->attainable);
        json_bool(&j, "holds", f->holds);
        json_number(&j, "price", f->price);
        json_end_object(&j);
    }
    json_end_array(&j);
    json_array(&j, "others");
    for (size_t k = 0; k < d->n_others; k++) {
        json_object(&j, NULL);
        json_number(&j, "objective", d->other_objective[k]);
        json_numbers(&j, "level", d->n_lamps, d->other_level + k * d->n_lamps);
        json_end_object(&j);
    }
    json_end_array(&j);
    json_array(&j, "luminaires");
    if (d->found) luminaires_print(a, &j);
    json_end_array(&j);
    cli_json_end(&j);
}
