// The left picture: strokes, mask and field, in the units of the drawing.

import { boxOf, withReflection } from "./strokes.js";

const dark = matchMedia("(prefers-color-scheme: dark)");
const PALETTE = JSON.parse(document.body.dataset.palette); // of all pictures: u, v, stroke, plus and minus
const COLOURS = {
  light: { ...PALETTE.light, line: PALETTE.light.stroke, cut: "#1c2430", ignored: "#9aa3ae", page: "#c9d0d9", beyond: "#eef0f3", chosen: "#0b6b8066",
    cursor: "#0b6b80", suspect: "#f08c0066", tints: ["#0000", "#4a90e226", "#f5a5236b", "#0000"] },
  dark: { ...PALETTE.dark, line: PALETTE.dark.stroke, cut: "#e6eaf0", ignored: "#6b7685", page: "#3a434f", beyond: "#0e1115", chosen: "#5cc3d677",
    cursor: "#5cc3d6", suspect: "#f0a35e77", tints: ["#0000", "#6aa9f033", "#f5a5237a", "#0000"] },
};
const APART = 13; // pixels of the screen between crosses
const MANY = 300, REST = 150; // strokes that are not drawn again while the view moves; milliseconds until it rests
export const colours = () => COLOURS[dark.matches ? "dark" : "light"];

/** A canvas with a view of the drawing: position of the origin and pixels per unit. */
export class View {
  constructor(canvas, changed) {
    this.canvas = canvas; this.box = [0, 0, 1, 1]; this.zoomed = false; this.cursor = null;
    this.base = document.createElement("canvas"); this.ink = document.createElement("canvas");
    this.inkLater = () => { clearTimeout(this.rest); this.rest = setTimeout(() => { this.inked = null; changed(); }, REST); };
    new ResizeObserver(() => { this.resize(); changed(); }).observe(canvas);
    dark.addEventListener("change", changed);
    this.resize();
  }
  resize() {
    this.ratio = devicePixelRatio || 1;
    this.wide = Math.max(1, this.canvas.clientWidth); this.high = Math.max(1, this.canvas.clientHeight);
    for (const each of [this.canvas, this.base, this.ink]) { each.width = this.wide * this.ratio; each.height = this.high * this.ratio; }
    this.inked = null;
    if (!this.zoomed) this.fit(this.box);
  }
  fit(box) {
    this.box = box; this.zoomed = false;
    const [left, top, right, bottom] = box, room = 0.94;
    this.scale = room * Math.min(this.wide / Math.max(right - left, 1e-6), this.high / Math.max(bottom - top, 1e-6));
    this.x = (this.wide - this.scale * (left + right)) / 2; this.y = (this.high - this.scale * (top + bottom)) / 2;
  }
  zoom(factor, px = this.wide / 2, py = this.high / 2, dx = 0, dy = 0) {
    const scale = this.scale * factor;
    this.x = px + dx - (px - this.x) * factor; this.y = py + dy - (py - this.y) * factor;
    this.scale = scale; this.zoomed = true;
  }
  /** The point of the drawing under a place of the window. */
  at(event) {
    const place = this.canvas.getBoundingClientRect();
    return [(event.clientX - place.left - this.x) / this.scale, (event.clientY - place.top - this.y) / this.scale];
  }
  begin(target) {
    const context = target.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0); context.clearRect(0, 0, target.width, target.height);
    return this.place(context);
  }
  place(context) {
    context.setTransform(this.ratio * this.scale, 0, 0, this.ratio * this.scale, this.ratio * this.x, this.ratio * this.y);
    context.lineCap = context.lineJoin = "round";
    return context;
  }
  /** Left, top, right and bottom of the part of the drawing that is seen. */
  get seen() { return [-this.x / this.scale, -this.y / this.scale, (this.wide - this.x) / this.scale, (this.high - this.y) / this.scale]; }
  /** Draws the cursor of the keyboard, and a ring round a place that a message names. */
  drawPlaces(context, spot) {
    if (spot) for (const [colour, width] of [["#fffc", 7], [colours().cursor, 3]]) {
      context.strokeStyle = colour; context.lineWidth = width / this.scale; context.beginPath(); context.arc(...spot, 14 / this.scale, 0, 7); context.stroke();
    }
    if (!this.cursor || document.activeElement !== this.canvas) return;
    const [x, y] = this.cursor, arm = 9 / this.scale;
    context.strokeStyle = colours().cursor; context.lineWidth = 2 / this.scale; context.beginPath();
    context.moveTo(x - arm, y); context.lineTo(x + arm, y); context.moveTo(x, y - arm); context.lineTo(x, y + arm); context.stroke();
  }
}

const trace = (context, points) => {
  context.moveTo(points[0], points[1]);
  for (let k = 2; k < points.length; k += 2) context.lineTo(points[k], points[k + 1]);
};

/** Draws strokes in one colour and width. */
function draw(context, strokes, colour, width) {
  context.strokeStyle = colour; context.lineWidth = width; context.beginPath();
  strokes.forEach(({ points }) => trace(context, points)); context.stroke();
}

const LEVELS = 12; // of pressure

/** Width of a stroke as a share of that at full pressure; as in export/studio/files.py. */
const shareOf = pressure => 0.3 + 0.7 * pressure;

/** Draws strokes in one colour, as wide as their pressure. width: at full pressure. */
export function drawInk(context, strokes, colour, width) {
  const paths = Array.from({ length: LEVELS + 1 }, () => null);
  for (const { points, pressures, weight } of strokes) {
    let last = null;
    for (let k = 2; k < points.length; k += 2) {
      const level = Math.round(LEVELS * Math.max(0, Math.min(1, pressures?.[k / 2] ?? weight ?? 1))), path = paths[level] ??= new Path2D();
      if (level !== last) path.moveTo(points[k - 2], points[k - 1]);
      path.lineTo(points[k], points[k + 1]); last = level;
    }
  }
  context.strokeStyle = colour;
  paths.forEach((path, level) => { if (path) { context.lineWidth = width * shareOf(level / LEVELS); context.stroke(path); } });
}

/** Puts strokes in the colours of their marks onto a picture. They are drawn on a canvas of their own: those that were added onto
 * those before, and many of them, while the view moves, as they were. widths: in pixels of the screen, by mark; others are left out. */
export function putInk(target, view, strokes, widths) {
  const { inked } = view, isLonger = inked?.dark === dark.matches && inked.strokes.every((stroke, k) => stroke === strokes[k]);
  const isStill = isLonger && ["x", "y", "scale"].every(name => inked[name] === view[name]);
  if (isLonger && !isStill && strokes.length > MANY && strokes.length === inked.strokes.length) view.inkLater();
  else drawInkOf(view, strokes, widths, isStill ? inked.strokes.length : 0);
  const { x, y, scale } = view.inked, by = view.scale / scale;
  target.setTransform(by, 0, 0, by, view.ratio * (view.x - by * x), view.ratio * (view.y - by * y));
  target.drawImage(view.ink, 0, 0); view.place(target);
}

/** Draws strokes from a number on onto the canvas of a view's ink. */
function drawInkOf(view, strokes, widths, start) {
  const context = start ? view.place(view.ink.getContext("2d")) : view.begin(view.ink), [left, top, right, bottom] = view.seen, thin = 1 / view.scale;
  for (let k = start, first = k; k < strokes.length; first = k) {
    const { mark } = strokes[first], run = [];
    for (; strokes[k]?.mark === mark; k++) {
      const box = boxOf(strokes[k]);
      if (box[2] >= left && box[0] <= right && box[3] >= top && box[1] <= bottom) run.push(strokes[k]);
    }
    context.setLineDash(mark === "ignored" ? [4 * thin, 4 * thin] : []);
    if (widths[mark]) drawInk(context, run, colours()[mark], widths[mark] * thin);
  }
  view.inked = { strokes, x: view.x, y: view.y, scale: view.scale, dark: dark.matches };
}

/** A small picture with a pixel per pixel of the grid. */
export function gridPicture(rows, columns, colour) {
  const picture = document.createElement("canvas");
  picture.width = columns; picture.height = rows;
  const context = picture.getContext("2d"), image = context.createImageData(columns, rows);
  for (let k = 0; k < rows * columns; k++) image.data.set(colour(k), 4 * k);
  context.putImageData(image, 0, 0);
  return picture;
}

const rgba = text => {
  const hex = text.length < 6 ? text.slice(1).replace(/./g, "$&$&") : text.slice(1);
  return [0, 2, 4, 6].map(k => parseInt(hex.slice(k, k + 2) || "ff", 16));
};

function tint(field) {
  const scheme = colours();
  if (field.tint?.scheme !== scheme) {
    const tints = scheme.tints.map(rgba);
    field.tint = { scheme, picture: gridPicture(field.frame.rows, field.frame.columns, k => tints[field.kinds[k]]) };
  }
  return field.tint.picture;
}

const ANGLES = PALETTE.angles.map(rgba);

function angleMap(field) {
  field.angles ??= gridPicture(field.frame.rows, field.frame.columns, k => {
    const n = field.number[k];
    if (n < 0) return [0, 0, 0, 0];
    const between = Math.abs(Math.asin(Math.sin(field.u[n] - field.v[n]))) / (Math.PI / 2) * (ANGLES.length - 1);
    const low = Math.min(ANGLES.length - 2, Math.floor(between)), part = between - low;
    return ANGLES[low].map((value, c) => value + part * (ANGLES[low + 1][c] - value));
  });
  return field.angles;
}

function crosses(context, field, scale) {
  const { x, y, pixel, rows, columns } = field.frame, every = Math.max(1, Math.round(APART / (pixel * scale)));
  const arm = 0.4 * pixel * every;
  for (const family of ["u", "v"]) {
    context.strokeStyle = colours()[family]; context.lineWidth = Math.max(0.7, Math.min(1.6, 0.12 * pixel * scale)) / scale;
    context.beginPath();
    for (let row = every >> 1; row < rows; row += every) for (let column = every >> 1; column < columns; column += every) {
      const n = field.number[row * columns + column];
      if (n < 0) continue;
      const cx = x + pixel * (column + 0.5), cy = y + pixel * (row + 0.5);
      const dx = arm * Math.cos(field[family][n]), dy = -arm * Math.sin(field[family][n]);
      context.moveTo(cx - dx, cy - dy); context.lineTo(cx + dx, cy + dy);
    }
    context.stroke();
  }
}

/** Draws what lies under the strokes, and changes with the document, the field and the view, into the hidden canvas. */
export function paintBase(view, { doc, picture, opacity, chosen, field, lines, mode, suspects }) {
  const context = view.begin(view.base), thin = 1 / view.scale, ink = colours();
  const [left, top, right, bottom] = view.seen;
  context.fillStyle = ink.beyond; context.fillRect(left, top, right - left, bottom - top); context.clearRect(...doc.page);
  if (picture && opacity) { context.globalAlpha = opacity; context.drawImage(picture, ...doc.page); context.globalAlpha = 1; }
  context.strokeStyle = ink.page; context.lineWidth = thin; context.strokeRect(...doc.page);
  if (doc.axis) {
    const [ax, ay, bx, by] = doc.axis, far = (right - left + bottom - top + Math.abs(ax - left) + Math.abs(ay - top)) / Math.hypot(bx - ax, by - ay);
    context.strokeStyle = ink.cursor; context.setLineDash([10 * thin, 4 * thin, 2 * thin, 4 * thin]);
    context.beginPath(); trace(context, [-far, far].flatMap(t => [ax + t * (bx - ax), ay + t * (by - ay)])); context.stroke(); context.setLineDash([]);
  }
  if (field) {
    const { x, y, pixel, rows, columns } = field.frame, place = [x, y, pixel * columns, pixel * rows];
    context.imageSmoothingEnabled = false;
    context.drawImage(tint(field), ...place);
    if (mode === "angle") context.drawImage(angleMap(field), ...place);
    context.globalAlpha = 0.75;
    if (mode === "crosses" || (mode === "lines" && !lines)) crosses(context, field, view.scale);
    if (mode === "lines" && lines) lines.forEach((family, k) => {
      context.strokeStyle = ink[k ? "v" : "u"]; context.lineWidth = 1.2 * thin; context.beginPath();
      family.forEach(points => trace(context, points)); context.stroke();
    });
    context.globalAlpha = 1;
  }
  draw(context, [...suspects].flatMap(k => doc.strokes[k] ?? []), ink.suspect, 11 * thin);
  draw(context, [...chosen].map(k => doc.strokes[k]), ink.chosen, 9 * thin);
}

const WIDTHS = { ignored: 1.4, cut: 2.6, line: 2.6 };

/** Copies the hidden canvases and draws what follows the pointer. live: the tool in use, with what it has done so far. */
export function paint(view, { live, brush, doc, chosen, field, mode, spot }) {
  const isStill = (_, k) => !live?.shift || !chosen.has(k), ink = colours(), thin = 1 / view.scale;
  const context = view.begin(view.canvas);
  context.setTransform(1, 0, 0, 1, 0, 0); context.drawImage(view.base, 0, 0);
  putInk(context, view, doc.strokes.filter(isStill), WIDTHS);
  for (const mark in WIDTHS) drawInk(context, doc.strokes.filter((stroke, k) => stroke.mark === mark && !isStill(stroke, k)), ink[mark], WIDTHS[mark] * thin);
  if (field && mode !== "none") for (const [x, y, index] of field.singularities) {
    context.fillStyle = index > 0 ? ink.plus : ink.minus;
    context.beginPath(); context.arc(x, y, 5 * thin, 0, 7); context.fill();
  }
  if (live?.tool === "draw") {
    const path = live.path.length > 2 ? live.path : [...live.path, ...live.path];
    context.save(); context.beginPath(); context.rect(...doc.page); context.clip();
    drawInk(context, withReflection(path, doc.axis, live.reach).map(points => ({ points, pressures: live.pressures })), ink[live.mark], 2.6 * thin); context.restore();
  } else if (live?.path) {
    const wide = { erase: 2 * live.radius, paint: 2 * live.radius, unpaint: 2 * live.radius }[live.tool];
    context.lineWidth = wide ?? 1.5 / view.scale;
    context.strokeStyle = { paint: "#4a90e266", unpaint: "#9aa3ae88", erase: "#9aa3ae66" }[live.tool] ?? ink.cursor;
    context.setLineDash(live.tool === "select" ? [5 / view.scale, 4 / view.scale] : []);
    context.beginPath(); trace(context, live.path.length > 2 ? live.path : [...live.path, ...live.path]); context.stroke(); context.setLineDash([]);
  } else if (brush) {
    context.strokeStyle = ink.cursor; context.lineWidth = 1 / view.scale;
    context.beginPath(); context.arc(brush.x, brush.y, brush.radius, 0, 7); context.stroke();
  }
  view.drawPlaces(context, spot);
}
