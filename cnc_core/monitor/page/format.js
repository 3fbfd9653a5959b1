// Numbers as people read them, and the few steps with the document that all views share.

export const byId = (id) => document.getElementById(id);

/** A number with so many places behind the point; "-" where there is none. */
export function fixed(value, places = 3) {
  return typeof value === "number" && Number.isFinite(value) ? value.toFixed(places) : "-";
}

/** Any value of a symbol. */
export function shown(value) {
  if (value === null || value === undefined) return "-";
  if (typeof value === "boolean") return value ? "TRUE" : "FALSE";
  if (typeof value === "number" && !Number.isInteger(value)) return String(Number(value.toPrecision(9)));
  return String(value);
}

/** A new element with text; attributes by name. */
export function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  if (text !== "") made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

/** Write a text only where it differs: a screen reader is told of changes alone. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** The rows of a table's body; cells that are numbers begin with "=". */
export function fillRows(body, rows, classes = []) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((cells, i) => {
    const row = body.rows[i] || body.insertRow();
    if ((row.className || "") !== (classes[i] || "")) row.className = classes[i] || "";
    while (row.cells.length > cells.length) row.deleteCell(-1);
    cells.forEach((cell, k) => {
      const place = row.cells[k] || row.insertCell();
      const span = cells.length === 1 ? 9 : 1; // one text alone has the whole row
      if (place.colSpan !== span) place.colSpan = span;
      const number = String(cell).startsWith("=");
      if (place.className !== (number ? "n" : "")) place.className = number ? "n" : "";
      setText(place, number ? cell.slice(1) : String(cell));
    });
  });
}

/** Colours that the colour-blind tell apart (Okabe and Ito). */
export const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/** A colour of the page's style. */
export const styleColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
