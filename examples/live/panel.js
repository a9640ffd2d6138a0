// The panel of the live page: presets, sliders, and the scale of lengths.

// Numbers as in `Parameter` of shoot.rs: [number, name, unit, from, to, step].
const SLIDERS = [
  [0, "oscillator strength α", "", 0, 0.3, 0.01],
  [9, "oscillator period τe", "min", 10, 60, 0.5],
  [1, "gravitropic sensitivity β", "", 0, 3, 0.05],
  [2, "proprioceptive sensitivity η", "", 0, 60, 1],
  [4, "memory time τm", "min", 1, 40, 0.5],
  [5, "reaction time τr", "min", 1, 40, 0.5],
  [3, "growth time τg", "h", 5, 80, 1],
  [7, "Young's modulus E", "MPa", 2, 50, 0.5],
  [6, "gravity g", "m/s²", 0, 30, 0.01],
  [8, "tilt of the base", "°", -90, 90, 1],
  [19, "pole: radius, 0 for none", "mm", 0, 5, 0.25],
  [17, "pole: x", "mm", -60, 60, 0.1],
  [18, "pole: y", "mm", -60, 60, 0.1],
];
const [TILT, SENSE, PUSH, LENGTH, GROWS, KICK, POLE] = [8, 10, 11, 14, 15, 16, 17];
const USUAL = { 0: 0, 1: 0.8, 2: 20, 3: 20, 4: 12, 5: 12, 6: 9.81, 7: 10, 8: 0, 9: 24, [SENSE]: 1, [LENGTH]: 6.59, [GROWS]: 0, [KICK]: 0, [POLE]: 20, [POLE + 1]: 0, [POLE + 2]: 0 };
const PRESETS = {
  "Video 2: growing shoot": { 0: 0.2, 3: 40, [LENGTH]: 6.8, [GROWS]: 1 },
  "Video 3: weak oscillator": { 0: 0.01, 3: 40, [LENGTH]: 6.8, [GROWS]: 1 },
  "Video 4: two force pulses": { [KICK]: 1 },
  "Video 5: epitrochoid": { 0: 0.3, 9: 20, [LENGTH]: 6.565, [KICK]: 2 },
  "Video 6: hypotrochoid": { 0: 0.3, 9: 20, [LENGTH]: 6.565, [SENSE]: -1, [KICK]: 2 },
  "Weightless, no gravitropism": { 0: 0.2, 1: 0, 6: 0, [LENGTH]: 6.8 },
  "Growing shoot and a pole": { 0: 0.2, 3: 40, [LENGTH]: 6.8, [GROWS]: 1, [POLE + 2]: 2 },
  "Horizontal base": { [LENGTH]: 5, 8: 90 },
};
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20], USUAL_SPEED = 1;

// Functions that show the value of a parameter.
const outputs = {};

function row(name, ...parts) {
  const label = document.createElement("label");
  label.className = "row";
  label.append(name, ...parts);
  return label;
}

function slider([number, name, unit, from, to, step], where) {
  const input = document.createElement("input"), output = document.createElement("output");
  Object.assign(input, { type: "range", min: from, max: to, step, id: `p${number}` });
  where.append(row(name, input, output));
  outputs[number] = (value) => {
    input.value = value;
    output.textContent = `${value}${unit === "°" ? "" : " "}${unit}`;
  };
  input.addEventListener("input", () => { set(number, Number(input.value)); draw(); });
}

function checkbox(number, name, where) {
  const input = document.createElement("input");
  Object.assign(input, { type: "checkbox", id: `p${number}` });
  where.append(row(name, input));
  outputs[number] = (value) => { input.checked = value > 0; };
  input.addEventListener("change", () => { set(number, Number(input.checked)); draw(); });
}

function fillPanel() {
  SLIDERS.forEach((of) => slider(of, $("sliders")));
  slider([LENGTH, "length", "cm", 1, 12, 0.005], $("starts"));
  checkbox(GROWS, "shoot grows", $("starts"));
  for (const [name, preset] of Object.entries(PRESETS)) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: name });
    button.addEventListener("click", () => choose(preset));
    $("presets").append(button);
  }
  for (const hours of SPEEDS) $("speed").add(new Option(`${hours} h/s`, hours, hours === USUAL_SPEED, hours === USUAL_SPEED));
  for (const [name, words] of Object.entries({ ...NAMES, force: "force on the tip" })) $("legend").append(legendItem(name, words));
}

// The scale of lengths. Its marks are named in the list below it, so that no mark crosses a label.
function drawScale() {
  const canvas = $("scale"), c = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
  [canvas.width, canvas.height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
  c.scale(ratio, ratio);
  const [width, left, right] = [canvas.clientWidth, 12, 34], [buckling, onset] = critical;
  const length = frame ? frame.length : 0.1;
  const longest = 1.08 * Math.max(length, ...critical.filter(Number.isFinite), 0.05);
  const x = (metres) => left + (width - left - right) * metres / longest;
  c.font = "13px system-ui, sans-serif";
  c.fillStyle = COLOURS.text;
  c.textAlign = "center";
  for (let at = 0, step = nice(longest / 6); at <= longest; at += step) {
    c.fillRect(x(at), 24, 1, 5);
    c.fillText(`${Number((100 * at).toFixed(2))}`, x(at), 43);
  }
  c.textAlign = "right";
  c.fillText("cm", width, 29);
  c.fillRect(left, 24, width - left - right, 1);
  c.fillStyle = COLOURS.zone;
  c.fillRect(left, 15, x(length) - left, 7);
  for (const [metres, colour] of [[onset, COLOURS.trace], [buckling, COLOURS.d1]]) {
    if (!Number.isFinite(metres)) continue;
    c.fillStyle = colour;
    c.fillRect(x(metres) - 1.5, 4, 3, 20);
  }
  const named = (metres, otherwise) => (Number.isFinite(metres) ? `${(100 * metres).toFixed(2)} cm` : otherwise);
  const lines = [
    [COLOURS.zone, `length ${named(length)}`],
    [COLOURS.trace, `onset of oscillation: ${named(onset, "none")}`],
    [COLOURS.d1, `buckling of young tissue: ${named(buckling, "none")}`],
  ];
  $("lengths").replaceChildren(...lines.map(([colour, words]) => {
    const line = document.createElement("li");
    line.append(swatch(colour), words);
    return line;
  }));
}
