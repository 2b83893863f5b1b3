/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of the sky: solid angles of texels, densities against quadrature and against
 * draws, the table of texels against one of rectangles, irradiance against a sum over
 * texels, maps in other projections, and maps that are refused. Both projections, turned
 * and mirrored. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/emitter/sphere_map.h"
#include "math/quadrature.h"
#include "math/rng.h"
#include "math/stat.h"
#include "math/warp.h"
#include "math/weight_table.h"
#include "scene/scene.h"
#include "walk/core/walk.h"
#include <unistd.h>

static imp_context *ctx;
static const char *const names[] = {"latlong", "equal_area"};

/* ---- Scenes ---------------------------------------------------------------------- */

/* Turned about the diagonal, and mirrored. */
static const double placed[16] = {0, 1, 0, 3, 0, 0, 1, 2, -1, 0, 0, 1, 0, 0, 0, 1};

struct sky {
    imp_scene *scene;
    const struct imp_emitter *e;
    struct imp__sphere_map map;
};
static struct sky sky_make(int projection, int w, int h, int channels,
                           const float *pixels, double rotation, bool turned)
{
    struct sky s = {.map = {(enum imp_sky_projection)projection, w, h}};
    test_must(ctx, imp_scene_create(ctx, NULL, &s.scene));
    test_camera(s.scene, 3, 30, 4, 4);
    imp_scene_begin(s.scene, "emitter", "envmap", "sky", NULL);
    imp_scene_string(s.scene, "projection", names[projection]);
    imp_scene_float(s.scene, "rotation", rotation);
    if (turned) imp_scene_transform(s.scene, "to_world", placed);
    imp_scene_image(s.scene, w, h, channels, pixels);
    imp_scene_end(s.scene);
    imp_scene_begin(s.scene, "shape", "rectangle", NULL, NULL);
    imp_scene_begin(s.scene, "bsdf", "diffuse", NULL, NULL);
    imp_scene_end(s.scene);
    imp_scene_end(s.scene);
    test_must(ctx, imp_scene_commit(s.scene));
    s.e = s.scene->emitters[0];
    return s;
}

/* Texels that differ by a factor of a thousand, some of them 0. */
static void texels(float *p, int n, uint64_t seed)
{
    for (int k = 0; k < n; k++) {
        const double u = imp__u01(imp__key(seed, 0, 0), (uint32_t)k);
        p[k] = u < 0.15 ? 0 : (float)exp2(10 * u - 5);
    }
}

static imp_v3 world(const struct sky *s, double u, double cos_theta, double rotation,
                    bool turned)
{
    const imp_v3 d = imp__sphere_direction(u - rotation / 360, cos_theta,
                                           sqrt((1 - cos_theta) * (1 + cos_theta)));
    (void)s;
    if (!turned) return d;
    return imp__v3(placed[0] * d[0] + placed[1] * d[1] + placed[2] * d[2],
                   placed[4] * d[0] + placed[5] * d[1] + placed[6] * d[2],
                   placed[8] * d[0] + placed[9] * d[1] + placed[10] * d[2]);
}
static double pdf(const struct sky *s, imp_v3 w)
{
    const imp_v3 origin = {0};
    return s->e->ops->pdf(s->e, &origin, &w, NULL, NULL);
}
static imp_spec radiance(const struct sky *s, imp_v3 w)
{
    const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -w};
    return imp__emitter_radiance(s->scene, 0, &x, (imp_v3){0}, NULL);
}

/* Integral over columns [u0, u1] and rows [r0, r1], without a kink inside, of the density
 * (what 0), luminance-free radiance of lane 0 (1) or that times max(0, w.z) (2). Rows
 * below 0 and beyond the last are what an equal-area map has there. */
struct part {
    const struct sky *s;
    double rotation;
    bool turned;
    int what;
};
static double part_integral(const struct part *p, double u0, double u1, double r0,
                            double r1)
{
    enum { N = 8 };
    double x[N], wx[N], y[N], wy[N], sum = 0;
    imp__gauss_legendre(N, u0, u1, x, wx);
    imp__gauss_legendre(N, r0, r1, y, wy);
    const struct imp__sphere_map *m = &p->s->map;
    for (int i = 0; i < N; i++) {
        const double c = imp__sphere_map_cosine(m, y[i]);
        const double area = m->projection == IMP_LATLONG
                                ? sqrt(1 - c * c) * IMP_PI / (m->height - 1)
                                : 2.0 / m->height;
        for (int j = 0; j < N; j++) {
            const imp_v3 w = world(p->s, x[j], c, p->rotation, p->turned);
            const double f = p->what == 0   ? pdf(p->s, w)
                             : p->what == 1 ? radiance(p->s, w)[0]
                                            : radiance(p->s, w)[0] * fmax(0, w[2]);
            sum += wx[j] * wy[i] * IMP_2PI * area * f;
        }
    }
    return sum;
}
/* Borders of rows: the centres, and the poles of an equal-area map. */
static int row_borders(const struct imp__sphere_map *m, double *r)
{
    int n = 0;
    if (m->projection == IMP_EQUAL_AREA) r[n++] = -0.5;
    for (int i = 0; i < m->height; i++) r[n++] = i;
    if (m->projection == IMP_EQUAL_AREA) r[n++] = m->height - 0.5;
    return n;
}
static double whole_integral(const struct part *p)
{
    const struct imp__sphere_map *m = &p->s->map;
    double r[600], sum = 0;
    const int n = row_borders(m, r);
    for (int i = 0; i + 1 < n; i++)
        for (int j = 0; j < m->width; j++)
            sum += part_integral(p, (j + 0.5) / m->width, (j + 1.5) / m->width, r[i],
                                 r[i + 1]);
    return sum;
}

/* ---- Geometry -------------------------------------------------------------------- */

static void geometry(int projection)
{
    static const int sizes[][2] = {{2, 2}, {3, 5}, {32, 16}, {1024, 512}, {64, 4096}};
    double total = 0, pixel = 0, back = 0;
    for (size_t k = 0; k < imp_count(sizes); k++) {
        const struct imp__sphere_map m = {(enum imp_sky_projection)projection,
                                          sizes[k][0], sizes[k][1]};
        double sum = 0;
        for (int i = 0; i < m.height; i++) {
            const double w = imp__sphere_map_weight(&m, i);
            sum += w * m.width;
            if (projection == IMP_EQUAL_AREA)
                pixel = fmax(pixel, fabs(w * m.width * m.height / (4 * IMP_PI) - 1));
        }
        total = fmax(total, fabs(sum / (4 * IMP_PI) - 1));
        for (int i = 0; i < m.height; i += 1 + m.height / 16)
            for (int j = 0; j < m.width; j += 1 + m.width / 16) {
                const double c = imp__sphere_map_cosine(&m, i), s = sqrt(1 - c * c);
                double u, row;
                if (s < 1e-6) continue; /* all columns meet at a pole */
                imp__sphere_map_place(
                    &m, imp__sphere_direction((j + 0.5) / m.width, c, s), &u, &row);
                back = fmax(back, fabs(u * m.width - j - 0.5));
                back = fmax(back, fabs(row - i));
            }
    }
    tap_ok(total < 1e-12 && pixel < 1e-12,
           "%s: solid angles of texels # sum %.1e, texel %.1e", names[projection], total,
           pixel);
    tap_ok(back < 1e-9, "%s: texel to direction and back # %.1e", names[projection],
           back);

    const struct imp__sphere_map m = {(enum imp_sky_projection)projection, 8, 4};
    const imp_v3 d[5] = {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    double u[5], row[5];
    for (int k = 0; k < 5; k++) imp__sphere_map_place(&m, d[k], &u[k], &row[k]);
    tap_ok(u[0] == 0.5 && u[1] == 0.25 && u[2] == 0.75 && row[0] == 1.5 && row[3] == 0 &&
               row[4] == 3,
           "%s: +z in the middle, +x at 1/4, -x at 3/4, up in row 0", names[projection]);
}

/* Draws inside a row against its hat, by their mean cosine and its square. */
static void rows(int projection)
{
    double worst = 0;
    for (int h = 2; h <= 512; h *= 4) {
        const struct imp__sphere_map m = {(enum imp_sky_projection)projection, 2, h};
        for (int i = 0; i < h; i += 1 + h / 7) {
            enum { N = 4000 };
            const struct imp__sphere_row row = imp__sphere_map_row(&m, i);
            double drawn[2] = {0}, exact[2] = {0}, weight = 0;
            for (int k = 0; k < N; k++) {
                double c, s;
                imp__sphere_map_draw(&m, &row, i, (k + 0.5) / N, &c, &s);
                drawn[0] += c / N;
                drawn[1] += c * c / N;
            }
            for (int side = -1; side <= 1; side += 2) {
                double x[16], w[16];
                const double reach =
                    projection == IMP_EQUAL_AREA &&
                            ((i == 0 && side < 0) || (i == h - 1 && side > 0))
                        ? 0.5
                        : 1;
                if (reach == 1 && (i + side < 0 || i + side >= h)) continue;
                imp__gauss_legendre(16, 0, reach, x, w);
                for (int k = 0; k < 16; k++) {
                    const double c = imp__sphere_map_cosine(&m, i + side * x[k]);
                    const double area =
                        projection == IMP_LATLONG ? sqrt(fmax(0, 1 - c * c)) : 1;
                    const double f = w[k] * (reach == 1 ? 1 - x[k] : 1) * area;
                    weight += f;
                    exact[0] += f * c;
                    exact[1] += f * c * c;
                }
            }
            for (int k = 0; k < 2; k++)
                worst = fmax(worst, fabs(drawn[k] - exact[k] / weight));
        }
    }
    tap_ok(worst < 2e-6, "%s: draws inside rows follow the hats # %.1e",
           names[projection], worst);
}

/* ---- Densities ------------------------------------------------------------------- */

/* Chi-square over quarters of the cells between texel centres; 0: a draw where the map is
 * dark. */
static double chi2_of_draws(const struct part *p, int samples, uint64_t seed)
{
    static double expected[20000], count[20000];
    const struct sky *s = p->s;
    const struct imp__sphere_map *m = &s->map;
    double r[600], chi2 = 0, pool[2] = {0};
    const int n = row_borders(m, r);
    const int columns = 2 * m->width, bins = columns * 2 * (n - 1);
    for (int b = 0; b < bins; b++) {
        const int i = b / columns, k = i / 2;
        const double u0 = 0.5 * (b % columns + 1) / m->width;
        const double r0 = r[k] + (i % 2) * 0.5 * (r[k + 1] - r[k]);
        expected[b] = samples * part_integral(p, u0, u0 + 0.5 / m->width, r0,
                                              r0 + 0.5 * (r[k + 1] - r[k]));
        count[b] = 0;
    }
    for (int k = 0; k < samples; k++) {
        const imp_v3 origin = {0};
        const struct imp_key key = imp__key(seed, 1, (uint64_t)k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_light_sample l;
        if (!s->e->ops->sample(s->e, &origin, u, &l) || !(l.pdf > 0)) return 0;
        imp_v3 d = l.wi;
        if (p->turned)
            for (int c = 0; c < 3; c++)
                d[c] = placed[c] * l.wi[0] + placed[4 + c] * l.wi[1] +
                       placed[8 + c] * l.wi[2];
        double column, row;
        imp__sphere_map_place(m, d, &column, &row);
        column += p->rotation / 360;
        column -= floor(column);
        if (m->projection == IMP_EQUAL_AREA) row = (1 - d[1]) * 0.5 * m->height - 0.5;
        int j = (int)floor(2 * (column * m->width - 0.5) + columns) % columns, i = 0;
        while (i + 2 < n && row >= r[i + 1]) i++;
        const int half = row >= 0.5 * (r[i] + r[i + 1]);
        count[(2 * i + half) * columns + j]++;
    }
    double cells = -1;
    for (int b = 0; b < bins; b++) {
        if (expected[b] < 10) {
            pool[0] += expected[b];
            pool[1] += count[b];
            continue;
        }
        chi2 += imp__sqr(count[b] - expected[b]) / expected[b];
        cells++;
    }
    if (pool[0] >= 10) {
        chi2 += imp__sqr(pool[1] - pool[0]) / pool[0];
        cells++;
    }
    return imp__chi2_tail(chi2, cells);
}

static void densities(int projection)
{
    static const struct {
        int w, h, channels;
        double rotation;
        bool turned;
    } cases[] = {{32, 16, 3, 0, false},
                 {17, 9, 1, 40, true},
                 {2, 2, 3, -700, true},
                 {5, 3, 1, 0, false}};
    static float p[3 * 32 * 16];
    for (size_t k = 0; k < imp_count(cases); k++) {
        const int w = cases[k].w, h = cases[k].h, c = cases[k].channels;
        texels(p, w * h * c, 5 + k);
        struct sky s =
            sky_make(projection, w, h, c, p, cases[k].rotation, cases[k].turned);
        const struct part part = {&s, cases[k].rotation, cases[k].turned, 0};
        const double whole = whole_integral(&part);
        tap_ok(fabs(whole - 1) < 1e-10, "%s %d x %d: the density integrates to 1 # %.1e",
               names[projection], w, h, whole - 1);
        const double chance = chi2_of_draws(&part, 1000000, 11 + k);
        tap_ok(chance > 0.001, "%s %d x %d: draws follow the density # p %.3f",
               names[projection], w, h, chance);

        /* Other texels: the density is theirs. */
        double *theta = calloc(s.scene->n_theta, sizeof *theta);
        imp_scene_get_theta(s.scene, theta);
        size_t at;
        test_must(ctx, imp_scene_find_param(s.scene, "sky.data", &at));
        const struct imp_param_info *info = &s.scene->params[at].info;
        for (size_t i = 0; i < info->count; i++)
            theta[info->offset + i] = imp__u01(imp__key(9, 9, k), (uint32_t)i);
        test_must(ctx, imp_scene_set_theta(s.scene, theta));
        const double now = whole_integral(&part);
        tap_ok(fabs(now - 1) < 1e-10 && chi2_of_draws(&part, 200000, 21 + k) > 0.001,
               "%s %d x %d: and follow texels that change # %.1e", names[projection], w,
               h, now - 1);
        memset(theta + info->offset, 0, info->count * sizeof *theta);
        test_must(ctx, imp_scene_set_theta(s.scene, theta));
        const imp_v3 dark = world(&s, 0.3, 0.2, 0, false);
        tap_ok(fabs(pdf(&s, dark) * 4 * IMP_PI - 1) < 1e-15,
               "%s %d x %d: all set to 0: uniform", names[projection], w, h);
        free(theta);
        imp_scene_destroy(s.scene);
    }
}

/* One texel of a million in the dark. */
static void sun(int projection)
{
    enum { W = 64, H = 32, N = 1000000 };
    static float p[W * H];
    int hit = 0;
    memset(p, 0, sizeof p);
    p[9 * W + 40] = 1e6F;
    struct sky s = sky_make(projection, W, H, 1, p, 15, true);
    struct tap_stat power = {0};
    for (int k = 0; k < N; k++) {
        const imp_v3 origin = {0};
        const struct imp_key key = imp__key(31, 1, (uint64_t)k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_light_sample l;
        if (!s.e->ops->sample(s.e, &origin, u, &l)) continue;
        const double value = radiance(&s, l.wi)[0];
        hit += value > 0 && l.pdf > 0;
        tap_add(&power, value / l.pdf);
    }
    const double exact = 1e6 * imp__sphere_map_weight(&s.map, 9);
    tap_ok(hit == N && fabs(power.mean / exact - 1) < 1e-9,
           "%s: a sun of one texel is met by all draws, at its power # %d, %.1e",
           names[projection], hit, power.mean / exact - 1);
    imp_scene_destroy(s.scene);
}

/* The table against one of sums over rectangles (Crow 1984), and against the weights. */
static void table(void)
{
    enum { W = 48, H = 24, N = 1000000 };
    static double column[W * H], row[H], weight[H], area[H + 1][W + 1], count[W * H];
    static float p[W * H];
    double total = 0, chi2 = 0;
    int other = 0, dark = 0, cells = -1;
    texels(p, W * H, 77);
    const struct imp__sphere_map m = {IMP_EQUAL_AREA, W, H};
    struct imp__weight_table t = {W, H, row, column};
    for (int i = 0; i < H; i++) {
        weight[i] = imp__sphere_map_weight(&m, i);
        for (int j = 0; j < W; j++) {
            column[i * W + j] = p[i * W + j];
            area[i + 1][j + 1] =
                area[i][j + 1] + area[i + 1][j] - area[i][j] + p[i * W + j] * weight[i];
        }
    }
    imp__weight_table_sum(&t, weight);
    total = imp__weight_table_total(&t);
    for (int k = 0; k < N; k++) {
        const struct imp_key key = imp__key(41, 1, (uint64_t)k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        double r[2];
        int i, j, y = 0, x = 0;
        imp__weight_table_draw(&t, u, &i, &j, r);
        while (u[1] * area[H][W] >= area[y + 1][W]) y++;
        const double of_row = area[y + 1][W] - area[y][W];
        while (u[0] * of_row >= area[y + 1][x + 1] - area[y][x + 1]) x++;
        other += x != j || y != i;
        dark += !(p[i * W + j] > 0) || !(r[0] >= 0 && r[0] < 1 && r[1] >= 0 && r[1] < 1);
        count[i * W + j]++;
    }
    for (int i = 0; i < H; i++)
        for (int j = 0; j < W; j++) {
            const double e = N * p[i * W + j] * weight[i] / total;
            if (e < 10) continue;
            chi2 += imp__sqr(count[i * W + j] - e) / e;
            cells++;
        }
    tap_ok(other <= 2 && dark == 0,
           "the table draws what one of rectangles draws # %d of %d differ", other, N);
    const double chance = imp__chi2_tail(chi2, cells);
    tap_ok(chance > 0.01, "texels are drawn by weight # p %.3f", chance);
}

/* ---- Light ----------------------------------------------------------------------- */

static void light(int projection)
{
    enum { W = 256, H = 128 };
    static float p[3 * W * H];
    for (int k = 0; k < 3 * W * H; k++) p[k] = 0.75F;
    struct sky s = sky_make(projection, W, H, 3, p, 33, true);
    double worst = 0;
    for (int k = 0; k < 10000; k++) {
        const struct imp_key key = imp__key(51, 0, (uint64_t)k);
        const imp_v3 w =
            imp__uniform_sphere((double[2]){imp__u01(key, 0), imp__u01(key, 1)});
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs(radiance(&s, w)[c] / 0.75 - 1));
    }
    tap_ok(worst < 1e-6, "%s: a map of one colour is that colour # %.1e",
           names[projection], worst);
    imp_scene_destroy(s.scene);

    /* Irradiance of a plane: of the map as it is interpolated, by a sum over texels, and
     * by a picture of a white square. */
    double sum = 0;
    const struct imp__sphere_map m = {(enum imp_sky_projection)projection, W, H};
    for (int i = 0; i < H; i++)
        for (int j = 0; j < W; j++) {
            const double u = (j + 0.5) / W;
            const double c = imp__sphere_map_cosine(&m, i);
            const imp_v3 w = world(&s, u, c, 0, false);
            const double v =
                1 + 0.8 * sin(IMP_2PI * u) * sqrt(1 - c * c) + 0.5 * w[2] * w[2];
            for (int k = 0; k < 3; k++) p[3 * (i * W + j) + k] = (float)v;
            sum += v * fmax(0, w[2]) * imp__sphere_map_weight(&m, i);
        }
    s = sky_make(projection, W, H, 3, p, 0, false);
    const struct part part = {&s, 0, false, 2};
    tap_near(whole_integral(&part), sum, 5e-4, 0, "irradiance is a sum over texels");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 16384;
    run.seed = 3;
    test_must(ctx, imp_render(s.scene, &run, &film));
    double mean = 0, variance = 0;
    for (int k = 0; k < 16; k++) {
        mean += imp_film_mean(film)[3 * k] / 16;
        variance += imp__sqr(imp_film_se(film)[3 * k] / 16);
    }
    const double exact = 0.5 * sum / IMP_PI, z = (mean - exact) / sqrt(variance);
    tap_ok(fabs(z) < 4.5 && sqrt(variance) < 0.002 * exact,
           "%s: so is a picture of a white square # %.6f, %.6f, z %.2f",
           names[projection], mean, exact, z);
    imp_film_destroy(film);
    imp_scene_destroy(s.scene);
}

/* ---- Projections -------------------------------------------------------------------- */

/* The light of a map, Int L dw, as its texels' hats have it. */
static double flux(const float *p, int projection, int w, int h, int c)
{
    const struct imp__sphere_map m = {(enum imp_sky_projection)projection, w, h};
    double sum = 0;
    for (int i = 0; i < h; i++)
        for (int j = 0; j < w; j++)
            sum += p[3 * (i * w + j) + c] * imp__sphere_map_weight(&m, i);
    return sum;
}

static void projections(void)
{
    static const int sizes[][2] = {{32, 16}, {32, 64}, {77, 5}, {16, 33}, {2, 2}};
    enum { W = 32, H = 16 };
    imp_film *f, *g, *back;
    test_must(ctx, imp_film_create(ctx, W, H, "R,G,B", &f));
    for (int from = 0; from < 2; from++)
        for (size_t k = 0; k < imp_count(sizes); k++)
            for (int to = 0; to < 2; to++) {
                const int w = sizes[k][0], h = sizes[k][1];
                double worst = 0;
                texels(imp_film_mean(f), 3 * W * H, 8);
                test_must(ctx, imp_film_project(f, (enum imp_sky_projection)from,
                                                (enum imp_sky_projection)to, w, h, &g));
                for (int c = 0; c < 3; c++) {
                    const double before = flux(imp_film_mean(f), from, W, H, c),
                                 after = flux(imp_film_mean(g), to, w, h, c);
                    worst = fmax(worst, fabs(after / before - 1));
                }
                tap_ok(worst < 1e-6, "%s to %s, %d x %d: the light is kept # %.1e",
                       names[from], names[to], w, h, worst);
                imp_film_destroy(g);
            }

    /* There and back, of a smooth map; one of a single colour is that everywhere. */
    float *p = imp_film_mean(f);
    for (int i = 0; i < H; i++)
        for (int j = 0; j < W; j++)
            for (int c = 0; c < 3; c++)
                p[3 * (i * W + j) + c] = c == 2 ? 0.75F
                                                : (float)(2 + cos(IMP_PI * i / (H - 1)) +
                                                          sin(IMP_2PI * (j + 0.5) / W) *
                                                              sin(IMP_PI * i / (H - 1)));
    test_must(ctx, imp_film_project(f, IMP_LATLONG, IMP_EQUAL_AREA, W, 512, &g));
    test_must(ctx, imp_film_project(g, IMP_EQUAL_AREA, IMP_LATLONG, W, H, &back));
    double worst = 0, flat = 0;
    for (int k = 0; k < W * H; k++) {
        /* Around the poles all columns meet: there it is a mean over them. */
        if (k / W > 1 && k / W < H - 2)
            worst = fmax(worst, fabs(imp_film_mean(back)[3 * k] / p[3 * k] - 1));
        flat = fmax(flat, fabs(imp_film_mean(back)[3 * k + 2] / 0.75 - 1));
    }
    tap_ok(worst < 0.02 && flat < 1e-6,
           "a smooth map there and back # %.1e, of one colour %.1e", worst, flat);
    imp_film_destroy(back);
    imp_film_destroy(g);
    enum imp_status st = imp_film_project(f, IMP_LATLONG, IMP_LATLONG, 1, 5, &g);
    tap_ok(st == IMP_E_ARG, "1 x 5: refused # %s", imp_last_error(ctx));
    st = imp_film_project(f, (enum imp_sky_projection)7, IMP_LATLONG, 8, 8, &g);
    tap_ok(st == IMP_E_ARG, "no such projection # %s", imp_last_error(ctx));
    imp_film_destroy(f);
}

/* ---- What is refused --------------------------------------------------------------- */

static enum imp_color_mode refused_in = IMP_RGB;
static void refused(const char *text, const char *inside, const char *message)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    o.mode = refused_in;
    imp_scene *s = NULL;
    char xml[2000];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>\n<emitter type='envmap' id='sky'>%s</emitter>"
             "%s</scene>",
             inside, text);
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s);
    const char *said = imp_last_error(ctx);
    tap_ok(st != IMP_OK && strstr(said, message) && strstr(said, "test:"),
           "refused: %s # %s", message, st != IMP_OK ? said : "nothing");
    imp_scene_destroy(s);
}

static void picture(const char *name, int w, int h, float base, int at, float value)
{
    FILE *f = fopen(name, "wb");
    fprintf(f, "PF\n%d %d\n-1.0\n", w, h);
    for (int i = h - 1; i >= 0; i--)
        for (int j = 0; j < 3 * w; j++) {
            const int k = 3 * w * i + j;
            const float v = k == at ? value : base;
            fwrite(&v, sizeof v, 1, f);
        }
    fclose(f);
}

static void refusals(void)
{
    char file[64], inside[400];
    snprintf(file, sizeof file, "environment_%d.pfm", (int)getpid());
#define MAP(more)                                                                        \
    (snprintf(inside, sizeof inside, "<string name='filename' value='%s'/>%s", file,     \
              more),                                                                     \
     inside)
    picture(file, 4, 3, 0, -1, 0);
    refused("", MAP(""), "all 12 texels of the map are 0");
    picture(file, 1, 5, 1, -1, 0);
    refused("", MAP(""), "1 x 5 texels");
    picture(file, 5, 1, 1, -1, 0);
    refused("", MAP(""), "5 x 1 texels");
    picture(file, 4, 3, 1, 3 * 6 + 1, -0.5f);
    for (int mode = IMP_RGB; mode <= IMP_SINGLE; mode++) {
        refused_in = (enum imp_color_mode)mode; /* mono has a luminance above 0 there */
        refused("", MAP(""), "texel (2, 1) of the map is negative: -0.5");
    }
    refused_in = IMP_RGB;
    picture(file, 4, 3, 1, 3 * 9, INFINITY);
    refused("", MAP(""), "pixel (1, 2) of the picture is not finite");
    picture(file, 4, 3, 1, 3 * 9, NAN);
    refused("", MAP(""), "pixel (1, 2) of the picture is not finite");
    picture(file, 4, 3, 1, -1, 0);
    refused("", "", "needs a picture");
    refused("", "<string name='filename' value='nowhere.exr'/>", "nowhere.exr");
    refused("", MAP("<transform name='to_world'><scale x='2'/></transform>"),
            "turn and mirror it only");
    refused("", MAP("<string name='projection' value='cube'/>"), "latlong");
    refused("", MAP("<float name='scale' value='-1'/>"), "scale = -1 is outside");
    refused("", MAP("<texture type='bitmap'/>"), "has two pictures");
    refused("", "<texture type='checkerboard'/>", "needs a picture");
    snprintf(inside, sizeof inside,
             "<texture type='bitmap'><string name='filename' value='%s'/>"
             "<string name='filter_type' value='nearest'/></texture>",
             file);
    refused("", inside, "bilinear");
    remove(file);
}

/* Light samples alone see no derivative of a dark texel. */
static void gaps(void)
{
    enum { W = 4, H = 3 };
    float p[W * H] = {1, 0, 2, 3, 0, 0, 1, 1, 2};
    static const char *const parts[] = {"sky.data", "sky.rotation", "*.reflectance*"};
    for (int light_only = 0; light_only < 2; light_only++)
        for (int k = 0; k < 3; k++) {
            imp_scene *s;
            struct imp_run run = IMP_RUN_INIT;
            double g[64];
            imp_film *film = NULL;
            test_must(ctx, imp_scene_create(ctx, NULL, &s));
            imp_scene_begin(s, "integrator", "direct", NULL, NULL);
            if (light_only) imp_scene_integer(s, "bsdf_samples", 0);
            imp_scene_end(s);
            imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
            imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
            imp_scene_integer(s, "width", 2);
            imp_scene_integer(s, "height", 2);
            imp_scene_end(s);
            imp_scene_end(s);
            imp_scene_begin(s, "emitter", "envmap", "sky", NULL);
            imp_scene_image(s, W, H, 1, p);
            imp_scene_end(s);
            imp_scene_begin(s, "shape", "sphere", "ball", NULL);
            imp_scene_end(s);
            test_must(ctx, imp_scene_commit(s));
            imp_problem *problem = test_problem(ctx, s, parts[k]);
            run.spp = 2;
            const size_t n = imp_problem_n_variables(problem);
            float adjoint[2 * 2 * 3] = {0};
            const enum imp_status st =
                n <= 64 ? imp_problem_reverse(problem, adjoint, &run, g, NULL) : IMP_OK;
            const bool refuse = light_only && k < 2;
            tap_ok((st == IMP_E_BIAS) == refuse && (st == IMP_OK) == !refuse,
                   "%s by light samples%s: %s # %s", parts[k],
                   light_only ? " alone" : " and directions",
                   refuse ? "refused" : "given", st ? imp_last_error(ctx) : "");
            imp_film_destroy(film);
            imp_problem_destroy(problem);
            imp_scene_destroy(s);
        }
}

int main(void)
{
    ctx = test_context(1);
    for (int p = IMP_LATLONG; p <= IMP_EQUAL_AREA; p++) {
        geometry(p);
        rows(p);
        densities(p);
        sun(p);
        light(p);
    }
    table();
    projections();
    refusals();
    gaps();
    imp_context_destroy(ctx);
    return tap_done();
}
