/* SPDX-License-Identifier: Apache-2.0
 *
 * What page_verdict.js and page_numbers.js show first, written into the page itself: it is there
 * where scripts are switched off, before they have run, and in what a program saves of the page. */
#include "page_static.h"
#include "json_walk.h"
#include <math.h>
#include <string.h>

enum { ROWS = 200 }; /* of a table, as in page_numbers.js */

static void number_put(struct imp_text *t, const char *value)
{
    const double x = imp__json_number(value);
    if (isfinite(x)) imp__put(t, "%.6g", x);
    else imp__put(t, "&#8211;");
}

static void error_put(struct imp_text *t, const char *value, const char *se)
{
    number_put(t, value);
    if (imp__json_number(se) > 0) imp__put(t, " &#177; %.2g", imp__json_number(se));
}

/* ---- Fits ---------------------------------------------------------------------------- */

static void residual_put(struct imp_text *t, const char *fit)
{
    const double is = imp__json_number(imp__json_member(fit, "residual")),
                 hi = imp__json_number(imp__json_member(fit, "residual_hi"));
    if (!isfinite(hi)) return;
    if (hi <= 0) imp__put(t, "<p>The residual is within its noise.</p>\n");
    else if (hi > 1.5 * is)
        imp__put(t, "<p>The residual is below %.2g %% of the targets.</p>\n", 100 * hi);
    else imp__put(t, "<p>The residual is %.2g %% of the targets.</p>\n", 100 * is);
}

static void chi2_put(struct imp_text *t, const char *fit)
{
    const double chi2 = imp__json_number(imp__json_member(fit, "chi2_per_freedom")),
                 se = imp__json_number(imp__json_member(fit, "chi2_se"));
    if (!isfinite(chi2) || !(se < 1 || chi2 > 3 * se)) return;
    imp__put(t,
             "<p>Chi-square per degree of freedom of the fit: %.4g; where the scene "
             "explains the targets, %.3g to %.3g.</p>\n",
             chi2, fmax(0, 1 - 2 * se), 1 + 2 * se);
}

static void verdict_put(struct imp_text *t, const char *fit)
{
    const char *value = imp__json_member(fit, "value"),
               *reason = imp__json_member(fit, "reason"),
               *loss = imp__json_member(fit, "loss"),
               *warning = imp__json_member(fit, "warning");
    if (isfinite(imp__json_number(value))) {
        imp__put(t, "<p>The search ended after ");
        number_put(t, imp__json_member(fit, "iterations"));
        imp__put(t, " iterations%s", imp__json_is_string(reason) ? ": " : "");
        imp__html_json(t, reason);
        imp__put(t, ". Loss%s", imp__json_is_string(loss) ? " (" : "");
        imp__html_json(t, loss);
        imp__put(t, "%s: ", imp__json_is_string(loss) ? ")" : "");
        error_put(t, value, imp__json_member(fit, "se"));
        imp__put(t, ".</p>\n");
    }
    residual_put(t, fit);
    chi2_put(t, fit);
    if (imp__json_is_string(warning)) {
        imp__put(t, "<p class=\"warning\">");
        imp__html_json(t, warning);
        imp__put(t, "</p>\n");
    }
    if (imp__json_is_false(imp__json_member(fit, "complete")))
        imp__put(t, "<p class=\"warning\">The fit was interrupted; this is the state "
                    "that it had reached.</p>\n");
}

static void interval_put(struct imp_text *t, const char *p)
{
    const char *lo = imp__json_member(p, "lo95"), *hi = imp__json_member(p, "hi95");
    const double bound = imp__json_number(imp__json_member(p, "at_bound"));
    if (isfinite(imp__json_number(lo)) && isfinite(imp__json_number(hi))) {
        number_put(t, lo);
        imp__put(t, " to ");
        number_put(t, hi);
    }
    if (imp__json_is_false(imp__json_member(p, "determined")))
        imp__put(t, " not determined by the pictures");
    else if (bound < 0) imp__put(t, " at its lower bound");
    else if (bound > 0) imp__put(t, " at its upper bound");
}

/* What is true of a number, from an item of its own (or its own member). */
static const char *truth_of(const char *p, const char *truths)
{
    const char *own = imp__json_member(p, "truth");
    return own ? own : imp__json_member_of(truths, imp__json_member(p, "name"));
}

static bool has_truth(const char *params, const char *truths)
{
    for (const char *p = imp__json_first(params); p; p = imp__json_next(p))
        if (isfinite(imp__json_number(truth_of(p, truths)))) return true;
    return false;
}

static void row_put(struct imp_text *t, const char *p, bool truth, const char *truths)
{
    const char *unit = imp__json_member(p, "unit");
    imp__put(t, "<tr><td class=\"mono\">");
    imp__html_json(t, imp__json_member(p, "name"));
    imp__put(t, "</td><td>");
    number_put(t, imp__json_member(p, "start"));
    imp__put(t, "</td><td>");
    number_put(t, imp__json_member(p, "value"));
    imp__put(t, "</td><td>");
    number_put(t, imp__json_member(p, "se"));
    imp__put(t, "</td><td>");
    interval_put(t, p);
    if (truth) {
        imp__put(t, "</td><td>");
        number_put(t, truth_of(p, truths));
    }
    imp__put(t, "</td><td class=\"unit\">");
    if (imp__json_is_string(unit) && strncmp(unit, "\"1\"", 3) != 0)
        imp__html_json(t, unit);
    imp__put(t, "</td></tr>\n");
}

static void params_put(struct imp_text *t, const char *params, const char *truths)
{
    const bool truth = has_truth(params, truths);
    int n = 0;
    for (const char *p = imp__json_first(params); p; p = imp__json_next(p)) {
        if (imp__json_member(p, "file") || !imp__json_member(p, "name")) continue;
        if (!n++)
            imp__put(t,
                     "<h2>Parameters</h2>\n<table><thead><tr><th>name</th>"
                     "<th>start</th><th>value</th><th>se</th><th>95 %% interval</th>"
                     "%s<th>unit</th></tr></thead><tbody>\n",
                     truth ? "<th>truth</th>" : "");
        if (n <= ROWS) row_put(t, p, truth, truths);
    }
    if (n) imp__put(t, "</tbody></table>\n");
    if (n > ROWS) imp__put(t, "<p>%d of %d are shown.</p>\n", ROWS, n);
}

/* ---- Pictures, checks, other answers -------------------------------------------------- */

static void explained_put(struct imp_text *t, const char *item, const char *data)
{
    const char *is = imp__json_member(data, "explained");
    const double chi2 = imp__json_number(imp__json_member(data, "chi2")),
                 view = imp__json_number(imp__json_member(item, "view"));
    imp__put(t, "<h2>Is the picture explained?</h2>\n<p>");
    if (view > 0) imp__put(t, "View %g: ", view);
    imp__put(t, imp__json_is_true(is)    ? "Yes: what is left over is what noise makes."
                : imp__json_is_false(is) ? "No: more is left over than noise makes."
                                         : "Its standard errors do not decide this.");
    if (isfinite(chi2)) imp__put(t, " Chi-square per number is %.4g.", chi2);
    imp__put(t, "</p>\n");
}

/* Members that are numbers, texts or truths, in a table. */
static void answer_put(struct imp_text *t, const char *item, const char *data)
{
    int n = 0;
    for (const char *k = imp__json_first(data); k && *data == '{' && n < ROWS;
         k = imp__json_next(k)) {
        const char *v = imp__json_value_of(k);
        if (!v || *v == '{' || *v == '[' || *v == 'n') continue;
        if (!n++) {
            imp__put(t, "<h2>");
            imp__html_json(t, imp__json_member(item, "kind"));
            imp__put(t, "</h2>\n<table><tbody>\n");
        }
        imp__put(t, "<tr><td>");
        imp__html_json(t, k);
        imp__put(t, "</td><td>");
        if (imp__json_is_string(v)) imp__html_json(t, v);
        else if (imp__json_is_true(v) || imp__json_is_false(v))
            imp__put(t, "%s", imp__json_is_true(v) ? "true" : "false");
        else number_put(t, v);
        imp__put(t, "</td></tr>\n");
    }
    if (n) imp__put(t, "</tbody></table>\n");
}

static bool is_kind(const char *item, const char *kind)
{
    const char *is = imp__json_member(item, "kind");
    const size_t n = strlen(kind);
    return imp__json_is_string(is) && !strncmp(is + 1, kind, n) && is[1 + n] == '"';
}

static const char *data_of(const char *items, const char *kind)
{
    for (const char *i = imp__json_first(items); i; i = imp__json_next(i))
        if (is_kind(i, kind)) return imp__json_member(i, "data");
    return NULL;
}

enum imp_status imp__page_static(struct imp_text *t, const struct imp_report *r,
                                 const char *data)
{
    const char *items = imp__json_member(data, "items"),
               *truths = data_of(items, "truth");
    if (r->live) return IMP_OK; /* it is filled as news come */
    imp__put(t, "<h1>");
    imp__html_text(t, r->title ? r->title : "importon report");
    imp__put(t, "</h1>\n");
    for (const char *i = imp__json_first(items); i; i = imp__json_next(i)) {
        const char *own = imp__json_member(i, "data");
        if (!own || is_kind(i, "walks") || is_kind(i, "rays") || is_kind(i, "mesh") ||
            is_kind(i, "truth"))
            continue;
        if (is_kind(i, "explained")) explained_put(t, i, own);
        else if (!is_kind(i, "fit")) answer_put(t, i, own);
        else {
            verdict_put(t, own);
            params_put(t, imp__json_member(own, "params"), truths);
        }
    }
    if (r->command) {
        imp__put(t, "<h2>How it was made</h2>\n<p><code>");
        imp__html_text(t, r->command);
        imp__put(t, "</code></p>\n");
    }
    return t->failed
               ? imp__error(t->ctx, IMP_E_NOMEM, "no memory for the page of a report")
               : IMP_OK;
}
