/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials of the RGL format: what is read is what was written, the message of
 * every error, files cut off and damaged anywhere; and the place of a
 * file's error in the scene. */
#include "format/measured_file.h"
#include "imp_measured.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/bsdf/measured.h"
#include "math/rng.h"
#include <unistd.h>

static imp_context *ctx;
static char path[64];
static struct rgl_tables tables;

static enum imp_status load(imp_context *c, const struct imp_bytes *file,
                            struct imp_arena *keep, struct imp_measured_data *d)
{
    imp__arena_init(keep, c);
    return imp__measured_parse(c, keep, "m.bsdf", file, d);
}

static void written(const struct rgl_field *field, int n, struct imp_bytes *out)
{
    if (!rgl_write_fields(path, field, n)) exit(99);
    test_must(ctx, imp__file_read(ctx, path, 1 << 24, out));
}

static void reading(void)
{
    struct rgl_field field[RGL_FIELDS];
    struct imp_bytes file = {0};
    struct imp_arena keep;
    struct imp_measured_data d;
    size_t count[IMP_MEASURED_TABLES], wrong = 0, all = 0;
    rgl_fields(&tables, field);
    written(field, RGL_FIELDS, &file);
    test_must(ctx, load(ctx, &file, &keep, &d));
    const bool sizes = imp__measured_counts(&d, count);
    for (int k = 0; k < IMP_MEASURED_TABLES && sizes; k++)
        for (size_t i = 0; i < count[k]; i++, all++)
            wrong += d.table[k][i] != tables.data.table[k][i];
    tap_ok(sizes && wrong == 0 && all > 1000 && d.jacobian == 1 && d.n_phi == RGL_PHIS,
           "%zu numbers as written", all);
    imp__arena_free(&keep);
    imp__bytes_free(ctx, &file);
}

/* One thing is wrong in a file that is else right. */
static void errors(void)
{
    static const float falling[RGL_THETAS] = {0, 0.4f, 0.3f, 1},
                       huge[RGL_WAVES] = {400, 500, 600, NAN};
    static const struct {
        struct rgl_field in_place; /* of the field of this name */
        const char *message;
    } cases[] = {
        {{"ndf", 0, 0, {0}, NULL}, "it has no field 'ndf'"},
        {{"wavelengths", 0, 0, {0}, NULL}, "it has no field 'wavelengths'"},
        {{"sigma", 1, 2, {10, 14}, tables.sigma},
         "field 'sigma' has 2 sizes and the type 1; it must have 2 and 10 (float32)"},
        {{"vndf", 10, 3, {5, 4, 140}, tables.vndf}, "field 'vndf' has 3 sizes"},
        {{"vndf", 10, 4, {4, 4, 10, 14}, tables.vndf},
         "size 1 of field 'vndf' is 4; that of 'phi_i': 5"},
        {{"luminance", 10, 4, {5, 4, 7, 6}, tables.luminance},
         "size 4 of field 'luminance' is 6"},
        {{"rgb", 10, 5, {5, 4, 4, 7, 7}, tables.spectra},
         "size 3 of field 'rgb' is 4; red, green, blue: 3"},
        {{"spectra", 10, 5, {5, 4, 3, 7, 7}, tables.rgb},
         "size 3 of field 'spectra' is 3; that of 'wavelengths': 4"},
        {{"ndf", 10, 2, {140, 1}, tables.ndf}, "field 'ndf' has 140 x 1 nodes"},
        {{"theta_i", 10, 1, {RGL_THETAS}, falling}, "field 'theta_i' does not ascend"},
        {{"wavelengths", 10, 1, {RGL_WAVES}, huge},
         "field 'wavelengths' has a number that is not finite"},
        {{"jacobian", 1, 1, {2}, "\1\1"}, "size 1 of field 'jacobian' is 2"},
        {{"theta_i", 77, 1, {RGL_THETAS}, falling},
         "field 'theta_i' has the unknown type 77"}};
    for (size_t i = 0; i < imp_count(cases); i++) {
        struct rgl_field field[RGL_FIELDS];
        struct imp_bytes file = {0};
        struct imp_arena keep;
        struct imp_measured_data d;
        rgl_fields(&tables, field);
        for (int k = 0; k < RGL_FIELDS; k++)
            if (strcmp(field[k].name, cases[i].in_place.name) == 0)
                field[k] = cases[i].in_place;
        written(field, RGL_FIELDS, &file);
        const enum imp_status st = load(ctx, &file, &keep, &d);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), cases[i].message) &&
                   strstr(imp_last_error(ctx), "m.bsdf: "),
               "%s # %s", cases[i].message, st ? imp_last_error(ctx) : "nothing");
        imp__arena_free(&keep);
        imp__bytes_free(ctx, &file);
    }
}

/* Cut, and with bytes changed: refused with the file's name, or read. */
static void damage(void)
{
    struct rgl_field field[RGL_FIELDS];
    struct imp_bytes file = {0};
    size_t refused = 0, good = 0, silent = 0;
    rgl_fields(&tables, field);
    written(field, RGL_FIELDS, &file);
    const size_t head = 500; /* of the fields' names and sizes */
    for (uint32_t i = 0; i < 20000; i++) {
        struct imp_arena keep;
        struct imp_measured_data d;
        struct imp_bytes part = file;
        unsigned char kept[4];
        size_t at[4];
        if (i % 4 == 0) part.size = (size_t)(imp__u01(imp__key(1, 0, i), 0) * 700);
        for (uint32_t k = 0; k < 4; k++) {
            at[k] = (size_t)(imp__u01(imp__key(1, 1, i), k) * (double)head);
            kept[k] = file.data[at[k]];
            if (k < i % 4)
                file.data[at[k]] =
                    i % 5 ? (unsigned char)(imp__u01(imp__key(1, 2, i), k) * 256) : 255;
        }
        const enum imp_status st = load(ctx, &part, &keep, &d);
        if (st == IMP_OK) good++;
        else if (strncmp(imp_last_error(ctx), "m.bsdf: ", 8) == 0) refused++;
        else silent++;
        for (int k = 3; k >= 0; k--) file.data[at[k]] = kept[k];
        imp__arena_free(&keep);
    }
    tap_ok(refused > 9000 && good > 100 && silent == 0,
           "damaged files: %zu refused by name, %zu read", refused, good);
    imp__bytes_free(ctx, &file);
}

static void scenes(void)
{
    static const char *const texts[] = {
        "<scene version='3.0.0'><shape type='sphere'><bsdf type='measured'/></shape>"
        "</scene>",
        "<scene version='3.0.0'><shape type='sphere'><bsdf type='measured'><string "
        "name='filename' value='%s'/><rgb name='scale' value='1,-1,0'/></bsdf></shape>"
        "</scene>",
        "<scene version='3.0.0'><shape type='sphere'><bsdf type='measured'><string "
        "name='filename' value='meson.build'/></bsdf></shape></scene>"};
    static const char *const messages[] = {"'filename'", "scale", "meson.build"};
    if (!rgl_write(path, &(struct rgl_model){{0.3, 0.3}, 0, true, false, true})) exit(99);
    for (size_t i = 0; i < imp_count(texts); i++) {
        char xml[600];
        imp_scene *s = NULL;
        snprintf(xml, sizeof xml, texts[i], path);
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
        tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), "test:1:") &&
                   strstr(imp_last_error(ctx), messages[i]),
               "a scene's error has its place # %s", st ? imp_last_error(ctx) : "none");
        imp_scene_destroy(s);
    }
}

int main(void)
{
    ctx = test_context(1);
    snprintf(path, sizeof path, "tensor_files_%d.bsdf", (int)getpid());
    rgl_fill(&(struct rgl_model){{0.3, 0.5}, 2, true, true, true}, &tables);
    reading();
    errors();
    damage();
    scenes();
    remove(path);
    imp_context_destroy(ctx);
    return tap_done();
}
