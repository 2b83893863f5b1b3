/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of parts, and manifests. Good files are made here, and the bytes say which is
 * changed and where: after the first, every three are a place (two bytes) and what is
 * xored there. The first: bit 0, the checksum is made to fit again; bit 1, a manifest;
 * bit 2, half of the file is missing. What is read is merged, or verified. */
#include "math/hash.h"
#include "memory_file.h"
#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SIDE = 4, TEXELS = 20, NUMBERS = TEXELS * TEXELS * 3 + 8, SUM = 8 };

struct good {
    uint8_t *bytes;
    size_t n;
};

static imp_context *ctx;
static imp_scene *scene;
static struct good part, other, proof;
static struct memory_file file[2];

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "%s\n", imp_last_error(ctx));
    abort();
}

static void scene_make(void)
{
    static float texels[TEXELS * TEXELS * 3];
    for (size_t k = 0; k < sizeof texels / sizeof *texels; k++) texels[k] = .5f;
    must(imp_scene_create(ctx, NULL, &scene));
    imp_scene_begin(scene, "integrator", "path", NULL, NULL);
    imp_scene_integer(scene, "max_depth", 3);
    imp_scene_end(scene);
    imp_scene_begin(scene, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(scene, "to_world",
                        (double[16]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1});
    imp_scene_begin(scene, "sampler", "independent", NULL, NULL);
    imp_scene_integer(scene, "sample_count", 4);
    imp_scene_end(scene);
    imp_scene_begin(scene, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(scene, "width", SIDE);
    imp_scene_integer(scene, "height", SIDE);
    imp_scene_begin(scene, "rfilter", "box", NULL, NULL);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_begin(scene, "emitter", "constant", "sky", NULL);
    imp_scene_end(scene);
    imp_scene_begin(scene, "shape", "sphere", NULL, NULL);
    imp_scene_begin(scene, "bsdf", "diffuse", "ball", NULL);
    imp_scene_begin(scene, "texture", "bitmap", "paper", "reflectance");
    imp_scene_image(scene, TEXELS, TEXELS, 3, texels);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_end(scene);
    must(imp_scene_commit(scene));
}

/* A picture, a gradient of few numbers, and one of many, in fixed point; with a manifest,
 * which has no sums of those, the first two. Returns what the first that failed says. */
static enum imp_status job(int many)
{
    static float pixels[SIDE * SIDE * 3];
    static double g[NUMBERS], se[NUMBERS];
    static const char *const active[] = {"sky.*", "*"};
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_estimate e;
    imp_film *film = NULL;
    enum imp_status last = imp_render(scene, NULL, &film);
    imp_film_destroy(film);
    t.width = t.height = SIDE, t.channels = 3, t.pixels = pixels;
    for (int k = 0; k <= many && (last == IMP_OK || last == IMP_PART); k++) {
        imp_problem *p;
        must(imp_problem_create(scene, &p));
        must(imp_problem_activate(p, active[k]));
        must(imp_problem_add_target(p, &t));
        if (imp_problem_n_variables(p) > NUMBERS) abort();
        last = imp_problem_objective(p, NULL, NULL, &e, g, se);
        imp_problem_destroy(p);
    }
    return last;
}

static struct good taken(const char *name)
{
    struct good out = {malloc(1 << 20), 0};
    if (!out.bytes) abort();
    out.n = good_file_take(name, out.bytes, 1 << 20);
    return out;
}

static struct good part_make(int index)
{
    char name[64];
    imp_parts *p;
    must(imp_parts_create(ctx, index, 2, "a run", &p));
    must(imp_context_set_parts(ctx, p));
    if (job(1) != IMP_PART) abort();
    good_file_name(name);
    must(imp_parts_write(p, name));
    imp_parts_destroy(p);
    return taken(name);
}

static void begin(void)
{
    char name[64];
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_manifest *m;
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    scene_make();
    part = part_make(1);
    other = part_make(2);
    must(imp_manifest_create(ctx, "a run", &m));
    must(imp_context_set_manifest(ctx, m));
    must(job(0));
    must(imp_context_set_manifest(ctx, NULL));
    must(imp_manifest_result(m, "bits", "1", 1));
    good_file_name(name);
    must(imp_manifest_write(m, name));
    imp_manifest_destroy(m);
    proof = taken(name);
    for (int k = 0; k < 2; k++) memory_file_open(&file[k]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!ctx) begin();
    if (size == 0) return 0;
    const int how = data[0];
    const struct good *from = how & 2 ? &proof : &part;
    uint8_t *bytes = malloc(from->n);
    if (!bytes) abort();
    memcpy(bytes, from->bytes, from->n);
    for (size_t k = 1; k + 3 <= size; k += 3)
        bytes[((size_t)data[k] << 8 | data[k + 1]) % (from->n - SUM)] ^= data[k + 2];
    size_t n = how & 4 ? from->n / 2 : from->n;
    if (how & 1) {
        const uint64_t sum = imp__hash(0, bytes, n - SUM);
        memcpy(bytes + n - SUM, &sum, SUM);
    }
    memory_file_put(&file[0], bytes, n);
    free(bytes);
    if (how & 2) {
        imp_manifest *m;
        if (imp_manifest_read(ctx, file[0].path, .5, 1, &m) == IMP_OK) {
            if (imp_context_set_manifest(ctx, m) == IMP_OK) (void)!job(0);
            imp_manifest_destroy(m);
        }
    } else {
        const char *const paths[] = {file[0].path, file[1].path};
        imp_parts *p;
        memory_file_put(&file[1], other.bytes, other.n);
        if (imp_parts_read(ctx, paths, 2, &p) == IMP_OK) {
            if (imp_context_set_parts(ctx, p) == IMP_OK) (void)!job(1);
            imp_parts_destroy(p);
        }
    }
    return 0;
}
