/* SPDX-License-Identifier: Apache-2.0
 *
 * Random walks as lines in the box of their scene, turned by dragging or by keys; the walk
 * that is chosen as a table, vertex by vertex. Where walks have met shapes there are dots,
 * a colour for each shape: they show the scene, which the page does not hold. */
"use strict";

const mean_of = (v) => (Array.isArray(v) && v.length ? v.reduce((a, b) => a + b, 0) / v.length : 0);
const shape_colour = (i) => `hsl(${(i * 137.508) % 360} 55% 55%)`;

/* What a segment of a walk is coloured by, at the vertex where it ends; walks_section adds
 * what each parameter does to the walk. */
const walk_colours = {
    "the weight of the walk": (walk, k) => mean_of(walk.vertices[k].throughput),
    "the light that comes back along it": (walk, k) =>
        k ? mean_of(walk.vertices[k - 1].arriving) : mean_of(walk.radiance),
};

function walks_section(data) {
    const walks = (Array.isArray(data.walks) ? data.walks : []).filter((w) => Array.isArray(w.vertices) && w.vertices.length && Array.isArray(w.origin));
    if (!walks.length) return null;
    const params = Array.isArray(data.params) ? data.params : [], pixels = Array.isArray(data.pixels) ? data.pixels : [];
    const number_of = new Map((Array.isArray(data.walks) ? data.walks : []).map((w, i) => [w, i])), of_walk = Array.isArray(data.walk_shares) ? data.walk_shares : [];
    const ways = {...walk_colours}, signed = new Set();
    params.slice(0, rows_shown).forEach((p, k) => {
        const name = `x dL/dx of ${p.name}`;
        ways[name] = (walk) => (of_walk[number_of.get(walk)] || [])[k];
        signed.add(name);
    });
    const shapes = [...new Set(walks.flatMap((w) => w.vertices.map((v) => String(v.shape))))];
    const state = {chosen: -1, only: false, by: Object.keys(ways)[0]};
    let [lo, hi] = Array.isArray(data.bounds) && data.bounds.flat().every(is_number) ? data.bounds : [null, null];
    if (!lo || hi.some((v, c) => v - lo[c] > 1e15)) {
        const points = walks.flatMap((w) => w.vertices.map((v) => v.position));
        lo = [0, 1, 2].map((c) => Math.min(...points.map((p) => p[c])));
        hi = [0, 1, 2].map((c) => Math.max(...points.map((p) => p[c])));
    }
    const away = walks[0].origin.map((v, c) => v - (lo[c] + hi[c]) / 2), radius = Math.hypot(...lo.map((v, c) => hi[c] - v)) / 2 || 1;
    const table = make("div", {class: "scroll"}), shares = make("div", {class: "carried"}), told = make("p", {class: "mono", "aria-live": "polite"});
    let space = null;

    function one(context, line, walk, strong) {
        const value = ways[state.by], top = one.top;
        /* From far away, the first segment would leave the picture: it begins at the box. */
        let from = walk.origin;
        const first = walk.vertices[0].position, far = Math.hypot(...from.map((v, c) => v - first[c]));
        if (far > 2 * radius) from = first.map((v, c) => v + (from[c] - v) * 2 * radius / far);
        walk.vertices.forEach((v, k) => {
            const x = value(walk, k), t = Math.log1p(50 * Math.min(Math.abs(x), top) / top) / Math.log1p(50);
            /* Of parameters: orange adds light with more of it, blue takes some; nothing is grey. */
            context.strokeStyle = !signed.has(state.by) ? `rgb(${false_colour(x > 0 ? t : 0).map(Math.round).join(",")})` : t > 0 ? `hsl(${x > 0 ? 25 : 215} ${Math.round(20 + 75 * t)}% 50%)` : "rgba(128,128,128,.4)";
            context.globalAlpha = strong ? 1 : 0.35;
            context.lineWidth = strong ? 2.5 : 1;
            line(from, v.position);
            if (Array.isArray(v.light_position) && mean_of(v.light_sample) > 0) {
                context.setLineDash([4, 4]);
                context.lineWidth = strong ? 1.5 : 0.5;
                line(v.position, v.light_position);
                context.setLineDash([]);
            }
            from = v.position;
        });
        context.globalAlpha = 1;
    }
    function paint(context, line, project) {
        for (const walk of walks)
            for (const v of walk.vertices) {
                const [x, y] = project(v.position);
                context.fillStyle = shape_colour(shapes.indexOf(String(v.shape)));
                context.fillRect(x - 2, y - 2, 4, 4);
            }
        const all = walks.flatMap((w) => w.vertices.map((v, k) => Math.abs(ways[state.by](w, k)))).filter((v) => is_number(v) && (v > 0 || !signed.has(state.by))).sort((a, b) => a - b);
        one.top = all[Math.floor(0.98 * all.length)] || 1;
        if (!(state.only && state.chosen >= 0)) walks.forEach((w) => one(context, line, w, false));
        if (state.chosen >= 0) one(context, line, walks[state.chosen], true);
    }
    function tell() {
        const walk = walks[state.chosen];
        if (!walk) {
            told.textContent = `${walks.length} walks; a click near a line chooses it, the keys N and P the next and the one before.`;
            table.replaceChildren();
            return;
        }
        told.textContent = `pixel ${walk.pixel.join(", ")}, sample ${walk.sample}: radiance ${walk.radiance.map((v) => show(v, 4)).join(", ")}`;
        const numbers = (v) => (Array.isArray(v) ? v.map((x) => show(x, 3)).join(", ") : "");
        table.replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, ...["vertex", "shape", "material", "position", "weight so far",
            "emission", "light", "from the light", "light that arrives"].map((t) => make("th", {scope: "col", class: "text"}, t)))),
            make("tbody", {}, ...walk.vertices.map((v, k) => make("tr", {}, make("td", {}, String(k + 1)), make("td", {class: "text mono"}, String(v.shape ?? "")),
                make("td", {class: "text mono"}, String(v.bsdf ?? v.phase ?? "")), make("td", {class: "text"}, numbers(v.position)),
                make("td", {class: "text"}, numbers(v.throughput)), make("td", {class: "text"}, numbers(v.emission)),
                make("td", {class: "text mono"}, String(v.light ?? "")), make("td", {class: "text"}, numbers(v.light_sample)),
                make("td", {class: "text"}, numbers(v.arriving)))))));
    }
    /* What carried the pixel of the chosen walk, or the only one. */
    function carried() {
        const walk = walks[state.chosen], pixel = walk ? pixels.find((p) => p.pixel[0] === walk.pixel[0] && p.pixel[1] === walk.pixel[1]) : pixels.length === 1 ? pixels[0] : null;
        if (!pixel) { shares.replaceChildren(make("p", {class: "faint"}, pixels.length ? "Choose a walk to see what carried its pixel." : "")); return; }
        const rows = params.map((p, k) => ({name: p.name, lamp: p.unit !== "1", share: pixel.shares[k][0], share_error: pixel.shares[k][1]})).filter((r) => is_number(r.share) && r.share !== 0).sort((a, b) => Math.abs(b.share) - Math.abs(a.share));
        const table_of = (list, what) => (list.length ? [share_table(list, what)] : []);
        shares.replaceChildren(make("p", {}, `Pixel ${pixel.pixel.join(", ")} has the radiance ${show_error(pixel.radiance, pixel.se)} (mean of the channels) over ${pixel.walks} walks. A share is x dR/dx / R of radiance R and numbers x: those of all lights add up to 100 %; that of a reflectance is how often light was reflected by it.`),
            ...table_of(rows.filter((r) => r.lamp), "lights and other numbers with a unit"), ...table_of(rows.filter((r) => !r.lamp), "reflectances and other numbers"),
            ...(rows.length ? [] : [make("p", {class: "faint"}, "No light that a parameter changes reaches it.")]));
    }
    function choose(i) {
        state.chosen = (i + walks.length) % walks.length;
        tell();
        carried();
        space.redraw();
    }
    /* The walk with a vertex or a segment nearest to the point. */
    function nearest(x, y) {
        let best = -1, least = 16 ** 2;
        walks.forEach((walk, i) => {
            let from = space.project(walk.vertices[0].position);
            for (const v of walk.vertices) {
                const to = space.project(v.position), d = [to[0] - from[0], to[1] - from[1]], n = d[0] ** 2 + d[1] ** 2;
                const t = n ? Math.min(Math.max(((x - from[0]) * d[0] + (y - from[1]) * d[1]) / n, 0), 1) : 0;
                const far = (from[0] + t * d[0] - x) ** 2 + (from[1] + t * d[1] - y) ** 2;
                if (far < least) [best, least] = [i, far];
                from = to;
            }
        });
        return best;
    }
    space = space_view(lo, hi, away, `${walks.length} random walks in the scene`, {draw: paint,
        click: (x, y) => {
            state.chosen = nearest(x, y);
            tell();
            carried();
            space.redraw();
        },
        key: (e) => {
            if (e.key !== "n" && e.key !== "p") return false;
            choose(state.chosen + (e.key === "n" ? 1 : -1));
            return true;
        }});
    const {canvas} = space;
    const by = make("select", {change: () => { state.by = by.value; space.redraw(); }}, ...Object.keys(ways).map((k) => make("option", {}, k)));
    const only = make("input", {type: "checkbox", change: () => { state.only = only.checked; space.redraw(); }});
    const heading = pixels.length ? make("h3", {}, "What carried the pixel") : null;
    tell();
    carried();
    space.redraw();
    return make("section", {id: "walks"}, make("h2", {}, "Random walks"), make("div", {class: "bar noprint"},
        make("label", {}, "coloured by ", by), make("label", {}, only, "the chosen one only"),
        make("span", {class: "faint"}, "drag or arrows turn, + and - zoom, dashed: towards a light")), canvas,
        make("p", {class: "faint"}, ...shapes.slice(0, 24).flatMap((s, i) => [make("span", {style: `color: ${shape_colour(i)}`}, "■ "), `${s}  `])),
        told, heading, shares, table);
}
