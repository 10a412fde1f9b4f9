// The interaction matrix of the shown instant: numbers, rank, condition, and motions that no feature sees.

import { element, find } from "./view.js";

const MATRIX_PERIOD = 200; // least milliseconds between two requests
const MOTION_UNITS = { v_x: "m/s", v_y: "m/s", v_z: "m/s", omega_x: "rad/s", omega_y: "rad/s", omega_z: "rad/s" };
const MOTION_SIGNS = { omega_x: "ω x", omega_y: "ω y", omega_z: "ω z", v_x: "v x", v_y: "v y", v_z: "v z" };

export class MatrixPanel {
  // `ask` sends a request to the studio.
  constructor(clock, ask) {
    Object.assign(this, { clock, ask, chosen: 0, asked: 0, message: null });
    this.place = element("details", "", "matrix");
    this.place.id = "matrix";
    this.body = element("div");
    const title = element("summary", "interaction matrix");
    title.title = "the matrix L of the shown instant (m)";
    this.place.append(title, this.body);
    find("texts").before(this.place);
    this.place.addEventListener("toggle", () => this.renew());
    clock.listen(() => this.renew());
  }

  toggle() {
    this.place.open = !this.place.open;
    this.opening = this.place.open; // scroll to the table once it is there
  }

  // Ask for the matrix of the shown instant, at most once in a period.
  renew() {
    if (!this.place.open || this.waiting) return;
    const wait = this.asked + MATRIX_PERIOD - performance.now();
    if (wait > 0) {
      this.waiting = setTimeout(() => {
        this.waiting = undefined;
        this.renew();
      }, wait);
      return;
    }
    this.asked = performance.now();
    this.ask({ interaction: this.clock.index });
  }

  tell(message) {
    this.message = message;
    if (this.place.open) this.show();
  }

  show() {
    const { matrices, reason, time } = this.message;
    if (!matrices.length) return this.body.replaceChildren(element("p", reason, "reason"));
    const shown = matrices[Math.min(this.chosen, matrices.length - 1)];
    const parts = [this.choice(matrices, shown), matrixTable(shown), ...matrixFacts(shown, time)];
    const focused = this.body.contains(document.activeElement);
    const left = this.body.querySelector(".numbers")?.scrollLeft ?? 0;
    this.body.replaceChildren(...parts);
    this.body.querySelector(".numbers").scrollLeft = left;
    if (focused) this.body.querySelector("select").focus({ preventScroll: true });
    if (this.opening) this.place.scrollIntoView({ block: "nearest" });
    this.opening = false;
    return undefined;
  }

  choice(matrices, shown) {
    const select = element("select");
    select.setAttribute("aria-label", "matrix");
    for (const each of matrices) select.append(new Option(each.title, each.title, false, each === shown));
    select.addEventListener("change", () => {
      this.chosen = select.selectedIndex;
      this.show();
    });
    return select;
  }
}

// A table of numbers with the same decimals, shaded by their size within each column.
function matrixTable({ matrix, rows, columns }) {
  const table = element("table");
  const head = table.createTHead().insertRow();
  for (const name of ["", ...columns]) {
    const cell = element("th", MOTION_SIGNS[name] ?? name);
    if (MOTION_UNITS[name]) cell.title = `per ${MOTION_UNITS[name]}`;
    head.append(cell);
  }
  const body = table.createTBody();
  const largest = columns.map((_, j) => Math.max(...matrix.map((row) => Math.abs(row[j] ?? 0))));
  const decimals = decimalsFor(Math.max(...largest));
  matrix.forEach((row, i) => {
    const line = body.insertRow();
    const name = element("th", rows[i].replace(/ of marks? /, " "));
    name.title = rows[i];
    line.append(name);
    row.forEach((number, j) => line.append(numberCell(number, largest[j], decimals)));
  });
  const frame = element("div", "", "numbers");
  frame.append(table);
  return frame;
}

function numberCell(number, largest, decimals) {
  const text = number === null ? "?" : number.toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1");
  const cell = element("td", /^0(\.0*)?$/.test(text) && Math.abs(number) < 1e-9 ? "0" : text.replace("-", "−"));
  const share = largest && number !== null ? Math.abs(number) / largest : 0;
  cell.style.setProperty("--share", `${Math.round(45 * share)}%`);
  return cell;
}

// Decimals that show about three digits of the largest number.
function decimalsFor(largest) {
  if (!(largest > 0)) return 0;
  return Math.min(Math.max(2 - Math.floor(Math.log10(largest)), 0), 6);
}

// Rank, condition and singular values, and the motions that change no feature.
function matrixFacts({ rank, full, tolerance, condition, singular, free, left_out: hidden }, time) {
  if (rank === null) return [element("p", "A mark is behind the camera: the matrix is not known.", "reason")];
  const line = element("p", `rank ${rank} of ${full} · condition ${matrixNumber(condition)} · at ${time.toFixed(2)} s`, "rank");
  line.title = `singular values above ${tolerance} of the largest count: ${singular.map(matrixNumber).join(", ")}`;
  line.classList.toggle("lacking", rank < full);
  const list = element("ul");
  for (const each of free) list.append(element("li", each));
  const words = free.length ? "No feature sees these motions:" : "Every motion changes a feature.";
  const rest = hidden ? [element("p", `${hidden} more rows`, "reason")] : [];
  return [...rest, line, element("p", words), ...(free.length ? [list] : [])];
}

function matrixNumber(x) {
  if (x === null) return "?";
  if (x !== 0 && (Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3)) return x.toExponential(1);
  return String(Number(x.toPrecision(3)));
}
