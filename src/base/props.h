/* SPDX-License-Identifier: Apache-2.0
 *
 * Property bags: a scene before its objects exist. The XML reader and the building calls
 * make a tree of imp_node; the kinds read their properties from it. Reading marks a
 * property as used; an unused property is an error that names its line and column
 * (docs/scene-format.md 1.3). */
#ifndef IMP_BASE_PROPS_H
#define IMP_BASE_PROPS_H

#include "arena.h"
#include <math.h>

struct imp_loc { /* where something was written; file NULL: built by calls */
    const char *file;
    int line, column;
};

enum imp_prop_type {
    IMP_PROP_BOOL,
    IMP_PROP_INTEGER,
    IMP_PROP_FLOAT,
    IMP_PROP_STRING,
    IMP_PROP_VECTOR,
    IMP_PROP_RGB,
    IMP_PROP_UNIFORM,  /* <spectrum value="c">: number[0] */
    IMP_PROP_SPECTRUM, /* n samples: wavelengths in list, values in list + n */
    IMP_PROP_TRANSFORM,
    IMP_PROP_REF /* string: id; resolved into a child before objects are made */
};

struct imp_prop {
    const char *name;
    enum imp_prop_type type;
    struct imp_loc loc;
    const char *of;    /* what is written, if a kind made this of it; else NULL */
    int64_t integer;   /* BOOL, INTEGER */
    double number[16]; /* FLOAT [0], VECTOR and RGB [0..2], TRANSFORM row-major */
    const char *string;
    const double *list; /* SPECTRUM: 2 n numbers */
    size_t n;
    bool used;
    bool theta; /* its numbers have become a parameter */
};

/* Mesh and pixel data attached to a node in place of a file. */
struct imp_mesh_data {
    size_t n_vertices, n_triangles;
    const float *positions, *normals, *uvs; /* normals, uvs may be NULL */
    const uint32_t *indices;
    bool normals_from_file; /* else: compute them unless face_normals */
    int n_attributes;
    struct imp_attribute_data {
        const char *name; /* vertex_..., face_... */
        size_t n;         /* vertices or triangles */
        int channels;     /* 1 or 3 */
        bool face, color;
        float *values; /* [n][channels] */
    } * attribute;
};
struct imp_image_data {
    int width, height, channels; /* 1 or 3 */
    const float *pixels;         /* linear unless `srgb` */
    bool srgb;                   /* an 8- or 16-bit file, values still encoded */
};

/* The luminous intensity of a luminaire by direction (LM-63, EULUMDAT). Degrees, ascending.
 *
 * Type C: vertical angles are from nadir, horizontal ones about it. Horizontally there is one
 * angle (rotational symmetry), or they go from 0 to 90 (symmetric about both planes), 0
 * to 180 or 90 to 270 (about one), or 0 to 360.
 * Types A and B: vertical angles go from -90 or 0 to 90, horizontal ones from -90 to 90, or
 * from 0 to 90 (symmetric about their plane 0); beyond them there is no light. */
enum imp_photometry { IMP_PHOTOMETRY_C, IMP_PHOTOMETRY_B, IMP_PHOTOMETRY_A };
struct imp_ies_data {
    int n_vertical, n_horizontal;
    const double *vertical, *horizontal;
    const double *candela; /* [n_horizontal][n_vertical] */
    enum imp_photometry type;
    double lamp_flux; /* lm, of its lamps as the file has it; 0: not given */
    double watts;     /* with its gear; 0: not given */
    double
        size[3]; /* of the luminous opening, m: along C0, along C90, height; 0: a point */
    bool
        length_c0; /* the length of lamps lies along C0 (LM-63); else along C90 (EULUMDAT) */
    /* What tilted lamps keep of their flux, by degrees from the position of measurement. n_tilts 0:
     * all of it; then tilt_file is the file that LM-63's TILT= names, which is not read yet, or NULL. */
    int n_tilts;
    const double *tilt, *tilt_factor;
    const char *tilt_file;
};

/* A measured isotropic BRDF by half-angle and difference angle (Rusinkiewicz 1998), in
 * 1/sr: [n_half][n_difference][n_azimuth][3], red, green, blue. */
struct imp_merl_data {
    int n_half, n_difference, n_azimuth;
    const float *rho;
};

/* A measured BRDF over the direction of sight (Dupuy and Jakob 2018), whose angles are
 * those of the first two tables; the others run over the unit square, [rows][columns], for
 * each of [n_phi][n_theta] directions and, of the last two, each channel. */
enum imp__measured_table {
    IMP_MEASURED_THETA,
    IMP_MEASURED_PHI,
    IMP_MEASURED_NDF,   /* of all directions together */
    IMP_MEASURED_SIGMA, /* of all directions together */
    IMP_MEASURED_VNDF,
    IMP_MEASURED_LUMINANCE,
    IMP_MEASURED_WAVELENGTHS, /* nm */
    IMP_MEASURED_RGB,
    IMP_MEASURED_SPECTRA,
    IMP_MEASURED_TABLES
};
struct imp_measured_data {
    /* n_wave 0: no spectra. side: rows and columns of the luminance, rgb and spectra. */
    int n_theta, n_phi, n_wave, side;
    int ndf[2], sigma[2], vndf[2]; /* rows, columns */
    int rgb, jacobian;             /* 0 or 1 */
    const float *table[IMP_MEASURED_TABLES];
};

/* Control points of curves in space, x, y, z and radius: [n_points][4]; curve k has those
 * from first[k] on, up to first[k + 1], [n_curves + 1]. */
struct imp_curve_data {
    size_t n_points, n_curves;
    const float *points;
    const uint32_t *first;
};

struct imp_grid_data {
    int n[3], channels; /* x, y, z */
    float box[6];       /* two corners */
    const float *value; /* [n[2]][n[1]][n[0]][channels] */
};

struct imp_node {
    const char *tag, *type, *id; /* id NULL: none */
    const char *name;            /* slot under the parent; NULL: nameless */
    struct imp_loc loc;
    struct imp_prop *props;
    size_t n_props, cap_props;
    struct imp_child {
        const char *name;      /* slot here; NULL: nameless. Differs from node->name
                                  when a reference gives one */
        struct imp_node *node; /* NULL until a reference is resolved */
        const char *ref;       /* id referred to; NULL: a direct child */
        struct imp_loc loc;
        bool used, theta;
    } * children;
    size_t n_children, cap_children;
    uint32_t given_props, given_children; /* before its object was made: kinds add some */
    const struct imp_mesh_data *mesh;     /* attached data, or NULL */
    const struct imp_image_data *image;
    const struct imp_ies_data *ies;
    const struct imp_merl_data *merl;
    const struct imp_measured_data *measured;
    const struct imp_curve_data *curves;
    const struct imp_grid_data *grid;
    const struct imp_attribute_data *attribute;
    struct imp_body *body; /* attached: a graded index (format/graded_file.c), or NULL */
    void *object;          /* what was made from it (scene/scene_build.c) */
    const char *asked[32]; /* names of properties that were looked for, literals; */
    int n_asked;           /* what a misspelt one may have meant. Full: no more */
    int visiting;          /* cycle detection */
    bool vector;           /* a texture read as IMP_INPUT_VECTOR */
    bool surveyed, gone;   /* format/survey.c: visited; left out of a lenient scene; */
    bool referred;         /* a reference names it */
    bool lenient;          /* what nobody reads is left out, not an error: */
    bool read;             /* its object was made: what is not used is used by nobody */
};

/* What a number may be; `open`: the end that does not belong to it. */
struct imp_interval {
    double lo, hi;
    enum imp_interval_open { IMP_CLOSED, IMP_OPEN_LO, IMP_OPEN_HI, IMP_OPEN } open;
};
#define IMP_NOT_NEGATIVE ((struct imp_interval){0, INFINITY, IMP_CLOSED})
#define IMP_POSITIVE     ((struct imp_interval){0, INFINITY, IMP_OPEN_LO})

/* Nodes and everything in them live in the arena; arrays grow in it too. */
struct imp_node *imp__node_create(struct imp_arena *a, const char *tag, const char *type,
                                  const char *id, const char *name, struct imp_loc loc);
/* Append; NULL if out of memory. The name must not be there yet (see imp__node_prop). */
struct imp_prop *imp__node_add(struct imp_arena *a, struct imp_node *node,
                               const char *name, enum imp_prop_type type,
                               struct imp_loc loc);
struct imp_child *imp__node_add_child(struct imp_arena *a, struct imp_node *parent,
                                      struct imp_node *child, const char *name,
                                      struct imp_loc loc);
/* Look up without marking; NULL: not there. */
struct imp_prop *imp__node_prop(const struct imp_node *node, const char *name);
struct imp_child *imp__node_child(const struct imp_node *node, const char *name);
/* As if it had not been written. */
void imp__node_remove(struct imp_node *node, const char *name);

/* "file:line:column", or "scene" for scenes built by calls; then " (type 'id')". */
const char *imp__loc_text(struct imp_loc loc, char *buffer, size_t size);
/* "file:line:column: shape 'ball' (sphere): message" */
IMP_COLD enum imp_status imp__node_error(imp_context *ctx, const struct imp_node *node,
                                         enum imp_status status, const char *format, ...)
    IMP_PRINTF(4, 5);
IMP_COLD enum imp_status imp__prop_error(imp_context *ctx, const struct imp_node *node,
                                         const struct imp_prop *prop,
                                         enum imp_status status, const char *format, ...)
    IMP_PRINTF(5, 6);

/* ---- Reading. Each marks the property used, leaves *out at the default if it is absent,
 * and returns IMP_E_SCENE with the place and both types if it is of another type.
 * Integers are taken where floats are read, never the reverse. ---- */
enum imp_status imp__props_bool(imp_context *ctx, struct imp_node *node, const char *name,
                                bool fallback, bool *out);
enum imp_status imp__props_int(imp_context *ctx, struct imp_node *node, const char *name,
                               int64_t fallback, int64_t lo, int64_t hi, int64_t *out);
enum imp_status imp__props_float(imp_context *ctx, struct imp_node *node,
                                 const char *name, double fallback, double *out);
/* The same; a number that is written is in the interval, or an error that shows it. */
enum imp_status imp__props_float_in(imp_context *ctx, struct imp_node *node,
                                    const char *name, double fallback,
                                    struct imp_interval range, double *out);
enum imp_status imp__props_string(imp_context *ctx, struct imp_node *node,
                                  const char *name, const char *fallback,
                                  const char **out);
enum imp_status imp__props_vector(imp_context *ctx, struct imp_node *node,
                                  const char *name, const double fallback[3],
                                  double out[3]);
/* Identity if absent. */
enum imp_status imp__props_transform(imp_context *ctx, struct imp_node *node,
                                     const char *name, double out[16]);
bool imp__props_has(struct imp_node *node, const char *name);
/* Mark `name` as a property of the plugin, as the imp__props_* readers do. The name must
 * live as long as the node. */
void imp__node_ask(struct imp_node *node, const char *name);
/* One of n words, in any case; *out its index. The error lists them. */
enum imp_status imp__props_choice(imp_context *ctx, struct imp_node *node,
                                  const char *name, const char *const *words, int n,
                                  int fallback, int *out);
/* IMP_E_SCENE with a list of all unused properties and children. */
enum imp_status imp__props_finish(imp_context *ctx, const struct imp_node *node);
/* The property that a misspelt one may have meant, or NULL: one that was looked for and not
 * found. */
IMP_COLD const char *imp__node_meant(const struct imp_node *node, const char *name);

#endif
