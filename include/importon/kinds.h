/* SPDX-License-Identifier: Apache-2.0
 *
 * kinds.h: what the author of a new kind needs. A kind is a const table of functions that
 * agree with each other: a material's value, sampling, density and derivative are side
 * by side in one file, and one line in the concept's table (src/kind/<concept>/)
 * registers it. Tests visit every kind through these tables: a new kind is tested by
 * existing.
 *
 * Inputs. A kind declares named inputs (colours, numbers, textures). Before any call the
 * engine looks them up at the point in question, so kinds are pure functions of `in`, an
 * array with one imp_spec per declared input, and never see textures or theta. Lanes 0..2
 * are r, g, b (lane 0 alone in mono mode; lane 3 is unspecified), or all four are
 * wavelengths; a scalar input has its value in all lanes, read it from lane 0.
 *
 * Lane rule. Lane c of every value depends on lane c of each input only. The Jacobian of
 * eval is therefore diagonal in the lanes, and one function (`eval_d`: lane-wise
 * derivatives with respect to each input) serves the reverse sweep, the forward tangent
 * and the tests. A vector, of which every component moves all lanes, is read by its
 * components (IMP_INPUT_COMPONENT): each is one number in all lanes.
 *
 * Directions. wo points to the sensor side, wi to the light side, both away from the
 * surface, in the local shading frame whose z is the shading normal (CONVENTIONS.md).
 *
 * Versions. A plug-in and the library may be compiled with different versions of this
 * header: registering compares them (IMP_KINDS_VERSION and IMP_KINDS_STRUCTS, below, with
 * the rules by which structs grow). Tables and descriptions are written with designated
 * initialisers, {.name = "rho", .hi = 1}: what is not written is zero, also what later
 * versions add.
 */
#ifndef IMPORTON_KINDS_H
#define IMPORTON_KINDS_H

#include <importon/importon.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define IMP_FORMAT(text, first) __attribute__((__format__(__printf__, text, first)))
#else
#define IMP_FORMAT(text, first)
#endif

typedef double imp_spec __attribute__((vector_size(32)));
typedef double imp_v3 __attribute__((vector_size(32)));

/* Vectors go by pointer: by value, their place depends on the processor that code is
 * compiled for. Inside a function they are numbers: *f = in[0] * (cos_i / pi). */
static inline void imp_spec_fill(imp_spec *s, double c)
{
    for (int k = 0; k < 4; k++) (*s)[k] = c;
}
static inline double imp_v3_dot(const imp_v3 *a, const imp_v3 *b)
{
    return ((*a)[0] * (*b)[0] + (*a)[1] * (*b)[1]) + (*a)[2] * (*b)[2];
}

/* How a colour property is converted (docs/scene-format.md 2.1): reflectance-like in [0,1],
 * unbounded, or emission. */
enum imp_role { IMP_REFLECTANCE, IMP_UNBOUNDED, IMP_EMISSION };

enum imp_input_flags {
    /* What a scene may write. */
    IMP_INPUT_OPTIONAL = 1, /* absent: the fallback, and no parameter */
    IMP_INPUT_REQUIRED = 2,
    IMP_INPUT_SCALAR = 4,  /* one number: textures are read as scalars */
    IMP_INPUT_NUMBER = 8,  /* a texture is refused */
    IMP_INPUT_VOLUME = 16, /* may be a volume */
    IMP_INPUT_VECTOR = 32, /* a texture, whose three channels are lanes 0..2 as they are,
                              in all modes: not a colour */
    IMP_INPUT_BUMP = 64,   /* a texture, read as one number, of which the slope counts:
                              lanes 0..2 are the normal, not unit, of the surface that is
                              raised by the texture times the property scale, in the
                              shading frame */
    IMP_INPUT_SOFT = 128,  /* a number above hi is taken as it is, and then has no bound:
                              what it is for decides */
    /* No property: the engine has its value, and its derivative. */
    IMP_INPUT_LUMINANCE =
        256, /* the luminance, in all lanes, of the input declared before
                                   it under the same name. A kind whose lanes couple (a
                                   tint divided by its luminance) reads it */
    IMP_INPUT_WAVELENGTH =
        512, /* the wavelength of each lane, in nm, of a kind whose rule
                                   depends on it; 0 where lanes are colours */
    /* What follows from it. */
    IMP_INPUT_FIXED = 1024, /* no gradient: changing it bends or moves things */
    IMP_INPUT_EDGES = 2048, /* differentiable, and may move discontinuities */
    IMP_INPUT_INDEX = 4096, /* refractive index behind the surface over the one before it:
                               where a medium fills the shape, the medium's */
    /* Inputs of media. */
    IMP_INPUT_EXTINCTION = 8192, /* the extinction depends on it, and does not fall where
                                    it rises */
    IMP_INPUT_FALLS = 16384, /* with IMP_INPUT_EXTINCTION: does not rise where it rises (a
                                 visibility). Not a texture, and not a spectrum where the
                                 extinction varies: those have no known lower bound */
    IMP_INPUT_AFFINE =
        32768, /* extinction and scattering are affine in it, and the emission
                                 does not depend on it. Derivatives with respect to it alone
                                 are made without looking it up */
    /* In spectral modes. */
    IMP_INPUT_DAYLIGHT = 65536, /* a bitmap's texels are daylight of their colours, of any
                                   size */
    IMP_INPUT_LINEAR = 131072,  /* colours become spectra by the linear basis, so that
                                   inputs add as their colours do */
    /* No property: the engine has its value, and its derivative. */
    IMP_INPUT_COMPONENT = 262144 /* a component, in all lanes, of the input with
                                    IMP_INPUT_VECTOR or IMP_INPUT_BUMP declared before it
                                    under the same name: three in a row, x, y and z. A kind
                                    whose lanes all depend on a normal reads them, and not
                                    the vector */
};

struct imp_input_desc { /* the list ends with {0} */
    const char *name;
    enum imp_role role;
    unsigned flags;
    double fallback;
    double lo, hi; /* bounds of every number; both 0: [0, inf) */
    const char *unit;
};

/* Inputs of one object, its children's included: more is an error when the kind is
 * registered or the object built, so that whoever visits an object has room for them on the
 * stack, and a bit for each in a uint64_t. */
#define IMP_INPUTS_MAX 64

/* What the lanes of a walk are where they are not the scene's colours: up to four
 * wavelengths. Unused lanes repeat the first. */
struct imp_carried {
    int n;
    double nm[4];
};

/* Opaque; imp_course_value and imp_spectrum_value evaluate them. */
struct imp_course; /* a factor over time: linear between given times, constant outside */
struct imp_spectrum; /* a value at every wavelength */
/* Opaque, and the engine's alone. */
struct imp_body;        /* a region of graded index, in which light goes on bent lines */
struct imp_camera_gain; /* exposure, white balance, vignetting, and their derivatives */
struct imp_majorants;   /* a grid of bounds of an extinction */
struct imp_map;         /* an affine map */
struct imp_texture;
/* One input of one object: a constant or a texture. */
struct imp_input {
    const struct imp_texture *texture; /* NULL: constant */
    int param;                         /* index of its parameter, -1: none */
    int count;                         /* numbers of a constant: 3, or 1 (in all lanes) */
    bool scalar;    /* declared IMP_INPUT_SCALAR: textures give one number */
    bool plain;     /* a constant: `value` as it is, unless lanes are wavelengths */
    bool vector;    /* declared IMP_INPUT_VECTOR */
    bool bump;      /* declared IMP_INPUT_BUMP */
    int luminance;  /* > 0: the luminance of the input that many before it */
    imp_spec value; /* the constant, in all used lanes */
    imp_spec
        weight; /* of a luminance: of that input's lanes. Of a component: 1 in the lanes
                        that colours use */
    const struct imp_spectrum *spectrum; /* what walks that carry wavelengths look up;
                                            NULL: the constant, at all of them */
    int component; /* > 0: component - 1 of the vector that many before it */
};

struct imp_build; /* what build functions get; read by imp_build_*, below */

/* Receives pieces of gradient. `param` is a parameter's index, `element` the number
 * inside it; with channels == 3 lane c belongs to element + c, with channels == 1 all
 * lanes belong to the one number. */
struct imp_sink {
    void (*add)(struct imp_sink *sink, int param, size_t element, int channels,
                const imp_spec *bar);
    bool apart; /* lanes of numbers with one channel are kept, not added up */
};

/* ---- BSDF ---------------------------------------------------------------------- */

#define IMP_SMOOTH (-1) /* imp_dirs.lobe: all lobes that have a density */

struct imp_dirs {
    imp_v3 wo, wi;
    int lobe; /* IMP_SMOOTH, or the index of a delta lobe (with wi as sample set it) */
    /* For sample and pdf: derivatives with respect to these inputs of the material will be
     * taken at what is drawn, bit j for input j, children's included (imp_wanted_of_child); 0:
     * with respect to none. A kind may draw without the parts whose value is 0, but then
     * not; it may draw more where such a derivative is large. */
    uint64_t derivative;
};

/* The derivatives wanted of a child whose inputs begin at `first`. */
static inline uint64_t imp_wanted_of_child(uint64_t derivative, int first)
{
    return first < 64 ? derivative >> first : 0;
}

enum imp_bsdf_flags {
    IMP_BSDF_SMOOTH = 1, /* has lobes with a density */
    IMP_BSDF_DELTA = 2,  /* has delta lobes */
    IMP_BSDF_TRANSMIT = 4,
    IMP_BSDF_EMIT = 8,     /* has emit: Stam's ambient terms */
    IMP_BSDF_JUMP = 16,    /* f/pdf of sample jumps at the horizon: sample_d, which has no
                           boundary term, is not the whole derivative */
    IMP_BSDF_NULL = 32,    /* light passes as if nothing were there */
    IMP_BSDF_LINEAR = 64,  /* eval is of first degree in its own inputs of role
                            IMP_REFLECTANCE together, and emit is free of them: an
                            identity of integrator stam that `check` tests */
    IMP_BSDF_TURNED = 128, /* its kernel has no transpose that `sample` could draw (it has
                              normals of its own, or light leaves a fibre elsewhere than it
                              entered): light tracing refuses it */
    IMP_BSDF_STEPS = 256   /* eval jumps where wo moves, also away from the horizon:
                              eval_directions_d is not the whole derivative */
};

struct imp_bsdf {
    const struct imp_bsdf_ops *ops;
    void *self;                     /* ops->object_size bytes, filled by build */
    unsigned flags;                 /* enum imp_bsdf_flags; build sets it */
    int n_own, n_in;                /* inputs of its own, and with its children's */
    const struct imp_input **input; /* [n_in] */
    int n_child;
    const struct imp_bsdf *child[2];
    int child_in[2]; /* where the child's inputs start in `in` */
    int index_input; /* its own input with IMP_INPUT_INDEX; -1: none */
    int index;       /* in the scene; -1 for the default material */
    double absorb;   /* Stam's absorption probability; 0: none given */
    const char *name;
    int n_lobes; /* delta lobes have the indices below it; build sets it. 0 of a kind with
                    IMP_BSDF_DELTA: not said, at most 8 */
    bool shaped; /* a scalar input is a spectrum: lanes differ in more than colour */
    /* Bit l: delta lobe l goes straight on, wi = -wo, as through a hole; build sets it.
     * volpath does not count it as a bounce, and light samples pass it. Its coefficient
     * depends on the angle to the normal alone. */
    uint64_t straight;
    /* Bit j: own input j has no derivative in this object, though its kind has one; build
     * sets it, and the reason, a sentence without a full stop. */
    uint64_t fixed;
    const char *why;
};

struct imp_bsdf_ops {
    size_t size; /* of this struct when compiled */
    const char *name;
    size_t object_size;
    const struct imp_input_desc *inputs;
    int min_children, max_children;

    /* Read further properties, set self and bsdf->flags. NULL: flags = IMP_BSDF_SMOOTH.
     */
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_bsdf *bsdf);

    /* Draw d->wi and d->lobe for d->wo; pdf and eval say the rest. u[0] chooses the
     * lobe, u[1], u[2] the direction. False: no sample (structurally zero: nothing may
     * arrive from there, whatever the inputs). The density must not vanish where the
     * value does not or, with d->derivative, a derivative does not. */
    bool (*sample)(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d);
    /* The BSDF times |cos(theta_i)|, in 1/sr, for d->lobe == IMP_SMOOTH; for a delta lobe
     * its coefficient. Radiance passing a refraction carries (n_wo/n_wi)^2. */
    void (*eval)(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f);
    /* Density of sample, per steradian, all smooth lobes together; for a delta lobe the
     * probability of choosing it. 0 exactly where the value is structurally zero. */
    double (*pdf)(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d);
    /* Refractive index on the side of wi over that on the side of wo. NULL: 1. */
    double (*index_ratio)(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d);
    /* df[j] = lane-wise derivative of eval with respect to input j, for all n_in; sets
     * all. */
    void (*eval_d)(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df);

    /* Radiance emitted along wo, and its lane-wise derivatives; both or neither. */
    void (*emit)(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e);
    void (*emit_d)(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de);

    /* Attached derivative of sampling with respect to scalar input `j`, for the direction
     * that `sample` made from u: dweight is d(f/pdf)/d in[j], dwi the motion of wi (both
     * at fixed u). Returns false where not offered; NULL: nowhere (docs/estimators.md 4). */
    bool (*sample_d)(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                     const struct imp_dirs *d, int j, imp_spec *dweight, imp_v3 *dwi);

    /* Rewrite the node before its inputs are read: named presets become numbers. May be
     * NULL. */
    enum imp_status (*prepare)(const struct imp_build *build);

    /* What the aov `albedo` shows: the reflectance of a diffuse surface or base colour,
     * from either side. NULL: pi f for light along the normal. */
    void (*albedo)(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *albedo);

    /* A child without an id is named <child_name>_<k> below this object. NULL:
     * nested_bsdf where there is at most one, else bsdf_<k>. */
    const char *child_name;
    /* Numbers of its inputs, or of their textures, are others now: make what build
     * derived from them anew. Called once after all numbers are set, while nobody renders.
     * It cannot fail: what it needs, build has allocated. May be NULL. */
    void (*changed)(const struct imp_bsdf *b);

    /* Directional albedo, the part of what arrives along wo that is not absorbed: the
     * integral of eval over wi, delta lobes with their coefficients, without the squared
     * index ratio of radiance. Survival of the walks of integrator photons goes by it; a
     * bad one costs variance, never bias. False, or NULL: not known, and the weight of the
     * direction drawn takes its place. */
    bool (*directional_albedo)(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *albedo);

    /* pdf and eval of one direction, where they have work in common: the same numbers,
     * to the bit; *f is anything where the density is 0. NULL: they are called in turn. */
    double (*pdf_eval)(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f);

    /* Derivatives of eval for d->lobe == IMP_SMOOTH with respect to the directions, lane by
     * lane: where they turn by dwo and dwi (at right angles to them, to first order), the
     * value changes by sum over k of d_wo[k] dwo[k] + d_wi[k] dwi[k]. The part of d_wo along
     * wo, and that of d_wi along wi, is anything finite. A kind with children calls theirs: it
     * is called only where all that is nested has it. NULL: not offered, and nothing that turns
     * the directions has a derivative. */
    void (*eval_directions_d)(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3]);
};

/* ---- Texture ------------------------------------------------------------------- */

struct imp_shape;
struct imp_surface;
struct imp_texcoord {
    double uv[2];
    imp_v3 p;                          /* world position */
    const struct imp_carried *carried; /* what is looked up; NULL: the scene's colours */
    const struct imp_shape *shape;     /* that is looked up; NULL: none, or not known */
    /* The primitive of the shape that is looked up, -1: not known. Where it is looked up by
     * triangle the surface there, too, of a shape in a group as it is in the group. */
    int prim;
    const struct imp_surface *surface;
};

struct imp_placed;
struct imp_texture {
    const struct imp_texture_ops *ops;
    void *self;
    int n_in;
    const struct imp_input **input;
    int param; /* of its bulk data; -1: none */
    const char *name;
    const struct imp_input_desc *asked; /* the first input that it serves; NULL: none yet.
                                           `changed` is called when it is known */
    const struct imp_placed
        *placed; /* the engine's: numbers by which a volume is moved */
};

enum imp_texture_flags {
    IMP_TEXTURE_SPECTRUM = 1, /* written as <spectrum> too, around the texture that is its
                                 input nested_texture */
    IMP_TEXTURE_CONSTANT = 2  /* the same everywhere */
};

/* Number `element` of a parameter in a direction of theta. */
typedef double imp_dot_fn(const void *x_dot, int param, size_t element);

struct imp_texture_ops {
    size_t size;
    const char *name;
    size_t object_size;
    unsigned flags;
    const struct imp_input_desc *inputs;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_texture *t);
    /* The value at uv; `scalar`: one number in all lanes. */
    void (*eval)(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value);
    /* Transpose of the derivative of eval with respect to its data and inputs. */
    void (*scatter)(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink);
    /* The derivative applied: direction x_dot is read through `dot` (element of param).
     */
    void (*tangent)(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot);
    /* d value/du, d value/dv, for what moves over the texture. False, or NULL: the value
     * jumps somewhere, and this derivative is not the whole of it. */
    bool (*slope)(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                  imp_spec d_uv[2]);
    /* As imp_bsdf_ops.changed; of its own texels too. */
    void (*changed)(const struct imp_texture *t);

    /* For volumes. A volume is a texture that looks at `at->p` alone. */
    /* Lane by lane, no less than any value in the box from lo to hi of the world. NULL:
     * not known, and no extinction can be made of it. */
    void (*bound)(const struct imp_texture *t, const imp_v3 *lo, const imp_v3 *hi,
                  bool scalar, imp_spec *most);
    /* The box that it fills: an affine map of the world, three rows of four, under which
     * it is the unit cube; and in how many cells along each axis its bounds are worth
     * knowing. NULL: it has no end. */
    void (*extent)(const struct imp_texture *t, double to_unit[12], int cells[3]);

    /* As scatter and tangent, of slope: bar[0] and bar[1] belong to d value/du and
     * d value/dv. Both or neither; NULL: slopes have no derivative. */
    void (*slope_scatter)(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, const imp_spec bar[2], struct imp_sink *sink);
    void (*slope_tangent)(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, imp_dot_fn *dot, const void *x_dot,
                          imp_spec d_uv_dot[2]);

    /* For volumes that may be moved: with gradient and extent. The affine map that puts it where it is,
     * three rows of four: read or, one that has an inverse, set. */
    void (*place)(const struct imp_texture *t, double to_world[12], bool set);
    /* The derivative of eval with respect to the place in the world. False: values jump. */
    bool (*gradient)(const struct imp_texture *t, const struct imp_texcoord *at,
                     bool scalar, imp_spec d_p[3]);
};

/* ---- Phase function ------------------------------------------------------------ */

/* How a point in a medium scatters light: a density over directions, the same whichever
 * of the two is the light's. Directions are of the world, in imp_dirs as those of a BSDF,
 * with lobe IMP_SMOOTH. */
struct imp_phase {
    const struct imp_phase_ops *ops;
    void *self;
    int n_own, n_in; /* inputs of its own, and with its children's */
    const struct imp_input **input;
    int n_child;
    const struct imp_phase *child[2];
    int child_in[2]; /* where the child's inputs start in `in` */
    const char *name;
};

struct imp_phase_ops {
    size_t size;
    const char *name;
    size_t object_size;
    const struct imp_input_desc *inputs;
    int min_children, max_children;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_phase *p);
    /* Draw d->wi for d->wo; u[0] chooses a child, u[1], u[2] the direction. */
    void (*sample)(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d);
    /* In 1/sr; its integral over d->wi is 1 in every lane. */
    void (*eval)(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f);
    /* Density of sample, per steradian; not 0 where the value or a derivative is not. */
    double (*pdf)(const struct imp_phase *p, const imp_spec *in,
                  const struct imp_dirs *d);
    /* df[j] = lane-wise derivative of eval with respect to input j, for all n_in; sets
     * all. */
    void (*eval_d)(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df);
    /* As imp_bsdf_ops.changed. */
    void (*changed)(const struct imp_phase *p);
    /* As imp_bsdf_ops.prepare. */
    enum imp_status (*prepare)(const struct imp_build *build);
};

/* Cosine of the angle between the directions of travel before and after: 1 is straight
 * on. The directions may be rounded. */
static inline double imp_phase_cos(const struct imp_dirs *d)
{
    return -imp_v3_dot(&d->wo, &d->wi) /
           __builtin_sqrt(imp_v3_dot(&d->wo, &d->wo) * imp_v3_dot(&d->wi, &d->wi));
}

/* ---- Medium -------------------------------------------------------------------- */

/* What a medium is at a point, per unit of length. */
struct imp_coefficients {
    imp_spec extinction; /* chance to be scattered or absorbed */
    imp_spec scattering; /* chance to be scattered, at most extinction */
    imp_spec emission;   /* radiance of a body of it that nothing passes: a length emits
                            (extinction - scattering) times it */
};

struct imp_medium {
    const struct imp_medium_ops *ops;
    void *self;
    int n_own, n_in; /* inputs of its own, and with its phase function's behind them */
    const struct imp_input **input;
    const struct imp_phase *phase;
    int index; /* in the scene */
    const char *name;
    bool emits; /* build sets it: the emission may differ from 0 */

    /* The scene's. */
    struct imp_majorants *majorants;  /* NULL: extinction is the same everywhere */
    const struct imp_bsdf *scatterer; /* of a point in it: albedo times phase function */
    const struct imp_bsdf *pure;      /* the same with albedo 1, without emission */
};

struct imp_medium_ops {
    size_t size;
    const char *name;
    size_t object_size;
    const struct imp_input_desc *inputs;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_medium *m);
    void (*eval)(const struct imp_medium *m, const imp_spec *in,
                 struct imp_coefficients *c);
    /* dc[j] = lane-wise derivative of eval with respect to input j, for all n_own; sets
     * all. That of the extinction is 0 for inputs without IMP_INPUT_EXTINCTION. */
    void (*eval_d)(const struct imp_medium *m, const imp_spec *in,
                   struct imp_coefficients *dc);
    /* As imp_bsdf_ops.changed. */
    void (*changed)(const struct imp_medium *m);
    bool boxed; /* it ends where the volume of its extinction ends */
};

/* A texture with inputs looks them up itself, at any point it likes: its eval, scatter and
 * tangent call these with t->input[k] and what they were given. The input may be a
 * constant, a spectrum or another texture. Threads may share all but the sink. */

/** The value of an input at a point.
 * @param scalar  read it as one number, in all lanes of *value.
 * @param[out] value  in the lanes of the walk (at->carried). */
IMP_API void imp_input_eval(const struct imp_input *input, const struct imp_texcoord *at,
                            bool scalar, imp_spec *value);
/** Transpose of its derivative: what `bar` = d objective / d value gives to the numbers of
 * its parameters, added to the sink. Nothing where the input has none. */
IMP_API void imp_input_scatter(const struct imp_input *input,
                               const struct imp_texcoord *at, bool scalar,
                               const imp_spec *bar, struct imp_sink *sink);
/** The derivative of its value in direction x_dot, which is read through `dot`.
 * @param x_dot  handed to `dot`; whatever that takes. */
IMP_API void imp_input_tangent(const struct imp_input *input,
                               const struct imp_texcoord *at, bool scalar,
                               imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot);

/* ---- Shape --------------------------------------------------------------------- */

struct imp_hit {
    int shape, prim;
    double t;
    double u, v; /* of triangles: barycentric weights of the second and third vertex;
                    of analytic shapes: what its `intersect` wrote */
    /* The scene's: the instance in which the shape was met, 0 for none, and when. */
    int64_t place;
    double time;
};

/* A point of a shape that is made of triangles: the triangle, and the barycentric weights of
 * its second and third vertex. Points of other shapes are identified by uv. */
struct imp_located {
    int32_t prim; /* -1: not known */
    float at[2];
};

struct imp_surface {
    imp_v3 p, ng;   /* position and geometric normal (unit), world */
    imp_v3 s, t, n; /* shading frame, world */
    imp_v3 dp_du, dp_dv;
    double uv[2];
    struct imp_located located; /* of a point that sample_area drew */
};

/* A point on a light as seen from `ref`. */
struct imp_light_sample {
    imp_v3 wi;   /* unit, from ref towards the light */
    double dist; /* INFINITY for the environment */
    double pdf;  /* per steradian at ref; 1 for delta lights */
    double uv[2];
    double cos_light; /* signed cosine at the light's shading normal; 1 if it has none */
    imp_v3 p;         /* the point, world (not set for the environment) */
    imp_v3 ng;        /* its geometric normal */
    struct imp_located located; /* the same point, of area lights. The engine sets prim to
                                   -1 before it calls */
};

/* Where a light walk begins, and whither. Its throughput is
 *
 *     Le cos_p / (pdf_p pdf_d),    Le: eval of the emitter, at distance 1 from a point
 */
struct imp_emission_sample {
    imp_v3 p;         /* on the light, or before the scene on its way in */
    imp_v3 ng;        /* geometric normal there; 0 where there is no surface */
    imp_v3 d;         /* unit, away from the light, world */
    double uv[2];     /* of the surface */
    double cos_light; /* as of struct imp_emission */
    double cos_p; /* |cosine| that turns area at p into area across d; 1 where pdf_p is
                         per area across d, or p is a point */
    double pdf_p; /* per area; 1: a point */
    double pdf_d; /* per steradian; 1: one direction alone */
    struct imp_located located; /* as of struct imp_light_sample */
};
/* All of a scene lies in it. */
struct imp_ball {
    imp_v3 centre;
    double radius;
};

/* A point of a sensor as seen from `ref`. */
struct imp_sensor_sample {
    imp_v3 wo;     /* unit, from ref towards the sensor */
    imp_v3 p;      /* where the sensor's ray starts: nothing behind it counts */
    double dist;   /* from ref to p */
    double px, py; /* film position */
    double weight; /* film area, in pixels, per steradian at ref and lens point drawn */
    imp_v3 ng;     /* of a sensor that is a surface: its geometric normal */
    double cos_sensor;          /* and the cosine there; of others 1 */
    struct imp_located located; /* of a sensor that is a surface: the same point */
};

enum imp_geometry { IMP_TRIANGLES, IMP_ANALYTIC, IMP_CURVES };

struct imp_triangles { /* world space */
    size_t n_vertices, n_triangles;
    const float *positions;  /* [3 n_vertices], room for 16 bytes after the end */
    const uint32_t *indices; /* [3 n_triangles] */
    double volume;           /* enclosed: negative where the normals point inwards; of
                                open meshes that of the cones to the centre of its box */
};

/* Tubes about lines, in world space, which rays meet from outside alone. Degree 1: cones
 * from point to point, with a ball at each point; 3: uniform cubic B-splines, open. */
struct imp_curves {
    size_t n_points, n_segments;
    const float *points;   /* [4 n_points] position and radius */
    const uint32_t *first; /* [n_segments] first of the points of a segment */
    const uint8_t *joined; /* [n_segments] degree 1: bit 0 one before, bit 1 one behind */
    int degree;
};

/* A texture of a shape under a name. */
struct imp_attribute {
    const char *name;
    const struct imp_texture *texture;
};

struct imp_shape {
    const struct imp_shape_ops *ops;
    void *self;
    int index;
    int bsdf;    /* index; -1: the scene's default, -2: black (emitters' default) */
    int emitter; /* index or -1 */
    bool flip_normals;
    double area; /* world units; build sets it. 0: a mesh from which nothing is sent */
    enum imp_geometry geometry;
    struct imp_triangles triangles; /* if geometry is IMP_TRIANGLES */
    struct imp_curves curves;       /* if it is IMP_CURVES */
    imp_v3 lo, hi;                  /* bounds; build sets them */
    const char *name;
    bool smooth; /* shading normals turn over flat facets; build sets it */
    const struct imp_body *body; /* of graded index, behind ng; NULL: none */
    /* Behind ng and before it; both NULL at a surface that bounds no medium. */
    const struct imp_medium *interior, *exterior;
    int priority; /* where closed shapes overlap, that of the highest priority fills the
                     place, the later one of equals; 0: it has none */
    const struct imp_sensor *sensor; /* that it is the surface of; NULL: none */
    /* Textures by name that mesh_attribute looks up on this shape. */
    int n_attributes;
    const struct imp_attribute *attribute;
    /* Its textures need more than uv: what `surface` and the draws of points write to uv
     * is then a code of the triangle and the point in it, and `place` gives uv back. */
    bool by_triangle;
    /* [2] of a shape that is there for instances alone which stretch or mirror its group, and
     * has a bump map: from the group to the world, and back. Else NULL. */
    const struct imp_map *placed;
};

/* A surface of constant curvature. */
struct imp_round {
    imp_v3 centre, axis; /* of a sphere the axis is 0 */
    double radius;
};

enum imp_shape_flags {
    IMP_SHAPE_CONVEX = 1,  /* whatever its to_world: no line meets it more than twice, and
                             nothing of it is seen from its outside but by the front */
    IMP_SHAPE_SQUARE = 2,  /* uv covers [0,1]^2 once, and its border is where u or v is
                             0 or 1 */
    IMP_SHAPE_NEAREST = 4, /* of the points on a line, sample_toward draws the nearest
                             only; else all of them */
    IMP_SHAPE_TRIANGLES = 8, /* it can be looked up by triangle */
    IMP_SHAPE_FLAT = 16      /* one normal everywhere */
};

struct imp_shape_ops {
    size_t size;
    const char *name;
    size_t object_size;
    unsigned flags;
    /* Reads its properties, to_world and flip_normals among them, and sets self, geometry,
     * area, lo, hi and s->flip_normals. The engine turns no normal: those of `surface` and
     * of the draws are as the properties say. */
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_shape *s);
    /* Nearest hit with tmin < t < tmax, in double; IMP_ANALYTIC only. Sets t, u, v, prim.
     */
    bool (*intersect)(const struct imp_shape *s, const imp_v3 *o, const imp_v3 *d,
                      double tmin, double tmax, struct imp_hit *hit);
    /* The surface at a hit of the ray (o, d), recomputed in double. */
    void (*surface)(const struct imp_shape *s, const struct imp_hit *hit, const imp_v3 *o,
                    const imp_v3 *d, struct imp_surface *out);
    /* Draw a point towards ref; false: none (ref inside, or degenerate). */
    bool (*sample_toward)(const struct imp_shape *s, const imp_v3 *ref, const double u[2],
                          struct imp_light_sample *out);
    /* Its density for the point found at `at` (hit from ref), per steradian. */
    double (*pdf_toward)(const struct imp_shape *s, const imp_v3 *ref,
                         const struct imp_hit *hit, const struct imp_surface *at);
    /* The sphere or cylinder that it is part of, or the radius 0: of neither. NULL: flat
     * where it is hit. */
    void (*round)(const struct imp_shape *s, struct imp_round *out);
    /* Draw a point uniformly by area, density 1/area; of IMP_SHAPE_SQUARE its uv is u. Of
     * triangles sets located, too. NULL: light walks cannot begin on it. */
    void (*sample_area)(const struct imp_shape *s, const double u[2],
                        struct imp_surface *out);
    /* The surface at a place that was met before, from what it had in uv, as floats. Sets
     * *prim where it is looked up by triangle. NULL: bump maps are refused. */
    void (*place)(const struct imp_shape *s, const double uv[2], struct imp_surface *out,
                  int *prim);
    /* As sample_toward, of one triangle: uniformly by area, density 1/its area. NULL: the
     * triangles of a light are not chosen one by one. */
    bool (*sample_triangle)(const struct imp_shape *s, int prim, const imp_v3 *ref,
                            const double u[2], struct imp_light_sample *out);
    /* Turns and shifts the shape as it is now by an affine map of the world that is rigid:
     * three rows of four. Positions of triangles are written where `triangles` has them. NULL:
     * its pose is no parameter. */
    void (*move)(struct imp_shape *s, const double to_world[12]);
    /* The map, three rows of four, that has put the kind's unit shape where it is, with what else
     * says so (a sphere's center and radius), as to_world of mi.traverse: reads it, or, with `set`,
     * puts it there, by a map whose determinant has the sign of the former one. False: such a map
     * makes another kind of shape, which may be left in any place. NULL: there is none. */
    bool (*placed)(struct imp_shape *s, double to_world[12], bool set);
};

/* ---- Emitter ------------------------------------------------------------------- */

enum imp_emitter_flags {
    IMP_EMITTER_DELTA = 1,
    IMP_EMITTER_AREA = 2,
    IMP_EMITTER_ENVIRONMENT = 4,
    IMP_EMITTER_UNIFORM = 8,  /* eval is its first input, whatever the direction (of a
                                surface: on its front) */
    IMP_EMITTER_GAPS = 16,    /* the density of sample is 0 where eval is, also where a
                                derivative is not */
    IMP_EMITTER_FAR = 32,     /* a delta light of parallel light: without end, or with
                                 IMP_EMITTER_AREA from a flat surface */
    IMP_EMITTER_BY_SHAPE = 64 /* its points are drawn as the shape draws them: sample and
                                 pdf are the shape's, evenly by area on triangles */
};

struct imp_emission { /* where and whither light leaves */
    double uv[2];
    double dist;      /* to the receiver; INFINITY for the environment */
    double cos_light; /* signed, at the light's shading normal */
    imp_v3 d;         /* unit, from the light to the receiver, world */
};

struct imp_emitter {
    const struct imp_emitter_ops *ops;
    void *self;
    int n_in;
    const struct imp_input **input;
    const struct imp_shape *shape; /* of area lights */
    int index;
    double weight; /* sampling_weight */
    const char *name;
    bool shaped;    /* as of imp_bsdf */
    uint64_t fixed; /* bit j: input j has no derivative in this object; build sets it */
    const struct imp_course *course; /* the scene's: factor over time; NULL: 1 */
};

/* A light that is its first input times a function of the direction alone: what solvers
 * other than walks need. Directions are unit vectors of the world, away from the light. */
struct imp_emitter_profile {
    double (*value)(const struct imp_emitter *e, const imp_v3 *w);
    /* No less than value within `angle` (radians) of w, or than what value times the
     * cosine at the light comes to where value has a pole. */
    double (*bound)(const struct imp_emitter *e, const imp_v3 *w, double angle);
    /* Mean of value over the hemisphere about n. */
    double (*mean)(const struct imp_emitter *e, const imp_v3 *n);
};

/* A circle of directions, world: unit w with w.axis = cosine. */
struct imp_sky_circle {
    imp_v3 axis; /* unit */
    double cosine;
};
#define IMP_SKY_CIRCLES 4 /* at most */

struct imp_emitter_ops {
    size_t size;
    const char *name;
    size_t object_size;
    unsigned flags;
    const struct imp_input_desc *inputs;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_emitter *e);
    /* Radiance arriving at the receiver (delta lights: irradiance perpendicular to d). */
    void (*eval)(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le);
    void (*eval_d)(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle);
    bool (*sample)(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out);
    /* Density of sample for light that arrives from the hit (area), or from direction wi
     * (environment; hit and at are NULL). */
    double (*pdf)(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at);

    /* For a light that is its first input times max(0, w . axis)^n: sets the axis, of a
     * surface with this normal, and returns which input n is. NULL: another light. */
    int (*lobe)(const struct imp_emitter *e, const imp_v3 *normal, imp_v3 *axis);
    const struct imp_emitter_profile *profile; /* NULL: another light */
    /* As imp_bsdf_ops.changed. */
    void (*changed)(const struct imp_emitter *e);
    /* Where the inputs are looked up for light that leaves along x->d. NULL: at x->uv. It
     * may read constants of its own, e->input[j]->value, that move it; for these */
    void (*place)(const struct imp_emitter *e, const struct imp_emission *x,
                  double uv[2]);
    /* sets d uv/d(input j), by which the engine adds the slopes of textures to eval_d. Both
     * or neither where a constant moves the lookup. */
    void (*place_d)(const struct imp_emitter *e, const struct imp_emission *x, int j,
                    double duv[2]);
    /* As imp_bsdf_ops.prepare. */
    enum imp_status (*prepare)(const struct imp_build *build);

    /* Where a light walk begins: u[0], u[1] choose the point, u[2], u[3] the direction.
     * The density must not vanish where eval does not. False: none. NULL: no walk can
     * begin at this light. */
    bool (*sample_emission)(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out);
    /* pdf_d of direction x->d, from the point that x describes. With sample_emission. */
    double (*pdf_emission)(const struct imp_emitter *e, const struct imp_emission *x);
    /* For a delta light: light leaves within a cone about `axis` alone, of this cosine, as
     * its inputs are now. NULL: all around. */
    void (*cone)(const struct imp_emitter *e, imp_v3 *axis, double *cosine);
    /* Where a light at a point is, or the unit direction in which parallel light travels, or that of
     * an environment from its middle, world:
     * reads it, or, with `set`, puts the light there (a direction of any length), turned as it was.
     * NULL: another light. */
    void (*aim)(struct imp_emitter *e, double v[3], bool set);
    /* The circles of directions towards an environment across which its radiance
     * jumps; returns how many. Elsewhere it is continuous, with a derivative by the direction almost
     * everywhere. NULL: it may jump anywhere, and derivatives by what moves are refused. */
    int (*jumps)(const struct imp_emitter *e, struct imp_sky_circle out[IMP_SKY_CIRCLES]);
    /* Turns an environment as it is now by an affine map of the world that is a rotation: three rows
     * of four. NULL: its turn is no parameter. */
    void (*move)(struct imp_emitter *e, const double to_world[12]);
};

/* ---- Sensor and filter --------------------------------------------------------- */

struct imp_sensor_ray {
    imp_v3 o, d;          /* d unit */
    double t_near, t_far; /* along d */
};

struct imp_filter {
    const struct imp_filter_ops *ops;
    void *self;
    double radius;
};
struct imp_filter_ops {
    size_t size;
    const char *name;
    size_t object_size;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_filter *f);
    double (*eval)(const struct imp_filter *f,
                   double x); /* one dimension, |x| < radius */
};

enum imp_pixel_format { /* channels of the written picture */
                        IMP_PIXEL_LUMINANCE,
                        IMP_PIXEL_LUMINANCE_ALPHA,
                        IMP_PIXEL_RGB,
                        IMP_PIXEL_RGBA,
                        IMP_PIXEL_XYZ,
                        IMP_PIXEL_XYZA
};
struct imp_film_desc {
    int width, height;                  /* the full film */
    int crop_x, crop_y, crop_w, crop_h; /* the picture */
    bool sample_border, half;
    enum imp_pixel_format pixel_format;
    const char *file_format; /* "openexr", "rgbe", "pfm" */
    struct imp_filter filter;
    /* In a specfilm: its channels are these curves, per nm, and not the pixel_format. */
    int n_responses;
    const struct imp_spectrum *response; /* [n_responses] */
    const char *const *response_name;
    const struct imp_spectrum
        *srf; /* a factor of the channels of another film; NULL: 1 */
};
#define IMP_RESPONSES_MAX 64

struct imp_sensor {
    const struct imp_sensor_ops *ops;
    void *self;
    struct imp_film_desc film;
    int spp;
    const char *name;
    const struct imp_medium *medium; /* that it is in; NULL: none */
    const struct imp_shape *shape;   /* of a sensor that is a surface; else NULL */
    double
        scale; /* reading over the mean of its rays' radiance: pi of irradiance, else 1 */
    const struct imp_ball *scene; /* set when the scene is whole */
    bool photometric;             /* readings are luminances, in lux or cd/m^2 */
    const struct imp_camera_gain
        *gain; /* exposure and its like, between radiance and picture; NULL: 1 */
    enum imp_points points; /* its sampler's; IMP_POINTS_SCENE: it names none */
    /* The scene's: its rays have times from `open` to `close`, evenly or as `course`. */
    double open, close;
    const struct imp_course *course;
    /* With IMP_SENSOR_GROUP: sensors whose pictures are side by side in its film. */
    int n_child;
    const struct imp_sensor *const *child;
    /* Of a sensor that is a surface: where on it and by which weight of directions it
     * measures; NULL: the mean irradiance on its front. */
    const struct imp_receiver *receiver;
};
enum imp_sensor_flags {
    IMP_SENSOR_AREA = 1,     /* its rays start on the shape that it belongs to */
    IMP_SENSOR_PARALLEL = 2, /* its rays are parallel: `connect` has no point without
                                end */
    IMP_SENSOR_GROUP = 4,    /* its children are sensors */
    IMP_SENSOR_PINHOLE = 8   /* `connect` reads none of its numbers */
};
#define IMP_VIEW_NUMBERS 10
struct imp_sensor_ops {
    size_t size;
    const char *name;
    size_t object_size;
    enum imp_status (*build)(const struct imp_build *build, void *self,
                             struct imp_sensor *s);
    /* Ray through film position (px, py), pixels from the top-left corner of the full
     * film; lens: two uniform numbers. */
    void (*ray)(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out);
    unsigned flags;
    /* The connection of a light walk, the adjoint of `ray`: a point of the sensor, drawn by
     * u[0], u[1], as seen from ref; u[2], u[3] choose a film position where nothing else
     * does. With `far`, ref is the direction, from the sensor, of a point without end, and
     * the weight is per steradian at the sensor. False: not seen. NULL: no light walk can
     * be connected to it. */
    bool (*connect)(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out);
    /* As imp_shape_ops.move. */
    void (*move)(struct imp_sensor *s, const double to_world[12]);
    /* Horizontal field of view in degrees, the principal point's offset in parts of the film's
     * width and height, k1, k2, p1, p2, k3 of a lens as OpenCV has them, and, of a thin lens, the
     * radius of its aperture and its focus distance: reads them (what it has not stays as it was),
     * or, with `set`, changes the camera to these. False: it has none; with `set`: a lens with these
     * numbers folds the picture. NULL: the kind has none. */
    bool (*view)(struct imp_sensor *s, double number[IMP_VIEW_NUMBERS], bool set);
    /* How fast what is seen at a fixed film position moves when number k of `view` grows, at the
     * point r from where its rays meet, world, along the plane of its depth; per unit of the
     * number. NULL where `view` is, or `lens_velocity` is not. */
    void (*view_velocity)(const struct imp_sensor *s, int k, const imp_v3 *r,
                          imp_v3 *out);
    /* The same of a lens with an aperture, for a ray whose numbers `lens` stay: r and `other` are
     * two points of it, from the middle of the lens. */
    void (*lens_velocity)(const struct imp_sensor *s, int k, const imp_v3 *r,
                          const imp_v3 *other, imp_v3 *out);
    /* As imp_shape_ops.placed. */
    bool (*placed)(struct imp_sensor *s, double to_world[12], bool set);
};

/* ---- Versions of this header ----------------------------------------------------- */

/* The version is raised where a plug-in of the former header could not run any more:
 *   - a struct of the second list changes its size,
 *   - a field moves, goes, or changes its type or meaning,
 *   - a flag or another constant changes its number,
 *   - a function gets other parameters or another duty, or becomes required.
 * It is not raised where
 *   - a struct of the first list grows at its end, beyond its former size (a field in the
 *     padding there would be seen by no check),
 *   - a table of functions (imp_..._ops) grows at its end: `size` says what a plug-in has,
 *     and what is absent is NULL,
 *   - a struct, a flag or an imp_build function is new.
 * Registration takes a plug-in of the same version whose structs of the first list are not
 * larger than the library's, and whose structs of the second list have the same size. */
#define IMP_KINDS_VERSION 1

/* First list: the library makes them, and a kind gets them by pointer. A kind of an older
 * header does not look at what is new; of what a kind fills (rays and samples), the library
 * clears everything before the call. A kind hands on the pointer that it was given, and
 * makes none of its own for the functions of another kind.
 *
 * Second list: they are elements of arrays or fields of other structs, or kinds make them
 * to call the library or another kind (a child's directions, a point on a shape). */
#define IMP_KINDS_STRUCTS(first, second)                                                 \
    first(imp_ball) first(imp_bsdf) first(imp_emission) first(imp_emission_sample)       \
        first(imp_emitter) first(imp_input) first(imp_medium) first(imp_phase)           \
            first(imp_round) first(imp_sensor) first(imp_sensor_ray)                     \
                first(imp_sensor_sample) first(imp_shape) first(imp_texture)             \
                    second(imp_attribute) second(imp_carried) second(imp_coefficients)   \
                        second(imp_curves) second(imp_dirs) second(imp_emitter_profile)  \
                            second(imp_film_desc) second(imp_filter) second(imp_hit)     \
                                second(imp_input_desc) second(imp_light_sample)          \
                                    second(imp_located) second(imp_sink)                 \
                                        second(imp_sky_circle) second(imp_surface)       \
                                            second(imp_texcoord) second(imp_triangles)

/* The version and the sizes that somebody was compiled with. These two structs never
 * change. */
struct imp_struct_size {
    const char *name; /* "imp_surface" */
    size_t size;
};
struct imp_kinds_layout {
    int version;
    int n;
    const struct imp_struct_size *structs; /* [n], in any order */
};

/** The layout of the header that this is compiled with; it lives for ever. */
static inline const struct imp_kinds_layout *imp_kinds_here(void)
{
#define IMP_KINDS_SIZE(name) {#name, sizeof(struct name)},
    static const struct imp_struct_size sizes[] = {
        IMP_KINDS_STRUCTS(IMP_KINDS_SIZE, IMP_KINDS_SIZE)};
#undef IMP_KINDS_SIZE
    static const struct imp_kinds_layout layout = {
        IMP_KINDS_VERSION, (int)(sizeof sizes / sizeof sizes[0]), sizes};
    return &layout;
}

/** The layout that the library was compiled with; it lives for ever. A host in a language
 * that cannot compile this header compares its own definitions with it. */
IMP_API const struct imp_kinds_layout *imp_kinds_of_library(void);

/* ---- Registering ---------------------------------------------------------------- */

enum imp_concept {
    IMP_CONCEPT_BSDF,
    IMP_CONCEPT_TEXTURE,
    IMP_CONCEPT_SHAPE,
    IMP_CONCEPT_EMITTER,
    IMP_CONCEPT_SENSOR,
    IMP_CONCEPT_FILTER,
    IMP_CONCEPT_VOLUME,
    IMP_CONCEPT_PHASE,
    IMP_CONCEPT_MEDIUM
};

/** What the functions below call: add a kind to those that scenes of this context can
 * name. Before its first scene. The table is copied; its strings, inputs and functions must
 * live as long as the context. A table of an older header (a smaller `size`) is taken if it
 * has all functions that are required.
 * @param of  the concept.
 * @param ops  its table, struct imp_bsdf_ops, ...; a volume has that of a
 *             texture, and `bound` makes it fit for an extinction.
 * @param layout  what the table was compiled with; read during the call alone.
 * @return IMP_OK, IMP_E_ARG (another version of this header, a struct of another size, no
 * such concept, a table of another `size`, a required function or the name missing, more
 * than IMP_INPUTS_MAX inputs, the name taken by a built-in kind or one registered before, a
 * scene made before; the message says which) or IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_register_kind(imp_context *context, enum imp_concept of, const void *ops,
                  const struct imp_kinds_layout *layout);

/* One of each concept, with the layout of the caller's header. */
static inline IMP_MUST_CHECK enum imp_status
imp_register_bsdf(imp_context *context, const struct imp_bsdf_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_BSDF, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_texture(imp_context *context, const struct imp_texture_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_TEXTURE, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_volume(imp_context *context, const struct imp_texture_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_VOLUME, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_phase(imp_context *context, const struct imp_phase_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_PHASE, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_medium(imp_context *context, const struct imp_medium_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_MEDIUM, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_shape(imp_context *context, const struct imp_shape_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_SHAPE, ops, imp_kinds_here());
}
/** A name may have two tables: one with IMP_EMITTER_AREA, for lights in shapes, and one
 * without. */
static inline IMP_MUST_CHECK enum imp_status
imp_register_emitter(imp_context *context, const struct imp_emitter_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_EMITTER, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_sensor(imp_context *context, const struct imp_sensor_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_SENSOR, ops, imp_kinds_here());
}
static inline IMP_MUST_CHECK enum imp_status
imp_register_filter(imp_context *context, const struct imp_filter_ops *ops)
{
    return imp_register_kind(context, IMP_CONCEPT_FILTER, ops, imp_kinds_here());
}

/* ---- What kinds cannot look into ------------------------------------------------- */

/** The factor at a time; NAN where course is NULL. */
IMP_API double imp_course_value(const struct imp_course *course, double time);
/** The value at a wavelength in nm, 0 outside of where it is given; NAN where spectrum is
 * NULL. */
IMP_API double imp_spectrum_value(const struct imp_spectrum *spectrum, double nm);

/* ---- Reading properties: what build functions call ------------------------------ */

/* A property is what the scene says of an object that is not an input. Each function
 * marks it as read, and leaves *out at `fallback` where it is absent; what nobody has read
 * when `build` returns is an error for the user. IMP_E_SCENE with file, line and column if
 * it has another type or a number is not finite. Names are literals: they must live as
 * long as the scene. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_build_bool(const struct imp_build *build, const char *name, bool fallback, bool *out);
/** IMP_E_SCENE outside [lo, hi]. */
IMP_API IMP_MUST_CHECK enum imp_status imp_build_int(const struct imp_build *build,
                                                     const char *name, int64_t fallback,
                                                     int64_t lo, int64_t hi,
                                                     int64_t *out);
/** Integers are taken too. */
IMP_API IMP_MUST_CHECK enum imp_status imp_build_float(const struct imp_build *build,
                                                       const char *name, double fallback,
                                                       double *out);
/** The string lives as long as the scene. */
IMP_API IMP_MUST_CHECK enum imp_status imp_build_string(const struct imp_build *build,
                                                        const char *name,
                                                        const char *fallback,
                                                        const char **out);
IMP_API IMP_MUST_CHECK enum imp_status imp_build_vector(const struct imp_build *build,
                                                        const char *name,
                                                        const double fallback[3],
                                                        double out[3]);
/** Row-major; the identity where it is absent. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_build_transform(const struct imp_build *build, const char *name, double out[16]);
/** One of n words, in any case; *out is its index. The error lists them. */
IMP_API IMP_MUST_CHECK enum imp_status imp_build_choice(const struct imp_build *build,
                                                        const char *name,
                                                        const char *const *words, int n,
                                                        int fallback, int *out);
/** Is the property, or a child in this slot, written? Marks nothing as read. */
IMP_API bool imp_build_has(const struct imp_build *build, const char *name);
/** Record an error at the place of property `name` (NULL: at the object's), with the
 * object's name in front.
 * @return status */
IMP_API enum imp_status imp_build_error(const struct imp_build *build, const char *name,
                                        enum imp_status status, const char *format, ...)
    IMP_FORMAT(4, 5);
/** Zeroed memory, aligned to 32 bytes, that lives as long as the scene; NULL: none. */
IMP_API void *imp_build_alloc(const struct imp_build *build, size_t n, size_t size);
/** In mono mode lane 0 is all there is; in spectral modes lanes are wavelengths. */
IMP_API enum imp_color_mode imp_build_color_mode(const struct imp_build *build);
/** In `prepare`: write an input as if the scene had, one number or (n = 3) a colour. The
 * input must be absent. */
IMP_API IMP_MUST_CHECK enum imp_status imp_build_set(const struct imp_build *build,
                                                     const char *name, size_t n,
                                                     const double *values);
/** In `build` of a texture: make `data` [dims[0]]..[dims[n_dims - 1]] a parameter <name>.<key>. The
 * numbers are read and set in place; `flags` are IMP_PARAM_*. *param is what an
 * imp_sink gets. n_dims is 1 to 3; of a volume (IMP_PARAM_VOLUME) 3, [z][y][x], or 4,
 * [z][y][x][channels]. Where rows have no order, say so (IMP_PARAM_LIST). */
IMP_API IMP_MUST_CHECK enum imp_status
imp_build_texels(const struct imp_build *build, const char *key, float *data, int n_dims,
                 const size_t *dims, unsigned flags, double lo, double hi, int *param);

#ifdef __cplusplus
}
#endif

#endif
