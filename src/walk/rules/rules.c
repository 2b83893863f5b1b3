/* SPDX-License-Identifier: Apache-2.0
 *
 * The table of rules, and the function that decides by it (features.h). */
#include "base/arguments.h"
#include "features.h"
#include <stdio.h>
#include <string.h>

const struct imp_job_rule imp__job_rules[] = {
#define RULE(feature, with, relation, other, status, sentence)                           \
    {IMP_HAS_##feature, IMP_HAS_##with, IMP_##relation,                                  \
     IMP_HAS_##other,   IMP_E_##status, sentence},
#include "rules.def"
#undef RULE
};
const int imp__n_job_rules = (int)imp_count(imp__job_rules);

const char *const imp__feature_names[IMP_FEATURE_COUNT] = {
#define X(name, text) text,
    IMP_FEATURES(X)
#undef X
};

/* ---- The sentence ------------------------------------------------------------------ */

static const char *value_of(const char *token, const struct imp_job *job,
                            const struct imp_bearer *its, const struct imp_bearer *other,
                            const char *number)
{
    const struct {
        const char *token, *value;
    } values[] = {{"{name}", other->name},
                  {"{kind}", other->kind},
                  {"{more}", other->more},
                  {"{number}", number},
                  {"{its.name}", its->name},
                  {"{its.kind}", its->kind},
                  {"{sensor}", job->sensor ? job->sensor->name : NULL},
                  {"{sensor.kind}", job->sensor ? job->sensor->ops->name : NULL},
                  {"{integrator}", job->scene && job->scene->integrator
                                       ? job->scene->integrator->ops->name
                                       : NULL},
                  {"{call}", job->call}};
    for (size_t k = 0; k < imp_count(values); k++)
        if (strncmp(token, values[k].token, strlen(values[k].token)) == 0)
            return values[k].value ? values[k].value : "";
    return "";
}

static void sentence_make(const struct imp_job_rule *rule, const struct imp_job *job,
                          const struct imp_bearer *its, const struct imp_bearer *other,
                          char text[IMP_SENTENCE_MAX])
{
    char number[24];
    size_t n = 0;
    snprintf(number, sizeof number, "%zu", other->number);
    for (const char *c = rule->sentence; *c && n < IMP_SENTENCE_MAX - 1;) {
        if (*c != '{') {
            text[n++] = *c++;
            continue;
        }
        const char *value = value_of(c, job, its, other, number);
        while (*value && n < IMP_SENTENCE_MAX - 1) text[n++] = *value++;
        c = strchr(c, '}') + 1;
    }
    text[n] = 0;
}

/* ---- The decision ------------------------------------------------------------------ */

static enum imp_status rule_check(imp_context *ctx, const struct imp_job_rule *rule,
                                  const struct imp_job *job)
{
    struct imp_bearer its = {0}, with = {0}, other = {0};
    char text[IMP_SENTENCE_MAX];
    if (!imp__job_has(job, rule->feature, &its) || !imp__job_has(job, rule->with, &with))
        return IMP_OK;
    if (imp__job_has(job, rule->other, &other) == (rule->relation == IMP_NEEDS))
        return IMP_OK;
    sentence_make(rule, job, &its, &other, text);
    return imp__error(ctx, rule->status, "%s", text);
}

enum imp_status imp__job_allowed(const struct imp_job *job)
{
    imp_context *ctx = job->ctx;
    for (int k = 0; k < imp__n_job_rules; k++)
        IMP_CHECKED(rule_check(ctx, &imp__job_rules[k], job));
    for (int k = 0; ctx->declared && k < ctx->declared->n_rules; k++)
        IMP_CHECKED(rule_check(ctx, &ctx->declared->rules[k], job));
    return IMP_OK;
}
