/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights that are made some at a time (walk/lights/light_supply.h) beside the same walks
 * alone: what reaches the film, the cause of a drop, and records, to the bit. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/lights/light_step.h"
#include "walk/lights/light_supply.h"
#include <string.h>

enum { WALKS = 700 }; /* no multiple of how many go together */

static imp_context *ctx;

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='8'/>"                             \
    "<integer name='height' value='6'/><rfilter type='tent'/></film>"
#define VIEW                                                                             \
    "<transform name='to_world'><lookat origin='0.3,0.4,3.4' target='0,0,0' "            \
    "up='0,1,0'/></transform>"
#define CAMERA                                                                           \
    "<sensor type='perspective'><float name='fov' value='60'/>" VIEW FILM "</sensor>"
#define DIFFUSE "<bsdf type='diffuse'><rgb name='reflectance' value='.7,.5,.3'/></bsdf>"
#define FLOOR                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"              \
    "<rotate x='1' angle='-90'/><translate y='-1'/></transform>" DIFFUSE "</shape>"
#define LAMP(at)                                                                         \
    "<shape type='rectangle'><transform name='to_world'><scale value='.3'/>"             \
    "<rotate x='1' angle='70'/><translate " at "/></transform><emitter type='area'>"     \
    "<rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define GLASS                                                                            \
    "<shape type='sphere'><float name='radius' value='.5'/>"                             \
    "<bsdf type='dielectric'/></shape>"
#define METAL                                                                            \
    "<shape type='cube'><transform name='to_world'><scale value='.3'/>"                  \
    "<translate x='-1' y='-.7'/></transform><bsdf type='roughconductor'/></shape>"
#define BULB                                                                             \
    "<shape type='sphere'><float name='radius' value='.2'/>"                             \
    "<point name='center' x='1' y='.5' z='0'/><emitter type='area'>"                     \
    "<rgb name='radiance' value='3,4,5'/></emitter></shape>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.2,.3,.4'/></emitter>"
#define POINT                                                                            \
    "<emitter type='point'><point name='position' x='.5' y='1' z='1'/></emitter>"

static bool same(const void *a, const void *b, size_t n) { return memcmp(a, b, n) == 0; }

/* Vertices that differ. */
static int differing(const struct imp_light_walk *a, const struct imp_light_walk *b,
                     bool recorded)
{
    const struct imp_vertex *v = a->walk.first, *w = b->walk.first;
    int wrong = a->walk.n != b->walk.n;
    for (; v && w; v = v->next, w = w->next) {
        wrong += !same(&v->e, &w->e, sizeof v->e) || !same(&v->b, &w->b, sizeof v->b) ||
                 !same(&v->w, &w->w, sizeof v->w);
        if (!recorded) continue;
        const struct imp_decision *x = &v->d, *y = &w->d;
        wrong += v->t != w->t || x->shape != y->shape || x->connection != y->connection ||
                 x->goes_on != y->goes_on || !same(x->p, y->p, sizeof x->p) ||
                 !same(x->uv, y->uv, sizeof x->uv) ||
                 !same(x->located.at, y->located.at, sizeof x->located.at);
        if (x->goes_on)
            wrong += x->pdf != y->pdf || x->survive != y->survive || x->lobe != y->lobe ||
                     !same(x->wo, y->wo, sizeof x->wo) ||
                     !same(x->wi, y->wi, sizeof x->wi);
    }
    return wrong + (v != w);
}

static int differing_reaches(const struct imp_light_walk *a,
                             const struct imp_light_walk *b)
{
    const struct imp_reach *r = a->reach, *q = b->reach;
    int wrong = a->n_reach != b->n_reach || a->walk.dropped != b->walk.dropped;
    for (; r && q; r = r->next, q = q->next)
        wrong += r->px != q->px || r->py != q->py || r->met != q->met ||
                 r->number != q->number || !same(&r->L, &q->L, sizeof r->L);
    return wrong + (r != q);
}

static void compare(const char *name, enum imp_color_mode mode, const char *body)
{
    char text[8192];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='ptracer'>"
             "<integer name='max_depth' value='7'/></integrator>%s</scene>",
             body);
    imp_scene *scene = test_scene_text(ctx, text, mode);
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .seed = 11,
                                .wavelengths = scene->wavelengths};
    for (int recorded = 0; recorded < 2; recorded++) {
        struct imp_arena arena, alone;
        int wrong = 0, reached = 0;
        tracer.value_only = !recorded;
        imp__arena_init(&arena, ctx);
        imp__arena_init(&alone, ctx);
        struct imp_light_supply s = imp__light_supply(&tracer, &arena, 5, 5 + WALKS);
        for (int k = 0; k < WALKS; k++) {
            struct imp_light_walk one;
            const struct imp_light_walk *other = imp__light_supply_take(&s);
            imp__light_walk_trace(&tracer, &alone, 5 + k, &one);
            wrong += !other || differing_reaches(&one, other) ||
                     differing(&one, other, recorded);
            reached += one.n_reach;
            imp__arena_rewind(&alone, (struct imp_arena_mark){0});
        }
        tap_ok(wrong == 0 && reached > WALKS / 16 &&
                   imp__light_walks_go_together(&tracer),
               "%s, %s: of %d walks %d differ, %d connections", name,
               recorded ? "recorded" : "values", WALKS, wrong, reached);
        imp__arena_free(&arena);
        imp__arena_free(&alone);
    }
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    compare("a lamp over glass", IMP_RGB, CAMERA FLOOR LAMP("y='1.5'") GLASS METAL);
    compare("a lamp in spectra", IMP_SPECTRAL, CAMERA FLOOR LAMP("y='1.5'") GLASS METAL);
    compare("in grey", IMP_MONO, CAMERA FLOOR LAMP("y='1.5'"));
    compare("a bulb", IMP_RGB, CAMERA FLOOR BULB METAL);
    compare("lamps, a point and a sky", IMP_RGB,
            CAMERA FLOOR LAMP("y='1.5'") LAMP("x='1' y='1.2'") BULB POINT SKY GLASS);
    compare("a thin lens", IMP_RGB,
            "<sensor type='thinlens'><float name='aperture_radius' value='.1'/><float "
            "name='focus_distance' value='3'/>" VIEW FILM
            "</sensor>" FLOOR LAMP("y='1.5'") GLASS);
    compare("a meter", IMP_RGB,
            FLOOR LAMP("y='1.5'") GLASS
            "<shape type='rectangle'><transform name='to_world'><rotate x='1' "
            "angle='-90'/><translate y='-.9'/></transform><sensor "
            "type='irradiancemeter'>" FILM "</sensor></shape>");
    imp_context_destroy(ctx);
    return tap_done();
}
