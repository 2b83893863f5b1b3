/* SPDX-License-Identifier: Apache-2.0
 *
 * Solutions of finite elements in files. A good file is made here, and the bytes say where it is
 * changed: after the first, every three are a place (two bytes) and what is xored there. The
 * first: bit 0, the checksum is made to fit again; bit 1, half of the file is missing. What is
 * read is measured. */
#include "math/hash.h"
#include "memory_file.h"
#include <importon/elements.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { HEAD = 80, SUM = 8 }; /* the checksum is the end of the head */

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='elements'/><sensor type='perspective'>"
    "<transform name='to_world'><lookat origin='0,0,3' target='0,0,0' "
    "up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "
    "value='4'/>"
    "</film></sensor><shape type='rectangle'><bsdf type='diffuse'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='.3'/>"
    "<rotate y='1' angle='180'/><translate z='1'/></transform><emitter "
    "type='area'/></shape>"
    "</scene>";

static imp_context *ctx;
static imp_scene *scene;
static uint8_t *good;
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
    struct imp_elements_options solve = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e;
    char name[64];
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    must(imp_scene_load_string(ctx, scene_text, sizeof scene_text - 1, "fuzz.xml", NULL,
                               &scene));
    solve.max_level = 1;
    must(imp_elements_create(scene, &solve, &e));
    must(imp_elements_solve(e));
    good_file_name(name);
    must(imp_elements_save(e, name));
    imp_elements_destroy(e);
    good = malloc(1 << 22);
    if (!good) abort();
    n_good = good_file_take(name, good, 1 << 22);
    memory_file_open(&file);
    if (n_good <= HEAD) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!ctx) begin();
    const int how = size > 0 ? data[0] : 0;
    uint8_t *bytes = malloc(n_good);
    if (!bytes) abort();
    memcpy(bytes, good, n_good);
    for (size_t k = 1; k + 3 <= size; k += 3)
        bytes[(data[k] | (size_t)data[k + 1] << 8) % n_good] ^= data[k + 2];
    const size_t n = how & 2 ? n_good / 2 : n_good;
    if (how & 1) {
        memset(bytes + HEAD - SUM, 0, SUM);
        const uint64_t sum = imp__hash(imp__hash(0, bytes, HEAD), bytes + HEAD, n - HEAD);
        memcpy(bytes + HEAD - SUM, &sum, SUM);
    }
    memory_file_put(&file, bytes, n);
    free(bytes);
    struct imp_elements_options solve = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e = NULL;
    solve.max_level = 1;
    if (imp_elements_open(scene, &solve, file.path, &e) == IMP_OK) {
        imp_film *f = NULL;
        if (imp_elements_image(e, 0, IMP_ELEMENTS_GOURAUD, 1, &f) == IMP_OK)
            imp_film_destroy(f);
        imp_elements_destroy(e);
    } else if (e || size < 2) { /* nothing was changed, but for a half */
        if (e || !(how & 2)) abort();
    }
    return 0;
}
