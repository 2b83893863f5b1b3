/* SPDX-License-Identifier: Apache-2.0
 *
 * A path tracer as one writes it by hand for one kind of scene: spheres and rectangles, diffuse
 * or mirrors, one light. Light samples and directions with the power heuristic, roulette, box
 * filter. It knows no files, no parameters, no derivatives and no standard errors. hand.c
 * compares the library's time with its own. */
#include "hand_tracer.h"
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

#define PI  3.14159265358979323846
#define EPS 1e-6 /* a ray leaves its surface by this */

enum { THREADS_MAX = 64, BAND = 4 }; /* rows that one thread takes at a time */

typedef struct {
    double x, y, z;
} vec;

static inline vec make(const double v[3]) { return (vec){v[0], v[1], v[2]}; }
static inline vec add(vec a, vec b) { return (vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline vec sub(vec a, vec b) { return (vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline vec mul(vec a, vec b) { return (vec){a.x * b.x, a.y * b.y, a.z * b.z}; }
static inline vec scale(vec a, double s) { return (vec){a.x * s, a.y * s, a.z * s}; }
static inline double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline vec along(vec o, vec d, double t) { return add(o, scale(d, t)); }
static inline vec unit(vec a) { return scale(a, 1 / sqrt(dot(a, a))); }
static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* ---- Random numbers: PCG32 (O'Neill 2014) ---------------------------------------- */

struct random {
    uint64_t state, stream;
};

static inline double number(struct random *r)
{
    const uint64_t old = r->state;
    r->state = old * 6364136223846793005u + r->stream;
    const uint32_t x = (uint32_t)(((old >> 18) ^ old) >> 27),
                   turn = (uint32_t)(old >> 59);
    return ((x >> turn) | (x << (-turn & 31))) * 0x1p-32;
}

static struct random random_begin(uint64_t seed, uint64_t stream)
{
    struct random r = {0, stream << 1 | 1};
    number(&r);
    r.state += seed * 0x9e3779b97f4a7c15u;
    number(&r);
    return r;
}

/* ---- Rays -------------------------------------------------------------------------- */

struct ball {
    vec centre, albedo;
    double r2, inv_r;
    bool mirror;
};
/* p - centre = x a + y b with x = dot(p, u) - u0, y = dot(p, v) - v0. */
struct plate {
    vec n, u, v;
    double height, u0, v0; /* height of its plane: dot(n, p) */
    vec centre, a, b, albedo, emits;
};
struct scene {
    struct ball *ball;
    struct plate *plate;
    int n_balls, n_plates, light;
    double inv_area; /* of the light */
    int max_depth, rr_depth;
    vec eye, corner, right, down; /* of the image plane; per pixel */
};

/* Whichever is hit: balls from 0 on, plates after them; -1 for none. */
static inline int nearest(const struct scene *s, vec o, vec d, double *t_hit)
{
    double t_max = INFINITY;
    int hit = -1;
    for (int i = 0; i < s->n_balls; i++) {
        const struct ball *k = &s->ball[i];
        const vec oc = sub(k->centre, o);
        const double b = dot(oc, d), q = b * b - dot(oc, oc) + k->r2;
        if (q < 0) continue;
        const double root = sqrt(q), t = b - root > EPS ? b - root : b + root;
        if (t > EPS && t < t_max) t_max = t, hit = i;
    }
    for (int i = 0; i < s->n_plates; i++) {
        const struct plate *k = &s->plate[i];
        const double t = (k->height - dot(k->n, o)) / dot(k->n, d);
        if (!(t > EPS && t < t_max)) continue;
        const vec p = along(o, d, t);
        if (fabs(dot(p, k->u) - k->u0) <= 1 && fabs(dot(p, k->v) - k->v0) <= 1)
            t_max = t, hit = s->n_balls + i;
    }
    *t_hit = t_max;
    return hit;
}

/* Is something on the way, d a unit vector? */
static inline bool occluded(const struct scene *s, vec o, vec d, double t_max)
{
    for (int i = 0; i < s->n_balls; i++) {
        const struct ball *k = &s->ball[i];
        const vec oc = sub(k->centre, o);
        const double b = dot(oc, d), q = b * b - dot(oc, oc) + k->r2;
        if (q < 0) continue;
        const double root = sqrt(q);
        if ((b - root > EPS && b - root < t_max) || (b + root > EPS && b + root < t_max))
            return true;
    }
    for (int i = 0; i < s->n_plates; i++) {
        const struct plate *k = &s->plate[i];
        const double t = (k->height - dot(k->n, o)) / dot(k->n, d);
        if (!(t > EPS && t < t_max)) continue;
        const vec p = along(o, d, t);
        if (fabs(dot(p, k->u) - k->u0) <= 1 && fabs(dot(p, k->v) - k->v0) <= 1)
            return true;
    }
    return false;
}

/* ---- Paths ------------------------------------------------------------------------- */

/* A direction by the cosine to n: a point of the unit disk, lifted; the basis is that of Duff
 * et al. (2017). */
static inline vec cosine_draw(struct random *r, vec n, double *cosine)
{
    double x, y, q;
    do x = 2 * number(r) - 1, y = 2 * number(r) - 1, q = x * x + y * y;
    while (q >= 1);
    const double z = sqrt(1 - q), sign = copysign(1, n.z), a = -1 / (sign + n.z),
                 b = n.x * n.y * a;
    const vec s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    const vec t = {b, sign + n.y * n.y * a, -n.y};
    *cosine = z;
    return add(add(scale(s, x), scale(t, y)), scale(n, z));
}

/* Of a direction with density `bsdf`, for light that lies at distance t under `cosine`. */
static inline double density_of_light(const struct scene *s, double t2, double cosine)
{
    return t2 * s->inv_area / cosine;
}

/* What a light sample brings to p, over albedo. */
static inline vec light_sample(const struct scene *s, struct random *r, vec p, vec n)
{
    const vec nothing = {0, 0, 0};
    const struct plate *k = &s->plate[s->light];
    const double x = 2 * number(r) - 1, y = 2 * number(r) - 1;
    const vec to = sub(add(add(k->centre, scale(k->a, x)), scale(k->b, y)), p);
    const double t2 = dot(to, to), here = dot(to, n), there = -dot(to, k->n);
    if (!(here > 0 && there > 0)) return nothing;
    const double t = sqrt(t2), inv_t = 1 / t;
    const double bsdf = here * inv_t / PI, light = density_of_light(s, t2, there * inv_t);
    if (occluded(s, p, scale(to, inv_t), t - EPS)) return nothing;
    return scale(k->emits, bsdf * light / (light * light + bsdf * bsdf));
}

static vec radiance(const struct scene *s, struct random *r, vec o, vec d)
{
    vec sum = {0, 0, 0}, beta = {1, 1, 1};
    double bsdf = 0; /* density of d; 0: a mirror or the camera chose it */
    for (int depth = 0; s->max_depth < 0 || depth < s->max_depth; depth++) {
        double t;
        const int hit = nearest(s, o, d, &t);
        if (hit < 0) return sum;
        const vec p = along(o, d, t);
        const struct ball *ball = hit < s->n_balls ? &s->ball[hit] : NULL;
        const struct plate *plate = ball ? NULL : &s->plate[hit - s->n_balls];
        const vec n = ball ? scale(sub(p, ball->centre), ball->inv_r) : plate->n;
        const double cosine = -dot(d, n);
        if (cosine <= 0) return sum; /* from behind all is black */

        if (hit - s->n_balls == s->light) {
            const double light = density_of_light(s, t * t, cosine);
            const double w = bsdf > 0 ? bsdf * bsdf / (bsdf * bsdf + light * light) : 1;
            sum = add(sum, scale(mul(beta, plate->emits), w));
        }
        if (s->max_depth >= 0 && depth + 1 >= s->max_depth) return sum;

        beta = mul(beta, ball ? ball->albedo : plate->albedo);
        const double brightest = fmax(beta.x, fmax(beta.y, beta.z));
        if (brightest == 0) return sum;
        if (ball && ball->mirror) {
            d = along(d, n, 2 * cosine);
            bsdf = 0;
        } else {
            double z;
            sum = add(sum, mul(beta, light_sample(s, r, p, n)));
            d = cosine_draw(r, n, &z);
            bsdf = z / PI;
        }
        o = p;
        if (depth + 1 >= s->rr_depth) {
            const double survive = fmin(brightest, .95);
            if (number(r) >= survive) return sum;
            beta = scale(beta, 1 / survive);
        }
    }
    return sum;
}

/* ---- Pictures ---------------------------------------------------------------------- */

static void camera_begin(struct scene *s, const struct hand_scene *from, int width,
                         int height)
{
    const vec ahead = unit(sub(make(from->target), make(from->eye)));
    const vec right = unit(cross(ahead, make(from->up))), down = cross(ahead, right);
    const double pixel = 2 * tan(from->fov * PI / 360) / width;
    s->eye = make(from->eye);
    s->right = scale(right, pixel);
    s->down = scale(down, pixel);
    s->corner = along(along(ahead, s->right, -.5 * width), s->down, -.5 * height);
}

static void scene_begin(struct scene *s, const struct hand_scene *from)
{
    *s = (struct scene){.n_balls = from->n_spheres,
                        .n_plates = from->n_rectangles,
                        .light = from->light,
                        .max_depth = from->max_depth,
                        .rr_depth = from->rr_depth};
    s->ball = calloc((size_t)s->n_balls + 1, sizeof *s->ball);
    s->plate = calloc((size_t)s->n_plates + 1, sizeof *s->plate);
    if (!s->ball || !s->plate) abort();
    for (int i = 0; i < s->n_balls; i++) {
        const struct hand_sphere *k = &from->sphere[i];
        s->ball[i] = (struct ball){make(k->centre), make(k->albedo),
                                   k->radius * k->radius, 1 / k->radius, k->mirror};
    }
    for (int i = 0; i < s->n_plates; i++) {
        const struct hand_rectangle *k = &from->rectangle[i];
        const vec a = make(k->a), b = make(k->b), c = make(k->centre),
                  n = unit(cross(a, b));
        const vec u = scale(a, 1 / dot(a, a)), v = scale(b, 1 / dot(b, b));
        s->plate[i] = (struct plate){n, u, v, dot(n, c),       dot(c, u),     dot(c, v),
                                     c, a, b, make(k->albedo), make(k->emits)};
        if (i == s->light) s->inv_area = 1 / (4 * sqrt(dot(a, a) * dot(b, b)));
    }
}

struct share {
    const struct scene *scene;
    int width, height, spp, first, threads;
    uint64_t seed;
    double *out;
};

static void *bands_render(void *payload)
{
    const struct share *j = payload;
    const struct scene *s = j->scene;
    for (int y = 0; y < j->height; y++) {
        if (y / BAND % j->threads != j->first) continue;
        struct random r = random_begin(j->seed, (uint64_t)y);
        for (int x = 0; x < j->width; x++) {
            vec sum = {0, 0, 0};
            for (int k = 0; k < j->spp; k++) {
                const double px = x + number(&r), py = y + number(&r);
                const vec d = unit(along(along(s->corner, s->right, px), s->down, py));
                sum = add(sum, radiance(s, &r, s->eye, d));
            }
            double *out = j->out + 3 * ((size_t)y * (size_t)j->width + (size_t)x);
            out[0] = sum.x / j->spp, out[1] = sum.y / j->spp, out[2] = sum.z / j->spp;
        }
    }
    return NULL;
}

void hand_render(const struct hand_scene *from, int width, int height, int spp,
                 uint64_t seed, int threads, double *out)
{
    struct scene s;
    struct share share[THREADS_MAX];
    pthread_t thread[THREADS_MAX];
    if (threads > THREADS_MAX) threads = THREADS_MAX;
    scene_begin(&s, from);
    camera_begin(&s, from, width, height);
    for (int k = 0; k < threads; k++) {
        share[k] = (struct share){&s, width, height, spp, k, threads, seed, out};
        if (k && pthread_create(&thread[k], NULL, bands_render, &share[k]) != 0) abort();
    }
    bands_render(&share[0]);
    for (int k = 1; k < threads; k++) pthread_join(thread[k], NULL);
    free(s.ball);
    free(s.plate);
}
