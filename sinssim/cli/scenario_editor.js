// The text of a scenario: its mistakes beside the lines, and the keys, tables and values that can stand at the cursor.
"use strict";
const editor = (() => {
  const LINE = 20, PAD = 6, SIDE = 8; // px, as in the style
  const TOKEN = /#[^\n]*|"""[^]*?(?:"""|$)|'''[^]*?(?:'''|$)|"(?:\\.|[^"\\\n])*"?|'[^'\n]*'?|[\w.+:-]+|[[\]{},=\n]/g;
  const NUMBER = /^[+-]?(\d|inf|nan)/;
  const join = (path, name) => path ? `${path}.${name}` : name;
  const plain = text => text.replace(/^["']|["']$/g, "");

  // What is being written at a place of a TOML text: a "key", a "value" of a key or the name of a table, "header";
  // the table there with what it has, and where the word begins and ends. Null in a comment, and where nothing can be.
  function context(text, at) {
    const table = path => ({path, given: new Map(), key: "", awaits: "key"});
    let stack = [table("")], found, first = true; // first: whether the line has nothing yet
    const here = () => stack[stack.length - 1];
    const owner = () => stack.findLast(part => part.given);
    const note = (from, to) => {
      const {awaits, key} = here().given ? here() : {awaits: "value", key: here().key};
      found = awaits === "key" && key && from === to ? null : {kind: awaits, table: owner(), key, from, to};
    };
    const value = raw => {
      const part = here();
      if (part.given) part.given.set(part.key, raw);
    };
    TOKEN.lastIndex = 0;
    for (let token; (token = TOKEN.exec(text)) !== null;) {
      const [word] = token, from = token.index, to = TOKEN.lastIndex, part = here();
      if (found === undefined && at <= from) note(at, at);
      if (word[0] === "#") { if (found === undefined && at <= to) found = null; continue; }
      if (word === "\n") {
        first = true;
        if (stack.length === 1) Object.assign(part, {key: "", awaits: "key"});
        continue;
      }
      if (word === "[" && first && stack.length === 1) {
        const head = /\[{1,2}([^\]\n]*)\]{0,2}/y;
        head.lastIndex = from;
        const [whole, name] = head.exec(text), begin = from + whole.indexOf(name, 1);
        stack = [table(name.split(".").map(part => plain(part.trim())).join("."))];
        if (found === undefined && at <= from + whole.length)
          found = {kind: "header", table: here(), key: "", from, to: from + whole.length, word: text.slice(begin, Math.max(begin, at))};
        TOKEN.lastIndex = from + whole.length;
        first = false;
        continue;
      }
      first = false;
      if (word === "=") { part.awaits = "value"; value(""); }
      else if (word === "[") stack.push({path: part.given ? join(part.path, part.key) : part.path, key: part.key});
      else if (word === "{") stack.push(table(part.given ? join(part.path, part.key) : part.path));
      else if (word === "]" || word === "}") { if (stack.length > 1) stack.pop(); }
      else if (word === ",") { if (part.given) Object.assign(part, {key: "", awaits: "key"}); }
      else {
        const awaits = part.given ? part.awaits : "value";
        if (awaits === "key") part.key = plain(word); else value(plain(word));
        if (found === undefined && at <= to) note(from, to);
      }
    }
    if (found === undefined) note(at, at);
    if (found && found.word === undefined) found.word = text.slice(found.from, at);
    return found;
  }

  // The tables of the schema at a path: of several kinds, the one that the text says.
  function kinds(tables, path, given) {
    const there = tables.filter(table => table.path === path), said = given.get("type") ?? given.get("on");
    const right = there.filter(table => said && table.tag === said);
    return right.length ? right : there;
  }

  // What can stand at a place: {label, insert, chosen: [from, to] in insert, unit, default, about}.
  function offers(tables, text, at) {
    const place = context(text, at);
    if (!place) return {place, items: []};
    if (place.kind === "header") {
      const names = new Map(tables.filter(table => table.path).map(table => [table.path, table]));
      return {place, items: [...names.values()].map(table => header(table)).filter(item => item.label.startsWith(place.word.trim()))};
    }
    const dots = place.kind === "key" ? place.word.split(".").slice(0, -1).map(plain) : place.key.split(".").slice(0, -1);
    const path = [place.table.path, ...dots].filter(Boolean).join(".");
    const here = kinds(tables, path, dots.length ? new Map() : place.table.given);
    const keys = new Map(here.flatMap(table => table.keys).reverse().map(key => [key.name, key]));
    if (place.kind === "value") {
      const tags = here.filter(table => table.tag).map(table => `"${table.tag}"`), name = place.key.split(".").pop();
      const all = ["type", "on"].includes(name) && tables.filter(table => table.path === path && table.tag);
      const values = all && all.length ? all.map(table => ({label: `"${table.tag}"`, about: table.about}))
        : (keys.get(name)?.values ?? tags).map(label => ({label, about: keys.get(name)?.about ?? ""}));
      return {place, items: values.filter(({label}) => label.startsWith(place.word) || label.startsWith(`"${place.word}`))
        .map(value => ({unit: "", default: "", ...value, insert: value.label}))};
    }
    const word = place.word.split(".").pop(), before = dots.map(name => `${name}.`).join("");
    const there = /^\s*=/.test(text.slice(place.to));
    const found = [...keys.values()].reverse().filter(key => !place.table.given.has(before + key.name) || before + key.name === place.word)
      .map(key => ({...written(key, before, there), unit: key.unit, default: key.required ? "required" : key.default ?? "", about: key.about}));
    const inner = new Map(tables.filter(table => table.path.startsWith(join(path, "")) && !table.path.slice(join(path, "").length).includes("."))
      .filter(table => table.path).map(table => [table.path, table]));
    const atTop = place.table.path === "" || !text.slice(text.lastIndexOf("\n", at - 1) + 1, place.from).trim();
    const more = [...inner.values()].filter(table => !dots.length && !place.table.given.has(table.path.split(".").pop()))
      .map(table => ({...header(table), label: table.path.split(".").pop(), whole: atTop}));
    return {place, items: [...found, ...more].filter(item => item.label.startsWith(before + word) || item.label.startsWith(word))};
  }

  const header = table => ({label: table.path, insert: table.array ? `[[${table.path}]]` : `[${table.path}]`, unit: "",
                            default: table.array ? "tables" : "table", about: table.about});

  function written(key, before, there) {
    const name = before + key.name;
    if (there) return {label: key.name, insert: name};
    const first = key.default ?? (key.values[0] && key.kind !== "array" ? key.values[0] : {string: '""', array: "[]"}[key.kind] ?? "");
    const start = name.length + 3, inner = /^["[]/.test(first) ? 1 : 0;
    return {label: key.name, insert: `${name} = ${first}`, chosen: [start + inner, start + first.length - inner]};
  }

  // The parts of a line: its text in spans of their kinds.
  function painted(line) {
    const row = document.createElement("div");
    const add = (text, kind) => {
      if (!kind) { row.append(text); return; }
      const span = document.createElement("span");
      span.className = kind;
      span.textContent = text;
      row.append(span);
    };
    if (/^\s*\[/.test(line) && !line.includes("=")) { add(line, "t-head"); return row; }
    let end = 0;
    for (const found of line.matchAll(TOKEN)) {
      const [word] = found, from = found.index;
      if (from > end) add(line.slice(end, from));
      end = from + word.length;
      const key = /^\s*=/.test(line.slice(end));
      add(word, word[0] === "#" ? "t-note" : /^["']/.test(word) ? "t-text" : key ? "t-key" : "");
    }
    add(line.slice(end));
    return row;
  }

  // Makes an editor of the page's parts; `changed` is called after each change of the text.
  function make(root, changed) {
    const [numbers, back, area] = [".numbers", ".back", "textarea"].map(name => root.querySelector(name));
    const box = root.querySelector(".choices"), list = box.querySelector("ul"), about = box.querySelector("p");
    let mistakes = [], tables = [], items = [], place = null, chosen = 0, letter = 0;

    function draw() {
      const lines = area.value.split("\n"), by = new Map();
      for (const {line, text} of mistakes) by.set(line, [...(by.get(line) ?? []), text]);
      numbers.textContent = lines.map((_, k) => k + 1).join("\n");
      back.replaceChildren(...lines.map((line, k) => {
        const row = painted(line), wrong = by.get(k + 1);
        if (wrong) {
          const remark = document.createElement("span");
          remark.className = "remark";
          remark.textContent = wrong.join(" · ").replaceAll("\n", " ");
          row.classList.add("bad");
          row.append(remark);
        }
        return row;
      }));
      follow();
    }

    function follow() {
      back.scrollTo(area.scrollLeft, area.scrollTop);
      numbers.scrollTo(0, area.scrollTop);
      for (const row of back.children) row.style.transform = ""; // a wider text than the back: scrolled below
      if (back.scrollLeft !== area.scrollLeft || back.scrollTop !== area.scrollTop)
        for (const row of back.children) row.style.transform = `translate(${back.scrollLeft - area.scrollLeft}px, ${back.scrollTop - area.scrollTop}px)`;
    }

    function close() {
      box.hidden = true;
      items = [];
      area.removeAttribute("aria-activedescendant");
      area.removeAttribute("aria-controls");
    }

    function choose(k) {
      chosen = (k + items.length) % items.length;
      [...list.children].forEach((entry, number) => entry.setAttribute("aria-selected", number === chosen));
      list.children[chosen].scrollIntoView({block: "nearest"});
      area.setAttribute("aria-activedescendant", list.children[chosen].id);
      about.textContent = items[chosen].about;
    }

    function open(asked) {
      ({items, place} = offers(tables, area.value, area.selectionStart));
      const word = place?.word ?? "";
      if (items.length === 1 && items[0].insert === word) items = [];
      if (!asked && !(word || place?.kind === "value" && /[=[,] $/.test(area.value.slice(0, place.from)))) items = [];
      items = items.slice(0, 300);
      if (!items.length || area.selectionStart !== area.selectionEnd) { close(); return; }
      list.replaceChildren(...items.map((item, k) => {
        const entry = document.createElement("li");
        for (const part of [item.label, item.unit, item.default]) {
          const span = document.createElement("span");
          span.textContent = part;
          entry.append(span);
        }
        Object.assign(entry, {id: `choice-${k}`, role: "option"});
        entry.setAttribute("role", "option");
        entry.addEventListener("mousedown", event => { event.preventDefault(); choose(k); take(); });
        return entry;
      }));
      area.setAttribute("aria-controls", list.id);
      box.hidden = false;
      letter ||= measure();
      const before = area.value.slice(0, place.from).split("\n"), column = before.at(-1).replaceAll("\t", "    ").length;
      const left = SIDE + column * letter - area.scrollLeft, top = PAD + before.length * LINE - area.scrollTop;
      box.style.left = `${Math.max(0, Math.min(left, area.clientWidth - box.offsetWidth))}px`;
      box.style.top = `${top + 2}px`;
      choose(0);
    }

    function measure() {
      const probe = back.appendChild(document.createElement("span"));
      probe.textContent = "0".repeat(100);
      const wide = probe.getBoundingClientRect().width / 100;
      probe.remove();
      return wide;
    }

    function take() {
      const item = items[chosen], {value} = area;
      let {from, to} = place;
      if (item.whole) from = value.lastIndexOf("\n", from - 1) + 1;
      const inline = item.insert[0] === "[" && !item.whole && place.kind === "key";
      const text = inline ? `${item.label} = { ` : item.insert, picked = inline ? null : item.chosen;
      close();
      area.focus();
      area.setSelectionRange(from, to);
      document.execCommand("insertText", false, text); // keeps what can be undone
      if (picked) area.setSelectionRange(from + picked[0], from + picked[1]);
      close();
    }

    area.addEventListener("input", () => { draw(); changed(); open(false); });
    area.addEventListener("scroll", () => { follow(); close(); });
    area.addEventListener("blur", close);
    area.addEventListener("click", close);
    area.addEventListener("keydown", event => {
      if (event.key === " " && event.ctrlKey) { event.preventDefault(); open(true); return; }
      if (box.hidden) return;
      const steps = {ArrowDown: 1, ArrowUp: -1, PageDown: 8, PageUp: -8};
      if (event.key in steps) choose(chosen + steps[event.key]);
      else if (event.key === "Enter" || event.key === "Tab") take();
      else { if (event.key === "Escape" || /^(Arrow|Home|End)/.test(event.key)) close(); return; }
      event.preventDefault();
    });

    return {
      get text() { return area.value; },
      set text(value) { area.value = value; mistakes = []; draw(); area.setSelectionRange(0, 0); area.scrollTo(0, 0); close(); },
      set mistakes(found) { mistakes = found; draw(); },
      set tables(found) { tables = found; },
      go(line) {
        const at = area.value.split("\n").slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
        area.focus();
        area.setSelectionRange(at, at);
        area.scrollTop = Math.max(0, (line - 4) * LINE);
      },
    };
  }

  return {make, offers, context};
})();
