// The map of a page at other scales: buttons, keys, two fingers, and the wheel once it was clicked on, zoom it; dragging
// and the arrow keys move it. The cursor of the charts has its place and its ellipse on the track; a place on the track
// has its instant in the charts.
"use strict";
(() => {
  const {add, css, point, spots, unpack} = live;
  const DRAWN = 40, NAMED = 12; // most airports that are drawn, and with their codes
  const MOST = 5000, NEAR = 12; // largest zoom; px from the track within which its instant is taken

  const number = (value, step) => {
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    return (Math.abs(value) < 1e-6 * step ? 0 : value).toFixed(places).replace("-", "\u2212");
  };
  const round = most => { // the largest of 1, 2, 5, 10 … that is not above
    const power = 10 ** Math.floor(Math.log10(most));
    return [5, 2, 1].map(n => n * power).find(v => v <= most * (1 + 1e-9)) ?? power;
  };

  async function begin(figure) {
    const given = JSON.parse(figure.dataset.map), arrays = await unpack(given), still = figure.querySelector("svg");
    const svg = still.cloneNode(true), inside = svg.querySelector("svg"), layers = [...svg.querySelectorAll(".redrawn")];
    const read = name => Number(inside.getAttribute(name));
    const map = {figure, given, arrays, svg, inside, layers, box: ["x", "y", "width", "height"].map(read), t: null};
    map.lines = given.lines.map(line => ({...line, x: arrays[line.x], y: arrays[line.y], time: line.time === null ? null : arrays[line.time]}));
    map.track = map.lines.find(line => line.time);
    map.whole = [...given.ends[0], ...given.ends[1]];
    map.view = map.whole;
    const place = document.createElement("div");
    place.className = "zoomed";
    place.append(svg);
    figure.append(place);
    figure.classList.add("drawn");
    tools(map, place);
    gestures(map);
    spots.push(t => { [map.t, map.last] = [t, t ?? map.last]; spot(map); });
    draw(map);
    (live.maps ??= []).push(map);
  }

  const scales = ({view: [west, east, south, north], box: [left, top, wide, high]}) => {
    const k = wide / (east - west);
    return {k, x: v => left + (v - west) * k, y: v => top + (north - v) * high / (north - south)};
  };

  // A line as a path, without the parts that do not meet the view.
  function path({view: [west, east, south, north]}, xs, ys, {x, y}) {
    let text = "", open = false;
    for (let k = 1; k < xs.length; k++) {
      const [a, b, c, d] = [xs[k - 1], ys[k - 1], xs[k], ys[k]];
      const seen = a !== null && c !== null && Math.max(a, c) >= west && Math.min(a, c) <= east && Math.max(b, d) >= south && Math.min(b, d) <= north;
      if (!seen) { open = false; continue; }
      if (!open) text += `M${x(a).toFixed(1)} ${y(b).toFixed(1)}`;
      text += `L${x(c).toFixed(1)} ${y(d).toFixed(1)}`;
      open = true;
    }
    return text;
  }

  function draw(map) {
    const {given, arrays, inside, layers: [axes, words], box: [left, top, wide, high], view} = map, scale = scales(map), {x, y} = scale;
    for (const part of [inside, axes, words]) part.textContent = "";
    const right = left + wide, bottom = top + high, step = round(1.9 * (view[1] - view[0]) * 75 / wide);
    const across = ticks(view[0], view[1], step), upright = ticks(view[2], view[3], step);
    add(axes, "path", "", {class: "grid", fill: "none", d: across.map(v => `M${x(v)} ${top}V${bottom}`).join("") + upright.map(v => `M${left} ${y(v)}H${right}`).join("")});
    add(axes, "path", "", {class: "axis", fill: "none", d: `M${left} ${top}V${bottom}H${right}`});
    for (const v of across) add(axes, "text", number(v, step), {x: x(v), y: bottom + 15, "text-anchor": "middle", class: "soft"});
    for (const v of upright) add(axes, "text", number(v, step), {x: left - 6, y: y(v) + 4, "text-anchor": "end", class: "soft"});
    for (const line of map.lines) {
      const look = {fill: "none", stroke: css(line.color), "stroke-width": line.width, "stroke-dasharray": line.dash, "stroke-linejoin": "round"};
      if (!line.marker) add(inside, "path", "", {...look, d: path(map, line.x, line.y, scale)});
      else add(inside, "path", "", {...look, d: line.x.map((v, k) => `M${x(v) - 4} ${y(line.y[k])}l4 -4l4 4l-4 4z`).join("")});
    }
    const seen = (a, b) => a >= view[0] && a <= view[1] && b >= view[2] && b <= view[3];
    for (const {color, x: xs, y: ys, names, large} of given.sites) { // as track_map.py draws them
      const [es, ns] = [arrays[xs], arrays[ys]], all = names.map((_, k) => k).filter(k => seen(es[k], ns[k])), taken = [];
      const drawn = [all, all.filter(k => k < large), []].find(some => some.length <= DRAWN);
      add(inside, "path", "", {d: drawn.map(k => `M${x(es[k]).toFixed(1)} ${y(ns[k]).toFixed(1)}h0`).join(""), fill: "none", stroke: css(color),
                               "stroke-width": 3.5, "stroke-linecap": "round"});
      for (const k of drawn.length <= NAMED ? drawn : []) {
        const [a, b] = [x(es[k]), y(ns[k])];
        if (a > right - 40 || taken.some(([c, d]) => Math.abs(a - c) <= 40 && Math.abs(b - d) <= 14)) continue;
        taken.push([a, b]);
        add(words, "text", names[k], {x: a + 7, y: b + 15, class: "soft over"});
      }
    }
    for (const dot of given.dots) {
      const xs = arrays[dot.x], ys = arrays[dot.y];
      add(inside, "path", "", {d: xs.map((v, k) => `M${x(v).toFixed(1)} ${y(ys[k]).toFixed(1)}h0`).join(""), fill: "none", stroke: css(dot.color),
                           "stroke-width": dot.size, "stroke-linecap": "round"});
    }
    for (const word of given.words) {
      const [a, b] = [x(word.x), y(word.y)];
      if (a < left || a > right || b < top || b > bottom) continue;
      add(words, "text", word.text, {x: word.left ? a - 7 : a + 7, y: b + (word.below ? 15 : -6), "text-anchor": word.left ? "end" : "start",
                                     class: word.soft ? "soft over" : "over"});
    }
    given.bars.forEach(([unit, size], n) => {
      const long = round(0.22 * (view[1] - view[0]) / size), end = right - 8, height = top + 14 + 16 * n;
      add(words, "path", "", {d: `M${end - long * size * scale.k} ${height - 4}v4H${end}v-4`, fill: "none", stroke: css("--ink")});
      add(words, "text", unit === "km" && long < 1 ? `${Number((1000 * long).toPrecision(1))} m` : `${Number(long.toPrecision(1))} ${unit}`,
          {x: end - long * size * scale.k - 7, y: height, "text-anchor": "end", class: "soft over"});
    });
    spot(map);
  }

  const ticks = (low, high, step) => {
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
    return found;
  };

  // The row before an instant, and the part of the way to the next; null outside.
  function between(times, t) {
    if (t === null || t < times[0] || t > times.at(-1)) return null;
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    return [low, (t - times[low]) / (times[high] - times[low] || 1)];
  }

  const mixed = (rows, [k, part]) => rows[k] + part * ((rows[k + 1] ?? rows[k]) - rows[k]);

  // Marks the place at an instant, and the ellipse then.
  function spot(map) {
    const {inside, track, t, given, arrays} = map, {x, y} = scales(map);
    inside.querySelectorAll(".here").forEach(part => part.remove());
    const at = between(track.time, t);
    if (!at) return;
    for (const {at: times, parts} of given.ellipses) {
      const then = between(arrays[times], t);
      if (!then) continue;
      const [e, n, ae, an, be, bn] = parts.map(k => mixed(arrays[k], then));
      const ring = Array.from({length: 49}, (_, k) => [Math.cos(k * Math.PI / 24), Math.sin(k * Math.PI / 24)]);
      add(inside, "path", "", {class: "here ellipse", d: `M${ring.map(([c, s]) => `${x(e + c * ae + s * be)} ${y(n + c * an + s * bn)}`).join("L")}Z`});
    }
    add(inside, "circle", "", {class: "here", r: 6, cx: x(mixed(track.x, at)), cy: y(mixed(track.y, at))});
  }

  // Shows a part of the map that is `factor` as wide, with the place at fractions of its width and height where it is.
  function zoom(map, factor, across = 0.5, up = 0.5) {
    const [west, east, south, north] = map.view, [first, last] = map.whole, wide = east - west;
    const size = Math.min(Math.max(factor, (last - first) / MOST / wide), (last - first) / wide);
    move(map, west + across * wide * (1 - size), south + up * (north - south) * (1 - size), size);
  }

  // Zooms in about the place of the track that is nearest to the middle of what is shown.
  function closer(map) {
    const {track, view: [west, east, south, north]} = map, middle = [(west + east) / 2, (south + north) / 2];
    let best = middle, least = Infinity;
    track.x.forEach((x, k) => {
      const away = Math.hypot(x - middle[0], track.y[k] - middle[1]);
      if (away < least) [least, best] = [away, [x, track.y[k]]];
    });
    const within = v => v >= 0 && v <= 1 ? v : 0.5;
    zoom(map, 0.5, within((best[0] - west) / (east - west)), within((best[1] - south) / (north - south)));
  }

  // Shows the part with its south-western corner at a place, within the map.
  function move(map, west, south, size = 1) {
    const [a, b, c, d] = map.whole, wide = (map.view[1] - map.view[0]) * size, high = (map.view[3] - map.view[2]) * size;
    const left = Math.min(Math.max(west, a), b - wide), foot = Math.min(Math.max(south, c), d - high);
    map.view = wide >= (b - a) * (1 - 1e-9) ? map.whole : [left, left + wide, foot, foot + high];
    map.svg.style.touchAction = map.view === map.whole ? "pan-y" : "none";
    cancelAnimationFrame(map.due);
    map.due = requestAnimationFrame(() => draw(map));
  }

  const shift = (map, across, up) => move(map, map.view[0] + across * (map.view[1] - map.view[0]), map.view[2] + up * (map.view[3] - map.view[2]));
  const whole = map => { map.view = map.whole; move(map, map.whole[0], map.whole[2]); };

  const KEYS = {
    ArrowLeft: map => shift(map, -0.1, 0), ArrowRight: map => shift(map, 0.1, 0), ArrowUp: map => shift(map, 0, 0.1),
    ArrowDown: map => shift(map, 0, -0.1), "+": closer, "=": closer, "-": map => zoom(map, 2), Escape: whole,
  };

  // The command that opens the run beside the page in the viewer at the last instant of the cursor.
  async function command(map, button) {
    const folder = decodeURIComponent(location.pathname).replace(/\/[^/]*$/, "").replaceAll("'", "'\\''");
    await live.copyText(`sinssim view ${location.protocol === "file:" ? `'${folder}'` : "RUN"} --time ${Number((map.last ?? map.track.time[0]).toPrecision(7))}`);
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "3-D"; }, 1500);
  }

  function tools(map, place) {
    const row = document.createElement("div"), {figure} = map;
    row.className = "tools";
    for (const [name, title, act] of [["+", "Zoom in", () => closer(map)], ["\u2212", "Zoom out", () => zoom(map, 2)], ["whole", "Show the whole map", () => whole(map)],
                                      ["3-D", "3-D: copy the command that shows this instant in the viewer", button => command(map, button)]]) {
      const button = document.createElement("button");
      Object.assign(button, {type: "button", textContent: name, title, ariaLabel: title});
      button.addEventListener("click", () => act(button));
      row.append(button);
    }
    place.append(row);
    figure.tabIndex = 0;
    figure.setAttribute("role", "group");
    figure.setAttribute("aria-label", "Map: plus and minus zoom, arrow keys move the part shown, Escape shows all");
    figure.addEventListener("keydown", event => {
      if (event.target !== figure || event.ctrlKey || event.altKey || event.metaKey || !KEYS[event.key]) return;
      event.preventDefault();
      KEYS[event.key](map);
    });
  }

  function gestures(map) {
    const {svg, figure, box: [left, top, wide, high]} = map, fingers = new Map();
    const where = event => { // fractions of the map from its south-western corner
      const area = svg.getBoundingClientRect(), size = svg.viewBox.baseVal;
      return [((event.clientX - area.left) * size.width / area.width - left) / wide, 1 - ((event.clientY - area.top) * size.height / area.height - top) / high];
    };
    const middle = () => [0, 1].map(n => [...fingers.values()].reduce((sum, at) => sum + at[n], 0) / fingers.size);
    const apart = () => { const [a, b] = [...fingers.values()]; return Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 0.02); };
    svg.addEventListener("pointerdown", event => {
      figure.focus({preventScroll: true});
      fingers.set(event.pointerId, where(event));
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", event => {
      if (!fingers.has(event.pointerId)) return instant(map, where(event));
      const [before, wider] = [middle(), fingers.size > 1 ? apart() : 1];
      fingers.set(event.pointerId, where(event));
      const now = middle();
      if (fingers.size > 1) zoom(map, wider / apart(), ...now);
      shift(map, before[0] - now[0], before[1] - now[1]);
    });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, event => fingers.delete(event.pointerId));
    svg.addEventListener("pointerleave", () => { if (map.pointed) { map.pointed = false; point(null); } });
    svg.addEventListener("dblclick", () => whole(map));
    svg.addEventListener("wheel", event => {
      if (!event.ctrlKey && document.activeElement !== figure) return;
      event.preventDefault();
      zoom(map, Math.exp(event.deltaY / 400), ...where(event));
    }, {passive: false});
  }

  // Puts the cursor of the charts at the instant of the track near a place.
  function instant(map, [across, up]) {
    const {track, view: [west, east, south, north], box: [, , wide]} = map, e = west + across * (east - west), n = south + up * (north - south);
    let best = 0, least = Infinity;
    track.x.forEach((v, k) => {
      const away = Math.hypot(v - e, track.y[k] - n);
      if (away < least) [least, best] = [away, k];
    });
    const near = least * wide / (east - west) < NEAR;
    if (near || map.pointed) point(near ? track.time[best] : null);
    map.pointed = near;
  }

  addEventListener("DOMContentLoaded", () => {
    live.map = figure => begin(figure).catch(console.error); // the still picture stays
    document.querySelectorAll("figure.live_map").forEach(live.map);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => live.maps?.forEach(draw));
  });
})();
