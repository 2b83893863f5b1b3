/* SPDX-License-Identifier: Apache-2.0
 *
 * Fields of an RGL file found by name, their sizes checked against each other, tables copied. */
#include "measured_file.h"
#include "base/little.h"
#include "kind/bsdf/measured.h"

enum { DESCRIPTION = IMP_MEASURED_TABLES, JACOBIAN, FIELDS };
static const struct {
    const char *name;
    int type, rank;
} fields[FIELDS] = {[IMP_MEASURED_THETA] = {"theta_i", IMP_TENSOR_FLOAT, 1},
                    [IMP_MEASURED_PHI] = {"phi_i", IMP_TENSOR_FLOAT, 1},
                    [IMP_MEASURED_NDF] = {"ndf", IMP_TENSOR_FLOAT, 2},
                    [IMP_MEASURED_SIGMA] = {"sigma", IMP_TENSOR_FLOAT, 2},
                    [IMP_MEASURED_VNDF] = {"vndf", IMP_TENSOR_FLOAT, 4},
                    [IMP_MEASURED_LUMINANCE] = {"luminance", IMP_TENSOR_FLOAT, 4},
                    [IMP_MEASURED_WAVELENGTHS] = {"wavelengths", IMP_TENSOR_FLOAT, 1},
                    [IMP_MEASURED_RGB] = {"rgb", IMP_TENSOR_FLOAT, 5},
                    [IMP_MEASURED_SPECTRA] = {"spectra", IMP_TENSOR_FLOAT, 5},
                    [DESCRIPTION] = {"description", IMP_TENSOR_UINT8, 1},
                    [JACOBIAN] = {"jacobian", IMP_TENSOR_UINT8, 1}};

/* field[k] NULL: it is not there, and need not be. */
static enum imp_status fields_find(imp_context *ctx, const struct imp__tensor_file *file,
                                   const struct imp__tensor_field *field[FIELDS])
{
    for (int k = 0; k < FIELDS; k++) field[k] = imp__tensor_find(file, fields[k].name);
    const bool rgb = field[IMP_MEASURED_RGB],
               spectra = field[IMP_MEASURED_WAVELENGTHS] || field[IMP_MEASURED_SPECTRA];
    if (!rgb && !spectra)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: it has neither a field 'rgb' nor 'spectra'", file->name);
    for (int k = 0; k < FIELDS; k++) {
        const bool optional =
            k == IMP_MEASURED_RGB || k == DESCRIPTION ||
            (!spectra && (k == IMP_MEASURED_WAVELENGTHS || k == IMP_MEASURED_SPECTRA));
        if (!field[k] && optional) continue;
        if (!field[k])
            return imp__error(ctx, IMP_E_SCENE, "%s: it has no field '%s'", file->name,
                              fields[k].name);
        if (field[k]->type != fields[k].type || field[k]->rank != fields[k].rank)
            return imp__error(ctx, IMP_E_SCENE,
                              "%s: field '%s' has %d sizes and the type %d; it must have "
                              "%d and %d (%s)",
                              file->name, fields[k].name, field[k]->rank, field[k]->type,
                              fields[k].rank, fields[k].type,
                              fields[k].type == IMP_TENSOR_FLOAT ? "float32" : "uint8");
        for (int d = 0; d < field[k]->rank && k < IMP_MEASURED_TABLES; d++)
            if (field[k]->size[d] > IMP_MEASURED_SIDE_MAX)
                return imp__error(
                    ctx, IMP_E_SCENE, "%s: field '%s' has a size of %zu; at most %d",
                    file->name, fields[k].name, field[k]->size[d], IMP_MEASURED_SIDE_MAX);
    }
    return IMP_OK;
}

/* Size d of field k must be `want`. */
static enum imp_status same(imp_context *ctx, const struct imp__tensor_file *file,
                            const struct imp__tensor_field *f, int d, int want,
                            const char *why)
{
    if (!f || f->size[d] == (size_t)want) return IMP_OK;
    return imp__error(ctx, IMP_E_SCENE, "%s: size %d of field '%s' is %zu; %s: %d",
                      file->name, d + 1, f->name, f->size[d], why, want);
}

static enum imp_status sizes_read(imp_context *ctx, const struct imp__tensor_file *file,
                                  const struct imp__tensor_field *const field[FIELDS],
                                  struct imp_measured_data *out)
{
    static const int grids[] = {IMP_MEASURED_NDF, IMP_MEASURED_SIGMA, IMP_MEASURED_VNDF,
                                IMP_MEASURED_LUMINANCE};
    static const int squares[] = {IMP_MEASURED_LUMINANCE, IMP_MEASURED_RGB,
                                  IMP_MEASURED_SPECTRA};
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < imp_count(grids); k++) {
        const struct imp__tensor_field *f = field[grids[k]];
        if (f->size[f->rank - 1] < 2 || f->size[f->rank - 2] < 2)
            return imp__error(
                ctx, IMP_E_SCENE, "%s: field '%s' has %zu x %zu nodes; it needs 2 x 2",
                file->name, f->name, f->size[f->rank - 2], f->size[f->rank - 1]);
    }
    out->n_theta = (int)field[IMP_MEASURED_THETA]->size[0];
    out->n_phi = (int)field[IMP_MEASURED_PHI]->size[0];
    out->n_wave =
        field[IMP_MEASURED_SPECTRA] ? (int)field[IMP_MEASURED_WAVELENGTHS]->size[0] : 0;
    out->rgb = field[IMP_MEASURED_RGB] != NULL;
    out->side = (int)field[IMP_MEASURED_LUMINANCE]->size[2];
    for (int d = 0; d < 2; d++) {
        out->ndf[d] = (int)field[IMP_MEASURED_NDF]->size[d];
        out->sigma[d] = (int)field[IMP_MEASURED_SIGMA]->size[d];
        out->vndf[d] = (int)field[IMP_MEASURED_VNDF]->size[2 + d];
    }
    for (int k = IMP_MEASURED_VNDF; k <= IMP_MEASURED_SPECTRA; k++) {
        if (k == IMP_MEASURED_WAVELENGTHS) continue;
        IMP_TRY(same(ctx, file, field[k], 0, out->n_phi, "that of 'phi_i'"));
        IMP_TRY(same(ctx, file, field[k], 1, out->n_theta, "that of 'theta_i'"));
    }
    for (size_t k = 0; k < imp_count(squares); k++) {
        const struct imp__tensor_field *f = field[squares[k]];
        for (int d = 1; f && d <= 2; d++)
            IMP_TRY(same(ctx, file, f, f->rank - d, out->side,
                         "luminance and colours share a square"));
    }
    IMP_TRY(same(ctx, file, field[IMP_MEASURED_RGB], 2, 3, "red, green, blue"));
    IMP_TRY(same(ctx, file, field[IMP_MEASURED_SPECTRA], 2, out->n_wave,
                 "that of 'wavelengths'"));
    IMP_TRY(same(ctx, file, field[JACOBIAN], 0, 1, "one number"));
    out->jacobian = field[JACOBIAN]->data[0] != 0;
out:
    return st;
}

enum imp_status imp__measured_parse(imp_context *ctx, struct imp_arena *keep,
                                    const char *name, const struct imp_bytes *bytes,
                                    struct imp_measured_data *out)
{
    enum imp_status st = IMP_OK;
    struct imp__tensor_file file;
    const struct imp__tensor_field *field[FIELDS];
    size_t count[IMP_MEASURED_TABLES];
    *out = (struct imp_measured_data){0};
    IMP_TRY(imp__tensor_parse(ctx, name, bytes, &file));
    IMP_TRY(fields_find(ctx, &file, field));
    IMP_TRY(sizes_read(ctx, &file, field, out));
    if (!imp__measured_counts(out, count))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: its tables are too large", name));
    for (int k = 0; k < IMP_MEASURED_TABLES; k++) {
        if (!field[k]) continue;
        float *table = imp__arena_take(keep, count[k], sizeof *table);
        if (!table)
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: no memory for its tables", name));
        for (size_t i = 0; i < count[k]; i++)
            table[i] = imp__little_float(field[k]->data + 4 * i);
        const char *wrong =
            imp__measured_mend((enum imp__measured_table)k, table, count[k]);
        if (wrong)
            IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: field '%s' %s", name,
                               fields[k].name, wrong));
        out->table[k] = table;
    }
out:
    return st;
}
