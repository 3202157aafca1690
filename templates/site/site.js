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

const form = document.getElementById("filters");
for (const table of document.querySelectorAll("table[data-sortable]")) {
  if (form && table.id === "table") filterable(table, form, document.getElementById("told"));
  else sortable(table, () => {});
}
document.querySelectorAll("[data-copy]").forEach(copyable);
