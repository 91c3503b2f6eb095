// What if a source were larger or smaller in all cells of a trade study: sliders of the sources, and the quantities and
// requirements of every cell, which follow here from the parts of its sources as its budget computes them.
"use strict";
(() => {
  const LEAST = -2, MOST = 2, KNOT = 1852 / 3600; // powers of ten of the sliders
  const {radius} = live.circles;
  const four = v => v === null || !Number.isFinite(v) ? "\u2013" : String(Number(v.toPrecision(4))).replace("-", "\u2212");
  const twelve = v => Number(v.toPrecision(12));

  const {add} = live;

  async function begin(place) {
    const given = JSON.parse(place.dataset.live), arrays = await live.unpack(given), factors = {};
    let next = 0;
    for (const cell of given.cells) {
      cell.parts = cell.sources.map(([name, value, random]) => ({name, value, random, of: given.quantities.map(() => arrays[next++])}));
    }
    for (const {name} of given.sources) factors[name] = 1;
    const view = {place, given, factors, rows: {}};
    place.textContent = "";
    add(place, "p", "A slider changes a source in all cells, as --set would in each: a factor of its size there. Linear theory leaves out products of "
      + "errors, limits of the sensors, the gate of a filter and failures. "
      + (given.quantities.some(quantity => quantity.some) ? "The largest value of a run is that of 41 instants. " : "")
      + (given.filter ? `The gains of the filter stay those of each cell; a filter that knows the change performs as well or better. Running the study again takes ${four(given.seconds)} s for each cell.` : ""),
      {class: "note"});
    view.now = add(place, "p", "", {class: "lead", "aria-live": "polite"});
    sliders(view);
    const row = add(place, "p");
    add(row, "button", "As computed", {type: "button"}).addEventListener("click", () => { for (const name in factors) factors[name] = 1; change(view); });
    add(row, "button", "Command", {type: "button"}).addEventListener("click", () => { view.said.textContent = command(view); });
    view.said = add(place, "pre", "", {class: "said-here", "aria-live": "polite"});
    cells(view);
    read(view);
    addEventListener("hashchange", () => read(view));
    live.tradeWhatIf = {view, values: () => given.cells.map(cell => value(view, cell)), command: () => command(view)};
  }

  // The values of a source in the cells: one number if all have the same.
  function sizes({given}, name) {
    const values = given.cells.flatMap(cell => cell.parts.filter(part => part.name === name && part.value).map(part => part.value));
    return [...new Set(values)];
  }

  function sliders(view) {
    const {given, factors, place} = view, table = add(add(place, "div", "", {class: "wide"}), "table");
    const heads = add(add(table, "thead"), "tr"), body = add(table, "tbody");
    ["source", "smaller \u2026 larger", "factor", "value in the cells"].forEach((head, n) => add(heads, "th", head, n % 3 ? {} : {class: "name"}));
    for (const {name, label, unit} of given.sources) {
      const values = sizes(view, name), row = add(body, "tr");
      if (!values.length) { row.remove(); continue; }
      add(row, "td", label, {class: "name"});
      const range = add(add(row, "td"), "input", "", {type: "range", min: LEAST, max: MOST, step: 0.01, "aria-label": `${label}, power of ten`});
      const field = add(add(row, "td"), "input", "", {type: "number", min: 0, step: "any", "aria-label": `${label}, factor`});
      view.rows[name] = {range, field, values, unit, cell: add(row, "td", "", {class: "name"})};
      range.addEventListener("input", () => { factors[name] = Number((10 ** Number(range.value)).toPrecision(3)); change(view); });
      field.addEventListener("change", () => {
        if (field.value !== "" && Number(field.value) >= 0) factors[name] = Number(field.value);
        change(view);
      });
    }
  }

  function cells(view) {
    const {given, place} = view, table = add(add(place, "div", "", {class: "wide several_list", tabindex: 0, role: "group", "aria-label": "Cells"}), "table");
    const heads = add(add(table, "thead"), "tr");
    add(heads, "th", "cell", {class: "name"});
    for (const {label, unit} of given.quantities) for (const head of ["", ", as computed"]) add(heads, "th", `${label} [${unit}]${head}`);
    for (const {text} of given.requirements) add(heads, "th", text, {class: "name"});
    const body = add(table, "tbody");
    view.lines = given.cells.map(cell => {
      const row = add(body, "tr");
      add(row, "td", cell.name, {class: "name"});
      const now = given.quantities.map(({size}, n) => {
        const field = add(row, "td");
        add(row, "td", four(cell.computed[n] / size));
        return field;
      });
      return {now, verdicts: given.requirements.map(() => add(row, "td", "", {class: "name"}))};
    });
  }

  // The quantities of a cell with the factors, SI, rates in nmi/h.
  function value({given, factors}, cell) {
    return given.quantities.map(({share, rate}, n) => {
      const found = cell.times[n].map((time, row) => {
        const sum = {nn: 0, ne: 0, ee: 0, n: 0, e: 0};
        let [squares, mean] = [0, 0];
        for (const {name, random, of} of cell.parts) {
          const f = factors[name], part = of[n];
          if (!share) { if (random) squares += f * f * part[row]; else mean += f * part[row]; }
          else if (random) ["nn", "ne", "ee"].forEach((key, k) => { sum[key] += f * f * part[3 * row + k]; });
          else ["n", "e"].forEach((key, k) => { sum[key] += f * part[2 * row + k]; });
        }
        if (!share) return Math.sqrt(Math.max(squares, 0) + mean * mean);
        return rate ? radius(sum, share) / time / KNOT : radius(sum, share);
      });
      return found.reduce((most, v) => v > most ? v : most, 0);
    });
  }

  function change(view, keep = true) {
    const {given, factors} = view;
    if (keep) live.keep(Object.fromEntries(given.sources.map(({name}) => [name, factors[name] === 1 ? null : `x${twelve(factors[name])}`])));
    for (const [name, {range, field, values, unit, cell}] of Object.entries(view.rows)) {
      range.value = Math.log10(Math.max(factors[name], 10 ** LEAST));
      field.value = factors[name];
      const ends = [Math.min(...values), Math.max(...values)].map(v => four(v * factors[name]));
      cell.textContent = `${ends[0] === ends[1] ? ends[0] : ends.join(" \u2026 ")} ${unit}`;
    }
    let met = 0;
    given.cells.forEach((cell, k) => {
      const now = value(view, cell), verdicts = given.requirements.map(({quantity, limit}) => now[quantity] <= limit);
      met += verdicts.every(Boolean);
      now.forEach((v, n) => { view.lines[k].now[n].textContent = four(v / given.quantities[n].size); });
      verdicts.forEach((is, n) => {
        const field = view.lines[k].verdicts[n];
        [field.textContent, field.className] = [is ? "met" : "not met", `name ${is ? "met" : "missed"}`];
      });
    });
    view.now.textContent = given.requirements.length ? `${met} of ${given.cells.length} cells meet ${given.requirements.map(({text}) => text).join(" and ")}.` : "";
  }

  function read(view) {
    for (const name in view.factors) {
      const wanted = Number((live.kept(name) ?? "x1").slice(1));
      view.factors[name] = wanted >= 0 && Number.isFinite(wanted) ? wanted : 1;
    }
    change(view, false);
  }

  // The command that computes this setting; a source that differs between the cells has no single key.
  function command(view) {
    const {given, factors} = view, changed = given.sources.filter(({name}) => factors[name] !== 1), sets = [], left = [];
    for (const {name, key} of changed) {
      const values = sizes(view, name);
      if (key && values.length === 1) sets.push(`--set '${key}=${twelve(values[0] * factors[name])}'`); else left.push(name);
    }
    return ["sinssim compare study.toml -o again", ...sets].join(" ")
      + (left.length ? `\n# ${left.join(", ")}: not the same in all cells, or without a single key; change the values of the axes` : "");
  }

  live.parts.trade_what_if = begin;
})();
