/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of recorded walks. A good file is made here, and the bytes say where it is changed:
 * every three are a place (two bytes) and what is xored there. With an odd first byte the
 * checksum is made to fit again, so that decisions no tracer makes are looked at one by
 * one. What is read is evaluated and swept. */
#include "math/hash.h"
#include "memory_file.h"
#include "walk/kept/record.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
    "value='2'/>"
    "</integrator><sensor type='perspective'><transform name='to_world'><lookat "
    "origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
    "name='width' value='8'/><integer name='height' value='8'/></film></sensor>"
    "<emitter type='constant'/>"
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/></transform>"
    "<bsdf type='diffuse'><texture name='reflectance' "
    "type='checkerboard'/></bsdf></shape>"
    "<shape type='sphere'><float name='radius' value='.6'/><point name='center' x='.5' "
    "y='0' z='1'/><bsdf type='dielectric'/></shape>"
    "<shape type='sphere'><float name='radius' value='.4'/><point name='center' x='-.8' "
    "y='0' z='.6'/><bsdf type='twosided'><bsdf type='roughconductor'/></bsdf></shape>"
    "<shape type='sphere'><float name='radius' value='.4'/><point name='center' x='0' "
    "y='-.9' z='.6'/><bsdf type='null'/><medium name='interior' type='homogeneous'>"
    "<float name='sigma_t' value='2'/></medium></shape>"
    "<shape type='sphere'><float name='radius' value='.4'/><point name='center' x='.8' "
    "y='-.9' z='.6'/><bsdf type='null'/><medium name='interior' type='heterogeneous'>"
    "<float name='sigma_t' value='2'/></medium></shape>"
    "<shape type='sphere'><float name='radius' value='.2'/><point name='center' x='-.8' "
    "y='.8' z='1'/><emitter type='area'/></shape>"
    "<emitter type='point'><point name='position' x='0' y='3' z='3'/></emitter></scene>";

enum { WALKS = 40, HEAD = 96, SUM = 8 };

static imp_context *ctx;
static struct imp_active active;
static struct imp_tracer tracer;
static struct imp_arena arena;
static uint8_t good[1 << 16];
static size_t n_good;
static struct memory_file file;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "%s\n", imp_last_error(ctx));
    abort();
}

static void begin(void)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_scene *scene;
    struct imp_record record;
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    must(imp_scene_load_string(ctx, scene_text, sizeof scene_text - 1, "fuzz.xml", NULL,
                               &scene));
    static uint8_t chosen[256];
    if (scene->n_params > sizeof chosen) abort();
    for (size_t k = 0; k < scene->n_params; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    must(imp__active_create(scene, chosen, &active));
    tracer = (struct imp_tracer){.scene = scene,
                                 .integrator = imp__walk_integrator(scene),
                                 .sensor = scene->sensors[0],
                                 .active = &active,
                                 .collisions_fixed = true};
    imp__arena_init(&arena, ctx);
    must(imp__record_create(&tracer, sizeof good, &record));
    for (int i = 0; i < WALKS; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_walk walk;
        imp__walk_trace(&tracer, &arena, i % 8, i / 8, i, &walk);
        must(imp__record_keep(&record, &walk, i));
        imp__arena_rewind(&arena, mark);
    }
    char name[64];
    memory_file_open(&file);
    good_file_name(name);
    must(imp__record_write(&record, name));
    n_good = good_file_take(name, good, sizeof good);
    const size_t starts = 2 * record.n_vertices, /* in memory alone */
        pages = (record.n_vertices + IMP_RECORD_PAGE - 1) / IMP_RECORD_PAGE;
    if (n_good != HEAD + imp__record_bytes(&record) - starts + 4 * pages + SUM) abort();
    imp__record_destroy(&record);
}

static void nothing(struct imp_sink *sink, int param, size_t element, int channels,
                    const imp_spec *bar)
{
    (void)sink, (void)bar;
    const struct imp_param_info *info = &tracer.scene->params[param].info;
    if (element + (size_t)channels > info->count) abort();
}

static uint64_t part_hash(uint64_t sum, const uint8_t *b, size_t end, size_t *at,
                          size_t n)
{
    if (n > end - *at) n = end - *at;
    sum = imp__hash(sum, b + *at, n);
    *at += n;
    return sum;
}
static uint64_t hash_of(const uint8_t *b, size_t n) /* the parts of a file in turn */
{
    const size_t end = n - SUM;
    uint64_t walks, vertices, sum = imp__hash(0, b, HEAD);
    size_t at = HEAD;
    memcpy(&walks, b + 64, sizeof walks);
    memcpy(&vertices, b + 72, sizeof vertices);
    if (walks > n || vertices > n) return 0;
    if (walks > 0)
        sum = part_hash(sum, b, end, &at, walks * sizeof(struct imp_record_walk));
    for (uint64_t k = 0; k < vertices && end - at >= 4; k += IMP_RECORD_PAGE) {
        uint32_t words;
        memcpy(&words, b + at, sizeof words);
        sum = part_hash(sum, b, end, &at, sizeof words);
        sum = part_hash(sum, b, end, &at, 4 * (size_t)words);
    }
    return at < end ? imp__hash(sum, b + at, end - at) : sum;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t b[sizeof good];
    struct imp_record record;
    if (!ctx) begin();
    memcpy(b, good, n_good);
    for (size_t k = 1; k + 3 <= size; k += 3)
        b[(data[k] | (size_t)data[k + 1] << 8) % (n_good - SUM)] ^= data[k + 2];
    if (size > 0 && data[0] & 1) {
        const uint64_t sum = hash_of(b, n_good);
        memcpy(b + n_good - SUM, &sum, SUM);
    }
    const size_t n = size > 0 && data[0] & 2 ? n_good / 2 : n_good; /* cut short */
    memory_file_put(&file, b, n);
    if (imp__record_read(&tracer, file.path, sizeof good, &record) != IMP_OK) {
        if (!imp_last_error(ctx)[0]) abort();
        return 0;
    }
    for (size_t i = 0; i < record.n_walks; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_sink sink = {.add = nothing};
        struct imp_walk walk;
        imp__record_walk(&record, i, &tracer, &arena, &walk);
        imp__walk_sweep(&tracer, &walk, (imp_spec){1, 1, 1, 0}, &sink);
        /* Negative: a null collision where extinction is above the bound (record.h). */
        for (int c = 0; c < 3; c++)
            if (!(fabs(walk.L[c]) <= 3.5e38)) abort();
        imp__arena_rewind(&arena, mark);
    }
    imp__record_destroy(&record);
    return 0;
}
