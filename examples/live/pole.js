// The pointer on the pole, which it drags over the floor into the path of the shoot.

// Pointer (CSS pixels) and place of the pole (m) at the start of a drag.
const drag = { from: null, place: null };
// Largest coordinate of the pole along x and y, mm, and the smallest half-width of the region that selects it, CSS pixels.
const [FAR, NEAR_POLE] = [60, 8];

// Whether a pointer is on the pole.
function onPole([x, y]) {
  if (!frame || !frame.poles.length) return false;
  const [[px, py], , radius] = frame.poles[0];
  const [a, b] = view.box[2].map((z) => view.at([px, py, z]).map((v) => v / view.ratio));
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]], square = Math.max(1e-9, dx * dx + dy * dy);
  const share = Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / square));
  const far = Math.hypot(x - a[0] - share * dx, y - a[1] - share * dy);
  return far < Math.max(NEAR_POLE, view.scale * radius / view.ratio);
}

// Requests the place under the pointer. Motion across the view is along its horizontal axis, and motion upwards is away
// from the eye; at low elevations a limit keeps it finite.
function movePole(at) {
  const scale = view.ratio / view.scale, [a, e] = [view.azimuth, view.elevation].map((angle) => angle * Math.PI / 180);
  const across = scale * (at[0] - drag.from[0]), away = scale * (drag.from[1] - at[1]) / Math.max(0.25, Math.sin(e));
  const move = [-across * Math.sin(a) - away * Math.cos(a), across * Math.cos(a) - away * Math.sin(a)];
  const place = move.map((by, k) => drag.place[k] + by);
  place.forEach((x, k) => set(POLE + k, Math.min(FAR, Math.max(-FAR, Math.round(1e4 * x) / 10))));
}

function listenToPole(canvas) {
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (event.defaultPrevented || !onPole(place(event))) return;
    event.preventDefault();
    [drag.from, drag.place] = [place(event), frame.poles[0][0]];
    canvas.setPointerCapture(event.pointerId);
    // The pole moves while time passes.
    run(true);
  }, { capture: true });
  canvas.addEventListener("pointermove", (event) => { if (drag.from) movePole(place(event)); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { drag.from = null; });
}
