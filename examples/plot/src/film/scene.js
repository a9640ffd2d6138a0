"use strict";
// Draws a shoot in space on a canvas: a box with a floor and walls, the centre line, arrows and the tip track.
// The projection is parallel, so that lengths can be compared. The z axis points up.

// Colours of Okabe and Ito, which colour-blind readers can distinguish. Growing and mature tissue also differ in width.
const COLOURS = {
  zone: "#009e73", mature: "#5b4636", d1: "#0072b2", d2: "#56b4e9", pile: "#e69f00",
  trace: "#d55e00", shadow: "#e5b49a", old: "#f3ddd0", tip: "#d55e00", grid: "#d9d9d9", edge: "#8a8a8a",
  text: "#222222", force: "#cc79a7", pole: "#bfb8ad",
};

// Names for the legend, by colour.
const NAMES = {
  mature: "mature tissue", zone: "growth zone", d1: "director d1", d2: "director d2",
  pile: "normal h of statoliths", trace: "tip track", pole: "pole",
};

// Duration of the emphasised recent part of the tip track, h.
const RECENT = 4;

// Parallel projection along a direction that is given by azimuth and elevation, in degrees.
class View {
  constructor(canvas, box) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.home = { azimuth: 35, elevation: 18 };
    Object.assign(this, this.home);
    this.setBox(box);
    this.onchange = () => {};
    this.listen();
  }

  // Sets the visible box [[x0, x1], [y0, y1], [z0, z1]], m.
  setBox(box) {
    this.box = box;
    this.centre = box.map(([a, b]) => (a + b) / 2);
    this.radius = Math.hypot(...box.map(([a, b]) => b - a)) / 2;
  }

  turn(azimuth, elevation) {
    this.azimuth = (this.azimuth + azimuth + 720) % 360;
    this.elevation = Math.min(90, Math.max(0, this.elevation + elevation));
    this.onchange();
  }

  reset() {
    Object.assign(this, this.home);
    this.onchange();
  }

  listen() {
    const canvas = this.canvas;
    let last = null;
    canvas.style.touchAction = "none";
    canvas.addEventListener("pointerdown", (event) => {
      // The page may use the pointer to apply a force.
      if (event.defaultPrevented) return;
      last = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turn(0.4 * (last[0] - event.clientX), 0.4 * (event.clientY - last[1]));
      last = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
    canvas.addEventListener("keydown", (event) => {
      const turns = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
      if (turns[event.key]) this.turn(...turns[event.key]);
      else if (event.key === "r" || event.key === "R") this.reset();
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
    new ResizeObserver(() => this.onchange()).observe(canvas);
  }

  // Sets the resolution of the canvas to that of the screen, clears it, and computes the projection.
  begin() {
    const { canvas, context } = this, ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#ffffff";
    context.fillRect(0, 0, width, height);
    this.ratio = ratio;
    const a = this.azimuth * Math.PI / 180, e = this.elevation * Math.PI / 180;
    this.right = [-Math.sin(a), Math.cos(a), 0];
    this.up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
    // Direction from the scene to the eye.
    this.towards = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    this.size = [width, height];
    // The scale is the largest for which the box fits into the canvas with a margin.
    let [across, high] = [0, 0];
    for (let corner = 0; corner < 8; corner++) {
      const p = this.box.map(([lo, hi], k) => ((corner >> k) & 1 ? hi : lo) - this.centre[k]);
      across = Math.max(across, Math.abs(dot(p, this.right)));
      high = Math.max(high, Math.abs(dot(p, this.up)));
    }
    this.scale = 0.94 * Math.min(width / (2 * across), height / (2 * high));
  }

  // Returns the pixel position of a point in space.
  at(p) {
    const q = p.map((x, k) => x - this.centre[k]);
    return [this.size[0] / 2 + this.scale * dot(q, this.right), this.size[1] / 2 - this.scale * dot(q, this.up)];
  }

  line(points, colour, width, smooth = false) {
    if (points.length < 2) return;
    const c = this.context, seen = points.map((p) => this.at(p));
    c.beginPath();
    c.moveTo(...seen[0]);
    for (let i = 1; i < seen.length; i++) {
      if (!smooth) { c.lineTo(...seen[i]); continue; }
      // Catmull and Rom's cubic, through all points.
      const [before, a, b, after] = [seen[Math.max(0, i - 2)], seen[i - 1], seen[i], seen[Math.min(seen.length - 1, i + 1)]];
      c.bezierCurveTo(a[0] + (b[0] - before[0]) / 6, a[1] + (b[1] - before[1]) / 6, b[0] - (after[0] - a[0]) / 6, b[1] - (after[1] - a[1]) / 6, ...b);
    }
    c.strokeStyle = colour;
    c.lineWidth = width * this.ratio;
    c.lineJoin = c.lineCap = "round";
    c.stroke();
  }

  dot(p, colour, radius) {
    const c = this.context, [x, y] = this.at(p);
    c.beginPath();
    c.arc(x, y, radius * this.ratio, 0, 2 * Math.PI);
    c.fillStyle = colour;
    c.fill();
  }

  // Draws an arrow of the given length, m.
  arrow(from, direction, length, colour, width = 1.8) {
    const to = from.map((x, k) => x + length * direction[k]);
    this.line([from, to], colour, width);
    const a = this.at(from), b = this.at(to), c = this.context;
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]], seen = Math.hypot(dx, dy);
    const head = Math.min(6 * this.ratio, 0.5 * seen);
    // An arrow along the viewing direction has no visible head.
    if (head < this.ratio) return;
    const [ux, uy] = [dx / seen, dy / seen];
    c.beginPath();
    c.moveTo(b[0], b[1]);
    c.lineTo(b[0] - head * (ux - 0.5 * uy), b[1] - head * (uy + 0.5 * ux));
    c.lineTo(b[0] - head * (ux + 0.5 * uy), b[1] - head * (uy - 0.5 * ux));
    c.fillStyle = colour;
    c.fill();
  }

  // Returns the coordinates x and y of the two rear walls.
  walls() {
    return [0, 1].map((k) => this.box[k][this.towards[k] > 0 ? 0 : 1]);
  }

  // Draws floor and walls with a grid. Returns its spacing (m), which is 1, 2 or 5 times a power of ten.
  room() {
    const [bx, by, bz] = this.box, [wx, wy] = this.walls();
    const span = Math.max(bx[1] - bx[0], by[1] - by[0], bz[1] - bz[0]), spacing = nice(span / 8);
    const lines = (range, draw) => {
      for (let v = Math.ceil(range[0] / spacing - 1e-9) * spacing; v <= range[1] + 1e-12; v += spacing) draw(v);
    };
    const floor = bz[0];
    lines(bx, (x) => {
      this.line([[x, by[0], floor], [x, by[1], floor]], COLOURS.grid, 1);
      this.line([[x, wy, bz[0]], [x, wy, bz[1]]], COLOURS.grid, 1);
    });
    lines(by, (y) => {
      this.line([[bx[0], y, floor], [bx[1], y, floor]], COLOURS.grid, 1);
      this.line([[wx, y, bz[0]], [wx, y, bz[1]]], COLOURS.grid, 1);
    });
    lines(bz, (z) => {
      this.line([[wx, by[0], z], [wx, by[1], z]], COLOURS.grid, 1);
      this.line([[bx[0], wy, z], [bx[1], wy, z]], COLOURS.grid, 1);
    });
    const [fx, fy] = [bx[0] + bx[1] - wx, by[0] + by[1] - wy];
    this.line([[wx, fy, floor], [wx, wy, floor], [fx, wy, floor]], COLOURS.edge, 1.2);
    this.line([[wx, wy, bz[0]], [wx, wy, bz[1]]], COLOURS.edge, 1.2);
    this.axes();
    return spacing;
  }

  // Directions of the fixed frame, in the lower left corner of the canvas.
  axes() {
    const origin = [44 * this.ratio, this.size[1] - 40 * this.ratio], reach = 24 * this.ratio / this.scale;
    // The point of space, in the plane of the box's centre, that is seen there.
    const [across, up] = [(origin[0] - this.size[0] / 2) / this.scale, (this.size[1] / 2 - origin[1]) / this.scale];
    const from = this.centre.map((x, k) => x + across * this.right[k] + up * this.up[k]);
    ["x", "y", "z"].forEach((name, k) => {
      const direction = [0, 1, 2].map((j) => Number(j === k));
      // An axis that points to the eye is not drawn.
      if (Math.abs(this.towards[k]) > 0.97) return;
      this.arrow(from, direction, reach, COLOURS.text, 1.6);
      this.text(name, from.map((x, j) => x + 1.5 * reach * direction[j]), COLOURS.text);
    });
  }

  text(words, p, colour) {
    const c = this.context, [x, y] = this.at(p);
    c.fillStyle = colour;
    c.font = `${14 * this.ratio}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText(words, x, y);
  }

  // Draws the projections of a track onto the floor and the walls. The part from index `recent` on has strong colours
  // and is also drawn in space. The older part would hide it there.
  trace(path, recent = 0) {
    const [wx, wy] = this.walls(), floor = this.box[2][0];
    const now = path.slice(recent), before = path.slice(0, recent + 1);
    const flat = [(p) => [wx, p[1], p[2]], (p) => [p[0], wy, p[2]], (p) => [p[0], p[1], floor]];
    for (const shadow of flat) this.line(before.map(shadow), COLOURS.old, 1);
    for (const shadow of flat.slice(0, 2)) this.line(now.map(shadow), COLOURS.shadow, 1, true);
    this.line(now.map(flat[2]), COLOURS.trace, 1.3, true);
    this.line(now, COLOURS.shadow, 1.3, true);
    if (path.length) this.dot(flat[2](path[path.length - 1]), COLOURS.trace, 3);
  }

  // Draws a frame: { line: points of the centre line, zone: relative arc length of the lower end of the growth zone,
  // directors: [[position, d1, d2]], piles: [[position, h]] }. Poles are [[point of the axis, its direction, radius]].
  shoot(frame, poles = []) {
    this.parts(frame, () => true);
    if (!poles.length) return;
    poles.forEach((pole) => this.pole(pole));
    // What is not behind a pole is drawn again.
    this.parts(frame, (p) => !poles.some((pole) => this.hides(pole, p)));
  }

  // Draws the parts of a frame whose places are seen.
  parts(frame, seen) {
    const last = frame.line.length - 1, cut = frame.zone * last, whole = Math.floor(cut), part = cut - whole;
    const between = whole < last
      ? frame.line[whole].map((x, k) => x + part * (frame.line[whole + 1][k] - x)) : frame.line[last];
    this.piece([...frame.line.slice(0, whole + 1), between], COLOURS.mature, 7, seen);
    this.piece([between, ...frame.line.slice(whole + 1)], COLOURS.zone, 4.5, seen);
    const long = 0.055 * 2 * this.radius;
    for (const [at, d1, d2] of frame.directors) {
      if (!seen(at)) continue;
      this.arrow(at, d1, long, COLOURS.d1);
      this.arrow(at, d2, long, COLOURS.d2);
    }
    for (const [at, h] of frame.piles) if (seen(at)) this.arrow(at, h, long, COLOURS.pile, 2.2);
    if (seen(frame.line[0])) this.dot(frame.line[0], COLOURS.text, 5);
    if (seen(frame.line[last])) this.dot(frame.line[last], COLOURS.tip, 4);
  }

  // Draws the intervals of a line whose middles are seen.
  piece(points, colour, width, seen) {
    let run = points.slice(0, 1);
    for (let i = 1; i < points.length; i++) {
      const middle = points[i].map((x, k) => (x + points[i - 1][k]) / 2);
      if (seen(middle)) { run.push(points[i]); continue; }
      this.line(run, colour, width, true);
      run = [points[i]];
    }
    this.line(run, colour, width, true);
  }

  // Draws a pole between the lowest and the highest plane of the box.
  pole([point, axis, radius]) {
    const [low, high] = this.box[2], c = this.context, steep = Math.abs(axis[2]) > 0.05;
    const ends = (steep ? [low, high].map((z) => (z - point[2]) / axis[2]) : [-2 * this.radius, 2 * this.radius])
      .map((t) => point.map((x, k) => x + t * axis[k]));
    const side = unit(cross(axis, Math.abs(axis[2]) > 0.9 ? [1, 0, 0] : [0, 0, 1])), other = cross(axis, side);
    const rings = ends.map((end) => Array.from({ length: 33 }, (_, i) => {
      const angle = i * Math.PI / 16, [x, y] = [radius * Math.cos(angle), radius * Math.sin(angle)];
      return end.map((z, k) => z + x * side[k] + y * other[k]);
    }));
    const fill = (points) => {
      c.beginPath();
      points.map((p) => this.at(p)).forEach((p, i) => i ? c.lineTo(...p) : c.moveTo(...p));
      c.closePath();
      c.fillStyle = COLOURS.pole;
      c.fill();
    };
    c.globalAlpha = 0.8;
    const across = cross(axis, this.towards);
    if (Math.hypot(...across) > 1e-6) {
      const edge = unit(across).map((x) => x * radius);
      const edges = [1, -1].map((sign) => ends.map((end) => end.map((x, k) => x + sign * edge[k])));
      fill([...edges[0], ...edges[1].reverse()]);
      c.globalAlpha = 1;
      edges.forEach((line) => this.line(line, COLOURS.edge, 1));
    }
    c.globalAlpha = 1;
    rings.forEach((ring) => this.line(ring, COLOURS.edge, 1));
  }

  // Whether a pole is between the eye and a place.
  hides([point, axis, radius], p) {
    const across = (v) => { const along = dot(v, axis); return v.map((x, k) => x - along * axis[k]); };
    const from = across(p.map((x, k) => x - point[k])), eye = across(this.towards);
    const ahead = dot(from, eye) / Math.hypot(...eye);
    return ahead < 0 && dot(from, from) - ahead * ahead < radius * radius;
  }
}

// Returns places on both sides of each pole, next to the base.
function besidePoles(poles) {
  return poles.flatMap(([point, axis, radius]) => {
    const along = dot(point, axis), at = point.map((x, k) => x - along * axis[k]);
    return [-radius, radius].map((r) => [at[0] + r, at[1] + r, at[2]]);
  });
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function cross(a, b) {
  return [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
}

function unit(a) {
  const size = Math.hypot(...a);
  return a.map((x) => x / size);
}

// Returns the nearest value among 1, 2 and 5 times a power of ten.
function nice(x) {
  const power = 10 ** Math.floor(Math.log10(x)), part = x / power;
  return power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
}

// Returns a length (m) as text: 0.02 gives "2 cm".
function distance(metres) {
  const [size, unit] = metres < 0.00999 ? [1e3, "mm"] : [1e2, "cm"];
  return `${Number((metres * size).toPrecision(3))} ${unit}`;
}

function swatch(colour) {
  const patch = document.createElement("i");
  patch.style.background = colour;
  return patch;
}

function legendItem(name, words) {
  const item = document.createElement("span");
  item.append(swatch(COLOURS[name]), words);
  return item;
}

// Returns a box that contains all points with a margin. Its floor is a square centred at the base.
function boxAround(points) {
  let [side, low, high] = [0.005, 0, 0.005];
  for (const [x, y, z] of points) {
    side = Math.max(side, Math.abs(x), Math.abs(y));
    low = Math.min(low, z);
    high = Math.max(high, z);
  }
  const margin = 1.08;
  return [[-margin * side, margin * side], [-margin * side, margin * side], [margin * low, margin * high]];
}
