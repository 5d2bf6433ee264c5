"use strict";
// Shows a film (film.py) in an element: drawings that move, charts with a cursor, controls. Returns
// {show(frame), update(film), leave()}; `moved(frame)` is called after each change of the frame.
function playFilm(root, film, moved = () => {}) {
  let frame = 0, timer = null, span = null, chosen = null, deviations = null, closeUps = [], hovered = null;
  let redraws = [];

  const element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (typeof value === "boolean") made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  };
  const drawn = (parent, tag, attributes = {}, text) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const digits = value => value === null || value === undefined ? "–" : String(Number(value.toPrecision(5)));
  const last = () => film.places.length - 1;
  // The index of the sorted numbers that is nearest to a value.
  const nearest = (sorted, value) => {
    let low = 0, high = sorted.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (sorted[middle] <= value) low = middle; else high = middle;
    }
    return value - sorted[low] <= sorted[high] - value ? low : high;
  };
  const zoomButtons = (what, act) => element("span", {class: "zoom", role: "group", "aria-label": "zoom of " + what},
    ...[["−", 1 / 1.5, "smaller"], ["+", 1.5, "larger"], ["all", 0, "all"]].map(([sign, factor, words]) =>
      element("button", {type: "button", "aria-label": words + ": " + what, onclick: () => act(factor)}, sign)));
  // Pinching on a touchpad is a turn of the wheel with this key; the wheel alone scrolls the page.
  const wheel = act => event => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    act(Math.exp(-0.01 * event.deltaY), event);
  };

  // Where a name may stand: above, below, right, left of what it names, and between these; then farther away.
  const SIDES = [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1], [0, -2.5], [0, 2.5], [1, -2.5], [-1, -2.5],
    [1, 2.5], [-1, 2.5]];

  function panel(data, index) {
    const svg = drawn(document.createDocumentFragment(), "svg", {role: "img", "aria-label": data.title});
    const [left, right, low, high] = data.view;
    const groups = [], world = drawn(svg, "g", {transform: "scale(1 -1)"});
    for (const shape of data.shapes) {
      let group = groups.at(-1);
      if (group === undefined || group.moves !== shape.moves || group.name !== shape.name) {
        group = {moves: shape.moves, name: shape.name, node: drawn(world, "g")};
        if (shape.name) drawn(group.node, "title", {}, shape.name);
        groups.push(group);
      }
      const style = {stroke: shape.color, "stroke-width": shape.width / 0.72, fill: shape.face,
        "fill-opacity": shape.alpha, ...(shape.dashed ? {"stroke-dasharray": "4 3"} : {})};
      const made = shape.kind === "disc"
        ? drawn(group.node, "circle", {cx: shape.points[0][0], cy: shape.points[0][1], r: shape.radius, ...style})
        : drawn(group.node, shape.kind === "line" ? "polyline" : "polygon", {points: shape.points.join(" "), ...style});
      made.dataset.moves = shape.moves;
    }
    // Names stand upright beside what they name, each where it covers no other one.
    const names = data.labels.map(({text, color}) => ({side: 0, node: element("span", {class: "name"}, text), color}));
    for (const {node, color} of names) node.style.color = color;
    const stage = element("div", {class: "drawing"}, svg, ...names.map(({node}) => node));
    const text = element("span", {class: "text"}), place = element("span", {class: "place"});
    let held = null;
    const steps = moves => { const all = data.transforms[moves]; return all[Math.min(frame, all.length - 1)]; };
    const seen = () => closeUps[index] ?? {zoom: 1, x: (left + right) / 2, y: (low + high) / 2};
    const look = () => {
      const {zoom, x, y} = seen();
      const width = (right - left) / zoom, height = (high - low) / zoom;
      svg.setAttribute("viewBox", [x - width / 2, -y - height / 2, width, height].join(" "));
      letter();
    };
    const letter = () => {
      const shown = world.getScreenCTM?.(), box = stage.getBoundingClientRect();
      if (!shown || !(shown.a > 0) || !(box.width > 0)) return;
      const anchors = data.labels.map(({at: [u, v], moves}) => {
        const [a, b, c, d, e, f] = steps(moves);
        const point = new DOMPoint(a * u + c * v + e, b * u + d * v + f).matrixTransform(shown);
        return [point.x - box.left, point.y - box.top];
      });
      const common = (one, other) => Math.max(0, Math.min(one[1], other[1]) - Math.max(one[0], other[0]))
        * Math.max(0, Math.min(one[3], other[3]) - Math.max(one[2], other[2]));
      const taken = [];
      names.forEach((name, n) => {
        const [x, y] = anchors[n], half = name.node.offsetWidth / 2, tall = name.node.offsetHeight / 2;
        const put = ([across, down]) => {
          const toX = x + across * (half + 10), toY = y + down * (tall + 10);
          return [toX - half, toX + half, toY - tall, toY + tall];
        };
        const cost = side => {
          const place = put(SIDES[side]), hidden = 4 * half * tall - common(place, [0, box.width, 0, box.height]);
          const covered = taken.reduce((sum, other) => sum + common(place, other), 0);
          const points = anchors.filter(([u, v]) => u > place[0] && u < place[1] && v > place[2] && v < place[3]).length;
          // A name stays on its side as long as it has room there.
          return covered + hidden + points * half * tall + (side === name.side ? 0 : 0.01 * half * tall * (1 + side));
        };
        name.side = SIDES.map((_, side) => side).reduce((best, side) => cost(side) < cost(best) ? side : best, name.side);
        const place = put(SIDES[name.side]);
        taken.push(place);
        name.node.style.transform = "translate(" + place[0].toFixed(1) + "px, " + place[2].toFixed(1) + "px)";
      });
    };
    const at = event => new DOMPoint(event.clientX, event.clientY).matrixTransform(world.getScreenCTM().inverse());
    const close = (factor, event) => {
      const now = seen(), point = event === undefined ? now : at(event);
      const zoom = factor === 0 ? 1 : clamp(now.zoom * factor, 1, 1000), share = now.zoom / zoom;
      // What is under the pointer stays there.
      closeUps[index] = zoom === 1 ? undefined
        : {zoom, x: point.x + (now.x - point.x) * share, y: point.y + (now.y - point.y) * share};
      look();
    };
    svg.addEventListener("wheel", wheel(close), {passive: false});
    svg.addEventListener("pointerdown", event => {
      const moves = event.target.dataset.moves;
      const [a, b, c, d, e, f] = moves === undefined ? [1, 0, 0, 1, 0, 0] : steps(moves);
      const {x, y} = at(event), size = a * d - b * c;
      held = {x, y, moves, own: [(d * (x - e) - c * (y - f)) / size, (a * (y - f) - b * (x - e)) / size]};
      svg.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    svg.addEventListener("pointermove", event => {
      const {x, y} = at(event);
      if (data.scale) place.textContent = "x " + digits(data.scale[0] * x) + ", y " + digits(data.scale[0] * y) + " " + data.scale[1];
      if (held === null) return;
      if (held.moves === undefined || data.transforms[held.moves].length === 1) {  // what is enlarged is moved
        const now = seen();
        if (now.zoom > 1) closeUps[index] = {...now, x: now.x + held.x - x, y: now.y + held.y - y};
        look();
        return;
      }
      // The frame near the present one in which the point that is held is nearest to the pointer.
      const count = last() + 1, reach = Math.ceil(count / 6);
      let best = frame, least = Infinity;
      for (let step = -reach; step <= reach; step++) {
        const next = film.cyclic ? (frame + step + count) % count : clamp(frame + step, 0, last());
        const [a, b, c, d, e, f] = data.transforms[held.moves][next], [u, v] = held.own;
        const far = Math.hypot(a * u + c * v + e - x, b * u + d * v + f - y);
        if (far < least) [least, best] = [far, next];
      }
      stop();
      show(best);
    });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
    svg.addEventListener("pointerleave", () => { place.textContent = ""; });
    look();
    redraws.push(() => {
      for (const {moves, node} of groups) node.setAttribute("transform", "matrix(" + steps(moves).join(" ") + ")");
      text.textContent = data.texts[frame] ?? "";
      letter();
    });
    svg.style.aspectRatio = (right - left) / (high - low);
    const caption = data.title === film.title ? "" : data.title;
    return element("figure", {class: "panel"}, element("figcaption", {}, caption, text), stage,
      element("div", {class: "under"}, zoomButtons(data.title, close), place));
  }

  const whole = () => [film.at[0], film.at.at(-1)];
  const zoomCharts = (factor, middle = film.at[frame]) => {
    const [first, end] = whole(), [low, high] = span ?? whole(), width = (high - low) / factor;
    if (factor === 0 || width >= end - first) span = null;
    else {
      const start = clamp(middle - (middle - low) / factor, first, end - width);
      span = [start, start + width];
    }
    layOut();
  };

  function ticks(low, high, count) {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find(one => one * power >= rough);
    const found = [];
    for (let n = Math.ceil(low / step); n * step <= high * (1 + 1e-12); n++) found.push(Number((n * step).toPrecision(6)));
    return found;
  }

  function chart(data, index) {
    const bounded = data.lower !== null;
    const named = data.name + (data.unit && data.unit !== "-" ? " [" + data.unit + "]" : "");
    const svg = drawn(document.createDocumentFragment(), "svg", {role: "img", "aria-label": named + " over " + film.label});
    const value = element("output");
    let toX = x => x, fromX = x => x, marks = [];
    const dev = () => bounded && deviations[index];
    const read = () => {
      const sample = nearest(data.x, hovered ?? film.at[frame]);
      let words = digits(data.nominal[sample]);
      if (bounded) words += " (" + digits(data.lower[sample]) + " to " + digits(data.upper[sample]) + ")";
      value.textContent = (hovered === null ? "" : film.label + " " + digits(data.x[sample]) + ": ") + words;
      const there = toX(data.x[sample]), now = toX(film.at[frame]);
      marks[0]?.setAttribute("transform", "translate(" + now + ")");
      marks[1]?.setAttribute("transform", "translate(" + there + ")");
      marks[1]?.setAttribute("visibility", hovered === null ? "hidden" : "visible");
    };
    const lay = () => {
      svg.replaceChildren();
      const width = Math.max(svg.clientWidth, 200), height = 190, left = 58, right = 20, top = 8, bottom = 38;
      svg.setAttribute("viewBox", "0 0 " + width + " " + height);
      const [low, high] = span ?? whole(), seen = [];
      data.x.forEach((x, n) => { if (x >= low && x <= high) seen.push(n); });
      const first = Math.max((seen[0] ?? nearest(data.x, low)) - 1, 0);
      const end = Math.min((seen.at(-1) ?? first) + 1, data.x.length - 1);
      const curve = (values, n) => values[n] === null ? null : values[n] - (dev() ? data.nominal[n] : 0);
      const curves = bounded ? [data.nominal, data.lower, data.upper] : [data.nominal];
      const values = curves.flatMap(one => data.x.map((_, n) => n).slice(first, end + 1).map(n => curve(one, n))).filter(one => one !== null);
      let floor = Math.min(...values), roof = Math.max(...values);
      if (!(roof > floor)) { const room = Math.abs(floor) * 0.1 || 1; floor -= room; roof += room; }
      const room = 0.05 * (roof - floor);
      floor -= room; roof += room;
      toX = x => left + (x - low) / (high - low || 1) * (width - left - right);
      fromX = place => low + (place - left) / (width - left - right) * (high - low);
      const toY = y => top + (roof - y) / (roof - floor) * (height - top - bottom);
      for (const tick of ticks(floor, roof, 6)) {
        drawn(svg, "path", {d: "M" + left + " " + toY(tick) + "H" + (width - right), class: "grid"});
        drawn(svg, "text", {x: left - 5, y: toY(tick) + 4, "text-anchor": "end"}, Math.abs(tick) < 1e6 ? tick : tick.toExponential());
      }
      for (const tick of ticks(low, high, width / 90)) {
        drawn(svg, "path", {d: "M" + toX(tick) + " " + top + "V" + (height - bottom), class: "grid"});
        drawn(svg, "text", {x: toX(tick), y: height - bottom + 15, "text-anchor": "middle"}, tick);
      }
      drawn(svg, "text", {x: (left + width - right) / 2, y: height - 5, "text-anchor": "middle"}, film.label);
      const clip = drawn(svg, "svg", {x: left, y: 0, width: width - left - right, height, viewBox: [left, 0, width - left - right, height].join(" ")});
      const path = (one, order = n => n) => {
        let text = "", pen = "M";
        for (let n = first; n <= end; n++) {
          const m = order(n), y = curve(one, m);
          if (y === null) { pen = "M"; continue; }
          text += pen + toX(data.x[m]).toFixed(1) + " " + toY(y).toFixed(1);
          pen = "L";
        }
        return text;
      };
      if (bounded) {
        const back = path(data.upper, n => first + end - n).replace(/^M/, "L");
        drawn(clip, "path", {d: path(data.lower) + back + "Z", class: "area"});
        for (const bound of [data.lower, data.upper]) drawn(clip, "path", {d: path(bound), class: "bound"});
      }
      drawn(clip, "path", {d: path(data.nominal), class: "nominal"});
      marks = ["now", "there"].map(name => drawn(clip, "path", {d: "M0 " + top + "V" + (height - bottom), class: name}));
      read();
    };
    const place = event => clamp(fromX(event.clientX - svg.getBoundingClientRect().left), ...(span ?? whole()));
    const follow = event => {
      if (event.buttons & 1) { stop(); hovered = null; show(nearest(film.at, place(event))); return; }
      hovered = place(event);
      redraw();
    };
    svg.addEventListener("pointerdown", event => { svg.setPointerCapture(event.pointerId); follow(event); });
    svg.addEventListener("pointermove", follow);
    svg.addEventListener("pointerleave", () => { hovered = null; redraw(); });
    svg.addEventListener("wheel", wheel((factor, event) => zoomCharts(factor, place(event))), {passive: false});
    redraws.push(read);
    const head = element("figcaption", {}, element("b", {}, named), value);
    if (bounded) {
      head.append(element("label", {}, element("input", {type: "checkbox", checked: deviations[index],
        onchange: event => { deviations[index] = event.target.checked; lay(); }}), "deviation from nominal"));
    }
    return {node: element("figure", {class: "chart"}, head, svg), lay};
  }

  let charts = [], controls = null;
  function redraw() {
    for (const one of redraws) one();
    controls.slider.value = frame;
    controls.slider.setAttribute("aria-valuetext", film.places[frame]);
    controls.place.textContent = film.places[frame];
  }
  const layOut = () => {
    for (const one of charts) one.lay();
    for (const one of redraws) one();
  };

  function show(next) {
    frame = clamp(next, 0, last());
    const [low, high] = span ?? whole(), x = film.at[frame];
    if (x < low || x > high) {  // a zoomed chart follows
      const start = clamp(x - (high - low) / 2, whole()[0], whole()[1] - (high - low));
      span = [start, start + high - low];
      layOut();
    }
    redraw();
    moved(frame);
  }
  function stop() {
    clearInterval(timer);
    timer = null;
    controls.play.textContent = "Play";
  }
  function play() {
    timer = setInterval(() => root.isConnected ? show(frame < last() ? frame + 1 : 0) : clearInterval(timer), 1000 / film.rate);
    controls.play.textContent = "Pause";
  }

  function build() {
    chosen ??= film.charts.map((_, n) => n < film.shown);
    deviations ??= film.charts.map(one => one.deviation);
    redraws = [];
    controls = {
      play: element("button", {type: "button", class: "play", onclick: () => timer === null ? play() : stop()}, timer === null ? "Play" : "Pause"),
      slider: element("input", {type: "range", min: 0, max: last(), step: 1, "aria-label": film.label,
        oninput: event => { stop(); show(Number(event.target.value)); }}),
      place: element("output"),
    };
    const boxes = film.charts.map((one, n) => element("label", {}, element("input", {type: "checkbox", checked: chosen[n],
      onchange: event => { chosen[n] = event.target.checked; build(); }}), one.name));
    charts = film.charts.flatMap((one, n) => chosen[n] ? [chart(one, n)] : []);
    const panels = film.panels.map(panel);
    const outputs = boxes.length > 1 ? [element("fieldset", {}, element("legend", {}, "Outputs"), ...boxes)] : [];
    const under = film.charts.length ? [element("div", {class: "under"}, zoomButtons("charts", zoomCharts), ...outputs)] : [];
    const parts = [panels.slice(0, 1), [...panels.slice(1), ...charts.map(one => one.node), ...under]].filter(one => one.length)
      .map(one => element("div", {class: "column"}, ...one));
    const bar = last() > 0 ? [element("div", {class: "bar"}, controls.play, controls.slider, controls.place)] : [];
    root.classList.add("film");
    // A box that had the focus has it again.
    const focused = [...root.querySelectorAll("input, button")].indexOf(document.activeElement);
    root.replaceChildren(element("div", {class: "stage"}, ...parts), ...bar);
    if (focused >= 0) root.querySelectorAll("input, button")[focused]?.focus();
    frame = Math.min(frame, last());
    layOut();
    redraw();
  }
  const watcher = new ResizeObserver(layOut);
  watcher.observe(root);
  window.addEventListener("resize", layOut);  // of a root without a box of its own
  build();
  if (film.starts && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) play();
  const leave = () => { stop(); watcher.disconnect(); window.removeEventListener("resize", layOut); };
  return {show, leave, update(next) {
    if (next.charts.length !== film.charts.length) chosen = deviations = null;
    if (next.at.at(-1) !== film.at.at(-1)) span = null;
    film = next;
    closeUps = film.panels.map((_, n) => closeUps[n]);
    build();
  }};
}
