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
  if (!flat(doc.page) || doc.page.length !== 4) throw new Error("its page is damaged");
  for (const key of ["strokes", "mask", "hints"]) if (!Array.isArray(doc[key])) throw new Error(`its ${key} are damaged`);
  if (![...doc.strokes, ...doc.mask].every(each => each && flat(each.points))) throw new Error("its points are damaged");
  return doc;
}

/** All documents so far, without limit; unchanged parts are shared between them. saved: those that are in a file. */
export class History {
  constructor(first) { this.reset(first); }
  reset(first, { saved = true } = {}) { this.all = [first]; this.at = 0; this.saved = new WeakSet(saved ? [first] : []); }
  get now() { return this.all[this.at]; }
  commit(next) { this.all.length = this.at + 1; this.all.push(next); this.at += 1; }
  step(by) { const moved = this.all[this.at + by] !== undefined; if (moved) this.at += by; return moved; }
  can(by) { return this.all[this.at + by] !== undefined; }
}

const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
export const decoded = { bytes, shorts: text => new Int16Array(bytes(text).buffer), floats: text => new Float32Array(bytes(text).buffer) };
