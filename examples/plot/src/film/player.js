// Player of a film. The suffix `#t=2.5` of the address opens the film at 2.5 h and pauses it.
const film = JSON.parse(document.getElementById("data").textContent);
const frames = unpack(film);
const measured = film.measured.flatMap(([, places]) => places);
const all = [...frames.flatMap((frame) => frame.line), ...besidePoles(film.poles), ...measured];
const view = new View(document.getElementById("view"), boxAround(all));
const tips = frames.map((frame) => frame.line[frame.line.length - 1]);
const [play, scrub, read, speed] = ["play", "scrub", "read", "speed"].map((id) => document.getElementById(id));
const last = frames.length - 1;
let [time, playing, drawnAt] = [0, false, null];

scrub.max = last;
// Speeds in simulated hours per second.
for (const hours of [0.1, 0.25, 0.5, 1, 2, 4, 8]) {
  const chosen = hours === film.speed;
  speed.add(new Option(`${hours} h per second`, hours, chosen, chosen));
}
for (const [name, words] of Object.entries(NAMES)) {
  if (name === "pile" && !film.piles || name === "mature" && frames.every((frame) => frame.zone === 0)) continue;
  if (name === "pole" && !film.poles.length) continue;
  document.getElementById("legend").append(legendItem(name, words));
}
if (film.measured.length) document.getElementById("legend").append(legendItem("text", "measured"));

// Decodes the frames. Vectors are 16-bit numbers: positions in units of film.unit (m), unit vectors in units of
// 1/32767.
function unpack({ data, unit, points, stations, piles, times, lengths, zones }) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0)), view = new DataView(bytes.buffer);
  let at = 0;
  const vector = (scale) => [0, 0, 0].map(() => { const x = view.getInt16(at, true) * scale; at += 2; return x; });
  const many = (n, make) => Array.from({ length: n }, make), turn = 1 / 32767;
  return times.map((time, i) => ({
    time, length: lengths[i], zone: zones[i],
    line: many(points, () => vector(unit)),
    directors: many(stations, () => [vector(unit), vector(turn), vector(turn)]),
    piles: many(piles, () => [vector(unit), vector(turn)]),
  }));
}

// Returns the index of the last frame that is not later than a time (h).
function frameAt(hours) {
  let [low, high] = [0, last];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (frames[middle].time <= hours + 1e-9) low = middle; else high = middle - 1;
  }
  return low;
}

// Returns the measured places of the last time, or those of all times until now if there is one at each time.
function measuredAt(hours) {
  const past = film.measured.filter(([time]) => time <= hours + 1e-9);
  return (past.some(([, places]) => places.length > 1) ? past.slice(-1) : past).flatMap(([, places]) => places);
}

function draw() {
  const i = frameAt(time), frame = frames[i];
  view.begin();
  const spacing = view.room();
  view.trace(tips.slice(0, i + 1), frameAt(frame.time - RECENT));
  view.shoot(frame, film.poles);
  for (const place of measuredAt(frame.time)) view.dot(place, COLOURS.text, 2.5);
  scrub.value = i;
  scrub.setAttribute("aria-valuetext", `${frame.time.toFixed(2)} hours`);
  const length = (100 * frame.length).toFixed(2);
  read.textContent = `${frame.time.toFixed(2)} h · length ${length} cm · grid spacing ${distance(spacing)}`;
  play.textContent = playing ? "Pause" : "Play";
  document.body.dataset.frame = i;
}

function tick(now) {
  if (!playing) return;
  if (drawnAt !== null) time += Number(speed.value) * Math.min(0.1, (now - drawnAt) / 1000);
  drawnAt = now;
  if (time >= frames[last].time) { time = frames[last].time; playing = false; }
  draw();
  requestAnimationFrame(tick);
}

function run(on) {
  if (on === playing) return;
  if (on && time >= frames[last].time) time = frames[0].time;
  [playing, drawnAt] = [on, null];
  draw();
  if (on) requestAnimationFrame(tick);
}

function goTo(i) {
  time = frames[Math.min(last, Math.max(0, i))].time;
  draw();
}

view.onchange = draw;
play.addEventListener("click", () => run(!playing));
scrub.addEventListener("input", () => { run(false); goTo(Number(scrub.value)); });
document.getElementById("reset").addEventListener("click", () => view.reset());
document.addEventListener("keydown", (event) => {
  // Keys for a focused button or list are left to that element.
  const own = event.target.closest && event.target.closest("button, select");
  const step = event.shiftKey ? 10 : 1;
  if (event.key === " " && !own) run(!playing);
  else if (event.key === "ArrowLeft" && !own) { run(false); goTo(frameAt(time) - step); }
  else if (event.key === "ArrowRight" && !own) { run(false); goTo(frameAt(time) + step); }
  else if (event.key === "Home" && !own) { run(false); goTo(0); }
  else if (event.key === "End" && !own) { run(false); goTo(last); }
  else if ((event.key === "r" || event.key === "R") && !own) view.reset();
  else if (event.key === "+" || event.key === "-") {
    speed.selectedIndex = Math.min(speed.length - 1, Math.max(0, speed.selectedIndex + (event.key === "+" ? 1 : -1)));
  } else return;
  event.preventDefault();
});

const requested = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? NaN);
if (Number.isFinite(requested)) time = Math.min(frames[last].time, Math.max(frames[0].time, requested));
draw();
// The film does not start automatically if reduced motion is preferred or a time is given in the address.
if (!Number.isFinite(requested) && !matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
