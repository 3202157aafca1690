// Sorting and filtering of tables, and buttons that copy. Without it every page is whole, only still.
"use strict";

const collator = new Intl.Collator("en", { numeric: true });

function keyOf(cell) {
  const given = cell.dataset.v;
  if (given === undefined) return cell.textContent.trim();
  return given === "" ? null : Number(given);
}

function compare(a, b) {
  return typeof a === "number" && typeof b === "number" ? a - b : collator.compare(a, b);
}

// Rows in a new order; those without a value come last either way, and equal ones keep the library's order.
function sortRows(table, rows, column, descending) {
  const sign = descending ? -1 : 1;
  const keyed = rows.map((row, place) => ({ row, place, key: column < 0 ? place : keyOf(row.cells[column]) }));
  keyed.sort((a, b) => {
    if (a.key === null || b.key === null) return (a.key === null) - (b.key === null) || a.place - b.place;
    return sign * compare(a.key, b.key) || a.place - b.place;
  });
  table.tBodies[0].append(...keyed.map((each) => each.row));
  [...table.tHead.rows[0].cells].forEach((head, place) => {
    head.setAttribute("aria-sort", place !== column ? "none" : descending ? "descending" : "ascending");
  });
}

// Turn the heads of a table into buttons; `changed` hears what was chosen.
function sortable(table, changed) {
  const rows = [...table.tBodies[0].rows];
  const heads = [...table.tHead.rows[0].cells];
  const names = heads.map((head) => head.textContent.trim().toLowerCase().replaceAll(" ", "-"));
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    head.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      sortRows(table, rows, column, descending);
      changed(names[column], descending);
    });
  });
  return (name, descending) => sortRows(table, rows, names.indexOf(name), descending);
}

// The table of all entries: filters, and a state that stands behind the # of the address.
function filterable(table, form, told) {
  const rows = [...table.tBodies[0].rows].map((row) => ({ row, text: row.textContent.toLowerCase().replace(/\s+/g, " ") }));
  const fields = [...form.elements].filter((field) => field.name);
  const state = { sort: "", order: "" };

  function apply() {
    const chosen = Object.fromEntries(fields.map((field) => [field.name, field.value]));
    const words = chosen.q.toLowerCase().split(/\s+/).filter(Boolean);
    delete chosen.q;
    const wanted = Object.entries(chosen).filter(([, value]) => value);
    let count = 0;
    for (const { row, text } of rows) {
      const shown = words.every((word) => text.includes(word)) && wanted.every(([name, value]) => row.dataset[name] === value);
      row.hidden = !shown;
      count += shown;
    }
    told.textContent = `${count} of ${rows.length} entries`;
  }

  function remember() {
    const found = new URLSearchParams();
    for (const field of fields) if (field.value) found.set(field.name, field.value);
    for (const key of ["sort", "order"]) if (state[key]) found.set(key, state[key]);
    history.replaceState(null, "", found.size ? `#${found}` : location.pathname + location.search);
  }

  const sort = sortable(table, (name, descending) => {
    Object.assign(state, { sort: name, order: descending ? "descending" : "" });
    remember();
  });

  function recall() {
    const text = location.hash.slice(1);
    if (text && !text.includes("=")) return; // a place on the page, no state
    const found = new URLSearchParams(text);
    for (const field of fields) {
      field.value = found.get(field.name) ?? "";
      if (field.selectedIndex === -1) field.value = "";
    }
    Object.assign(state, { sort: found.get("sort") ?? "", order: found.get("order") ?? "" });
    sort(state.sort, state.order === "descending");
    apply();
  }

  form.hidden = false;
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => { apply(); remember(); });
  form.addEventListener("reset", (event) => {
    event.preventDefault(); // the fields would be empty only after this
    for (const field of fields) field.value = "";
    apply();
    remember();
  });
  addEventListener("hashchange", recall);
  apply();
  recall();
}

// A button that copies a text; where the browser does not allow that, the text is selected.
function copyable(block) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "copy";
  button.textContent = "Copy";
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(block.textContent);
      button.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(block);
      button.textContent = "Selected";
    }
  });
  block.before(button);
}

// The check sum that a zip archive asks for.
const CRC = Uint32Array.from({ length: 256 }, (_, number) => {
  for (let bit = 0; bit < 8; bit++) number = number & 1 ? 0xedb88320 ^ (number >>> 1) : number >>> 1;
  return number;
});

function crc32(bytes) {
  let found = 0xffffffff;
  for (const byte of bytes) found = CRC[(found ^ byte) & 255] ^ (found >>> 8);
  return ~found >>> 0;
}

function record(...numbers) { // pairs of bytes and value, little-endian
  const bytes = new Uint8Array(numbers.reduce((sum, [width]) => sum + width, 0));
  let place = 0;
  for (const [width, number] of numbers) {
    for (let each = 0; each < width; each++) bytes[place++] = (number / 256 ** each) & 255;
  }
  return bytes;
}

// A zip archive of files by name, as they are: the large ones are compressed already.
function zipped(files) {
  const parts = [], listed = [];
  let offset = 0;
  for (const [name, bytes] of files) {
    const path = new TextEncoder().encode(name);
    const facts = [[2, 20], [2, 0x800], [2, 0], [2, 0], [2, 33], [4, crc32(bytes)], [4, bytes.length], [4, bytes.length], [2, path.length], [2, 0]];
    listed.push(record([4, 0x02014b50], [2, 20], ...facts, [2, 0], [2, 0], [2, 0], [4, 0], [4, offset]), path);
    const head = record([4, 0x04034b50], ...facts);
    parts.push(head, path, bytes);
    offset += head.length + path.length + bytes.length;
  }
  const size = listed.reduce((sum, each) => sum + each.length, 0);
  const end = record([4, 0x06054b50], [2, 0], [2, 0], [2, files.size], [2, files.size], [4, size], [4, offset], [2, 0]);
  return new Blob([...parts, ...listed, end], { type: "application/zip" });
}

// A button that downloads the files of entries: of those that it names, or of all that the table shows.
function archivable(block) {
  const [button, told] = [block.querySelector("button"), block.querySelector("[role=status]")];
  const folder = `${block.dataset.root}files/`;
  const named = () => block.dataset.archive.split(" ").filter(Boolean);
  const shown = () => [...document.querySelectorAll("#table tbody tr:not([hidden]) th a")].map((link) => link.href.match(/([^/]+)\.html$/)[1]);

  async function fetched(name) {
    const answer = await fetch(folder + name);
    if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
    return new Uint8Array(await answer.arrayBuffer());
  }

  async function collect() {
    if (location.protocol === "file:") throw new Error("browsers read no files next to a page in a folder");
    const names = named().length ? named() : shown();
    if (!names.length) throw new Error("no entry is shown");
    const files = new Map();
    for (const [place, name] of names.entries()) {
      told.textContent = `${place + 1} of ${names.length} entries`;
      const sidecar = await fetched(`${name}.json`);
      files.set(`${name}.json`, sidecar);
      const document = JSON.parse(new TextDecoder().decode(sidecar));
      for (const file of [document.instance.file, ...document.files.map((each) => each.name)]) {
        if (!files.has(file)) files.set(file, await fetched(file));
      }
    }
    const link = window.document.createElement("a");
    link.href = URL.createObjectURL(zipped(files));
    link.download = `${names.length === 1 ? names[0] : `${names.length}_entries`}.zip`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    told.textContent = `${link.download} has ${files.size} files`;
  }

  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      await collect();
    } catch (error) {
      told.textContent = `No archive: ${error.message}. Serve the site over HTTP, or run: crossfield library get`;
    }
    button.disabled = false;
  });
  block.hidden = false;
}

const form = document.getElementById("filters");
for (const table of document.querySelectorAll("table[data-sortable]")) {
  if (form && table.id === "table") filterable(table, form, document.getElementById("told"));
  else sortable(table, () => {});
}
document.querySelectorAll("[data-copy]").forEach(copyable);
document.querySelectorAll("[data-archive]").forEach(archivable);
