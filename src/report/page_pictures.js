/* SPDX-License-Identifier: Apache-2.0
 *
 * The viewer: one view at a time, its layers flipped by keys, with zoom, pan and the
 * pixel under the cursor. Zoom and pan stay when the layer changes, so layers are
 * compared in place; "side by side" shows several with one zoom. */
"use strict";

function picture_section(layers, page) {
    const live = page.live;
    let views = [...new Set(layers.map((l) => l.view))];
    const state = {view: views[0], current: 0, beside: false, gain: 0, scale: 0, false_colour: false, things: true, zoom: 1, x: 0, y: 0, px: -1, py: -1};
    const of_view = () => layers.filter((l) => l.view === state.view);
    const buttons = make("div", {class: "bar noprint", role: "toolbar", "aria-label": "layers"});
    const readout = make("div", {class: "scroll", "aria-live": "polite"});
    const canvases = make("div", {class: "bar"});
    const scale_box = make("div");
    const exposure = make("input", {type: "range", min: -10, max: 10, step: 0.25, value: 0, "aria-label": "exposure in stops",
        input: () => { state.gain = Number(exposure.value); redraw(); }});
    const exposure_text = make("span", {class: "mono"}, "0");
    const false_box = make("input", {type: "checkbox", change: () => { state.false_colour = false_box.checked; redraw(); }});
    const beside_box = make("input", {type: "checkbox", change: () => { state.beside = beside_box.checked; rebuild(); }});

    const things_box = make("input", {type: "checkbox", checked: "", change: () => { state.things = things_box.checked; redraw(); }});
    const things_label = make("label", {}, things_box, "what moves"), things_text = make("p", {class: "faint"});

    const look_of = (layer) => ({
        mode: layer.signed ? "signed" : state.false_colour || !layer.luminance ? "false" : "colour",
        gain: 2 ** state.gain, range: layer.range(),
    });
    const shown = () => (state.beside ? of_view().slice(0, 4) : [of_view()[state.current]]);

    /* Texels a canvas pixel, and the texel in the upper left corner. */
    const window_of = (layer, canvas) => ({x: state.x, y: state.y, step: layer.width / canvas.width / state.zoom});
    function keep_inside(layer) {
        state.zoom = Math.min(Math.max(state.zoom, 1), Math.max(layer.width / 4, 1));
        state.x = Math.min(Math.max(state.x, 0), layer.width * (1 - 1 / state.zoom));
        state.y = Math.min(Math.max(state.y, 0), layer.height * (1 - 1 / state.zoom));
    }
    function mark(context, layer, at) {
        if (state.px < 0) return;
        const size = Math.max(1 / at.step, 3), x = (state.px - at.x) / at.step, y = (state.py - at.y) / at.step;
        context.lineWidth = 1;
        context.strokeStyle = "#000";
        context.strokeRect(x - 1.5, y - 1.5, size + 3, size + 3);
        context.strokeStyle = "#fff";
        context.strokeRect(x - 0.5, y - 0.5, size + 1, size + 1);
    }
    function redraw() {
        exposure_text.textContent = `${state.gain > 0 ? "+" : ""}${state.gain} stops`;
        shown().forEach((layer, i) => {
            const canvas = canvases.querySelectorAll("canvas")[i], context = canvas.getContext("2d");
            const at = window_of(layer, canvas);
            draw(context, layer, look_of(layer), at);
            if (state.things) things_draw(context, layer, at, page.things);
            mark(context, layer, at);
        });
        things_label.hidden = !page.things.length;
        things_text.textContent = state.things ? things_legend(page.things, Boolean(live)) : "";
        [...buttons.children].forEach((b, i) => b.setAttribute("aria-pressed", String(i === state.current)));
        scale_box.replaceChildren(scale_of(shown()[0], look_of(shown()[0])));
        tell();
    }
    function tell() {
        if (state.px < 0) {
            readout.replaceChildren(make("p", {class: "faint"}, "Point at the picture, or focus it and use the arrow keys."));
            return;
        }
        const body = make("tbody");
        for (const layer of of_view().slice(0, rows_shown)) {
            if (state.px >= layer.width || state.py >= layer.height) continue;
            for (let c = 0; c < layer.count; c++)
                body.append(make("tr", {}, make("td", {}, layer.name + (layer.count === 3 ? ` ${"RGB"[c]}` : "")),
                    make("td", {}, show_error(layer.at(c, state.px, state.py), layer.error_at(c, state.px, state.py))),
                    make("td", {class: "text"}, layer.unit)));
        }
        readout.replaceChildren(make("p", {class: "mono", id: "pixel"}, `pixel ${state.px}, ${state.py}`), make("table", {}, body));
    }
    /* A page that is served asks for the walks of the pixel. */
    function ask_walks() {
        if (live && live.walks && state.px >= 0) live.ask("walks", {x: state.px, y: state.py});
    }
    function choose(i) {
        if (i < 0 || i >= of_view().length) return;
        state.current = i;
        if (state.beside) redraw();
        else rebuild();
    }
    function pick(layer, canvas, event) {
        const box = canvas.getBoundingClientRect(), at = window_of(layer, canvas);
        const x = Math.floor(at.x + (event.clientX - box.left) * canvas.width / box.width * at.step);
        const y = Math.floor(at.y + (event.clientY - box.top) * canvas.height / box.height * at.step);
        if (x < 0 || y < 0 || x >= layer.width || y >= layer.height) return;
        [state.px, state.py] = [x, y];
        redraw();
    }
    function zoom_at(layer, factor, x, y) {
        const before = state.zoom;
        state.zoom *= factor;
        state.zoom = Math.min(Math.max(state.zoom, 1), Math.max(layer.width / 4, 1));
        state.x = x - (x - state.x) * before / state.zoom;
        state.y = y - (y - state.y) * before / state.zoom;
        keep_inside(layer);
        redraw();
    }
    function canvas_of(layer, slot) {
        const scale = Math.max(1, Math.min(16, Math.ceil(720 / layer.width)));
        const canvas = make("canvas", {class: "view", tabindex: 0, width: layer.width * scale, height: layer.height * scale,
            role: "img", "aria-label": `${layer.name}, ${layer.width} x ${layer.height}`});
        let drag = null, held = null;
        const film_at = (e) => {
            const box = canvas.getBoundingClientRect(), at = window_of(layer, canvas), per = canvas.width / box.width;
            return {at, x: (e.clientX - box.left) * per, y: (e.clientY - box.top) * per, near: 12 * per};
        };
        canvas.addEventListener("pointerdown", (e) => {
            const p = film_at(e);
            const thing = state.things && live && live.movable() ? thing_at(page.things, layer, p.at, p.x, p.y, p.near) : null;
            held = thing && {thing, at: thing.at, axes: thing.axes, shift: live.held(thing)};
            drag = {x: e.clientX, y: e.clientY, moved: false};
            canvas.setPointerCapture(e.pointerId);
        });
        canvas.addEventListener("pointerup", (e) => {
            const still = drag && !drag.moved && !held;
            drag = held = null;
            if (!still) return;
            pick(layer, canvas, e);
            ask_walks();
        });
        canvas.addEventListener("pointermove", (e) => {
            if (!drag) { pick(layer, canvas, e); return; }
            drag.moved = drag.moved || Math.abs(e.clientX - drag.x) + Math.abs(e.clientY - drag.y) > 2;
            if (!drag.moved) return;
            if (held) {
                const p = film_at(e), to = [p.at.x + p.x * p.at.step, p.at.y + p.y * p.at.step];
                held.shift(shift_of(held, to.map((x, i) => x - held.at[i])));
                held.thing.at = to;
                redraw();
                return;
            }
            const step = window_of(layer, canvas).step * canvas.width / canvas.getBoundingClientRect().width;
            state.x -= (e.clientX - drag.x) * step;
            state.y -= (e.clientY - drag.y) * step;
            [drag.x, drag.y] = [e.clientX, e.clientY];
            keep_inside(layer);
            redraw();
        });
        canvas.addEventListener("wheel", (e) => {
            if (!e.ctrlKey && document.activeElement !== canvas) return; /* the page scrolls */
            e.preventDefault();
            pick(layer, canvas, e);
            zoom_at(layer, e.deltaY < 0 ? 1.25 : 0.8, state.px, state.py);
        }, {passive: false});
        canvas.addEventListener("keydown", (e) => {
            const move = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[e.key];
            if (move) {
                const far = e.shiftKey ? 10 : 1;
                state.px = Math.min(Math.max(Math.max(state.px, 0) + far * move[0], 0), layer.width - 1);
                state.py = Math.min(Math.max(Math.max(state.py, 0) + far * move[1], 0), layer.height - 1);
                /* the window follows the pixel */
                const w = layer.width / state.zoom, h = layer.height / state.zoom;
                state.x = Math.min(Math.max(state.x, state.px + 1 - w), state.px);
                state.y = Math.min(Math.max(state.y, state.py + 1 - h), state.py);
                keep_inside(layer);
                redraw();
            } else if (e.key === "+" || e.key === "=") zoom_at(layer, 1.25, Math.max(state.px, 0), Math.max(state.py, 0));
            else if (e.key === "-") zoom_at(layer, 0.8, Math.max(state.px, 0), Math.max(state.py, 0));
            else if (e.key === "0") { state.zoom = 1; keep_inside(layer); redraw(); }
            else if (e.key === "Enter" && live && live.walks) ask_walks();
            else return;
            e.preventDefault();
        });
        return make("div", {style: state.beside ? "flex: 1 1 240px; min-width: 0" : "flex: 1 1 100%; min-width: 0"},
            state.beside ? make("div", {class: "faint"}, layer.name) : null, canvas);
    }
    function rebuild() {
        buttons.replaceChildren(...of_view().map((layer, i) => make("button", {type: "button", click: () => choose(i)},
            (i < 9 ? `${i + 1} ` : "") + layer.name)));
        canvases.replaceChildren(...shown().map((layer, slot) => canvas_of(layer, slot)));
        redraw();
    }
    document.addEventListener("keydown", (e) => {
        if (e.ctrlKey || e.altKey || e.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName) && e.target.type !== "checkbox") return;
        if (e.key >= "1" && e.key <= "9") choose(Number(e.key) - 1);
    });
    const view_box = views.length < 2 ? null : make("label", {}, "view ", make("select", {change: (e) => {
        state.view = views[e.target.selectedIndex];
        [state.current, state.px] = [0, -1];
        rebuild();
    }}, ...views.map((v) => make("option", {}, String(v)))));
    const section = make("section", {id: "pictures"}, make("h2", {}, "Pictures"), buttons,
        make("div", {class: "bar noprint"}, view_box, make("label", {}, "exposure ", exposure, exposure_text),
            make("label", {}, false_box, "false colour"), make("label", {}, beside_box, "side by side"),
            things_label, make("span", {class: "faint"}, "keys 1 to 9 change the layer; on the picture: arrows, + and -, 0; drag moves it")),
        make("div", {class: "stage"}, make("div", {}, canvases, things_text, scale_box), readout));
    const bad = layers.filter((l) => l.not_finite > 0 && !l.name.endsWith(".interval")); /* there NaN: no interval */
    if (bad.length) section.append(make("p", {class: "warning"}, `Numbers that are not finite (NaN or infinite) are drawn in magenta: ${bad.slice(0, 5).map((l) => `${l.name}: ${l.not_finite}${l.not_finite === l.planes[0].length * l.of_channels ? ", all of it" : ""}`).join("; ")}.`));
    rebuild();
    /* New layers take the place of those with the same names; the rest of the view stays. */
    section.update = (fresh) => {
        const chosen = of_view()[state.current], same = layers.length === fresh.length && layers.every((l, i) => l.name === fresh[i].name && l.width === fresh[i].width && l.height === fresh[i].height);
        for (const layer of layers) if (!fresh.includes(layer)) forget_layer(layer);
        layers.splice(0, layers.length, ...fresh);
        views = [...new Set(layers.map((l) => l.view))];
        if (!views.includes(state.view)) state.view = views[0];
        const at = of_view().findIndex((l) => chosen && l.name === chosen.name);
        state.current = Math.max(at, 0);
        if (same) redraw();
        else rebuild();
    };
    section.redraw = redraw;
    /* The layer of a role, with a marked pixel. */
    section.show = (view, role, x, y) => {
        const layer = layers.find((l) => l.view === view && l.role === role) || layers.find((l) => l.view === view);
        if (!layer) return;
        [state.px, state.py] = [x, y];
        section.choose(layer);
    };
    section.choose = (layer) => { state.view = layer.view; rebuild(); choose(of_view().indexOf(layer)); section.scrollIntoView(); };
    return section;
}

/* What the colours mean. */
function scale_of(layer, look) {
    if (look.mode === "colour") return make("p", {class: "faint"}, layer.unit ? `in ${layer.unit}` : "");
    const top = look.range / look.gain, bottom = look.mode === "signed" ? -top : 0, bar = make("canvas", {width: 100, height: 1, class: "scale", role: "img", "aria-label": "scale of colours"});
    const context = bar.getContext("2d"), image = context.createImageData(100, 1);
    for (let i = 0; i < 100; i++) image.data.set([...(look.mode === "signed" ? signed_colour((i + 0.5) / 50 - 1) : false_colour((i + 0.5) / 100)), 255], 4 * i);
    context.putImageData(image, 0, 0);
    return make("div", {}, bar, make("div", {class: "scale_numbers"}, ...[0, 0.5, 1].map((t) => make("span", {}, show(bottom + t * (top - bottom), 3)))), layer.unit ? make("div", {class: "faint"}, layer.unit) : null);
}

/* The change of the picture that numbers stand for which the pictures do not determine:
 * what can be added to the answer, and hardly be seen. */
function loosest_figures(layers, undetermined, choose) {
    const names = Array.isArray(undetermined.names) ? undetermined.names : [], direction = Array.isArray(undetermined.direction) ? undetermined.direction : [];
    const largest = Math.max(...direction.map(Math.abs)), terms = direction.map((d, k) => [d, names[k]]).filter(([d]) => Math.abs(d) > 0.05 * largest).slice(0, 8);
    return make("div", {id: "undetermined"}, make("h3", {}, "What the pictures determine least"),
        make("p", {}, `This change of the numbers changes the picture as it is drawn: ${terms.map(([d, name]) => `${name} by ${d > 0 ? "+" : "−"}${show(Math.abs(d), 3)}`).join(", ")}.`),
        make("div", {class: "thumbs"}, ...layers.map((layer) => thumb(layer, choose))));
}

function thumb(layer, choose) {
    const canvas = make("canvas", {width: layer.width, height: layer.height, tabindex: 0, role: "button",
        "aria-label": layer.name, click: () => choose(layer), keydown: (e) => { if (e.key === "Enter") choose(layer); }});
    const look = {mode: "signed", gain: 1, range: layer.range()};
    draw(canvas.getContext("2d"), layer, look, {x: 0, y: 0, step: 1});
    return make("figure", {}, canvas, scale_of(layer, look), make("figcaption", {}, layer.name));
}

/* Small pictures of what is signed, one a parameter. */
function derivative_section(layers, choose) {
    return make("section", {id: "derivatives"}, make("h2", {}, "Derivatives of the picture"),
        make("p", {class: "faint"}, "Red: more of the parameter makes the pixel brighter. A click shows it above."),
        make("div", {class: "thumbs"}, ...layers.map((layer) => thumb(layer, choose))));
}
