/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks that leave a mesh of glass by a hole: white milk in a bumpy ball of 20 4^LEVEL
 * triangles, index 1.3, under uniform light of radiance 1. Every walk brings 1, unless it
 * leaks and is dropped.
 *
 *     leaks [WALKS [LEVEL [SEED]]]      10^6, 5, 1
 *
 * All processors; prints walks, drops by cause, and the largest difference of a pixel's mean
 * from 1 over its walks. */
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "leaks: %s\n", imp_last_error(ctx));
    exit(3);
}

struct point {
    double x[3];
};

/* On the bumpy ball, towards p. */
static struct point raised(struct point p)
{
    const double *x = p.x, r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int a = 0; a < 3; a++) p.x[a] /= r;
    const double bump = 1 + .08 * sin(9 * x[0] + 1) * sin(8 * x[1] + 2) * sin(10 * x[2]);
    for (int a = 0; a < 3; a++) p.x[a] *= bump;
    return p;
}
static struct point middle(struct point a, struct point b)
{
    double r = 0;
    struct point m;
    for (int k = 0; k < 3; k++) {
        m.x[k] = a.x[k] + b.x[k];
        r += m.x[k] * m.x[k];
    }
    for (int k = 0; k < 3; k++) m.x[k] /= sqrt(r);
    return m;
}

/* Corners of each triangle, three lines of them. Neighbours compute the same middles of their common edge from its ends in either order,
 * so their corners agree to the bit. */
static void split(FILE *f, struct point a, struct point b, struct point c, int level)
{
    if (level > 0) {
        const struct point ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        split(f, a, ab, ca, level - 1);
        split(f, ab, b, bc, level - 1);
        split(f, ca, bc, c, level - 1);
        split(f, ab, bc, ca, level - 1);
        return;
    }
    const struct point p[3] = {raised(a), raised(b), raised(c)};
    for (int k = 0; k < 3; k++)
        fprintf(f, "v %.9g %.9g %.9g\n", p[k].x[0], p[k].x[1], p[k].x[2]);
}

static void mesh_write(FILE *f, int level)
{
    static const int face[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10},
                                    {0, 10, 11}, {1, 5, 9},  {5, 11, 4}, {11, 10, 2},
                                    {10, 7, 6},  {7, 1, 8},  {3, 9, 4},  {3, 4, 2},
                                    {3, 2, 6},   {3, 6, 8},  {3, 8, 9},  {4, 9, 5},
                                    {2, 4, 11},  {6, 2, 10}, {8, 6, 7},  {9, 8, 1}};
    const double t = (1 + sqrt(5.)) / 2, r = sqrt(1 + t * t);
    struct point v[12];
    for (int k = 0; k < 12; k++) { /* (+-1, +-t, 0) and its turns */
        const double one = (k & 1 ? 1 : -1) / r, other = (k & 2 ? -t : t) / r;
        const int a = k / 4; /* 0: xy, 1: yz, 2: zx */
        v[k].x[a] = one;
        v[k].x[(a + 1) % 3] = other;
        v[k].x[(a + 2) % 3] = 0;
    }
    for (int k = 0; k < 20; k++)
        split(f, v[face[k][0]], v[face[k][1]], v[face[k][2]], level);
    for (int k = 0; k < 20 << 2 * level; k++)
        fprintf(f, "f %d %d %d\n", 3 * k + 1, 3 * k + 2, 3 * k + 3);
}

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
    "value='100000'/></integrator><medium type='homogeneous' id='milk'><float "
    "name='sigma_t' value='3'/><float name='albedo' value='1'/></medium><shape "
    "type='obj'><string name='filename' value='%s'/><boolean name='face_normals' "
    "value='true'/><bsdf type='dielectric'><float name='int_ior' value='1.3'/><float "
    "name='ext_ior' value='1'/></bsdf><ref id='milk' name='interior'/></shape><emitter "
    "type='constant'/><sensor type='perspective'><float name='fov' "
    "value='22'/><transform "
    "name='to_world'><lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform><film "
    "type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
    "<rfilter type='box'/></film></sensor></scene>";

int main(int argc, char **argv)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    const double walks = argc > 1 ? atof(argv[1]) : 1e6;
    const int level = argc > 2 ? atoi(argv[2]) : 5;
    char path[] = "/tmp/leaks-XXXXXX.obj", text[4096];
    imp_scene *scene;
    imp_film *film;
    if (!(walks >= 1024 && walks < 1e12) || level < 0 || level > 9) {
        fprintf(stderr, "usage: leaks [WALKS [LEVEL [SEED]]]\n");
        return 2;
    }
    const int fd = mkstemps(path, 4);
    FILE *f = fd < 0 ? NULL : fdopen(fd, "w");
    if (!f) {
        fprintf(stderr, "leaks: no file for the mesh\n");
        return 3;
    }
    mesh_write(f, level);
    if (fclose(f) != 0) return 3;
    must(imp_context_create(&o, &ctx));
    snprintf(text, sizeof text, scene_text, path);
    load.mode = IMP_MONO;
    must(imp_scene_load_string(ctx, text, strlen(text), "leaks", &load, &scene));
    remove(path);
    run.spp = (int)fmin(walks / 1024, 1e9);
    run.seed = argc > 3 ? strtoull(argv[3], NULL, 10) : 1;
    run.drop_budget = 1;
    must(imp_render(scene, &run, &film));
    must(imp_film_get_info(film, &info));
    double worst = 0;
    for (int k = 0; k < info.width * info.height; k++)
        worst = fmax(worst, fabs((double)imp_film_mean(film)[k] - 1));
    printf("%.4g walks in a mesh of %d triangles; dropped: %llu\n", 1024. * run.spp,
           20 << 2 * level, (unsigned long long)info.dropped);
    for (int c = 0; c < IMP_DROP_CAUSES; c++)
        if (info.dropped_by_cause[c])
            printf("  %llu: %s\n", (unsigned long long)info.dropped_by_cause[c],
                   imp_drop_text((enum imp_drop)c));
    for (int k = 0; k < info.n_drop_keys; k++) {
        const struct imp_drop_key *key = IMP_ROW(imp_drop_key, info.drop_keys, k);
        printf("  column %d, row %d, sample %lld\n", key->x, key->y,
               (long long)key->sample);
    }
    printf("largest difference of a pixel from 1: %.2e\n", worst);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return 0;
}
