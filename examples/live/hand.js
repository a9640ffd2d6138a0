// The pointer on the view. It catches the tip and pulls it. The simulation slows down while the pointer approaches
// the tip.

// A press within `CATCH` of the tip catches it. The simulation is paused there, and slowed down up to the distance
// `NEAR`. Distances in CSS pixels.
const [CATCH, NEAR] = [32, 240];
// The tip is also caught at places where it was seen less than `REACTION` ago: a finger on a screen cannot approach
// it. Time in ms.
const REACTION = 600;
// A pointer that has not moved for `PATIENCE` no longer slows the simulation down, nor does any pointer for `AFTER` a
// pull. Times in ms.
const [PATIENCE, AFTER] = [3000, 1500];
// Force (µN) of a pull as long as the radius of the box, and the largest force (µN).
const [FORCE, MOST_FORCE] = [100, 40];

const hand = {
  // Pointer on the canvas in CSS pixels, the time of its last movement, and the time before which it does not slow
  // anything down.
  at: null, movedAt: -Infinity, idleUntil: -Infinity,
  // Places at which the tip was drawn: [time, x, y].
  drawn: [],
  // Where the pull began, its force (µN), and the time of the shoot at which a push by a button ends (s).
  from: null, force: null, until: null,
};

function push(force) {
  hand.force = force && Math.hypot(...force) > 0 ? force : null;
  hand.until = null;
  for (let k = 0; k < 3; k++) set(PUSH + k, force ? force[k] : 0);
}

// A push by a button: 10 µN for 12 min of the shoot's time.
function pushAlong(axis) {
  push([0, 1, 2].map((k) => (k === axis ? 10 : 0)));
  hand.until = frame.time + 720;
  run(true);
}

function tipOnCanvas() {
  return view.at(frame.tip).map((x) => x / view.ratio);
}

function distanceTo([x, y]) {
  return Math.hypot(hand.at[0] - x, hand.at[1] - y);
}

// Returns whether a press would catch the tip.
function catches() {
  if (!hand.at || !frame) return false;
  return [tipOnCanvas(), ...seen().map(([, x, y]) => [x, y])].some((place) => distanceTo(place) <= CATCH);
}

// Places at which the tip was seen recently. Each is seen until the next is drawn.
function seen() {
  const since = performance.now() - REACTION;
  return hand.drawn.filter((_, i, all) => i === all.length - 1 || all[i + 1][0] >= since);
}

// The factor by which a pointer near the tip reduces the speed of the simulation.
function pace() {
  const now = performance.now();
  if (!hand.at || hand.from || now < hand.idleUntil || now - hand.movedAt > PATIENCE) return 1;
  return Math.min(1, Math.max(0, (distanceTo(tipOnCanvas()) - CATCH) / (NEAR - CATCH)));
}

// Draws the target round the tip and the force, and selects the cursor.
function drawHand() {
  const [x, y] = tipOnCanvas(), c = view.context, hit = Boolean(hand.from) || catches();
  hand.drawn = [...seen(), [performance.now(), x, y]];
  const held = hand.from || drag.from, near = hit || hand.at && onPole(hand.at);
  view.canvas.style.cursor = held ? "grabbing" : near ? "grab" : "";
  c.beginPath();
  c.arc(view.ratio * x, view.ratio * y, view.ratio * (hit ? 18 : 12), 0, 2 * Math.PI);
  c.strokeStyle = COLOURS.force;
  c.lineWidth = view.ratio * (hit ? 3 : 1.5);
  c.stroke();
  if (!hand.force) return;
  const size = Math.hypot(...hand.force);
  view.arrow(frame.tip, hand.force.map((f) => f / size), view.radius * size / FORCE, COLOURS.force, 3);
}

function listenToHand(canvas) {
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const leave = () => { hand.at = null; };
  const letGo = () => {
    if (!hand.from) return;
    [hand.from, hand.idleUntil] = [null, performance.now() + AFTER];
    push(null);
    draw();
  };
  canvas.addEventListener("pointerdown", (event) => {
    hand.at = place(event);
    if (!catches()) return;
    event.preventDefault();
    hand.from = hand.at;
    canvas.setPointerCapture(event.pointerId);
    draw();
  }, { capture: true });
  canvas.addEventListener("pointermove", (event) => {
    // A pointer that rotates the view does not approach the tip.
    if (event.buttons && !hand.from) return leave();
    [hand.at, hand.movedAt] = [place(event), performance.now()];
    if (hand.from) {
      const per = FORCE * view.ratio / (view.scale * view.radius);
      const [across, up] = [per * (hand.at[0] - hand.from[0]), per * (hand.from[1] - hand.at[1])];
      const force = [0, 1, 2].map((k) => across * view.right[k] + up * view.up[k]);
      const part = Math.min(1, MOST_FORCE / Math.max(Math.hypot(...force), 1e-9));
      push(force.map((f) => f * part));
    }
    draw();
  });
  canvas.addEventListener("pointerleave", leave);
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, letGo);
}
