// A click, or Enter, on a column's heading sorts by it: rising, falling, and then as it was.
const UNITS = { "µs": 1e-6, ms: 1e-3, s: 1, min: 60, h: 3600 };
const NUMBER = /^[<>≤≥~\s]*([+\-−]?[\d,]*\.?\d+(?:e[+-]?\d+)?)\s*(µs|ms|s|min|h)?(?![a-zA-Zµ\d])/;

// What a cell is sorted by: its number, a time in seconds, or its text; null if it is empty.
const worth = (text) => {
  if (text === "" || text === "–") return null;
  const found = NUMBER.exec(text);
  return found ? Number(found[1].replaceAll(",", "").replace("−", "-")) * (UNITS[found[2]] ?? 1) : text;
};

const compare = (a, b) => {
  if (typeof a === typeof b) return typeof a === "number" ? a - b : a.localeCompare(b, "en", { numeric: true });
  return typeof a === "number" ? -1 : 1;
};

// Rows by a column; what is empty stays last either way, and equal rows stay as they were.
const sorted = (rows, column, direction) => {
  const keyed = rows.map((row) => [worth(row.cells[column].textContent.trim()), row]);
  keyed.sort(([a], [b]) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return direction * compare(a, b);
  });
  return keyed.map(([, row]) => row);
};

const makeSortable = (table) => {
  const body = table.tBodies[0];
  const original = [...body.rows];
  if (original.length < 2) return;
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = make("button", { type: "button", title: "sort by this column" }, ...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const next = { ascending: "descending", descending: "" }[head.getAttribute("aria-sort")] ?? "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      if (next) head.setAttribute("aria-sort", next);
      body.append(...(next ? sorted(original, column, next === "ascending" ? 1 : -1) : original));
    });
  });
};

// A long table lies deflated in the page until somebody opens it.
const unfold = async (holder) => {
  const text = new TextDecoder().decode(await unpack(holder.dataset.packed));
  const [names, kinds, ...rows] = text.split("\n").map((line) => line.split("\t"));
  const fill = (row, tag, cells) => {
    cells.forEach((cell, i) => row.append(make(tag, { className: kinds[i], textContent: cell })));
    return row;
  };
  const table = make("table", {}, make("caption", { textContent: holder.dataset.caption }));
  table.createTHead().append(fill(make("tr"), "th", names));
  table.append(make("tbody", {}, ...rows.map((row) => fill(make("tr"), "td", row))));
  table.querySelectorAll("th").forEach((head) => head.setAttribute("scope", "col"));
  holder.replaceChildren(table);
  makeSortable(table);
};

document.querySelectorAll("main table").forEach(makeSortable);
document.querySelectorAll("[data-packed]").forEach((holder) => {
  holder.closest("details").addEventListener("toggle", () => unfold(holder), { once: true });
});
