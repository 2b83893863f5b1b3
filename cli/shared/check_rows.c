/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of a check printed as a table or as JSON, and their count by verdict. */
#include "check_rows.h"
#include "command.h"

#include <stdio.h>
#include <string.h>

/* Steps that are not the best have none. */
static const char *verdict(const struct imp_check_row *r)
{
    if (r->limit == 0) return "";
    if (r->why) return "open";
    return r->ok > 0 ? r->kinks > 0 ? "kink" : "ok" : r->ok < 0 ? "noisy" : "FAILED";
}

void check_rows_print(const struct imp_check_row *rows, size_t n)
{
    int width = 9;
    for (size_t i = 0; i < n; i++) {
        const char *param = IMP_ROW(imp_check_row, rows, i)->param;
        if (param && (int)strlen(param) > width) width = (int)strlen(param);
    }
    printf("%-10s %-*s %-8s %-15s %-15s %-9s %-9s %s\n", "method", width, "parameter",
           "step", "value", "reference", "se", "error", "verdict");
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = IMP_ROW(imp_check_row, rows, i);
        char step[16] = "", se[16] = "";
        if (r->step > 0) snprintf(step, sizeof step, "%.0e", r->step);
        if (r->se > 0) snprintf(se, sizeof se, "%.1e", r->se);
        printf("%-10s %-*s %-8s %-15.8g %-15.8g %-9s %s%-9.2g %s", r->method, width,
               r->param ? r->param : "", step, r->value, r->reference, se,
               r->se > 0 ? "z " : "", r->error, verdict(r));
        if (r->kinks > 0) printf(" (%d walk%s)", r->kinks, plural(r->kinks));
        if (r->sees > 0 && r->ok != 0) printf(" (sees %.2g %%)", 100 * r->sees);
        printf("\n");
        if (r->why) printf("           %s\n", r->why);
    }
}

void check_rows_json(struct json *j, const struct imp_check_row *rows, size_t n)
{
    json_array(j, "rows");
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = IMP_ROW(imp_check_row, rows, i);
        json_object(j, NULL);
        json_text(j, "method", r->method);
        json_text(j, "param", r->param);
        json_number(j, "step", r->step);
        json_number(j, "value", r->value);
        json_number(j, "reference", r->reference);
        json_number(j, "se", r->se);
        json_number(j, "error", r->error);
        json_number(j, "limit", r->limit);
        json_bool(j, "ok", r->ok != 0);
        json_bool(j, "resolved", r->ok >= 0);
        json_integer(j, "kinks", r->kinks);
        json_number(j, "sees", r->sees);
        if (r->why) json_text(j, "why", r->why);
        json_end_object(j);
    }
    json_end_array(j);
    json_integer(j, "failed", (int64_t)check_rows_count(rows, n, 0));
    json_integer(j, "noisy", (int64_t)check_rows_count(rows, n, -1));
}

size_t check_rows_count(const struct imp_check_row *rows, size_t n, int ok)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        const int is = IMP_ROW(imp_check_row, rows, i)->ok;
        count += ok < 0 ? is < 0 : is == ok;
    }
    return count;
}
