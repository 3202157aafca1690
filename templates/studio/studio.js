// The page: tools, keys, requests. The document lives here; the server computes functions of it.

import { History, check, decoded, emptyDocument, textWithout } from "./document.js";
import { View, paint, paintBase } from "./drawing.js";
import { listen, watchPen } from "./pointer.js";
import { Server, lined, sentence, trouble } from "./server.js";
import { LAMP_AT, leaning, mirrored, paintSurface, reachOf, tipOf } from "./shading.js";
import { clipped, erased, fitShift, isClosed, moved, reflected, rounded, strokeAt, strokesIn, withReflection } from "./strokes.js";

const $ = selector => document.querySelector(selector), all = selector => [...document.querySelectorAll(selector)];
const page = crypto.randomUUID(), KEPT = "crossfield-studio", PARTS = ["file", "picture", "source"];
const REACH = 9, FINGER = 18, STILL = 4, PASTED = 16; // pixels of the screen: near a stroke, also for a finger; in a click; between copies
const state = {
  history: new History(emptyDocument()), doc: null, chosen: new Set(), tool: "draw", mark: "cut", preset: true, next: "outline", live: null, brush: null, edit: 0,
  field: null, lines: null, surface: null, mode: "crosses", kind: "shaded", lamp: LAMP_AT, suspects: new Set(),
  copied: [], fingers: null, // whether fingers draw; null: until a pen comes
  spot: null, // a place that a message names
};
state.doc = state.history.now;
const left = new View($("#drawing"), () => refresh()), right = new View($("#surface"), () => refresh());
let dirty = false, asked = false;

// Painting: at most once per frame.
function refresh(base = true) {
  dirty ||= base;
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    const seen = { ...state, doc: state.live?.shift ? shifted(state.live) : state.doc };
    if (dirty) paintBase(left, { ...seen, picture: picture(), opacity: Number($("#opacity").value) });
    dirty = false;
    paint(left, seen);
    paintSurface(right, { ...state, frame: state.surface?.frame ?? state.field?.frame, strokes: $("#ink").checked ? state.doc.strokes : [], hints: state.doc.hints, live: state.arrow });
  });
}

// Messages.
let bannerKind = "";
function banner(text, { kind = "error", retry = false } = {}) {
  bannerKind = text ? kind : ""; $("#banner").hidden = !text; $("#banner span").replaceChildren(...placed(text)); $("#retry").hidden = !retry;
}
/** A text as nodes: coordinates are buttons that mark their place on both pictures. */
function placed(text) {
  state.spot = null; // the button that showed it may be gone
  const number = "-?[\\d.]+(?:e[+-]?\\d+)?", show = spot => () => { state.spot = spot; refresh(false); };
  return text.split(new RegExp(`(\\(${number}, ${number}\\))`)).map((part, k) => {
    if (k % 2 === 0) return part;
    const made = action(part, event => event.target.focus()), spot = part.match(new RegExp(number, "g")).map(Number);
    made.className = "place"; made.title = "Show this place"; made.ariaLabel = `Show the place ${part}`;
    for (const [kind, shown] of Object.entries({ pointerenter: spot, focus: spot, pointerleave: null, blur: null })) made.addEventListener(kind, show(shown));
    return made;
  });
}
const clear = kind => { if (bannerKind === kind) banner(""); };
const status = text => { $("#status").textContent = text; };
function ready(text) { status(text); document.documentElement.dataset.state = "ready"; }

// Documents.
function show(doc, { compute = true } = {}) {
  if (doc.page !== state.doc.page) {
    forget(); left.fit(pageBox(doc)); right.zoomed = false;
    doc.strokes.length ? presetLine() : presetCut();
  }
  state.doc = doc; state.chosen = new Set([...state.chosen].filter(k => k < doc.strokes.length));
  if (state.tool === "turn" && !doc.file) state.tool = "draw";
  controls(); refresh();
  if (compute) request();
}
function commit(change) {
  const next = typeof change === "function" ? change(state.history.now) : { ...state.history.now, ...change };
  state.history.commit(next); keep(); show(next);
}
function step(by) {
  if (!state.history.step(by)) return;
  if (!state.history.now.strokes.length) presetCut();
  state.chosen.clear(); keep(); show(state.history.now);
}
/** Shows another drawing that is in a file. Undo brings the present one back, unless it is empty. */
function replace(doc) {
  if (!state.history.now.strokes.length) state.history.at -= 1;
  state.history.saved.add(doc); state.chosen.clear(); commit(() => doc);
}
const forget = () => { state.field = state.lines = state.surface = state.arrow = null; state.suspects = new Set(); doubts(); };
/** A page in the shape of the canvas. */
const canvasPage = () => [0, 0, 800, Math.round(800 * left.high / left.wide)];
/** The pen begins with the outline. Once that is there, it goes on to curvature lines, unless its kind was chosen. */
const presetCut = () => { state.mark = "cut"; state.preset = true; };
function presetLine() { if (state.preset) state.mark = "line"; state.preset = false; }
const pageBox = ({ page: [x, y, w, h] }) => [x, y, x + w, y + h];
/** The decoded picture under the strokes; it is painted again once it is decoded. */
const under = { source: null, image: null };
function picture() {
  const { picture: source } = state.doc;
  if (source !== under.source) {
    Object.assign(under, { source, image: null });
    if (source) createImageBitmap(new Blob([decoded.bytes(source)], { type: "image/jpeg" })).then(image => {
      if (source === under.source) { under.image = image; refresh(); }
    }, () => banner("The picture under the strokes cannot be shown. Open its file again.", { kind: "picture" }));
  }
  return under.image;
}
const isSaved = () => state.history.saved.has(state.history.now);

// What survives a reload of the page. The large parts change rarely: they are stored apart. Computing needs the source of unchanged strokes.
const strokesOf = new WeakMap();
const computable = doc => {
  const { source } = doc, changed = strokesOf.has(source) && strokesOf.get(source) !== doc.strokes;
  return textWithout(doc, ["file", "picture", ...changed ? ["source"] : []]);
};
const stored = new Map();
function store(name, value, text = String) {
  if (stored.has(name) && stored.get(name) === value) return true;
  stored.delete(name); sessionStorage.removeItem(name);
  try { if (value) sessionStorage.setItem(name, text(value)); stored.set(name, value); return true; } catch { return false; }
}
function keep() {
  const { now } = state.history, whole = PARTS.map(part => store(`${KEPT}-${part}`, now[part], JSON.stringify)).every(Boolean);
  store(`${KEPT}-at`, location.pathname); store(`${KEPT}-saved`, isSaved() && "yes");
  if (!store(KEPT, now, doc => textWithout(doc, PARTS))) banner("This drawing is too large to survive a reload of this page. Save it as a file.", { kind: "large" });
  else if (!whole) banner("A reload of this page keeps the strokes, but not the picture or file that they come from, which is too large. Save the drawing.", { kind: "large" });
}
addEventListener("pagehide", () => { for (let most = 256; most && !store(`${KEPT}-past`, state.history.pack(most, PARTS)); most >>= 1); });
function kept() {
  try {
    const text = sessionStorage.getItem(KEPT), parts = PARTS.map(part => [part, JSON.parse(sessionStorage.getItem(`${KEPT}-${part}`))]);
    return text && check({ ...JSON.parse(text), ...Object.fromEntries(parts.filter(([, value]) => value)) });
  } catch (error) {
    banner(`The drawing that this tab kept cannot be shown: ${error.message}. The next change replaces it.`, { kind: "kept" });
    return null;
  }
}

// Requests. A newer edit aborts older ones, here and on the server.
const SLOW = 20000; // milliseconds
let waiting = null, begun = 0;
const server = new Server({ back: () => request(), lost() {
  waiting?.abort();
  banner("The server does not answer. Your drawing is safe here, and this page goes on when the server is back. If “crossfield studio” has ended, save the drawing, start it again, and open the saved file at the new address that it prints.", { kind: "lost", retry: true });
  ready("No server.");
} });
async function request() {
  waiting?.abort();
  const doc = state.doc, edit = ++state.edit;
  document.documentElement.dataset.state = "busy"; begun = performance.now(); state.first = true;
  const hasLine = doc.strokes.some(stroke => stroke.mark === "line");
  if (!hasLine) { forget(); $("#times").textContent = ""; $("#numbers").replaceChildren(); clear("error"); refresh(); }
  waiting = new AbortController(); status("Computing …");
  const wanted = new URLSearchParams({ page, edit, size: doc.size });
  if (state.mode === "lines") wanted.set("lines", 1);
  const slow = setTimeout(() => { if (!bannerKind) banner(`Field and surface are not ready after ${SLOW / 1000} seconds. Wait, choose a smaller size, or try again.`, { kind: "slow", retry: true }); }, SLOW);
  try {
    await server.ask(`${hasLine ? "compute" : "next"}?${wanted}`, { method: "POST", body: computable(doc), signal: waiting.signal }, async response => {
      clear("lost");
      if (!response.ok) { banner(await trouble(response)); ready(""); return; }
      if (!hasLine) { take({ stage: "next", ...await response.json() }); return; }
      let last = null;
      for await (const found of lined(response)) { last = found.stage; if (edit === state.edit) take(found); }
      if (edit === state.edit && !["done", "error", "overtaken"].includes(last)) server.miss(); // it was stopped while it computed
    });
  } catch { /* a newer edit, or the server is lost, which is shown */ } finally { clearTimeout(slow); if (edit === state.edit) clear("slow"); }
}
const seconds = () => `${((performance.now() - begun) / 1000).toFixed(2)} s`;
const numbered = mask => { let n = 0; return Int32Array.from(mask, inside => inside ? n++ : -1); };
function take(found) {
  if (found.stage === "error") { forget(); banner(sentence(found.message)); refresh(); ready(""); return; }
  if (found.stage === "overtaken") return;
  if (found.stage === "next") proceed(found.next);
  if (found.stage === "next" || found.stage === "done") { ready(""); return; }
  const times = $("#times").dataset;
  if (found.stage === "field") {
    clear("error");
    state.field = { ...found, kinds: decoded.bytes(found.kinds), u: decoded.floats(found.u), v: decoded.floats(found.v), number: numbered(decoded.bytes(found.mask)) };
    state.lines = null; if (state.first) { state.first = false; times.field = seconds(); times.fine = times.lines = times.surface = ""; } else times.fine = seconds();
    const { x, y, pixel, rows, columns } = found.frame;
    right.box = [x, y, x + pixel * columns, y + pixel * rows];
    if (!right.zoomed) zoom(right, 0);
    numbers(found); proceed(found.next);
  } else if (found.stage === "lines") { state.lines = found.families; times.lines = seconds(); }
  else if (found.stage === "surface") {
    state.surface = { ...found, frame: state.field.frame, normals: decoded.shorts(found.normals), opacity: decoded.bytes(found.opacity) };
    times.surface = seconds(); doubts();
  }
  $("#times").textContent = Object.entries({ ...times }).filter(([, value]) => value).map(([key, value]) => `${key} ${value}`).join(" · ");
  refresh();
}

// The next step, until the strokes determine a field.
const STEPS = {
  outline: { mark: "cut", text: "Draw the outline of a shape, and close it." },
  line: { mark: "line", text: "Draw a line along which the surface bends." },
  across: { mark: "line", text: "Draw a line across the others." },
};
const isDetermined = () => state.next !== "across";
function proceed(next) {
  state.next = next;
  if (next === "line") presetLine();
  controls(); doubts();
}
function showNext() {
  const step = STEPS[state.next], choice = step && step.mark !== state.mark ? `Choose ${$(`[data-mark=${step.mark}]`).textContent}. ` : "";
  $("#next").textContent = step ? choice + step.text : ""; $("#welcome").hidden = state.doc.strokes.length > 0;
  $("#surface-note").textContent = !state.field ? "The surface appears here." : !isDetermined() ? "This surface is arbitrary until a line crosses the others." : "Drag an arrow, or tap its two ends, to state where the normal leans.";
}

// Numbers, doubts.
const degrees = value => `${value.toFixed(1)}°`;
function numbers({ numbers: n, frame }) {
  const facts = { Grid: `${frame.columns} × ${frame.rows}`, Pixels: n.pixels, "Stroke pixels": n.strokes, Deviation: `${degrees(n.deviation)} mean`,
    "": `${degrees(n.most_deviation)} for 90 %`, Energy: n.energy.toPrecision(5), Singular: n.singularities.replace(/ singularit\w+/, "").replace(/^no$/, "none") };
  $("#numbers").replaceChildren(...Object.entries(facts).flatMap(([key, value]) => [element("dt", key), element("dd", value)]));
}
const element = (tag, text, ...children) => { const made = document.createElement(tag); made.textContent = text; made.append(...children); return made; };
const action = (text, run) => { const made = element("button", text); made.addEventListener("click", run); return made; };
function doubts() {
  const items = [], item = (text, ...actions) => {
    const row = element("div", ""); row.className = "row"; row.append(...actions); items.push(element("li", "", ...placed(text), row));
  };
  const { field, surface } = state;
  for (const text of field?.warnings ?? []) item(`Mask: ${text}.`, action("Areas", () => choose("area")), action("Paint the mask", () => choose("paint")));
  const settled = surface && isDetermined(), some = (surface?.suspects ?? []).filter(k => state.doc.strokes[k]?.mark === "line");
  state.suspects = new Set(some);
  if (some.length) item(some.length === 1 ? "1 stroke crosses lines that cross each other. Probably it is not a curvature line, or is hidden." : `${some.length} strokes cross lines that cross each other. Probably they are not curvature lines, or are hidden.`,
    action(some.length === 1 ? "Select it" : "Select them", () => select(some)), action(some.length === 1 ? "Mark as cut" : "Mark as cuts", () => { select(some); mark("cut"); }));
  for (const choice of settled ? surface.freedom : []) item(`Your choice: ${choice.text}.`, choice.kind === "side" ? action("It is a bowl", () => commit({ concave: [...bowls(), [choice.x, choice.y]] }))
    : action("Take another depth", () => commit({ hints: [...state.doc.hints, hintOf(choice)] })));
  if (!items.length) items.push(element("li", settled ? "None." : field && isDetermined() ? "Not computed yet." : "The field is not determined yet."));
  $("#doubts").replaceChildren(...items);
}

// Controls.
function controls() {
  const { doc, history, chosen } = state;
  $("#undo").disabled = !history.can(-1); $("#redo").disabled = !history.can(1); $("#delete").disabled = $("#copy").disabled = !chosen.size; $("#paste").disabled = !state.copied.length;
  showNext();
  $("#unhint").disabled = !doc.hints.length && !bowls().length; $("#flip").setAttribute("aria-pressed", doc.flip);
  $("#selected").textContent = chosen.size ? `${chosen.size} selected` : "";
  if (document.activeElement !== $("#name")) $("#name").value = doc.name;
  $("#size").value = doc.size; $("#size-value").textContent = `${doc.size} pixels`;
  $("#weight").value = Math.log10(Math.max(doc.stroke_weight, 0.1)); $("#weight-value").textContent = doc.stroke_weight.toPrecision(3);
  $("#opacity").parentElement.hidden = !doc.picture;
  $("#silhouette").checked = doc.silhouette === "outer"; $("#brush-value").textContent = `${$("#brush").value} ${$("#brush").value === "1" ? "pixel" : "pixels"}`;
  const marks = new Set([...chosen].map(k => doc.strokes[k].mark)), shown = marks.size === 1 ? [...marks][0] : chosen.size ? "" : state.mark;
  all("[data-mark]").forEach(each => each.setAttribute("aria-pressed", each.dataset.mark === shown));
  all("[data-tool]").forEach(each => each.setAttribute("aria-pressed", each.dataset.tool === state.tool));
  $("#fingers").setAttribute("aria-pressed", fingersDraw());
  $("[data-tool=turn]").hidden = !doc.file;
}
function choose(tool) { if (tool === "turn" && !state.doc.file) return; state.tool = tool; state.brush = null; tool === "draw" ? select([]) : (controls(), refresh(false)); }
function select(numbers) { state.chosen = new Set(numbers); controls(); refresh(); }
function mark(kind) {
  if (!state.chosen.size) { state.mark = kind; state.preset = false; controls(); return; }
  commit(doc => ({ ...doc, strokes: doc.strokes.map((stroke, k) => state.chosen.has(k) ? { ...stroke, mark: kind } : stroke) }));
}
function remove() { if (state.chosen.size) commit(doc => { const rest = doc.strokes.filter((_, k) => !state.chosen.has(k)); state.chosen.clear(); return { ...doc, strokes: rest }; }); }
function copy() {
  if (!state.chosen.size) return false;
  state.copied = chosenStrokes(); controls(); status(`${counted(state.copied)} copied`);
}
function paste() {
  if (!state.copied.length) return false;
  const shift = fitShift(state.copied, state.doc.page, [PASTED / left.scale, PASTED / left.scale]), first = state.doc.strokes.length;
  state.copied = state.copied.map(stroke => moved(stroke, shift)); // the next copy lies beside this one
  choose("select"); commit(doc => ({ ...doc, strokes: [...doc.strokes, ...state.copied] })); select(state.copied.map((_, k) => first + k)); left.canvas.focus();
}
const chosenStrokes = () => state.history.now.strokes.filter((_, k) => state.chosen.has(k));
const counted = strokes => strokes.length === 1 ? "1 stroke" : `${strokes.length} strokes`;
const fingersDraw = () => state.fingers ?? true;
const bowls = () => state.doc.concave ?? [];
const hintOf = ({ x, y, hint }) => ({ x, y, slant: hint.slant, tilt: hint.tilt });
function flip() {
  if (bowls().length) { commit({ concave: [] }); return; }
  if (state.surface) state.surface = mirrored(state.surface);
  commit(doc => ({ ...doc, flip: !doc.flip, hints: doc.hints.map(hint => ({ ...hint, tilt: (hint.tilt + 360) % 360 - 180 })) }));
}
function next(name) {
  const options = all(`input[name=${name}]`), at = options.findIndex(each => each.checked);
  options[(at + 1) % options.length].click();
}

/** Zooms a picture by a factor; 0 fits it. */
function zoom(view, factor) { factor ? view.zoom(factor) : view.fit(view.box); refresh(); }
const zoomFocused = factor => { zoom(document.activeElement === right.canvas ? right : left, factor); };

// Tools: begin, move and end at points of the drawing, by pointer or by keyboard.
const brushRadius = () => $("#brush").value * (state.field?.frame.pixel ?? state.doc.page[2] / 60) / 2;
const tools = {
  begin([x, y], { pressure = 1, erasing = false, coarse = false } = {}) {
    const reach = (coarse ? FINGER : REACH) / left.scale, grabbed = state.tool === "select" && strokeAt(chosenStrokes(), [x, y], reach) >= 0;
    const tool = erasing ? "erase" : grabbed ? "move" : state.tool;
    state.live = { tool, mark: state.mark, path: [rounded(x), rounded(y)], reach, radius: tool === "erase" ? REACH / left.scale : brushRadius(), pressures: [rounded(pressure)] };
    refresh(false);
  },
  move([x, y], { pressure = 1, straight = false } = {}) {
    const { live } = state;
    if (!live) return;
    live.bend = straight && live.tool === "draw" ? live.bend ?? live.path.length : null; // whence a straight part runs
    if (live.bend) { live.path.length = live.bend; live.pressures.length = live.bend / 2; }
    const [px, py] = live.path.slice(-2);
    if (Math.hypot(x - px, y - py) * left.scale < 1.2) return;
    live.path.push(rounded(x), rounded(y)); live.pressures.push(rounded(pressure));
    if (live.tool === "turn") turn(live);
    if (live.tool === "move" && hasLeft(live)) live.shift = [x - live.path[0], y - live.path[1]];
    refresh(Boolean(live.shift));
  },
  end() {
    const { live } = state;
    state.live = null;
    if (live) finish(live);
    refresh(false);
  },
  cancel() { const { live } = state; state.live = null; refresh(Boolean(live?.shift)); },
  tap(point, contact) { if (["select", "area", "mirror"].includes(state.tool)) { tools.begin(point, contact); tools.end(); } },
  refuse() {
    if (state.fingers !== false || state.refused || bannerKind) return;
    state.refused = true; banner("Since the pen was used, a finger scrolls the page and draws nothing. Press “Finger draws” to draw with it.", { kind: "fingers" });
  },
  nudge(step) {
    if (state.tool !== "select" || !state.chosen.size) return false;
    if (state.live?.path) return true; // a pointer is at work
    state.live ??= { tool: "move", shift: [0, 0] };
    state.live.shift = state.live.shift.map((value, axis) => value + step[axis]); refresh();
    return true;
  },
};
/** Whether the path of a tool is more than a click. */
const hasLeft = ({ path: [x, y, ...rest] }) => rest.some((value, k) => Math.abs(value - [x, y][k % 2]) * left.scale > STILL);
/** The document with the selected strokes where a tool moves them. */
function shifted({ shift }) {
  const { now } = state.history, by = fitShift(chosenStrokes(), now.page, shift);
  return by.some(Boolean) ? { ...now, strokes: now.strokes.map((stroke, k) => state.chosen.has(k) ? moved(stroke, by) : stroke) } : now;
}
function finish(live) {
  const { tool, path, reach, radius, mark: kind, pressures } = live, first = path?.slice(0, 2), { axis } = state.doc;
  if (tool === "draw" && path.length > 2) {
    const weight = rounded(pressures.reduce((sum, each) => sum + each, 0) / pressures.length), varied = pressures.some(each => each !== pressures[0]);
    const parts = withReflection(path, axis, reach).flatMap(points => clipped({ points, mark: kind, weight, ...varied && { pressures } }, state.doc.page));
    if (kind === "cut" && isClosed(path)) presetLine();
    if (parts.length) { state.chosen.clear(); commit(doc => ({ ...doc, strokes: [...doc.strokes, ...parts] })); } else status("Draw inside the page.");
  } else if (live.shift) {
    const doc = shifted(live);
    if (doc !== state.history.now) commit(() => doc);
  } else if (tool === "select" || tool === "move") {
    const hit = strokeAt(state.doc.strokes, first, reach);
    if (hasLeft(live)) select(strokesIn(state.doc.strokes, path));
    else select(hit < 0 ? [] : [hit]);
  } else if (tool === "erase") {
    const strokes = [path, ...axis ? [reflected(path, axis)] : []].reduce((rest, each) => erased(rest, each, radius), state.doc.strokes);
    state.chosen.clear(); if (strokes.length !== state.doc.strokes.length || strokes.some((stroke, k) => stroke !== state.doc.strokes[k])) commit({ strokes });
  } else if (tool === "paint" || tool === "unpaint") editMask(...[path, ...axis ? [reflected(path, axis)] : []].map(points => ({ kind: tool === "paint" ? "paint" : "erase", points, radius: rounded(radius) })));
  else if (tool === "area") editMask({ kind: "toggle", points: first, radius: 0 });
  else if (tool === "turn") turn({ path }, true);
  else if (tool === "mirror") {
    const [x, y] = first, [ex, ey] = path.slice(-2), isHit = axis && withReflection(first, axis, reach).length === 1;
    commit({ axis: Math.hypot(ex - x, ey - y) * left.scale > STILL ? [x, y, ex, ey] : isHit ? undefined : [x, y, x, rounded(y + 1)] }); choose("draw");
  }
}
const editMask = (...edits) => commit(doc => ({ ...doc, mask: [...doc.mask, ...edits] }));

// Turning a drawing in space: the file is read again from another side.
let turning = null;
async function turn({ path }, done = false) {
  const { file } = state.doc, from = state.history.now.view ?? [30, 25], k = path.length - 2;
  const view = [from[0] - (path[k] - path[0]) * left.scale / 3, Math.max(-89, Math.min(89, from[1] + (path[k + 1] - path[1]) * left.scale / 3))].map(Math.round);
  if (turning && !done) return;
  await turning;
  turning = readFile(decoded.bytes(file.data), file.name, view.join(",")).finally(() => { turning = null; });
  const found = await turning;
  if (!found || file !== state.doc.file) return;
  const doc = { ...state.history.now, page: found.page, strokes: found.strokes, mask: [], hints: [], view };
  state.chosen.clear();
  done ? commit(doc) : show(doc, { compute: false });
}

// Hints.
function hintAt([x, y]) {
  const close = 12 / right.scale, reach = reachOf(state.surface.frame);
  return state.doc.hints.findIndex(hint => [[hint.x, hint.y], tipOf(hint, reach)].some(([hx, hy]) => Math.hypot(hx - x, hy - y) < close));
}
const arrows = {
  begin([x, y]) { if (state.surface) { state.arrow = { x: rounded(x), y: rounded(y), slant: 0, tilt: 0 }; refresh(false); } },
  move([x, y], { erasing = false } = {}) { if (state.arrow && !erasing) { Object.assign(state.arrow, leaning(x - state.arrow.x, y - state.arrow.y, reachOf(state.surface.frame))); refresh(false); } },
  end() {
    const { arrow } = state;
    state.arrow = null;
    if (!arrow) return;
    const hit = hintAt([arrow.x, arrow.y]);
    const rest = state.doc.hints.filter((_, k) => k !== hit);
    if (arrow.slant >= 5) commit({ hints: [...rest, { ...arrow, slant: Math.round(arrow.slant), tilt: Math.round(arrow.tilt) }] });
    else if (hit >= 0) commit({ hints: rest });
    refresh();
  },
  cancel() { state.arrow = null; refresh(false); },
  nudge: () => false, refuse() {},
  tap(point) {
    if (state.arrow) { arrows.move(point); arrows.end(); return; }
    arrows.begin(point);
    if (!state.arrow) return;
    if (hintAt(point) >= 0) arrows.end(); else status("Tap where the normal leans to, or tap the same point again for no hint.");
  },
};

// Pointers and keys of both pictures.
watchPen(() => { state.fingers ??= false; controls(); });
listen(left, tools, { refresh, fingers: () => fingersDraw() && state.tool !== "area", hover(event) {
  const grabs = event.pointerType === "mouse" && state.tool === "select" && strokeAt(chosenStrokes(), left.at(event), REACH / left.scale) >= 0;
  left.canvas.style.cursor = grabs ? "move" : "";
  const wide = { paint: brushRadius(), unpaint: brushRadius(), erase: REACH / left.scale }[state.tool], [x, y] = left.at(event);
  if (wide || state.brush) { state.brush = wide && event.pointerType !== "touch" ? { x, y, radius: wide } : null; refresh(false); }
} });
listen(right, arrows, { refresh, fingers: () => false, hover(event) {
  if (state.arrow || state.kind !== "shaded" || event.pointerType === "touch") return;
  const place = right.canvas.getBoundingClientRect(), x = 2 * (event.clientX - place.left) / place.width - 1, y = 1 - 2 * (event.clientY - place.top) / place.height;
  state.lamp = { azimuth: Math.atan2(y, x), elevation: Math.PI / 2 * (1 - 0.85 * Math.min(1, Math.hypot(x, y))) }; refresh(false);
} });
right.canvas.addEventListener("pointerleave", () => { state.lamp = LAMP_AT; refresh(false); });

// Files.
/** What the server reads, or null after a message. */
async function read(path, name, body) {
  const response = await server.ask(path, body && { method: "POST", body }).catch(() => null); // a lost server is shown
  if (response?.ok) return await response.json();
  if (response) banner(await trouble(response, name).then(text => text.startsWith(name) ? text : `${name}: ${text}`));
  return null;
}
const readFile = (file, name, view) => read(`open?${new URLSearchParams({ name, ...view && { view } })}`, name, file);
/** The document of what the server read from a file. */
const documentOf = ({ document: session, name, page, strokes, file, picture, source }) => ({ ...emptyDocument(), size: state.doc.size, ...session ?? { name: name || "drawing", page, strokes, file, picture, source } });
const mayReplace = () => isSaved() || !state.doc.strokes.length || confirm("Replace this drawing? It has changes that are not in a saved file. Undo brings it back until this page is closed or loaded again.");
/** Shows what the server read, and its notes on what it left out. */
function enter(found) {
  if (!found) return;
  const doc = documentOf(found);
  if (found.source) strokesOf.set(doc.source, doc.strokes);
  replace(doc); showNotes(found);
}
const showNotes = ({ notes = [] }) => banner(notes.map(note => sentence(note)).join(" "), { kind: "notes" });
const open = async file => { if (file && mayReplace()) enter(await readFile(file, file.name)); };
function give(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob); link.download = name; link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
function save() {
  give(new Blob([JSON.stringify(state.history.now)], { type: "application/json" }), `${state.doc.name}.studio.json`);
  state.history.saved.add(state.history.now); keep(); status("Saved.");
}
async function download(what) {
  const title = $(`[data-download=${what}]`).textContent, query = new URLSearchParams({ what, formulation: $("#formulation").value, format: $("#format").value });
  status(`Writing ${title} …`);
  try {
    await server.ask(`download?${query}`, { method: "POST", body: computable(state.doc) }, async response => {
      if (!response.ok) { banner(await trouble(response)); status(""); return; }
      give(await response.blob(), /filename="(.*)"/.exec(response.headers.get("content-disposition"))[1]);
      ready(`${title} is written.`);
    });
  } catch { /* the server is lost, which is shown */ }
}
function dialog(title, ...content) { $("#dialog h2").textContent = title; $("#dialog div").replaceChildren(...content); $("#dialog").showModal(); }
const actions = {
  undo: () => step(-1), redo: () => step(1), save, flip, copy, paste, delete: remove, retry: request, dismiss: () => banner(""),
  open: () => $("#file").click(), unhint: () => commit({ hints: [], concave: [] }),
  empty: () => { if (mayReplace()) replace({ ...emptyDocument(), page: canvasPage(), size: state.doc.size }); },
  fingers: () => { state.fingers = !fingersDraw(); clear("fingers"); controls(); },
  help: () => dialog("Help", $("#help").content.cloneNode(true)),
};
const closeMenus = () => all(".menu[open]").forEach(each => { each.open = false; });
document.addEventListener("click", event => {
  const button = event.target.closest("button");
  if (!event.target.closest(".menu") || button) closeMenus();
  if (!button) return;
  const { do: name, tool, mark: kind, download: what, sample, zoom: factor } = button.dataset;
  if (name) actions[name]();
  if (tool) choose(tool);
  if (kind) mark(kind);
  if (factor) zoom(button.closest("#right") ? right : left, Number(factor));
  if (what) download(what);
  if (sample && mayReplace()) read(`sample/${sample}`, sample).then(found => enter(found));
});
$("#file").addEventListener("change", event => { open(event.target.files[0]).finally(() => { event.target.value = ""; }); });
document.addEventListener("dragover", event => event.preventDefault());
document.addEventListener("drop", event => { event.preventDefault(); open(event.dataTransfer.files[0]); });

// Settings: a slider shows its field while it moves, and makes one step of the history.
const settings = {
  size: () => ({ size: Number($("#size").value) }), weight: () => ({ stroke_weight: Number((10 ** $("#weight").value).toPrecision(3)) }),
  silhouette: () => ({ silhouette: $("#silhouette").checked ? "outer" : "none" }), name: () => ({ name: $("#name").value.slice(0, 32) || "drawing" }),
};
for (const [name, read_] of Object.entries(settings)) {
  if (name === "size" || name === "weight") $(`#${name}`).addEventListener("input", () => show({ ...state.doc, ...read_() }));
  $(`#${name}`).addEventListener("change", () => commit(read_()));
}
$("#brush").addEventListener("input", controls); $("#opacity").addEventListener("input", () => refresh());
$("#ink").addEventListener("change", () => refresh(false));
all("input[name=field]").forEach(each => each.addEventListener("change", () => { state.mode = each.value; refresh(); if (each.value === "lines" && !state.lines) request(); }));
all("input[name=surface]").forEach(each => each.addEventListener("change", () => { state.kind = each.value; refresh(false); }));

// Keys.
const hasText = () => getSelection().type === "Range"; // which the browser copies
const keys = {
  d: () => choose("draw"), v: () => choose("select"), e: () => choose("erase"), b: () => choose("paint"), n: () => choose("unpaint"), a: () => choose("area"), r: () => choose("turn"), m: () => choose("mirror"),
  1: () => mark("line"), 2: () => mark("cut"), 3: () => mark("ignored"), f: flip, q: () => next("field"), w: () => next("surface"),
  delete: remove, backspace: remove, escape: () => { closeMenus(); tools.cancel(); arrows.cancel(); select([]); }, "?": actions.help,
  "+": () => zoomFocused(1.25), "=": () => zoomFocused(1.25), "-": () => zoomFocused(0.8), 0: () => zoomFocused(0),
  "ctrl+z": () => step(-1), "ctrl+shift+z": () => step(1), "ctrl+y": () => step(1), "ctrl+s": save, "ctrl+o": actions.open, "ctrl+c": () => !hasText() && copy(), "ctrl+x": () => !hasText() && (copy() ?? remove()), "ctrl+v": paste,
  "ctrl+a": () => select(state.doc.strokes.map((_, k) => k)),
};
for (const key of ["+", "=", "-", "0"]) keys[`ctrl+${key}`] = keys[`ctrl+shift+${key}`] = () => document.activeElement.localName === "canvas" && keys[key](); // else the browser zooms the page
document.addEventListener("keydown", event => {
  const typing = event.target.closest("input:not([type=range],[type=radio],[type=checkbox]), select, dialog");
  const control = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  const run = keys[control ? `ctrl+${event.shiftKey ? "shift+" : ""}${key}` : key];
  if (!run || event.altKey || (typing && !(control && "so".includes(key)))) return;
  if (run() !== false) event.preventDefault();
});

// Pages do not share drawings; a second one says so.
const others = new BroadcastChannel(KEPT);
others.addEventListener("message", ({ data }) => {
  if (data === "opened") others.postMessage("there");
  if (data === "there" && !bannerKind) banner("This studio is open in another tab too. Each tab has its own drawing.", { kind: "tab" });
});
others.postMessage("opened");
addEventListener("beforeunload", event => { if (!isSaved()) event.preventDefault(); });

// What this tab had before it was loaded again, or the drawing of the command line.
async function begin() {
  const mine = kept(), same = sessionStorage.getItem(`${KEPT}-at`) === location.pathname, saved = sessionStorage.getItem(`${KEPT}-saved`);
  const given = await read("first", "First drawing"), first = documentOf(given ?? { document: { page: canvasPage() } });
  state.history.reset(mine || first, { saved: !mine || saved === "yes" });
  if (mine) try { state.history.unpack(sessionStorage.getItem(`${KEPT}-past`), PARTS); } catch { /* without its past */ }
  sessionStorage.removeItem(`${KEPT}-past`); // its room is for the drawing
  show(state.history.now);
  if (mine && given && !same && !confirm("This tab has a drawing from an earlier page. Keep it instead of the new one? If not, undo brings it back.")) replace(first);
  else if (mine) keep();
  else if (given) showNotes(given);
}
controls(); doubts(); begin();
