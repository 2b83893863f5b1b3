/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays against every kind of shape: Embree's answer beside a brute-force intersector of
 * the test's own, in long double, that knows the shapes by their definitions only. */
#include "imp_tap.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"

static struct imp_mat4 placement(int k)
{
    struct imp_mat4 m = imp__mat4_identity();
    if (k == 0) return m;
    const struct imp_mat4 r = imp__rotate(imp__normalize(imp__v3(1, 2, -0.5)), 37);
    struct imp_mat4 s = imp__scale(imp__v3(1.7, 1.7, k == 2 ? -1.7 : 1.7));
    if (k == 3) { /* uneven, and sheared */
        s = imp__scale(imp__v3(1.7, 0.6, 1.2));
        s.m[1] = 0.5, s.m[6] = -0.4, s.m[8] = 0.3;
    }
    const struct imp_mat4 t = imp__translate(imp__v3(0.3, -0.2, 0.7));
    m = imp__mat4_multiply(&r, &s);
    return imp__mat4_multiply(&t, &m);
}

/* Distance along the ray to the kind's local geometry, by definition; INFINITY: none. */
typedef long double real;
static real triangle_hit(const real p[3][3], const real o[3], const real d[3])
{
    real e1[3], e2[3], h[3], s[3], q[3];
    for (int i = 0; i < 3; i++) e1[i] = p[1][i] - p[0][i], e2[i] = p[2][i] - p[0][i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        h[i] = d[j] * e2[k] - d[k] * e2[j];
    }
    real det = 0;
    for (int i = 0; i < 3; i++) det += e1[i] * h[i];
    if (det == 0) return INFINITY;
    for (int i = 0; i < 3; i++) s[i] = o[i] - p[0][i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        q[i] = s[j] * e1[k] - s[k] * e1[j];
    }
    real u = 0, v = 0, t = 0;
    for (int i = 0; i < 3; i++) u += s[i] * h[i], v += d[i] * q[i], t += e2[i] * q[i];
    u /= det, v /= det, t /= det;
    return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : INFINITY;
}

static real local_hit(const struct imp_shape *s, const real o[3], const real d[3])
{
    const char *kind = s->ops->name;
    real best = INFINITY;
    if (strcmp(kind, "rectangle") == 0 || strcmp(kind, "disk") == 0) {
        const real t = -o[2] / d[2], x = o[0] + t * d[0], y = o[1] + t * d[1];
        const int in = *kind == 'r' ? fabsl(x) <= 1 && fabsl(y) <= 1 : x * x + y * y <= 1;
        return t > 0 && in ? t : INFINITY;
    }
    if (strcmp(kind, "sphere") == 0 || strcmp(kind, "cylinder") == 0) {
        const int n = *kind == 's' ? 3 : 2;
        real a = 0, b = 0, c = -1;
        for (int i = 0; i < n; i++) a += d[i] * d[i], b += o[i] * d[i], c += o[i] * o[i];
        const real disc = b * b - a * c;
        if (disc < 0) return INFINITY;
        for (int k = -1; k <= 1; k += 2) {
            const real t = (-b + k * sqrtl(disc)) / a, z = o[2] + t * d[2];
            if (t > 0 && t < best && (n == 3 || (z >= 0 && z <= 1))) best = t;
        }
        return best;
    }
    if (strcmp(kind, "cube") == 0) {
        for (int i = 0; i < 3; i++)
            for (int side = -1; side <= 1; side += 2) {
                const real t = (side - o[i]) / d[i];
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                if (t > 0 && t < best && fabsl(o[j] + t * d[j]) <= 1 &&
                    fabsl(o[k] + t * d[k]) <= 1)
                    best = t;
            }
        return best;
    }
    for (size_t k = 0; k < octahedron.n_triangles; k++) {
        real p[3][3];
        for (int v = 0; v < 3; v++)
            for (int i = 0; i < 3; i++)
                p[v][i] = octa_positions[3 * octa_indices[3 * k + (size_t)v] + (size_t)i];
        best = fminl(best, triangle_hit(p, o, d));
    }
    return best;
}
/* World ray to local; t keeps its value under affine maps. */
static double brute(const struct imp_shape *s, const struct imp_mat4 *inverse, imp_v3 o,
                    imp_v3 d)
{
    real lo[3], ld[3];
    for (int i = 0; i < 3; i++) {
        lo[i] = inverse->m[4 * i + 3], ld[i] = 0;
        for (int j = 0; j < 3; j++) {
            lo[i] += (real)inverse->m[4 * i + j] * o[j];
            ld[i] += (real)inverse->m[4 * i + j] * d[j];
        }
    }
    return (double)local_hit(s, lo, ld);
}

static imp_v3 uniform3(struct imp_key key, uint32_t dim, double size)
{
    return imp__v3(imp__u01(key, dim) - 0.5, imp__u01(key, dim + 1) - 0.5,
                   imp__u01(key, dim + 2) - 0.5) *
           (2 * size);
}

/* Curves have no closed form: unit/curves holds their hits to the tubes' equations. */
static int has_reference(const struct imp_shape_ops *ops)
{
    return strstr(ops->name, "curve") == NULL;
}

/* One shape alone: random rays, axis-aligned ones, from inside, and aimed at rims. */
static void single(imp_context *ctx, const struct imp_shape_ops *ops, int place)
{
    world_begin(ctx);
    struct imp_node *node = kind_node(ops);
    const struct imp_mat4 m = placement(place);
    struct imp_mat4 inverse;
    if (!imp__mat4_inverse(&m, &inverse)) return;
    node_transform(node, m);
    enum imp_status st;
    struct imp_shape *s = shape_build(node, &st);
    int wrong = 0, hits = 0, rays = 0, worst_ops = 0, shadow = 0;
    double worst_t = 0, worst_p = 0, worst_on = 0;
    if (s && imp__intersector_create(&world) == IMP_OK) {
        for (uint32_t i = 0; i < 20000; i++) {
            const struct imp_key key = imp__key(11, (uint64_t)place, i);
            const imp_v3 center = (s->lo + s->hi) * 0.5;
            const double size = imp__length(s->hi - s->lo);
            imp_v3 o = center + uniform3(key, 0, i % 3 == 0 ? size : 0.3 * size), d;
            if (i % 4 == 0) {
                d = imp__v3(0, 0, 0);
                d[i / 4 % 3] = i / 12 % 2 ? 1 : -1;
            } else {
                d = imp__normalize(center + uniform3(key, 3, 0.35 * size) - o);
            }
            const double ref = brute(s, &inverse, o, d);
            /* Too near an edge to call: a ray displaced by float rounding disagrees. */
            int edge = 0;
            for (int k = 0; k < 6; k++) {
                imp_v3 shift = imp__v3(0, 0, 0);
                shift[k / 2] = (k % 2 ? 1 : -1) * 4e-6 * (1 + size);
                const double near = brute(s, &inverse, o + shift, d);
                edge |= isfinite(near) != isfinite(ref) ||
                        (isfinite(ref) && fabs(near - ref) > 1e-3 * (1 + ref));
            }
            if (edge) continue;
            rays++;
            struct imp_hit hit;
            const int found = imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
            shadow += imp__occluded(&world, &o, &d, 0, INFINITY) != found;
            if (found) shadow += imp__occluded(&world, &o, &d, 0, hit.t * 0.999);
            if (found != isfinite(ref)) {
                wrong++;
                continue;
            }
            if (!found) continue;
            hits++;
            struct imp_surface at;
            ops->surface(s, &hit, &o, &d, &at);
            worst_t = fmax(worst_t, fabs(hit.t - ref) / (1 + ref));
            worst_p = fmax(worst_p, imp__length(o + d * ref - at.p) / (1 + size));
            /* The point computed from the primitive lies on the local definition. */
            const imp_v3 back = imp__point(&inverse, at.p);
            double off = 0;
            if (strcmp(ops->name, "sphere") == 0) off = fabs(imp__length(back) - 1);
            else if (strcmp(ops->name, "cylinder") == 0)
                off = fabs(hypot(back[0], back[1]) - 1);
            else if (strcmp(ops->name, "disk") == 0 ||
                     strcmp(ops->name, "rectangle") == 0)
                off = fabs(back[2]);
            worst_on = fmax(worst_on, off);
            if (ops->intersect) {
                struct imp_hit own;
                if (!ops->intersect(s, &o, &d, 0, INFINITY, &own) ||
                    fabs(own.t - ref) > 1e-12 * (1 + ref))
                    worst_ops++;
            }
        }
    }
    const int analytic = s && s->geometry == IMP_ANALYTIC;
    tap_ok(s && rays > 15000 && hits > 2000 && wrong == 0 && shadow == 0 &&
               worst_ops == 0 && worst_t < (analytic ? 1e-12 : 1e-5) &&
               worst_p < (analytic ? 1e-12 : 1e-5) && worst_on < 1e-13,
           "%s, placement %d: nearest hits # rays %d hits %d wrong %d shadow %d t %.1e p "
           "%.1e",
           ops->name, place, rays, hits, wrong, shadow, worst_t, worst_p);
    world_end();
}

/* Everything in one scene: the nearest of all, whatever its type. */
static void together(imp_context *ctx)
{
    enum { N = 24 };
    struct imp_mat4 inverse[N];
    world_begin(ctx);
    const struct imp_shape_ops *kinds[32];
    int n_kinds = 0;
    for (int k = 0; imp__shape_kinds[k]; k++)
        if (has_reference(imp__shape_kinds[k])) kinds[n_kinds++] = imp__shape_kinds[k];
    for (int k = 0; k < N; k++) {
        struct imp_node *node = kind_node(kinds[k % n_kinds]);
        const struct imp_key key = imp__key(5, 0, (uint64_t)k);
        const struct imp_mat4 p = placement(k % 3);
        const struct imp_mat4 t = imp__translate(uniform3(key, 0, 6));
        const struct imp_mat4 m = imp__mat4_multiply(&t, &p);
        imp__mat4_inverse(&m, &inverse[k]);
        node_transform(node, m);
        shape_build(node, NULL);
    }
    int wrong = 0, rays = 0, hits = 0;
    if (world.n_shapes == N && imp__intersector_create(&world) == IMP_OK)
        for (uint32_t i = 0; i < 20000; i++) {
            const struct imp_key key = imp__key(12, 0, i);
            const imp_v3 o = uniform3(key, 0, 8);
            const double u[2] = {imp__u01(key, 4), imp__u01(key, 5)};
            const imp_v3 d = imp__uniform_sphere(u);
            double best = INFINITY, second = INFINITY;
            int shape = -1;
            for (int k = 0; k < N; k++) {
                const double t = brute(world.shapes[k], &inverse[k], o, d);
                if (t < best) second = best, best = t, shape = k;
                else if (t < second) second = t;
            }
            if (second - best < 1e-4 && isfinite(second)) continue;
            struct imp_hit hit;
            const int found = imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
            rays++;
            hits += found;
            if (found != (shape >= 0) ||
                (found && (hit.shape != shape || fabs(hit.t - best) > 1e-5 * (1 + best))))
                wrong++;
        }
    /* A ray within float rounding of a rim may go either way. */
    tap_ok(rays > 18000 && hits > 3000 && wrong <= 2,
           "24 shapes of these kinds: the nearest # rays %d hits %d wrong %d bytes %zu",
           rays, hits, wrong, imp__intersector_bytes(&world));
    tap_ok(imp__intersector_bytes(&world) > 1000, "Embree's memory is counted");
    world_end();
}

static bool made(void)
{
    const bool is = imp__intersector_create(&world) == IMP_OK;
    if (!is) tap_ok(0, "an intersector: %s", imp_last_error(world.ctx));
    return is;
}

/* The same hits of shapes that are asked before Embree (8 analytic ones, as many as it may be, and
 * a wall) and in Embree's tree (with another one far away): in all bits, but for the wall's, which
 * are floats in the tree. */
static void few(imp_context *ctx)
{
    enum { N = 8, RAYS = 20000 };
    static const char *const kinds[] = {"sphere", "disk", "cylinder"};
    static struct imp_hit hits[2][RAYS];
    static bool found[2][RAYS], dark[2][RAYS];
    static double rounding[RAYS];
    int met = 0, wrong = 0;
    for (int more = 0; more < 2; more++) {
        world_begin(ctx);
        for (int k = 0; k < N + more; k++) {
            const struct imp_key key = imp__key(5, 0, (uint64_t)k);
            const imp_v3 at = k < N ? uniform3(key, 0, 6) : imp__v3(0, 0, 1e5);
            const struct imp_mat4 m = placement(k % 3), t = imp__translate(at);
            struct imp_node *n = node_new("shape", kinds[k % 3]);
            node_transform(n, imp__mat4_multiply(&t, &m));
            shape_build(n, NULL);
        }
        struct imp_node *wall = node_new("shape", "rectangle");
        node_transform(wall, imp__scale(imp__v3(4, 4, 4)));
        shape_build(wall, NULL);
        if (!made()) return;
        for (uint32_t i = 0; i < RAYS; i++) {
            const struct imp_key key = imp__key(6, 0, i);
            /* From around them and from among them; one in eight from far away. */
            const imp_v3 o = uniform3(key, 0, i % 8 ? 9 : 1e4), to = uniform3(key, 8, 4);
            const imp_v3 d = (to - o) * (i % 3 ? 1 / imp__length(to - o) : 0.1);
            struct imp_hit hit = {.shape = -1};
            found[more][i] = imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
            if (hit.shape == N + more) hit.shape = N; /* the wall */
            hits[more][i] = hit;
            dark[more][i] = imp__occluded(&world, &o, &d, 0.5, 6);
            rounding[i] = 4e-7 * (1 + imp__length(o)) * fmax(1, 1 / imp__length(d));
        }
        world_end();
    }
    for (int i = 0; i < RAYS; i++) {
        const struct imp_hit *a = &hits[0][i], *b = &hits[1][i];
        met += found[0][i];
        const double off = a->shape == N ? rounding[i] : 0;
        wrong += found[0][i] != found[1][i] || dark[0][i] != dark[1][i] ||
                 a->shape != b->shape || !(fabs(a->t - b->t) <= off) ||
                 !(fabs(a->u - b->u) <= off) || !(fabs(a->v - b->v) <= off);
    }
    tap_ok(met > RAYS / 4 && met < RAYS && wrong == 0,
           "few shapes as many: the same hits # %d of %d rays meet, %d differ", met, RAYS,
           wrong);
}

/* A disk that lies on a rectangle, which is two triangles: within the rounding of a triangle's
 * distance the disk is met, as it should be a hair above; and what is clearly in front is
 * met, the rectangle or the disk. In each row rays of all distances up to 60 degrees from the normal. */
static void ties(imp_context *ctx)
{
    enum { RAYS = 20000 };
    static const struct {
        double above;
        bool disk;
    } rows[] = {{0, true}, {1e-7, true}, {1e-5, true}, {-3e-5, false}};
    static const double planes[] = {0, 1.3, -2.7};
    for (int more = 0; more <= 9; more += 9)
        for (int order = 0; order < 2; order++)
            for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
                int wrong = 0, met = 0;
                for (int at = 0; at < 3; at++) {
                    const double z = (double)(float)planes[at];
                    world_begin(ctx);
                    for (int k = 0; k < 2 + more; k++) {
                        const bool disk = k < 2 ? k == order : true;
                        struct imp_node *n =
                            node_new("shape", disk ? "disk" : "rectangle");
                        const double size = k > 1 ? 1 : disk ? 0.8 : 2;
                        const imp_v3 to =
                            imp__v3(k > 1 ? 1e3 * k : 0, 0,
                                    z + (k < 2 && disk ? rows[r].above : 0));
                        const struct imp_mat4 m = imp__scale(imp__v3(size, size, size)),
                                              t = imp__translate(to);
                        node_transform(n, imp__mat4_multiply(&t, &m));
                        shape_build(n, NULL);
                    }
                    if (!made()) return;
                    const int wanted = rows[r].disk ? order : 1 - order;
                    for (uint32_t i = 0; i < RAYS; i++) {
                        const struct imp_key key = imp__key(21, (uint64_t)at, i);
                        const imp_v3 to =
                            imp__v3(imp__u01(key, 0) - 0.5, imp__u01(key, 1) - 0.5, z);
                        const double c = 0.5 + 0.5 * imp__u01(key, 2),
                                     phi = 6.28 * imp__u01(key, 3),
                                     t = 0.5 + 7 * imp__u01(key, 4), s = sqrt(1 - c * c);
                        const imp_v3 d = imp__v3(-s * cos(phi), -s * sin(phi), -c);
                        const imp_v3 o = to - d * t;
                        struct imp_hit hit = {.shape = -1};
                        met += imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
                        wrong += hit.shape != wanted;
                    }
                    world_end();
                }
                tap_ok(met == 3 * RAYS && wrong == 0,
                       "a disk %g above a rectangle, made %s, %s: the %s # %d rays, %d "
                       "wrong",
                       rows[r].above, order ? "last" : "first",
                       more ? "of many shapes" : "of few",
                       rows[r].disk ? "disk" : "rectangle", met, wrong);
            }
}

static void intervals(imp_context *ctx)
{
    world_begin(ctx);
    struct imp_node *ball = node_new("shape", "sphere"),
                    *wall = node_new("shape", "rectangle");
    node_vector(ball, "center", imp__v3(0, 0, 5));
    node_transform(wall, imp__translate(imp__v3(0, 0, 10)));
    shape_build(ball, NULL);
    shape_build(wall, NULL);
    struct imp_hit hit = {0};
    const imp_v3 o = imp__v3(0, 0, 0), d = imp__v3(0, 0, 1);
    if (!made()) return;
    tap_ok(imp__intersect(&world, &o, &d, 0, INFINITY, &hit) && hit.shape == 0 &&
               hit.t == 4,
           "front of the ball");
    tap_ok(imp__intersect(&world, &o, &d, 4.5, INFINITY, &hit) && hit.shape == 0 &&
               hit.t == 6,
           "from tmin inside: its back");
    tap_ok(imp__intersect(&world, &o, &d, 6.5, INFINITY, &hit) && hit.shape == 1 &&
               hit.t == 10,
           "behind the ball: the wall");
    tap_ok(!imp__intersect(&world, &o, &d, 6.5, 9.5, &hit), "nothing in between");
    tap_ok(!imp__occluded(&world, &o, &d, 6.5, 9.5), "nothing in between: no shadow");
    tap_ok(imp__occluded(&world, &o, &d, 0, 9.5), "shadow of the ball");
    tap_ok(imp__occluded(&world, &o, &d, 7, 10.5), "shadow of the wall");
    tap_ok(!imp__intersect(&world, &o, &d, 5, 5, &hit) &&
               !imp__occluded(&world, &o, &d, 5, 4),
           "empty intervals");
    const imp_v3 bad[4] = {imp__v3(NAN, 0, 0), imp__v3(INFINITY, 0, 0),
                           imp__v3(1e30, 0, 0), imp__v3(0, 0, 0)};
    for (int i = 0; i < 4; i++) {
        const int a = imp__intersect(&world, &o, &bad[i], 0, INFINITY, &hit);
        const int b = i < 3 && imp__intersect(&world, &bad[i], &d, 0, INFINITY, &hit);
        tap_ok(!a && !b && !imp__occluded(&world, &o, &bad[i], 0, INFINITY),
               "a ray with %g in it hits nothing", bad[i][0]);
    }
    tap_ok(!imp__intersect(&world, &o, &d, 0, NAN, &hit), "tmax NaN");
    tap_ok(!imp__intersect(&world, &o, &d, -1, 9, &hit), "tmin below 0");
    world_end();

    world_begin(ctx);
    tap_ok(imp__intersector_create(&world) == IMP_OK &&
               !imp__intersect(&world, &o, &d, 0, INFINITY, &hit) &&
               !imp__occluded(&world, &o, &d, 0, INFINITY),
           "a scene without shapes");
    world_end();
}

/* Four threads, each with a scene of its own in one context, made at the same time: one
 * device, and the same hits. */
struct thread_job {
    imp_context *ctx;
    double sum;
    int ok;
};
static void *thread_run(void *payload)
{
    struct thread_job *job = payload;
    struct imp_bsdf opaque = {.flags = IMP_BSDF_SMOOTH};
    struct imp_scene scene = {.ctx = job->ctx, .default_bsdf = &opaque};
    struct imp_shape *list[8];
    imp__arena_init(&scene.arena, job->ctx);
    for (int k = 0; k < 8 && imp__shape_kinds[k]; k++) {
        struct imp_node *n =
            imp__node_create(&scene.arena, "shape", imp__shape_kinds[k]->name, NULL, NULL,
                             (struct imp_loc){0});
        n->mesh = &octahedron;
        struct imp_prop *p =
            imp__node_add(&scene.arena, n, "to_world", IMP_PROP_TRANSFORM, n->loc);
        memcpy(p->number, imp__translate(imp__v3(3 * (k % 3), 3 * (k / 3), k)).m,
               sizeof p->number);
        struct imp_shape *s = imp__arena_array(&scene.arena, 1, sizeof *s);
        *s = (struct imp_shape){
            .ops = imp__shape_kinds[k],
            .index = k,
            .bsdf = -1,
            .self = imp__arena_array(&scene.arena, 1, imp__shape_kinds[k]->object_size)};
        const struct imp_build b = {.ctx = job->ctx, .node = n, .arena = &scene.arena};
        if (s->ops->build(&b, s->self, s) != IMP_OK) return NULL;
        list[scene.n_shapes++] = s;
    }
    scene.shapes = list;
    for (int round = 0; round < 20; round++) {
        if (imp__intersector_create(&scene) != IMP_OK) return NULL;
        for (uint32_t i = 0; i < 500; i++) {
            const struct imp_key key = imp__key(77, (uint64_t)round, i);
            const imp_v3 o = imp__v3(3, 3, -20),
                         to = uniform3(key, 0, 8) + imp__v3(3, 3, 3);
            const imp_v3 d = imp__normalize(to - o);
            struct imp_hit hit;
            if (imp__intersect(&scene, &o, &d, 0, INFINITY, &hit))
                job->sum += hit.t + hit.shape + hit.u;
        }
        imp__intersector_destroy(&scene);
    }
    imp__arena_free(&scene.arena);
    job->ok = 1;
    return NULL;
}
static void threads(void)
{
    enum { N = 4 };
    imp_context *ctx;
    struct thread_job job[N];
    pthread_t thread[N];
    if (imp_context_create(NULL, &ctx) != IMP_OK) {
        tap_ok(0, "a context for four threads");
        return;
    }
    for (int i = 0; i < N; i++) {
        job[i] = (struct thread_job){.ctx = ctx};
        pthread_create(&thread[i], NULL, thread_run, &job[i]);
    }
    int same = 1;
    for (int i = 0; i < N; i++) {
        pthread_join(thread[i], NULL);
        same &= job[i].ok && job[i].sum == job[0].sum && job[i].sum > 0;
    }
    tap_ok(same, "four threads make and trace scenes in one context # sum %.17g",
           job[0].sum);
    imp_context_destroy(ctx);
}

int main(void)
{
    imp_context *ctx;
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    for (int k = 0; imp__shape_kinds[k]; k++)
        for (int place = 0; place < 4 && has_reference(imp__shape_kinds[k]); place++)
            if (place < 3 || strcmp(imp__shape_kinds[k]->name, "sphere"))
                single(ctx, imp__shape_kinds[k], place);
    together(ctx);
    few(ctx);
    ties(ctx);
    intervals(ctx);
    imp_context_destroy(ctx);
    threads();
    return tap_done();
}
