// The right picture: the surface as normal map, in the light of a lamp, or in the material of a glazed ball.

import { colours, putInk } from "./drawing.js";

const AMBIENT = 0.04, VIEWER = 0.10, LAMP = 0.95, FILL = 0.08, CLAY = [0.80, 0.77, 0.73]; // as export/shading/colours.py
export const LAMP_AT = { azimuth: 130 * Math.PI / 180, elevation: 38 * Math.PI / 180 };
const LEVELS = 8192, FINE = 32767;
const SCREEN = Uint8ClampedArray.from({ length: LEVELS + 1 }, (_, k) => {
  const light = k / LEVELS;
  return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
});
const screen = light => SCREEN[Math.max(0, Math.min(LEVELS, Math.round(light * LEVELS)))];
const unit = ([x, y, z]) => { const long = Math.hypot(x, y, z); return [x / long, y / long, z / long]; };
const direction = ({ azimuth, elevation }) => [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];

const KEY = unit([-0.52, 0.60, 0.61]), WALL = unit([0.75, -0.40, 0.53]), HALF = unit([KEY[0], KEY[1], KEY[2] + 1]);
const KEY_COLOUR = [1.05, 0.98, 0.88], WALL_COLOUR = [0.10, 0.18, 0.34], FLOOR = [0.05, 0.04, 0.04], BODY = [0.66, 0.19, 0.09];

function ball(x, y, z, c) {
  const key = Math.max((x * KEY[0] + y * KEY[1] + z * KEY[2] + 0.25) / 1.25, 0) ** 1.5, side = Math.max(x * WALL[0] + y * WALL[1] + z * WALL[2], 0);
  const gloss = Math.max(x * HALF[0] + y * HALF[1] + z * HALF[2], 0) ** 38, rim = Math.max(1 - z, 0) ** 3, soft = key * KEY_COLOUR[c];
  return BODY[c] * (soft + side * WALL_COLOUR[c] + FLOOR[c]) + 0.4 * gloss * KEY_COLOUR[c] + 0.55 * rim * (WALL_COLOUR[c] + 0.25 * soft);
}

function shade(surface, kind, lamp) {
  const { width, height, normals, opacity } = surface, image = new ImageData(width, height), out = image.data;
  const [lx, ly, lz] = direction(lamp), [fx, fy, fz] = direction({ azimuth: lamp.azimuth + Math.PI, elevation: lamp.elevation / 2 });
  for (let n = 0, k = 0; k < out.length; n++, k += 4) {
    out[k + 3] = opacity[n];
    if (!opacity[n]) continue;
    const x = normals[2 * n] / FINE, y = normals[2 * n + 1] / FINE, z = Math.sqrt(Math.max(0, 1 - x * x - y * y));
    if (kind === "normals") { out[k] = 127.5 * (x + 1); out[k + 1] = 127.5 * (y + 1); out[k + 2] = 127.5 * (z + 1); continue; }
    if (kind === "matcap") { for (let c = 0; c < 3; c++) out[k + c] = screen(ball(x, y, z, c)); continue; }
    const light = AMBIENT + VIEWER * z + LAMP * Math.max(x * lx + y * ly + z * lz, 0) + FILL * Math.max(x * fx + y * fy + z * fz, 0);
    for (let c = 0; c < 3; c++) out[k + c] = screen(light * CLAY[c]);
  }
  return image;
}

/** The surface turned inside out: the same normals, mirrored. */
export function mirrored(surface) {
  return { ...surface, normals: surface.normals.map(each => -each), shown: null };
}

/** Slant and tilt in degrees of an arrow in the picture; reach: length of the longest arrow. */
export const leaning = (dx, dy, reach) => ({
  slant: Math.min(80, 80 * Math.hypot(dx, dy) / reach), tilt: Math.atan2(-dy, dx) * 180 / Math.PI,
});

/** The tip of the arrow of a hint. */
export const tipOf = ({ x, y, slant, tilt }, reach) => {
  const long = reach * slant / 80, angle = tilt * Math.PI / 180;
  return [x + long * Math.cos(angle), y - long * Math.sin(angle)];
};

export function paintSurface(view, { surface, frame, kind, lamp, strokes, hints, live, spot }) {
  const context = view.begin(view.canvas);
  if (!frame) return;
  if (surface) {
    const key = `${kind} ${kind === "shaded" ? `${lamp.azimuth} ${lamp.elevation}` : ""}`;
    if (surface.shown?.key !== key) {
      const picture = surface.shown?.picture ?? document.createElement("canvas");
      picture.width = surface.width; picture.height = surface.height;
      picture.getContext("2d").putImageData(shade(surface, kind, lamp), 0, 0);
      surface.shown = { key, picture };
    }
    context.imageSmoothingQuality = "high";
    context.drawImage(surface.shown.picture, ...surface.box);
  }
  const reach = reachOf(frame), thin = 1 / view.scale;
  context.globalAlpha = 0.7;
  if (surface) putInk(context, view, strokes, { cut: 1.5, line: 1.5 });
  context.globalAlpha = 1;
  for (const hint of live ? [...hints, live] : hints) {
    const [x, y] = tipOf(hint, reach), angle = hint.tilt * Math.PI / 180;
    for (const [colour, width] of [["#fffc", 5], [colours().minus, 2.5]]) {
      context.strokeStyle = context.fillStyle = colour; context.lineWidth = width * thin; context.beginPath();
      context.moveTo(hint.x, hint.y); context.lineTo(x, y);
      for (const side of [2.6, -2.6]) { context.moveTo(x, y); context.lineTo(x + 9 * thin * Math.cos(angle + side), y - 9 * thin * Math.sin(angle + side)); }
      context.stroke(); context.beginPath(); context.arc(hint.x, hint.y, (width + 1) * thin, 0, 7); context.fill();
    }
  }
  view.drawPlaces(context, spot);
}

export const reachOf = frame => 0.3 * frame.pixel * Math.max(frame.rows, frame.columns);
