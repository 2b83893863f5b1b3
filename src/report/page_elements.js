/* SPDX-License-Identifier: Apache-2.0
 *
 * Finite elements: drawn in three dimensions and polygon by polygon, with radiance,
 * importance or illuminance; what arrives at a chosen one over links; illuminance of what
 * is measured, with isolines; lamps and reflectances by what they do to the measurement. */
"use strict";

const element_colours = {
    radiance: {text: "radiance", value: (e) => mean_of(e.radiance), colour: (e, top) => e.radiance.map((v) => to_srgb(v / top))},
    illuminance: {text: "illuminance", value: (e) => e.illuminance},
    importance: {text: "importance", value: (e) => e.importance, decades: 4},
    leaves: {text: "subdivision", value: (e) => e.level},
};

/* [r, g, b] of element `e` by a way of element_colours; `top` is its full scale. */
function element_colour(e, way, top) {
    const v = way.value(e);
    if (!is_number(v)) return [128, 128, 128];
    if (way.colour) { const c = way.colour(e, top); return c.length === 3 ? c : [c[0], c[0], c[0]]; }
    return false_colour(way.decades ? (v > 0 ? 1 + Math.log10(v / top) / way.decades : 0) : v / top);
}

function element_top(elements, way) {
    const all = elements.map(way.value).filter((v) => is_number(v) && v > 0).sort((a, b) => a - b);
    return (way.decades || way.text === "subdivision" ? all[all.length - 1] : all[Math.floor(0.98 * (all.length - 1))]) || 1;
}

function element_scale(way, top, unit) {
    if (way.colour) return make("p", {class: "faint"}, `white: ${show(top, 3)} ${unit}`);
    const bar = make("canvas", {width: 100, height: 1, class: "scale", role: "img", "aria-label": "scale of colours"}), context = bar.getContext("2d"), image = context.createImageData(100, 1);
    for (let i = 0; i < 100; i++) image.data.set([...false_colour((i + 0.5) / 100), 255], 4 * i);
    context.putImageData(image, 0, 0);
    const at = (t) => (way.decades ? top * 10 ** (way.decades * (t - 1)) : t * top);
    return make("div", {class: "thumbs"}, make("div", {}, bar, make("div", {class: "scale_numbers"}, ...[0, 0.5, 1].map((t) => make("span", {}, show(at(t), 3)))), make("div", {class: "faint"}, way.decades ? "logarithmic" : unit)));
}

const element_points = (e) => Array.from({length: Math.floor(e.corners.length / 3)}, (_, k) => e.corners.slice(3 * k, 3 * k + 3));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const minus = (a, b) => a.map((v, c) => v - b[c]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/* ---- Lamps ------------------------------------------------------------------------------ */

/* Shares of the measurement as bars, with their errors. */
function share_table(rows, what) {
    const most = Math.max(...rows.map((r) => Math.abs(r.share)).filter(is_number), 1e-12);
    return make("div", {class: "scroll"}, make("table", {class: "shares"}, make("thead", {}, make("tr", {}, ...[what, "share", ""].map((t) => make("th", {scope: "col"}, t)))),
        make("tbody", {}, ...rows.slice(0, rows_shown).map((r) => {
            const svg = make_svg("svg", {width: 220, height: 16, viewBox: "0 0 220 16", role: "img", "aria-label": "share"}), at = (v) => 4 + 200 * Math.min(Math.abs(v) / most, 1.05);
            svg.append(make_svg("rect", {x: 4, y: 3, width: at(r.share) - 4, height: 10, fill: r.share < 0 ? "var(--warn)" : "var(--accent)"}));
            if (is_number(r.share_error)) svg.append(make_svg("path", {class: "whisker", d: `M${at(Math.abs(r.share) - Math.min(r.share_error, Math.abs(r.share)))} 8H${at(Math.abs(r.share) + r.share_error)}`}));
            return make("tr", {}, make("td", {class: "mono"}, String(r.name)), make("td", {}, `${show(100 * r.share, 4)} %${is_number(r.share_error) ? ` ± ${show(100 * r.share_error, 2)} %` : ""}`), make("td", {}, svg));
        }))), rows.length > rows_shown ? make("p", {class: "faint"}, `${rows_shown} of ${rows.length}`) : null);
}

/* ---- Illuminance --------------------------------------------------------------------------- */

function illuminance_figure(map, unit) {
    const {width, height} = map, rows = Array.from({length: height}, (_, j) => map.illuminance.slice((height - 1 - j) * width, (height - j) * width)).flat();
    const finite = rows.filter(is_number), most = finite.reduce((a, b) => Math.max(a, b), 0), least = finite.reduce((a, b) => Math.min(a, b), Infinity);
    if (!finite.length) return make("figure", {}, make("figcaption", {}, `${map.name}: no illuminance is known`));
    const flat = !(most - least > 1e-9 * Math.abs(most)), levels = flat ? [] : ticks(least, most, 7).filter((v) => v > 0);
    const {svg} = field_plot({values: rows, width, height, x: [0, map.size[0]], y: [0, map.size[1]], x_label: "along the first edge", y_label: "along the last edge", label: `illuminance of ${map.name}`,
        colour: (v) => false_colour(most > 0 ? v / most : 0), levels, digits: 3});
    return make("figure", {}, svg, make("figcaption", {}, `${map.plane ? "plane " : ""}`, make("span", {class: "mono"}, String(map.name)), `: mean ${show(map.measured, 5)}${is_number(map.target) ? ` (wanted: ${show(map.target, 5)})` : ""}, from ${show(least, 3)} to ${show(most, 3)} ${unit}${flat ? "" : "; isolines with their numbers"}`));
}

/* ---- The section ------------------------------------------------------------------------------ */

function elements_section(data) {
    const elements = Array.isArray(data.elements) ? data.elements.filter((e) => Array.isArray(e.corners) && e.corners.length >= 9 && e.corners.every(is_number)) : [];
    const unit = data.unit || "", lux = unit === "cd m^-2" ? "lx" : unit === "W m^-2 sr^-1" ? "W m^-2" : "";
    const maps = (Array.isArray(data.maps) ? data.maps : []).filter((m) => Array.isArray(m.illuminance)), heading = make("h2", {}, "Finite elements");
    const ranked = (key, title, what) => (Array.isArray(data[key]) && data[key].length ? [make("h3", {}, title), share_table(data[key], what)] : []);
    const others = [
        ...ranked("lamps", "Lamps, by what they give", "lamp"), ...ranked("reflectances", "Reflectances, by what they do", "reflectance"),
        ...(maps.length ? [make("h3", {}, "Illuminance"), maps.length < data.n_maps ? make("p", {class: "faint"}, `The largest ${maps.length} of ${data.n_maps} polygons that are measured.`) : null,
            make("div", {class: "drawings"}, ...maps.map((m) => illuminance_figure(m, lux)))] : [])];
    if (!elements.length) return make("section", {id: "elements"}, heading, make("p", {class: "warning"}, "There is no element to draw."), ...others);
    const shape_name = (e) => { const s = Array.isArray(data.shapes) ? data.shapes[e.shape] : null; return s === null || s === undefined ? "measuring plane" : String(s); };
    const points = elements.map(element_points), centres = points.map((p) => [0, 1, 2].map((c) => p.reduce((s, v) => s + v[c], 0) / p.length));
    const normals = points.map((p) => cross(minus(p[1], p[0]), minus(p[p.length - 1], p[0])));
    const far = (Array.isArray(data.others) ? data.others : []).map((o) => ({name: shape_name({shape: o[0]}), centre: o.slice(1, 4)}));
    const sender = (id) => (id < elements.length ? {name: shape_name(elements[id]), centre: centres[id]} : far[id - elements.length] || {name: "?", centre: null});
    const state = {by: "radiance", edges: true, chosen: -1, polygon: null};
    const [lo, hi] = Array.isArray(data.bounds) && data.bounds.flat().every((v) => is_number(v) && Math.abs(v) < 1e15) ? data.bounds : [Math.min, Math.max].map((f) => [0, 1, 2].map((c) => centres.reduce((s, p) => f(s, p[c]), centres[0][c])));
    const table = make("div", {class: "scroll"}), told = make("p", {class: "mono", "aria-live": "polite"}), scale = make("div"), flat_box = make("div");
    const tops = new Map(), top_of = (by) => { if (!tops.has(by)) tops.set(by, element_top(elements, element_colours[by])); return tops.get(by); };
    const css = (e) => `rgb(${element_colour(e, element_colours[state.by], top_of(state.by)).map(Math.round).join(",")})`;
    let space = null, drawn = [];

    function paint(context, line, project, towards) {
        const eye = towards();
        drawn = elements.map((_, i) => i).filter((i) => dot(normals[i], eye) > 0).map((i) => ({i, at: points[i].map(project), near: project(centres[i])[2]})).sort((a, b) => a.near - b.near);
        for (const {i, at} of drawn) {
            const plane = shape_name(elements[i]) === "measuring plane";
            context.beginPath();
            at.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
            context.closePath();
            context.globalAlpha = plane ? 0.35 : 1;
            context.fillStyle = context.strokeStyle = css(elements[i]);
            if (!plane || state.by === "illuminance" || state.by === "importance") context.fill(); /* it sends no light */
            if (state.edges) context.strokeStyle = plane ? "rgba(128,128,128,.15)" : "rgba(128,128,128,.35)";
            context.lineWidth = 0.7;
            context.stroke();
        }
        context.globalAlpha = 1;
        const e = elements[state.chosen];
        if (!e) return;
        const most = Math.max(...(e.links || []).map((l) => l[1]), 0) || 1;
        for (const [id, arrives] of e.links || []) {
            const from = sender(id).centre;
            if (!from) continue;
            context.strokeStyle = style_of("--warn");
            context.globalAlpha = 0.3 + 0.7 * Math.sqrt(arrives / most);
            context.lineWidth = 0.8 + 4 * Math.sqrt(arrives / most);
            line(from, centres[state.chosen]);
        }
        context.globalAlpha = 1;
        context.strokeStyle = style_of("--bad");
        context.lineWidth = 3;
        points[state.chosen].forEach((p, k, all) => line(p, all[(k + 1) % all.length]));
    }
    function tell() {
        const e = elements[state.chosen];
        if (!e) {
            told.textContent = `${elements.length} elements; a click chooses one, the keys N and P the next and the one before.`;
            table.replaceChildren();
            return;
        }
        told.textContent = `${shape_name(e)}, level ${e.level}${e.leaves > 1 ? ` (stands for ${e.leaves} leaves)` : ""}: radiance ${(e.radiance || []).map((v) => show(v, 4)).join(", ")} ${unit}, importance ${show(e.importance, 4)}, illuminance ${show(e.illuminance, 5)} ${lux}`;
        const links = e.links || [];
        table.replaceChildren(links.length ? make("table", {}, make("thead", {}, make("tr", {}, ...["light arrives from", `illuminance ${lux}`, "part", "of the measurement"].map((t) => make("th", {scope: "col"}, t)))),
            make("tbody", {}, ...links.map(([id, arrives, measure]) => make("tr", {}, make("td", {class: "mono"}, `${sender(id).name}${id < elements.length ? `, element ${id}` : ""}`), make("td", {}, show(arrives, 4)),
                make("td", {}, e.illuminance > 0 ? percent(arrives / e.illuminance) : "–"), make("td", {}, show(measure, 3)))),
            e.n_links > links.length ? make("tr", {}, make("td", {}, `${e.n_links - links.length} others`), make("td", {}, show(e.rest, 4)), make("td", {}, e.illuminance > 0 ? percent(e.rest / e.illuminance) : "–"), make("td")) : null))
            : make("p", {class: "faint"}, "No light arrives here over links: it is black, or dark."));
    }
    /* The polygon of the chosen element, flat. */
    function flat() {
        const members = elements.map((_, i) => i).filter((i) => elements[i].polygon === state.polygon);
        if (!members.length) { flat_box.replaceChildren(); return; }
        const p = points[members[0]], along = minus(p[1], p[0]), size = Math.hypot(...along) || 1, u = along.map((v) => v / size);
        const n = normals[members[0]], n_size = Math.hypot(...n) || 1, v = cross(n.map((c) => c / n_size), u);
        const place = (q) => [dot(minus(q, p[0]), u), dot(minus(q, p[0]), v)], all = members.flatMap((i) => points[i].map(place));
        const range = [0, 1].map((c) => [all.reduce((s, q) => Math.min(s, q[c]), Infinity), all.reduce((s, q) => Math.max(s, q[c]), -Infinity)]), origin = [range[0][0], range[1][0]];
        const span = range.map(([a, b]) => b - a || 1), wide = 480, tall = Math.min(Math.max((wide - 80) * span[1] / span[0] + 52, 160), 640);
        const {svg, at} = plot_axes({width: wide, height: tall, x: [0, span[0]], y: [0, span[1]], x_label: "along the surface", y_label: "", label: `elements of ${shape_name(elements[members[0]])}`});
        for (const i of members) {
            const d = points[i].map((q) => { const [a, b] = place(q); return at(a - origin[0], b - origin[1]).map((c) => c.toFixed(1)).join(","); }).join(" ");
            const shape = make_svg("polygon", {points: d, class: i === state.chosen ? "element chosen" : "element", style: `fill: ${css(elements[i])}`});
            shape.append(make_svg("title", {}, `${element_colours[state.by].text} ${show(element_colours[state.by].value(elements[i]), 4)}`));
            shape.addEventListener("click", () => choose(i));
            svg.append(shape);
        }
        flat_box.replaceChildren(make("figure", {}, svg, make("figcaption", {}, `${shape_name(elements[members[0]])}: ${members.length} elements, from its front`)));
    }
    function redraw() {
        scale.replaceChildren(element_scale(element_colours[state.by], top_of(state.by), state.by === "radiance" ? unit : state.by === "illuminance" ? lux : ""));
        space.redraw();
        flat();
    }
    function choose(i) {
        state.chosen = i < 0 ? i : i % elements.length;
        if (i >= 0) { state.polygon = elements[state.chosen].polygon; surfaces.value = String(state.polygon); }
        tell();
        redraw();
    }
    const inside = (x, y, at) => at.reduce((odd, [ax, ay], k) => { const [bx, by] = at[(k + 1) % at.length]; return (ay > y) !== (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax) ? !odd : odd; }, false);
    space = space_view(lo, hi, [0.3, 0.35, 1], `${elements.length} finite elements in space`, {draw: paint,
        click: (x, y) => { const hit = [...drawn].reverse().find((d) => inside(x, y, d.at)); choose(hit ? hit.i : -1); },
        key: (e) => {
            if (e.key !== "n" && e.key !== "p") return false;
            choose((state.chosen + (e.key === "n" ? 1 : elements.length - 1) + (state.chosen < 0 && e.key === "p" ? 1 : 0)) % elements.length);
            return true;
        }});
    const areas = new Map();
    elements.forEach((e, i) => areas.set(e.polygon, (areas.get(e.polygon) || 0) + Math.hypot(...normals[i])));
    const polygons = [...areas].sort((a, b) => b[1] - a[1]).slice(0, rows_shown).map(([polygon]) => polygon), name_of = new Map(elements.map((e) => [e.polygon, shape_name(e)]));
    const by = make("select", {"aria-label": "colours of the elements", change: () => { state.by = by.value; redraw(); }}, ...Object.entries(element_colours).map(([key, way]) => make("option", {value: key}, way.text)));
    const edges = make("input", {type: "checkbox", checked: "", change: () => { state.edges = edges.checked; space.redraw(); }});
    const surfaces = make("select", {"aria-label": "surface", change: () => { state.polygon = Number(surfaces.value); flat(); }}, ...polygons.map((p) => make("option", {value: p}, `${name_of.get(p)} (polygon ${p})`)));
    state.polygon = polygons[0];
    tell();
    redraw();
    const few = data.most_leaves > 1 || data.all_polygons === false;
    return make("section", {id: "elements"}, heading,
        make("p", {}, few ? `${elements.length} elements are drawn for ${data.n_leaves} leaves: each is the mean of at most ${data.most_leaves} of them${data.all_polygons === false ? ", and only the largest polygons are shown" : ""}.` : `All ${data.n_leaves} leaves.`),
        make("div", {class: "bar noprint"}, make("label", {}, "colours: ", by), make("label", {}, edges, "edges"), make("span", {class: "faint"}, "drag or arrows turn, wheel, + and - zoom; surfaces are seen from their front")),
        space.canvas, scale, told, table, make("h3", {}, "One surface"), make("div", {class: "bar noprint"}, make("label", {}, "surface ", surfaces)), flat_box, ...others);
}

/* The answer of the command in words. */
function elements_verdict(a) {
    const lines = [make("p", {}, `Finite elements: ${a.leaves} leaves, ${a.links} links; ${a.reason || ""}. No noise; the mesh and the directional order are what the result is biased by.`)];
    if (a.complete === false) lines.push(make("p", {class: "warning"}, "The solution was interrupted; this is what it had reached."));
    if (is_number(a.measure) && is_number(a.measure_adjoint)) lines.push(make("p", {}, `The measurement is ${show(a.measure)} from radiance and ${show(a.measure_adjoint)} from emission x importance.`));
    if (Array.isArray(a.measurements) && a.measurements.length) {
        const goals = a.fit && Array.isArray(a.fit.goals) ? new Map(a.fit.goals.map((g) => [g.goal, g])) : new Map();
        lines.push(make("div", {class: "scroll"}, make("table", {id: "measurements"}, make("thead", {}, make("tr", {}, ...["measurement", "value", ...(goals.size ? ["wanted", "before"] : [])].map((t) => make("th", {scope: "col"}, t)))),
            make("tbody", {}, ...a.measurements.slice(0, rows_shown).map((m) => make("tr", {}, make("td", {class: "mono"}, String(m.name)), make("td", {}, show(m.value)),
                ...(goals.size ? [make("td", {}, show(goals.get(m.name)?.target)), make("td", {}, show(goals.get(m.name)?.before))] : [])))))));
    }
    return lines;
}
