// Shows the assembly (a GLB that stands in the page) and pulls it apart. Without WebGL 2 the pictures stay.
(() => {
  "use strict";
  const box = document.getElementById("viewer");
  if (!box) return;
  const canvas = box.querySelector("canvas"), slider = box.querySelector("input[type=range]");
  const still = box.querySelector("[data-still]"), hide = box.querySelector("fieldset");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  const stills = still.querySelectorAll("img");
  const showStill = () => stills.forEach((img, i) => { img.hidden = (slider.value > 50 ? 1 : 0) !== i; });
  if (!gl) {
    canvas.hidden = true; hide.hidden = true; box.dataset.state = "pictures";
    slider.addEventListener("input", showStill); showStill();
    return;
  }
  still.hidden = true;

  const raw = Uint8Array.from(atob(document.getElementById("assembly").textContent.trim()), (c) => c.charCodeAt(0));
  const view = new DataView(raw.buffer), textSize = view.getUint32(12, true);
  const gltf = JSON.parse(new TextDecoder().decode(raw.subarray(20, 20 + textSize)));
  const binary = 20 + textSize + 8;
  const read = (accessor, Kind, width) => {
    const a = gltf.accessors[accessor], v = gltf.bufferViews[a.bufferView];
    return new Kind(raw.buffer.slice(binary + (v.byteOffset || 0), binary + (v.byteOffset || 0) + a.count * width * Kind.BYTES_PER_ELEMENT));
  };
  const shifts = gltf.scenes.map((scene) => {
    const found = {};
    const walk = (index) => {
      const node = gltf.nodes[index];
      if (node.mesh !== undefined) found[node.mesh] = node.translation || [0, 0, 0];
      (node.children || []).forEach(walk);
    };
    scene.nodes.forEach(walk);
    return found;
  });

  const compile = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `#version 300 es
    in vec3 p; uniform mat4 m; uniform vec3 shift; out vec3 q;
    void main() { q = p + shift; gl_Position = m * vec4(q, 1.0); }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; in vec3 q; uniform vec4 color; uniform vec3 eye; out vec4 o;
    void main() { vec3 n = normalize(cross(dFdx(q), dFdy(q)));
      float l = 0.35 + 0.5 * abs(dot(n, normalize(eye))) + 0.15 * max(0.0, n.y);
      o = vec4(pow(color.rgb, vec3(1.0 / 2.2)) * l, color.a); }`));
  gl.linkProgram(program); gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const u = { m: at("m"), shift: at("shift"), color: at("color"), eye: at("eye") };

  let low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
  const families = new Map();
  const items = gltf.meshes.map((mesh, index) => {
    const part = mesh.primitives[0], box3 = gltf.accessors[part.attributes.POSITION];
    for (let k = 0; k < 3; k++) {
      for (const s of shifts) {
        low[k] = Math.min(low[k], box3.min[k] + s[index][k]); high[k] = Math.max(high[k], box3.max[k] + s[index][k]);
      }
    }
    const vertices = gl.createVertexArray(); gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, read(part.attributes.POSITION, Float32Array, 3), gl.STATIC_DRAW);
    const place = gl.getAttribLocation(program, "p");
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, read(part.indices, Uint32Array, 1), gl.STATIC_DRAW);
    const family = mesh.name.replace(/[\s\d]+$/, "").replace(/^(upper|lower) (magnet).*/, "$2").replace(/_/g, " ");
    if (!families.has(family)) families.set(family, true);
    return { vertices, count: gltf.accessors[part.indices].count, family, index,
      color: gltf.materials[part.material].pbrMetallicRoughness.baseColorFactor };
  });
  for (const family of families.keys()) {
    const label = document.createElement("label"), tick = document.createElement("input");
    tick.type = "checkbox"; tick.checked = true;
    tick.addEventListener("change", () => { families.set(family, tick.checked); ask(); });
    label.append(tick, " " + family); hide.append(label);
  }

  let turn = 0.7, lift = 0.35, near = 1, asked = false;
  const draw = () => {
    asked = false;
    const wide = canvas.clientWidth, tall = canvas.clientHeight, dense = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, wide * dense); canvas.height = Math.max(1, tall * dense);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT); gl.enable(gl.DEPTH_TEST);
    const pull = slider.value / 100;
    const mid = low.map((v, k) => (v + high[k]) / 2);
    const size = Math.hypot(...low.map((v, k) => high[k] - v)) * 0.5 / near;
    const [ct, st, cl, sl] = [Math.cos(turn), Math.sin(turn), Math.cos(lift), Math.sin(lift)];
    const right = [ct, 0, -st], up = [-st * sl, cl, -ct * sl], eye = [st * cl, sl, ct * cl];
    const aspect = wide / tall, fx = aspect > 1 ? 1 / (size * aspect) : 1 / size, fy = aspect > 1 ? 1 / size : aspect / size;
    const line = (axis, f) => axis.map((a) => a * f), dot = (a) => a[0] * mid[0] + a[1] * mid[1] + a[2] * mid[2];
    const r = line(right, fx), t = line(up, fy), d = line(eye, -0.25 / size);
    const m = new Float32Array([r[0], t[0], d[0], 0, r[1], t[1], d[1], 0, r[2], t[2], d[2], 0, -dot(r), -dot(t), -dot(d), 1]);
    gl.uniformMatrix4fv(u.m, false, m); gl.uniform3fv(u.eye, eye);
    const shown = items.filter((item) => families.get(item.family));
    for (const clear of [false, true]) {
      (clear ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(!clear);
      for (const item of shown.filter((i) => (i.color[3] < 1) === clear)) {
        const [a, b] = [shifts[0][item.index], (shifts[1] || shifts[0])[item.index]];
        gl.uniform3fv(u.shift, a.map((v, k) => v + pull * (b[k] - v)));
        gl.uniform4fv(u.color, item.color);
        gl.bindVertexArray(item.vertices);
        gl.drawElements(gl.TRIANGLES, item.count, gl.UNSIGNED_INT, 0);
      }
    }
    gl.depthMask(true);
    box.dataset.state = "drawn " + Math.round(pull * 100);
  };
  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(draw); } };
  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    turn -= (e.clientX - held[0]) * 0.01; lift = Math.max(-1.5, Math.min(1.5, lift + (e.clientY - held[1]) * 0.01));
    held = [e.clientX, e.clientY]; ask();
  });
  canvas.addEventListener("keydown", (e) => {
    const move = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (move) { turn += move[0]; lift = Math.max(-1.5, Math.min(1.5, lift + move[1])); }
    else if (e.key === "+" || e.key === "=") near = Math.min(8, near * 1.15);
    else if (e.key === "-") near = Math.max(0.5, near / 1.15);
    else return;
    e.preventDefault(); ask();
  });
  slider.addEventListener("input", ask);
  window.addEventListener("resize", ask);
  ask();
})();
