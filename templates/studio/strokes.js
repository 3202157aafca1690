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

/** Whether a path ends about where it began, far from a mere dot. */
export function isClosed(points) {
  const [left, top, right, bottom] = boxOf({ points }), [x, y] = points.slice(-2);
  return points.length > 16 && Math.hypot(x - points[0], y - points[1]) < 0.15 * Math.max(right - left, bottom - top);
}

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
    return split(stroke, dense(samplesOf(stroke), reach / 2), ([x, y]) => !near(path, x, y, reach));
  });
}

/** The parts of a stroke on a page. */
export function clipped(stroke, [x, y, wide, high]) {
  const low = [x, y], most = [x + wide, y + high], samples = samplesOf(stroke), crossed = samples.slice(0, 1);
  for (let k = 1; k < samples.length; k++) {
    const [from, to] = [samples[k - 1], samples[k]], places = [];
    for (const axis of [0, 1]) for (const border of [low[axis], most[axis]]) {
      const t = (border - from[axis]) / (to[axis] - from[axis]);
      if (t > 0 && t < 1) { const sample = between(from, to, t); sample[axis] = border; places.push([t, sample]); }
    }
    crossed.push(...places.sort((a, b) => a[0] - b[0]).map(([, sample]) => sample), to);
  }
  return split(stroke, crossed, sample => [0, 1].every(axis => sample[axis] >= low[axis] && sample[axis] <= most[axis]));
}

/** A stroke at another place. */
export const moved = (stroke, shift) => ({ ...stroke, points: stroke.points.map((value, k) => rounded(value + shift[k % 2])) });

/** The shift of strokes nearest to a wanted one that keeps them on a page, or the page under them if they are larger. */
export function fitShift(strokes, [x, y, wide, high], shift) {
  const [left, top, right, bottom] = boxOf({ points: strokes.flatMap(boxOf) });
  return [[x - left, x + wide - right], [y - top, y + high - bottom]].map((room, axis) => {
    return Math.max(Math.min(...room), Math.min(Math.max(...room), shift[axis]));
  });
}

/** Points x, y, x, y, ... on the other side of an axis x, y, x, y. */
export function reflected(points, [ax, ay, bx, by]) {
  const dx = bx - ax, dy = by - ay, long = dx * dx + dy * dy || 1;
  return points.map((value, k) => {
    const even = k - k % 2, away = 2 * ((points[even] - ax) * dy - (points[even + 1] - ay) * dx) / long;
    return rounded(k % 2 ? value + away * dx : value - away * dy);
  });
}

/** A path with its reflection. Ends within a reach of the axis are moved onto it; a path along the axis has none. */
export function withReflection(path, axis, reach) {
  if (!axis) return [path];
  const there = reflected(path, axis), isNear = (_, k) => Math.hypot(path[k] - there[k], path[k ^ 1] - there[k ^ 1]) < 2 * reach;
  const isAlong = path.every(isNear), isEnd = k => k < 2 || k >= path.length - 2;
  const pulled = path.map((value, k) => isNear(value, k) && (isAlong || isEnd(k)) ? rounded((value + there[k]) / 2) : value);
  return isAlong ? [pulled] : [pulled, reflected(pulled, axis)];
}

// Samples x, y, pressure of a stroke; without pressures the third is its weight.
const samplesOf = ({ points, pressures, weight }) => Array.from({ length: points.length / 2 }, (_, k) => [points[2 * k], points[2 * k + 1], pressures?.[k] ?? weight]);
const between = (from, to, t) => from.map((value, k) => rounded(value + t * (to[k] - value)));

/** The runs of samples that are kept, as strokes; the stroke itself if all are. */
function split(stroke, samples, isKept) {
  const runs = [[]];
  for (const sample of samples) if (isKept(sample)) runs.at(-1).push(sample); else if (runs.at(-1).length) runs.push([]);
  if (runs[0].length === samples.length) return [stroke];
  return runs.filter(run => run.length > 1).map(run => ({
    ...stroke, points: run.flatMap(([x, y]) => [x, y]), ...stroke.pressures && { pressures: run.map(([, , pressure]) => pressure) },
  }));
}

const near = (path, x, y, reach) => {
  for (let k = 0; k < path.length; k += 2) {
    const next = Math.min(k + 2, path.length - 2);
    if (fromSegment(x, y, path[k], path[k + 1], path[next], path[next + 1]) <= reach) return true;
  }
  return false;
};

const dense = (samples, step) => samples.flatMap((to, k) => {
  if (!k) return [to];
  const from = samples[k - 1], parts = Math.min(200, Math.max(1, Math.ceil(Math.hypot(to[0] - from[0], to[1] - from[1]) / step)));
  return Array.from({ length: parts }, (_, part) => between(from, to, (part + 1) / parts));
});
