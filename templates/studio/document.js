// The document of a drawing and its history. Documents are never changed in place.

const FORMAT = "crossfield-studio", VERSION = 1;

export const emptyDocument = () => ({
  format: FORMAT, version: VERSION, name: "drawing", page: [0, 0, 800, 600], strokes: [], mask: [], hints: [],
  flip: false, size: 48, stroke_weight: 20, silhouette: "none",
});

/** The document, if this page can show it; otherwise throws an error with the reason. */
export function check(doc) {
  const flat = points => Array.isArray(points) && points.length >= 2 && points.length % 2 === 0 && points.every(Number.isFinite);
  if (doc.format !== FORMAT) throw new Error("it is not a session of crossfield");
  if (doc.version !== VERSION) throw new Error(`its session version is ${doc.version}, and this page reads version ${VERSION}; load it with the crossfield that made it`);
  if (![doc.page, doc.axis ?? doc.page].every(each => flat(each) && each.length === 4)) throw new Error("its page is damaged");
  for (const key of ["strokes", "mask", "hints"]) if (!Array.isArray(doc[key])) throw new Error(`its ${key} are damaged`);
  if (![...doc.strokes, ...doc.mask].every(each => each && flat(each.points))) throw new Error("its points are damaged");
  return doc;
}

const SHARED = ["strokes", "mask", "hints"]; // by the steps of a history
const texts = new WeakMap(); // of strokes
const textOf = stroke => texts.get(stroke) ?? texts.set(stroke, JSON.stringify(stroke)).get(stroke);
/** A document as JSON without some of its parts. The text of a stroke is made once. */
export const textWithout = (doc, parts) => `${JSON.stringify({ ...doc, ...Object.fromEntries(parts.map(part => [part, undefined])), strokes: undefined }).slice(0, -1)},"strokes":[${doc.strokes.map(textOf)}]}`;

/** All documents so far, without limit; unchanged parts are shared between them. saved: those that are in a file. */
export class History {
  constructor(first) { this.reset(first); }
  reset(first, { saved = true } = {}) { this.all = [first]; this.at = 0; this.saved = new WeakSet(saved ? [first] : []); }
  get now() { return this.all[this.at]; }
  commit(next) { this.all.length = this.at + 1; this.all.push(next); this.at += 1; }
  step(by) { const moved = this.all[this.at + by] !== undefined; if (moved) this.at += by; return moved; }
  /** Up to so many steps to each side of the present one as JSON, for a reload; they share their strokes, edits and hints. Parts that are kept elsewhere are those of the present one. */
  pack(most, parts) {
    const items = new Map(), numbered = list => list.map(item => items.get(item) ?? items.set(item, items.size).size - 1);
    const isNear = doc => doc && parts.every(part => doc[part] === this.now[part]);
    let [first, last] = [this.at, this.at];
    while (isNear(this.all[first - 1]) && this.at - first < most) first--;
    while (isNear(this.all[last + 1]) && last - this.at < most) last++;
    const bare = Object.fromEntries(parts.map(part => [part, undefined]));
    const steps = this.all.slice(first, last + 1).map(doc => ({ ...doc, ...bare, ...Object.fromEntries(SHARED.map(name => [name, numbered(doc[name])])) }));
    return `{"at":${this.at - first},"steps":${JSON.stringify(steps)},"items":[${[...items.keys()].map(textOf)}]}`;
  }
  /** Takes on packed steps if the present one is among them. */
  unpack(text, parts) {
    const { at, steps, items } = JSON.parse(text), kept = Object.fromEntries(parts.filter(part => this.now[part]).map(part => [part, this.now[part]]));
    const all = steps.map(step => ({ ...step, ...kept, ...Object.fromEntries(SHARED.map(name => [name, step[name].map(k => items[k])])) }));
    if (textWithout(all[at], parts) !== textWithout(this.now, parts)) return;
    all[at] = this.now; this.all = all; this.at = at;
  }
  can(by) { return this.all[this.at + by] !== undefined; }
}

function bytes(text) {
  const letters = atob(text), all = new Uint8Array(letters.length); // Uint8Array.from takes 10 times as long
  for (let k = 0; k < all.length; k++) all[k] = letters.charCodeAt(k);
  return all;
}
export const decoded = { bytes, shorts: text => new Int16Array(bytes(text).buffer), floats: text => new Float32Array(bytes(text).buffer) };
