/* SPDX-License-Identifier: Apache-2.0
 *
 * Both walks of a sample note the densities of their vertices as they are decided. */
#include "both_density.h"
#include "kind/cleared.h"
#include <string.h>

/* ---- Ends ------------------------------------------------------------------------ */

static bool grow(struct imp_arena *arena, void **items, int n, int *cap, size_t size)
{
    if (n < *cap) return true;
    const int more = *cap ? 2 * *cap : 16;
    void *room = imp__arena_take(arena, (size_t)more, size);
    if (!room) return false;
    if (n) memcpy(room, *items, (size_t)n * size);
    *items = room;
    *cap = more;
    return true;
}

struct imp_end *imp__both_light_end(struct imp_both *b)
{
    int cap = b->cap_light;
    void *ends = b->light, *places = b->place;
    if (!grow(b->arena, &ends, b->n_light, &cap, sizeof *b->light)) return NULL;
    cap = b->cap_light;
    if (!grow(b->arena, &places, b->n_light, &cap, sizeof *b->place)) return NULL;
    b->light = ends;
    b->place = places;
    b->cap_light = cap;
    b->place[b->n_light].vertex = NULL;
    struct imp_end *e = &b->light[b->n_light++];
    *e = (struct imp_end){.own = 1, .other = 1};
    return e;
}

struct imp_end *imp__both_eye_end(struct imp_both *b)
{
    void *ends = b->from_eye;
    if (!grow(b->arena, &ends, b->n_eye, &b->cap_eye, sizeof *b->from_eye)) return NULL;
    b->from_eye = ends;
    struct imp_end *e = &b->from_eye[b->n_eye++];
    *e = (struct imp_end){.own = 1, .other = 1};
    return e;
}

/* ---- The walk from the light ------------------------------------------------------- */

bool imp__both_light_begins(struct imp_light_step *w, int light,
                            const struct imp_emission_sample *start)
{
    struct imp_both *b = w->both;
    const struct imp_scene *scene = w->s.scene;
    const struct imp_emitter *e = scene->emitters[light];
    const struct imp_emission x = {
        {start->uv[0], start->uv[1]}, 1, start->cos_light, start->d};
    struct imp_end *end = imp__both_light_end(b);
    if (!end) return false;
    end->far = imp__end_is_far(e);
    end->p = end->far ? -start->d : start->p;
    end->ng = start->ng;
    end->own = imp__end_begins(scene, light, &x);
    b->emitter = light;
    b->pdf_light = start->pdf_d;
    return true;
}

bool imp__both_light_arrives(struct imp_light_step *w, struct imp_vertex *v,
                             const struct imp_surface *at, const struct imp_frame *frame)
{
    struct imp_both *b = w->both;
    const struct imp_step *s = &w->s;
    struct imp_end *end = imp__both_light_end(b);
    imp_spec *in = NULL;
    if (!end) return false;
    const int k = b->n_light - 1;
    const struct imp_end *before = end - 1;
    struct imp_both_place *place = &b->place[k];
    end->p = at->p;
    end->ng = at->ng;
    if (k == 1 && before->far)
        end->own = imp__end_arrives_across(s->scene, b->emitter, end, s->d);
    else if (b->pdf_light > 0) end->own = imp__end_arrives(before, end, b->pdf_light);
    place->P = k == 1 ? v->prev->w : b->place[k - 1].P * v->prev->w;
    if (!(v->bsdf->flags & IMP_BSDF_SMOOTH) || !(end->own > 0)) return true;
    if (s->recorded) {
        in = v->in;
    } else {
        in = imp__arena_take(b->arena, (size_t)imp_max(v->bsdf->n_in, 1), sizeof *in);
        if (!in) return false;
        for (int j = 0; j < v->bsdf->n_in; j++) in[j] = s->in[j];
    }
    place->vertex = v;
    place->number = s->walk->n - 1;
    place->in = in;
    place->frame = *frame;
    place->wi = s->wo;
    place->d = -s->d;
    place->lanes = s->lanes;
    return true;
}

void imp__both_light_leaves(struct imp_light_step *w, const struct imp_bsdf *bsdf,
                            const struct imp_dirs *dirs)
{
    struct imp_both *b = w->both;
    const struct imp_step *s = &w->s;
    struct imp_end *end = &b->light[b->n_light - 1];
    end->delta = dirs->lobe != IMP_SMOOTH;
    b->pdf_light = 0;
    if (end->delta) return;
    b->pdf_light =
        imp__end_pdf(bsdf, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative);
    end[-1].other = imp__end_arrives(
        end, &end[-1],
        imp__end_pdf(bsdf, s->at.carried, s->in, dirs->wo, dirs->wi, dirs->derivative));
}

/* ---- The walk from the sensor ------------------------------------------------------ */

bool imp__both_eye_arrives(struct imp_step *s, const struct imp_surface *at)
{
    struct imp_both *b = s->both;
    const struct imp_sensor *sensor = b->sensor;
    struct imp_end *end = imp__both_eye_end(b);
    if (!end) return false;
    const int k = b->n_eye - 1;
    end->far = !at;
    end->p = at ? at->p : s->d;
    if (at) end->ng = at->ng;
    if (k > 1 || sensor->shape) {
        if (b->pdf_eye > 0) end->own = imp__end_arrives(end - 1, end, b->pdf_eye);
        if (k == 1)
            end->own *= (double)sensor->film.width * sensor->film.height / b->pixels;
        return true;
    }
    const double u[4] = {b->lens[0], b->lens[1], 0, 0};
    struct imp_sensor_sample to;
    b->sees = imp__sensor_connect(sensor, &end->p, end->far, u, &to);
    if (b->sees) end->own = imp__end_arrives_from_sensor(b, to.weight, end, s->d);
    return true;
}

void imp__both_eye_leaves(struct imp_step *s, const struct imp_bsdf *bsdf,
                          const struct imp_frame *frame)
{
    struct imp_both *b = s->both;
    struct imp_end *end = &b->from_eye[b->n_eye - 1];
    const uint64_t derivative = imp__derivative_wanted(s, bsdf);
    end->delta = !(s->pdf > 0);
    b->pdf_eye = 0;
    if (end->delta) return;
    const imp_v3 wi = imp__decide(imp__to_local(frame, s->d));
    b->pdf_eye = imp_likely(!bsdf->shaped)
                     ? s->pdf
                     : imp__end_pdf(bsdf, s->at.carried, s->in, s->wo, wi, derivative);
    if (b->n_eye < 2) return;
    end[-1].other = imp__end_arrives(
        end, &end[-1], imp__end_pdf(bsdf, s->at.carried, s->in, wi, s->wo, derivative));
}
