// Pointers and keys of a picture: one finger or the pen uses the tool, two fingers and the wheel zoom and move.

/** Lets pointers and keys of a view use a tool. refresh: paints, with false only what follows the pointer. */
export function listen(view, tool, { hover, refresh }) {
  const { canvas } = view, down = new Map();
  const middle = () => [...down.values()].reduce(([x, y], each) => [x + each.clientX / down.size, y + each.clientY / down.size], [0, 0]);
  const spread = () => { const [a, b] = [...down.values()]; return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY); };
  const pressure = event => event.pointerType === "pen" && event.pressure ? event.pressure : 1;
  canvas.addEventListener("pointerdown", event => {
    canvas.focus({ preventScroll: true }); view.cursor = null;
    try { canvas.setPointerCapture(event.pointerId); } catch { /* the pointer is gone */ }
    down.set(event.pointerId, event);
    if (down.size > 1 || event.button === 1) tool.cancel(); else if (event.button === 0) tool.begin(view.at(event), pressure(event));
  });
  canvas.addEventListener("pointermove", event => {
    const before = down.get(event.pointerId);
    if (before && (down.size > 1 || before.buttons & 4)) {
      const [x, y] = middle(), wide = down.size > 1 ? spread() : 1;
      down.set(event.pointerId, event);
      const [nx, ny] = middle(), place = canvas.getBoundingClientRect();
      view.zoom(down.size > 1 ? spread() / wide : 1, x - place.left, y - place.top, nx - x, ny - y); refresh();
    } else if (before) for (const each of event.getCoalescedEvents?.().length ? event.getCoalescedEvents() : [event]) tool.move(view.at(each), pressure(each));
    hover(event);
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, event => {
    if (down.delete(event.pointerId) && !down.size) kind === "pointerup" ? tool.end() : tool.cancel();
  });
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const place = canvas.getBoundingClientRect();
    view.zoom(Math.exp(-Math.max(-60, Math.min(60, event.deltaY)) / 250), event.clientX - place.left, event.clientY - place.top); refresh();
  }, { passive: false });
  canvas.addEventListener("focus", () => { refresh(false); });
  canvas.addEventListener("blur", () => { if (view.cursor) { view.cursor = null; tool.end(); } });
  let held = false;
  canvas.addEventListener("keydown", event => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way && event.key !== " " && event.key !== "Enter" || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    if (!view.cursor) { held = false; view.cursor = [(view.wide / 2 - view.x) / view.scale, (view.high / 2 - view.y) / view.scale]; }
    if (way) {
      const far = (event.shiftKey ? 40 : 8) / view.scale;
      view.cursor = view.cursor.map((value, k) => value + far * way[k]);
      if (held) tool.move(view.cursor, 1);
    } else if (event.key === "Enter") { held = false; tool.begin(view.cursor, 1); tool.end(); }
    else { held = !held; held ? tool.begin(view.cursor, 1) : tool.end(); }
    refresh(false);
  });
}
