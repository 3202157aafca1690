// Pointers and keys of a picture. The pen, the mouse and the keyboard use its tool; a finger uses it where fingers draw,
// and otherwise taps, while its swipes scroll the page; two fingers, the wheel, and the space bar move and zoom the view.

const PALM = 800; // milliseconds after the pen in which a touch may be the palm
const TAP = 10; // pixels of the screen that a finger moves at most in a tap
const ERASER = { button: 5, buttons: 32 }; // the other end of a pen
const pen = { down: false, at: -Infinity, seen: false };
const space = { held: false, moved: false };
const isPalm = event => pen.down || event.timeStamp - pen.at < PALM;

/** Watches for a pen on the pictures, and calls a function when it comes for the first time. */
export function watchPen(first) {
  for (const kind of ["pointerdown", "pointermove", "pointerup", "pointercancel"]) document.addEventListener(kind, event => {
    if (event.pointerType !== "pen" || event.target.localName !== "canvas") return; // elsewhere, its release can be missed
    pen.down = kind === "pointerdown" || kind === "pointermove" && pen.down; pen.at = event.timeStamp;
    if (!pen.seen) first();
    pen.seen = true;
  }, true);
  stopTouches(document, () => pen.down);
}

const hold = held => { space.held = held; document.documentElement.toggleAttribute("data-moves", held); };
addEventListener("keydown", event => {
  if (event.key !== " " || event.repeat) return;
  hold(true); space.moved = false;
  if (event.target === document.body && document.querySelector("canvas:hover")) event.preventDefault(); // it would scroll the page
});
addEventListener("keyup", event => { if (event.key === " ") hold(false); });
addEventListener("blur", () => hold(false));

/** Keeps the browser from scrolling, zooming and clicking by touches. */
function stopTouches(target, isStopped) {
  for (const kind of ["touchstart", "touchmove"]) target.addEventListener(kind, event => { if (event.cancelable && isStopped(event)) event.preventDefault(); }, { passive: false });
}

const readContact = ({ pointerType, pressure, button, buttons, shiftKey }) => ({
  straight: shiftKey,
  pressure: pointerType === "pen" ? Math.max(0.05, pressure) : 1, erasing: button === ERASER.button || (buttons & ERASER.buttons) > 0, coarse: pointerType === "touch",
});

/** Lets pointers and keys of a view use a tool.
 * The tool begins, moves, ends or cancels, taps, nudges, and learns of a finger that does nothing (refuse).
 * hover: what a pointer does without the tool. refresh: paints, with false only what follows the pointer. fingers: whether they draw. */
export function listen(view, tool, { hover, refresh, fingers }) {
  const { canvas } = view, down = new Map();
  let user = null, gesture = false, held = false, nudging = false; // user: the pointer that uses the tool
  const middle = () => [...down.values()].reduce(([x, y], each) => [x + each.clientX / down.size, y + each.clientY / down.size], [0, 0]);
  const spread = () => { const [a, b] = [...down.values()]; return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY); };
  const stop = () => { if (user !== null) tool.cancel(); user = null; };
  const release = () => { if (held || nudging) tool.end(); held = nudging = false; };
  const drop = () => { stop(); down.clear(); gesture = false; };
  stopTouches(canvas, event => event.targetTouches.length > 1 || fingers() || isPalm(event));
  canvas.addEventListener("pointerdown", event => {
    const touch = event.pointerType === "touch";
    if (touch && (pen.down || [...down.values()].some(each => each.pointerType !== "touch"))) return; // the palm beside the pen
    if (!touch) drop(); // the palm before the pen
    release(); canvas.focus({ preventScroll: true }); view.cursor = null;
    try { canvas.setPointerCapture(event.pointerId); } catch { /* the pointer is gone */ }
    down.set(event.pointerId, event);
    if (down.size > 1 || event.button === 1 || space.held) { stop(); gesture = true; space.moved = space.held; }
    else if (touch ? fingers() && !isPalm(event) : [0, ERASER.button].includes(event.button)) { user = event.pointerId; tool.begin(view.at(event), readContact(event)); }
  });
  canvas.addEventListener("pointermove", event => {
    const before = down.get(event.pointerId);
    if (before && pen.down && event.pointerType === "touch") { drop(); return; }
    if (before && (down.size > 1 || gesture && event.pointerType !== "touch")) {
      const [x, y] = middle(), wide = down.size > 1 ? spread() : 1;
      down.set(event.pointerId, event);
      const [nx, ny] = middle(), place = canvas.getBoundingClientRect();
      view.zoom(down.size > 1 ? spread() / wide : 1, x - place.left, y - place.top, nx - x, ny - y); refresh();
    } else if (event.pointerId === user) for (const each of event.getCoalescedEvents?.().length ? event.getCoalescedEvents() : [event]) tool.move(view.at(each), readContact(each));
    hover(event);
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, event => {
    const before = down.get(event.pointerId), still = before && Math.hypot(event.clientX - before.clientX, event.clientY - before.clientY) < TAP;
    if (!down.delete(event.pointerId)) return;
    if (event.pointerType === "touch" && event.pointerId !== user && !gesture && !isPalm(before) && (kind === "pointercancel" || !still)) tool.refuse();
    if (kind === "pointercancel") stop();
    else if (event.pointerId === user) tool.end();
    else if (event.pointerType === "touch" && still && !gesture && !isPalm(event)) tool.tap(view.at(event), readContact(event));
    if (event.pointerId === user) user = null;
    if (!down.size) gesture = false;
  });
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const place = canvas.getBoundingClientRect();
    view.zoom(Math.exp(-Math.max(-60, Math.min(60, event.deltaY)) / 250), event.clientX - place.left, event.clientY - place.top); refresh();
  }, { passive: false });
  canvas.addEventListener("focus", () => { refresh(false); });
  canvas.addEventListener("blur", () => { release(); view.cursor = null; refresh(false); });
  canvas.addEventListener("keydown", event => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way && event.key !== " " && event.key !== "Enter" || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    if (event.key === " ") return; // once it is released: it may be held for the pointer
    const far = (event.shiftKey ? 40 : 8) / view.scale;
    if (way && !view.cursor && tool.nudge(way.map(part => part * far / 4))) { nudging = true; return; }
    aim();
    if (way) {
      view.cursor = view.cursor.map((value, k) => value + far * way[k]);
      if (held) tool.move(view.cursor);
    } else { held = false; tool.begin(view.cursor); tool.end(); }
    refresh(false);
  });
  const aim = () => { if (!view.cursor) { held = false; view.cursor = [(view.wide / 2 - view.x) / view.scale, (view.high / 2 - view.y) / view.scale]; } };
  canvas.addEventListener("keyup", event => {
    if (nudging && event.key.startsWith("Arrow")) release();
    if (event.key !== " " || space.moved || event.ctrlKey || event.metaKey) return;
    aim(); held = !held; held ? tool.begin(view.cursor) : tool.end(); refresh(false);
  });
}
