// The image of a camera: feature points, their paths and goals, in pixels.

import { inked } from "./charts.js";

const MARGIN = 0.05; // of the image, around it
const RIM = "rgba(255, 255, 255, 0.8)"; // of lines over a rendered picture
const HELD = { holding: "#e69f00", yielding: "#d55e00" }; // colours of what constraints concern
const DARK = "#1c1c1c"; // black lines over a rendered picture

export class Picture {
  // `beneath` returns the rendered picture of an instant, or null.
  constructor(element, camera, arrays, beneath) {
    this.camera = camera;
    this.beneath = beneath;
    this.pixels = arrays[camera.pixels];
    this.goal = arrays[camera.goal];
    this.second = camera.second && arrays[camera.second];
    this.count = camera.colors.length;
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `image of ${camera.name}`);
    element.append(this.canvas);
    this.canvas.addEventListener("dblclick", () => this.canvas.requestFullscreen?.());
    this.bounds = this.boundsOf();
    this.index = 0;
    this.held = { sides: new Map(), marks: new Map() };
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(element);
  }

  destroy() {
    this.observer.disconnect();
  }

  // Left, top, width and height of the displayed region, in pixels.
  boundsOf() {
    let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
    const { size } = this.camera;
    if (size) [left, top, right, bottom] = [-0.5, -0.5, size[0] - 0.5, size[1] - 0.5];
    else
      for (const values of [this.pixels.values, this.goal.values])
        for (let i = 0; i < values.length; i += 2) {
          if (!Number.isFinite(values[i])) continue;
          [left, right] = [Math.min(left, values[i]), Math.max(right, values[i])];
          [top, bottom] = [Math.min(top, values[i + 1]), Math.max(bottom, values[i + 1])];
        }
    if (!(right > left)) [left, right] = [left - 1, left + 1];
    if (!(bottom > top)) [top, bottom] = [top - 1, top + 1];
    const edge = MARGIN * Math.max(right - left, bottom - top);
    return [left - edge, top - edge, right - left + 2 * edge, bottom - top + 2 * edge];
  }

  // Show an instant; `held` are the states of sides and feature points that constraints concern.
  place(index, held) {
    Object.assign(this, { index, held });
    this.draw();
  }

  draw() {
    const [left, top, width, height] = this.bounds;
    const room = this.canvas.parentElement.clientWidth;
    if (!room) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const tall = (room * height) / width;
    if (this.canvas.width !== Math.round(room * ratio)) {
      this.canvas.width = Math.round(room * ratio);
      this.canvas.height = Math.round(tall * ratio);
    }
    this.scale = (room * ratio) / width;
    this.pen = this.canvas.getContext("2d", { willReadFrequently: true }); // small: no work for a GPU
    this.pen.setTransform(this.scale, 0, 0, this.scale, -left * this.scale, -top * this.scale);
    this.unit = ratio / this.scale; // a screen pixel in image pixels
    const style = getComputedStyle(this.canvas);
    this.image = this.beneath(this.index);
    this.ink = this.image ? DARK : style.getPropertyValue("--ink").trim();
    this.colors = this.camera.colors.map((color) => inked(color, this.ink));
    this.pen.clearRect(left, top, width, height);
    this.drawBorder(style.getPropertyValue("--paper"));
    this.drawMargins();
    for (let mark = 0; mark < this.count; mark++) {
      if (this.second) this.drawSecond(mark);
      this.drawWay(mark);
    }
    this.drawGoals();
    for (let mark = 0; mark < this.count; mark++) this.drawMark(mark);
  }

  drawBorder(paper) {
    const { pen, unit } = this;
    const { size, centre } = this.camera;
    pen.strokeStyle = this.ink;
    pen.lineWidth = unit;
    if (size) {
      pen.fillStyle = paper;
      pen.fillRect(-0.5, -0.5, size[0], size[1]);
      if (this.image) pen.drawImage(this.image, -0.5, -0.5, size[0], size[1]);
      pen.strokeRect(-0.5, -0.5, size[0], size[1]);
    }
    pen.globalAlpha = 0.5;
    pen.beginPath();
    pen.moveTo(centre[0] - 6 * unit, centre[1]);
    pen.lineTo(centre[0] + 6 * unit, centre[1]);
    pen.moveTo(centre[0], centre[1] - 6 * unit);
    pen.lineTo(centre[0], centre[1] + 6 * unit);
    this.stroke();
    pen.globalAlpha = 1;
  }

  // The margins that constraints keep, and the sides where they act.
  drawMargins() {
    const { pen, unit } = this;
    const { size, margins = [] } = this.camera;
    if (!size) return;
    const [width, height] = size;
    pen.strokeStyle = this.ink;
    pen.lineWidth = unit;
    pen.globalAlpha = 0.45;
    pen.setLineDash([2 * unit, 3 * unit]);
    for (const margin of margins) pen.strokeRect(margin - 0.5, margin - 0.5, width - 2 * margin, height - 2 * margin);
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    const [band, edge] = [5 * unit, Math.max(...margins, 0)];
    for (const [side, state] of this.held.sides) {
      pen.fillStyle = pen.strokeStyle = HELD[state];
      const wide = ["left", "right"].includes(side) ? [band, height] : [width, band];
      pen.fillRect((side === "right" ? width - band : 0) - 0.5, (side === "bottom" ? height - band : 0) - 0.5, ...wide);
      const [x, y] = [side === "right" ? width - edge : edge, side === "bottom" ? height - edge : edge];
      pen.lineWidth = 2 * unit;
      pen.beginPath();
      pen.moveTo(x - 0.5, y - 0.5);
      if (wide[0] === band) pen.lineTo(x - 0.5, height - edge - 0.5);
      else pen.lineTo(width - edge - 0.5, y - 0.5);
      pen.stroke();
    }
  }

  // Stroke the path of the pen, over a picture with a pale rim.
  stroke() {
    const { pen, unit } = this;
    const { strokeStyle, lineWidth } = pen;
    if (this.image) {
      Object.assign(pen, { strokeStyle: RIM, lineWidth: lineWidth + 2 * unit });
      pen.stroke();
      Object.assign(pen, { strokeStyle, lineWidth });
    }
    pen.stroke();
  }

  at(index, mark, pixels = this.pixels) {
    const i = 2 * (index * this.count + mark);
    return [pixels.values[i], pixels.values[i + 1]];
  }

  drawWay(mark) {
    const { pen, unit } = this;
    pen.strokeStyle = this.colors[mark];
    pen.lineWidth = 1.6 * unit;
    const last = this.pixels.shape[0] - 1;
    for (const [to, alpha] of [[last, 0.25], [this.index, 0.9]]) {
      if (to === last && alpha < 0.5 && this.index === last) continue; // nothing lies ahead
      pen.globalAlpha = alpha;
      this.drawPath(mark, to, this.pixels);
    }
    pen.globalAlpha = 1;
  }

  // The path of a feature point under the second scheme, dashed, and its position, hollow.
  drawSecond(mark) {
    const { pen, unit } = this;
    pen.strokeStyle = this.colors[mark];
    pen.lineWidth = 1.2 * unit;
    pen.setLineDash([4 * unit, 3 * unit]);
    this.drawPath(mark, this.index, this.second);
    pen.setLineDash([]);
    const [x, y] = this.at(this.index, mark, this.second);
    if (!Number.isFinite(x)) return;
    pen.beginPath();
    pen.arc(x, y, 4 * unit, 0, 2 * Math.PI);
    this.stroke();
  }

  drawPath(mark, to, pixels) {
    const { pen, unit } = this;
    const { values } = pixels;
    pen.beginPath();
    let [x0, y0] = [NaN, NaN]; // the last drawn point; points within a pixel of it are skipped
    for (let t = 0, i = 2 * mark; t <= to; t++, i += 2 * this.count) {
      const [x, y] = [values[i], values[i + 1]];
      if (!(Math.abs(x - x0) + Math.abs(y - y0) < unit)) {
        if (Number.isFinite(x0)) pen.lineTo(x, y);
        else pen.moveTo(x, y);
        [x0, y0] = [x, y];
      }
    }
    this.stroke();
  }

  drawGoals() {
    const { pen, unit } = this;
    pen.lineWidth = 1.5 * unit;
    const side = 11 * unit;
    this.colors.forEach((color, mark) => {
      const [x, y] = this.goal.values.subarray(2 * mark, 2 * mark + 2);
      if (!Number.isFinite(x)) return;
      pen.strokeStyle = color;
      pen.beginPath();
      pen.rect(x - side / 2, y - side / 2, side, side);
      this.stroke();
    });
  }

  drawMark(mark) {
    const { pen, unit } = this;
    const [x, y] = this.at(this.index, mark);
    if (!Number.isFinite(x)) return;
    pen.fillStyle = this.colors[mark];
    pen.strokeStyle = this.image ? RIM : this.ink;
    pen.lineWidth = (this.image ? 1.6 : 0.8) * unit;
    pen.beginPath();
    pen.arc(x, y, 4.5 * unit, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
    if (!this.held.marks.has(mark)) return;
    pen.strokeStyle = HELD[this.held.marks.get(mark)];
    pen.lineWidth = 3 * unit;
    pen.beginPath();
    pen.arc(x, y, 9 * unit, 0, 2 * Math.PI);
    this.stroke();
  }
}
