/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of recorded walks: the head and the scene in it. A good file is made here, and the
 * bytes say where it is changed: every three are a place (two bytes) and what is xored
 * there. With an odd first byte the checksum is made to fit again, so that scenes that
 * nobody has written are made. What is read makes a picture. (fuzz_record changes walks.) */
#include "math/hash.h"
#include "memory_file.h"
#include <importon/walks.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='path'/><sensor "
    "type='perspective'><transform "
    "name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film "
    "type='hdrfilm'><integer name='width' value='3'/><integer name='height' value='2'/>"
    "<rfilter type='box'/></film></sensor><bsdf type='diffuse' id='a'><texture "
    "name='reflectance' type='checkerboard'/></bsdf><emitter type='constant'/>"
    "<shape type='rectangle'><ref id='a'/></shape><shape type='sphere'><float "
    "name='radius' value='.6'/><bsdf type='roughconductor'><spectrum name='eta' "
    "value='400:1, 700:2'/><string name='distribution' "
    "value='ggx'/></bsdf></shape></scene>";

/* The head of a file: bytes of the scene and numbers stand at 16 and 24. */
enum { HEAD = 104, SUM = 8 };

static imp_context *ctx;
static uint8_t good[1 << 17];
static size_t n_good, n_start; /* bytes in all, and up to the first checksum */
static struct memory_file file;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "%s\n", imp_last_error(ctx));
    abort();
}

static uint64_t word_at(const uint8_t *b, size_t at)
{
    uint64_t word;
    memcpy(&word, b + at, sizeof word);
    return word;
}

static void begin(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene;
    imp_walks *walks;
    o.threads = 1;
    run.spp = 2;
    must(imp_context_create(&o, &ctx));
    must(imp_scene_load_string(ctx, scene_text, sizeof scene_text - 1, "fuzz.xml", NULL,
                               &scene));
    must(imp_walks_keep(scene, &run, NULL, &walks));
    char name[64];
    good_file_name(name);
    must(imp_walks_write(walks, name));
    n_good = good_file_take(name, good, sizeof good);
    memory_file_open(&file);
    n_start = HEAD + word_at(good, 16) + 8 * word_at(good, 24);
    if (n_start + SUM >= n_good) abort();
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* The sum of head, scene and each parameter: this scene has numbers of 1 and 3 lanes, so
 * that parameters are told apart by the walks' own reader only when it is unchanged. */
static uint64_t sum_of(const uint8_t *b, const size_t *count, size_t n)
{
    const size_t bytes = (size_t)word_at(b, 16);
    uint64_t sum = imp__hash(0, b, HEAD);
    size_t at = HEAD + bytes;
    sum = imp__hash(sum, b + HEAD, bytes);
    for (size_t k = 0; k < n; k++) {
        sum = imp__hash(sum, b + at, 8 * count[k]);
        at += 8 * count[k];
    }
    return sum;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t b[sizeof good];
    static size_t count[32], n_params;
    imp_walks *walks;
    if (!ctx) {
        begin();
        imp_scene *scene;
        must(imp_scene_load_string(ctx, scene_text, sizeof scene_text - 1, "fuzz.xml",
                                   NULL, &scene));
        n_params = imp_scene_n_params(scene);
        if (n_params > 32) abort();
        for (size_t k = 0; k < n_params; k++) {
            struct imp_param_info info = {.size = sizeof info};
            must(imp_scene_get_param(scene, k, &info));
            count[k] = info.count;
        }
        imp_scene_destroy(scene);
        if (sum_of(good, count, n_params) != word_at(good, n_start)) abort();
    }
    memcpy(b, good, n_good);
    for (size_t k = 1; k + 3 <= size; k += 3)
        b[(data[k] | (size_t)data[k + 1] << 8) % n_start] ^= data[k + 2];
    if (size > 0 && data[0] & 1 && word_at(b, 16) == word_at(good, 16)) {
        const uint64_t sum = sum_of(b, count, n_params);
        memcpy(b + n_start, &sum, SUM);
    }
    const size_t n = size > 0 && data[0] & 2 ? n_good / 2 : n_good; /* cut short */
    memory_file_put(&file, b, n);
    if (imp_walks_read(ctx, NULL, file.path, NULL, &walks) != IMP_OK) {
        if (!imp_last_error(ctx)[0]) abort();
        return 0;
    }
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.walks = walks;
    if (imp_render(imp_walks_scene(walks), &run, &film) == IMP_OK) imp_film_destroy(film);
    else if (!imp_last_error(ctx)[0]) abort();
    imp_walks_destroy(walks);
    return 0;
}
