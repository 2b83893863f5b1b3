/* SPDX-License-Identifier: Apache-2.0
 *
 * The table of unified glare ratings of a luminaire, as CIE 117-1995 and CIE 190:2010 have it.
 *
 * Rooms of X x Y, H high from the eye to the luminaires, full of them in a square grid of the
 * spacing s H; the observer is in the middle of the wall with the length X and looks along Y,
 * level. Lb is the mean indirect illuminance of the walls over pi, by radiosity of three
 * surfaces (floor, walls, ceiling) whose form factors are those of a box. With q the ray's
 * displacement H tan(gamma) on its way to the floor, the part of a luminaire's light in this
 * direction that reaches the floor is, on average over all places in the room,
 *
 *     max(0, 1 - |q_x|/X) max(0, 1 - |q_y|/Y).
 *
 * The other light below the luminaires falls on the walls, that above them on the ceiling. */
#include "base/arguments.h"
#include "kind/emitter/ies.h"
#include "scene/luminaires.h"
#include <importon/rooms.h>
#include <math.h>

#define DEGREE (IMP_PI / 180)

enum { FLOOR, WALLS, CEILING };

#define ASIDE_MOST 3             /* T/R of the luminaires that count (CIE 117) */
#define LOW_MOST   (85 * DEGREE) /* angle from nadir of the rays that do */
#define HEIGHT     2.            /* m; ratings do not depend on it */

static const double rooms[IMP_GLARE_ROOMS][2] = {
    {2, 2}, {2, 3},  {2, 4}, {2, 6}, {2, 8}, {2, 12}, {4, 2},  {4, 3},  {4, 4}, {4, 6},
    {4, 8}, {4, 12}, {8, 4}, {8, 6}, {8, 8}, {8, 12}, {12, 4}, {12, 6}, {12, 8}};
static const double reflectances[IMP_GLARE_SETS][3] = {
    {.7, .5, .2}, {.7, .3, .2}, {.5, .5, .2}, {.5, .3, .2}, {.3, .3, .2}};

/* A luminaire by its own axes: across its lamps, along them, and nadir. */
struct lamp {
    const struct imp__ies *x;
    imp_v3 across, along;
    double scale; /* cd over intensities at scale 1 */
};

/* Direction by the angle from nadir and the azimuth from `ahead` towards `aside`. */
static imp_v3 direction(const struct lamp *l, imp_v3 ahead, imp_v3 aside, double gamma,
                        double azimuth)
{
    return l->x->nadir * cos(gamma) +
           (ahead * cos(azimuth) + aside * sin(azimuth)) * sin(gamma);
}

static double intensity(const struct lamp *l, imp_v3 w)
{
    return l->scale * imp__ies_intensity(l->x, w);
}

/* ---- Background ---------------------------------------------------------------------- */

/* Between two equal rectangles of x by y at distance 1 (Howell and Menguc, C-11). */
static double opposite(double x, double y)
{
    const double X = 1 + x * x, Y = 1 + y * y;
    const double logs = log(sqrt(X * Y / (1 + x * x + y * y)));
    const double turns = x * sqrt(Y) * atan(x / sqrt(Y)) +
                         y * sqrt(X) * atan(y / sqrt(X)) - x * atan(x) - y * atan(y);
    return 2 / (IMP_PI * x * y) * (logs + turns);
}

/* Flux of a luminaire on the floor, the walls and the ceiling of a room, y along `ahead`. */
static void direct(const struct lamp *l, const double room[2], imp_v3 ahead, imp_v3 aside,
                   double flux[3])
{
    enum { UP = 180, AROUND = 72 };
    flux[FLOOR] = flux[WALLS] = flux[CEILING] = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double gamma = (i + 0.5) * (IMP_PI / UP);
            const double phi = (j + 0.5) * (IMP_2PI / AROUND);
            const double solid = (cos(i * (IMP_PI / UP)) - cos((i + 1) * (IMP_PI / UP))) *
                                 (IMP_2PI / AROUND);
            const double here =
                intensity(l, direction(l, ahead, aside, gamma, phi)) * solid;
            if (2 * i >= UP) {
                flux[CEILING] += here;
                continue;
            }
            const double far = tan(gamma), x = far * fabs(sin(phi)) / room[0],
                         y = far * fabs(cos(phi)) / room[1];
            const double part = fmax(0, 1 - x) * fmax(0, 1 - y);
            flux[FLOOR] += part * here;
            flux[WALLS] += (1 - part) * here;
        }
}

/* Mean indirect illuminance of the walls where surface k has the direct flux flux[k]; lengths in
 * H. */
static double walls_indirect(const double room[2], const double reflectance[3],
                             const double flux[3])
{
    const double level = room[0] * room[1], walls = 2 * (room[0] + room[1]);
    const double area[3] = {level, walls, level};
    const double rho[3] = {reflectance[2], reflectance[1], reflectance[0]};
    const double up = opposite(room[0], room[1]), aside = 1 - up,
                 back = aside * level / walls;
    const double to[3][3] = {{0, aside, up}, {back, 1 - 2 * back, back}, {up, aside, 0}};
    double E[3], first[3];
    for (int k = 0; k < 3; k++) E[k] = first[k] = flux[k] / area[k];
    /* Each reflection leaves .7 of the light or less. */
    for (int n = 0; n < 200; n++) {
        double next[3];
        for (int i = 0; i < 3; i++) {
            next[i] = first[i];
            for (int k = 0; k < 3; k++) next[i] += to[i][k] * rho[k] * E[k];
        }
        for (int i = 0; i < 3; i++) E[i] = next[i];
    }
    return E[WALLS] - first[WALLS];
}

/* ---- Sources ------------------------------------------------------------------------- */

static int along_of(double side, double spacing)
{
    return imp_max((int)lround(side / spacing), 1);
}

/* sum L^2 w/p^2 over the luminaires before the observer. */
static double sources(const struct lamp *l, const double room[2], double spacing,
                      imp_v3 ahead, imp_v3 aside)
{
    const int columns = along_of(room[0], spacing), rows = along_of(room[1], spacing);
    double sum = 0;
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < rows; j++) {
            const double T = room[0] * ((i + 0.5) / columns - 0.5);
            const double R = room[1] * (j + 0.5) / rows;
            const double gamma = atan(hypot(T, R)), r2 = T * T + R * R + 1;
            if (fabs(T) > ASIDE_MOST * R || gamma > LOW_MOST) continue;
            const imp_v3 w = direction(l, ahead, aside, gamma, atan2(T, R));
            const double area = imp__ies_opening(l->x, w) / (HEIGHT * HEIGHT);
            const double L = intensity(l, w) / (HEIGHT * HEIGHT) / area;
            const double p = imp_guth_position(atan2(fabs(T), 1) / DEGREE,
                                               atan(hypot(T, 1) / R) / DEGREE);
            sum += L * L * area / r2 / (p * p);
        }
    return sum;
}

static void room_rate(const struct lamp *l, int k, double spacing,
                      struct imp_glare_table *out)
{
    const double *room = rooms[k];
    const double n = along_of(room[0], spacing) * (double)along_of(room[1], spacing);
    for (int turned = 0; turned < 2; turned++) {
        const imp_v3 ahead = turned ? l->along : l->across,
                     aside = turned ? l->across : l->along;
        const double sum = sources(l, room, spacing, ahead, aside);
        double flux[3];
        direct(l, room, ahead, aside, flux);
        for (int i = 0; i < 3; i++) flux[i] *= n / (HEIGHT * HEIGHT);
        for (int s = 0; s < IMP_GLARE_SETS; s++) {
            const double Lb = walls_indirect(room, reflectances[s], flux) * IMP_INV_PI;
            out->ugr[k][turned][s] = 8 * log10(0.25 / Lb * sum);
        }
    }
}

enum imp_status imp_luminaire_glare_table(const imp_scene *scene, int luminaire,
                                          const struct imp_glare_table_options *options,
                                          struct imp_glare_table *out)
{
    struct imp_luminaire_info info = {.size = sizeof info};
    struct imp_glare_table_options o = IMP_GLARE_TABLE_OPTIONS_INIT;
    struct imp_glare_table all = {.size = sizeof all};
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "out");
    IMP_OPTIONS(scene->ctx, o, options, "options");
    IMP_CHECKED(imp__size_check(scene->ctx, __func__, "out", out->size, sizeof *out));
    IMP_FINITE(scene->ctx, o.spacing, "options.spacing");
    IMP_FINITE(scene->ctx, o.flux, "options.flux");
    if (o.spacing == 0) o.spacing = 0.25;
    if (!(o.spacing >= 0.01 && o.spacing <= 2 && o.flux >= 0))
        return imp__error(
            scene->ctx, IMP_E_ARG,
            "a spacing of %g and a flux of %g lm: they are in [0.01, 2] and "
            "not negative",
            o.spacing, o.flux);
    IMP_CHECKED(imp_scene_get_luminaire(scene, luminaire, &info));
    const struct imp_emitter *e = imp__luminaire_at(scene, luminaire);
    const struct imp__ies *x = e->self;
    const double *side = x->data->size;
    if (!(info.flux > 0))
        return imp__error(scene->ctx, IMP_E_ARG, "luminaire '%s' is dark", info.name);
    if (!(side[0] * side[1] > 0))
        return imp__error(
            scene->ctx, IMP_E_ARG,
            "luminaire '%s' has no luminous area: its file names no opening", info.name);
    all.flux = o.flux > 0 ? o.flux : info.flux;
    all.spacing = o.spacing;
    const struct lamp l = {x, x->data->length_c0 ? x->c90 : x->c0,
                           x->data->length_c0 ? x->c0 : x->c90,
                           all.flux / imp__ies_flux(x)};
    for (int k = 0; k < IMP_GLARE_ROOMS; k++) {
        for (int i = 0; i < 2; i++) all.room[k][i] = rooms[k][i];
        room_rate(&l, k, o.spacing, &all);
    }
    for (int s = 0; s < IMP_GLARE_SETS; s++)
        for (int i = 0; i < 3; i++) all.reflectance[s][i] = reflectances[s][i];
    IMP_GIVE(scene->ctx, out, all, "out");
    return IMP_OK;
}
