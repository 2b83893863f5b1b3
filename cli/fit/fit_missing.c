/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters that were not fitted and may be wrong: tested and reported. */
#include "fit_answer.h"
#include "fit_options.h"
#include "shared/command.h"

#include <string.h>

#define CHANCE 0.05 /* of a false alarm */

static const char *missing_name(const struct imp_missing *m, char *name, size_t size)
{
    struct imp_param_info info = {.size = sizeof info};
    char number[512];
    if (imp_scene_get_param(cli.scene, m->param, &info) != IMP_OK) return "";
    if (m->factor) snprintf(name, size, "factor(%s)", info.name);
    else
        snprintf(name, size, "%s",
                 cli_number_name(&info, m->element, number, sizeof number));
    return name;
}

void fit_missing_json(struct json *j, const struct fit_answer *a)
{
    char name[576];
    json_array(j, "missing");
    for (size_t k = 0; k < a->n_missing; k++) {
        const struct imp_missing *m = IMP_ROW(imp_missing, a->missing, k);
        json_object(j, NULL);
        json_text(j, "name", missing_name(m, name, sizeof name));
        json_number(j, "value", m->value);
        json_number(j, "step", m->step);
        json_number(j, "step_se", m->step_se);
        json_number(j, "chi2_drop", m->chi2);
        json_number(j, "chi2_drop_se", m->chi2_se);
        json_number(j, "chance", m->chance);
        json_bool(j, "named", m->chance < CHANCE);
        json_end_object(j);
    }
    json_end_array(j);
}

/* Those that noise does not explain. */
void fit_missing_print(const struct fit_answer *a)
{
    enum { MOST = 8 };
    const struct imp_missing *named[MOST];
    size_t n = 0;
    char name[576];
    for (size_t k = 0; k < a->n_missing && n < MOST; k++)
        if (IMP_ROW(imp_missing, a->missing, k)->chance < CHANCE)
            named[n++] = IMP_ROW(imp_missing, a->missing, k);
    if (n == 0) {
        printf("no parameter that is not fitted is significant\n");
        return;
    }
    int width = 0;
    for (size_t k = 0; k < n; k++) {
        const int length = (int)strlen(missing_name(named[k], name, sizeof name));
        width = length > width ? length : width;
    }
    printf("not fitted, and may be wrong (if it were fitted too):\n");
    for (size_t k = 0; k < n; k++) {
        const struct imp_missing *m = named[k];
        printf("  %-*s  %.6g -> %.6g +- %.1g   chi-square -%.4g +- %.1g\n", width,
               missing_name(m, name, sizeof name), m->value, m->value + m->step,
               m->step_se, m->chi2, m->chi2_se);
    }
}

void fit_missing_find(struct fit_answer *a)
{
    enum { AUTO, ALWAYS, NEVER };
    const double excess = (a->result->chi2 - 1) / a->result->chi2_se;
    const struct imp_run run = cli_run();
    if (fit_choice.missing == NEVER || (fit_choice.missing == AUTO && !(excess > 3)))
        return;
    const enum imp_status st =
        imp_problem_missing(a->problem, &run, &a->missing, &a->n_missing);
    a->looked = st == IMP_OK;
    if (st == IMP_CANCELLED || st == IMP_OK ||
        (fit_choice.missing == AUTO && (st == IMP_E_UNSUPPORTED || st == IMP_E_BIAS)))
        return;
    cli_say("importon: warning: numbers that may be wrong were not looked for: %s",
            imp_last_error(cli.context));
}
