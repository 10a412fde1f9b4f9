// A map: thousands of points on a canvas, which the user points at and picks.

import { label } from "./charts.js";
import { NOT_SHOWN } from "./shades.js";
import { press, stampOf } from "./stamps.js";
import { element } from "./view.js";

const SIDES = { left: 64, right: 14, top: 12, bottom: 44 }; // pixels around the points
const NEAR = 12; // pixels within which a point is selected
const DRAG = 6; // pixels; a shorter drag is a click
const SPARE = 0.03; // of the span, at each end
const TOWARDS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Scatter {
  // `heard` is called with the point under the pointer or picked (-1: none) and whether by touch, and after a zoom.
  constructor(place, heard) {
    Object.assign(this, { place, heard, at: -1, zoom: null });
    this.canvas = element("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.context = this.canvas.getContext("2d", { willReadFrequently: true }); // drawn without a GPU
    this.ring = element("div", "", "ring");
    this.frame = element("div", "", "zoom");
    this.ring.hidden = this.frame.hidden = true;
    place.append(this.canvas, this.ring, this.frame);
    new ResizeObserver(() => this.draw()).observe(place);
    this.listen();
  }

  // Show points: x, y, kinds, looks, the axes {title, low, high, labels}, whether both axes have one
  // scale, and `turns`: positions of runs in a ring of `cells` around their common place.
  show(points) {
    const keep = this.points && this.points.axes.every((axis, k) => axis.title === points.axes[k].title);
    if (!keep) this.zoomTo(null);
    this.points = points;
    this.canvas.setAttribute("aria-label", `${points.axes[1].title} over ${points.axes[0].title}; arrows go from run to run, Enter opens one`);
    this.draw();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!this.points || !width || !height) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio))
      [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.context.fillStyle = getComputedStyle(this.place).getPropertyValue("--panel");
    this.context.fillRect(0, 0, width, height);
    this.layOut(width, height);
    this.drawAxes(width, height);
    this.drawPoints(ratio);
    this.mark(this.at);
  }

  // The map from numbers to pixels: from + scale * number on each axis.
  layOut(width, height) {
    const room = [width - SIDES.left - SIDES.right, height - SIDES.top - SIDES.bottom];
    const ends = this.zoom ?? this.points.axes.map(({ low, high }) => withMargin(low, high));
    const scales = ends.map(([low, high], k) => room[k] / (high - low));
    if (this.points.equal) scales.fill(Math.min(...scales));
    this.to = ends.map(([low, high], k) => {
      const middle = (k ? SIDES.top : SIDES.left) + room[k] / 2;
      const scale = k ? -scales[k] : scales[k];
      return { scale, from: middle - (scale * (low + high)) / 2 };
    });
    this.area = [SIDES.left, SIDES.top, SIDES.left + room[0], SIDES.top + room[1]];
    this.px = this.pixels(0);
    this.py = this.pixels(1);
  }

  // Places in pixels; distant points are placed on the border, hidden points nowhere.
  pixels(k) {
    const { x, y, kinds, axes } = this.points;
    const [numbers, { low, high, labels }, { from, scale }] = [k ? y : x, axes[k], this.to[k]];
    const found = new Float32Array(numbers.length);
    const [least, most] = [this.area[k], this.area[k + 2]];
    const aside = this.asides(k);
    for (let i = 0; i < numbers.length; i++) {
      const number = labels ? numbers[i] : Math.min(Math.max(numbers[i], low), high);
      const at = from + scale * number + (aside ? aside[this.points.turns[i]] : 0);
      found[i] = kinds[i] === NOT_SHOWN || at < least || at > most ? NaN : at;
    }
    return found;
  }

  // Offset of a run from a place that it shares with other runs, for each turn.
  asides(k) {
    const { turns, cells } = this.points;
    const turn = (i) => (2 * Math.PI * (i + 0.5)) / cells;
    return turns && Array.from({ length: cells }, (_, i) => 1.2 * this.radius * (k ? Math.sin : Math.cos)(turn(i)));
  }

  get radius() {
    const { length } = this.points.kinds;
    return length > 30000 ? 2 : length > 6000 ? 2.8 : 3.8;
  }

  // Write the points into the image of the canvas, which cannot draw 100,000 discs itself.
  drawPoints(ratio) {
    const { canvas, context, px, py } = this;
    const { looks, kinds } = this.points;
    const stamps = looks.map((look) => stampOf(look, this.radius, ratio, canvas.width));
    const image = context.getImageData(0, 0, canvas.width, canvas.height);
    for (let i = 0; i < kinds.length; i++)
      if (px[i] === px[i] && py[i] === py[i])
        press(image.data, stamps[kinds[i]], canvas.width * Math.round(py[i] * ratio) + Math.round(px[i] * ratio));
    context.putImageData(image, 0, 0);
  }

  drawAxes(width, height) {
    const { context, area } = this;
    const style = getComputedStyle(this.place);
    const [ink, soft, line] = ["--ink", "--soft", "--line"].map((name) => style.getPropertyValue(name).trim());
    const [left, top, right, bottom] = area;
    Object.assign(context, { lineWidth: 1, strokeStyle: line, fillStyle: soft, font: "11px system-ui, sans-serif" });
    for (const k of [0, 1])
      for (const [number, text] of this.ticks(k)) {
        const at = Math.round(this.to[k].from + this.to[k].scale * number) + 0.5;
        Object.assign(context, { textAlign: k ? "right" : "center", textBaseline: k ? "middle" : "top" });
        context.beginPath();
        if (k) context.moveTo(left, at), context.lineTo(right, at);
        else context.moveTo(at, top), context.lineTo(at, bottom);
        context.stroke();
        context.fillText(text, k ? left - 6 : at, k ? at : bottom + 6, k ? left - 20 : 120);
      }
    Object.assign(context, { fillStyle: ink, font: "12px system-ui, sans-serif", textAlign: "center", textBaseline: "bottom" });
    const [across, up] = this.points.axes;
    context.fillText(across.title, (left + right) / 2, height - 4);
    context.save();
    context.translate(8, (top + bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.textBaseline = "top";
    context.fillText(up.title, 0, 0);
    context.restore();
  }

  // Round numbers on an axis, or its labels, with their texts.
  ticks(k) {
    const { labels, log } = this.points.axes[k];
    const [from, to] = [this.area[k], this.area[k + 2]].map((at) => (at - this.to[k].from) / this.to[k].scale);
    const [low, high] = [Math.min(from, to), Math.max(from, to)];
    const most = (this.area[k + 2] - this.area[k]) / (k ? 40 : 80);
    if (labels) return labelTicks(labels, low, high, Math.max(most, 2));
    const step = Math.max(roundStep((high - low) / Math.max(most, 2)), log ? 1 : 0);
    const text = (at) => label(Number((log ? 10 ** at : at).toPrecision(6)));
    const found = [];
    for (let n = Math.ceil(low / step); n * step <= high; n++) found.push([n * step, text(n * step)]);
    return found;
  }

  // The number of the point nearest to a place, or -1.
  nearest(x, y) {
    let [best, found] = [NEAR * NEAR, -1];
    const { px, py } = this;
    for (let i = 0; i < px.length; i++) {
      const [dx, dy] = [px[i] - x, py[i] - y];
      const distance = dx * dx + dy * dy;
      if (distance <= best) [best, found] = [distance, i]; // of equal distances the visible point
    }
    return found;
  }

  // The next point in a direction from the marked point, or the first point.
  next([dx, dy]) {
    if (this.at < 0 || Number.isNaN(this.px[this.at])) return this.px.findIndex((x, i) => x === x && this.py[i] === this.py[i]);
    let [best, found] = [Infinity, this.at];
    for (let i = 0; i < this.px.length; i++) {
      const [x, y] = [this.px[i] - this.px[this.at], this.py[i] - this.py[this.at]];
      const [along, aside] = [x * dx + y * dy, Math.abs(x * dy - y * dx)];
      if (along > 0.5 && along + 3 * aside < best) [best, found] = [along + 3 * aside, i];
    }
    return found;
  }

  // Place the ring around a point; -1 hides it.
  mark(i) {
    this.at = i;
    const [x, y] = i < 0 ? [NaN, NaN] : [this.px[i], this.py[i]];
    this.ring.hidden = !(x === x && y === y);
    this.ring.style.transform = `translate(${x}px, ${y}px)`;
  }

  zoomTo(ends) {
    this.zoom = ends;
    this.heard.zoomed(Boolean(ends));
    if (this.points) this.draw();
  }

  // Show the whole map, without a selected point.
  leave() {
    this.mark(-1);
    this.heard.pick(-1, false);
    this.zoomTo(null);
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerleave", () => this.point(-1));
    canvas.addEventListener("pointerdown", (event) => {
      this.down = [event.offsetX, event.offsetY];
      if (event.pointerType !== "touch") canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", (event) => this.released(event));
    canvas.addEventListener("pointercancel", () => (this.down = null));
    canvas.addEventListener("keydown", (event) => this.pressed(event));
  }

  point(i) {
    this.mark(i);
    this.heard.point(i);
  }

  moved(event) {
    if (!this.points) return;
    const box = this.box(event);
    this.frame.hidden = !box;
    if (!box) {
      if (!this.down) this.point(this.nearest(event.offsetX, event.offsetY));
      return;
    }
    this.point(-1);
    const [x0, y0, x1, y1] = box;
    Object.assign(this.frame.style, { left: `${x0}px`, top: `${y0}px`, width: `${x1 - x0}px`, height: `${y1 - y0}px` });
  }

  // The rectangle of the current drag, or null.
  box({ offsetX: x, offsetY: y, pointerType }) {
    if (!this.down || pointerType === "touch") return null;
    const [x0, y0] = this.down;
    if (Math.hypot(x - x0, y - y0) < DRAG) return null;
    return [Math.min(x, x0), Math.min(y, y0), Math.max(x, x0), Math.max(y, y0)];
  }

  released(event) {
    const box = this.box(event);
    const clicked = this.down && !box && Math.hypot(event.offsetX - this.down[0], event.offsetY - this.down[1]) < DRAG;
    this.down = null;
    this.frame.hidden = true;
    if (box) {
      const number = (k, at) => (at - this.to[k].from) / this.to[k].scale;
      this.zoomTo([[number(0, box[0]), number(0, box[2])], [number(1, box[3]), number(1, box[1])]]);
    } else if (clicked) {
      this.mark(this.nearest(event.offsetX, event.offsetY));
      this.heard.pick(this.at, event.pointerType === "touch");
    }
  }

  pressed(event) {
    if (!this.points || event.ctrlKey || event.metaKey || event.altKey) return;
    if (TOWARDS[event.key]) this.point(this.next(TOWARDS[event.key]));
    else if (event.key === "Enter" && this.at >= 0) this.heard.pick(this.at, false);
    else if (event.key === "Escape") this.leave();
    else return;
    event.preventDefault();
  }
}

function withMargin(low, high) {
  const spare = SPARE * (high - low) || 0.5;
  return [low - spare, high + spare];
}

// The next of 1, 2, 5, 10, 20, ... above a number.
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((step) => step * power >= least * (1 - 1e-9));
}

function labelTicks(labels, low, high, most) {
  const step = Math.ceil(labels.length / most);
  return labels.map((text, i) => [i, text]).filter(([i]) => i % step === 0 && i >= low && i <= high);
}
