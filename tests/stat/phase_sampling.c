/* SPDX-License-Identifier: Apache-2.0
 *
 * Every phase function of the tables, with inputs drawn within their bounds: its integral
 * over the sphere is 1 in every lane and so is that of its density; what it draws has that
 * density (chi-square over cosine and azimuth, and the weight's mean); it is the same
 * whichever direction is the light's; eval_d is the derivative of eval. */
#include "color/rgb.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/build.h"
#include "math/rng.h"
#include "math/stat.h"
#include "math/vec.h"
#include "scene/scene.h"

enum { NZ = 24, NPHI = 8, DRAWS = 400000, FINE = 60 };

static double u01(uint64_t stream, uint32_t k)
{
    return imp__u01(imp__key(11, stream, 1), k);
}

/* Inputs, lane by lane, away from where a density would need finer cells. */
static void inputs_draw(const struct imp_phase *p, uint64_t stream, imp_spec *in)
{
    for (int j = 0; j < p->n_in; j++)
        for (int c = 0; c < 4; c++) {
            const double u = u01(stream, (uint32_t)(4 * j + c));
            const bool scalar =
                j < p->n_own && p->ops->inputs[j].flags & IMP_INPUT_SCALAR;
            in[j][c] = scalar && c > 0 ? in[j][0]
                       : j < p->n_own && p->ops->inputs[j].lo >= 0
                           ? .1 + .8 * u /* a weight, or a value */
                           : -.7 + 1.4 * u;
        }
}

static imp_v3 direction(double z, double phi)
{
    const double r = sqrt(1 - z * z);
    return imp__v3(r * cos(phi), r * sin(phi), z);
}

static void check(const struct imp_phase *p, uint64_t stream, const char *name)
{
    imp_spec in[IMP_INPUTS_MAX] = {{0}}, f, df[IMP_INPUTS_MAX], sum = {0};
    double expected[NZ * NPHI] = {0}, seen[NZ * NPHI] = {0}, total = 0;
    inputs_draw(p, stream, in);
    struct imp_dirs d = {.wo = imp__normalize(imp__v3(.3, -.5, .4)), .lobe = IMP_SMOOTH};

    /* Integrals: midpoints within each cell. */
    double asymmetry = 0;
    for (int z = 0; z < NZ * FINE; z++)
        for (int k = 0; k < NPHI * 16; k++) {
            const double area = 4 * M_PI / (NZ * FINE) / (NPHI * 16);
            d.wi = direction(2 * (z + .5) / (NZ * FINE) - 1,
                             2 * M_PI * (k + .5) / (NPHI * 16));
            const double pdf = p->ops->pdf(p, in, &d);
            p->ops->eval(p, in, &d, &f);
            sum += f * area;
            total += pdf * area;
            expected[z / FINE * NPHI + k / 16] += pdf * area * DRAWS;
            if (k % 37 == 0 && z % 11 == 0) {
                const struct imp_dirs back = {d.wi, d.wo, IMP_SMOOTH, 0};
                imp_spec g;
                p->ops->eval(p, in, &back, &g);
                asymmetry = fmax(asymmetry, fabs(g[1] - f[1]) / f[1]);
            }
        }
    double off = fabs(total - 1);
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(sum[c] - 1));
    tap_ok(off < (p->n_in ? 1e-4 : 1e-6),
           "%s: integrals of value and density are 1 # off by %.1e", name, off);
    tap_ok(asymmetry < 1e-12, "%s: reciprocal # %.1e", name, asymmetry);

    struct tap_stat weight = {0, 0, 0};
    for (uint32_t i = 0; i < DRAWS; i++) {
        const double u[3] = {u01(stream + 1000, 3 * i), u01(stream + 1000, 3 * i + 1),
                             u01(stream + 1000, 3 * i + 2)};
        p->ops->sample(p, in, u, &d);
        const double phi = atan2(d.wi[1], d.wi[0]);
        const int z = (int)imp_clamp((d.wi[2] + 1) / 2 * NZ, 0., NZ - 1.);
        const int k = (int)imp_clamp((phi < 0 ? phi + 2 * M_PI : phi) / (2 * M_PI) * NPHI,
                                     0., NPHI - 1.);
        seen[z * NPHI + k]++;
        p->ops->eval(p, in, &d, &f);
        tap_add(&weight, f[2] / p->ops->pdf(p, in, &d));
    }
    double chi = 0;
    for (int i = 0; i < NZ * NPHI; i++)
        chi += imp__sqr(seen[i] - expected[i]) / expected[i];
    const double n = NZ * NPHI - 1, z = (chi - n) / sqrt(2 * n);
    tap_ok(fabs(z) < 4.5, "%s: draws have the density # chi-square %.1f of %.0f, z %.2f",
           name, chi, n, z);
    tap_ok(fabs(weight.mean - 1) <= 4.5 * tap_se(&weight) + 1e-12,
           "%s: mean of value over density # %.5f se %.1e", name, weight.mean,
           tap_se(&weight));

    /* Derivatives. */
    double worst = 0;
    for (uint32_t i = 0; i < 200; i++) {
        d.wi =
            direction(2 * u01(stream, 100 + 2 * i) - 1, 6.28 * u01(stream, 101 + 2 * i));
        p->ops->eval_d(p, in, &d, df);
        for (int j = 0; j < p->n_in; j++) {
            imp_spec at[2], old = in[j];
            const double h = 1e-5;
            for (int s = 0; s < 2; s++) {
                in[j] = old + (s ? -h : h);
                p->ops->eval(p, in, &d, &at[s]);
            }
            in[j] = old;
            for (int c = 0; c < 3; c++) {
                const double q = (at[0][c] - at[1][c]) / (2 * h);
                worst = fmax(worst, fabs(q - df[j][c]) / (fabs(q) + 1e-3));
            }
        }
    }
    tap_ok(worst < 1e-6, "%s: derivatives are those of the value # %.1e", name, worst);
}

/* A table, as a scene has it; against Mitsuba 3.9.1's tabphase. */
static void table(void)
{
    static const struct {
        double c, p;
    } peer[] = {{-1, .03183098882},
                {-.5, .05570422858},
                {0, .09549296647},
                {.5, .11140845716},
                {1, .06366197765}};
    imp_context *ctx = test_context(1);
    imp_scene *s = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='volpath'/><medium type='homogeneous' "
        "id='m'><phase type='tabphase'><string name='values' value='0.5, 1.0,2 1'/>"
        "</phase></medium><shape type='cube'><bsdf type='null'/>"
        "<ref id='m' name='interior'/></shape><sensor type='perspective'><transform "
        "name='to_world'><translate z='-5'/></transform></sensor></scene>",
        IMP_RGB);
    const struct imp_phase *p = s->media[0]->phase;
    const struct imp_texcoord at = {.uv = {0, 0}};
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(p->input, p->n_in, &at, in);
    struct imp_dirs d = {.wo = {0, 0, -1, 0}, .lobe = IMP_SMOOTH};
    for (size_t k = 0; k < sizeof peer / sizeof *peer; k++) {
        d.wi = direction(peer[k].c, 1);
        tap_near(p->ops->pdf(p, in, &d), peer[k].p, 0, 1e-8, "tabphase: as Mitsuba's");
    }
    check(p, 77, "tabphase");
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

int main(void)
{
    table();
    const struct imp_phase_ops *hg = NULL, *rayleigh = NULL;
    for (size_t k = 0; imp__phase_kinds[k]; k++) {
        if (strcmp(imp__phase_kinds[k]->name, "hg") == 0) hg = imp__phase_kinds[k];
        if (strcmp(imp__phase_kinds[k]->name, "rayleigh") == 0)
            rayleigh = imp__phase_kinds[k];
    }
    for (size_t k = 0; imp__phase_kinds[k]; k++) {
        const struct imp_phase_ops *ops = imp__phase_kinds[k];
        struct imp_phase child[2] = {{.ops = hg, .n_own = 1, .n_in = 1},
                                     {.ops = rayleigh}};
        struct imp_phase p = {.ops = ops};
        while (ops->inputs && ops->inputs[p.n_own].name) p.n_own++;
        p.n_in = p.n_own;
        for (; p.n_child < ops->min_children; p.n_child++) {
            p.child[p.n_child] = &child[p.n_child];
            p.child_in[p.n_child] = p.n_in;
            p.n_in += child[p.n_child].n_in;
        }
        if (ops->object_size) {
            tap_skip(ops->name, "it has numbers of its own: a test of its own");
            continue;
        }
        for (uint64_t s = 0; s < 2; s++) check(&p, 10 * k + s, ops->name);
    }
    return tap_done();
}
