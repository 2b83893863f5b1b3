/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent rays: in space, in sections over the index with its isolines, as spots with
 * wavelengths told apart, as irradiance; and what was found over what is true. */
"use strict";

/* From the shortest wavelength, blue, to the longest, red; rays of one wavelength by their
 * bundle. */
function ray_colours(data) {
    const um = Array.isArray(data.wavelengths_um) ? data.wavelengths_um : [];
    const hue = (k) => `hsl(${Math.round(240 * (1 - k / Math.max(um.length - 1, 1)))} 75% 48%)`;
    const of = (ray) => (um.length > 1 ? hue(ray.wavelength) : `hsl(${(210 + 137.508 * (ray.bundle || 0)) % 360} 70% 48%)`);
    const legend = um.length < 2 ? null : make("p", {class: "legend"}, ...um.flatMap((w, k) => [make("span", {style: `color: ${hue(k)}`}, "■ "), `${w > 0 ? `${show(w, 4)} µm` : "no wavelength"}  `]));
    return {of, hue: (k) => (um.length > 1 ? hue(k) : "var(--accent)"), legend};
}

/* Points [[x, y, z], ...] of a ray. */
const ray_points = (ray) => Array.from({length: Math.floor(ray.points.length / 3)}, (_, k) => ray.points.slice(3 * k, 3 * k + 3)).filter((p) => p.every(is_number));

function rays_in_space(data, rays, colours) {
    const circle = (line, at) => { for (let k = 0; k < 48; k++) line(at(2 * Math.PI * k / 48), at(2 * Math.PI * (k + 1) / 48)); };
    const [lo, hi] = [0, 1].map((k) => data.box[k].map((v, c) => (k ? Math.max : Math.min)(v, ...rays.flatMap((r) => ray_points(r).map((p) => p[c])).slice(0, 20000))));
    const view = space_view(lo, hi, [0.4, 0.25, 1], `${rays.length} bent rays in space`, {draw: (context, line) => {
        context.strokeStyle = style_of("--faint");
        context.lineWidth = 1;
        for (const s of Array.isArray(data.surfaces) ? data.surfaces : []) {
            const place = (a, u, v) => s.centre.map((c, k) => c + s.radius * (u[k] * Math.cos(a) + v[k] * Math.sin(a)));
            const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
            if (s.type === "sphere") for (const k of [0, 1, 2]) circle(line, (a) => place(a, axes[k], axes[(k + 1) % 3]));
            else if (s.type === "disc") {
                const n = s.normal, k = n.reduce((best, v, i) => (Math.abs(v) < Math.abs(n[best]) ? i : best), 0), e = axes[k];
                const u0 = [n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]], size = Math.hypot(...u0) || 1, u = u0.map((c) => c / size);
                const v = [n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]];
                circle(line, (a) => place(a, u, v));
            }
        }
        context.globalAlpha = 0.75;
        for (const ray of rays) {
            const points = ray_points(ray);
            context.strokeStyle = colours.of(ray);
            for (let k = 1; k < points.length; k++) line(points[k - 1], points[k]);
        }
        context.globalAlpha = 1;
    }});
    view.redraw();
    return view.canvas;
}

/* One slice: the index in false colour with isolines, rays over it. */
function slice_figure(slice, rays, colours, what) {
    const {width, height, lo, hi, across} = slice, axis = {x: 0, y: 1, z: 2};
    const index = what === "truth" ? slice.truth : what === "difference" ? slice.index.map((v, i) => v - slice.truth[i]) : slice.index;
    const finite = index.filter(is_number), least = finite.reduce((a, b) => Math.min(a, b), Infinity), most = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    const signed = what === "difference", size = Math.max(Math.abs(least), Math.abs(most)) || 1, flat = !(most - least > 1e-12 * size);
    const levels = flat ? [] : ticks(least, most, 7);
    const {svg, at, corners: [x0, y0, x1, y1]} = field_plot({values: index, width, height, x: [lo[0], hi[0]], y: [lo[1], hi[1]], x_label: across[0], y_label: across[1], label: `index, ${slice.axis} = ${show(slice.at, 3)}`,
        levels, colour: (v) => (signed ? signed_colour(v / size) : false_colour(flat ? 0.5 : (v - least) / (most - least)))});
    const step = Math.max(1, Math.ceil(rays.length / 60));
    const clip = `clip-${slice.axis}-${Math.random().toString(36).slice(2)}`;
    const box = make_svg("clipPath", {id: clip});
    box.append(make_svg("rect", {x: x0, y: y0, width: x1 - x0, height: y1 - y0}));
    const group = make_svg("g", {"clip-path": `url(#${clip})`});
    for (let k = 0; k < rays.length; k += step) {
        const places = ray_points(rays[k]).map((p) => at(p[axis[across[0]]], p[axis[across[1]]]).map((v) => v.toFixed(1)).join(" "));
        group.append(make_svg("path", {d: `M${places.join("L")}`, class: "ray", style: `stroke: ${colours.of(rays[k])}`}));
    }
    svg.append(box, group);
    return make("figure", {}, svg, make("figcaption", {}, flat ? `${slice.axis} = ${show(slice.at, 3)}: ${show(least, 7)} everywhere`
        : `${slice.axis} = ${show(slice.at, 3)}: ${show(least, 5)} to ${show(most, 5)}, isolines at ${levels.map((v) => show(v, 5)).join(", ")}`));
}

/* Found and true along the middle of a slice. */
function profile_figure(slice) {
    const {width, height, lo, hi} = slice, row = Math.floor(height / 2);
    const cut = (all) => all.slice(row * width, (row + 1) * width), found = cut(slice.index), truth = cut(slice.truth), all = [...found, ...truth].filter(is_number);
    if (!all.length) return null;
    const least = Math.min(...all), most = Math.max(...all), margin = 0.05 * (most - least) || 1e-6;
    const {svg, at} = plot_axes({x: [lo[0], hi[0]], y: [least - margin, most + margin], x_label: slice.across[0], y_label: "index", label: "found over true"});
    const path = (values) => `M${values.map((v, k) => at(lo[0] + (hi[0] - lo[0]) * (k + 0.5) / width, v).map((c) => c.toFixed(1)).join(" ")).join("L")}`;
    svg.append(make_svg("path", {d: path(truth), class: "truth"}), make_svg("path", {d: path(found), class: "curve"}));
    const worst = found.reduce((w, v, k) => Math.max(w, Math.abs(v - truth[k])), 0);
    return make("figure", {}, svg, make("figcaption", {}, `${slice.axis} = ${show(slice.at, 3)}, ${slice.across[1]} in the middle: found (line) over true (dashes); ${show(worst, 2)} apart at most`));
}

function spot_figure(target, colours) {
    const p = target.points, n = Math.floor(p.length / 3);
    let half = 0;
    for (let k = 0; k < n; k++) half = Math.max(half, Math.abs(p[3 * k]), Math.abs(p[3 * k + 1]));
    half = is_number(target.rms) && target.rms > 0 ? Math.min(half, 5 * target.rms) * 1.05 : half || 1;
    const {svg, at} = plot_axes({width: 360, height: 338, x: [-half, half], y: [-half, half], x_label: `${target.across[0]} − ${show(target.centre[0], 5)}`, y_label: `${target.across[1]} − ${show(target.centre[1], 5)}`, label: `spot of target ${target.target}`});
    for (let k = 0; k < n; k++) {
        if (Math.abs(p[3 * k]) > half || Math.abs(p[3 * k + 1]) > half) continue;
        const [cx, cy] = at(p[3 * k], p[3 * k + 1]);
        svg.append(make_svg("circle", {cx: cx.toFixed(1), cy: cy.toFixed(1), r: 2, class: "spot", style: `fill: ${colours.hue(p[3 * k + 2])}`}));
    }
    return make("figure", {}, svg, make("figcaption", {}, target.rays ? `target ${target.target} (${target.type}): ${target.rays} rays, rms ${show(target.rms, 3)}` : `target ${target.target} (${target.type}): no ray arrives`));
}

/* Irradiance that was found beside the one that is wanted, over its mean. */
function irradiance_figures(target) {
    const {width, height} = target, plane = (values) => [Float32Array.from(values, (v) => (is_number(v) ? v : NaN))];
    const difference = target.found.map((v, i) => v - target.wanted[i]), most = Math.max(1e-9, ...target.wanted.filter(is_number));
    const layer = (name, values, signed) => new Layer(name, width, height, plane(values), null, {signed, luminance: false, range_: signed ? undefined : most});
    return [["found", target.found, false], ["wanted", target.wanted, false], ["found − wanted", difference, true]].map(([name, values, signed]) => {
        const shown = layer(name, values, signed), canvas = make("canvas", {width, height, class: "small"}), look = {mode: signed ? "signed" : "false", gain: 1, range: shown.range()};
        draw(canvas.getContext("2d"), shown, look, {x: 0, y: 0, step: 1});
        return make("figure", {}, canvas, scale_of(shown, look), make("figcaption", {}, `target ${target.target} (${target.type}), ${name}, over the mean`));
    });
}

function rays_section(data, name) {
    if (!data || !Array.isArray(data.box) || !Array.isArray(data.rays)) return null;
    const colours = ray_colours(data), rays = data.rays.filter((r) => Array.isArray(r.points)), slices = Array.isArray(data.slices) ? data.slices : [];
    const targets = Array.isArray(data.targets) ? data.targets : [], spots = targets.filter((t) => Array.isArray(t.points)), images = targets.filter((t) => Array.isArray(t.found));
    const has_truth = slices.some((s) => Array.isArray(s.truth)), sections = make("div", {class: "drawings"});
    const choice = make("select", {"aria-label": "what the sections show", change: () => fill(choice.value)}, ...[["index", "what was found"], ["truth", "what is true"], ["difference", "found − true"]].map(([value, text]) => make("option", {value}, text)));
    function fill(what) { sections.replaceChildren(...slices.map((s) => slice_figure(s, rays, colours, s.truth ? what : "index"))); }
    fill("index");
    const start = /^before/.test(name || ""), children = [
        make("p", {}, `${rays.length < data.n_rays ? `${rays.length} of ` : ""}${data.n_rays ?? rays.length} rays in a field of the kind ${data.field}.`), colours.legend,
        rays.length ? rays_in_space(data, rays, colours) : make("p", {class: "warning"}, "No ray can be drawn."),
        make("p", {class: "faint noprint"}, "drag or arrows turn, + and - zoom"),
        slices.length ? make("h3", {}, "Sections") : null, has_truth ? make("div", {class: "bar noprint"}, make("label", {}, "index: ", choice)) : null, sections,
        has_truth ? make("h3", {}, "Found over true") : null, has_truth ? make("div", {class: "drawings"}, ...slices.filter((s) => s.truth).map(profile_figure).filter(Boolean)) : null,
        spots.length ? make("h3", {}, "Spots") : null, make("div", {class: "drawings"}, ...spots.map((t) => spot_figure(t, colours))),
        images.length ? make("h3", {}, "Irradiance") : null, make("div", {class: "drawings"}, ...images.flatMap(irradiance_figures)),
    ].filter(Boolean);
    return make("section", {class: "rays", id: start ? "rays-start" : "rays"}, make("h2", {}, start ? "Bent rays at the start" : "Bent rays"), ...children);
}
