// The document of a drawing and its history. Documents are never changed in place.

export const FORMAT = "crossfield-studio";

export const emptyDocument = () => ({
  format: FORMAT, version: 1, name: "drawing", page: [0, 0, 800, 600], strokes: [], mask: [], hints: [],
  flip: false, size: 48, stroke_weight: 20, silhouette: "none",
});

/** All documents so far, without limit; unchanged parts are shared between them. */
export class History {
  constructor(first) { this.reset(first); }
  reset(first) { this.all = [first]; this.at = 0; this.saved = first; }
  get now() { return this.all[this.at]; }
  commit(next) { this.all.length = this.at + 1; this.all.push(next); this.at += 1; }
  step(by) { const moved = this.all[this.at + by] !== undefined; if (moved) this.at += by; return moved; }
  can(by) { return this.all[this.at + by] !== undefined; }
}

const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
export const decoded = { bytes, shorts: text => new Int16Array(bytes(text).buffer), floats: text => new Float32Array(bytes(text).buffer) };
export const encoded = data => btoa(Array.from(new Uint8Array(data), byte => String.fromCharCode(byte)).join(""));
