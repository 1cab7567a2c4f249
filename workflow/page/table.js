// Sorts the table by the column whose head is pressed; pressed again, the other way round.
const heads = [...document.querySelectorAll("thead th")];
const body = document.querySelector("tbody");
const collator = new Intl.Collator(undefined, { numeric: true });

// What a row is sorted by: a number or a text; empty cells come last.
function sortKey(row, column) {
  const cell = row.cells[column];
  const text = cell.dataset.value ?? cell.textContent;
  return cell.classList.contains("number") ? Number(text) : text;
}

function compare(a, b) {
  return typeof a === "number" ? a - b : collator.compare(a, b);
}

function sortBy(column) {
  const head = heads[column];
  const order = head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
  const sign = order === "ascending" ? 1 : -1;
  for (const other of heads) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", order);
  const rows = [...body.rows].map((row) => ({ row, key: sortKey(row, column) }));
  rows.sort((a, b) => (a.key === "") - (b.key === "") || sign * compare(a.key, b.key));
  body.append(...rows.map(({ row }) => row));
  document.querySelector("#sorting").textContent = `Sorted by ${head.textContent}, ${order}.`;
}

heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => sortBy(column)));
