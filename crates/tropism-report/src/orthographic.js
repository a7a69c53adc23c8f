"use strict";
/* Scenes that the reader turns, by orthographic projection. The law is that of orthographic.rs. Nothing is loaded: the scene
   stands in the page as JSON, with lengths in cm. No character opens a tag here, so that the page stays well-formed. */

for (const place of document.querySelectorAll(".turnable")) show(place);

function show(place) {
  const scene = JSON.parse(place.querySelector("script").textContent);
  const svg = place.querySelector("svg");
  const state = place.querySelector("output");
  const [MOST, LEAST] = [20, 0.2];
  const START = { azimuth: 30, elevation: 20, zoom: 1 };
  const VIEWS = {
    front: { azimuth: 0, elevation: 0 },
    side: { azimuth: 90, elevation: 0 },
    above: { azimuth: 0, elevation: 90 },
    reset: START,
  };
  let view = { ...START };
  let size = [900, 480];

  const made = (name, parent) => parent.appendChild(document.createElementNS(svg.namespaceURI, name));
  const between = (least, value, most) => Math.min(Math.max(value, least), most);
  /* Elements are made once and set anew in each picture, in the order of their depth. */
  const layers = ["ground", "things", "marks"].map(() => made("g", svg));
  const [ground, things, marks] = layers.map((layer) => {
    const pools = { path: [], text: [] };
    const used = { path: 0, text: 0 };
    return {
      begin: () => (used.path = used.text = 0),
      next(name, kind) {
        const index = used[name]++;
        pools[name][index] ??= made(name, layer);
        pools[name][index].setAttribute("class", kind);
        return pools[name][index];
      },
      end() {
        for (const name in pools)
          pools[name].forEach((element, index) => (element.style.display = used[name] > index ? "" : "none"));
      },
    };
  });

  /* What is sorted by depth: pieces of lines, areas and discs, each with a place that tells its depth. */
  const pieces = scene.lines.flatMap((line) =>
    line.points.slice(1).map((to, index) => ({ line, from: line.points[index], to, at: middle(line.points[index], to) })),
  );
  const solids = [
    ...scene.outlines.map((points) => ({ points, at: points.reduce(middle) })),
    ...scene.poles.map((pole) => ({ pole, at: [pole.at[0], 0, pole.at[1]] })),
  ];
  const spots = [
    { at: scene.ends[0], kind: "start", radius: 3.5 },
    { at: scene.ends[1], kind: "fill best", radius: 4 },
    ...scene.targets.map((at, index) => ({ at, kind: "stroke target", number: index + 1 })),
  ];

  function middle(one, other) {
    return one.map((value, axis) => (value + other[axis]) / 2);
  }

  function draw() {
    const [width, height] = size;
    const [azimuth, elevation] = [view.azimuth, view.elevation].map((degrees) => (degrees * Math.PI) / 180);
    const [sinA, cosA, sinE, cosE] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    const scale = (view.zoom * (Math.min(width, height) / 2 - 14)) / scene.radius;
    const near = ([x, , z]) => x * sinA + z * cosA;
    const project = ([x, y, z]) => [
      x * cosA - z * sinA,
      y * cosE - (x * sinA + z * cosA) * sinE,
      y * sinE + (x * sinA + z * cosA) * cosE,
    ];
    const centre = project(scene.centre);
    const seen = (point) => {
      const [right, up] = project(point);
      return [width / 2 + scale * (right - centre[0]), height / 2 - scale * (up - centre[1])];
    };
    /* From 0 far away to 1 near: near lines are wider and stronger. */
    const nearness = (point) => between(0, 0.5 + (project(point)[2] - centre[2]) / (2 * scene.radius), 1);
    const text = ([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`;
    const path = (points) => "M" + points.map((point) => text(seen(point))).join("L");
    const put = (layer, kind, d, strokeWidth = "", opacity = "") => {
      const element = layer.next("path", kind);
      element.setAttribute("d", d);
      element.style.strokeWidth = strokeWidth;
      element.style.opacity = opacity;
    };
    const write = (layer, kind, [x, y], words, anchor = "middle") => {
      const element = layer.next("text", kind);
      element.setAttribute("x", x.toFixed(1));
      element.setAttribute("y", y.toFixed(1));
      element.setAttribute("text-anchor", anchor);
      element.textContent = words;
    };
    const disc = ([x, y], radius) =>
      `M${text([x - radius, y])}a${radius} ${radius} 0 1 0 ${2 * radius} 0a${radius} ${radius} 0 1 0 ${-2 * radius} 0z`;

    for (const layer of [ground, things, marks]) layer.begin();

    const [half, step] = scene.soil;
    const count = Math.round(half / step);
    const places = Array.from({ length: 2 * count + 1 }, (_, index) => (index - count) * step);
    const lines = places.flatMap((at) => [path([[at, 0, -half], [at, 0, half]]), path([[-half, 0, at], [half, 0, at]])]);
    put(ground, "stroke grid", lines.join(""));
    for (const lamp of scene.lamps) {
      const [x, z] = lamp.towards.map((share) => 1.12 * half * share);
      const at = seen([x, 0, z]);
      put(ground, "fill " + lamp.class, disc(at, 4));
      write(marks, "tick halo", [at[0], at[1] + 17], lamp.name);
    }
    for (const target of scene.targets) put(ground, "stroke grid dotted", path([target, [target[0], 0, target[2]]]));

    const all = [...pieces, ...solids, ...spots];
    const depths = new Map(all.map((thing) => [thing, near(thing.at)]));
    all.sort((one, other) => depths.get(one) - depths.get(other));
    for (const thing of all) {
      const share = nearness(thing.at);
      if (thing.line) {
        const width = (thing.line.width * (0.65 + 0.7 * share)).toFixed(2);
        put(things, "stroke " + thing.line.class, path([thing.from, thing.to]), width, (0.4 + 0.6 * share).toFixed(2));
      } else if (thing.pole) {
        pole(thing.pole);
      } else if (thing.points) {
        put(things, "fill dark faint", path(thing.points));
        put(things, "stroke thin dark", path(thing.points));
      } else if (thing.number) {
        const [x, y] = seen(thing.at);
        const arm = 3.5 + 3 * share;
        const ends = [[-1, -1], [1, 1], [-1, 1], [1, -1]].map(([dx, dy]) => text([x + arm * dx, y + arm * dy]));
        put(things, thing.kind, `M${ends[0]}L${ends[1]}M${ends[2]}L${ends[3]}`, 2);
        write(marks, "mark halo target", [x, y - 10], String(thing.number));
      } else {
        put(things, thing.kind, disc(seen(thing.at), thing.radius));
      }
    }

    function pole({ at: [x, z], radius_cm, height_cm }) {
      const radius = radius_cm * scale;
      const arc = `A${radius.toFixed(2)} ${(radius * Math.abs(sinE)).toFixed(2)} 0 0 0 `;
      const [foot, top] = [seen([x, 0, z]), seen([x, height_cm, z])];
      const edge = ([across, up], side) => text([across + side * radius, up]);
      const rim = `M${edge(top, -1)}${arc}${edge(top, 1)}`;
      const body = `M${edge(foot, -1)}${arc}${edge(foot, 1)}L${edge(top, 1)}${arc}${edge(top, -1)}z`;
      put(things, "fill dark faint", body);
      put(things, "stroke thin dark faint", body + rim);
    }

    scaleBar(scale, [16, height - 16]);
    for (const [axis, name] of ["x", "y", "z"].entries()) {
      const arm = project([0, 1, 2].map((other) => (other === axis ? 22 : 0)));
      const [x, y] = [width - 46, height - 40];
      put(marks, "axis stroke", `M${text([x, y])}L${text([x + arm[0], y - arm[1]])}`);
      if (Math.hypot(arm[0], arm[1]) > 6) write(marks, "tick", [x + 1.4 * arm[0], y - 1.4 * arm[1] + 4], name);
    }
    for (const layer of [ground, things, marks]) layer.end();

    function scaleBar(pixels, [x, y]) {
      const lengths = [0.01, 0.1, 1, 10, 100, 1000].flatMap((power) => [power, 2 * power, 5 * power]);
      const length = lengths.findLast((cm) => 110 >= cm * pixels) ?? lengths[0];
      const right = x + length * pixels;
      put(marks, "axis stroke", `M${text([x, y - 4])}L${text([x, y])}L${text([right, y])}L${text([right, y - 4])}`, 1.5);
      write(marks, "label", [(x + right) / 2, y - 7], `${Number(length.toPrecision(1))} cm`);
    }

    const turned = Math.round(((((view.azimuth + 180) % 360) + 360) % 360) - 180);
    const side = 0 > turned ? "left" : "right";
    const words = `${Math.abs(turned)}\u00b0 to the ${side} of the front camera, ${Math.round(view.elevation)}\u00b0 above the horizontal`;
    state.textContent = words;
    svg.setAttribute("aria-label", `${svg.dataset.title}: ${words}`);
  }

  let waits = false;
  function change(next) {
    view = { ...view, ...next };
    view.elevation = between(0, view.elevation, 90);
    view.zoom = between(LEAST, view.zoom, MOST);
    if (waits) return;
    waits = true;
    requestAnimationFrame(() => {
      waits = false;
      draw();
    });
  }
  const turn = (right, up) => change({ azimuth: view.azimuth + right, elevation: view.elevation + up });
  const magnify = (factor) => change({ zoom: view.zoom * factor });

  /* A finger that begins sideways turns the scene; one that begins up or down scrolls the page (`touch-action`). */
  const pointers = new Map();
  const spread = () => {
    const [one, other] = [...pointers.values()];
    return Math.hypot(one[0] - other[0], one[1] - other[1]);
  };
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  svg.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const apart = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (apart > 0) magnify(spread() / apart);
    else if (pointers.size === 1) turn(-0.5 * (event.clientX - before[0]), 0.5 * (event.clientY - before[1]));
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
    svg.addEventListener(end, (event) => pointers.delete(event.pointerId));

  /* The wheel scrolls the page until the scene has the focus. */
  svg.addEventListener(
    "wheel",
    (event) => {
      if (document.activeElement !== svg && !event.ctrlKey) return;
      event.preventDefault();
      magnify(Math.exp(-0.0015 * event.deltaY));
    },
    { passive: false },
  );
  const keys = {
    ArrowLeft: () => turn(-5, 0),
    ArrowRight: () => turn(5, 0),
    ArrowUp: () => turn(0, 5),
    ArrowDown: () => turn(0, -5),
    "+": () => magnify(1.2),
    "=": () => magnify(1.2),
    "-": () => magnify(1 / 1.2),
    0: () => change(START),
  };
  svg.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  place.addEventListener("click", (event) => {
    const asked = event.target.dataset?.view;
    if (asked === "nearer") magnify(1.2);
    else if (asked === "farther") magnify(1 / 1.2);
    else if (VIEWS[asked]) change(VIEWS[asked]);
  });

  place.hidden = false;
  new ResizeObserver(() => {
    const width = svg.clientWidth || size[0];
    size = [width, Math.round(between(320, 0.6 * width, 500))];
    svg.setAttribute("viewBox", `0 0 ${size[0]} ${size[1]}`);
    draw();
  }).observe(svg);
}
