// Shows the skin of a frame as a surface, and marks the frame in the curves. Where the browser cannot, the picture stays.
(async () => {
  "use strict";
  const box = document.getElementById("skin-view");
  const data = JSON.parse(document.getElementById("track").textContent), skin = data.skin;
  const canvas = box.querySelector("canvas"), slider = box.querySelector("input[type=range]");
  const deeper = box.querySelector("input[type=checkbox]"), output = box.querySelector("output"), still = box.querySelector("[data-still]");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  if (!gl || typeof DecompressionStream === "undefined") { box.dataset.state = "picture"; return; }
  const packed = Uint8Array.from(atob(document.getElementById("skins").textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const raw = await new Response(stream).arrayBuffer();

  // places of the dome at rest, Y up, and the triangles between them
  const { around, rings } = skin, count = 1 + (rings.length - 1) * around, places = [], normals = [], corners = [];
  const node = (ring, step) => (ring === 0 ? 0 : 1 + (ring - 1) * around + (step % around));
  rings.forEach(([r, z, nr, nz], ring) => {
    for (let step = 0; step < (ring === 0 ? 1 : around); step++) {
      const [c, s] = [Math.cos(2 * Math.PI * step / around), Math.sin(2 * Math.PI * step / around)];
      places.push(r * c, z, -r * s); normals.push(nr * c, nz, -nr * s);
    }
  });
  for (let ring = 0; ring + 1 < rings.length; ring++) for (let step = 0; step < around; step++) {
    corners.push(node(ring, step), node(ring + 1, step), node(ring + 1, step + 1));
    if (ring) corners.push(node(ring, step), node(ring + 1, step + 1), node(ring, step + 1));
  }
  const view = new DataView(raw), frames = skin.frames.length;
  // depth (mm), whether it is seen, how much of it and its neighbours is touched
  const state = (index) => {
    const values = new Float32Array(3 * count), touched = new Uint8Array(raw, 2 * frames * count + index * count, count);
    const share = (k) => {
      if (k === 0) return touched[0];
      const ring = Math.floor((k - 1) / around) + 1, step = (k - 1) % around, out = Math.min(ring + 1, rings.length - 1);
      const near = [node(ring, step + 1), node(ring, step + around - 1), node(ring - 1, step), node(out, step)];
      return 0.4 * touched[k] + 0.15 * near.reduce((sum, other) => sum + touched[other], 0);
    };
    for (let k = 0; k < count; k++) {
      const height = view.getInt16(2 * (index * count + k), true), isSeen = height !== skin.unseen;
      values.set([isSeen ? -height * skin.unit_mm : 0, isSeen ? 1 : 0, share(k)], 3 * k);
    }
    return values;
  };

  const orbit = domecastOrbit(canvas, gl, () => draw(), { lift: 0.75, near: 1.3 });
  const vector = (rgb) => `vec3(${rgb.map((v) => (v / 255).toFixed(5)).join(", ")})`, color = skin.colors.map(vector);
  const program = orbit.program(`#version 300 es
    in vec3 p, n, s; uniform mat4 m; uniform float deeper; out vec3 q, v;
    void main() { q = p - n * s.x * deeper; v = s; gl_Position = m * vec4(q, 1.0); }`, `#version 300 es
    precision highp float; in vec3 q, v; uniform vec3 eye; uniform float range; out vec4 o;
    void main() {
      vec3 stops[${color.length}] = vec3[](${color.join(", ")});
      float share = clamp(v.x / range, 0.0, 1.0), at = share * ${color.length - 1}.0; int low = min(int(at), ${color.length - 2});
      vec3 deep = mix(stops[low], stops[low + 1], at - float(low));
      vec3 c = v.y > 0.999 ? mix(${vector(skin.rest_color)}, deep, min(share / ${skin.fade.toFixed(5)}, 1.0)) : vec3(0.55);
      vec3 n = normalize(cross(dFdx(q), dFdy(q)));
      float l = 0.55 + 0.45 * abs(dot(n, normalize(eye + vec3(0.3, 0.6, -0.2))));
      c = mix(c * l, vec3(1.0), 1.0 - smoothstep(0.8, 1.6, abs(v.z - 0.5) / max(fwidth(v.z), 1e-4)));
      o = vec4(c, 1.0); }`);
  const buffer = (name, values, use) => {
    const made = gl.createBuffer(), place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, made); gl.bufferData(gl.ARRAY_BUFFER, values, use);
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    return made;
  };
  buffer("p", new Float32Array(places), gl.STATIC_DRAW); buffer("n", new Float32Array(normals), gl.STATIC_DRAW);
  const states = buffer("s", state(0), gl.DYNAMIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(corners), gl.STATIC_DRAW);
  const u = Object.fromEntries(["m", "eye", "range", "deeper"].map((name) => [name, gl.getUniformLocation(program, name)]));
  const rim = Math.max(...rings.map(([r]) => r)), low = [-rim, Math.min(...rings.map(([, z]) => z)), -rim], high = [rim, rings[0][1], rim];
  const draw = () => {
    const { matrix, eye } = orbit.frame(low, high);
    gl.uniformMatrix4fv(u.m, false, matrix); gl.uniform3fv(u.eye, eye);
    gl.uniform1f(u.range, skin.range_mm); gl.uniform1f(u.deeper, deeper.checked ? 5 : 1);
    gl.drawElements(gl.TRIANGLES, corners.length, gl.UNSIGNED_INT, 0);
    box.dataset.state = "drawn " + skin.frames[slider.value];
  };

  // the frame in words, and a line through every curve where it is
  const [left, top, right, bottom] = data.plot.corners_px;
  const cursors = [...document.querySelectorAll("#curves figure .chart")].map((chart) => {
    const line = document.createElementNS(chart.namespaceURI, "line");
    line.setAttribute("class", "cursor"); line.setAttribute("y1", top); line.setAttribute("y2", bottom);
    chart.append(line);
    return line;
  });
  const number = (v, digits) => v.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
  const choose = () => {
    const index = Number(slider.value), frame = skin.frames[index], at = data.frames.indexOf(frame);
    gl.bindBuffer(gl.ARRAY_BUFFER, states); gl.bufferSubData(gl.ARRAY_BUFFER, 0, state(index));
    const words = [`Frame ${frame}`];
    if (at >= 0) words.push(data.status[at]);
    words.push(skin.depth_mm[index] > 0 ? `${number(skin.depth_mm[index], 3)} mm deep` : "nothing touches");
    if (at >= 0 && data.force_n[at]) words.push(`force ${data.force_n[at].map((v) => number(v, 2)).join(", ")} N`);
    output.textContent = words.join("; ");
    slider.setAttribute("aria-valuetext", `frame ${frame}`);
    const x = left + (frame - data.plot.first) / (data.plot.last - data.plot.first) * (right - left);
    for (const line of cursors) { line.setAttribute("x1", x); line.setAttribute("x2", x); }
    orbit.ask();
  };
  still.hidden = true;
  for (const part of box.querySelectorAll("canvas, label, output")) part.hidden = false;
  slider.addEventListener("input", choose); deeper.addEventListener("input", orbit.ask);
  choose();
})();
