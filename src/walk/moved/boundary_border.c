/* SPDX-License-Identifier: Apache-2.0
 *
 * The border of a projector's picture (boundary.h), which falls on what it lights: as of a silhouette
 * between a light without a size and a vertex x, with the edge at x itself. With D(u) the border on the
 * screen at distance 1 from the light, I the intensity inside of it, and m into the picture,
 *
 *     dI = -int du |D' x D|/(t |D|^2) I f W(x) m.(V - x'),
 *
 * t the distance of x, at which a point that goes and turns with the light has the velocity V. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "kind/emitter/projector.h"
#include "walk/core/step.h"

#define INSIDE                                                                           \
    1e-9 /* so far from the border, per distance, what is inside is looked up */

void imp__draw_border(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const struct imp_scene *scene = b->tracer->scene;
    struct imp_emitter *e = scene->emitters[d->item->sky];
    imp_v3 D, along, inside, m;
    double place[3];
    e->ops->aim(e, place, false);
    const imp_v3 o = imp__v3(place[0], place[1], place[2]);
    imp__projector_border(e, d->u, &D, &along, &inside);
    const double far = imp__length(D);
    const imp_v3 w = D * (1 / far), turned = imp__cross(along, w);
    m = imp__normalize(turned);
    if (imp__dot(m, inside) < 0) m = -m;
    struct imp_hit hit;
    struct imp_surface at;
    imp_spec T = imp__spec(1);
    bool meets;
    if (imp_unlikely(b->fog || (b->passes && b->through))) {
        struct imp__line line;
        /* Over a mirror no light sample of a projector comes. */
        meets = imp__edge_follow(d, o, w, 0, 0, &hit, &at, &line) && line.mirrors.n == 0;
        if (meets) T = line.T * line.times;
    } else {
        meets = imp__intersect_at(scene, d->time, &o, &w, 0, INFINITY, &hit);
        if (meets) imp__hit_surface(scene, &hit, &o, &w, &at);
    }
    const imp_spec sent =
        imp__edge_sent(d, d->item->sky, 1, imp__normalize(w + m * INSIDE)) * T *
        (-imp__length(turned) / (far * d->chance));
    struct imp__edge_light light = {.w = w, .behind = 1, .slide = -m, .n_ends = 1};
    struct imp__meter_point x;
    if (b->tracer->sensor->shape) {
        /* Where the meter is must be behind an edge: one next to the light. */
        const double near = 1e-6 * (meets ? hit.t : b->size);
        const imp_v3 to = w * near;
        struct imp_hit scaled;
        if (meets) {
            scaled = hit;
            scaled.t = (float)(hit.t / near);
        }
        if (imp__meter_meet(d, o, to, meets ? &scaled : NULL, &x)) {
            const imp_v3 r = x.at.p - o;
            light.light = sent * (1 / imp__length(r));
            light.end[0] =
                (struct imp__flux_end){{.p = o}, {.v = m}, false, d->item->sky + 1, r};
            imp__meter_reach(d, &x, &light);
        }
    }
    if (!meets) return;
    const imp_v3 r = at.p - o;
    light.light = sent * (1 / imp__length(r));
    light.end[0] = (struct imp__flux_end){{.p = o}, {.v = m}, false, d->item->sky + 1, r};
    imp__edge_reach(d, &hit, &at, &light);
}
