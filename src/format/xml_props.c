/* SPDX-License-Identifier: Apache-2.0
 *
 * Tags that are plain properties of an object (docs/scene-format.md 1.1). */
#include "search.h"
#include "value.h"
#include "xml.h"
#include <string.h>

struct imp_prop *imp__xml_prop(struct xml_file *f, const struct xml_attributes *a,
                               enum imp_prop_type type)
{
    struct imp_prop *p = NULL;
    const char *name = imp__xml_name(f, a);
    if (f->st != IMP_OK) return NULL;
    imp__xml_fail_placed(f, imp__tree_prop(&f->reader->tree, imp__xml_top(f)->props, name,
                                           type, imp__xml_loc(f), &p));
    return p;
}

static void bad_value(struct xml_file *f, const char *tag, const struct xml_attributes *a,
                      const char *what)
{
    imp__xml_fail(f, IMP_E_SCENE, "%s '%s': '%.80s' is not %s", tag,
                  imp__xml_get(a, "name"), imp__xml_get(a, "value"), what);
}

void imp__xml_integer(struct xml_file *f, const struct xml_attributes *a)
{
    int64_t v;
    if (!imp__value_integer(imp__xml_get(a, "value"), &v)) {
        bad_value(f, "integer", a, "an integer");
        return;
    }
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_INTEGER);
    if (p) p->integer = v;
}

void imp__xml_float(struct xml_file *f, const struct xml_attributes *a)
{
    double v;
    if (!imp__value_float(imp__xml_get(a, "value"), &v)) {
        bad_value(f, "float", a, "a finite number");
        return;
    }
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_FLOAT);
    if (p) p->number[0] = v;
}

void imp__xml_boolean(struct xml_file *f, const struct xml_attributes *a)
{
    bool v;
    if (!imp__value_bool(imp__xml_get(a, "value"), &v)) {
        bad_value(f, "boolean", a, "true or false");
        return;
    }
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_BOOL);
    if (p) p->integer = v;
}

void imp__xml_string(struct xml_file *f, const struct xml_attributes *a)
{
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_STRING);
    if (!p) return;
    p->string = imp__arena_strdup(&f->reader->scene->arena, imp__xml_get(a, "value"));
    if (!p->string) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
}

/* x y z with defaults `missing`, or value; false if f failed. */
bool imp__xml_xyz(struct xml_file *f, const char *tag, const struct xml_attributes *a,
                  double missing, double out[3])
{
    static const char *const axis[] = {"x", "y", "z"};
    const char *value = imp__xml_get(a, "value");
    for (int i = 0; i < 3; i++) {
        const char *text = imp__xml_get(a, axis[i]);
        out[i] = missing;
        if (text && value) {
            imp__xml_fail(f, IMP_E_SCENE, "%s: either 'value' or x, y, z, not both", tag);
            return false;
        }
        if (text && !imp__value_float(text, &out[i])) {
            imp__xml_fail(f, IMP_E_SCENE, "%s: %s = '%.80s' is not a finite number", tag,
                          axis[i], text);
            return false;
        }
    }
    if (value && !imp__value_triple(value, out)) {
        imp__xml_fail(f, IMP_E_SCENE, "%s: '%.80s' is not one or three finite numbers",
                      tag, value);
        return false;
    }
    return true;
}

void imp__xml_vector(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (!imp__xml_get(a, "value") &&
        !(imp__xml_get(a, "x") && imp__xml_get(a, "y") && imp__xml_get(a, "z"))) {
        imp__xml_fail(f, IMP_E_SCENE,
                      "point or vector '%s': needs x, y and z, or 'value'",
                      imp__xml_get(a, "name"));
        return;
    }
    if (!imp__xml_xyz(f, "point or vector", a, 0, v)) return;
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_VECTOR);
    if (p) memcpy(p->number, v, sizeof v);
}

void imp__xml_rgb(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (!imp__value_triple(imp__xml_get(a, "value"), v)) {
        bad_value(f, "rgb", a, "one or three finite numbers");
        return;
    }
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_RGB);
    if (p) memcpy(p->number, v, sizeof v);
}

static enum imp_status samples_of(struct xml_file *f, const char *value,
                                  const char *filename, struct imp_samples *out)
{
    struct xml_reader *r = f->reader;
    if (value) return imp__samples_parse(r->ctx, value, out);
    const char *path;
    const enum imp_status st =
        imp__search(r->scene, f->includer ? f->folder : NULL, filename, &path);
    return st == IMP_OK ? imp__samples_read(r->ctx, path, out) : st;
}

void imp__xml_spectrum(struct xml_file *f, const struct xml_attributes *a)
{
    const char *value = imp__xml_get(a, "value"), *filename = imp__xml_get(a, "filename");
    if (!value == !filename) {
        imp__xml_fail(f, IMP_E_SCENE, "spectrum '%s': needs either 'value' or 'filename'",
                      imp__xml_get(a, "name"));
        return;
    }
    double constant;
    if (value && !strchr(value, ':')) {
        if (imp__value_list(value, 1, &constant) != 1) {
            bad_value(f, "spectrum", a, "a finite number or a list of wavelength:value");
            return;
        }
        struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_UNIFORM);
        if (p) p->number[0] = constant;
        return;
    }
    struct imp_samples s = {0};
    const enum imp_status st = samples_of(f, value, filename, &s);
    if (st != IMP_OK) {
        imp__error_prefix(f->reader->ctx, st, "spectrum '%s'", imp__xml_get(a, "name"));
        imp__xml_fail_here(f, st);
        return;
    }
    struct imp_prop *p = imp__xml_prop(f, a, IMP_PROP_SPECTRUM);
    double *list =
        p ? imp__arena_array(&f->reader->scene->arena, 2 * s.n, sizeof *list) : NULL;
    if (list) {
        memcpy(list, s.list, 2 * s.n * sizeof *list);
        p->list = list;
        p->n = s.n;
    } else imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    imp__release(f->reader->ctx, s.list);
}
