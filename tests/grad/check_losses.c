/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks of losses: right ones pass on every scene, and mistakes planted in what
 * imp__replicate_adjoints returns fail, each loss by itself. This program links its own
 * copy of that function, in place of the library's. */
#define imp__replicate_adjoints right_adjoints
#include "inverse/estimate/adjoint.c"
#undef imp__replicate_adjoints
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse_scenes.h"

static imp_context *ctx;

enum mistake {
    NONE,
    TOO_LARGE,  /* adjoints times n/(n - 1) */
    TOO_SMALL,  /* times (n - 1)/n: a leave-one-out mean over n */
    SAME_SAMPLE /* the mean of all samples in place of the others' */
};
static enum mistake mistake;
static enum imp_loss in;

double imp__replicate_adjoints(const struct imp__target *target, int channels,
                               size_t pixel, int n, const imp_spec *L, const imp_spec *M,
                               imp_spec *P)
{
    const double value = right_adjoints(target, channels, pixel, n, L, M, P);
    const struct imp_target *t = &target->desc;
    if (t->loss != in) return value;
    imp_spec mean = {0};
    for (int i = 0; i < n; i++) mean += L[i] * (1. / n);
    for (int i = 0; i < n; i++)
        if (mistake == TOO_LARGE) P[i] *= imp__spec(n / (n - 1.));
        else if (mistake == TOO_SMALL) P[i] *= imp__spec((n - 1.) / n);
        else if (mistake == SAME_SAMPLE)
            for (int c = 0; c < channels; c++) {
                struct imp__loss_at at;
                const size_t k = pixel * (size_t)channels + (size_t)c;
                imp__loss_eval(t->loss, t->scale, t->epsilon, mean[c], target->pixels[k],
                               &at);
                P[i][c] = at.d1 / n;
            }
    return mistake == TOO_SMALL ? value * (n - 1.) / n : value;
}

struct found {
    int rows, values, gradients; /* of losses; those that failed */
    double worst;
};

static struct found check(imp_problem *p)
{
    struct found f = {0};
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    size_t n;
    o.only = "frozen,dot,euler,fresh,loss,ends";
    o.draws_s = 0.02;
    o.paths = 10;
    o.fresh_spp = 1;
    test_must(ctx, imp_check(p, &o, NULL, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        if (strcmp(rows[i].method, "loss") != 0) continue;
        f.rows++;
        f.worst = fmax(f.worst, rows[i].error);
        if (!rows[i].ok && mistake == NONE)
            printf("# %s: %.9g against %.9g, error %.2g\n", rows[i].param, rows[i].value,
                   rows[i].reference, rows[i].error);
        if (strstr(rows[i].param, "gradient")) f.gradients += !rows[i].ok;
        else f.values += !rows[i].ok;
    }
    return f;
}

static void right(imp_scene *s, const char *what)
{
    imp_problem *p = test_problem(ctx, s, "*");
    mistake = NONE;
    const struct found f = check(p);
    tap_ok(f.rows == 8 && f.values + f.gradients == 0, "%s # %d rows, worst %.1e", what,
           f.rows, f.worst);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    static const char *const names[] = {"l2", "l1", "relative", "log"};
    static const enum imp_loss losses[] = {IMP_LOSS_L2, IMP_LOSS_L1, IMP_LOSS_RELATIVE_L2,
                                           IMP_LOSS_LOG};
    static const char *const mistakes[] = {"none", "n/(n-1)", "(n-1)/n", "same sample"};
    ctx = test_context(0);
    right(test_scene(ctx, "stam.xml", IMP_MONO, "res=12"), "Stam's box");
    right(test_scene(ctx, "cornell.xml", IMP_RGB, "res=12"), "Cornell box");
    right(test_scene(ctx, "textured.xml", IMP_RGB, "width=18 height=12"), "textures");
    right(scene_open(ctx, ball_xml, IMP_RGB), "ball without noise");

    imp_scene *s = scene_open(ctx, box_xml, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "*");
    for (size_t k = 0; k < imp_count(losses); k++)
        for (int m = TOO_LARGE; m <= SAME_SAMPLE; m++) {
            mistake = (enum mistake)m;
            in = losses[k];
            const struct found f = check(p);
            tap_ok(f.gradients == 1 && f.values == (m == TOO_SMALL),
                   "%s: %s is caught # worst error %.2g", names[k], mistakes[m], f.worst);
        }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
