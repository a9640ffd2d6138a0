// The live page: sliders, presets, the loop in time. The shoot itself is the WebAssembly module.
// `#check=2` behind the address runs 2 h in frames of 2 min, without drawing, and writes what came out.

// Numbers as in `Parameter` of shoot.rs: [name, unit, from, to, step].
const SLIDERS = {
  0: ["oscillator α", "", 0, 0.3, 0.01], 1: ["gravity sense β", "", 0, 3, 0.05], 2: ["bending sense η", "", 0, 60, 1],
  3: ["growth time τg", "h", 5, 80, 1], 4: ["memory τm", "min", 1, 40, 0.5], 5: ["reaction τr", "min", 1, 40, 0.5],
  9: ["oscillator τe", "min", 10, 60, 0.5], 6: ["gravity g", "m/s²", 0, 30, 0.01], 7: ["stiffness E", "MPa", 2, 50, 0.5],
  8: ["tilt of the base", "°", -90, 90, 1],
};
const STARTS = { 14: ["length", "cm", 1, 12, 0.005], 15: ["grows", "", 0, 1, 1] };
const [SENSE, PUSH, LENGTH, GROWS, KICK] = [10, 11, 14, 15, 16];
const USUAL = { 0: 0, 1: 0.8, 2: 20, 3: 20, 4: 12, 5: 12, 6: 9.81, 7: 10, 8: 0, 9: 24, [SENSE]: 1, [LENGTH]: 6.59, [GROWS]: 0, [KICK]: 0 };
const PRESETS = {
  "video 2: growing": { 0: 0.2, 3: 40, [LENGTH]: 6.8, [GROWS]: 1 },
  "video 3: weak oscillator": { 0: 0.01, 3: 40, [LENGTH]: 6.8, [GROWS]: 1 },
  "video 4: two kicks": { [KICK]: 1 },
  "video 5: epitrochoid": { 0: 0.3, 9: 20, [LENGTH]: 6.565, [KICK]: 2 },
  "video 6: hypotrochoid": { 0: 0.3, 9: 20, [LENGTH]: 6.565, [SENSE]: -1, [KICK]: 2 },
  "no gravity, no sense of it": { 0: 0.2, 1: 0, 6: 0, [LENGTH]: 6.8 },
  "on its side": { [LENGTH]: 5, 8: 90 },
};
/// The longest trace that is drawn, in points.
const LONGEST = 4000;

const $ = (id) => document.getElementById(id);
let core = null, view = null, frame = null, critical = [Infinity, Infinity];
let [playing, drawnAt, rate, trace, reading, readAt] = [false, null, 0, [], [0, 0, 0], 0];
const outputs = {};

function bytesOfModule() {
  return Uint8Array.from(atob($("wasm").textContent), (c) => c.charCodeAt(0));
}

// Calls the core; false, with the message shown, where it fails.
function call(name, ...values) {
  const failed = core[name](...values);
  const text = new Uint8Array(core.memory.buffer, core.live_message(), core.live_message_length());
  $("message").textContent = failed ? `Stopped: ${new TextDecoder().decode(text)}` : "";
  if (failed) run(false);
  return !failed;
}

function numbers() {
  return Array.from(new Float64Array(core.memory.buffer, core.live_numbers(), core.live_count()));
}

function look() {
  if (!call("live_look")) return;
  const all = numbers(), [time, length, zone] = all, tip = all.slice(3, 6), [points, stations, piles] = all.slice(6, 9);
  let at = 9;
  const vector = () => all.slice(at, at += 3), many = (n, make) => Array.from({ length: n }, make);
  frame = {
    time, length, zone, tip,
    line: many(points, vector),
    directors: many(stations, () => [vector(), vector(), vector()]),
    piles: many(piles, () => [vector(), vector()]),
  };
}

function set(number, value) {
  const done = call("live_set", number, value);
  if (outputs[number]) outputs[number](value);
  // Lengths at which it buckles and swings are found again a moment after the last change.
  if (done && number < PUSH) { clearTimeout(set.later); set.later = setTimeout(findCritical, 200); }
  return done;
}

function findCritical() {
  if (call("live_critical")) critical = numbers();
  drawScale();
}

function slider(number, [name, unit, from, to, step], where) {
  const row = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
  row.className = "row";
  Object.assign(input, { type: "range", min: from, max: to, step, id: `p${number}` });
  row.append(name, input, output);
  where.append(row);
  outputs[number] = (value) => {
    input.value = value;
    output.textContent = number === GROWS ? (value > 0 ? "yes" : "no") : `${Number(value)} ${unit}`;
  };
  input.addEventListener("input", () => { set(number, Number(input.value)); if (number in STARTS) drawScale(); draw(); });
}

function restart() {
  const done = call("live_restart");
  [trace, reading] = [[], [0, 0, 0]];
  look();
  if (!done || !frame) return;
  const reach = frame.length * (value(GROWS) > 0 ? 1.75 : 1.02);
  view?.setBox(boxAround([[0.62 * reach, 0, reach], [0, 0, value(8) === 0 ? 0 : -0.4 * reach]]));
  drawScale();
}

function value(number) {
  return core.live_get(number) ? NaN : numbers()[0];
}

function choose(preset) {
  Object.entries({ ...USUAL, ...preset }).forEach(([number, x]) => set(Number(number), x));
  restart();
  draw();
}

function advance(seconds) {
  if (!call("live_advance", seconds)) return false;
  look();
  trace.push([frame.tip, frame.time]);
  if (trace.length > LONGEST) trace.splice(0, trace.length - LONGEST);
  return true;
}

function tick(now) {
  if (!playing) return;
  if (drawnAt !== null && now > drawnAt) {
    const asked = 3600 * Number($("speed").value) * Math.min(0.1, (now - drawnAt) / 1000);
    // The trace wants a place every few minutes.
    const parts = Math.ceil(asked / 240), began = performance.now();
    for (let i = 0; i < parts && playing; i++) advance(asked / parts);
    const took = performance.now() - began;
    rate = 0.9 * rate + 0.1 * (asked / 3600) / Math.max(1e-6, took / 1000);
  }
  drawnAt = now;
  if (now - readAt > 500) { if (call("live_read")) reading = numbers(); readAt = now; }
  draw();
  requestAnimationFrame(tick);
}

function run(on) {
  if (on === playing) return;
  [playing, drawnAt] = [on, null];
  $("play").textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(tick);
}

function draw() {
  if (!frame || !view) return;
  drawScale();
  view.begin();
  const spacing = view.room();
  view.trace(trace.map(([tip]) => tip), Math.max(0, trace.findIndex(([, time]) => time >= frame.time - 3600 * RECENT)));
  view.shoot(frame);
  if (pull.force) view.arrow(frame.tip, unit(pull.force), 0.16 * view.radius, COLOURS.force, 3);
  const [period, major, minor] = reading;
  const sense = Math.abs(minor) < 0.01 * major ? "in a plane" : minor > 0 ? "counterclockwise" : "clockwise";
  const swing = period > 0
    ? `swings every ${(period / 60).toFixed(1)} min, semi-axes ${(1e3 * major).toFixed(2)} and ${(1e3 * Math.abs(minor)).toFixed(2)} mm, ${sense}`
    : frame.time < 6 * 3600 ? "no swing read yet" : "no swing";
  $("read").textContent = `${(frame.time / 3600).toFixed(1)} h · ${(100 * frame.length).toFixed(2)} cm · ${swing} · grid ${distance(spacing)}`;
}

function unit(v) {
  const size = Math.hypot(...v);
  return v.map((x) => x / size);
}

// The scale of lengths: the shoot, where it begins to swing and where it buckles.
function drawScale() {
  const canvas = $("scale"), c = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
  [canvas.width, canvas.height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
  c.scale(ratio, ratio);
  const [width, left, right] = [canvas.clientWidth, 12, 14];
  const length = frame ? Math.max(frame.length, 0.01 * value(LENGTH)) : 0.1;
  const longest = 1.15 * Math.max(length, ...critical.filter(Number.isFinite), 0.05);
  const x = (metres) => left + (width - left - right) * metres / longest;
  c.font = "13px system-ui, sans-serif";
  c.fillStyle = COLOURS.text;
  c.textAlign = "center";
  const step = nice(longest / 6);
  for (let at = 0; at <= longest; at += step) {
    c.fillRect(x(at), 52, 1, 5);
    c.fillText(`${Number((100 * at).toFixed(2))}`, x(at), 70);
  }
  c.fillText("cm", width - right, 82);
  c.fillRect(left, 52, width - left - right, 1);
  c.fillStyle = COLOURS.zone;
  c.fillRect(left, 43, x(length) - left, 7);
  for (const [metres, colour, name, row] of [[critical[1], COLOURS.trace, "swings from", 10], [critical[0], COLOURS.d1, "young tissue buckles at", 25]]) {
    if (!Number.isFinite(metres)) continue;
    c.fillStyle = colour;
    c.fillRect(x(metres) - 1, row + 3, 2, 52 - row - 3);
    const words = `${name} ${(100 * metres).toFixed(2)} cm`;
    c.textAlign = "right";
    c.fillText(words, Math.max(x(metres) - 5, c.measureText(words).width + 2), row + 3);
  }
}

// The hand: dragging the tip pushes it, 20 µN for every tenth of the room; letting go ends it.
const pull = { from: null, force: null };
function push(force) {
  pull.force = force && Math.hypot(...force) > 0 ? force : null;
  for (let k = 0; k < 3; k++) set(PUSH + k, force ? force[k] : 0);
}

function listenToHand(canvas) {
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * view.ratio, (event.clientY - box.top) * view.ratio];
  };
  canvas.addEventListener("pointerdown", (event) => {
    const [x, y] = place(event), [tx, ty] = view.at(frame.tip);
    if (Math.hypot(x - tx, y - ty) > 28 * view.ratio) return;
    event.preventDefault();
    pull.from = [x, y];
    canvas.setPointerCapture(event.pointerId);
  }, { capture: true });
  canvas.addEventListener("pointermove", (event) => {
    if (!pull.from) return;
    const [x, y] = place(event), per = 100 / (view.scale * view.radius);
    const [across, up] = [per * (x - pull.from[0]), per * (pull.from[1] - y)];
    const force = [0, 1, 2].map((k) => across * view.right[k] + up * view.up[k]), size = Math.hypot(...force);
    push(force.map((f) => f * Math.min(1, 40 / Math.max(size, 1e-9))));
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, () => { if (pull.from) { pull.from = null; push(null); draw(); } });
  }
}

// A push by a button: 10 µN for 12 min of the shoot's time.
function shove(axis) {
  const force = [0, 0, 0];
  force[axis] = 10;
  push(force);
  const until = frame.time + 720;
  const wait = () => {
    if (pull.from) return;
    if (frame.time >= until || !playing) push(null);
    else requestAnimationFrame(wait);
  };
  if (!playing) { advance(720); push(null); draw(); } else wait();
}

function begin() {
  Object.entries(SLIDERS).forEach(([number, of]) => slider(Number(number), of, $("sliders")));
  Object.entries(STARTS).forEach(([number, of]) => slider(Number(number), of, $("starts")));
  for (const [name, preset] of Object.entries(PRESETS)) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: name });
    button.addEventListener("click", () => choose(preset));
    $("presets").append(button);
  }
  for (const hours of [0.5, 1, 2, 5, 10, 20]) $("speed").add(new Option(`${hours} h per second`, hours, hours === 2, hours === 2));
  const shown = { mature: "mature", zone: "growth zone", d1: "director d1", d2: "director d2", pile: "piles of statoliths", trace: "path of the tip", force: "force of the hand" };
  for (const [name, words] of Object.entries(shown)) {
    const item = document.createElement("span"), swatch = document.createElement("i");
    swatch.style.background = COLOURS[name];
    item.append(swatch, words);
    $("legend").append(item);
  }
  $("play").addEventListener("click", () => run(!playing));
  $("restart").addEventListener("click", () => { restart(); draw(); });
  $("pushx").addEventListener("click", () => shove(0));
  $("pushy").addEventListener("click", () => shove(1));
  $("reset").addEventListener("click", () => view.reset());
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target.closest("button, select")) return;
    run(!playing);
    event.preventDefault();
  });
  // The hand listens first.
  listenToHand($("view"));
  view = new View($("view"), boxAround([[0.05, 0, 0.1]]));
  view.onchange = draw;
  choose(PRESETS["video 2: growing"]);
}

// What a run of so many hours ends in, for a comparison with the same run outside of a browser.
function check(hours) {
  const go = () => { for (let i = 0; i < Math.round(30 * hours); i++) advance(120); return frame.tip; };
  restart();
  const tip = go();
  restart();
  const input = $("p1");
  input.value = 1.6;
  input.dispatchEvent(new Event("input"));
  const moved = go();
  choose(PRESETS["video 2: growing"]);
  const began = performance.now();
  for (let i = 0; i < 600; i++) advance(120);
  const perSecond = 20 / ((performance.now() - began) / 1000);
  const found = document.createElement("pre");
  found.id = "found";
  found.textContent = JSON.stringify({ tip, moved, perSecond, message: $("message").textContent });
  document.body.append(found);
}

const asked = new URLSearchParams(location.hash.slice(1));
if (asked.has("check")) {
  core = new WebAssembly.Instance(new WebAssembly.Module(bytesOfModule())).exports;
  begin();
  check(Number(asked.get("check")));
} else {
  WebAssembly.instantiate(bytesOfModule()).then(({ instance }) => {
    core = instance.exports;
    begin();
    // `#hours=20` shows the shoot at that age, at rest.
    if (asked.has("hours")) {
      for (let i = 0; i < 30 * Number(asked.get("hours")); i++) advance(120);
      if (call("live_read")) reading = numbers();
      findCritical();
      draw();
    } else if (!matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
  }).catch((error) => { $("message").textContent = `This browser cannot run the page: ${error.message}`; });
}
