// The live page: calls of the WebAssembly module, the loop in time, and the readout.
// `#check=2` in the address simulates 2 h in steps of 2 min, without drawing, and writes the results into the page.

// Longest trace that is drawn, in points, and the smallest time between two of them, s.
const [LONGEST, SPACING] = [4000, 30];
// Smaller motion of the tip is rounding, m.
const REST = 1e-5;
// Longest part of a frame between two points of the trace, s.
const PART = 60;
// Radius of the shoot, and gap below which it touches the pole in the check, m.
const [SHOOT, TOUCH] = [5e-4, 1e-6];

const $ = (id) => document.getElementById(id);
let core = null, view = null, frame = null, critical = [Infinity, Infinity];
let [playing, drawnAt, trace, reading, readAt] = [false, null, [], [0, 0, 0], 0];

function bytesOfModule() {
  return expand(Uint8Array.from(atob($("wasm").textContent), (c) => c.charCodeAt(0)), Number($("wasm").dataset.size));
}

// Inverse of `compressed` in compress.rs, for a result of a known size.
function expand(from, size) {
  const to = new Uint8Array(size);
  let [i, at] = [0, 0];
  const length = (short) => {
    let sum = short;
    for (let more = short === 15; more; i++) { sum += from[i]; more = from[i] === 255; }
    return sum;
  };
  while (i < from.length) {
    const token = from[i++], count = length(token >> 4);
    to.set(from.subarray(i, i + count), at);
    [i, at] = [i + count, at + count];
    if (i >= from.length) break;
    const distance = from[i] + 256 * from[i + 1];
    i += 2;
    for (let left = length(token & 15) + 4; left > 0; left--, at++) to[at] = to[at - distance];
  }
  return to;
}

// Calls the module. If it fails, the message is shown, the simulation is stopped, and false is returned.
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
  const all = numbers(), [time, length, zone] = all, tip = all.slice(3, 6);
  const [x, y, radius, points, stations, piles] = all.slice(6, 12);
  let at = 12;
  const vector = () => all.slice(at, at += 3), many = (n, make) => Array.from({ length: n }, make);
  frame = {
    time, length, zone, tip,
    poles: radius > 0 ? [[[x, y, 0], [0, 0, 1], radius]] : [],
    line: many(points, vector),
    directors: many(stations, () => [vector(), vector(), vector()]),
    piles: many(piles, () => [vector(), vector()]),
  };
}

function set(number, value) {
  const done = call("live_set", number, value);
  if (outputs[number]) outputs[number](value);
  // The critical lengths are computed a moment after the last change.
  if (done && number < PUSH) { clearTimeout(set.later); set.later = setTimeout(findCritical, 200); }
  return done;
}

function value(number) {
  return core.live_get(number) ? NaN : numbers()[0];
}

function findCritical() {
  if (call("live_critical")) critical = numbers();
  drawScale();
}

function restart() {
  push(null);
  const done = call("live_restart");
  [trace, reading, hand.drawn] = [[], [0, 0, 0], []];
  look();
  if (!done || !frame) return;
  const reach = frame.length * (value(GROWS) > 0 ? 1.4 : 1.02);
  view.setBox(boxAround([...besidePoles(frame.poles), [0.62 * reach, 0, reach], [0, 0, value(TILT) === 0 ? 0 : -0.4 * reach]]));
  drawScale();
}

function choose(preset) {
  Object.entries({ ...USUAL, ...preset }).forEach(([number, x]) => set(Number(number), x));
  restart();
  draw();
}

// Simulates so many seconds, in parts short enough for a smooth trace.
function advance(seconds) {
  const parts = Math.ceil(seconds / PART), began = frame.time;
  for (let i = 1; i <= parts; i++) {
    const time = began + seconds * i / parts;
    if (!call("live_advance", seconds / parts)) return false;
    if (!trace.length || time >= trace[trace.length - 1][1] + SPACING) {
      call("live_tip");
      trace.push([numbers(), time]);
    }
    if (hand.until !== null && time >= hand.until) push(null);
  }
  if (trace.length > LONGEST) trace.splice(0, trace.length - LONGEST);
  look();
  follow();
  return true;
}

// Enlarges the box where the shoot would leave it.
function follow() {
  const needed = boxAround([...frame.line, ...besidePoles(frame.poles)]), box = view.box.map(([lo, hi], k) => [Math.min(lo, needed[k][0]), Math.max(hi, needed[k][1])]);
  if (box.flat().some((x, i) => x !== view.box.flat()[i])) view.setBox(box);
}

function tick(now) {
  if (!playing) return;
  if (drawnAt !== null && now > drawnAt) {
    const seconds = 3600 * Number($("speed").value) * pace() * Math.min(0.1, (now - drawnAt) / 1000);
    if (seconds > 0) advance(seconds);
  }
  drawnAt = now;
  if (now - readAt > 1000) { if (call("live_read")) reading = numbers(); readAt = now; }
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
  const spacing = view.room(), path = [...trace.map(([tip]) => tip), frame.tip];
  view.trace(path, Math.max(0, trace.findIndex(([, time]) => time >= frame.time - 3600 * RECENT)));
  view.shoot(frame, frame.poles);
  drawHand();
  const parts = [`${(frame.time / 3600).toFixed(1)} h`, `length ${(100 * frame.length).toFixed(2)} cm`, motion(), `grid ${distance(spacing)}`];
  $("read").textContent = parts.join(" · ");
  const near = playing && pace() < 1 ? (pace() > 0 ? "slowed down" : "paused at the tip: press and drag to pull it") : "";
  $("hint").textContent = hand.force ? `force ${Math.hypot(...hand.force).toFixed(0)} µN` : near;
}

// Describes the motion of the tip in words.
function motion() {
  const [period, major, minor] = reading;
  if (period > 0 && major > REST) {
    const sense = Math.abs(minor) < 0.01 * major ? "planar" : minor > 0 ? "counterclockwise" : "clockwise";
    return `period ${(period / 60).toFixed(1)} min, semi-axes ${(1e3 * major).toPrecision(3)} and ${(1e3 * Math.abs(minor)).toFixed(major < 1e-3 ? 2 : 1)} mm, ${sense}`;
  }
  const recent = trace.filter(([, time]) => time >= frame.time - 3600 * RECENT).map(([tip]) => tip);
  if (recent.length < 2) return "no motion recorded yet";
  const sides = [0, 1, 2].map((k) => Math.max(...recent.map((tip) => tip[k])) - Math.min(...recent.map((tip) => tip[k])));
  const range = Math.hypot(...sides), hours = Math.min(RECENT, (frame.time - trace[0][1]) / 3600);
  return range < REST ? "tip at rest" : `no period found, tip moved by ${Number((1e3 * range).toPrecision(2))} mm in ${hours.toFixed(1)} h`;
}

function begin() {
  fillPanel();
  $("help").open = window.innerWidth >= 1000 && window.innerHeight >= 600;
  $("play").addEventListener("click", () => run(!playing));
  $("restart").addEventListener("click", () => { restart(); draw(); });
  $("pushx").addEventListener("click", () => pushAlong(0));
  $("pushy").addEventListener("click", () => pushAlong(1));
  $("reset").addEventListener("click", () => view.reset());
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target.closest("button, select, summary, input")) return;
    run(!playing);
    event.preventDefault();
  });
  // The hand and the pole receive events before the view, and may take them.
  listenToHand($("view"));
  listenToPole($("view"));
  view = new View($("view"), boxAround([[0.05, 0, 0.1]]));
  view.onchange = draw;
  choose(Object.values(PRESETS)[0]);
}

// Smallest gap between the pole and 41 places of the shoot, m.
function gap() {
  const [[[x, y], , radius]] = frame.poles;
  return Math.min(...frame.line.map((p) => Math.hypot(p[0] - x, p[1] - y))) - radius - SHOOT;
}

// Lets a shoot grow beside the pole until they touch. Returns the smallest gap in the following hour (m), the number of
// frames of one minute that are simulated and drawn in a second, and the time of the first contact (h).
function meetPole() {
  choose({ ...PRESETS["Growing shoot and a pole"], [POLE]: 5 });
  for (let i = 0; i < 1440 && gap() > TOUCH; i++) advance(60);
  const began = performance.now();
  let least = gap();
  for (let i = 0; i < 60; i++) { advance(60); draw(); least = Math.min(least, gap()); }
  return { gap: least, framesPerSecond: 60000 / (performance.now() - began), metAt: frame.time / 3600 - 1 };
}

// Writes the tip after a number of hours, for a comparison with a run outside a browser, the speed, and the gap at a pole.
function check(hours) {
  const go = () => { for (let i = 0; i < Math.round(30 * hours); i++) advance(120); return frame.tip; };
  restart();
  const tip = go();
  restart();
  const input = $("p1");
  input.value = 1.6;
  input.dispatchEvent(new Event("input"));
  const moved = go();
  choose(Object.values(PRESETS)[0]);
  const began = performance.now();
  for (let i = 0; i < 600; i++) advance(120);
  const perSecond = 20 / ((performance.now() - began) / 1000);
  const found = document.createElement("pre");
  found.id = "found";
  found.textContent = JSON.stringify({ tip, moved, perSecond, ...meetPole(), message: $("message").textContent });
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
    // `#hours=20` shows the shoot at that age, paused.
    if (asked.has("hours")) {
      for (let i = 0; i < 30 * Number(asked.get("hours")); i++) advance(120);
      if (call("live_read")) reading = numbers();
      findCritical();
      draw();
    } else if (!matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
  }).catch((error) => { $("message").textContent = `This browser cannot run the page: ${error.message}`; });
}
