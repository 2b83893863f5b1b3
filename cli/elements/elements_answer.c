/* SPDX-License-Identifier: Apache-2.0
 *
 * What importon elements has found: measurements, statistics, sensitivities. */
#include "cmd_elements.h"

#include <math.h>
#include <stdlib.h>

/* What was measured, each by its name, and their sum from both sides. */
static void print_measures(const struct elements_answer *a)
{
    const struct imp_elements_info *i = a->info;
    double only = a->n_sources == 1 ? a->sources[0].weight : 0;
    for (size_t k = 0; k < a->n_sources; k++) {
        const struct imp_elements_source *s = &a->sources[k];
        const char *name = elements_source_name(a->typed, k);
        const double *u = s->edge_u, *v = s->edge_v;
        const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                             u[0] * v[1] - u[1] * v[0]};
        const double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (s->kind == IMP_ELEMENTS_CAMERA)
            cli_say("mean of the region %s: %.9g", name, i->measures[k]);
        else if (s->kind == IMP_ELEMENTS_SHAPE)
            cli_say("mean illuminance of %s: %.9g", name, i->measures[k]);
        else /* + 0.0: no negative zero */
            cli_say("mean illuminance of the plane %s, which faces %.3g,%.3g,%.3g: %.9g",
                    name, n[0] / area + 0.0, n[1] / area + 0.0, n[2] / area + 0.0,
                    i->measures[k]);
    }
    if (a->n_sources == 0) cli_say("mean of the picture: %.9g", i->measure);
    else if (only != 1) cli_say("weighted sum: %.9g", i->measure);
    if (isfinite(i->luminance)) cli_say("mean luminance: %.9g", i->luminance);
    if (isfinite(i->measure_adjoint))
        cli_say("the same from the lights, emission x importance: %.9g",
                i->measure_adjoint);
}

void elements_answer_info(const struct elements_answer *a, struct json *j)
{
    const struct imp_elements_info *i = a->info;
    if (!j) {
        cli_say("%zu polygon%s, %zu element%s (%zu %s), %zu link%s, %lld ray%s; order %d",
                i->polygons, plural((long long)i->polygons), i->elements,
                plural((long long)i->elements), i->leaves,
                i->leaves == 1 ? "leaf" : "leaves", i->links, plural((long long)i->links),
                (long long)i->rays, plural(i->rays), i->order);
        print_measures(a);
        const double change =
            i->n_steps > 1 ? IMP_ROW(imp_elements_step, i->steps, i->n_steps - 2)->change
                           : NAN;
        if (isfinite(change))
            cli_say("%s (last change %.2g %%)", i->reason, 100 * change);
        else cli_say("%s", i->reason);
        return;
    }
    json_number(j, "measure", i->measure);
    json_number(j, "luminance", i->luminance);
    json_array(j, "measurements");
    for (size_t k = 0; k < a->n_sources; k++) {
        json_object(j, NULL);
        json_text(j, "name", elements_source_name(a->typed, k));
        json_number(j, "value", i->measures[k]);
        json_end_object(j);
    }
    json_end_array(j);
    json_number(j, "measure_direct", i->measure_direct);
    json_number(j, "measure_adjoint", i->measure_adjoint);
    json_bool(j, "complete", a->complete);
    json_text(j, "reason", i->reason);
    json_integer(j, "order", i->order);
    json_integer(j, "functions", i->functions);
    json_integer(j, "polygons", (int64_t)i->polygons);
    json_integer(j, "skipped", (int64_t)i->skipped);
    json_integer(j, "elements", (int64_t)i->elements);
    json_integer(j, "leaves", (int64_t)i->leaves);
    json_integer(j, "links", (int64_t)i->links);
    json_integer(j, "rays", i->rays);
    json_integer(j, "bytes", (int64_t)i->bytes);
    json_number(j, "bytes_per_link", i->bytes_per_link);
    json_number(j, "bytes_per_element", i->bytes_per_element);
    json_number(j, "lobe_error", i->worst_residual);
    json_array(j, "steps");
    for (size_t k = 0; k < i->n_steps; k++) {
        const struct imp_elements_step *s = IMP_ROW(imp_elements_step, i->steps, k);
        json_object(j, NULL);
        json_number(j, "eps", s->eps);
        json_integer(j, "links", (int64_t)s->links);
        json_integer(j, "elements", (int64_t)s->elements);
        json_number(j, "measure", s->measure);
        json_number(j, "change", s->change);
        json_number(j, "seconds", s->elapsed_s);
        json_end_object(j);
    }
    json_end_array(j);
}

const char *elements_row_name(const struct imp_elements_row *r, char *text, size_t size)
{
    struct imp_param_info info = {.size = sizeof info};
    if (r->param >= 0 &&
        imp_scene_get_param(cli.scene, (size_t)r->param, &info) == IMP_OK)
        return cli_number_name(&info, r->element, text, size);
    snprintf(text, size, "%s[%zu]", r->name, r->element);
    return text;
}

void elements_answer_sensitivity(const struct elements_answer *a, struct json *j)
{
    double sum = 0;
    int loose = 0;
    char text[256];
    if (j) json_array(j, "sensitivity");
    else printf("%-44s %13s %13s %10s\n", "number", "value", "derivative", "elasticity");
    for (size_t k = 0; k < a->n_rows; k++) {
        const struct imp_elements_row *r = IMP_ROW(imp_elements_row, a->rows, k);
        const char *name = elements_row_name(r, text, sizeof text);
        if (r->emission) sum += r->share;
        if (j) {
            json_object(j, NULL);
            json_text(j, "name", name);
            json_bool(j, "emission", r->emission);
            json_number(j, "value", r->value);
            json_number(j, "derivative", r->derivative);
            json_number(j, "share", r->share);
            json_number(j, "share_error", r->share_error);
            json_end_object(j);
        } else {
            printf("%-44s %13.6g %13.6g %9.3f%%", name, r->value, r->derivative,
                   100 * r->share);
            if (r->share_error > 0.05 * fabs(r->share))
                printf(" +- %.2g%%", 100 * r->share_error);
            printf("\n");
            loose |= r->share_error > 0.05 * fabs(r->share);
        }
    }
    if (j) {
        json_end_array(j);
        json_number(j, "euler", sum);
    } else {
        printf("the lights' elasticities add up to %.6f%%\n", 100 * sum);
        if (loose)
            printf("+-: the change from a neighbouring directional order; --order L sets "
                   "it\n");
    }
}
