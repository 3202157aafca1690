// Strokes of a drawing: where they lie, and what is left of them. Strokes are never changed in place.

export const rounded = value => Math.round(value * 1000) / 1000;

/** Least and greatest coordinates of a stroke, kept with its points. */
const boxes = new WeakMap();
export function boxOf(stroke) {
  let box = boxes.get(stroke.points);
  if (!box) {
    box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let k = 0; k < stroke.points.length; k += 2) {
      const x = stroke.points[k], y = stroke.points[k + 1];
      if (x < box[0]) box[0] = x; if (y < box[1]) box[1] = y; if (x > box[2]) box[2] = x; if (y > box[3]) box[3] = y;
    }
    boxes.set(stroke.points, box);
  }
  return box;
}

const fromSegment = (px, py, ax, ay, bx, by) => {
  const dx = bx - ax, dy = by - ay, long = dx * dx + dy * dy;
  const t = long ? Math.max(0, Math.min(1, ((px - ax) * dx + (py - ay) * dy) / long)) : 0;
  return Math.hypot(px - ax - t * dx, py - ay - t * dy);
};

/** Number of the stroke nearest to a point within a reach, or -1. */
export function strokeAt(strokes, [x, y], reach) {
  let best = reach, found = -1;
  strokes.forEach((stroke, number) => {
    const [left, top, right, bottom] = boxOf(stroke), p = stroke.points;
    if (x < left - reach || x > right + reach || y < top - reach || y > bottom + reach) return;
    for (let k = 0; k < p.length; k += 2) {
      const next = Math.min(k + 2, p.length - 2);
      const away = fromSegment(x, y, p[k], p[k + 1], p[next], p[next + 1]);
      if (away <= best) { best = away; found = number; }
    }
  });
  return found;
}

/** Numbers of the strokes with most of their points inside of a loop. */
export function strokesIn(strokes, loop) {
  const inside = (x, y) => {
    let odd = false;
    for (let i = 0, j = loop.length - 2; i < loop.length; j = i, i += 2) {
      const [ax, ay, bx, by] = [loop[i], loop[i + 1], loop[j], loop[j + 1]];
      if ((ay > y) !== (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax) odd = !odd;
    }
    return odd;
  };
  return strokes.flatMap((stroke, number) => {
    let count = 0;
    for (let k = 0; k < stroke.points.length; k += 2) count += inside(stroke.points[k], stroke.points[k + 1]);
    return count > stroke.points.length / 4 ? [number] : [];
  });
}

/** The strokes without the parts within a reach of a path; a stroke may fall apart. */
export function erased(strokes, path, reach) {
  const [left, top, right, bottom] = boxOf({ points: path });
  return strokes.flatMap(stroke => {
    const box = boxOf(stroke);
    if (box[0] > right + reach || box[2] < left - reach || box[1] > bottom + reach || box[3] < top - reach) return [stroke];
    const points = dense(stroke.points, reach / 2), pieces = [[]];
    let cut = false;
    for (let k = 0; k < points.length; k += 2) {
      if (near(path, points[k], points[k + 1], reach)) { cut = true; if (pieces.at(-1).length) pieces.push([]); }
      else pieces.at(-1).push(points[k], points[k + 1]);
    }
    return cut ? pieces.filter(piece => piece.length > 2).map(piece => ({ ...stroke, points: piece })) : [stroke];
  });
}

const near = (path, x, y, reach) => {
  for (let k = 0; k < path.length; k += 2) {
    const next = Math.min(k + 2, path.length - 2);
    if (fromSegment(x, y, path[k], path[k + 1], path[next], path[next + 1]) <= reach) return true;
  }
  return false;
};

const dense = (points, step) => {
  const found = [points[0], points[1]];
  for (let k = 2; k < points.length; k += 2) {
    const [ax, ay, bx, by] = points.slice(k - 2, k + 2);
    const parts = Math.min(200, Math.max(1, Math.ceil(Math.hypot(bx - ax, by - ay) / step)));
    for (let part = 1; part <= parts; part++) found.push(rounded(ax + (bx - ax) * part / parts), rounded(ay + (by - ay) * part / parts));
  }
  return found;
};
