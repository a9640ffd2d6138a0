// A simulated user of the live page, who tries to catch the tip and to pull it. The check appends this script to the
// page.
//
// The script replaces the clock and the frames of the page, so that the result does not depend on the speed of the
// machine. A try: some hours pass, then a random time with the pointer anywhere on the view. The user then observes
// the tip. The pointer remains where it is for 100 ms, moves to the observed position in 150 ms, and is pressed
// there. The tip is caught if the press and the drag that follows result in a force.
(() => {
  const [TRIES, FRAME, REST, MOVE] = [20, 1000 / 60, 100, 150];
  let now = performance.now(), next = null, seed = 1;
  performance.now = () => now;
  window.requestAnimationFrame = (callback) => { next = callback; };
  const canvas = document.getElementById("view"), box = canvas.getBoundingClientRect();
  // Lehmer's generator; numbers between 0 and 1.
  const random = () => (seed = seed * 48271 % 2147483647) / 2147483647;
  const pass = (ms) => {
    for (const end = now + ms; now < end - 1e-6;) {
      now += Math.min(FRAME, end - now);
      const callback = next;
      next = null;
      if (callback) callback(now);
    }
  };
  const send = (type, [x, y], buttons) => canvas.dispatchEvent(new PointerEvent(type, {
    pointerId: 1, pointerType: "mouse", clientX: box.left + x, clientY: box.top + y, buttons, bubbles: true, cancelable: true,
  }));
  // Moves the pointer with the smallest jerk, one event in each frame.
  const move = (from, to, ms) => {
    const steps = Math.ceil(ms / FRAME);
    for (let i = 1; i <= steps; i++) {
      const s = i / steps, part = s ** 3 * (10 - 15 * s + 6 * s * s);
      pass(ms / steps);
      send("pointermove", from.map((x, k) => x + part * (to[k] - x)), 0);
    }
  };
  const observe = () => view.at(frame.tip).map((x) => x / view.ratio);

  choose(Object.values(PRESETS)[0]);
  run(true);
  let caught = 0, pointer = [0.5 * box.width, 0.5 * box.height], farthest = 0;
  for (let i = 0; i < TRIES; i++) {
    advance(3600 * 4 * random());
    const away = [random() * box.width, random() * box.height];
    move(pointer, away, 200);
    // Nothing slows the simulation down before the user observes the tip.
    canvas.dispatchEvent(new PointerEvent("pointerleave"));
    pass(500 + 500 * random());
    const seen = observe();
    pass(REST);
    move(away, seen, MOVE);
    const tip = observe();
    farthest = Math.max(farthest, Math.hypot(tip[0] - seen[0], tip[1] - seen[1]));
    send("pointerdown", seen, 1);
    pointer = [seen[0] + 60, seen[1]];
    send("pointermove", pointer, 1);
    pass(100);
    if (hand.force && canvas.style.cursor === "grabbing") caught++;
    send("pointerup", pointer, 0);
    if (hand.force) throw new Error("the force remains after the pointer is released");
  }
  const found = document.createElement("pre");
  found.id = "caught";
  found.textContent = JSON.stringify({ caught, tries: TRIES, hours: frame.time / 3600, farthest });
  document.body.append(found);
})();
