// Curves over time, with a line at the displayed instant.

import { uPlot } from "./vendor.js";

const [BAND_WIDTH, BAND_ALPHA] = [7, 0.35]; // pixels and opacity of limited parts of a curve

export class Chart {
  constructor(element, curve, arrays, clock) {
    Object.assign(this, { element, curve, clock });
    this.array = arrays[curve.values];
    this.limited = arrays[curve.limited];
    this.time = arrays.time;
    this.times = [];
    this.columns = curve.names.map(() => []);
    this.log = curve.log && this.array.values.some((value) => value > 0);
    this.extend(0);
    this.observer = new ResizeObserver(() => this.build());
    this.observer.observe(element);
  }

  destroy() {
    this.observer.disconnect();
    this.plot?.destroy();
  }

  // Replace the values from an instant on.
  extend(from) {
    const { shape, values } = this.array;
    this.times.length = from;
    for (let t = from; t < shape[0]; t++) this.times.push(this.time.values[t]);
    this.columns.forEach((column, i) => {
      column.length = from;
      for (let t = from; t < shape[0]; t++) column.push(shownValue(values[t * shape[1] + i], this.log));
    });
    this.plot?.setData([this.times, ...this.columns]);
  }

  build() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    const key = `${width} ${height} ${document.documentElement.dataset.theme}`;
    if (this.key === key) return;
    this.key = key;
    this.plot?.destroy();
    const style = getComputedStyle(this.element);
    const ink = (this.ink = style.getPropertyValue("--ink").trim());
    const line = { stroke: style.getPropertyValue("--line").trim(), width: 1 };
    const axis = { stroke: ink, grid: line, ticks: { ...line, size: 4 }, font: "11px system-ui", gap: 3 };
    const { curve } = this;
    this.plot = new uPlot(
      {
        width,
        height,
        padding: [6, 14, 0, 0],
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, points: { show: false } },
        scales: { x: { time: false, range: sinceStart }, y: this.log ? { distr: 3, range: decadesOfData } : { range: aroundData } },
        axes: [
          { ...axis, size: 26, space: 60, values: (_, splits) => splits.map(secondsLabel) },
          { ...axis, size: 46, space: 26, ...(this.log ? { splits: decades, filter: (_, s) => s } : {}), values: (_, splits) => splits.map(label) },
        ],
        series: [
          {},
          ...curve.names.map((name, i) => ({
            label: name,
            stroke: inked(curve.colors[i], ink),
            width: this.log && i > 0 ? 0.7 : 1.6,
            points: { show: (plot) => plot.data[0].length === 1 },
          })),
        ],
        hooks: { drawSeries: [(plot, i) => this.drawLimited(plot, i)], draw: [() => this.line && this.place()] },
      },
      [this.times, ...this.columns],
      this.element,
    );
    const over = this.plot.over;
    this.line = document.createElement("div");
    this.line.className = "now";
    over.append(this.line);
    this.place();
    const seek = (event) => this.clock.seek(this.plot.posToVal(event.offsetX, "x"));
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      seek(event);
    });
    over.addEventListener("pointermove", (event) => event.buttons && seek(event));
  }

  // Draw the periods broadly in which a value was limited.
  drawLimited(plot, series) {
    const { limited, times, curve, ink } = this;
    if (!limited || !series) return;
    const [width, column] = [limited.shape[1], this.columns[series - 1]];
    const pen = plot.ctx;
    const at = (t) => [plot.valToPos(times[t], "x", true), plot.valToPos(column[t], "y", true)];
    pen.save();
    Object.assign(pen, { strokeStyle: inked(curve.colors[series - 1], ink), globalAlpha: BAND_ALPHA, lineWidth: BAND_WIDTH * devicePixelRatio });
    pen.beginPath();
    for (let t = 1; t < times.length; t++) {
      if (!limited.values[t * width + series - 1] || column[t] === null || column[t - 1] === null) continue;
      pen.moveTo(...at(t - 1));
      pen.lineTo(...at(t));
    }
    pen.stroke();
    pen.restore();
  }

  // Move the line to the displayed instant.
  place() {
    if (!this.plot) return;
    const x = this.plot.valToPos(this.clock.seconds, "x");
    this.line.style.transform = `translateX(${x}px)`;
  }
}

function shownValue(value, log) {
  return Number.isFinite(value) && (!log || value > 0) ? value : null;
}

// The displayed range of time, at least a second.
function sinceStart(plot, first, last) {
  return last > first ? [first, last] : [first ?? 0, (first ?? 0) + 1];
}

// A range with a margin, also around a constant.
function aroundData(plot, low, high) {
  if (low === null) return [-1, 1];
  const rounding = 1e-9; // smaller differences are a constant
  if (high - low > rounding) return [low - 0.06 * (high - low), high + 0.06 * (high - low)];
  const margin = Math.abs(high) > rounding ? Math.abs(high) : 1;
  return [low - margin, high + margin];
}

// Whole powers of ten, at most twelve; smaller values are rounding errors.
function decadesOfData(plot, low, high) {
  if (low === null) return [0.1, 1];
  const top = Math.ceil(Math.log10(high) + 1e-9);
  return [10 ** Math.max(Math.floor(Math.log10(low)), top - 12), 10 ** top];
}

// Powers of ten, at most six.
function decades(plot, axis, low, high) {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const step = Math.max(1, Math.ceil((last - first) / 5));
  const found = [];
  for (let power = first; power <= last; power += step) found.push(10 ** power);
  return found;
}

export function label(value) {
  if (value === null) return "";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(0).replace("e+", "e");
  return String(Number(value.toPrecision(4)));
}

// The label of an instant; the last one has the unit.
function secondsLabel(value, i, all) {
  return i === all.length - 1 ? `${label(value)} s` : label(value);
}

// Black lines are drawn in the ink of the theme.
export function inked(color, ink) {
  return color === "#000000" ? ink : color;
}
