/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads building calls from bytes and makes them: counts are checked against the bytes that are
 * left before memory is taken. */
#include "ies_file.h"
#include "kind/bsdf/measured.h"
#include "mesh_file.h"
#include "tree_file.h"
#include "tree_marks.h"
#include <string.h>

struct taking {
    struct imp_scene *scene;
    const unsigned char *at, *end;
    char text[4][IMP_TREE_TEXT_MAX];
};

static bool take(struct taking *t, void *out, size_t n)
{
    if ((size_t)(t->end - t->at) < n) return false;
    memcpy(out, t->at, n);
    t->at += n;
    return true;
}

/* In text[k]; *out NULL: there is none. */
static bool take_text(struct taking *t, int k, const char **out)
{
    uint32_t n;
    *out = NULL;
    if (!take(t, &n, sizeof n)) return false;
    if (n == UINT32_MAX) return true;
    if (n >= IMP_TREE_TEXT_MAX || !take(t, t->text[k], n) || memchr(t->text[k], 0, n))
        return false;
    t->text[k][n] = 0;
    *out = t->text[k];
    return true;
}

/* Arrays in the arena of files, which the scene frees when it is made: `keep`: in that of
 * the scene. NULL: there are not as many bytes, or no memory. */
static void *take_array(struct taking *t, size_t n, size_t size, bool keep)
{
    if (n > (size_t)(t->end - t->at) / size) return NULL;
    void *out = imp__arena_take(keep ? &t->scene->arena : &t->scene->files, n + 1, size);
    if (out) take(t, out, n * size);
    return out;
}

static struct imp_node *top_of(struct taking *t)
{
    return t->scene->stack[t->scene->n_stack - 1];
}

static bool all_in(const double *x, size_t n, double lo, double hi)
{
    for (size_t k = 0; k < n; k++)
        if (!(x[k] >= lo && x[k] <= hi)) return false;
    return true;
}

static bool take_ies(struct taking *t)
{
    int32_t size[4];
    double more[5];
    struct imp_node *node = top_of(t);
    struct imp_ies_data *d = imp__arena_array(&t->scene->arena, 1, sizeof *d);
    if (!d || node->ies || strcmp(node->tag, "emitter") != 0 ||
        !take(t, size, sizeof size) || !take(t, more, sizeof more) ||
        !all_in(more, 5, 0, 1e300) || size[2] < 0 || size[2] >> 3 ||
        (size[2] & 3) > IMP_PHOTOMETRY_A || size[0] < 2 || size[1] < 1 ||
        size[0] > IMP_IES_ANGLES_MAX || size[1] > IMP_IES_ANGLES_MAX || size[3] < 0)
        return false;
    const size_t n = (size_t)size[3], v = (size_t)size[0], h = (size_t)size[1];
    d->n_vertical = size[0];
    d->n_horizontal = size[1];
    d->type = (enum imp_photometry)(size[2] & 3);
    d->length_c0 = size[2] & 4;
    d->lamp_flux = more[0];
    d->watts = more[1];
    for (int k = 0; k < 3; k++) d->size[k] = more[2 + k];
    d->vertical = take_array(t, v, sizeof(double), true);
    d->horizontal = take_array(t, h, sizeof(double), true);
    d->candela = take_array(t, v * h, sizeof(double), true);
    if (n > 0) {
        d->n_tilts = size[3];
        d->tilt = take_array(t, n, sizeof(double), true);
        d->tilt_factor = take_array(t, n, sizeof(double), true);
        if (!d->tilt || !d->tilt_factor || !all_in(d->tilt, n, 0, 180) ||
            !all_in(d->tilt_factor, n, 0, 1e300))
            return false;
    }
    node->ies = d;
    return d->vertical && d->horizontal && d->candela && imp__ies_is_valid(d) &&
           all_in(d->candela, v * h, 0, 1e300);
}

static bool take_merl(struct taking *t)
{
    int32_t size[3];
    struct imp_node *node = top_of(t);
    struct imp_merl_data *d = imp__arena_array(&t->scene->arena, 1, sizeof *d);
    if (!d || node->merl || !take(t, size, sizeof size)) return false;
    for (int k = 0; k < 3; k++)
        if (size[k] < 1 || size[k] > 1 << 12) return false;
    const size_t n = 3 * (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    const float *rho = take_array(t, n, sizeof *rho, true);
    for (size_t k = 0; rho && k < n; k++)
        if (!(rho[k] >= 0 && rho[k] < 1e30f)) return false;
    *d = (struct imp_merl_data){size[0], size[1], size[2], rho};
    node->merl = d;
    return rho != NULL;
}

static bool take_measured(struct taking *t)
{
    size_t count[IMP_MEASURED_TABLES];
    struct imp_node *node = top_of(t);
    struct imp_measured_data *d = imp__arena_array(&t->scene->arena, 1, sizeof *d);
    if (!d || node->measured || !take(t, d, offsetof(struct imp_measured_data, table)) ||
        !imp__measured_counts(d, count))
        return false;
    for (int k = 0; k < IMP_MEASURED_TABLES; k++) {
        if (!count[k]) continue;
        float *table = take_array(t, count[k], sizeof *table, true);
        if (!table || imp__measured_mend((enum imp__measured_table)k, table, count[k]))
            return false;
        d->table[k] = table;
    }
    node->measured = d;
    return true;
}

static bool take_grid(struct taking *t)
{
    int32_t size[4];
    float box[6];
    size_t n = 1;
    struct imp_node *node = top_of(t);
    struct imp_grid_data *d = imp__arena_array(&t->scene->files, 1, sizeof *d);
    if (!d || node->grid || !take(t, size, sizeof size) || !take(t, box, sizeof box) ||
        (size[3] != 1 && size[3] != 3))
        return false;
    for (int k = 0; k < 4; k++)
        if (size[k] < 1 || size[k] > INT32_MAX / 4 ||
            __builtin_mul_overflow(n, (size_t)size[k], &n))
            return false;
    const float *value = take_array(t, n, sizeof *value, false);
    for (size_t k = 0; value && k < n; k++)
        if (!isfinite(value[k])) return false;
    for (int k = 0; k < 6; k++)
        if (!isfinite(box[k])) return false;
    *d = (struct imp_grid_data){
        .n = {size[0], size[1], size[2]}, .channels = size[3], .value = value};
    memcpy(d->box, box, sizeof box);
    node->grid = d;
    return value != NULL;
}

static bool take_image(struct taking *t)
{
    int32_t size[3];
    if (!take(t, size, sizeof size)) return false;
    for (int k = 0; k < 3; k++)
        if (size[k] < 1 || size[k] > 1 << 20) return false;
    const float *pixels = take_array(
        t, (size_t)size[0] * (size_t)size[1] * (size_t)size[2], sizeof *pixels, false);
    if (pixels) imp_scene_image(t->scene, size[0], size[1], size[2], pixels);
    return pixels != NULL;
}

static bool take_mesh(struct taking *t)
{
    uint64_t n[2];
    if (!take(t, n, sizeof n) || n[0] > IMP_MESH_MAX || n[1] > IMP_MESH_MAX) return false;
    const float *at = take_array(t, 3 * n[0], sizeof *at, false);
    const uint32_t *index = at ? take_array(t, 3 * n[1], sizeof *index, false) : NULL;
    if (index) imp_scene_mesh(t->scene, n[0], n[1], at, NULL, NULL, index);
    return index != NULL;
}

static bool take_spectrum(struct taking *t, const char *name)
{
    uint64_t n;
    double value;
    if (!take(t, &n, sizeof n)) return false;
    if (n == 0) {
        if (!take(t, &value, sizeof value)) return false;
        imp_scene_spectrum(t->scene, name, 1, NULL, &value);
        return true;
    }
    const double *list =
        n > SIZE_MAX / 32 ? NULL : take_array(t, 2 * n, sizeof *list, false);
    if (list) imp_scene_spectrum(t->scene, name, n, list, list + n);
    return list != NULL;
}

/* A property; its name is in text[0]. */
static bool take_prop(struct taking *t, enum imp__tree_mark mark)
{
    const char *name, *text;
    uint8_t yes;
    int64_t integer;
    double x[16];
    struct imp_scene *s = t->scene;
    if (!take_text(t, 0, &name) || !name || strcmp(name, "filename") == 0) return false;
    switch (mark) {
    case MARK_BOOL:
        if (!take(t, &yes, 1)) return false;
        imp_scene_bool(s, name, yes);
        return true;
    case MARK_INTEGER:
        if (!take(t, &integer, sizeof integer)) return false;
        imp_scene_integer(s, name, integer);
        return true;
    case MARK_STRING:
        if (!take_text(t, 1, &text) || !text) return false;
        imp_scene_string(s, name, text);
        return true;
    case MARK_FLOAT:
        if (!take(t, x, sizeof *x)) return false;
        imp_scene_float(s, name, x[0]);
        return true;
    case MARK_VECTOR:
    case MARK_RGB:
        if (!take(t, x, 3 * sizeof *x)) return false;
        if (mark == MARK_RGB) imp_scene_rgb(s, name, x);
        else imp_scene_vector(s, name, x);
        return true;
    case MARK_TRANSFORM:
        if (!take(t, x, sizeof x)) return false;
        imp_scene_transform(s, name, x);
        return true;
    case MARK_SPECTRUM: return take_spectrum(t, name);
    default: return false;
    }
}

static bool take_begin(struct taking *t)
{
    const char *text[4];
    for (int k = 0; k < 4; k++)
        if (!take_text(t, k, &text[k])) return false;
    if (!text[0] || !text[1]) return false;
    imp_scene_begin(t->scene, text[0], text[1], text[2], text[3]);
    return true;
}

static bool take_ref(struct taking *t)
{
    const char *id, *name;
    if (!take_text(t, 0, &id) || !take_text(t, 1, &name) || !id) return false;
    imp_scene_ref(t->scene, id, name);
    return true;
}

/* Up to the end of the scene, or the first call that fails, whose reason commit has. */
static bool take_calls(struct taking *t)
{
    while (t->scene->build_status == IMP_OK) {
        uint8_t mark;
        bool good = true;
        if (!take(t, &mark, 1)) return false;
        const bool inside = t->scene->n_stack > 1;
        if (mark == MARK_END && !inside) return t->at == t->end;
        if (mark == MARK_END) imp_scene_end(t->scene);
        else if (mark == MARK_BEGIN) good = take_begin(t);
        else if (mark == MARK_REF) good = take_ref(t);
        else if (!inside) return false;
        else if (mark == MARK_IMAGE) good = take_image(t);
        else if (mark == MARK_MESH) good = take_mesh(t);
        else if (mark == MARK_IES) good = take_ies(t);
        else if (mark == MARK_MERL) good = take_merl(t);
        else if (mark == MARK_MEASURED) good = take_measured(t);
        else if (mark == MARK_GRID) good = take_grid(t);
        else good = take_prop(t, (enum imp__tree_mark)mark);
        if (!good) return false;
    }
    return true;
}

enum imp_status imp__tree_take(imp_context *ctx, const char *name,
                               const unsigned char *bytes, size_t n, imp_scene **out)
{
    enum imp_status st = IMP_OK;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct taking *t = imp__alloc(ctx, 1, sizeof *t);
    uint8_t how[2];
    if (!t) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for a scene", name);
    t->at = bytes;
    t->end = bytes + n;
    if (!take(t, how, sizeof how) || how[0] > IMP_SINGLE || how[1] > 1)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: damaged (its scene)", name));
    o.mode = (enum imp_color_mode)how[0];
    o.upsampling = how[1] ? IMP_UPSAMPLING_LINEAR : IMP_UPSAMPLING_SIGMOID;
    IMP_TRY(imp_scene_create(ctx, &o, &t->scene));
    t->scene->rayless = true;
    if (!take_calls(t))
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: damaged (its scene)", name));
    st = imp_scene_commit(t->scene);
    if (st != IMP_OK) IMP_TRY(imp__error_prefix(ctx, st, "%s: its scene", name));
    *out = t->scene;
    t->scene = NULL;
out:
    imp_scene_destroy(t->scene);
    imp__release(ctx, t);
    return st;
}
