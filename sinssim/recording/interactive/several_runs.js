// Several runs on the same axes: a check box for each curve in the table of the runs draws it or takes it away, a field
// shows the rows with a word, and a table has the keys in which the chosen scenarios differ.
"use strict";
(() => {
  const KEYS = 200, COLUMNS = 12; // most rows and columns of the table of keys

  const {add} = live;

  async function begin(place) {
    const plain = JSON.parse(place.dataset.live), arrays = await live.unpack(plain);
    const view = {...JSON.parse(await live.inflate(plain.packed).text()), arrays, place};
    view.curves = view.entries.flatMap((entry, row) => entry.curves.map(curve => ({...curve, row, label: `${entry.label}: ${curve.name}`})));
    await charts(view);
    const stored = live.kept("runs");
    if (stored !== null) view.curves.forEach((curve, k) => { curve.shown = stored.split(" ").includes(String(k)); });
    list(view);
    for (let part = place.previousElementSibling; part && part.tagName !== "H2"; part = part.previousElementSibling) part.hidden = true;
    place.textContent = "";
    view.keyTable = add(place, "div", "", {"aria-live": "polite"});
    if (stored === null) keys(view); else change(view);
    live.severalRuns = view;
  }

  // The figures of the quantities, and the curves that they have at first, in SI.
  async function charts(view) {
    view.figures = [];
    for (const figure of document.querySelectorAll("figure.live")) {
      const chart = JSON.parse(figure.dataset.chart), quantity = /^several\/(\w+)$/.exec(chart.key)?.[1];
      if (!quantity) continue;
      view.figures.push({figure, chart, quantity});
      const own = await live.unpack(chart);
      for (const {name, x, y} of chart.curves) {
        const curve = view.curves.find(one => one.label === name.replace(/ \(same as .*$/, ""));
        curve.of[quantity] = [own[x].map(v => v * chart.x.size), own[y].map(v => v === null ? null : v * chart.y.size)];
      }
    }
    for (const curve of view.curves) {
      for (const [quantity, of] of Object.entries(curve.of)) {
        if (typeof of[0] === "number") curve.of[quantity] = of.map(k => view.arrays[k]);
      }
    }
  }

  // Check boxes in the last column of the table of the runs, and a field that leaves the rows with a word.
  function list(view) {
    const table = [...document.querySelectorAll("table")].find(one => one.querySelector("th:last-child")?.textContent === "curves");
    const rows = [...table.tBodies[0].rows], tools = document.createElement("div"), box = table.parentNode;
    tools.className = "several_tools";
    box.before(tools);
    box.classList.add("several_list");
    box.tabIndex = 0;
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", "Runs, with a check box for each curve");
    const label = add(tools, "label", "Only rows with "), field = add(label, "input", "", {type: "search"});
    view.count = add(tools, "output", "", {"aria-live": "polite"});
    field.addEventListener("input", () => {
      const word = field.value.toLowerCase();
      rows.forEach(row => { row.hidden = !row.textContent.toLowerCase().includes(word); });
    });
    for (const [name, act] of [["Draw the headline curves of these rows", row => row.curves.length], ["Draw none", () => 0]]) {
      add(tools, "button", name, {type: "button"}).addEventListener("click", () => {
        let count = 0;
        view.entries.forEach((entry, k) => {
          if (act(entry) && rows[k].hidden) return;
          const some = view.curves.filter(curve => curve.row === k), first = some.filter(curve => curve.headline);
          for (const curve of some) curve.shown = act(entry) > 0 && (first.length ? first : some.slice(0, 1)).includes(curve) && count++ < 200;
        });
        change(view);
      });
    }
    view.entries.forEach((entry, k) => {
      const cells = rows[k].cells, cell = cells[cells.length - 1];
      if (entry.report) {
        const name = cells[0], swatch = name.querySelector(".swatch"), link = document.createElement("a");
        [link.textContent, link.href] = [name.textContent, entry.report];
        swatch?.remove();
        name.replaceChildren(link);
      }
      const some = view.curves.filter(curve => curve.row === k);
      if (some.length) cell.textContent = "";
      for (const curve of some) {
        const line = add(cell, "label"), input = add(line, "input", "", {type: "checkbox", "aria-label": curve.label});
        curve.swatch = add(line, "span", "", {class: "swatch"});
        line.append(curve.name);
        curve.input = input;
        input.addEventListener("change", () => { curve.shown = input.checked; change(view); });
      }
    });
    mark(view);
  }

  // The colours of the drawn curves: each keeps its own, a new one takes the first that is free.
  function mark(view) {
    const {curves, palette} = view, used = new Set();
    for (const curve of curves) {
      if (!curve.shown) curve.color = null;
      else if (curve.color) used.add(curve.color);
    }
    for (const curve of curves.filter(one => one.shown && !one.color)) {
      curve.color = palette.find(color => !used.has(color)) ?? palette[used.size % palette.length];
      used.add(curve.color);
    }
    for (const {input, shown, swatch, color} of curves) {
      if (!input) continue;
      input.checked = shown;
      swatch.style.background = color ?? "none";
    }
    const count = curves.filter(curve => curve.shown).length;
    view.count.textContent = `${count} of ${curves.length} curves are drawn.`;
  }

  function change(view) {
    mark(view);
    live.keep({runs: view.curves.flatMap((curve, k) => curve.shown ? [k] : []).join(" ")});
    for (const {figure, chart, quantity} of view.figures) live.replace(figure, drawing(view, figure.chart ?? chart, chart, quantity));
    other(view);
    keys(view);
  }

  const largest = rows => rows.reduce((most, v) => v > most ? v : most, 0);
  const unit = (scale, most) => scale.find(([, , end]) => end === null || most <= end);

  // A chart of the page with the chosen curves, in the units that suit them.
  function drawing(view, now, chart, quantity) {
    const some = view.curves.filter(curve => curve.shown && curve.of[quantity]), seen = some.filter(({of}) => of[quantity][0].length);
    const starts = seen.map(({of}) => of[quantity][0][0]), ends = seen.map(({of}) => of[quantity][0].at(-1));
    const span = seen.length ? [Math.min(...starts), Math.max(...ends)] : chart.x.ends.map(v => v * chart.x.size);
    const most = Math.max(0, ...seen.map(({of}) => largest(of[quantity][1])));
    const [xName, xSize] = unit(view.times, span[1] - span[0]), [yName, ySize] = seen.length ? unit(view.scales[quantity], most) : [chart.y.unit, chart.y.size];
    const arrays = [], index = new Map();
    const scaled = (rows, size) => {
      if (!index.has(rows)) index.set(rows, arrays.push(rows.map(v => v === null ? null : v / size)) - 1);
      return index.get(rows);
    };
    const curves = some.map(curve => ({name: curve.label, color: curve.color, x: scaled(curve.of[quantity][0], xSize),
      y: scaled(curve.of[quantity][1], ySize), width: 1.6, dash: curve.dash, dots: 0, turns: false}));
    if (!curves.length) curves.push({name: "", color: "--line", x: arrays.push(span.map(v => v / xSize)) - 1,
      y: arrays.push([null, null]) - 1, width: 1, dash: [], dots: 0, turns: false});
    return {...chart, arrays, curves, own: now.own, kept: {step: Math.max(0, ...some.map(curve => curve.step)), dots: 1},
      x: {...chart.x, unit: xName, size: xSize, ends: span.map(v => v / xSize)},
      y: {...chart.y, unit: yName, size: ySize, ends: [0, 1.05 * (most || ySize) / ySize], log: false}};
  }

  // In the other charts of the page, the curve that has the name of a run follows its check boxes.
  function other(view) {
    for (const {plot, options, key} of live.drawn) {
      if (key.startsWith("several/")) continue;
      options.forEach((curve, k) => {
        const row = view.entries.findIndex(entry => entry.label === curve.label.replace(/ \(same as .*$/, ""));
        if (row >= 0) plot.setSeries(k + 1, {show: view.curves.some(one => one.row === row && one.shown)});
      });
    }
  }

  function keys(view) {
    const all = [...new Set(view.curves.filter(curve => curve.shown).map(curve => curve.row))], rows = all.slice(0, COLUMNS);
    const lines = Object.entries(view.keys).map(([key, values]) => {
      const texts = rows.map(row => Object.entries(values).find(([, of]) => of.includes(row))?.[0] ?? "\u2013");
      return [key, ...texts];
    }).filter(([, first, ...rest]) => rest.some(text => text !== first));
    const {keyTable} = view;
    keyTable.textContent = "";
    if (!lines.length) return void add(keyTable, "p", rows.length > 1 ? "The scenarios are the same." : "Keys differ between two runs or more.");
    const table = add(add(keyTable, "div", "", {class: "wide several_list", tabindex: 0, role: "group", "aria-label": "Keys that differ"}), "table");
    const head = add(add(table, "thead"), "tr"), body = add(table, "tbody");
    for (const name of ["key", ...rows.map(row => view.entries[row].label)]) add(head, "th", name, {class: "name"});
    for (const line of lines.slice(0, KEYS)) {
      const row = add(body, "tr");
      for (const text of line) add(row, "td", text, {class: "name"});
    }
    const more = [lines.length > KEYS ? `${lines.length - KEYS} more keys differ` : "", all.length > COLUMNS ? `${all.length - COLUMNS} more runs are drawn` : ""];
    if (more.some(Boolean)) add(keyTable, "p", `${more.filter(Boolean).join("; ")}.`, {class: "note"});
  }

  live.draws.push(() => { if (live.severalRuns) other(live.severalRuns); });
  live.parts.several_runs = begin;
})();
