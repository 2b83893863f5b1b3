/* SPDX-License-Identifier: Apache-2.0
 *
 * Serialized meshes: versions 3 and 4, single and double numbers, normals, uv and colours,
 * the second of two meshes; a scene with one has the picture of the same mesh from PLY.
 * Files cut off at any byte, or with a byte changed, are errors or meshes. */
#include "format/mesh_file.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <zlib.h>

static imp_context *ctx;

struct file {
    unsigned char data[8192];
    size_t n;
};
static void put(struct file *f, const void *data, size_t n)
{
    memcpy(f->data + f->n, data, n);
    f->n += n;
}
static void put_int(struct file *f, uint64_t x, int bytes)
{
    for (int i = 0; i < bytes; i++) f->data[f->n++] = (unsigned char)(x >> (8 * i));
}
static void put_floats(struct file *f, const float *x, size_t n, bool doubles)
{
    for (size_t i = 0; i < n; i++) {
        uint32_t single;
        uint64_t twice;
        const double d = x[i];
        memcpy(&single, &x[i], 4);
        memcpy(&twice, &d, 8);
        put_int(f, doubles ? twice : single, doubles ? 8 : 4);
    }
}

static const float positions[2][12] = {
    {0, 0, 0, 1, 0, .25f, 0, 1, .5f, -1, -1, .125f},
    {2, 0, 0, 3, 0, .25f, 2, 1, .5f, 1, -1, .125f},
};
static const float normals[12] = {0, 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, 1};
static const float uvs[8] = {0, .25f, 1, 0, .5f, 1, .75f, .75f};
static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};

/* Two meshes; the second has normals, uv and colours too. */
static void file_make(struct file *f, int version, bool doubles)
{
    size_t offset[2];
    f->n = 0;
    for (int m = 0; m < 2; m++) {
        struct file body = {.n = 0};
        const unsigned flags = (m ? 1 | 2 | 8 : 0) | (doubles ? 0x2000u : 0x1000u);
        put_int(&body, flags, 4);
        if (version == 4) put(&body, m ? "second" : "first", m ? 7 : 6);
        put_int(&body, 4, 8);
        put_int(&body, 2, 8);
        put_floats(&body, positions[m], 12, doubles);
        if (m) {
            put_floats(&body, normals, 12, doubles);
            put_floats(&body, uvs, 8, doubles);
            put_floats(&body, normals, 12, doubles); /* colours */
        }
        for (int k = 0; k < 6; k++) put_int(&body, indices[k], 4);
        offset[m] = f->n;
        put_int(f, 0x041c, 2);
        put_int(f, (uint64_t)version, 2);
        uLongf room = sizeof f->data - f->n;
        if (compress(f->data + f->n, &room, body.data, body.n) != Z_OK) exit(99);
        f->n += room;
    }
    for (int m = 0; m < 2; m++) put_int(f, offset[m], version == 4 ? 8 : 4);
    put_int(f, 2, 4);
}

static enum imp_status parse(const struct file *f, int index, bool flip,
                             struct imp_arena *keep, struct imp_mesh_data *out)
{
    /* A copy of its own size, so that sanitizers see reads behind it. */
    unsigned char *copy = malloc(f->n ? f->n : 1);
    memcpy(copy, f->data, f->n);
    const struct imp_mesh_source s = {.ctx = ctx,
                                      .keep = keep,
                                      .temporary = keep,
                                      .name = "two.serialized",
                                      .text = {copy, f->n, f->n},
                                      .flip_v = flip};
    const enum imp_status st = imp__serialized_parse(&s, index, out);
    free(copy);
    return st;
}

static bool same(const float *a, const float *b, size_t n)
{
    return memcmp(a, b, n * sizeof *a) == 0;
}

static void read_back(int version, bool doubles)
{
    struct file f;
    struct imp_arena keep;
    struct imp_mesh_data one, two, flipped;
    imp__arena_init(&keep, ctx);
    file_make(&f, version, doubles);
    test_must(ctx, parse(&f, 0, false, &keep, &one));
    test_must(ctx, parse(&f, 1, false, &keep, &two));
    test_must(ctx, parse(&f, 1, true, &keep, &flipped));
    tap_ok(one.n_vertices == 4 && one.n_triangles == 2 && !one.normals && !one.uvs &&
               same(one.positions, positions[0], 12) &&
               memcmp(one.indices, indices, sizeof indices) == 0,
           "version %d, %s: the first mesh", version, doubles ? "double" : "single");
    tap_ok(same(two.positions, positions[1], 12) && same(two.normals, normals, 12) &&
               same(two.uvs, uvs, 8) && two.normals_from_file &&
               memcmp(two.indices, indices, sizeof indices) == 0 &&
               flipped.uvs[1] == .75f && flipped.uvs[0] == 0,
           "version %d, %s: the second, behind colours; v is flipped", version,
           doubles ? "double" : "single");
    tap_ok(parse(&f, 2, false, &keep, &one) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "shape_index = 2 is outside [0, 1]"),
           "version %d: a third # %s", version, imp_last_error(ctx));

    int errors = 0, meshes = 0;
    const struct file whole = f;
    for (size_t n = 0; n < whole.n; n++) {
        f.n = n;
        errors += parse(&f, 1, false, &keep, &one) == IMP_E_SCENE;
    }
    tap_ok(errors == (int)whole.n, "cut off at any byte: an error # %d of %zu", errors,
           whole.n);
    errors = 0;
    for (size_t n = 0; n < whole.n; n++)
        for (int bit = 0; bit < 8; bit++) {
            f = whole;
            f.data[n] ^= (unsigned char)(1 << bit);
            const enum imp_status st = parse(&f, 1, false, &keep, &one);
            errors += st == IMP_E_SCENE;
            meshes += st == IMP_OK && one.indices[0] < one.n_vertices;
        }
    tap_ok(errors + meshes == 8 * (int)whole.n,
           "a bit changed: an error or a mesh # %d errors, %d meshes", errors, meshes);
    imp__arena_free(&keep);
}

/* The picture of a scene with the mesh, from either file. */
static void picture(void)
{
    static const char *const shape[2] = {
        "<shape type='ply'><string name='filename' value='serialized_test.ply'/>",
        "<shape type='serialized'><string name='filename' value='serialized_test.bin'/>"
        "<integer name='shape_index' value='1'/>"};
    struct file f;
    file_make(&f, 4, false);
    FILE *out = fopen("serialized_test.bin", "wb");
    fwrite(f.data, 1, f.n, out);
    fclose(out);
    out = fopen("serialized_test.ply", "w");
    fprintf(out, "ply\nformat ascii 1.0\nelement vertex 4\n");
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz", "u", "v"};
    for (int k = 0; k < 8; k++) fprintf(out, "property float %s\n", names[k]);
    fprintf(out, "element face 2\nproperty list uchar int vertex_indices\nend_header\n");
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < 3; i++) fprintf(out, "%g ", (double)positions[1][3 * k + i]);
        for (int i = 0; i < 3; i++) fprintf(out, "%g ", (double)normals[3 * k + i]);
        fprintf(out, "%g %g\n", (double)uvs[2 * k], (double)uvs[2 * k + 1]);
    }
    fprintf(out, "3 0 1 2\n3 0 2 3\n");
    fclose(out);
    float *pixels[2] = {NULL, NULL};
    for (int k = 0; k < 2; k++) {
        char xml[2048];
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        snprintf(xml, sizeof xml,
                 "<scene version='3.0.0'><integrator type='path'/><sensor "
                 "type='perspective'><transform name='to_world'><lookat origin='2,0,4' "
                 "target='2,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
                 "name='width' value='16'/><integer name='height' "
                 "value='16'/></film></sensor><emitter type='constant'/>%s<bsdf "
                 "type='twosided'><bsdf type='diffuse'><texture type='checkerboard' "
                 "name='reflectance'/></bsdf></bsdf></shape></scene>",
                 shape[k]);
        imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
        run.spp = 4;
        test_must(ctx, imp_render(scene, &run, &film));
        pixels[k] = malloc(16 * 16 * 3 * sizeof(float));
        memcpy(pixels[k], imp_film_mean(film), 16 * 16 * 3 * sizeof(float));
        imp_film_destroy(film);
        imp_scene_destroy(scene);
    }
    double least = 1e9, most = 0;
    for (int k = 0; k < 768; k++) {
        least = fmin(least, pixels[1][k]);
        most = fmax(most, pixels[1][k]);
    }
    tap_ok(memcmp(pixels[0], pixels[1], 768 * sizeof(float)) == 0 && least < .5 &&
               most > .9,
           "the picture of the same mesh from PLY # %g to %g", least, most);
    free(pixels[0]);
    free(pixels[1]);
    remove("serialized_test.bin");
    remove("serialized_test.ply");
}

int main(void)
{
    ctx = test_context(1);
    read_back(3, false);
    read_back(4, false);
    read_back(4, true);
    picture();
    imp_context_destroy(ctx);
    return tap_done();
}
